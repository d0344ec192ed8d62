"""Reads and writes files: pictures, depth, cameras, poses, frames, sequences, films. No GL here."""
