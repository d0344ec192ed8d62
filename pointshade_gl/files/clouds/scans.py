"""The points of scanners: PTX, and with libraries that are extras LAS, LAZ, COPC and E57 files."""

from __future__ import annotations

import struct
from importlib import import_module
from io import BufferedReader
from typing import Any

import numpy as np

from ...notes.notes import Note
from ...notes.words import counted, option, shown
from ..access.content import CLOUD_TEXT, FilePath, check_size, import_extra, naming, open_regular, read_bytes
from ..arrays.numpy_files import parse_numbers
from .cloud_columns import CloudOptions, FoundPoints, check_points

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


def read_las_points(path: FilePath, note: Note, options: CloudOptions) -> FoundPoints:
    """The points of a LAS, LAZ or COPC file. Raises ValueError for a broken one, and without the extra."""
    laspy = import_extra("laspy", "las", f"{path} is a LAS file")
    with open_regular(path) as file:
        size = check_size(file, path, options.max_pixels)
        with naming(path, "is a broken or truncated LAS file"), _no_panic():
            check_las_header(file, size)
            with laspy.open(file, closefd=False, laz_backend=laspy.LazBackend.Lazrs) as reader:
                header = reader.header
                check_points(header.point_count, path, options.max_pixels)
                if header.are_points_compressed:
                    _check_packed(header, path)
                form = f"LAS {header.version}, point format {header.point_format.id}"
                found = _read(reader, form, options, str(path), note)
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


_NOISE = 7, 18  # classes of ASPRS: low and high


def _read(reader: Any, form: str, options: CloudOptions, name: str, note: Note) -> FoundPoints:
    names = [*reader.header.point_format.dimension_names]
    has_color = {"red", "green", "blue"} <= {*names}
    count, done = reader.header.point_count, 0
    parts: dict[str, list[np.ndarray]] = {"positions": [], "colors": [], "intensity": [], "classes": []}
    found = FoundPoints(form, np.empty((0, 3)), up="z", up_from="always so in LAS")
    found.fields = {one: None for one in names if one.lower() not in ("x", "y", "z")}
    asked = found.field_named(options.color_by)
    values, marked = list[np.ndarray](), list[np.ndarray]()
    lines, angles = list[np.ndarray](), list[np.ndarray]()
    for chunk in reader.chunk_iterator(_AT_A_TIME):
        parts["positions"].append(np.stack([chunk.x, chunk.y, chunk.z], -1))
        parts["intensity"].append(np.array(chunk.intensity))
        parts["classes"].append(np.array(chunk.classification, np.uint8))
        lines.append(_passes(chunk, names))
        angles.append(_scan_angle(chunk, names))
        marked.append(np.isin(parts["classes"][-1], _NOISE) + 2 * (np.array(chunk.withheld) != 0))
        if has_color:
            parts["colors"].append(np.stack([chunk.red, chunk.green, chunk.blue], -1))
        if asked:
            values.append(np.array(chunk[asked]))
        done += len(chunk)
    if done != count:
        raise ValueError(f"it has {done} of {count} points")
    for role, part in parts.items():
        if part:
            setattr(found, role, np.concatenate(part))
    if found.colors is not None and not found.colors.any():
        found.colors = None  # a format with colours, and nobody wrote any
    if asked and values:
        found.fields[asked] = np.concatenate(values)
    if count:
        found.seen_from = seen_from_above(found.positions, np.concatenate(lines), np.concatenate(angles))
    if marked and not options.all_points:
        _leave_marked(found, np.concatenate(marked), name, note)
    return found


def _leave_marked(found: FoundPoints, marks: np.ndarray, name: str, note: Note) -> None:
    """Leave out what the file marks as noise or as withheld, unless that is all of it."""
    noise, withheld = (int(np.count_nonzero(marks & bit)) for bit in (1, 2))
    good = marks == 0
    if good.all() or not good.any():
        return
    parts = [f"{noise} of class {_NOISE[0]} or {_NOISE[1]} (noise)"] * (noise > 0)
    parts += [f"{withheld} withheld"] * (withheld > 0)
    note(
        f"{name}: {counted(int((~good).sum()), 'point')} of {len(found)} are left out, {' and '.join(parts)}: "
        f"{option('all_points', True)} keeps them"
    )
    found.select(good)


