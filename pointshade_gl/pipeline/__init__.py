"""Draws a scene as a lit picture, step by step."""
