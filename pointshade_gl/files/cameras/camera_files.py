"""Reads camera intrinsics from whatever holds them: numbers, a matrix, text, JSON, COLMAP, nerfstudio, EXIF."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import as_array
from ...notes.notes import Note
from ...notes.words import cut, option, shown
from ...scene.camera import OPENGL, Camera, Matrices, from_quaternions, inverted
from ..access import content
from ..access.content import LONGEST_SIDE, MATLAB, MAX_PIXELS, FilePath
from ..access.folders import natural
from ..arrays.named_numbers import Named, named_of, read_named
from ..arrays.numpy_files import NUMPY, SINTEL, read_cam, read_numbers
from ..pictures.picture_files import TURNED, opened_picture
from . import intrinsics
from .intrinsics import FX, Intrinsics
from .lens_names import COLMAP


def read_colmap_cameras(path: Path, max_pixels: float = MAX_PIXELS) -> list[Intrinsics]:
    """The cameras in their order. Raises ValueError for any other content."""
    data, found = content.read_bytes(path, max_pixels), []
    try:
        (count,), at = struct.unpack_from("<Q", data), 8
        for _ in range(count):
            _, model, width, height = struct.unpack_from("<iiQQ", data, at)
            title, order = COLMAP[model] if 0 <= model < len(COLMAP) else ("", [])
            numbers = struct.unpack_from(f"<{len(order)}d", data, at + 24)
            camera = intrinsics.colmap_camera(title, (width, height), numbers, str(path))
            if camera is None:
                raise KeyError
            found.append(camera)
            at += 24 + 8 * len(order)
    except (struct.error, KeyError):
        raise ValueError(f"{path} holds no cameras of COLMAP's") from None
    if not found:
        raise ValueError(f"{path} holds no camera")
    return found


def read_colmap_images(path: Path, max_pixels: float = MAX_PIXELS) -> tuple[Matrices, list[str]]:
    """(n, 4, 4) camera-to-world in OpenCV axes, and the pictures' names. Raises ValueError for any other content."""
    data, rows, names = content.read_bytes(path, max_pixels), [], []
    try:
        (count,), at = struct.unpack_from("<Q", data), 8
        for _ in range(count):
            rows.append(struct.unpack_from("<7d", data, at + 4))
            end = data.index(b"\0", at + 64)
            names.append(data[at + 64 : end].decode("utf-8", "replace"))
            (points,) = struct.unpack_from("<Q", data, end + 1)
            at = end + 9 + 24 * points
    except (struct.error, ValueError, OverflowError):
        raise ValueError(f"{path} holds no images of COLMAP's") from None
    turned: NDArray[np.float64] = np.array(rows, np.float64).reshape(-1, 7)
    return inverted(from_quaternions(turned[:, 4:], turned[:, [1, 2, 3, 0]])), names


_CELLS = {"k00": "fx", "k11": "fy", "k02": "cx", "k12": "cy"}  # of a matrix, spelt K[0,0]
_EXPECTED = "a file, 'fx,fy,cx,cy', four numbers, a 3x3 or 4x4 matrix or a Camera"


def read_intrinsics(source: Any, note: Note, max_pixels: float = MAX_PIXELS, of_color: bool = False) -> Intrinsics:
    """Intrinsics from a path, 'fx,fy,cx,cy', numbers, a matrix or a Camera. Raises ValueError, OSError for others.
    of_color: of several cameras in a file take that of the colour picture: the depth was brought to it."""
    if isinstance(source, Intrinsics):
        return source
    if isinstance(source, Camera):
        return Intrinsics("the camera", source.intrinsics, (source.width, source.height))
    if isinstance(source, str) and (numbers := content.split_numbers(source)) is not None:
        return _from_numbers(numbers, option("intrinsics"), note)
    if isinstance(source, str | PathLike):
        return _read_file(Path(source), note, max_pixels, of_color)
    array = as_array(source, f"intrinsics must be {_EXPECTED}")
    return _from_numbers(array.ravel(), option("intrinsics"), note)


