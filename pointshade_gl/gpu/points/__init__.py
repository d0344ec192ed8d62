"""Points drawn as splats: rasterisers, rims, sets of frames, tiles."""
