"""The data model: frames, cameras, lights, meshes, looks and views. Plain values: no GL, no files."""
