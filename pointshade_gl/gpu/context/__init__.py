"""The OpenGL context: ours or the caller's, with its state and its driver."""
