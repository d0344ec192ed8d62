"""What a container gives of a frame, and how arrays become frames, colours and normals."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ..arrays.numpy_files import Stored
from ..cameras.intrinsics import Intrinsics, Numbers

SURE = 0.1  # of the median confidence: what has less is not used


@dataclass(frozen=True, eq=False)
class Contents:
    """One frame out of a container: its own values, nothing scaled. None = the file has none."""

    depth: NDArray[Any]  # (h, w) raw numbers
    color: NDArray[np.uint8] | None = None  # (h', w', 3|4)
    # in this package's pixels (centres at integers); `size` is the picture they belong to
    intrinsics: Intrinsics | None = None
    pose: NDArray[np.float64] | None = None  # (4, 4) camera-to-world, OpenCV axes, unchecked
    # (h, w), False where the depth is not to be used by the file's mask or confidence
    valid: NDArray[np.bool_] | None = None
    # (h, w, 3) unit, OpenCV camera axes, towards the camera, NaN where missing
    normals: NDArray[np.float32] | None = None
    # one of `depth_kinds.KINDS`, also where the camera is unknown; the intrinsics repeat it
    depth_kind: str | None = None
    depth_scale: float | None = None  # raw values per metre, likewise


class Frames(Sequence[Contents]):
    """Frames that are read when they are asked for, from any thread; slices are the same."""

    def __init__(self, count: int, read: Callable[[int], Contents]):
        self._count, self._read = count, read

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, index: Any) -> Any:
        """Raises IndexError beyond the end, ValueError for a frame that cannot be read."""
        chosen = range(self._count)[index]
        return self._read(chosen) if isinstance(chosen, int) else Frames(len(chosen), lambda k: self._read(chosen[k]))


_WHITE = 1.01  # filters overshoot a little


def as_color(picture: NDArray[Any]) -> NDArray[np.uint8]:
    """(h, w, 3|4) uint8 of a picture of any type: floating point from 0 or -1 to 1, or up to 255; 16 bits; grey."""
    if picture.dtype.kind == "f":
        picture = np.nan_to_num(picture.astype(np.float32), posinf=0, neginf=0)
        low, high = picture.min(), picture.max()
        scale, offset = (1, 0) if high > _WHITE else (127.5, 127.5) if low < 0 else (255, 0)
        picture = np.rint(picture * scale + offset).clip(0, 255).astype(np.uint8)
    elif picture.dtype == bool:
        picture = picture * np.uint8(255)
    elif picture.dtype != np.uint8:
        is_deep = picture.dtype.itemsize == 2 and picture.max(initial=0) > 255
        picture = (picture // 257 if is_deep else picture.clip(0, 255)).astype(np.uint8)
    return np.repeat(picture[..., None], 3, axis=2) if picture.ndim == 2 else picture


PLANES = ("depth", "inverse", "ray", "mask", "sky", "confidence")  # one number a pixel
NUMBERS = ("focal", "center", "scale")  # one or two, for all frames or for each
_CHANNELS = {"own_points": (3,), "points": (3,), "normals": (3,), "color": (3, 4, 1)}
_MATRICES = ("intrinsics", "world_to_camera", "camera_to_world")


class ArrayItem:
    """An array and how its axes are divided: the leading ones count frames, the others are of one frame."""

    def __init__(self, role: str, array: Stored):
        self.array, self.lead = array, _lead(role, array.shape)  # None if the shape is impossible for the role
        self.count = math.prod(array.shape[: self.lead or 0])  # of frames

    @property
    def size(self) -> tuple[int, int]:
        """Rows and columns of a picture."""
        sides = self.array.shape[self.lead or 0 :]
        rows, columns, *_ = *(sides[1:] if len(sides) > 2 and sides[2] > 4 else sides), 1, 1  # channels first, or last
        return rows, columns

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


# What their makers may have meant: x right, y down, z forward; the same away from the camera; y up and z backwards
_AXES = {"": (1, 1, 1), "away from the camera": (-1, -1, -1), "with OpenGL's axes": (1, -1, -1)}
_COARSE = 200  # rows and columns that are compared


def turn_normals(
    normals: NDArray[Any], depth: NDArray[Any], camera: Numbers | None, name: str, note: Note
) -> NDArray[np.float32]:
    """(h, w, 3) float32 in OpenCV's axes towards the camera, NaN where missing, from normals of the depth's size. Which
    axes they have is found by comparing with the depth's own surface; without a camera OpenCV's are taken."""
    vectors = normals.astype(np.float32)
    lengths = np.linalg.norm(vectors, axis=2, keepdims=True)
    vectors = np.where((lengths > 0.5) & (lengths < 2), vectors / lengths, np.float32(np.nan))
    if camera is None:
        return vectors
    step = max(1, min(depth.shape) // _COARSE)
    surface = _of_surface(depth[::step, ::step].astype(np.float64), camera, step)
    some = vectors[::step, ::step][:-1, :-1]

    def agreement(axes: tuple[int, int, int]) -> float:
        cosines = np.sum(some * axes * surface, axis=2)
        known = cosines[np.isfinite(cosines)]
        return float(known.mean()) if known.size else 0.0

    change, axes = max(_AXES.items(), key=lambda entry: agreement(entry[1]))
    if change:
        note(f"{name}: its normals are {change}, and turned")
    return vectors * np.array(axes, np.float32)


def _of_surface(depth: NDArray[np.float64], camera: Numbers, step: int) -> NDArray[Any]:
    """(h-1, w-1, 3) normals of the triangles between neighbouring points, towards the camera."""
    fx, fy, cx, cy = camera
    rows, columns = np.mgrid[0 : depth.shape[0], 0 : depth.shape[1]] * step
    depth = np.where((depth > 0) & np.isfinite(depth), depth, np.nan)
    points = np.stack([(columns - cx) / fx * depth, (rows - cy) / fy * depth, depth], axis=2)
    along, down = points[:-1, 1:] - points[:-1, :-1], points[1:, :-1] - points[:-1, :-1]
    normals = np.cross(along, down)
    normals *= -np.sign(np.sum(normals * points[:-1, :-1], axis=2, keepdims=True))
    return normals / np.linalg.norm(normals, axis=2, keepdims=True)
