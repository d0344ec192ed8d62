"""Several Renderers, each in a thread of its own, that draw what other threads ask for: for servers."""

from __future__ import annotations

import os
import threading
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import check_choice, check_count
from ..notes.errors import ContextError, check_process
from ..scene.option_fields import takes_as
from .renderer import RASTERIZERS, Rasterizer, Renderer
from .thread_renderer import renderer_here


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