_PASS = 5.0  # seconds in which an aircraft flies straight on
_FITTED = 2000  # points of a pass that its line is found from,
_FEWEST = 50  # at least
_STEEPEST = 65  # degrees: the mirrors of aircraft turn no further, those of cars do
_FITS = 0.5  # of the angles' variance is explained by where the points lie
_HEIGHTS = 50.0, 10_000.0  # of flight
_FLAT, _ABOVE = 0.4, 100.0  # of its sides is the height of what is seen from above, and from how far


def _passes(chunk: Any, names: list[str]) -> np.ndarray:
    """A number for each time that the scanner flew past."""
    seconds = np.asarray(chunk.gps_time) if "gps_time" in names else np.zeros(len(chunk))
    times = np.nan_to_num(seconds / _PASS).clip(-1e12, 1e12).astype(np.int64)
    return (times << 16) + np.asarray(chunk.point_source_id)


def _scan_angle(chunk: Any, names: list[str]) -> np.ndarray:
    """Degrees to the side of straight down."""
    if "scan_angle" in names:
        return np.asarray(chunk.scan_angle, np.float32) * np.float32(0.006)
    return np.asarray(chunk.scan_angle_rank, np.float32)


def seen_from_above(positions: np.ndarray, passes: np.ndarray, angles: np.ndarray) -> np.ndarray | None:
    """Where an aircraft was when it saw each point, (n, 3); without angles far above flat points, (3,); else None. The
    angle grows across the line of flight, by more the lower that is: so both are known without its path."""
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
_E57_NORMALS = ("nor:normalX", "nor:normalY", "nor:normalZ")  # of the extension E57_EXT_surface_normals
_INVALID = ("cartesianInvalidState", "sphericalInvalidState")
_PER_BYTE = 8  # points that a byte of a file holds at most


def read_e57_points(path: FilePath, note: Note, options: CloudOptions) -> FoundPoints:
    """The points of all scans of an E57 file. Raises ValueError for a broken one, and without the extra."""
    pye57 = import_extra("pye57", "e57", f"{path} is an E57 file")
    with open_regular(path) as file:
        size = check_size(file, path, options.max_pixels)
    with naming(path, "is a broken or truncated E57 file"), pye57.E57(str(path)) as file:
        headers = [file.get_header(k) for k in range(file.scan_count)]
        counts = [header.point_count for header in headers]
        check_points(sum(counts), path, options.max_pixels)
        if min(counts, default=0) < 0 or sum(counts) > _PER_BYTE * size:
            raise ValueError(f"it counts {sum(counts)} points in {size} bytes")
        scans = [_scan(file, header, options) for header in headers]
        places = {tuple(map(float, header.translation)) for header in headers if header.has_pose()}
    if not scans:
        raise ValueError(f"{path} has no scans, only pictures or nothing")
    at = np.concatenate([one["positions"] for one in scans])
    known = f"seen from {counted(len(places), 'place')}" if places else "which do not say where the scanner stood"
    note(f"{path}: {counted(len(at), 'point')} of {counted(len(scans), 'scan')}, {known}")
    together: dict[str, Any] = {}
    for name in ("colors", "intensity", "seen_from", "normals"):
        if all(one[name] is not None for one in scans):
            together[name] = np.concatenate([one[name] for one in scans])
    if len(places) == 1 and "seen_from" in together:
        together["seen_from"] = np.array(next(iter(places)))
    fields: dict[str, Any] = {name: None for one in scans for name in one["fields"]}
    for name in fields:
        if all(one["fields"].get(name) is not None for one in scans):
            fields[name] = np.concatenate([one["fields"][name] for one in scans])
    return FoundPoints("E57", at, up="z", up_from="always so in E57", fields=fields, **together)


