"""Reads arrays of numbers from files: NumPy, MATLAB, HDF5, zip archives, text."""
