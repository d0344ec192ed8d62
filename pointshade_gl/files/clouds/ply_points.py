"""The points of PLY files, in and out: which properties of a vertex are what, and what the header's comments say."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...scene.cloud import UPS, PointCloud, axes_in_words, front_in_words
from ..access.content import FilePath, naming, split_numbers
from ..arrays.ply import read_ply
from .field_names import found_in
from .found_points import FoundPoints, check_points
from .gaussians import gaussians_in, is_of_gaussians

VERTEX = "vertex"
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


def read_ply_points(path: FilePath, note: Note, max_pixels: float) -> FoundPoints:
    """The vertices of a PLY file. Raises ValueError for one that is broken, or has none."""
    ply = read_ply(path, max_pixels, VERTEX)
    with naming(path, "cannot be read as a point cloud", (ValueError,)):
        if VERTEX not in ply.elements:
            raise ValueError(f"it has no vertices, only {', '.join([*ply.elements][:12]) or 'a header'}")
        rows = ply.elements[VERTEX]
        check_points(len(rows), path, max_pixels)
        columns = {name: rows[name] for name in rows.dtype.names or ()}
        form = f"PLY, {ply.form}"
        if is_of_gaussians(columns):
            return gaussians_in(columns, f"{form}, 3-D Gaussians", str(path), note)
        return _as_commented(found_in(columns, form), ply.comments)


def vertices_of(cloud: PointCloud) -> NDArray[np.void]:
    """(n,) structured, a field for each property: those values that the cloud has."""
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
    """What the header says about a cloud beside its points, for `read_ply_points`."""
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
    said = {first: rest for first, _, rest in (line.partition(" ") for line in comments)}
    for up in UPS:
        if said.get(_UP) == up:
            found.up, found.up_from = up, "its header says so"
            found.front = next((one for one in map(front_in_words, comments) if one and one[-1] != up[-1]), None)
    for name in (_ORIGIN, _SEEN_FROM):
        numbers = split_numbers(said.get(name, "")) or []
        if len(numbers) == 3 and np.isfinite(numbers).all() and found.up:  # our own
            setattr(found, name, np.array(numbers))
    return found
