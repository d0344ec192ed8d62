"""OpenGL contexts, our own or the caller's: how they are made, their state, and their driver."""
