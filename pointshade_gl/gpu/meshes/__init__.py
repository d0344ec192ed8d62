"""Triangles: meshes, and frames that are drawn as meshes."""
