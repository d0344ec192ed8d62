"""Pictures in files: PNG, JPEG, TIFF, EXR, video."""
