"""Access to files and folders: what may be opened, size limits, safe paths, and writing completely or not at all."""
