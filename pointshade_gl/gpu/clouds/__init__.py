"""Point clouds: their normals, and how they are drawn."""
