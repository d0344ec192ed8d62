"""Finds out which files of a folder belong together."""
