"""Reads points that are written as text: XYZ, PTS, CSV and the like, one point a line.

Before the points there may be a count (PTS), comments, and names of the columns, also behind # or //.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import shown
from ..access.content import FilePath, naming, read_bytes
from ..access.limits import CLOUD_TEXT
from ..arrays.array_files import parse_numbers
from .field_names import found_in, has_positions
from .found_points import FoundPoints, check_points
from .numbered_columns import found_by_number

TEXTS = (".xyz", ".pts", ".asc", ".xyzn", ".xyzrgb")  # names that hold nothing else
_COMMENT = re.compile(rb"\s*(#|//|%|!)")
_HEAD = 1 << 16  # bytes in which the first point lies
_AT_A_TIME = 1 << 22  # bytes
_BOM = b"\xef\xbb\xbf"


class Head(NamedTuple):
    """What comes before the points. at: where they begin; separators: bytes that become blanks, and decimal commas."""

    at: int
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
        table = _table(_plain(body, head), head)
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
            has_commas = b";" in line and b"," in line
            return Head(at, len(numbers), names, count, has_commas)
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


def _plain(body: bytes, head: Head) -> bytes:
    """The numbers with blanks between them."""
    if head.has_decimal_commas:
        return body.replace(b",", b".").replace(b";", b" ")
    return body.translate(bytes.maketrans(b",;", b"  "))


def _table(body: bytes, head: Head) -> NDArray[np.float64]:
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
