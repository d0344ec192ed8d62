"""Checks the arrays of a frame: what is refused, what counts as missing, and what is copied."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import LARGEST, as_given, depth_as_given
from ..checks.foreign_arrays import way_to
from ..notes.notes import print_note
from ..notes.words import shown
from .camera import Camera
from .far_plane import far_plane
from .values import frozen

BACKGROUND = 100  # times as far as all else: one value there is that of a sky without a depth
LEAST = 1 / LARGEST  # of a depth: shaders square lengths, and drivers take the squares of smaller ones for 0
NEUTRAL = 204  # light grey, sRGB: the colour of a frame without colours
PROBE = 10_000  # pixels looked at for the pivot and the range: enough for a median, quick for any size


def check_colors(color: Any) -> NDArray[np.uint8]:
    """The colours, read-only. Raises TypeError or ValueError for anything but (h, w, 3|4) uint8."""
    expected = "color must have shape (h, w, 3) or (h, w, 4)"
    array = as_given(color, expected)
    if array.ndim != 3 or array.shape[2] not in (3, 4) or 0 in array.shape:
        raise ValueError(f"{expected}, got {array.shape}{way_to(array.shape, 'color', color, (3, 4))}")
    if array.dtype != np.uint8:
        hint = "multiply by 255 and round" if array.dtype.kind == "f" else "convert it to 8 bits"
        raise TypeError(f"color must be uint8 sRGB, got {array.dtype}: {hint}")
    array = array if _is_frozen(array) else np.array(array, order="C")
    return frozen(array)


def check_depth(depth: Any, camera: Camera) -> NDArray[np.float32]:
    """The depth, 0 where it is missing. Raises TypeError or ValueError unless it is metres of the camera's size."""
    array = depth_as_given(depth)
    if array.dtype.kind not in "fiub":
        got = shown(depth) if array.ndim == 0 else array.dtype
        raise TypeError(f"depth must be floating point metres, got {got}")
    if array.ndim != 2 or 0 in array.shape:
        raise ValueError(f"depth must have shape (h, w), got {array.shape}{way_to(array.shape, 'depth', depth)}")
    if array.dtype.kind in "iu":
        raise TypeError(f"depth is {array.dtype}: divide it by its depth_scale (1000 for millimetres) to get metres")
    if array.dtype.kind != "f":
        raise TypeError(f"depth must be floating point metres, got {array.dtype}")
    if array.shape != (camera.height, camera.width):
        raise ValueError(
            f"camera is for {camera.width}x{camera.height} pixels, depth is {array.shape[1]}x{array.shape[0]}: "
            f"use camera.resized({array.shape[1]}, {array.shape[0]}) if it shows the same view"
        )
    with np.errstate(over="ignore", invalid="ignore"):
        result = array if _is_frozen(array) and array.dtype == np.float32 else array.astype(np.float32, order="C")
        # one test for everything that is missing: NaN compares false, and what overflows float32 is infinite by now
        if not (result.min() >= LEAST and result.max() <= LARGEST):  # most pictures that miss nothing end here
            result = result if result.flags.writeable else result.copy()
            result[~((result >= LEAST) & (result <= LARGEST))] = 0
    return result


def without_background(depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return depth without its far plane, if that is a background; a note tells it."""
    step = probing_step(depth)
    probed = depth[::step, ::step]
    found = far_plane(probed[probed > 0], BACKGROUND)
    if found is None:
        return depth
    is_background = depth > found.limit
    share = np.count_nonzero(is_background) / np.count_nonzero(depth)
    apart = f"over {BACKGROUND} times as far as the others"
    print_note(f"the depth {found.depth:g} of {share:.0%} of the points, {apart}, is taken as background: missing")
    return np.where(is_background, np.float32(0), depth)


def probing_step(depth: NDArray[Any]) -> int:
    """Return the step between the rows and columns of about PROBE pixels."""
    return max(1, round((depth.size / PROBE) ** 0.5))


def _is_frozen(array: NDArray[Any]) -> bool:
    """Return whether nobody is expected to write into an array: it is kept as it is, all others are copied."""
    return array.base is None and not array.flags.writeable and array.flags.c_contiguous


def cut_out(depth: NDArray[np.float32], color: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return depth without the pixels whose colour is fully transparent."""
    h, w = depth.shape
    rows = [(2 * i + 1) * color.shape[0] // (2 * h) for i in range(h)]
    columns = [(2 * i + 1) * color.shape[1] // (2 * w) for i in range(w)]
    return np.where(color[rows][:, columns, 3] > 0, depth, np.float32(0))
