"""One scale for the depth of a whole film, where a network gives each picture its own (files/depth/frame_scale.py).

Pictures are followed in their order, each once: one that is asked for out of order is preceded by those before it. So
a frame is the same however it is reached, in a window as in a batch.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import option
from ...scene.camera import Camera
from ..depth.depth_kinds import METRIC, Decoded
from ..depth.frame_scale import FrameScale

ScaleName = Literal["auto", "keep"]
SCALES: tuple[ScaleName, ...] = get_args(ScaleName)


_PATIENCE = 8  # pictures


class Laid(NamedTuple):
    """How a picture's values become metres: those at the two ends of depth without a scale, or a factor."""

    low: float = 0.0
    high: float = 0.0
    factor: float = 1.0

    @property
    def ends(self) -> tuple[float, float] | None:
        return (self.low, self.high) if self.high > self.low else None


class FilmScale:
    """The scale of each picture of a film. From any thread.

    may_breathe   whether metres may be a network's
    is_networks   whether they surely are: then they breathe while the camera moves, too
    """

    def __init__(self, may_breathe: bool, is_networks: bool, note: Note):
        self.lock = threading.RLock()
        self._may_breathe, self._is_networks, self._note = may_breathe, is_networks, note
        self._follower: FrameScale | None = None
        self._found: list[Laid] = []
        self._first = Laid()
        self.is_over = False  # nothing to follow: depth has a scale

    def of(
        self, index: int, decoded: Decoded, colors: NDArray[Any] | None, camera: Camera, read: Callable[[int], object]
    ) -> Laid:
        """Return how to lay the depth of a picture.

        index  of the picture in the film
        read   reads an earlier picture, which comes here for its own
        """
        if not self.is_over and not self._found and index == 0:
            self._begin(decoded)
        for before in range(len(self._found), index):
            self._catch_up(before, read)
        if self.is_over:
            return Laid()
        if index == len(self._found):
            self._found.append(self._next(index, decoded, colors, camera))
        return self._found[index]

    def _begin(self, decoded: Decoded) -> None:
        coding = decoded.coding
        is_relative = coding.scale is None and coding.kind in ("z", "inverse")
        is_floating = decoded.values.dtype.kind == "f" and coding.kind in METRIC
        self.is_over = not (is_relative or (is_floating and self._may_breathe))
        self._follower = FrameScale(
            is_inverse=coding.kind == "inverse", is_metric=not is_relative, may_move=self._is_networks
        )
        if is_relative:
            self._note(
                "each frame's depth has a scale of its own: one is found for all, from what does not change; "
                f"pass {option('scale_frames', 'keep')} to leave each as it is"
            )

    def _catch_up(self, before: int, read: Callable[[int], object]) -> None:
        """Read an earlier picture; one that cannot be read is passed over."""
        if self.is_over or len(self._found) > before:
            return
        try:
            read(before)
        except (ValueError, OSError):
            self._found[len(self._found) :] = [self._found[-1] if self._found else Laid()]

    def _give_up(self, index: int, factor: float) -> None:
        """Follow files of metres no further that do not breathe at first: nobody then waits for earlier frames."""
        is_steady = factor == 1 and all(one.factor == 1 for one in self._found)
        self.is_over = is_steady and not self._is_networks and index >= _PATIENCE

    def _next(self, index: int, decoded: Decoded, colors: NDArray[Any] | None, camera: Camera) -> Laid:
        if self._follower is None:  # the first ones could not be read
            self._begin(decoded)
        assert self._follower is not None
        self._follower.focal = abs(camera.fx) / camera.width
        values = np.asarray(decoded.values, np.float32)
        unknown = ~np.isfinite(values) if not self._follower.is_metric else ~(np.isfinite(values) & (values > 0))
        line = self._follower.of(np.where(unknown, np.float32(np.nan), values), colors)
        if self._follower.is_metric:
            self._give_up(index, line.a)
            return Laid(factor=line.a)
        if line.is_first:
            if index:
                self._note(f"frame {index} begins another shot: its depth has a scale of its own")
            known = values[~unknown]
            self._first = Laid(float(known.min()), float(known.max())) if known.size else Laid()
            return self._first
        return Laid((self._first.low - line.b) / line.a, (self._first.high - line.b) / line.a)
