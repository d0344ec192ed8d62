"""The data model: frames, cameras, lights, meshes, their appearance and views of them. Plain values: no GL, no
files."""
