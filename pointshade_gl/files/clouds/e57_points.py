"""The points of E57 files (ASTM E2807), every scan at its pose. They come with the extra `e57`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import counted
from ..access.content import FilePath, check_size, import_extra, naming, open_regular
from .found_points import FoundPoints, check_points

E57 = b"ASTM-E57"
_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_COLORS = ("colorRed", "colorGreen", "colorBlue")
_INVALID = ("cartesianInvalidState", "sphericalInvalidState")
_PER_BYTE = 8  # points that a byte of a file holds at most


def read_e57_points(path: FilePath, note: Note, max_pixels: float) -> FoundPoints:
    """The points of all scans of an E57 file. Raises ValueError for a broken one, and without the extra."""
    pye57 = import_extra("pye57", "e57", f"{path} is an E57 file")
    with open_regular(path) as file:
        size = check_size(file, path, max_pixels)
    with naming(path, "is a broken or truncated E57 file"), pye57.E57(str(path)) as file:
        headers = [file.get_header(k) for k in range(file.scan_count)]
        counts = [header.point_count for header in headers]
        check_points(sum(counts), path, max_pixels)
        if min(counts, default=0) < 0 or sum(counts) > _PER_BYTE * size:
            raise ValueError(f"it counts {sum(counts)} points in {size} bytes")
        scans = [_scan(file, header) for header in headers]
    if not scans:
        raise ValueError(f"{path} has no scans, only pictures or nothing")
    at = np.concatenate([one["positions"] for one in scans])
    places = {tuple(one["seen_from"]) for one in scans if one["seen_from"] is not None}
    known = f"seen from {counted(len(places), 'place')}" if places else "which do not say where the scanner stood"
    note(f"{path}: {counted(len(at), 'point')} of {counted(len(scans), 'scan')}, {known}")
    together: dict[str, Any] = {name: _joined(scans, name) for name in ("colors", "intensity")}
    return FoundPoints(
        "E57", at, seen_from=_seen_from(scans, len(places)), up="z", up_from="always so in E57", **together
    )


def _scan(file: Any, header: Any) -> dict[str, Any]:
    """The values of a scan's points, in the file's axes."""
    names = [
        name for name in (*_CARTESIAN, *_SPHERICAL, "intensity", *_COLORS, *_INVALID) if name in header.point_fields
    ]
    is_spherical = not set(_CARTESIAN) <= set(names)
    if is_spherical and not set(_SPHERICAL) <= set(names):
        raise ValueError(f"a scan has no coordinates, only {', '.join([*header.point_fields][:12])}")
    data, buffers = file.make_buffers(names, header.point_count)
    if header.point_count:
        reader = header.points.reader(buffers)
        reader.read()
        reader.close()
    good = np.ones(header.point_count, bool)
    for name in _INVALID:
        if name in data:
            good &= data[name] == 0
    columns = {name: column[good] for name, column in data.items()}
    at = (
        _of_sphere(*(columns[name] for name in _SPHERICAL))
        if is_spherical
        else np.stack([columns[n] for n in _CARTESIAN], -1)
    )
    seen_from = None
    if header.has_pose():
        turn, seen_from = np.asarray(header.rotation_matrix, float), np.asarray(header.translation, float)
        at = at @ turn.T + seen_from
    colors = np.stack([columns[name] for name in _COLORS], -1) if set(_COLORS) <= columns.keys() else None
    return {"positions": at, "intensity": columns.get("intensity"), "colors": colors, "seen_from": seen_from}


def _of_sphere(distance: NDArray[Any], azimuth: NDArray[Any], elevation: NDArray[Any]) -> NDArray[np.float64]:
    level = distance * np.cos(elevation)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), distance * np.sin(elevation)], -1)


def _joined(scans: list[dict[str, Any]], name: str) -> NDArray[Any] | None:
    """A value of all points, if every scan has it."""
    columns = [one[name] for one in scans]
    return None if any(column is None for column in columns) else np.concatenate(columns)


def _seen_from(scans: list[dict[str, Any]], places: int) -> NDArray[np.float64] | None:
    """(3,) where the only scanner stood, (n, 3) for several; None if that is not known of all."""
    if any(one["seen_from"] is None for one in scans):
        return None
    if places == 1:
        return scans[0]["seen_from"]
    return np.concatenate([np.broadcast_to(one["seen_from"], one["positions"].shape) for one in scans])