def _read_file(path: Path, note: Note, max_pixels: float, of_color: bool) -> Intrinsics:
    head = content.read_head(path, 512)
    if head.startswith(NUMPY):
        return _from_numbers(_first_matrix(read_numbers(path, max_pixels)), str(path), note)
    if head.startswith(MATLAB):
        from ..arrays.matlab import read_matrix_mat  # only here

        return _from_names(read_matrix_mat(path, max_pixels), path, of_color)
    if head.startswith(SINTEL):
        return _from_numbers(read_cam(path, max_pixels)[0], str(path), note)
    if path.suffix.lower() == ".bin":
        first, *others = read_colmap_cameras(path, max_pixels)
        return replace(first, alternatives=tuple(others))
    text = content.read_text(path, max_pixels)
    if cameras := intrinsics.from_colmap(text, str(path)):
        return next(iter(cameras.values()))
    if realsense := intrinsics.from_realsense(text, str(path)):
        return realsense
    is_json = text.lstrip().startswith("{")
    data = content.parse_object(text, path, max_pixels) if is_json else {}
    named = named_of(data) if is_json else _read_table(text) or read_named(text, path, max_pixels)
    if not named and not is_json:
        return _from_numbers(_first_matrix(read_numbers(path, max_pixels)), str(path), note)
    found = _from_names(named, path, of_color)
    if not is_json:
        return found
    kind = data.get("depth_kind")
    if not isinstance(kind, str | None):
        raise ValueError(f"{path}: depth_kind must be a text, got {shown(kind)}")
    return replace(found, depth_kind=kind)


def _read_table(text: str) -> Named:
    """The first row of a table whose columns have names, such as `frame fx fy cx cy` or Virtual KITTI's K[0,0]."""
    head, *rows = [line.replace(", ", " ").split() for line in text.splitlines()[:2]] or [[]]
    head = head[0].split(",") if len(head) == 1 and rows else head
    values = content.split_numbers(" ".join(rows[0])) if rows else None
    if values is None or len(values) != len(head):
        return Named()
    named = {_CELLS.get(intrinsics.word(name), name): [value] for name, value in zip(head, values, strict=True)}
    return Named(named.items() if any(intrinsics.word(name) in FX for name in named) else ())


def _from_names(named: Mapping[str, list[float]], path: Path, of_color: bool) -> Intrinsics:
    found = intrinsics.from_named(named, str(path), of_color)
    if not found:
        has = ", ".join([*named][:6]) or "no numbers"
        matrix = "a 3x3 matrix called K, intrinsic_matrix or camera_matrix"
        expected = f"expected fx, fy, cx, cy, or {matrix}, or fov_x and fov_y in degrees"
        raise ValueError(f"{path} holds no camera: {expected}; it has {cut(has)}")
    return replace(found[0], alternatives=tuple(found[1:]))


