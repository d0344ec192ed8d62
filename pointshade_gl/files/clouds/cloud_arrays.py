"""The points of NumPy's files, of plain float32 (KITTI), PLY and PCD."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import shown
from ...scene.cloud import UPS, PointCloud, axes_in_words, front_in_words
from ..access.content import FILE_BYTES, FilePath, check_limit, naming, read_bytes, read_head, split_numbers
from ..arrays.compression import Archive
from ..arrays.numpy_files import NpyArray, NpzArray, is_named, list_arrays, plain
from ..arrays.ply_and_pcd import read_pcd, read_ply
from . import cloud_columns
from .cloud_columns import COUNTS, CloudOptions, FoundPoints
from .placing import is_before_camera
from .splat_files import PACKED, is_trained, packed_splats, splats_in, trained_columns

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


def read_npy_points(path: FilePath, note: Note, options: CloudOptions) -> FoundPoints:
    """The points of an .npy file. Raises ValueError for one that is broken, or of another shape."""
    held = NpyArray(path, "biufV")
    size = math.prod(held.shape) * held.dtype.itemsize
    check_limit(size, f"{path} is an array {shown(held.shape)}", options.max_pixels, FILE_BYTES)
    with naming(path, "cannot be read as a point cloud", (ValueError,)):
        return _found_in_array(held.part(()), "NumPy", path, note, options)


def _found_in_array(array: NDArray[Any], form: str, path: FilePath, note: Note, options: CloudOptions) -> FoundPoints:
    """The points of an array: records with named fields, or a table."""
    if array.dtype.names:
        rows = array.ravel()
        cloud_columns.check_points(len(rows), path, options.max_pixels)
        return cloud_columns.found_in(
            {name: rows[name] for name in array.dtype.names}, f"{form}, columns by their names", options
        )
    table = as_table(array)
    cloud_columns.check_points(len(table), path, options.max_pixels)
    return cloud_columns.found_by_number(table, f"{form}, {table.shape[1]} columns", str(path), note, options)


def read_npz_points(path: FilePath, note: Note, options: CloudOptions) -> FoundPoints:
    """The points of an .npz file, by the names of its arrays. Raises ValueError for one without any."""
    archive = Archive(path, options.max_pixels)
    arrays = {
        name.removesuffix(".npy"): NpzArray(archive, name, "biufV") for name in archive.names if name.endswith(".npy")
    }
    named = _named(arrays, POSITIONS)
    if named is None and len(arrays) == 1:
        named = next(iter(arrays))
    singles = {name: one for name, one in arrays.items() if len(one.shape) == 1 and not one.dtype.names}
    is_columns = named is None and cloud_columns.has_positions(singles)
    if named is None and not is_columns:
        listed = list_arrays({name: array.shape for name, array in arrays.items()})
        raise ValueError(f"{path} must hold an array points of shape (n, 3), got {listed or 'none'}")

    def read(name: str) -> NDArray[Any]:
        size = math.prod(arrays[name].shape) * arrays[name].dtype.itemsize
        if size > max(_SMALL, _RATIO * archive.packed(f"{name}.npy")):
            raise ValueError(f"{path}/{shown(name)[1:-1]} unpacks to {size} bytes, more than points ever do")
        return arrays[name].part(())

    with naming(path, "cannot be read as a point cloud", (ValueError,)):
        if named is None:
            columns = {name: read(name) for name in singles}
            if len({len(one) for one in columns.values()}) > 1:
                listed = list_arrays({name: array.shape for name, array in arrays.items()})
                raise ValueError(f"its columns differ in length: {listed}")
            cloud_columns.check_points(len(next(iter(columns.values()))), path, options.max_pixels)
            return cloud_columns.found_in(columns, "NumPy archive, columns by their names", options)
        found = _found_in_array(read(named), "NumPy archive", path, note, options)
        for name in singles:
            if name != named and arrays[name].shape == (len(found),):
                found.fields[name] = read(name) if plain(name) == plain(options.color_by or "") else None
        for role, names in _BESIDE.items():
            if (name := _named(arrays, names)) and math.prod(arrays[name].shape[:-1] or (1,)):
                array, is_three = read(name), role in ("colors", "normals")
                array = array.reshape(-1, array.shape[-1])[:, :3] if is_three and array.ndim > 1 else array.ravel()
                if array.shape != ((len(found), 3) if is_three else (len(found),)):
                    raise ValueError(f"its {name} have shape {array.shape}, and there are {len(found)} points")
                setattr(found, role, array)
        return found


def _named(arrays: dict[str, NpzArray], names: tuple[str, ...]) -> str | None:
    return next((name for one in names for name in arrays if is_named(name, [one])), None)


def as_table(array: NDArray[Any]) -> NDArray[Any]:
    """(n, c) of an array with a point in each row, in each pixel (h, w, c), or in each of 3 to 9 long columns."""
    if array.dtype.kind not in "iuf":
        raise ValueError(f"it holds {array.dtype}, expected numbers")
    if array.ndim == 2 and array.shape[0] in COUNTS and array.shape[1] > COUNTS[-1]:
        return array.T
    if array.ndim < 2 or array.shape[-1] < 3:
        raise ValueError(f"it has shape {array.shape}, expected (n, 3)")
    return array.reshape(-1, array.shape[-1])


_COLUMNS = 4, 5, 6
_OTHERS = 3, 7  # columns of other files
_FARTHEST = 1000.0  # metres
_BRIGHTEST = 255.0
_LOOKED_AT = 4096  # points
_FEWEST = 4
HEAD = _LOOKED_AT * 6 * 4  # bytes that show what it is


def read_lidar_points(path: FilePath, note: Note, options: CloudOptions) -> FoundPoints:
    """The points of a scan. Raises ValueError for other numbers."""
    data = read_bytes(path, options.max_pixels)
    columns = lidar_columns(data[:HEAD], len(data))
    if columns is None:
        expected = "float32 x, y, z and intensity, as in KITTI; other numbers without a header can be saved as .npy"
        raise ValueError(f"{path} is no scan of a lidar: expected {expected}")
    table = np.frombuffer(data, "<f4").reshape(-1, columns)
    cloud_columns.check_points(len(table), path, options.max_pixels)
    if options.columns is not None:
        found = cloud_columns.found_by_number(table, f"float32, {columns} columns", str(path), note, options)
        found.up, found.up_from = "z", "usual of lidars"
        return found
    more: dict[str, Any] = {"colors": table[:, 3:]} if columns == 6 else {"intensity": table[:, 3]}
    names = ("red", "green", "blue") if columns == 6 else ("intensity", "ring")
    more["fields"] = dict(zip(names, table[:, 3:].T, strict=False))
    return FoundPoints(f"float32, {columns} columns", table[:, :3], up="z", up_from="usual of lidars", **more)


def lidar_columns(head: bytes, size: int) -> int | None:
    """How many numbers a point has, from the beginning of a file of that size; None if it is no scan."""
    numbers = np.frombuffer(head[: len(head) // 4 * 4], "<f4")
    if size % 4 or not np.isfinite(numbers).all() or not numbers.size or np.abs(numbers).max() > _FARTHEST:
        return None
    fitting = [one for one in _COLUMNS if size % (4 * one) == 0 and numbers.size >= _FEWEST * one]
    best = max((*fitting, *_OTHERS), key=lambda one: _apart(numbers, one))
    if best not in fitting:
        return None
    table = _table(numbers, best)
    more = table[:, 3:]  # from 0 to 1, or to 255
    is_whole = best != 5 or (more[:, 1] % 1 == 0).all()  # a ring's number
    is_wide = np.ptp(table[:, :2], 0).min() > 0
    return best if is_whole and is_wide and more.min() >= 0 and more.max() <= _BRIGHTEST else None


def _table(numbers: NDArray[np.float32], columns: int) -> NDArray[np.float32]:
    return numbers[: len(numbers) // columns * columns].reshape(-1, columns)


def _apart(numbers: NDArray[np.float32], columns: int) -> float:
    """How much the columns differ from each other, which they do most if there are so many."""
    if len(numbers) < columns:
        return 0.0
    table = _table(numbers, columns).astype(np.float64)
    return float(table.mean(0).var() + np.abs(table).mean(0).var())


_NOWHERE = [0, 0, 0, 1, 0, 0, 0]  # the viewpoint of a file that has none


def read_pcd_points(path: FilePath, note: Note, options: CloudOptions) -> FoundPoints:
    """The points of a PCD file, row after row. Raises ValueError for one that is broken, or has no x, y and z."""
    pcd = read_pcd(path, options.max_pixels)
    with naming(path, "cannot be read as a point cloud", (ValueError,)):
        found = cloud_columns.found_in(pcd.columns, f"PCD, {pcd.header.coding}", options)
    view = pcd.header.viewpoint
    if len(view) == 7 and view != _NOWHERE and np.isfinite(view).all():
        found.seen_from = np.array(view[:3])
    found.up, found.up_from, found.up_is_guessed = "z", "usual in PCD files", True
    if is_before_camera(found.positions):
        found.up, found.up_from = "-y", "all of it lies in front of a camera at 0, 0, 0"
        found.seen_from = np.zeros(3) if found.seen_from is None else found.seen_from
    return found


PLY = (b"ply\n", b"ply\r")
VERTEX, HEADER = "vertex", 2**13
_UP, _ORIGIN, _SEEN_FROM = "up", "origin", "seen_from"  # first words of comments
_FAR = 1000.0  # sizes of a cloud from zero: beyond, float32 would move its points visibly
_PROPERTIES = {  # what is written of each value
    "positions": "x y z",
    "normals": "nx ny nz",
    "colors": "red green blue",
    "sizes": "radius",
    "confidence": "confidence",
    "seen_from": "seen_x seen_y seen_z",
}
_KINDS = {"colors": "u1", "seen_from": "<f8"}  # else float


def read_ply_points(path: FilePath, note: Note, options: CloudOptions) -> FoundPoints:
    """The vertices of a PLY file. Raises ValueError for one that is broken, or has none."""
    head = read_head(path, HEADER)
    is_packed = b"property uint packed_position" in head  # and has other elements behind its vertices
    ply = read_ply(path, options.max_pixels, "" if is_packed else VERTEX)
    with naming(path, "cannot be read as a point cloud", (ValueError,)):
        if VERTEX not in ply.elements:
            raise ValueError(f"it has no vertices, only {', '.join([*ply.elements][:12]) or 'a header'}")
        rows = ply.elements[VERTEX]
        cloud_columns.check_points(len(rows), path, options.max_pixels)
        columns = {name: rows[name] for name in rows.dtype.names or ()}
        form = f"PLY, {ply.form}"
        if {*PACKED} <= columns.keys() and "chunk" in ply.elements:
            return packed_splats(ply.elements, path, note)
        if is_trained(columns):
            return splats_in(columns, form, ply.comments, path, note)
        return _as_commented(cloud_columns.found_in(columns, form, options), ply.comments)


def vertices_of(cloud: PointCloud) -> NDArray[np.void]:
    """(n,) structured, a field for each property: those values that the cloud has."""
    if cloud.gaussians is not None:
        return trained_columns(cloud)
    world = cloud.positions + cloud.origin
    size = np.ptp(world, 0).max() if len(world) else 0.0
    is_far = len(world) > 0 and np.abs(world).max() > _FAR * size
    values = {name: getattr(cloud, name) for name in _PROPERTIES} | {"positions": world}
    if cloud.seen_from is not None:
        values["seen_from"] = None if cloud.seen_from.ndim == 1 else cloud.seen_from + cloud.origin
    kinds = _KINDS | {"positions": "<f8" if is_far or cloud.origin.any() else "<f4"}
    columns = [
        (name, kinds.get(key, "<f4"), values[key][:, k] if values[key].ndim == 2 else values[key])
        for key, names in _PROPERTIES.items()
        if values[key] is not None
        for k, name in enumerate(names.split())
    ]
    rows = np.empty(len(cloud), [(name, kind) for name, kind, _ in columns])
    for name, _, column in columns:
        rows[name] = column
    return rows


def comments_of(cloud: PointCloud) -> list[str]:
    """What the header holds of a cloud beside its points, for `read_ply_points`."""
    lines = [f"{_UP} {cloud.up}"]
    if cloud.front:
        lines.append(axes_in_words(cloud.up, cloud.front))
    if cloud.origin.any():
        lines.append(f"{_ORIGIN} {_text(cloud.origin)}")
    if cloud.seen_from is not None and cloud.seen_from.ndim == 1:
        lines.append(f"{_SEEN_FROM} {_text(cloud.seen_from + cloud.origin)}")
    return lines


def _text(numbers: NDArray[np.float64]) -> str:
    return " ".join(repr(float(one)) for one in numbers)


def _as_commented(found: FoundPoints, comments: list[str]) -> FoundPoints:
    stated = {first: rest for first, _, rest in (line.partition(" ") for line in comments)}
    for up in UPS:
        if stated.get(_UP) == up:
            found.up, found.up_from = up, "its header says so"
            found.front = next((one for one in map(front_in_words, comments) if one and one[-1] != up[-1]), None)
    for name in (_ORIGIN, _SEEN_FROM):
        numbers = split_numbers(stated.get(name, "")) or []
        if len(numbers) == 3 and np.isfinite(numbers).all() and found.up:  # our own
            setattr(found, name, np.array(numbers))
    return found
