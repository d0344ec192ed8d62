"""Divides an array into frames: which of its axes count frames, and the part of one frame."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays.stored_arrays import Stored

PLANES = ("depth", "inverse", "ray", "mask", "sky", "confidence")  # one number a pixel
NUMBERS = ("focal", "center", "scale")  # one or two, for all frames or for each
_CHANNELS = {"own_points": (3,), "points": (3,), "normals": (3,), "color": (3, 4, 1)}
_MATRICES = ("intrinsics", "world_to_camera", "camera_to_world")


class Item:
    """An array and how its axes are divided: the leading ones count frames, the others are of one frame.

    lead   how many axes count frames; None if the shape is impossible for the role
    count  of frames
    """

    def __init__(self, role: str, array: Stored):
        self.array, self.lead = array, _lead(role, array.shape)
        self.count = math.prod(array.shape[: self.lead or 0])

    @property
    def size(self) -> tuple[int, int]:
        """Rows and columns of a picture."""
        first, second, *_ = [*_without_channels(self.array.shape[self.lead or 0 :]), 1, 1]
        return first, second

    def part(self, k: int, is_transposed: bool) -> NDArray[Any]:
        """Of the k-th frame, or of all if there is but one: (h, w), (h, w, c) or a matrix."""
        lead = self.array.shape[: self.lead or 0]
        index = np.unravel_index(k if self.count > 1 else 0, lead) if lead else ()
        part = self.array.part(tuple(int(i) for i in index))
        if part.ndim == 3 and part.shape[2] > 4 and part.shape[0] <= 4:
            part = np.moveaxis(part, 0, 2)
        if part.ndim == 3 and part.shape[2] == 1:
            part = part[..., 0]
        return part.swapaxes(0, 1) if is_transposed and part.ndim >= 2 else part


def _lead(role: str, shape: tuple[int, ...]) -> int | None:
    """How many axes come before those of one frame; None if the shape is impossible for the role."""
    own = len(shape)
    if role in PLANES:
        own = 3 if len(shape) > 2 and shape[-1] == 1 else 2
    elif role in _CHANNELS:
        channels = _CHANNELS[role]
        has_them = len(shape) > 2 and (shape[-1] in channels or shape[-3] in channels)
        own = 3 if has_them else 2 if role == "color" else math.inf
    elif role in _MATRICES:
        own = 2 if shape[-2:] in ((3, 3), (3, 4), (4, 4)) else math.inf
    return len(shape) - int(own) if own <= len(shape) and 0 not in shape else None


def _without_channels(shape: tuple[int, ...]) -> tuple[int, ...]:
    if len(shape) < 3:
        return shape
    return shape[:2] if shape[2] <= 4 else shape[1:]
