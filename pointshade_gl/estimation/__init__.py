"""Estimates on the CPU, from small arrays: depth noise, the light in a photograph, highlights, floors, and wrong
poses."""
