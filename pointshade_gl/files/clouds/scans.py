"""The points of LAS, LAZ, COPC and E57 files, with libraries that are extras."""

from __future__ import annotations

import struct
from io import BufferedReader
from typing import Any

import numpy as np

from ...notes.notes import Note
from ...notes.words import counted, option
from ..access.content import FilePath, check_size, import_extra, naming, open_regular
from .cloud_columns import FoundPoints, check_points

_HEADER = 375  # bytes of the longest header; older ones have 227
_VLR, _EVLR = 54, 60  # bytes of a record's own header
_PACKED = 0b11000000  # bits of the point format
_LAST = -1  # the place of the chunk table: in the last bytes of the file


def check_las_header(file: BufferedReader, size: int) -> None:
    """Raises ValueError for more points, records or chunks than an open file of this size can hold."""
    head = file.read(_HEADER).ljust(_HEADER, b"\0")
    version, offset, records = head[25], *struct.unpack_from("<II", head, 96)
    kind, row, points = head[104], *struct.unpack_from("<HI", head, 105)
    header = struct.unpack_from("<H", head, 94)[0]
    late = 0
    if version >= 4:
        late, points = struct.unpack_from("<I", head, 243)[0], struct.unpack_from("<Q", head, 247)[0]
    room = size - offset
    if not 0 < header <= offset <= size:
        raise ValueError(f"its points begin at {offset} of {size} bytes")
    if records * _VLR > offset or late * _EVLR > size:
        raise ValueError(f"it counts {records + late} records in {size} bytes")
    if not row or (not kind & _PACKED and points * row > room):
        raise ValueError(f"it counts {points} points of {row} bytes, and has {room}")
    if kind & _PACKED and points:
        _check_chunks(file, offset, row, size)
    file.seek(0)


def _check_chunks(file: BufferedReader, offset: int, row: int, size: int) -> None:
    """Of a compressed file: a chunk has one whole point at least."""
    place = _int64(file, offset)
    place = _int64(file, size - 8) if place == _LAST else place
    if not offset <= place <= size - 8:
        raise ValueError(f"its table of chunks begins at {place} of {size} bytes")
    file.seek(place)
    chunks = struct.unpack("<II", file.read(8))[1]
    if chunks * row > size - offset:
        raise ValueError(f"it counts {chunks} chunks in {size - offset} bytes")


def _int64(file: BufferedReader, place: int) -> int:
    file.seek(place)
    data = file.read(8)
    if len(data) < 8:
        raise ValueError("it ends before its points")
    return struct.unpack("<q", data)[0]


LAS = b"LASF"
_AT_A_TIME = 1 << 20  # points


def read_las_points(path: FilePath, note: Note, max_pixels: float) -> FoundPoints:
    """The points of a LAS, LAZ or COPC file. Raises ValueError for a broken one, and without the extra."""
    laspy = import_extra("laspy", "las", f"{path} is a LAS file")
    with open_regular(path) as file:
        size = check_size(file, path, max_pixels)
        with naming(path, "is a broken or truncated LAS file"), _no_panic():
            check_las_header(file, size)
            with laspy.open(file, closefd=False, laz_backend=laspy.LazBackend.Lazrs) as reader:
                header = reader.header
                check_points(header.point_count, path, max_pixels)
                if header.are_points_compressed:
                    _check_packed(header, path)
                found = _read(reader, f"LAS {header.version}, point format {header.point_format.id}")
    if found.seen_from is not None:
        why = "where its scan angles show an aircraft" if found.seen_from.ndim == 2 else "above, as it is flat"
        note(f"{path}: normals that are estimated point to {why}; {option('seen_from')} names another place")
    return found


def _check_packed(header: Any, path: FilePath) -> None:
    """Raises ValueError without the decompressor, and if it would give points of another size."""
    lazrs = import_extra("lazrs", "las", f"{path} is a compressed LAS file")
    packed = lazrs.LazVlr(header.vlrs[header.vlrs.index("LasZipVlr")].record_data)
    if packed.item_size() != header.point_format.size:
        raise ValueError(f"its points have {header.point_format.size} bytes, and are packed as {packed.item_size()}")


def _read(reader: Any, form: str) -> FoundPoints:
    names = set(reader.header.point_format.dimension_names)
    has_color = {"red", "green", "blue"} <= names
    count, done = reader.header.point_count, 0
    parts: dict[str, list[np.ndarray]] = {"positions": [], "colors": [], "intensity": [], "classes": []}
    lines, angles = list[np.ndarray](), list[np.ndarray]()
    for chunk in reader.chunk_iterator(_AT_A_TIME):
        parts["positions"].append(np.stack([chunk.x, chunk.y, chunk.z], -1))
        parts["intensity"].append(np.array(chunk.intensity))
        parts["classes"].append(np.array(chunk.classification, np.uint8))
        lines.append(_passes(chunk, names))
        angles.append(_scan_angle(chunk, names))
        if has_color:
            parts["colors"].append(np.stack([chunk.red, chunk.green, chunk.blue], -1))
        done += len(chunk)
    if done != count:
        raise ValueError(f"it has {done} of {count} points")
    found: dict[str, Any] = {name: np.concatenate(part) for name, part in parts.items() if part}
    positions = found.pop("positions", np.empty((0, 3)))
    if "colors" in found and not found["colors"].any():
        del found["colors"]  # a format with colours, and nobody wrote any
    if count:
        found["seen_from"] = seen_from_above(positions, np.concatenate(lines), np.concatenate(angles))
    return FoundPoints(form, positions, **found, up="z", up_from="always so in LAS")


