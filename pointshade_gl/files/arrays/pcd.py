"""Reads PCD files, the point clouds of PCL (Rusu and Cousins 2011): text, binary and compressed."""

from __future__ import annotations

import struct
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...notes.words import shown
from ..access.content import FilePath, naming, read_bytes, split_numbers
from ..access.limits import CLOUD_TEXT, FILE_BYTES, MAX_PIXELS, check_limit
from .array_files import parse_numbers
from .lzf import unpack

PCD_HEADER = 2**16  # bytes of the longest header
_KINDS = {"F": (2, 4, 8), "I": (1, 2, 4, 8), "U": (1, 2, 4, 8)}  # bytes of numbers
_MOST_FIELDS, _MOST_COUNT = 256, 2**16


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
    data = read_bytes(path, max_pixels)
    with naming(path, "is a broken PCD file", (ValueError,)):
        header = read_pcd_header(data)
        check_limit(header.points, f"{path} has {header.points} points", max_pixels)
        size = header.points * header.row.itemsize
        check_limit(size, f"{path} has {size} bytes of points", max_pixels, FILE_BYTES)
        if header.coding == "ascii":
            check_limit(len(data), f"{path} has {len(data)} bytes of text", max_pixels, CLOUD_TEXT)
            return Pcd(header, _of_text(data[header.at :], header))
        if header.coding == "binary":
            if len(data) - header.at < size:
                raise ValueError(f"it ends before the last of {header.points} points")
            rows = np.frombuffer(data, header.row, header.points, header.at)
            return Pcd(header, {name: rows[name] for name in header.row.names or ()})
        return Pcd(header, _of_packed(data, header, size))


def read_pcd_header(data: bytes) -> PcdHeader:
    """Raises ValueError for a broken header."""
    said, at = dict[str, list[str]](), 0
    while (end := data.find(b"\n", at, PCD_HEADER)) >= 0:
        line, at = data[at:end].decode("utf-8", "replace").strip(), end + 1
        if line and not line.startswith("#"):
            key, *words = line.split()
            said[key] = words
            if key == "DATA":
                break
    coding = (said.get("DATA") or [""])[0].lower()
    if coding not in ("ascii", "binary", "binary_compressed"):
        raise ValueError("its header has no end")
    width, height = _whole(said, "WIDTH"), _whole(said, "HEIGHT", 1)
    points = _whole(said, "POINTS", width * height)
    if width * height != points:
        raise ValueError(f"its header counts {shown(points)} points of {shown(width)} x {shown(height)}")
    viewpoint = split_numbers(" ".join(said.get("VIEWPOINT", []))) or []
    return PcdHeader(_fields(said), width, height, points, viewpoint, coding, at)


def _whole(said: dict[str, list[str]], key: str, usual: int | None = None) -> int:
    words = said.get(key, [])
    if not words and usual is not None:
        return usual
    if len(words) != 1 or not words[0].isdecimal() or len(words[0]) > 12:
        raise ValueError(f"its header has {key} {shown(' '.join(words))}, expected a whole number")
    return int(words[0])


def _fields(said: dict[str, list[str]]) -> list[tuple[str, np.dtype, int]]:
    names = said.get("FIELDS") or said.get("COLUMNS") or []
    sizes, kinds = said.get("SIZE", ["4"] * len(names)), said.get("TYPE", ["F"] * len(names))
    counts = said.get("COUNT", ["1"] * len(names))
    if not 0 < len(names) <= _MOST_FIELDS or not len(names) == len(sizes) == len(kinds) == len(counts):
        raise ValueError("its header has FIELDS, SIZE, TYPE and COUNT of different length")
    found, seen = list[tuple[str, np.dtype, int]](), set[str]()
    for k, (name, size, kind, many) in enumerate(zip(names, sizes, kinds, counts, strict=True)):
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
            found[name] = part.astype(kind) if kind.kind == "f" else np.nan_to_num(part).astype(np.int64).astype(kind)
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
    unpacked, at, found = unpack(data[start : start + packed], size), 0, dict[str, NDArray[Any]]()
    for name, kind, many in header.fields:
        column = np.frombuffer(unpacked, kind, header.points * many, at)
        found[name] = column if many == 1 else column.reshape(header.points, many)
        at += column.nbytes
    return found
