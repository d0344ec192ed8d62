"""Writing films, depth, normals and point clouds."""
