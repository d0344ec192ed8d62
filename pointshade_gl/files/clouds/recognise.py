"""Which files are point clouds. Names decide where they are certain, else the content: NumPy's may be depth as well.

PLY, LAS, E57   always, as .xyz, .pts and the like
PCD             unless its points lie in a picture that a pinhole camera sees: that is a frame
NumPy           records with x, y and z, or an array (n, 3|4|6|7|9) of very many rows; (h, w) is depth, and so is what
                holds an array called depth; (h, w, 3) is a frame's points
.bin            float32 of a lidar, some of it below 0, which depth never is
.txt, .csv      many lines of 3, 4, 6, 7 or 9 numbers, or columns called x, y and z
"""

from __future__ import annotations

import math
from os import PathLike
from pathlib import Path
from typing import TypeGuard

import numpy as np

from ..access.content import FilePath, naming, read_head
from ..access.known_names import NOT_PICTURES, builtin_name
from ..arrays.compression import ZIP, Archive
from ..arrays.numpy_files import BROKEN, NUMPY, SURFACES, find_roles, is_named, npz_arrays, read_header
from ..arrays.ply_and_pcd import is_pcd
from ..containers.array_frames import is_organised
from .cloud_arrays import POSITIONS, lidar_columns
from .cloud_columns import COUNTS, TEXTS, has_positions, read_text_head
from .scans import E57, LAS

_HEAD = 1 << 16  # bytes that are looked at
_MANY = 100  # rows: no picture is so much higher than wide
CLOUD_SUFFIXES = (".ply", ".las", ".laz", ".e57", *TEXTS)
_MAYBE_TEXTS = (".txt", ".csv")


def is_cloud(source: FilePath | None) -> TypeGuard[FilePath]:
    """Whether it is the path of a file that `load_cloud` reads, and `load_frame` does not."""
    if not isinstance(source, str | PathLike) or builtin_name(source) is not None:
        return False
    path = Path(source)
    try:
        if not path.is_file():
            return False
        if path.suffix.lower() in CLOUD_SUFFIXES:
            return True
        return _is_cloud(path, read_head(path, _HEAD))
    except (OSError, ValueError):  # whoever reads it says so
        return path.suffix.lower() == ".pcd"


def _is_cloud(path: Path, head: bytes) -> bool:
    suffix = path.suffix.lower()
    if head.startswith((b"ply\n", b"ply\r", LAS, E57)):
        return True
    if suffix == ".pcd" or is_pcd(head):
        return not is_organised(path)
    if head.startswith(NUMPY):
        return _is_table(path)
    if head.startswith(ZIP):
        return suffix == ".npz" and _has_points(path)
    if suffix == ".bin" and not NOT_PICTURES.fullmatch(path.name):
        columns = lidar_columns(head, path.stat().st_size)
        return columns is not None and _has_negative(head, columns)
    if suffix in _MAYBE_TEXTS and (found := read_text_head(head)):
        return has_positions(found.names) or (found.columns in COUNTS and head.count(b"\n") > _MANY)
    return False


def _is_table(path: Path) -> bool:
    with path.open("rb") as file, naming(path, BROKEN):  # NumPy raises of everything for broken bytes
        shape, _, dtype = read_header(file, "biufV")
    if dtype.names:
        return has_positions(dtype.names)
    return dtype.kind in "iuf" and len(shape) == 2 and shape[1] in COUNTS and shape[0] > _MANY


def _has_points(path: Path) -> bool:
    arrays = npz_arrays(Archive(path))
    if any(role in SURFACES and len(_sides(arrays[name].shape)) > 2 for role, name in find_roles(arrays).items()):
        return False
    is_other = {"depth", "inverse", "ray"} & find_roles(arrays).keys()
    shapes = [array.shape for name, array in arrays.items() if is_named(name, POSITIONS)]
    return not is_other and any(len(shape) == 2 and shape[1] in COUNTS and shape[0] > _MANY for shape in shapes)


def _sides(shape: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(side for side in shape if side != 1) if math.prod(shape) else ()


def _has_negative(head: bytes, columns: int) -> bool:
    numbers = np.frombuffer(head[: len(head) // (4 * columns) * 4 * columns], "<f4")
    return bool(numbers.reshape(-1, columns)[:, :3].min() < 0)
