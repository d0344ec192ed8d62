"""OpenGL contexts: made off screen, checked, and tied to the thread and process that made them."""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from typing import Any

import moderngl

from ..errors import ContextError

SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software rasterizer", "swiftshader", "microsoft basic render")
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # their numbers in malloc.h
INSTALL_HINT = "on Debian or Ubuntu: apt-get install -y libegl1 libgl1-mesa-dri"


class Context:
    """A moderngl context with its owner noted: who made it releases it, and only there it may be used.

    context  a moderngl.Context of the caller's (a window's, say), or None to make one off screen
    device   which GPU, counted by EGL; Linux only

    Raises ContextError with what to install when no OpenGL 3.3 can be had.
    """

    def __init__(self, context: moderngl.Context | None = None, device: int = 0):
        self.owned = context is None
        self.gl = _create(device) if context is None else context
        self._thread, self._process = threading.get_ident(), os.getpid()
        with self.gl:
            self.info = self.gl.info  # asked of the driver each time, and only right while current
        if self.is_software:
            _keep_freed_memory()
        if self.gl.version_code < 330:
            raise ContextError(f"OpenGL 3.3 is needed, {self.renderer} offers {self.gl.version_code / 100:.1f}")

    @property
    def renderer(self) -> str:
        """The driver's name for what draws."""
        return str(self.info["GL_RENDERER"])

    @property
    def is_software(self) -> bool:
        return any(name in self.renderer.lower() for name in SOFTWARE)

    def limits(self) -> dict[str, Any]:
        """What `pointshade info` tells."""
        info = self.info
        return {
            "vendor": info["GL_VENDOR"],
            "renderer": self.renderer,
            "version": info["GL_VERSION"],
            "largest texture": info["GL_MAX_TEXTURE_SIZE"],
            "largest point": info["GL_POINT_SIZE_RANGE"][1],
        }

    def check(self) -> None:
        """Raises ContextError outside the thread or process that made this context: there GL draws rubbish."""
        if os.getpid() != self._process:
            raise ContextError("this Renderer was made before a fork: make a new one in each process (spawn, not fork)")
        if threading.get_ident() != self._thread:
            raise ContextError("this Renderer belongs to the thread that made it: make one Renderer in each thread")

    def release(self) -> None:
        if self.owned:
            self.gl.release()


def _keep_freed_memory() -> None:
    """Asks glibc to keep up to 256 MB of freed memory for this process instead of returning it to the system.

    A software driver takes and frees about 60 MB for each picture of 300 000 points. Given back each time, that
    memory costs 15 000 page faults a picture, a quarter of the time; and the arrays of a frame and its picture, each
    mapped anew beyond 128 kB, another 1000, a tenth of it.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform.startswith("linux") else None
    if mallopt is not None:  # glibc has it, musl has not
        mallopt(M_TRIM_THRESHOLD, 256 << 20)
        mallopt(M_MMAP_THRESHOLD, 32 << 20)  # the most that it takes


def _is_there(library: str) -> bool:
    """Whether the loader finds it: quicker than find_library, which asks another process."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _create(device: int) -> moderngl.Context:
    try:
        if sys.platform.startswith("linux"):
            # EGL itself hands out all of GL: without libGL (package libgl1) its own library will do.
            libgl = next((name for name in ("libGL.so.1", "libEGL.so.1") if _is_there(name)), None)
            settings: dict[str, Any] = {
                "backend": "egl",
                "device_index": device,
                "libgl": libgl,
                "libegl": "libEGL.so.1",
            }
            return moderngl.create_context(standalone=True, require=330, **settings)
        return moderngl.create_context(standalone=True, require=330)
    except Exception as error:  # moderngl raises plain Exception, ValueError or ImportError here, by backend
        hint = INSTALL_HINT if sys.platform.startswith("linux") else "update the graphics driver"
        which = f" on device {device}" if device else ""
        raise ContextError(f"no OpenGL 3.3 context{which} ({error}); {hint}") from error
