"""Files that a window writes: the pictures that it saves, and the film of what it shows."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..files.pictures.picture_files import save_image

RATE = 30.0


class Recorder:
    """Feeds a Film in real time, at the film's rate, whatever the window's rate is.

    Raises what `Film` raises if it cannot be written.
    """

    def __init__(self, path: Path, fps: float = RATE):
        from ..files.writing.film import Film

        self._film, self._fps = Film(path, fps), fps
        self._began: float | None = None  # when the first picture came
        self._written = 0
        self._last: NDArray[np.uint8] | None = None

    def patience(self, now: float) -> float:
        """Seconds until the next picture is due."""
        return 0.0 if self._began is None else max(self._began + self._written / self._fps - now, 0.0)

    def add(self, now: float, take: Callable[[], NDArray[np.uint8]]) -> None:
        """Adds as many pictures as are due, all the same. take() gives (h, w, 4) uint8, always of one size."""
        self._began = now if self._began is None else self._began
        due = int((now - self._began) * self._fps) + 1 - self._written
        if due > 0:
            self._last = take()
            for _ in range(due):
                self._film.add(self._last)
            self._written += due

    def hold(self, now: float) -> None:
        """Adds the last picture as often as pictures are due. Before the first one nothing is."""
        if (last := self._last) is not None:
            self.add(now, lambda: last)

    def close(self) -> None:
        self._film.close()


def save_new(image: NDArray[np.uint8]) -> Path:
    """Write a picture to a new file in the working directory, and return its path. Raises OSError."""
    path = next(p for k in range(1, 1_000_000) if not (p := Path(f"pointshade_{k:04d}.png")).exists())
    save_image(path, image)
    return path
