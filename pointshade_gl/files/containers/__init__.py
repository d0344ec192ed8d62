"""Reads files that bring depth together with colour, camera, pose or mask, for one frame or for many."""