_PASS = 5.0  # seconds in which an aircraft flies straight on
_FITTED = 2000  # points of a pass that its line is found from,
_FEWEST = 50  # at least
_STEEPEST = 65  # degrees: the mirrors of aircraft turn no further, those of cars do
_FITS = 0.5  # of the angles' variance is explained by where the points lie
_HEIGHTS = 50.0, 10_000.0  # of flight
_FLAT, _ABOVE = 0.4, 100.0  # of its sides is the height of what is seen from above, and from how far


def _passes(chunk: Any, names: set[str]) -> np.ndarray:
    """A number for each time that the scanner flew past."""
    seconds = np.asarray(chunk.gps_time) if "gps_time" in names else np.zeros(len(chunk))
    times = np.nan_to_num(seconds / _PASS).clip(-1e12, 1e12).astype(np.int64)
    return (times << 16) + np.asarray(chunk.point_source_id)


def _scan_angle(chunk: Any, names: set[str]) -> np.ndarray:
    """Degrees to the side of straight down."""
    if "scan_angle" in names:
        return np.asarray(chunk.scan_angle, np.float32) * np.float32(0.006)
    return np.asarray(chunk.scan_angle_rank, np.float32)


def seen_from_above(positions: np.ndarray, passes: np.ndarray, angles: np.ndarray) -> np.ndarray | None:
    """Where an aircraft was when it saw each point, (n, 3); without angles far above flat points, (3,); else None.

    The angle grows across the line of flight, by more the lower that is: so both are known without its path.
    """
    sides, largest = np.ptp(positions, axis=0), np.abs(angles).max()
    if largest > _STEEPEST:
        return None
    if not largest:
        x, y, z = np.median(positions, axis=0)
        return np.array([x, y, z + _ABOVE * sides.max()]) if sides[2] < _FLAT * sides[:2].min() else None
    aside, height = np.zeros((len(positions), 2), np.float32), np.full(len(positions), sides.max() + 1000, np.float32)
    _, number, counts = np.unique(passes, return_inverse=True, return_counts=True)
    order = np.argsort(number, kind="stable")
    for own in np.split(order, np.cumsum(counts)[:-1]):
        some = own[:: -(-len(own) // _FITTED)]
        tangents = np.tan(np.radians(angles[some].astype(np.float64)))
        middle = positions[some].mean(0)[:2]
        terms = np.c_[positions[some, :2] - middle, np.ones(len(some))]
        slope = np.linalg.lstsq(terms, tangents, rcond=None)[0]
        rest, steep = tangents - terms @ slope, float(np.hypot(*slope[:2]))
        fits = len(some) >= _FEWEST and rest.var() < (1 - _FITS) * tangents.var()
        if not (fits and 1 / _HEIGHTS[1] < steep < 1 / _HEIGHTS[0]):
            continue
        tangent = (positions[own, :2] - middle) @ slope[:2] + slope[2]
        aside[own], height[own] = -tangent[:, None] * slope[:2] / steep, 1 / steep
    return positions + np.c_[aside, np.ones(len(aside), np.float32)] * height[:, None]


class _no_panic:
    """A context in which the compressor's panics, which are no Exceptions, become ValueErrors."""

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: object) -> None:
        if kind is not None and kind.__name__ == "PanicException":
            raise ValueError("its compressed points are damaged") from None


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
        places = {tuple(map(float, header.translation)) for header in headers if header.has_pose()}
    if not scans:
        raise ValueError(f"{path} has no scans, only pictures or nothing")
    at = np.concatenate([one["positions"] for one in scans])
    known = f"seen from {counted(len(places), 'place')}" if places else "which do not say where the scanner stood"
    note(f"{path}: {counted(len(at), 'point')} of {counted(len(scans), 'scan')}, {known}")
    together: dict[str, Any] = {}
    for name in ("colors", "intensity", "seen_from"):
        if all(one[name] is not None for one in scans):
            together[name] = np.concatenate([one[name] for one in scans])
    if len(places) == 1 and "seen_from" in together:
        together["seen_from"] = np.array(next(iter(places)))
    return FoundPoints("E57", at, up="z", up_from="always so in E57", **together)


def _scan(file: Any, header: Any) -> dict[str, Any]:
    """The values of a scan's points, in the file's axes."""
    known = (*_CARTESIAN, *_SPHERICAL, "intensity", *_COLORS, *_INVALID)
    names = [name for name in known if name in header.point_fields]
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
    at = np.stack([columns[name] for name in (_SPHERICAL if is_spherical else _CARTESIAN)], -1)
    if is_spherical:
        distance, azimuth, elevation = at.T
        level = distance * np.cos(elevation)
        at = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), distance * np.sin(elevation)], -1)
    seen_from = None
    if header.has_pose():
        place = np.asarray(header.translation, float)
        at = at @ np.asarray(header.rotation_matrix, float).T + place
        seen_from = np.broadcast_to(place, at.shape)
    colors = np.stack([columns[name] for name in _COLORS], -1) if set(_COLORS) <= columns.keys() else None
    return {"positions": at, "intensity": columns.get("intensity"), "colors": colors, "seen_from": seen_from}
