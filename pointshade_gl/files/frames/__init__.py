"""Assembles frames and sequences from their files."""
