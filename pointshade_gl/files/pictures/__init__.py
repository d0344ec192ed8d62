"""Reads and writes image files: PNG, JPEG, TIFF, EXR, video."""
