"""Functions that need no Renderer at hand, and the pictures of notebooks: each thread keeps a Renderer for them."""

from __future__ import annotations

import inspect
import threading
import weakref
from collections.abc import Callable
from functools import wraps
from typing import Concatenate, ParamSpec, TypeVar

from ..checks.arguments import check_count, check_type
from ..scene.camera import Camera
from ..scene.frame import Frame, draw_previews_by
from ..scene.graph import Scene
from .renderer import Rasterizer, Renderer

PREVIEW = 640  # pixels of the longer side of what notebooks show

_mine = threading.local()  # what keeps a Renderer for each thread, made when it is first needed
_P = ParamSpec("_P")
_R = TypeVar("_R")


def renderer_here(device: int | None = None, rasterizer: Rasterizer = "auto") -> Renderer:
    """The Renderer that this thread keeps, on this GPU or on that of `use_device`. Another one replaces it.

    Raises as `Renderer` does.
    """
    made_by = getattr(_mine, "device", 0) if device is None else device, rasterizer
    kept = getattr(_mine, "kept", None)
    if kept is None or kept.made_by != made_by:
        _mine.kept = kept = _OfThread(Renderer(None, *made_by), made_by)
    return kept.renderer


class _OfThread:
    """Keeps a thread's Renderer and frees it with the thread, which lets go of what is local to it at its end."""

    def __init__(self, renderer: Renderer, made_by: tuple[int, Rasterizer]):
        self.renderer, self.made_by = renderer, made_by
        weakref.finalize(self, renderer.context.drop).atexit = False


def use_device(device: int) -> None:
    """Choose the GPU on which `render` and the other functions that need no Renderer draw, in this thread.

    Parameters
    ----------
    device : int
        Which GPU, counted by EGL (Linux).

    Raises
    ------
    TypeError, ValueError
        For anything but a whole number from 0. Where there is no such GPU, the next picture raises ContextError.
    """
    _mine.device = check_count(device, "device")


def release() -> None:
    """Free the Renderer that this thread keeps for `render` and its relatives; the next picture makes a new one.

    It is also freed when its thread ends.
    """
    kept = _mine.__dict__.pop("kept", None)
    if kept is not None:
        kept.renderer.release()


def by_shared_renderer(method: Callable[Concatenate[Renderer, _P], _R], name: str = "") -> Callable[_P, _R]:
    """The method as a function, called on a Renderer that this thread keeps.

    name  under which it is public, if that is another than the method's; so it can be pickled
    """

    @wraps(method)
    def function(*args: _P.args, **options: _P.kwargs) -> _R:
        return method(renderer_here(), *args, **options)

    signature = inspect.signature(method)
    without_self = list(signature.parameters.values())[1:]
    function.__name__ = function.__qualname__ = name or method.__name__
    function.__module__ = __name__.partition(".")[0]
    function.__signature__ = signature.replace(parameters=without_self)  # type: ignore[attr-defined]
    return function


align_frames = by_shared_renderer(Renderer.align_frames)
render = by_shared_renderer(Renderer.render)
render_depth = by_shared_renderer(Renderer.render_depth)
render_points = by_shared_renderer(Renderer.render_points)
estimate_albedo = by_shared_renderer(Renderer.estimate_albedo)
estimate_normals = by_shared_renderer(Renderer.estimate_normals)


def _preview(source: Frame | Scene) -> bytes:
    """A small PNG for notebooks."""
    camera = check_type((source.framed() if isinstance(source, Scene) else source).camera, Camera, "camera")
    share = min(1.0, PREVIEW / max(camera.width, camera.height))
    sides = (max(1, round(share * side)) for side in (camera.width, camera.height))
    from ..files.pictures.picture_files import encode_png

    return encode_png(render(source, camera=camera.resized(*sides)))


draw_previews_by(_preview)
