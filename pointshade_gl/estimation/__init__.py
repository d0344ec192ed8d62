"""Estimates on the CPU, from small arrays: depth noise, a photograph's light, highlights, floors, wrong poses."""
