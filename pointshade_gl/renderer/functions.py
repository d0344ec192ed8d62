"""Renderers of threads: functions that need none at hand, pools for servers, and the pictures of notebooks."""

from __future__ import annotations

import inspect
import os
import threading
import weakref
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import check_choice, check_count, check_type
from ..notes.errors import ContextError, check_process
from ..scene.camera import Camera
from ..scene.frame import Frame, draw_previews_by
from ..scene.graph import Scene
from ..scene.option_fields import takes_as
from .renderer import RASTERIZERS, Rasterizer, Renderer

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
render_normals = by_shared_renderer(Renderer.render_normals)
render_passes = by_shared_renderer(Renderer.render_passes)
render_points = by_shared_renderer(Renderer.render_points)
render_mesh = by_shared_renderer(Renderer.render_mesh)
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


class RendererPool:
    """Draw pictures for any number of threads or coroutines, by several Renderers at once.

    Requests wait in a queue, without a limit, for the next Renderer that is free. One that fails or is cancelled is
    nothing to the others. Streams (`temporal`) are left to a Renderer of your own: here each picture may have another.

    Parameters
    ----------
    size : int
        How many Renderers draw at once, each in a thread of its own.
    device : int
        Which GPU, counted by EGL (Linux).
    rasterizer : {"auto", "points", "compute"}
        As of `Renderer`.

    Raises
    ------
    ContextError
        As `Renderer`.
    TypeError, ValueError
        For arguments of another kind.
    """

    def __init__(self, size: int = 1, device: int = 0, rasterizer: Rasterizer = "auto"):
        check_count(size, "size", 1)
        check_count(device, "device")
        check_choice("rasterizer", rasterizer, RASTERIZERS)
        self._wanted = device, rasterizer
        self._process = os.getpid()
        self._threads = ThreadPoolExecutor(size, "pointshade")
        all_there = threading.Barrier(size)  # a thread that waits takes no second task

        def start() -> None:
            all_there.wait()
            renderer_here(device, rasterizer)

        try:
            for started in [self._threads.submit(start) for _ in range(size)]:
                started.result()
        except BaseException:
            all_there.abort()
            self.release()
            raise

    @takes_as(Renderer.render)
    def render(self, *args: Any, **options: Any) -> NDArray[np.uint8]:
        """Draw as `Renderer.render` does, and wait for the picture.

        Returns
        -------
        (h, w, 4) uint8
            As of `Renderer.render`.

        Raises
        ------
        ContextError
            After `release`, and in a forked process. Otherwise as `Renderer.render`.
        """
        return self.submit(*args, **options).result()

    @takes_as(Renderer.render)
    async def render_async(self, *args: Any, **options: Any) -> NDArray[np.uint8]:
        """Draw as `Renderer.render` does, for `await` under asyncio. Cancelled, it is not drawn if it still waits.

        Returns
        -------
        (h, w, 4) uint8
            As of `Renderer.render`.

        Raises
        ------
        ContextError
            After `release`, and in a forked process. Otherwise as `Renderer.render`.
        """
        from asyncio import wrap_future

        return await wrap_future(self.submit(*args, **options))

    @takes_as(Renderer.render)
    def submit(self, *args: Any, **options: Any) -> Future[NDArray[np.uint8]]:
        """Ask for a picture without waiting for it.

        Returns
        -------
        concurrent.futures.Future
            `result()` waits for the picture, or raises what `Renderer.render` raises.

        Raises
        ------
        ContextError
            After `release`, and in a forked process.
        """
        check_process(self._process, "RendererPool")
        try:
            return self._threads.submit(self._draw, *args, **options)
        except RuntimeError as error:  # of an executor that takes no more
            raise ContextError("this RendererPool was released: make a new one") from error

    def _draw(self, *args: Any, **options: Any) -> NDArray[np.uint8]:
        return renderer_here(*self._wanted).render(*args, **options)

    def release(self) -> None:
        """Draw what was asked for, then end all threads and free their Renderers. Called again it does nothing."""
        self._threads.shutdown()

    def __enter__(self) -> RendererPool:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()
