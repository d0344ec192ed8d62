"""Numbers in files: NumPy, MATLAB, HDF5, zip archives, texts."""