def _first_matrix(numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    """The first of several equal matrices of 3x3 or 4x4 that stand one after another, else all numbers."""
    for size in (9, 16):
        rows = numbers.reshape(-1, size) if numbers.size % size == 0 else numbers[:0]
        if len(rows) > 1 and intrinsics.from_matrix(rows[0]) and (rows == rows[0]).all():
            return rows[0]
    return numbers


def _from_numbers(numbers: Sequence[float] | NDArray[np.float64], name: str, note: Note) -> Intrinsics:
    """Four numbers, a matrix of 9, 12 or 16 row after row, or what else `from_numbers` knows."""
    values = np.asarray(numbers, np.float64)
    found = intrinsics.from_numbers(values, name)
    if found is None and values.size not in (4, 9, 12, 16):
        raise ValueError(f"{name} must hold fx, fy, cx, cy or a matrix of 3x3 or 4x4, got {values.size} numbers")
    form = "[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]"
    if found is None:
        rows = values.reshape(3 if values.size < 16 else 4, -1).tolist()
        raise ValueError(f"{name} must be a matrix {form}, got {rows}")
    if values.size in (9, 12, 16) and values[2] == 0 != found.numbers[2]:
        note(f"{name}: rows and columns of the matrix are exchanged, it is read as {form}")
    return found


class CameraEntry(NamedTuple):
    """One frame: names of its files, (4, 4) camera-to-world in OpenCV axes, its own camera if the file has several."""

    color: str | None
    depth: str | None
    pose: NDArray[np.float64]
    camera: Intrinsics | None


def read_transforms(path: Path, max_pixels: float = MAX_PIXELS) -> list[CameraEntry]:
    """The frames of a transforms.json, by the numbers in their names. Raises ValueError for another content."""
    data = content.parse_object(content.read_text(path, max_pixels), path, max_pixels)
    frames, scale = data.get("frames", []), data.get("applied_scale")
    if not isinstance(frames, list):
        raise ValueError(f"{path}: frames must be a list, got {shown(frames)}")
    per_metre = scale if isinstance(scale, int | float) and scale > 0 else 1.0
    shared = intrinsics.from_named(named_of({key: value for key, value in data.items() if key != "frames"}), str(path))
    common = {key: value for key, value in data.items() if isinstance(value, int | float | str)}
    entries = [_entry(frame, common, per_metre, path) for frame in frames]
    if shared:  # it may state the unit of the depth for all
        entries = [
            one._replace(camera=intrinsics.merged(one.camera, shared[0])) if one.camera else one for one in entries
        ]
    return sorted(entries, key=lambda one: natural(one.color or one.depth or ""))


@np.errstate(invalid="ignore", over="ignore")  # poses are checked later
def _entry(frame: Any, common: dict[str, Any], per_metre: float, path: Path) -> CameraEntry:
    try:
        pose = np.array(frame["transform_matrix"], np.float64).reshape(4, 4) @ OPENGL
        pose[:3, 3] /= per_metre
    except (KeyError, TypeError, ValueError, OverflowError):
        raise ValueError(f"{path}: every frame must have a transform_matrix of 4x4 numbers") from None
    names = frame.get("file_path"), frame.get("depth_file_path", frame.get("depth_path"))
    color, depth = (name if isinstance(name, str) else None for name in names)
    own = common | {key: value for key, value in frame.items() if key != "transform_matrix"}
    cameras = intrinsics.from_named(named_of(own), str(path)) if "fl_x" in frame else []
    return CameraEntry(color, depth, pose, cameras[0] if cameras else None)


EXIF = 0x8769  # the tag under which the others lie
_FOCAL_35, _WIDTH, _HEIGHT = 0xA405, 0xA002, 0xA003
_DIAGONAL_35 = math.hypot(36, 24)  # mm; cameras compare diagonals (CIPA DCG-001): a phone's 4:3 has no width of 36 mm
_SAME_SHAPE = 0.02


def camera_from_exif(path: FilePath, max_pixels: float = MAX_PIXELS) -> Intrinsics | None:
    """The camera of a picture with EXIF FocalLengthIn35mmFilm, upright; None if it has none, or was cropped. Its
    principal point is the middle. Whole millimetres make it right to a few per cent."""
    head = content.read_head(path)
    with content.open_regular(path) as file:
        content.check_size(file, path, max_pixels)
        try:
            with opened_picture(file, head) as image:
                return camera_of_lens(str(path), image.getexif(), image.size)
        except Exception:  # broken bytes make Pillow raise of everything: then the picture has none
            return None


def camera_of_lens(name: str, exif: Any, size: tuple[int, int]) -> Intrinsics | None:
    """The same from EXIF data (`PIL.Image.Exif`) of a picture of this width and height, not yet turned."""
    tags = exif.get_ifd(EXIF)
    focal, width, height = (_number(tags.get(key)) for key in (_FOCAL_35, _WIDTH, _HEIGHT))
    if not 1 <= focal <= 10_000 or not all(1 <= side <= LONGEST_SIDE for side in size):
        return None
    if width > 0 and height > 0 and abs(_elongation(*size) / _elongation(width, height) - 1) > _SAME_SHAPE:
        return None
    if exif.get(TURNED, 1) in (5, 6, 7, 8):
        size = size[1], size[0]
    pixels = focal / _DIAGONAL_35 * math.hypot(*size)
    return Intrinsics(name, (pixels, pixels, (size[0] - 1) / 2, (size[1] - 1) / 2), size)


def _elongation(width: float, height: float) -> float:
    return max(width, height) / min(width, height)


def _number(value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError, ZeroDivisionError, OverflowError):
        return 0.0
