"""Points drawn as splats: rasterisers, outlines (rims), several frames of one object, and tiles of large frames."""
