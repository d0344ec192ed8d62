"""Reads named numbers from any text that has them: JSON, YAML, `name: 1 2`, `name,1`, `name = [1 2; 3 4]`.

Camera files of ROS, OpenCV, ORB-SLAM, KITTI, Middlebury, ScanNet and many others are read alike: their names differ.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Any

from ..access.content import MAX_PIXELS, FilePath, parse_object, split_numbers

_MODEL = re.compile(r"(?i)(.*model|.*type|distort?s?ion|projection|(is_?)?(fisheye|latlong))")  # what a text may name


class Named(dict[str, list[float]]):
    """Numbers by path, such as "camera_matrix.data" or "frames.0.fl_x", and texts that may name a camera's model."""

    def __init__(self, items: Iterable[tuple[str, list[float]]] = ()):
        super().__init__(items)
        self.texts: dict[str, str] = {}


_MOST = 65_536  # names that are looked at: a file of a thousand frames has their cameras too

_LONGEST, _DEEPEST = 500, 10  # characters and levels of a name that is looked at; levels of a list of numbers

# Each takes time in proportion to a line: where one repetition ends, the next cannot begin.
_NAME = re.compile(r"(\s*)(?:-\s+)?\"?([A-Za-z_][\w./ -]*)")
_VALUE = re.compile(r"\"?\s*[:=,](.*)")  # after a name
_KEY = re.compile(r"^(\s*)(\d+):\s*$")  # BOP's and T-LESS' YAML: a block for each frame
_HEADED = re.compile(r"^([A-Za-z_]\w*)\s+(-?[\d.][-+\d.eE\s]*)$")  # Matterport3D: intrinsics_matrix 1 0 0 ...
_ITEM = re.compile(r"^\s*-\s+([^:\s][^:]*)$")
_BRACKETS = re.compile(r"\[[^\]]*\]")
_AROUND = " \t\r\n,;[](){}\"'"  # numbers
_TAG = re.compile(r"!!?[\w-]+")


def read_named(text: str, path: FilePath, max_pixels: float = MAX_PIXELS) -> Named:
    """All numbers of a text that have a name; none if it has no names. Raises ValueError for broken JSON."""
    if text.lstrip().startswith("{"):
        return named_of(parse_object(text, path, max_pixels))
    return _named_of_lines(text)


def named_of(data: Any) -> Named:
    """All numbers in nested dictionaries. The lists of a matrix become one list; lists of anything else are counted."""
    found = Named()
    for name, value in islice(_walk(data, ""), _MOST):
        if isinstance(value, str):
            found.texts[name] = value
        else:
            found[name] = value
    return found


def _walk(value: Any, name: str) -> Iterator[tuple[str, list[float] | str]]:
    if len(name) > _LONGEST or name.count(".") > _DEEPEST:
        return
    numbers = _flat(value)
    if numbers is not None:
        yield name, numbers
    elif isinstance(value, dict | list):
        for key, part in value.items() if isinstance(value, dict) else enumerate(value):
            if isinstance(part, str | bool):
                if _MODEL.fullmatch(str(key)) and part:  # a switch that is on is named by its key
                    yield f"{name}.{key}".lstrip("."), part if isinstance(part, str) else str(key)
                continue
            yield from _walk(part, f"{name}.{key}".lstrip("."))


def _flat(value: Any, levels: int = _DEEPEST) -> list[float] | None:
    """The numbers of a number, or of nested lists that hold nothing else, up to so many levels."""
    if isinstance(value, bool) or value is None or isinstance(value, dict):
        return None
    if isinstance(value, int | float):
        return [float(value) if abs(value) < 1e300 else float("inf")]
    if not isinstance(value, list) or not value or not levels:
        return None
    found: list[float] = []
    for part in value:
        numbers = _flat(part, levels - 1)
        if numbers is None:
            return None
        found += numbers
    return found


def _named_of_lines(text: str) -> Named:
    """Names are joined to those of the lines above that are indented less, as in YAML."""
    closed = text.rfind("]") + 1
    text = _BRACKETS.sub(lambda found: found[0].replace("\n", " "), text[:closed]) + text[closed:]
    found = Named()
    above: list[tuple[int, str]] = []  # indents, and names with those that they are joined to
    heading = ""  # MVSNet: a word, and a matrix in the lines below
    for line in text.splitlines()[:_MOST]:
        line = line.partition("#")[0]
        if heading and line.strip() and (numbers := split_numbers(line, _AROUND)):
            found.setdefault(heading, []).extend(numbers)
            continue
        heading = line.strip() if re.fullmatch(r"[A-Za-z_]+", line.strip()) else ""
        item = _ITEM.match(line)
        if item and above and (numbers := split_numbers(item[1], _AROUND)):
            found.setdefault(above[-1][1], []).extend(numbers)
            continue
        if headed := _HEADED.match(line):
            found.setdefault(headed[1], split_numbers(headed[2]) or [])
            continue
        if key := _KEY.match(line):
            above = [(len(key[1]), key[2])]
            continue
        start = _NAME.match(line)
        rest = _VALUE.match(line, start.end()) if start else None
        if not start or not rest:
            continue
        indent, name, value = len(start[1]), start[2].strip(), _TAG.sub("", rest[1]).strip()
        while above and above[-1][0] >= indent:
            above.pop()
        name = f"{above[-1][1]}.{name}" if above else name
        if len(name) > _LONGEST or name.count(".") > _DEEPEST:
            continue
        if not value:
            above.append((indent, name))
        elif numbers := split_numbers(value, _AROUND):
            found[name] = numbers
        elif _MODEL.fullmatch(start[2].strip().rpartition(".")[2]) and value.lower() not in ("false", "no"):
            found.texts[name] = name if value.lower() in ("true", "yes") else value.strip(_AROUND)
    return found
