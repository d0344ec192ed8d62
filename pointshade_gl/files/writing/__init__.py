"""Writes films, depth, normals and point clouds."""
