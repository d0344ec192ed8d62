"""Frames from arrays with known names, as networks, renderers and data sets write them (the names: `roles.ROLES`).

Shapes    (h, w), (h, w, c) or (c, h, w); one frame or several (n, ...); any axes of length 1 before.
Points    (h, w, 3): z is the depth, and the camera is fitted to x/z and y/z. Beside poses they may be in the world's
          axes: whichever a pinhole camera sees.
Cameras   a 3x3 matrix in pixels, or normalised (cx and cy up to 1, corners at 0 and 1: MoGe); or a focal length in
          pixels, with the principal point in the middle unless the file says it.
Poses     "extrinsics" and "w2c" are world-to-camera, "poses" and "c2w" camera-to-world, all with OpenCV's axes.
Valid     where mask is true, where sky is not, and where the confidence is high enough, see `_is_sure`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..notes import Note, once
from ..wording import option
from .contents import Contents, Frames
from .intrinsics import Intrinsics
from .limits import MAX_PIXELS, check_pixels
from .pinhole import fit_pinhole, is_pinhole
from .roles import MAYBE_INVERSE, SURFACES, find_roles, is_named, list_arrays
from .stored import Stored
from .turned_normals import turn_normals

_PLANES = ("depth", "inverse", "ray", "mask", "sky", "confidence")
_CHANNELS = {"own_points": (3,), "points": (3,), "normals": (3,), "color": (3, 4, 1)}
_MATRICES = {"intrinsics": (3, 4), "world_to_camera": (3, 4), "camera_to_world": (3, 4)}
_KINDS = {"inverse": "inverse", "ray": "ray"}
_SURE = 0.1  # of the median confidence


def open_arrays(
    name: str,
    arrays: dict[str, Stored],
    note: Note,
    max_pixels: float = MAX_PIXELS,
    is_transposed: bool = False,
    usual: Intrinsics | None = None,
) -> Frames:
    """The frames that arrays of these names make.

    name           of the file, for messages
    is_transposed  (w, h) instead of (h, w), and so on: MATLAB's arrays in HDF5
    usual          the camera if the arrays do not say it

    Raises ValueError if no array is a depth, or if it has too many pixels.
    """
    shapes = {key: array.shape for key, array in arrays.items()}
    roles = find_roles(arrays)
    items = {role: _Item(role, arrays[key]) for role, key in roles.items()}
    surface = next((role for role in SURFACES if role in items and items[role].lead is not None), None)
    if surface is None:
        raise ValueError(
            f"{name} has no array called depth or points, only {list_arrays(shapes) or 'nothing'}: "
            f"save the depth alone as .npy and pass it as {option('depth', 'FILE')}"
        )
    count = items[surface].count
    height, width = items[surface].size
    check_pixels(width, height, f"{name}/{roles[surface]}", max_pixels)
    for role, item in list(items.items()):
        if role not in ("focal", "center", "scale") and (item.lead is None or item.count not in (1, count)):
            note(f"{name}: {list_arrays({roles[role]: item.array.shape})} does not fit the depth and is not used")
            del items[role]
    if is_named(roles[surface], MAYBE_INVERSE):
        kind = option("depth_kind", "inverse")
        note(f"{name}: {roles[surface]} is read as distances; pass {kind} for Depth Anything or MiDaS")
    reader = _Reader(name, items, surface, is_transposed, usual, once(note), max_pixels)
    return Frames(count, reader.read)


class _Item:
    """An array and how its axes are divided: the leading ones count frames, the others are of one frame."""

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
    if role in _PLANES:
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


@dataclass(frozen=True)
class _Reader:
    """Makes one frame of the arrays."""

    name: str
    items: dict[str, _Item]
    surface: str
    is_transposed: bool
    usual: Intrinsics | None
    note: Note
    max_pixels: float

    def read(self, k: int) -> Contents:
        pose = self._pose(k)
        fitted = None
        depth = self._part(self.surface, k)
        if self.surface in ("points", "own_points"):
            points, fitted = self._own_points(depth, pose)
            depth = points[..., 2]
        color, kind, scale = self._color(k), _KINDS.get(self.surface), self._scale()
        numbers = self._camera(k, depth.shape) or fitted
        intrinsics = None
        if numbers is not None:
            size = _size(depth.shape, None if color is None else color.shape, numbers)
            intrinsics = Intrinsics(self.name, numbers, size, scale, kind)
        elif self.usual is not None:
            intrinsics, kind = self.usual, kind or self.usual.depth_kind
        valid = self._valid(k, depth.shape)
        normals = self._part("normals", k) if "normals" in self.items else None
        if normals is not None:
            normals = turn_normals(normals, depth, numbers if kind is None else None, self.name, self.note)
        return Contents(depth, color, intrinsics, pose, valid, normals, kind, scale)

    def _part(self, role: str, k: int) -> NDArray[Any]:
        return self.items[role].part(k, self.is_transposed)

    def _own_points(self, points: NDArray[Any], pose: NDArray[np.float64] | None) -> tuple[NDArray[Any], Any]:
        """The points in the camera's axes, and the camera that sees them."""
        fitted, off = fit_pinhole(points)
        if self.surface == "points" and pose is not None and not np.array_equal(pose, np.eye(4)):
            inverse = np.linalg.inv(pose)
            moved = (points @ inverse[:3, :3].T + inverse[:3, 3]).astype(points.dtype)
            fitted_moved, off_moved = fit_pinhole(moved)
            if off_moved < off:
                points, fitted, off = moved, fitted_moved, off_moved
        if not is_pinhole(off):
            raise ValueError(
                f"{self.name}: no pinhole camera sees its points where they are in the picture: expected x right, "
                "y down and z forward, in the camera's axes or with the camera's pose beside them"
            )
        return points, fitted

    def _pose(self, k: int) -> NDArray[np.float64] | None:
        for role in ("camera_to_world", "world_to_camera"):
            if role in self.items:
                pose = np.eye(4)
                rows = self._part(role, k)[:3]
                pose[:3, : rows.shape[1]] = rows
                return pose if role == "camera_to_world" else _inverse(pose, self.name)
        return None

    def _camera(self, k: int, shape: tuple[int, ...]) -> tuple[float, float, float, float] | None:
        height, width = shape
        if "intrinsics" in self.items:
            matrix = self._part("intrinsics", k).astype(np.float64)
            fx, fy, cx, cy = matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]
            if 0 < cx <= 1 and 0 < cy <= 1:  # from edge to edge
                fx, fy, cx, cy = fx * width, fy * height, cx * width - 0.5, cy * height - 0.5
            return float(fx), float(fy), float(cx), float(cy)
        focal = self._numbers("focal", k)
        if focal is None:
            return None
        center = self._numbers("center", k)
        cx, cy = ((width - 1) / 2, (height - 1) / 2) if center is None else center[:2]
        return float(focal[0]), float(focal[-1]), float(cx), float(cy)

    def _numbers(self, role: str, k: int) -> NDArray[np.float64] | None:
        """One or two numbers of a frame, from an array of these for one or all frames."""
        if role not in self.items:
            return None
        count, stored = self.items[self.surface].count, self.items[role].array
        size = math.prod(stored.shape)
        if (role == "center" and size not in (2, 2 * count)) or size not in (1, 2, count, 2 * count):
            return None
        numbers = stored.part(()).astype(np.float64).ravel()
        rows = count if size in (count, 2 * count) and not (role == "center" and size == 2) else 1
        return numbers.reshape(rows, -1)[k if rows > 1 else 0]

    def _scale(self) -> float | None:
        scale = self._numbers("scale", 0)
        return None if scale is None else float(scale[0])

    def _color(self, k: int) -> NDArray[np.uint8] | None:
        if "color" not in self.items:
            return None
        height, width = self.items["color"].size
        check_pixels(width, height, f"{self.name}'s colour", self.max_pixels)
        return as_color(self._part("color", k))

    def _valid(self, k: int, shape: tuple[int, ...]) -> NDArray[np.bool_] | None:
        valid = None
        for role in ("mask", "sky", "confidence"):
            if role not in self.items:
                continue
            part = self._part(role, k)
            if part.shape != shape:
                self.note(f"{self.name}: the {role} is {part.shape}, the depth {shape}: it is not used")
                continue
            if role == "confidence":
                is_good = _is_sure(part)
                share = np.mean(~is_good)
                if share:
                    self.note(f"{self.name}: {share:.0%} of the depth is of low confidence and left out")
            else:
                is_good = (
                    (part > 0.5) == (role == "mask") if part.dtype.kind == "f" else (part != 0) == (role == "mask")
                )
            valid = is_good if valid is None else valid & is_good
        return valid


