"""The nouns: frames, cameras, lights, meshes, how they look and from where. Plain values: no GL, no files."""
