"""Frames and sequences, put together from their files."""