def as_color(picture: NDArray[Any]) -> NDArray[np.uint8]:
    """(h, w, 3|4) uint8 of a picture of any type: floating point from 0 or -1 to 1, or up to 255; 16 bits; grey."""
    if picture.dtype.kind == "f":
        low, high = np.nanmin(picture), np.nanmax(picture)
        span = 127.5 if low < 0 and high <= 1.01 else 255.0 if high <= 1.01 else 1.0
        scaled = np.nan_to_num(picture * span + (span if span == 127.5 else 0))
        picture = np.rint(scaled).clip(0, 255).astype(np.uint8)
    elif picture.dtype == bool:
        picture = picture * np.uint8(255)
    elif picture.dtype != np.uint8:
        is_deep = picture.dtype.itemsize == 2 and picture.max(initial=0) > 255
        picture = (picture // 257 if is_deep else picture.clip(0, 255)).astype(np.uint8)
    return np.repeat(picture[..., None], 3, axis=2) if picture.ndim == 2 else picture


def _is_sure(confidence: NDArray[Any]) -> NDArray[np.bool_]:
    """Where a network is sure of its depth: at a tenth of the picture's median confidence or more.

    Confidence counts from where it starts: 1 if nothing is below (VGGT, DUSt3R and Depth Anything 3 give 1 + exp(x)),
    else 0; values below 0 are logits (Pi3) and become shares by the logistic function. NaN is not sure.
    """
    values = confidence.astype(np.float64)
    known = values[np.isfinite(values)]
    if not known.size:
        return np.ones(values.shape, bool)
    if known.min() < 0:
        values, known = (1 / (1 + np.exp(-v.clip(-50, 50))) for v in (values, known))
    elif known.min() >= 1:
        values, known = values - 1, known - 1
    return values >= _SURE * np.median(known)


def _inverse(pose: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    try:
        return np.asarray(np.linalg.inv(pose), np.float64)
    except np.linalg.LinAlgError:
        raise ValueError(f"{name}: its world-to-camera matrix cannot be inverted: {pose[:3].tolist()}") from None


def _size(
    depth: tuple[int, ...], color: tuple[int, ...] | None, numbers: tuple[float, float, float, float]
) -> tuple[int, int] | None:
    """(width, height) of the picture that a camera is of; None if that is not certain."""
    is_one = color is None or color[:2] == depth
    return (depth[1], depth[0]) if is_one and 0 < numbers[2] < depth[1] and 0 < numbers[3] < depth[0] else None
