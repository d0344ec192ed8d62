"""Keeps one light for the frames of a stream: looked for in each, it would cost more, and flicker."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .light_fit import FoundLight, fit_light
from .photo_shading import PhotoSamples

PATIENCE = 30  # frames after which the light is looked for again
ELSEWHERE = np.cos(np.radians(10)), 0.2  # cosine of a direction, and strength, that make it another light
STREAMS = 64  # that are remembered


class KeptLight(NamedTuple):
    """A light with its direction in the world, and for how many frames it has been used."""

    light: FoundLight
    direction: NDArray[np.float64]
    frames: int


class StreamLights:
    """Finds the light in the frames of streams."""

    def __init__(self) -> None:
        self._kept: dict[Hashable, KeptLight] = {}

    def find(self, photo: PhotoSamples, stream: Hashable, pose: NDArray[np.float64]) -> FoundLight:
        """Return the light in the next frame of a stream; of None, the light in a frame of its own.

        pose  camera-to-world (4, 4)
        """
        kept = None if stream is None else self._kept.pop(stream, None)
        if kept is None or kept.frames % PATIENCE == 0:
            found = fit_light(photo.unclipped, photo.surfaces)
            direction = pose[:3, :3] @ np.array(found.direction)
            if kept is None or _is_another(kept, found, direction):
                kept = KeptLight(found, direction, 0)
        if stream is not None:
            self._kept[stream] = kept._replace(frames=kept.frames + 1)
            if len(self._kept) > STREAMS:
                del self._kept[next(iter(self._kept))]
        x, y, z = (pose[:3, :3].T @ kept.direction).tolist()
        return replace(kept.light, direction=(x, y, z))


def _is_another(kept: KeptLight, found: FoundLight, direction: NDArray[np.float64]) -> bool:
    closest, weaker = ELSEWHERE
    return bool(direction @ kept.direction < closest) or abs(found.strength - kept.light.strength) > weaker
