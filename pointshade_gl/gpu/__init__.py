"""The passes on the GPU: the only modules that import moderngl."""
