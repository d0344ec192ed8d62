"""Assembles one frame from named arrays: its depth, camera, pose, colour, normals and validity mask."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import shown
from ..access.limits import check_pixels
from ..cameras.intrinsics import Intrinsics, Numbers, Size
from .color_values import as_color
from .contents import SURE, Contents
from .items import Item
from .normal_axes import turn_normals
from .pinhole import MOST_OFF, fit_pinhole


@dataclass(frozen=True)
class Assembly:
    """Assembles frames from arrays that fit each other: `read(k)`."""

    name: str
    items: dict[str, Item]
    surface: str
    is_transposed: bool
    usual: Intrinsics | None
    note: Note
    max_pixels: float

    @np.errstate(all="ignore")  # what is missing may be infinite, or anything else
    def read(self, k: int) -> Contents:
        pose = self._pose(k)
        fitted = None
        depth = self._part(self.surface, k)
        if self.surface in ("points", "own_points"):
            points, fitted = self._own_points(depth, pose)
            depth = points[..., 2]
        color, scale = self._color(k), self._scale()
        kind = self.surface if self.surface in ("inverse", "ray") else None
        numbers = self._camera(k, depth.shape) or fitted
        intrinsics = None
        if numbers is not None:
            size = _size(depth.shape, None if color is None else color.shape, numbers)
            intrinsics = Intrinsics(self.name, numbers, size, scale, kind)
        elif self.usual is not None:
            intrinsics, kind = self.usual, kind or self.usual.depth_kind
        valid = self._valid(k)
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
            inverse = _inverse(pose, self.name)
            moved = (points @ inverse[:3, :3].T + inverse[:3, 3]).astype(points.dtype)
            fitted_moved, off_moved = fit_pinhole(moved)
            if off_moved < off:
                points, fitted, off = moved, fitted_moved, off_moved
        if off >= MOST_OFF:
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

    def _camera(self, k: int, shape: tuple[int, ...]) -> Numbers | None:
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
        """Raw values per metre; below 1 the file says metres per raw value, as RealSense does."""
        numbers = self._numbers("scale", 0)
        scale = 0.0 if numbers is None else float(numbers[0])
        return None if not 0 < scale < math.inf else 1 / scale if scale < 1 else scale

    def _color(self, k: int) -> NDArray[np.uint8] | None:
        if "color" not in self.items:
            return None
        height, width = self.items["color"].size
        check_pixels(width, height, f"{self.name}'s colour", self.max_pixels)
        return as_color(self._part("color", k))

    def _valid(self, k: int) -> NDArray[np.bool_] | None:
        valid = None
        for role in ("mask", "sky", "confidence"):
            if role not in self.items:
                continue
            part = self._part(role, k)
            if role == "confidence":
                is_good = _is_sure(part)
                share = np.mean(~is_good)
                if share:
                    self.note(f"{self.name}: {share:.0%} of the depth is of low confidence and left out")
            else:
                is_good = (part > (0.5 if part.dtype.kind == "f" else 0)) == (role == "mask")
            valid = is_good if valid is None else valid & is_good
        return valid


def _is_sure(confidence: NDArray[Any]) -> NDArray[np.bool_]:
    """Return where a network is sure of its depth: a tenth of the picture's median confidence or more. Levels: above 0.

    Confidence counts from where it starts: 1 if nothing is below (VGGT, DUSt3R and Depth Anything 3 give 1 + exp(x)),
    else 0; values below 0 are logits (Pi3) and become shares by the logistic function. NaN is not sure.
    """
    if confidence.dtype.kind != "f":
        return confidence > 0  # ARKit's 0, 1, 2
    values = confidence.astype(np.float64)
    known = values[np.isfinite(values)]
    if not known.size:
        return np.ones(values.shape, bool)
    if known.min() < 0:
        values, known = (1 / (1 + np.exp(-v.clip(-50, 50))) for v in (values, known))
    elif known.min() >= 1:
        values, known = values - 1, known - 1
    return values >= SURE * np.median(known)


def _inverse(pose: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    try:
        return np.asarray(np.linalg.inv(pose), np.float64)
    except np.linalg.LinAlgError:
        raise ValueError(f"{name}: its pose cannot be inverted: {shown(pose[:3].tolist())}") from None


def _size(depth: tuple[int, ...], color: tuple[int, ...] | None, numbers: Numbers) -> Size | None:
    """(width, height) of the picture that a camera is of; None if that is not certain."""
    is_one = color is None or color[:2] == depth
    return (depth[1], depth[0]) if is_one and 0 < numbers[2] < depth[1] and 0 < numbers[3] < depth[0] else None
