"""Estimates on the CPU, from small arrays: depth noise, a photograph's light, floors, wrong poses."""
