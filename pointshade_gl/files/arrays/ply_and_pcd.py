"""Reads and writes PLY files (Turk 1994), and reads PCD files, the clouds of PCL (Rusu and Cousins 2011)."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from io import BufferedIOBase
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...notes.words import shown
from ..access import content
from ..access.content import CLOUD_TEXT, FILE_BYTES, MAX_PIXELS, FilePath
from .compression import unpack_lzf
from .numpy_files import parse_numbers

FACES = ("face", "tristrips")  # elements
Elements = dict[str, NDArray[Any]]  # by name: (n,) structured, a field for each property
_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8",
}  # fmt: skip
_LENGTHS = {name: kind for name, kind in _TYPES.items() if kind[0] in "iu"}  # of a list
_WRITTEN = {kind: name for name, kind in reversed(_TYPES.items())}  # the older names, which every program knows
_TEXT = "="
_ORDERS = {"ascii": _TEXT, "binary_little_endian": "<", "binary_big_endian": ">"}
PLY_HEADER = 2**18  # bytes of the longest header
_DIGITS = 18  # of the largest count
_PADDING = b"\0\t\n\r "  # what may follow the last row


class _Property(NamedTuple):
    """A number, or a list of numbers after its length; types as NumPy calls them."""

    kind: str
    length: str = ""  # of a list


class _Element(NamedTuple):
    name: str
    rows: int
    properties: dict[str, _Property]


class _PlyHeader(NamedTuple):
    """order: of bytes; at: where the first of the elements begins."""

    order: str
    elements: list[_Element]
    at: int
    comments: list[str]


Lists = dict[str, tuple[NDArray[Any], NDArray[Any]]]  # by name: the length of each row's list, and all numbers


class Ply(NamedTuple):
    """What a PLY file holds. lists: of each element."""

    elements: Elements
    lists: dict[str, Lists]
    comments: list[str]  # the lines of its header that begin with that word, without it
    form: str


def counts_faces(head: bytes) -> int:
    """How many faces, or strips of them, the header counts that a file begins with; 0 for none and for a broken one."""
    try:
        elements = _read_header(head).elements
    except ValueError:
        return 0
    return sum(one.rows for one in elements if one.name in FACES)


def write_ply(file: BufferedIOBase, elements: Elements, comments: Sequence[str] = ()) -> None:
    """Write elements as binary little-endian PLY. Their fields are integers of up to 4 bytes, floats and doubles."""
    header = ["ply", "format binary_little_endian 1.0", *(f"comment {one}" for one in comments)]
    for name, rows in elements.items():
        header.append(f"element {name} {len(rows)}")
        header += [f"property {_WRITTEN[rows.dtype[field].str[1:]]} {field}" for field in rows.dtype.names or ()]
    file.write("\n".join([*header, "end_header\n"]).encode())
    for rows in elements.values():
        file.write(rows.astype(rows.dtype.newbyteorder("<"), copy=False).view(np.uint8).data)


def read_ply(path: FilePath, max_pixels: float = MAX_PIXELS, last: str = "") -> Ply:
    """The elements of a PLY file up to the last one that is wanted, and their lists, such as corners of faces. Raises
    OSError if the path is not a file, ValueError for one that is broken, truncated or too large."""
    data = content.read_bytes(path, max_pixels)
    with content.naming(path, "is a broken PLY file", (ValueError,)):
        header = _read_header(data)
        at, form = header.at, next(name for name, order in _ORDERS.items() if order == header.order)
        if header.order == _TEXT:
            content.check_limit(len(data), f"{path} has {len(data)} bytes of text", max_pixels, CLOUD_TEXT)
            values = parse_numbers(data[at:].decode("ascii", "replace"))  # 8 bytes each
            if not values.size and data[at:].strip(_PADDING):
                raise ValueError("after its header it holds something other than numbers")
            data, at = values.tobytes(), 0
        found, lists = Elements(), dict[str, Lists]()
        for element in header.elements:
            rows, lists[element.name], at = _read_rows(data, at, element, header.order)
            found[element.name] = _as_declared(rows, element, header.order == _TEXT)
            if element.name == last:
                break
        else:
            if data[at:].strip(_PADDING):
                raise ValueError("it goes on after the rows that its header counts")
        return Ply(found, lists, header.comments, form)


def _read_header(data: bytes) -> _PlyHeader:
    if data[:4] not in (b"ply\n", b"ply\r"):
        raise ValueError("its first line is not 'ply'")
    order, names, elements, at = "", set[str](), list[_Element](), data.find(b"\n") + 1
    comments = list[str]()
    while (end := data.find(b"\n", at, PLY_HEADER)) >= 0:
        words, at = data[at:end].decode("utf-8", "replace").split(), end + 1
        own = elements[-1].properties if elements else {}
        match words:
            case ["end_header"] if order:
                return _PlyHeader(order, elements, at, comments)
            case ["comment" | "obj_info", *rest]:
                comments.append(" ".join(rest))
            case []:
                pass
            case ["format", name, "1.0"] if name in _ORDERS and not order:
                order = _ORDERS[name]
            case ["element", name, count] if count.isdecimal() and len(count) <= _DIGITS and name not in names:
                names.add(name)
                elements.append(_Element(name, int(count), {}))
            case ["property", kind, name] if elements and kind in _TYPES and name not in own:
                own[name] = _Property(_TYPES[kind])
            case ["property", "list", length, kind, name] if (
                elements and length in _LENGTHS and kind in _TYPES and name not in own
            ):
                own[name] = _Property(_TYPES[kind], _LENGTHS[length])
            case _:
                raise ValueError(f"its header has the line {shown(' '.join(words))}")
    raise ValueError("its header has no end")


def _read_rows(data: bytes, at: int, element: _Element, order: str) -> tuple[NDArray[Any], Lists, int]:
    """(n,) structured: the rows that begin there, as they are stored, without lists; these; and where they end."""
    stored = {
        name: _Property(*(order + ("f8" if order == _TEXT else kind) if kind else "" for kind in one))
        for name, one in element.properties.items()
    }
    row = np.dtype([(name, one.kind) for name, one in stored.items() if not one.length])
    lists = any(one.length for one in stored.values())
    least = row.itemsize + sum(np.dtype(one.length).itemsize for one in stored.values() if one.length)
    if not least:
        raise ValueError(f"its element {shown(element.name)} has no properties")
    if element.rows * least > len(data) - at:
        raise _truncated(element)
    if lists:
        return _alike_lists(data, at, element, stored, row) or _any_lists(data, at, element, stored, row)
    return np.frombuffer(data, row, element.rows, at), {}, at + element.rows * row.itemsize


def _alike_lists(
    data: bytes, at: int, element: _Element, stored: Mapping[str, _Property], row: np.dtype
) -> tuple[NDArray[Any], Lists, int] | None:
    """The rows of an element all of whose lists are as long as in its first row, as of triangles; else None."""
    fields, place = list[tuple[Any, ...]](), at
    for name, one in stored.items():
        if one.length:
            length = np.dtype(one.length)
            if place + length.itemsize > len(data) or not element.rows:
                return None
            many = np.frombuffer(data, length, 1, place)[0]
            if not 0 <= many <= _ALIKE or many % 1:
                return None
            fields += [(f"{name} length", length), (name, one.kind, (int(many),))]
            place += length.itemsize + int(many) * np.dtype(one.kind).itemsize
        else:
            fields.append((name, one.kind))
            place += np.dtype(one.kind).itemsize
    whole = np.dtype(fields)
    if at + element.rows * whole.itemsize > len(data):
        return None
    table, lists = np.frombuffer(data, whole, element.rows, at), Lists()
    for name, one in stored.items():
        if one.length:
            lengths = table[f"{name} length"]
            if (lengths != lengths[0]).any():
                return None
            lists[name] = lengths.astype(np.int64), table[name].reshape(-1)
    rows = np.empty(element.rows, row)
    for name in row.names or ():
        rows[name] = table[name]
    return rows, lists, at + element.rows * whole.itemsize


_ALIKE = 256  # numbers of the longest list that is looked at so


def _any_lists(
    data: bytes, at: int, element: _Element, stored: Mapping[str, _Property], row: np.dtype
) -> tuple[NDArray[Any], Lists, int]:
    steps: list[tuple[int, str, struct.Struct, int]] = []  # bytes of numbers, then a list: its length, bytes of an item
    size = 0
    for name, one in stored.items():
        item = np.dtype(one.kind).itemsize
        if one.length:
            steps.append((size, name, struct.Struct(one.length[0] + np.dtype(one.length).char), item))
        size = 0 if one.length else size + item
    kept, lengths = list[bytes](), {name: list[int]() for _, name, _, _ in steps}
    held = {name: list[bytes]() for name in lengths}
    for _ in range(element.rows):
        for before, name, length, item in steps:
            kept.append(data[at : at + before])
            at += before
            if at + length.size > len(data):
                raise _truncated(element)
            (many,) = length.unpack_from(data, at)
            if not (many >= 0 and many % 1 == 0):
                raise ValueError(f"a list of its element {shown(element.name)} has the length {many:g}")
            at += length.size
            lengths[name].append(int(many))
            held[name].append(data[at : at + int(many) * item])
            at += int(many) * item
        kept.append(data[at : at + size])
        at += size
    if at > len(data):
        raise _truncated(element)
    lists: Lists = {
        name: (np.array(lengths[name], np.int64), np.frombuffer(b"".join(held[name]), stored[name].kind))
        for name in lengths
    }
    plain = b"".join(kept)
    rows = np.frombuffer(plain, row, element.rows) if row.itemsize else np.empty(element.rows, row)
    return rows, lists, at


def _truncated(element: _Element) -> ValueError:
    return ValueError(f"it ends before the last of {element.rows} rows of its element {shown(element.name)}")


@np.errstate(over="ignore", invalid="ignore")  # of texts: what no float holds is infinite
def _as_declared(rows: NDArray[Any], element: _Element, is_text: bool) -> NDArray[Any]:
    """The rows with the types of the header, in native byte order. Raises ValueError for numbers that do not fit.
    Floats of a text stay as they were parsed: those of a map have more digits than the type that is declared."""
    declared = np.dtype([(name, one.kind) for name, one in element.properties.items() if not one.length])
    if is_text:
        floats = [(name, "f8" if declared[name].kind == "f" else declared[name]) for name in declared.names or ()]
        declared = np.dtype(floats)
    for name in declared.names or ():
        if declared[name].kind in "iu" and rows.dtype[name].kind == "f":
            column, limits = rows[name], np.iinfo(declared[name])
            if not ((column >= limits.min) & (column <= limits.max) & (column % 1 == 0)).all():
                raise ValueError(f"its property {shown(name)} must be whole numbers from {limits.min} to {limits.max}")
    return rows.astype(declared, copy=False)


PCD_HEADER = 2**16  # bytes of the longest header
_KINDS = {"F": (2, 4, 8), "I": (1, 2, 4, 8), "U": (1, 2, 4, 8)}  # bytes of numbers
_MOST_FIELDS, _MOST_COUNT = 256, 2**16
_BITS = ("rgb", "rgba")  # floats whose four bytes are a colour


class PcdHeader(NamedTuple):
    """fields: name, type and how many numbers of each; at: where the points begin."""

    fields: list[tuple[str, np.dtype, int]]
    width: int
    height: int
    points: int
    viewpoint: list[float]
    coding: str
    at: int

    @property
    def row(self) -> np.dtype:
        return np.dtype([(name, kind, (many,)) if many > 1 else (name, kind) for name, kind, many in self.fields])


class Pcd(NamedTuple):
    """columns: (n,) by name, (n, c) where a field has several numbers."""

    header: PcdHeader
    columns: dict[str, NDArray[Any]]


def is_pcd(head: bytes) -> bool:
    """Whether the first bytes of a file are those of a PCD."""
    lines = [line for line in head.split(b"\n") if line.strip()]
    return head.startswith((b"# .PCD", b"#.PCD")) or (
        bool(lines) and lines[0].startswith(b"VERSION ") and b"FIELDS" in head
    )


def read_pcd(path: FilePath, max_pixels: float = MAX_PIXELS) -> Pcd:
    """The points of a PCD file. Raises ValueError for one that is broken, truncated or too large."""
    data = content.read_bytes(path, max_pixels)
    with content.naming(path, "is a broken PCD file", (ValueError,)):
        header = read_pcd_header(data)
        content.check_limit(header.points, f"{path} has {header.points} points", max_pixels)
        size = header.points * header.row.itemsize
        content.check_limit(size, f"{path} has {size} bytes of points", max_pixels, FILE_BYTES)
        if header.coding == "ascii":
            content.check_limit(len(data), f"{path} has {len(data)} bytes of text", max_pixels, CLOUD_TEXT)
            return Pcd(header, _of_text(data[header.at :], header))
        if header.coding == "binary":
            if len(data) - header.at < size:
                raise ValueError(f"it ends before the last of {header.points} points")
            rows = np.frombuffer(data, header.row, header.points, header.at)
            return Pcd(header, {name: rows[name] for name in header.row.names or ()})
        return Pcd(header, _of_packed(data, header, size))


def read_pcd_header(data: bytes) -> PcdHeader:
    """Raises ValueError for a broken header."""
    stated, at = dict[str, list[str]](), 0
    while (end := data.find(b"\n", at, PCD_HEADER)) >= 0:
        line, at = data[at:end].decode("utf-8", "replace").strip(), end + 1
        if line and not line.startswith("#"):
            key, *words = line.split()
            stated[key.upper()] = words
            if key.upper() == "DATA":
                break
    coding = (stated.get("DATA") or [""])[0].lower()
    if coding not in ("ascii", "binary", "binary_compressed"):
        raise ValueError("its header has no end")
    width, height = _whole(stated, "WIDTH"), _whole(stated, "HEIGHT", 1)
    points = _whole(stated, "POINTS", width * height)
    if width * height != points:
        raise ValueError(f"its header counts {shown(points)} points of {shown(width)} x {shown(height)}")
    viewpoint = content.split_numbers(" ".join(stated.get("VIEWPOINT", []))) or []
    return PcdHeader(_fields(stated), width, height, points, viewpoint, coding, at)


def _whole(stated: dict[str, list[str]], key: str, usual: int | None = None) -> int:
    words = stated.get(key, [])
    if not words and usual is not None:
        return usual
    if len(words) != 1 or not words[0].isdecimal() or len(words[0]) > 12:
        raise ValueError(f"its header has {key} {shown(' '.join(words))}, expected a whole number")
    return int(words[0])


def _fields(stated: dict[str, list[str]]) -> list[tuple[str, np.dtype, int]]:
    names = stated.get("FIELDS") or stated.get("COLUMNS") or []
    sizes, kinds = stated.get("SIZE", ["4"] * len(names)), stated.get("TYPE", ["F"] * len(names))
    counts = stated.get("COUNT", ["1"] * len(names))
    if not 0 < len(names) <= _MOST_FIELDS or not len(names) == len(sizes) == len(kinds) == len(counts):
        raise ValueError("its header has FIELDS, SIZE, TYPE and COUNT of different length")
    found, seen = list[tuple[str, np.dtype, int]](), set[str]()
    for k, (name, size, kind, many) in enumerate(zip(names, sizes, map(str.upper, kinds), counts, strict=True)):
        if kind not in _KINDS or size not in map(str, _KINDS[kind]) or not many.isdecimal() or len(many) > 6:
            raise ValueError(f"its field {shown(name)} has the type {shown(f'{kind} {size} {many}')}")
        if int(many) > _MOST_COUNT:
            raise ValueError(f"its field {shown(name)} has {many} numbers a point")
        if int(many):
            unique = f"{name} {k}" if name in seen else name  # padding is called _ again and again
            seen.add(name)
            found.append((unique, np.dtype(f"<{kind.lower()}{size}"), int(many)))
    if not found:
        raise ValueError("its points have no fields")
    return found


def _of_text(text: bytes, header: PcdHeader) -> dict[str, NDArray[Any]]:
    numbers = parse_numbers(text.decode("ascii", "replace"))
    many = sum(many for _, _, many in header.fields)
    if numbers.size != many * header.points:
        raise ValueError(f"it has {numbers.size} numbers, expected {many} for each of {header.points} points")
    table, at, found = numbers.reshape(header.points, many), 0, dict[str, NDArray[Any]]()
    with np.errstate(all="ignore"):  # what a type does not hold is missing anyway
        for name, kind, width in header.fields:
            part = table[:, at] if width == 1 else table[:, at : at + width]
            if kind.kind != "f":
                part = np.nan_to_num(part).astype(np.int64)
            is_exact = kind.kind == "f" and name not in _BITS  # keeps all digits of a map
            found[name] = part if is_exact else part.astype(kind)
            at += width
    return found


def _of_packed(data: bytes, header: PcdHeader, size: int) -> dict[str, NDArray[Any]]:
    """Field after field, each with the numbers of all points."""
    if len(data) < header.at + 8:
        raise ValueError("it ends before its points")
    packed, whole = struct.unpack_from("<II", data, header.at)
    start = header.at + 8
    if whole != size or len(data) < start + packed:
        raise ValueError(f"it says {packed} packed bytes of {whole}, expected {size}, and has {len(data) - start}")
    unpacked, at, found = unpack_lzf(data[start : start + packed], size), 0, dict[str, NDArray[Any]]()
    for name, kind, many in header.fields:
        column = np.frombuffer(unpacked, kind, header.points * many, at)
        found[name] = column if many == 1 else column.reshape(header.points, many)
        at += column.nbytes
    return found
