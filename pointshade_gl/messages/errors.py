"""The package's own exceptions: for OpenGL contexts, shaders and cancelled work. All others are built-in ones."""


class ContextError(RuntimeError):
    """No usable OpenGL context: none on this machine, too old, released, or of another thread or process."""


class ShaderError(RuntimeError):
    """A shader cannot be assembled or compiled; the message names file and line."""


class Cancelled(Exception):
    """Work that its `progress` has ended by returning False: nothing is half-written, and renderers go on."""
