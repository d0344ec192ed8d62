"""Functions that need no Renderer at hand, and the pictures of notebooks: each thread keeps a Renderer for them."""

from __future__ import annotations

import inspect
import sys
import threading
import weakref
from collections.abc import Callable
from functools import wraps
from typing import Concatenate, ParamSpec, TypeVar

from ..messages.validation import check_type
from ..scene.camera import Camera
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.preview import draw_previews_by
from .renderer import Renderer

PREVIEW = 640  # pixels of the longer side of what notebooks show

_mine = threading.local()  # what keeps a Renderer for each thread, made when it is first needed
_P = ParamSpec("_P")
_R = TypeVar("_R")


def renderer_here(device: int = 0) -> Renderer:
    """The Renderer that this thread keeps, on this GPU: another device replaces it. Raises as `Renderer` does."""
    kept = getattr(_mine, "kept", None)
    if kept is None or kept.device != device:
        _mine.kept = kept = _OfThread(Renderer(device=device), device)
    return kept.renderer


class _OfThread:
    """Keeps a thread's Renderer and frees it with the thread, which lets go of what is local to it at its end."""

    def __init__(self, renderer: Renderer, device: int):
        self.renderer, self.device = renderer, device
        weakref.finalize(self, _free, renderer).atexit = False


def _free(renderer: Renderer) -> None:
    """Only in the renderer's own thread, and not at the end of the process: drivers may be gone by then."""
    if renderer.context.is_here and not sys.is_finalizing():
        renderer.release()


def by_shared_renderer(method: Callable[Concatenate[Renderer, _P], _R]) -> Callable[_P, _R]:
    """The method as a function, called on a Renderer that this thread keeps."""

    @wraps(method)
    def function(*args: _P.args, **options: _P.kwargs) -> _R:
        return method(renderer_here(), *args, **options)

    signature = inspect.signature(method)
    without_self = list(signature.parameters.values())[1:]
    function.__signature__ = signature.replace(parameters=without_self)  # type: ignore[attr-defined]
    return function


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
