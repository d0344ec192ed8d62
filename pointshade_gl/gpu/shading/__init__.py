"""Lighting: the lights as shaders read them, shadow maps, and the light pass."""
