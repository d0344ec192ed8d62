"""Render passes and other work on the GPU: the only modules that import moderngl."""
