"""The columns of a table of points, of text too: what each means, by name, number and content."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import shown
from ...scene.cloud import Up
from ..access.content import CLOUD_TEXT, FilePath, check_limit, naming, read_bytes
from ..arrays.numpy_files import parse_numbers, plain

ColorBy = Literal["rgb", "intensity", "class", "height"]
COLOR_BY: tuple[ColorBy, ...] = get_args(ColorBy)
_COLUMNS = ("positions", "normals", "colors", "intensity", "classes", "sizes", "confidence", "seen_from")


@dataclass
class FoundPoints:
    """The points of a file. None = the file has none."""

    form: str  # what the file is, for a report
    positions: NDArray[Any]  # (n, 3) numbers
    normals: NDArray[Any] | None = None  # (n, 3)
    colors: NDArray[Any] | None = None  # (n, 3) of any scale
    intensity: NDArray[Any] | None = None  # (n,) of any scale
    classes: NDArray[Any] | None = None  # (n,) whole numbers, as LAS counts them
    sizes: NDArray[Any] | None = None  # (n,) radii
    confidence: NDArray[Any] | None = None  # (n,)
    seen_from: NDArray[np.float64] | None = None  # (3,) or (n, 3) float64: where the scanner stood
    # what the caller's own program wrote as the origin of the positions, which still contain it
    origin: NDArray[np.float64] | None = None
    up: Up | None = None  # which axis points up, how that is known, and whether there is doubt
    up_from: str = ""
    up_is_guessed: bool = False
    front: Up | None = None  # which axis points towards the viewer, as seen with that up

    def __len__(self) -> int:
        return len(self.positions)

    def select(self, rows: NDArray[Any]) -> None:
        """Keep these rows only: their numbers, or a mask."""
        count = len(self)
        for name in _COLUMNS:
            column = getattr(self, name)
            if column is not None and column.shape[0] == count and (name != "seen_from" or column.ndim == 2):
                setattr(self, name, column[rows])


def check_points(count: int, name: object, max_pixels: float) -> None:
    """Raises ValueError for more points than the limit: as many as a picture may have pixels."""
    check_limit(count, f"{name} has {count} points", max_pixels)


def side_by_side(columns: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """(n, c) of columns (n,). Fields of one type that follow each other in rows are copied together: 6 times faster."""
    first, count = columns[0], len(columns[0])
    step, width = first.dtype.itemsize, first.dtype.itemsize * len(columns)
    starts = [one.__array_interface__["data"][0] for one in columns]
    follow = all(start == starts[0] + k * step for k, start in enumerate(starts))
    alike = all(one.dtype == first.dtype and one.strides == first.strides for one in columns)
    if not (count and follow and alike and first.strides[0] >= width):
        return np.stack(columns, -1)
    shape, strides = (count, len(columns)), (first.strides[0], step)
    rows = np.lib.stride_tricks.as_strided(first, shape, strides, writeable=False)
    return rows.view(f"V{width}").copy().view(first.dtype).reshape(shape)


Names = tuple[str, ...]

# Role: groups of names, the best first.
_THREES: dict[str, tuple[Names, ...]] = {
    "positions": (("x", "y", "z"), ("px", "py", "pz"), ("easting", "northing", "height"), ("posx", "posy", "posz")),
    "normals": (("nx", "ny", "nz"), ("normalx", "normaly", "normalz"), ("normal0", "normal1", "normal2")),
    "colors": (
        ("red", "green", "blue"), ("r", "g", "b"), ("diffusered", "diffusegreen", "diffuseblue"),
        ("rf", "gf", "bf"), ("colorr", "colorg", "colorb"), ("cr", "cg", "cb"),
    ),
    "seen_from": (("seenx", "seeny", "seenz"),),
}  # fmt: skip
_ONES: dict[str, Names] = {
    "intensity": ("intensity", "scalarintensity", "reflectance", "scalarreflectance", "remission", "i"),
    "classes": ("classification", "scalarclassification", "class"),
    "sizes": ("radius",),
    "confidence": ("confidence",),
}
_PACKED = ("rgb", "rgba")  # a colour in one number of four bytes, as PCL stores it


def has_positions(names: Iterable[str]) -> bool:
    """Whether three of the names are those of positions."""
    return _first_of(_THREES["positions"], {plain(name) for name in names}) is not None


def found_in(columns: Mapping[str, NDArray[Any]], form: str) -> FoundPoints:
    """The points of named columns (n,), or (n, c). Raises ValueError without x, y and z."""
    known: dict[str, NDArray[Any]] = {}
    for name, column in columns.items():
        if column.ndim == 1:
            known.setdefault(plain(name), column)
    threes = {role: _first_of(groups, known.keys()) for role, groups in _THREES.items()}
    if threes["positions"] is None:
        raise ValueError(f"it has no x, y and z, only {', '.join([*columns][:12]) or 'nothing'}")
    found: dict[str, Any] = {
        role: side_by_side([known[name] for name in names]) for role, names in threes.items() if names
    }
    found |= {role: known[name] for role, names in _ONES.items() for name in names[::-1] if name in known}
    packed = next((known[name] for name in _PACKED if name in known), None)
    if "colors" not in found and packed is not None and packed.dtype.itemsize == 4:
        found["colors"] = unpacked(packed)
    if "seen_from" in found:
        found["seen_from"] = found["seen_from"].astype(np.float64)
    return FoundPoints(form, **found)


def unpacked(colors: NDArray[Any]) -> NDArray[np.uint8]:
    """(n, 3) colours of (n,) numbers of four bytes, 0xRRGGBB each, also where these bytes are called a float."""
    whole = np.ascontiguousarray(colors).view(np.uint32 if colors.dtype.isnative else ">u4")
    return np.stack([whole >> 16 & 255, whole >> 8 & 255, whole & 255], -1).astype(np.uint8)


def _first_of(groups: Iterable[Names], known: Iterable[str]) -> Names | None:
    return next((names for names in groups if set(names) <= set(known)), None)


COUNTS = (3, 4, 6, 7, 9)  # x y z, then an intensity, a colour, a normal, or two of them
_LOOKED_AT = 1000  # rows
_UNIT = 0.9  # of the normals have length 1


def found_by_number(table: NDArray[Any], form: str, name: str, note: Note) -> FoundPoints:
    """The points of a table (n, c). Raises ValueError for fewer than 3 columns."""
    count = table.shape[1]
    if count < 3:
        raise ValueError(f"it has {count} column{'s' if count > 1 else ''}, expected x, y, z and what belongs to them")
    found = FoundPoints(form, table[:, :3])
    some = table[:: -(-len(table) // _LOOKED_AT)] if len(table) else table
    match count:
        case 4:
            found.intensity = table[:, 3]
        case 6 if _are_normals(some[:, 3:]):
            found.normals = table[:, 3:]
        case 6:
            found.colors = table[:, 3:]
        case 7 if _are_colors(some[:, 3:6]) and not _are_colors(some[:, 4:]):
            found.colors, found.intensity = table[:, 3:6], table[:, 6]
        case 7:
            found.intensity, found.colors = table[:, 3], table[:, 4:]
        case 9 if _are_normals(some[:, 3:6]):
            found.normals, found.colors = table[:, 3:6], table[:, 6:]
        case 9:
            found.colors, found.normals = table[:, 3:6], table[:, 6:]
        case 3:
            pass
        case _:
            note(f"{name}: the first three of its {count} columns are read: nothing says what the others are")
    return found


def _are_normals(values: NDArray[Any]) -> bool:
    if values.dtype.kind != "f" or not len(values):
        return False
    return bool((np.abs(np.linalg.norm(values.astype(np.float64), axis=1) - 1) < 0.02).mean() > _UNIT)


def _are_colors(values: NDArray[Any]) -> bool:
    return bool(((values >= 0) & (values <= 255) & (values % 1 == 0)).all())


TEXTS = (".xyz", ".pts", ".asc", ".xyzn", ".xyzrgb")  # names that hold nothing else
_COMMENT = re.compile(rb"\s*(#|//|%|!)")
_HEAD = 1 << 16  # bytes in which the first point lies
_AT_A_TIME = 1 << 22  # bytes
_BOM = b"\xef\xbb\xbf"


class Head(NamedTuple):
    """What comes before the points."""

    at: int  # where they begin
    columns: int
    names: list[str]
    counted: int | None
    has_decimal_commas: bool


def read_text_points(path: FilePath, note: Note, max_pixels: float) -> FoundPoints:
    """The points of a text. Raises ValueError for one that holds anything else, or lines of different length."""
    data = read_bytes(path, max_pixels, CLOUD_TEXT)
    with naming(path, "cannot be read as a point cloud", (ValueError,)):
        head = read_text_head(data[:_HEAD])
        if head is None:
            raise ValueError("no line of its beginning holds x, y and z")
        body = data[head.at :]
        del data
        if any(sign in body for sign in (b"#", b"//", b"%", b"!")):
            body = re.sub(rb"(?:#|//|%|!)[^\r\n]*", b"", body)
        body = body.replace(b",", b"." if head.has_decimal_commas else b" ").replace(b";", b" ")
        table = _table_of_text(body, head)
        if head.counted is not None and head.counted != len(table):
            raise ValueError(f"its first line counts {head.counted} points, and it has {len(table)}")
        check_points(len(table), path, max_pixels)
        if has_positions(head.names) and len(head.names) == head.columns:
            return found_in({name: table[:, k] for k, name in enumerate(head.names)}, "text, columns by their names")
        return found_by_number(table, f"text, {head.columns} columns", str(path), note)


def read_text_head(data: bytes) -> Head | None:
    """What lies before the first point in the beginning of a text; None if there is no point."""
    at = len(_BOM) if data.startswith(_BOM) else 0
    names, count, words_seen = list[str](), None, 0
    for line in data[at:].splitlines(keepends=True):
        comment = _COMMENT.match(line)
        words = _words(line[comment.end() :] if comment else line)
        numbers = None if comment else _numbers(line)
        if numbers is not None and len(numbers) >= 3:
            return Head(at, len(numbers), names, count, b";" in line and b"," in line)
        if comment is None and words:
            words_seen += 1
            if numbers is not None and len(numbers) == 1 and numbers[0] % 1 == 0 and count is None and not names:
                count = int(numbers[0])
            elif numbers is None and words_seen <= 2:
                names = words
            else:
                return None
        elif has_positions(words):
            names = words
        at += len(line)
    return None


def _words(line: bytes) -> list[str]:
    return re.split(r"[\s,;]+", line.decode("utf-8", "replace").strip(" \t\r\n,;")) if line.strip(b" \t\r\n,;") else []


def _numbers(line: bytes) -> list[float] | None:
    line = line.replace(b",", b".") if b";" in line else line
    try:
        return [float(word) for word in _words(line)] or None
    except ValueError:
        return None


def _table_of_text(body: bytes, head: Head) -> NDArray[np.float64]:
    first = 0
    for part in _parts(body):
        words = _words_a_line(part)
        words = words[words > 0]
        if (words != head.columns).any():
            raise _misfit(part, first, head.columns)
        first += len(words)
    values = parse_numbers(body.decode("ascii", "replace"))
    if values.size != first * head.columns:
        first = 0
        for part in _parts(body):
            if not parse_numbers(part.decode("ascii", "replace")).size:
                raise _misfit(part, first, head.columns)
            first += int(np.count_nonzero(_words_a_line(part)))
    return values.reshape(-1, head.columns)


def _parts(body: bytes) -> Iterator[bytes]:
    """Whole lines together, some megabytes at a time."""
    at = 0
    while at < len(body):
        end = body.find(b"\n", at + _AT_A_TIME) + 1 or len(body)
        yield body[at:end]
        at = end


def _words_a_line(part: bytes) -> NDArray[np.int64]:
    """How many words each line has; classic Mac's lines end with a carriage return alone."""
    letters = np.frombuffer(part, np.uint8)
    is_blank = letters <= ord(" ")
    begins = ~is_blank
    begins[1:] &= is_blank[:-1]
    ends = np.append(np.flatnonzero((letters == ord("\n")) | (letters == ord("\r"))), len(letters) - 1)
    return np.diff(np.cumsum(begins)[ends], prepend=0)


def _misfit(part: bytes, first: int, columns: int) -> ValueError:
    """The error that names the first line that is none of so many numbers. first: of the part's points."""
    lines = [line for line in re.split(rb"[\r\n]+", part) if line.strip()]
    wrong = next((k for k, line in enumerate(lines) if len(_numbers(line) or ()) != columns), 0)
    text = shown(lines[wrong].decode("utf-8", "replace").strip())
    return ValueError(f"point {first + wrong} is {text}, expected {columns} numbers as in the lines before it")
