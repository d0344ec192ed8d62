"""Intrinsics in every form that users have: numbers, text, our JSON, Open3D's, nerfstudio's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..checks import as_array
from ..notes import Note
from ..wording import option, shown
from .arrays import read_numbers
from .content import parse_object, read_text, split_numbers
from .limits import MAX_PIXELS

Size = tuple[int, int]  # width, height

_EXPECTED = "a file, 'fx,fy,cx,cy', four numbers, a 3x3 or 4x4 matrix or a Camera"
_DISTORTION = ("k1", "k2", "k3", "k4", "p1", "p2")


@dataclass(frozen=True)
class Intrinsics:
    """What the source says: (fx, fy, cx, cy), the size of their picture, how the depth is coded; None = nothing."""

    name: str
    numbers: tuple[float, float, float, float]
    size: Size | None = None
    depth_scale: float | None = None
    depth_kind: str | None = None
    baseline: float | None = None


def read_intrinsics(source: Any, note: Note, max_pixels: float = MAX_PIXELS) -> Intrinsics:
    """Intrinsics from a path, a text 'fx,fy,cx,cy', four numbers, a matrix or a Camera.

    Raises ValueError for any other content, OSError if the file cannot be read.
    """
    if isinstance(source, Camera):
        return Intrinsics("the camera", source.intrinsics, (source.width, source.height))
    if isinstance(source, str):
        numbers = split_numbers(source)
        if numbers is not None:
            return _from_numbers(numbers, option("intrinsics"), note)
    if isinstance(source, str | PathLike):
        return _read_file(Path(source), note, max_pixels)
    array = as_array(source, f"intrinsics must be {_EXPECTED}")
    return _from_numbers(array.ravel(), option("intrinsics"), note)


def place_camera(intrinsics: Intrinsics, depth: Size, color: Size | None, note: Note) -> Camera:
    """The camera of the depth picture. Sizes are (width, height), color is None without a colour picture.

    Raises ValueError when the intrinsics belong to neither picture.
    """
    size = intrinsics.size or _guess_size(intrinsics, depth, color, note)
    if size not in (depth, color):
        seen = f"depth is {_text(depth)} and " + (f"color is {_text(color)}" if color else "there is no color")
        raise ValueError(
            f"{intrinsics.name}: intrinsics are for {_text(size)} pixels, but {seen}: "
            "pass the intrinsics of one of the two pictures"
        )
    try:
        camera = Camera(*intrinsics.numbers, *size)
    except ValueError as error:
        raise ValueError(f"{intrinsics.name}: {error}") from None
    if size == depth:
        return camera
    note(f"{intrinsics.name}: intrinsics are for the color of {_text(size)}, scaled to the depth's {_text(depth)}")
    return camera.resized(*depth)


def _guess_size(intrinsics: Intrinsics, depth: Size, color: Size | None, note: Note) -> Size:
    """The picture whose middle is nearest to the principal point, among those that contain it."""
    cx, cy = intrinsics.numbers[2:]

    def distance(size: Size) -> float:
        return max(abs(cx / size[0] - 0.5), abs(cy / size[1] - 0.5))

    size = min((depth, color or depth), key=distance)  # the depth when both are as near
    if not distance(size) <= 0.5:
        raise ValueError(
            f"{intrinsics.name}: the principal point ({cx:g}, {cy:g}) must lie in the depth picture of {_text(depth)}"
        )
    which = "depth" if size == depth else "color"
    note(f"{intrinsics.name}: no picture size is given, taken as for the {which} picture of {_text(size)}")
    return size


def _text(size: Size) -> str:
    return f"{size[0]}x{size[1]}"


def _read_file(path: Path, note: Note, max_pixels: float) -> Intrinsics:
    text = read_text(path, max_pixels)
    if not text.lstrip().startswith("{"):
        return _from_numbers(read_numbers(path, max_pixels), str(path), note)
    data = parse_object(text, path, max_pixels)
    if isinstance(data.get("intrinsic"), dict):  # Open3D's camera parameters hold the extrinsic beside it
        data = data["intrinsic"]
    if "intrinsic_matrix" in data:
        return _from_open3d(data, path, note)
    if "fl_x" in data:
        return _from_nerfstudio(data, path, note)
    missing = [key for key in ("fx", "fy", "cx", "cy") if key not in data]
    if missing:
        raise ValueError(
            f"{path} has no {', '.join(missing)}: expected fx, fy, cx, cy, or Open3D's intrinsic_matrix, "
            "or nerfstudio's fl_x, fl_y, cx, cy"
        )
    fx, fy, cx, cy = (_number(data, key, path) for key in ("fx", "fy", "cx", "cy"))
    size, scale = _size(data, "width", "height", path), _optional(data, "depth_scale", path)
    kind = data.get("depth_kind")
    if not isinstance(kind, str | None):
        raise ValueError(f"{path}: depth_kind must be a text, got {shown(kind)}")
    return Intrinsics(str(path), (fx, fy, cx, cy), size, scale, kind, _optional(data, "baseline", path))


def _from_open3d(data: dict[str, Any], path: Path, note: Note) -> Intrinsics:
    try:
        matrix = np.asarray(data["intrinsic_matrix"], np.float64)
    except (TypeError, ValueError, OverflowError):
        matrix = np.empty(0)
    if matrix.size != 9:
        raise ValueError(f"{path}: intrinsic_matrix must be a list of 9 numbers, got {shown(data['intrinsic_matrix'])}")
    if matrix.ndim == 1:
        matrix = matrix.reshape(3, 3).T  # Open3D writes columns
    numbers = _from_numbers(matrix.ravel(), str(path), note).numbers
    return Intrinsics(str(path), numbers, _size(data, "width", "height", path))


def _from_nerfstudio(data: dict[str, Any], path: Path, note: Note) -> Intrinsics:
    if any(data.get(key) for key in _DISTORTION):
        note(f"{path}: the lens distortion is ignored, pictures are taken as undistorted")
    fx = _number(data, "fl_x", path)
    fy = _number(data, "fl_y", path) if "fl_y" in data else fx
    metres = _optional(data, "depth_unit_scale_factor", path)
    # nerfstudio counts from the picture's corner, pixel centres are at +0.5 there and at +0 here
    numbers = (fx, fy, _number(data, "cx", path) - 0.5, _number(data, "cy", path) - 0.5)
    return Intrinsics(str(path), numbers, _size(data, "w", "h", path), 1 / metres if metres else None)


def _from_numbers(numbers: Sequence[float] | NDArray[np.float64], name: str, note: Note) -> Intrinsics:
    """Four numbers, or a matrix of 9 or 16 row after row."""
    values = np.asarray(numbers, np.float64)
    if values.size == 4:
        fx, fy, cx, cy = values.tolist()
        return Intrinsics(name, (fx, fy, cx, cy))
    if values.size not in (9, 16):
        raise ValueError(f"{name} must hold fx, fy, cx, cy or a matrix of 3x3 or 4x4, got {values.size} numbers")
    side = 3 if values.size == 9 else 4
    k = values.reshape(side, side)[:3, :3]
    if k[2, 0] and k[2, 1] and not (k[0, 2] or k[1, 2]):
        note(
            f"{name}: rows and columns of the matrix are exchanged, it is read as [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]"
        )
        k = k.T
    if abs(k[2] - (0, 0, 1)).max() > 1e-6 or k[1, 0] != 0:
        raise ValueError(f"{name} must be a matrix [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], got {k.tolist()}")
    return Intrinsics(name, (float(k[0, 0]), float(k[1, 1]), float(k[0, 2]), float(k[1, 2])))


def _number(data: dict[str, Any], key: str, path: Path) -> float:
    value = data.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{path}: {key} must be a number, got {shown(value)}")
    try:
        return float(value)
    except OverflowError:  # JSON has whole numbers of any length
        return float("inf")


def _optional(data: dict[str, Any], key: str, path: Path) -> float | None:
    return None if data.get(key) is None else _number(data, key, path)


def _size(data: dict[str, Any], width: str, height: str, path: Path) -> Size | None:
    if data.get(width) is None and data.get(height) is None:
        return None
    w, h = _number(data, width, path), _number(data, height, path)
    if not (w >= 1 and h >= 1 and w % 1 == h % 1 == 0):
        raise ValueError(f"{path}: {width} and {height} must be whole numbers of pixels above 0, got {w:g}x{h:g}")
    return int(w), int(h)
