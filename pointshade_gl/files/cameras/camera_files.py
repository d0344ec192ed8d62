"""Reads camera intrinsics from whatever holds them: numbers, a matrix, text, JSON, YAML, .npy, .mat."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import as_array
from ...notes.notes import Note
from ...notes.words import cut, option, shown
from ...scene.camera import Camera
from ..access.content import MATLAB, parse_object, read_head, read_text, split_numbers
from ..access.limits import MAX_PIXELS
from ..arrays.array_files import NUMPY, read_numbers
from ..arrays.named_numbers import Named, read_named
from ..arrays.sintel import SINTEL, read_cam
from .camera_key_names import DISTORTION, FX, from_colmap, from_named, from_realsense, word
from .camera_numbers import from_matrix, from_numbers
from .colmap_model import read_colmap_cameras
from .intrinsics import Intrinsics

_CELLS = {"k00": "fx", "k11": "fy", "k02": "cx", "k12": "cy"}  # of a matrix, spelt K[0,0]
_EXPECTED = "a file, 'fx,fy,cx,cy', four numbers, a 3x3 or 4x4 matrix or a Camera"


def read_intrinsics(source: Any, note: Note, max_pixels: float = MAX_PIXELS, of_color: bool = False) -> Intrinsics:
    """Intrinsics from a path, 'fx,fy,cx,cy', numbers, a matrix or a Camera. Raises ValueError, OSError for others.

    of_color  of several cameras in a file take that of the colour picture: the depth was brought to it
    """
    if isinstance(source, Intrinsics):
        return source
    if isinstance(source, Camera):
        return Intrinsics("the camera", source.intrinsics, (source.width, source.height))
    if isinstance(source, str):
        numbers = split_numbers(source)
        if numbers is not None:
            return _from_numbers(numbers, option("intrinsics"), note)
    if isinstance(source, str | PathLike):
        return _read_file(Path(source), note, max_pixels, of_color)
    array = as_array(source, f"intrinsics must be {_EXPECTED}")
    return _from_numbers(array.ravel(), option("intrinsics"), note)


def _read_file(path: Path, note: Note, max_pixels: float, of_color: bool) -> Intrinsics:
    head = read_head(path, 512)
    if head.startswith(NUMPY):
        return _from_numbers(_first_matrix(read_numbers(path, max_pixels)), str(path), note)
    if head.startswith(MATLAB):
        from ..arrays.matlab import read_matrix_mat  # only here

        arrays = read_matrix_mat(path, max_pixels).items()
        return _from_names({name: array.ravel().tolist() for name, array in arrays}, path, note, of_color)
    if head.startswith(SINTEL):
        return _from_numbers(read_cam(path, max_pixels)[0], str(path), note)
    if path.suffix.lower() == ".bin":
        first, *others = read_colmap_cameras(path, max_pixels)
        return replace(first, alternatives=tuple(others))
    text = read_text(path, max_pixels)
    if cameras := from_colmap(text, str(path)):
        return next(iter(cameras.values()))
    if realsense := from_realsense(text, str(path)):
        return realsense
    named = _read_table(text) or read_named(text, path, max_pixels)
    if not named and not text.lstrip().startswith("{"):
        return _from_numbers(_first_matrix(read_numbers(path, max_pixels)), str(path), note)
    found = _from_names(named, path, note, of_color)
    if not text.lstrip().startswith("{"):
        return found
    kind = parse_object(text, path, max_pixels).get("depth_kind")
    if not isinstance(kind, str | None):
        raise ValueError(f"{path}: depth_kind must be a text, got {shown(kind)}")
    return replace(found, depth_kind=kind)


def _read_table(text: str) -> Named:
    """The first row of a table whose columns have names, such as `frame fx fy cx cy` or Virtual KITTI's K[0,0]."""
    head, *rows = [line.replace(", ", " ").split() for line in text.splitlines()[:2]] or [[]]
    head = head[0].split(",") if len(head) == 1 and rows else head
    values = split_numbers(" ".join(rows[0])) if rows else None
    if values is None or len(values) != len(head):
        return {}
    named = {_CELLS.get(word(name), name): [value] for name, value in zip(head, values, strict=True)}
    return named if any(word(name) in FX for name in named) else {}


def _from_names(named: Named, path: Path, note: Note, of_color: bool) -> Intrinsics:
    found = from_named(named, str(path), of_color)
    if not found:
        has = ", ".join([*named][:6]) or "no numbers"
        raise ValueError(
            f"{path} holds no camera: expected fx, fy, cx, cy, or a 3x3 matrix called K, intrinsic_matrix "
            f"or camera_matrix, or fov_x and fov_y in degrees; it has {cut(has)}"
        )
    if any(len(numbers) == 1 and numbers[0] for name, numbers in named.items() if word(name) in DISTORTION):
        note(f"{path}: the lens distortion is ignored, pictures are taken as undistorted")
    return replace(found[0], alternatives=tuple(found[1:]))


def _first_matrix(numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    """The first of several equal matrices of 3x3 or 4x4 that stand one after another, else all numbers."""
    for size in (9, 16):
        rows = numbers.reshape(-1, size) if numbers.size % size == 0 else numbers[:0]
        if len(rows) > 1 and from_matrix(rows[0]) and (rows == rows[0]).all():
            return rows[0]
    return numbers


def _from_numbers(numbers: Sequence[float] | NDArray[np.float64], name: str, note: Note) -> Intrinsics:
    """Four numbers, a matrix of 9, 12 or 16 row after row, or what else `from_numbers` knows."""
    values = np.asarray(numbers, np.float64)
    found = from_numbers(values, name)
    if found is None and values.size not in (4, 9, 12, 16):
        raise ValueError(f"{name} must hold fx, fy, cx, cy or a matrix of 3x3 or 4x4, got {values.size} numbers")
    if found is None:
        rows = values.reshape(3 if values.size < 16 else 4, -1).tolist()
        raise ValueError(f"{name} must be a matrix [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], got {rows}")
    if values.size in (9, 12, 16) and values[2] == 0 != found.numbers[2]:
        read = "[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]"
        note(f"{name}: rows and columns of the matrix are exchanged, it is read as {read}")
    return found
