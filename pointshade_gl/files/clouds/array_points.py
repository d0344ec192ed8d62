"""The points of NumPy's files: (n, 3) and more columns, records with names, or arrays by name in an .npz."""

from __future__ import annotations

import math
from typing import Any

from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import shown
from ..access.content import FilePath, naming, open_regular
from ..access.limits import FILE_BYTES, check_limit
from ..arrays.array_files import BROKEN, read_exactly, read_header
from ..arrays.array_roles import is_named, list_arrays
from ..arrays.stored_arrays import NpzArray
from ..arrays.zip_archive import Archive
from .field_names import found_in
from .found_points import FoundPoints, check_points
from .numbered_columns import COUNTS, found_by_number

POSITIONS = (
    "points", "xyz", "positions", "position", "pos", "vertices", "verts", "pts", "coords", "coord", "point_cloud",
    "pointcloud", "cloud", "pc", "data", "arr_0",
)  # fmt: skip
_BESIDE = {
    "colors": ("colors", "color", "colours", "colour", "rgb", "rgbs"),
    "normals": ("normals", "normal"),
    "intensity": ("intensity", "intensities", "reflectance", "remission"),
    "sizes": ("sizes", "radii", "radius"),
    "confidence": ("confidence",),
    "classes": ("classification", "classes"),
}
_RATIO = 100  # times smaller than its points no archive of points is, unless it is a bomb
_SMALL = 2**26  # bytes that are unpacked whatever they were packed to


def read_npy_points(path: FilePath, note: Note, max_pixels: float) -> FoundPoints:
    """The points of an .npy file. Raises ValueError for one that is broken, or of another shape."""
    with open_regular(path) as file:
        with naming(path, BROKEN):
            shape, is_fortran, dtype = read_header(file, "biufV")
        check_limit(math.prod(shape) * dtype.itemsize, f"{path} is an array {shown(shape)}", max_pixels, FILE_BYTES)
        with naming(path, BROKEN, (ValueError,)):
            array = read_exactly(file, math.prod(shape) * dtype.itemsize)
    array = array.view(dtype).reshape(shape, order="F" if is_fortran else "C")
    with naming(path, "cannot be read as a point cloud", (ValueError,)):
        if array.dtype.names:
            rows = array.ravel()
            check_points(len(rows), path, max_pixels)
            return found_in({name: rows[name] for name in array.dtype.names}, "NumPy, columns by their names")
        table = as_table(array)
        check_points(len(table), path, max_pixels)
        return found_by_number(table, f"NumPy, {table.shape[1]} columns", str(path), note)


def read_npz_points(path: FilePath, note: Note, max_pixels: float) -> FoundPoints:
    """The points of an .npz file, by the names of its arrays. Raises ValueError for one without any."""
    archive = Archive(path, max_pixels)
    arrays = {name.removesuffix(".npy"): NpzArray(archive, name) for name in archive.names if name.endswith(".npy")}
    named = _named(arrays, POSITIONS)
    if named is None and len(arrays) == 1:
        named = next(iter(arrays))
    if named is None:
        listed = list_arrays({name: array.shape for name, array in arrays.items()})
        raise ValueError(f"{path} must hold an array points of shape (n, 3), got {listed or 'none'}")

    def read(name: str) -> NDArray[Any]:
        size = math.prod(arrays[name].shape) * arrays[name].dtype.itemsize
        if size > max(_SMALL, _RATIO * archive.packed(f"{name}.npy")):
            raise ValueError(f"{path}/{shown(name)[1:-1]} unpacks to {size} bytes, more than points ever do")
        return arrays[name].part(())

    with naming(path, "cannot be read as a point cloud", (ValueError,)):
        table = as_table(read(named))
        check_points(len(table), path, max_pixels)
        found = found_by_number(table, "NumPy archive", str(path), note)
        for role, names in _BESIDE.items():
            if (name := _named(arrays, names)) and math.prod(arrays[name].shape[:-1] or (1,)):
                setattr(found, role, _fitting(read(name), len(table), role, name))
        return found


def _named(arrays: dict[str, NpzArray], names: tuple[str, ...]) -> str | None:
    return next((name for one in names for name in arrays if is_named(name, [one])), None)


def _fitting(array: NDArray[Any], count: int, role: str, name: str) -> NDArray[Any]:
    is_three = role in ("colors", "normals")
    array = array.reshape(-1, array.shape[-1])[:, :3] if is_three and array.ndim > 1 else array.ravel()
    if array.shape != ((count, 3) if is_three else (count,)):
        raise ValueError(f"its {name} have shape {array.shape}, and there are {count} points")
    return array


def as_table(array: NDArray[Any]) -> NDArray[Any]:
    """(n, c) of an array with a point in each row, in each pixel (h, w, c), or in each of 3 to 9 long columns."""
    if array.dtype.kind not in "iuf":
        raise ValueError(f"it holds {array.dtype}, expected numbers")
    if array.ndim == 2 and array.shape[0] in COUNTS and array.shape[1] > COUNTS[-1]:
        return array.T
    if array.ndim < 2 or array.shape[-1] < 3:
        raise ValueError(f"it has shape {array.shape}, expected (n, 3)")
    return array.reshape(-1, array.shape[-1])
