"""Reads and writes PLY files (Turk 1994): elements, such as the vertices of a point cloud, with rows of numbers."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from io import BufferedIOBase
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...notes.words import shown
from ..access.content import FilePath, naming, read_bytes
from ..access.limits import CLOUD_TEXT, MAX_PIXELS, check_limit
from .array_files import parse_numbers

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
_HEADER = 2**18  # bytes of the longest header
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


class _Header(NamedTuple):
    """order: of bytes; at: where the first of the elements begins."""

    order: str
    elements: list[_Element]
    at: int
    comments: list[str]


class Ply(NamedTuple):
    """What a PLY file holds; comments are the lines of its header without that word."""

    elements: Elements
    comments: list[str]
    form: str


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
    """The elements of a PLY file, text or binary. Lists, such as the corners of faces, are left out.

    last  the element after which nothing is read; "" reads all

    Raises OSError if the path is not a file, ValueError for one that is broken, truncated or too large.
    """
    data = read_bytes(path, max_pixels)
    with naming(path, "is a broken PLY file", (ValueError,)):
        header = _read_header(data)
        at, form = header.at, next(name for name, order in _ORDERS.items() if order == header.order)
        if header.order == _TEXT:
            check_limit(len(data), f"{path} has {len(data)} bytes of text", max_pixels, CLOUD_TEXT)
            data, at = _doubles(data[at:]), 0
        found: Elements = {}
        for element in header.elements:
            rows, at = _read_rows(data, at, element, header.order)
            found[element.name] = _as_declared(rows, element)
            if element.name == last:
                break
        else:
            if data[at:].strip(_PADDING):
                raise ValueError("it goes on after the rows that its header counts")
        return Ply(found, header.comments, form)


def _read_header(data: bytes) -> _Header:
    if data[:4] not in (b"ply\n", b"ply\r"):
        raise ValueError("its first line is not 'ply'")
    order, names, elements, at = "", set[str](), list[_Element](), data.find(b"\n") + 1
    comments = list[str]()
    while (end := data.find(b"\n", at, _HEADER)) >= 0:
        words, at = data[at:end].decode("utf-8", "replace").split(), end + 1
        own = elements[-1].properties if elements else {}
        match words:
            case ["end_header"] if order:
                return _Header(order, elements, at, comments)
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


def _doubles(text: bytes) -> bytes:
    """The numbers of a text, 8 bytes each."""
    values = parse_numbers(text.decode("ascii", "replace"))
    if not values.size and text.strip(_PADDING):
        raise ValueError("after its header it holds something other than numbers")
    return values.tobytes()


def _read_rows(data: bytes, at: int, element: _Element, order: str) -> tuple[NDArray[Any], int]:
    """(n,) structured: the rows that begin there, as they are stored, without lists; and where they end."""
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
        data, end = _without_lists(data, at, element, [*stored.values()])
        at = 0
    else:
        end = at + element.rows * row.itemsize
    rows = np.frombuffer(data, row, element.rows, at) if row.itemsize else np.empty(element.rows, row)
    return rows, end


def _without_lists(data: bytes, at: int, element: _Element, stored: Sequence[_Property]) -> tuple[bytes, int]:
    """The numbers of rows that begin there, without lists; and where they end."""
    steps, size = (
        list[tuple[int, struct.Struct, int]](),
        0,
    )  # bytes of numbers, then a list: its length, bytes of an item
    for one in stored:
        item = np.dtype(one.kind).itemsize
        if one.length:
            steps.append((size, struct.Struct(one.length[0] + np.dtype(one.length).char), item))
        size = 0 if one.length else size + item
    kept = list[bytes]()
    for _ in range(element.rows):
        for before, length, item in steps:
            kept.append(data[at : at + before])
            at += before
            if at + length.size > len(data):
                raise _truncated(element)
            (many,) = length.unpack_from(data, at)
            if not (many >= 0 and many % 1 == 0):
                raise ValueError(f"a list of its element {shown(element.name)} has the length {many:g}")
            at += length.size + int(many) * item
        kept.append(data[at : at + size])
        at += size
    if at > len(data):
        raise _truncated(element)
    return b"".join(kept), at


def _truncated(element: _Element) -> ValueError:
    return ValueError(f"it ends before the last of {element.rows} rows of its element {shown(element.name)}")


@np.errstate(over="ignore", invalid="ignore")  # of texts: what no float holds is infinite
def _as_declared(rows: NDArray[Any], element: _Element) -> NDArray[Any]:
    """The rows with the types of the header, in native byte order. Raises ValueError for numbers that do not fit."""
    declared = np.dtype([(name, one.kind) for name, one in element.properties.items() if not one.length])
    for name in declared.names or ():
        if declared[name].kind in "iu" and rows.dtype[name].kind == "f":
            column, limits = rows[name], np.iinfo(declared[name])
            if not ((column >= limits.min) & (column <= limits.max) & (column % 1 == 0)).all():
                fact = f"whole numbers from {limits.min} to {limits.max}"
                raise ValueError(f"its property {shown(name)} must be {fact}")
    return rows.astype(declared, copy=False)