def _scan(file: Any, header: Any, options: CloudOptions) -> dict[str, Any]:
    """The values of a scan's points, in the file's axes."""
    every: dict[str, Any] = dict.fromkeys(header.point_fields)
    asked = FoundPoints("", np.empty((0, 3)), fields=every).field_named(options.color_by)
    known = (*_CARTESIAN, *_SPHERICAL, "intensity", *_COLORS, *_INVALID, *_E57_NORMALS, asked or "")
    names = [name for name in dict.fromkeys(known) if name in header.point_fields]
    is_spherical = not set(_CARTESIAN) <= set(names)
    if is_spherical and not set(_SPHERICAL) <= set(names):
        raise ValueError(f"a scan has no coordinates, only {', '.join([*header.point_fields][:12])}")
    data, buffers = _buffers(file, names, header.point_count)
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
    colors, normals = (
        np.stack([columns[name] for name in three], -1) if {*three} <= columns.keys() else None
        for three in (_COLORS, _E57_NORMALS)
    )
    if header.has_pose():
        place, turn = np.asarray(header.translation, float), np.asarray(header.rotation_matrix, float)
        at = at @ turn.T + place
        normals = None if normals is None else normals @ turn.T
        seen_from = np.broadcast_to(place, at.shape)
    fields = {name: columns.get(name) if name == asked else None for name in every if name not in _CARTESIAN}
    found = {"positions": at, "intensity": columns.get("intensity"), "colors": colors, "seen_from": seen_from}
    return found | {"normals": normals, "fields": fields}


def _buffers(file: Any, names: list[str], count: int) -> tuple[dict[str, np.ndarray], Any]:
    """Arrays for fields, and what the library fills them by; of those that it has no type for as numbers of 64 bits."""
    from pye57.e57 import SUPPORTED_POINT_FIELDS

    libe57: Any = import_module("pye57.libe57")
    data, buffers = {}, libe57.VectorSourceDestBuffer()
    for name in names:
        data[name] = np.empty(count, SUPPORTED_POINT_FIELDS.get(name, "d"))
        buffers.append(libe57.SourceDestBuffer(file.image_file, name, data[name], count, True, True))
    return data, buffers


_PTX_LINES = (1, 1, 3, 3, 3, 3, 4, 4, 4, 4)  # numbers of each of the lines before the points of a scan


def is_ptx(head: bytes) -> bool:
    """Whether a text begins as one of Leica's: the size of a scan, and where it stood."""
    lines = [line.split() for line in head.splitlines() if line.strip()][: len(_PTX_LINES)]
    return tuple(map(len, lines)) == _PTX_LINES


def read_ptx_points(path: FilePath, note: Note, options: CloudOptions) -> FoundPoints:
    """The points of all scans of a PTX file, each at its place. Raises ValueError for a broken one."""
    data = read_bytes(path, options.max_pixels, CLOUD_TEXT)
    first = next((line for k, line in enumerate(filter(bytes.strip, data.splitlines())) if k == len(_PTX_LINES)), b"")
    columns, before = len(first.split()), sum(_PTX_LINES)
    scans, places, at, empty = list[np.ndarray](), list[np.ndarray](), 0, 0
    with naming(path, "is a broken PTX file", (ValueError,)):
        if columns not in (4, 7):
            raise ValueError(f"its first point is {shown(first.decode('utf-8', 'replace'))}, expected 4 or 7 numbers")
        numbers = parse_numbers(data.decode("ascii", "replace"))
        while at < len(numbers) or not scans:
            head = numbers[at : at + before]
            count = head[0] * head[1] if len(head) == before else -1
            end = at + before + count * columns
            if not (count >= 0 and count % 1 == 0 and end <= len(numbers)):
                raise ValueError(f"it does not hold the points that its scan {len(scans)} counts")
            rows = numbers[at + before : int(end)].reshape(-1, columns)
            at, turn = int(end), head[14:].reshape(4, 4)
            good = rows[:, :3].any(1)
            empty += int((~good).sum())
            rows = np.array(rows[good])
            rows[:, :3] = rows[:, :3] @ turn[:3, :3] + turn[3, :3]
            scans.append(rows)
            places.append(np.broadcast_to(turn[3, :3], (len(rows), 3)))
    table, seen_from = np.concatenate(scans), np.concatenate(places)
    check_points(len(table), path, options.max_pixels)
    if empty:
        note(f"{path}: {counted(empty, 'point')} of {len(table) + empty} are returns that never came: left out")
    if len(scans) == 1:
        seen_from = np.array(seen_from[0]) if len(table) else None
    colors = table[:, 4:] if columns == 7 else None
    fields: dict[str, Any] = {"intensity": table[:, 3]}
    form = f"PTX, {counted(len(scans), 'scan')}"
    known: dict[str, Any] = {"up": "z", "up_from": "usual of scanners", "seen_from": seen_from, "fields": fields}
    return FoundPoints(form, table[:, :3], colors=colors, intensity=table[:, 3], **known)
