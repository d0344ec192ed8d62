"""The columns of a table of points, of text too: what each means, by name, number and content."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...checks import arguments as checks
from ...notes.notes import Note
from ...notes.words import option, shown
from ...scene.cloud import UPS, Up
from ...scene.gaussians import Gaussians
from ..access.content import CLOUD_TEXT, MAX_PIXELS, FilePath, check_limit, naming, read_bytes
from ..arrays.numpy_files import parse_numbers, plain

COLOR_BY = ("rgb", "intensity", "class", "height")  # beside all fields of a file
_COLUMNS = ("positions", "normals", "colors", "intensity", "classes", "sizes", "confidence", "seen_from")

_BOX = "crop must be two opposite corners of a box, six finite numbers"
MOST_PLACES = 100
_PLACES = f"seen_from must be a place (3,), or up to {MOST_PLACES} of them (k, 3), of finite numbers"


@dataclass(frozen=True)
class CloudOptions:
    """What the caller gives with a cloud; see `load_cloud`."""

    up: Up | None = None
    most: int | None = None
    color_by: str | None = None
    max_pixels: float = MAX_PIXELS
    color_range: Any = None  # two numbers
    columns: str | Sequence[str] | None = None
    all_points: bool = False
    crop: Any = None  # two corners, six numbers
    clean: bool = False
    seen_from: Any = None  # places (k, 3)

    def __post_init__(self) -> None:
        checks.check_positive(self.max_pixels, option("max_pixels", beside_file=True))
        checks.check_flag(self.clean, option("clean"))
        if self.crop is not None:
            corners = checks.as_array(self.crop, _BOX)
            checks.check_numbers(corners.reshape(-1) if corners.shape == (2, 3) else corners, 6, _BOX)
        if self.seen_from is not None:
            places = checks.as_array(self.seen_from, _PLACES)
            if places.shape[-1:] != (3,) or not 0 < places.size <= 3 * MOST_PLACES:
                raise ValueError(f"{_PLACES}, got shape {places.shape}")
            checks.check_numbers(places.reshape(-1), places.size, _PLACES)
        if self.up is not None:
            checks.check_choice(option("up"), self.up, UPS)
        if self.most is not None:
            checks.check_count(self.most, option("most"), 1)
        if self.color_by is not None:
            checks.check_type(self.color_by, str, option("color_by"))
        if self.color_range is not None:
            expected = f"{option('color_range')} must be two numbers, the lower first"
            ends = checks.as_array(self.color_range, expected, np.float64)
            if ends.shape != (2,) or not ends[0] < ends[1] or not np.isfinite(ends).all():
                raise ValueError(f"{expected}, got {shown(self.color_range)}")
            object.__setattr__(self, "color_range", (float(ends[0]), float(ends[1])))
        if self.columns is not None:
            names = self.columns.split(",") if isinstance(self.columns, str) else self.columns
            names = tuple(str(name).strip() for name in names)
            if not has_positions(names):
                such = f"{option('columns')} must name x, y and z, such as x,y,z,nx,ny,nz,label"
                raise ValueError(f"{such}, got {','.join(names)}")
            object.__setattr__(self, "columns", names)


class ColorLegend(NamedTuple):
    """What colours mean: the texts of as many labels, or of the two ends of a row of colours."""

    title: str
    texts: Sequence[str]
    colors: NDArray[np.uint8]  # (n, 3)


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
    in_degrees: bool | None = None  # x and y are longitude and latitude; None: nothing says so, nor the contrary
    # (n,) numbers of the points by the file's names; None: not read, as nobody asks for them
    fields: dict[str, NDArray[Any] | None] = field(default_factory=dict)
    legend: ColorLegend | None = None  # of colours that numbers were turned into
    gaussians: Gaussians | None = None  # what trained splats are beside their positions

    def __len__(self) -> int:
        return len(self.positions)

    def select(self, rows: NDArray[Any]) -> None:
        """Keep these rows only: their numbers, or a mask."""
        count = len(self)
        for name in _COLUMNS:
            column = getattr(self, name)
            if column is not None and column.shape[0] == count and (name != "seen_from" or column.ndim == 2):
                setattr(self, name, column[rows])
        self.gaussians = self.gaussians and self.gaussians.select(rows)
        self.fields = {name: None if one is None else one[rows] for name, one in self.fields.items()}

    def field_named(self, wanted: str | None) -> str | None:
        """The name of a field as the file has it: letters' case does not count, nor CloudCompare's "scalar"."""
        asked = plain(wanted or "").removeprefix("scalar")
        return next((name for name in self.fields if wanted and plain(name).removeprefix("scalar") == asked), None)

    def keep_field(self, wanted: str | None) -> None:
        """Forget the numbers of all other fields."""
        kept = self.field_named(wanted)
        self.fields = {name: one if name == kept else None for name, one in self.fields.items()}


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

_HEIGHTS = ("z", "height", "altitude", "alt", "elevation", "elev", "up", "h")
_LONGITUDES = ("longitude", "lon", "long", "lng")
_DEGREES = tuple(product(_LONGITUDES, ("latitude", "lat"), _HEIGHTS))
_MAPS = tuple((*ground, one) for ground in (("easting", "northing"), ("east", "north")) for one in _HEIGHTS)
# Role: groups of names, the best first. ParaView counts the numbers of an array: Points:0, Points_1.
_THREES: dict[str, tuple[Names, ...]] = {
    "positions": (
        ("x", "y", "z"), ("px", "py", "pz"), ("posx", "posy", "posz"), ("positionx", "positiony", "positionz"),
        ("points0", "points1", "points2"), ("coordinatex", "coordinatey", "coordinatez"),
        ("coordx", "coordy", "coordz"), ("xcoord", "ycoord", "zcoord"), *_MAPS, *_DEGREES,
    ),
    "normals": (
        ("nx", "ny", "nz"), ("normalx", "normaly", "normalz"), ("normal0", "normal1", "normal2"),
        ("normals0", "normals1", "normals2"), ("normalsx", "normalsy", "normalsz"),
    ),
    "colors": (
        ("red", "green", "blue"), ("r", "g", "b"), ("diffusered", "diffusegreen", "diffuseblue"),
        ("rf", "gf", "bf"), ("colorr", "colorg", "colorb"), ("cr", "cg", "cb"), ("rgb0", "rgb1", "rgb2"),
        ("color0", "color1", "color2"), ("colors0", "colors1", "colors2"), ("rgba0", "rgba1", "rgba2"),
    ),
    "seen_from": (("seenx", "seeny", "seenz"),),
}  # fmt: skip
_WHOLE = {  # names of fields of three numbers each
    "positions": ("xyz", "points", "position", "positions", "pos", "coords", "vertices"),
    "normals": ("normal", "normals"),
    "colors": ("rgb", "color", "colors", "rgba"),
}
_ONES: dict[str, Names] = {
    "intensity": ("intensity", "scalarintensity", "reflectance", "scalarreflectance", "remission", "i"),
    "classes": ("classification", "scalarclassification", "class"),
    "sizes": ("radius",),
    "confidence": ("confidence",),
}
_PACKED = ("rgb", "rgba")  # a colour in one number of four bytes, as PCL stores it


def has_points(rows: np.dtype) -> bool:
    """Whether the fields of records hold positions: three of them, or one of three numbers."""
    names = rows.names or ()
    wholes = (name for name in names if plain(name) in _WHOLE["positions"])
    return has_positions(names) or any(rows[name].shape[:1] >= (3,) for name in wholes)


def has_positions(names: Iterable[str]) -> bool:
    """Whether three of the names are those of positions."""
    known = {_key(name) for name in names}
    return _first_of(_THREES["positions"], known) is not None


def found_in(columns: Mapping[str, NDArray[Any]], form: str, options: CloudOptions) -> FoundPoints:
    """The points of named columns (n,), or (n, c). Raises ValueError without x, y and z."""
    columns = _renamed(columns, options.columns)
    known: dict[str, NDArray[Any]] = {}
    for name, column in columns.items():
        if column.ndim == 1:
            known.setdefault(_key(name), column)
    threes = {role: _first_of(groups, known.keys()) for role, groups in _THREES.items()}
    found: dict[str, Any] = {
        role: side_by_side([known[name] for name in names]) for role, names in threes.items() if names
    }
    for role, names in _WHOLE.items():
        whole = (one for name, one in columns.items() if plain(name) in names and one.ndim == 2 and one.shape[1] > 2)
        if role not in found and (three := next(whole, None)) is not None:
            found[role] = three[:, :3]
    if "positions" not in found:
        raise ValueError(f"it has no x, y and z, only {', '.join([*columns][:12]) or 'nothing'}")
    found |= {role: known[name] for role, names in _ONES.items() for name in names[::-1] if name in known}
    packed = next((known[name] for name in _PACKED if name in known), None)
    if packed is not None and packed.dtype == np.float64:  # of a text, whose numbers keep all their digits
        packed = packed.astype(np.float32)
    if "colors" not in found and packed is not None and packed.dtype.itemsize == 4:
        found["colors"] = unpacked(packed)
    if "seen_from" in found:
        found["seen_from"] = found["seen_from"].astype(np.float64)
    places = threes["positions"] or ()
    fields: dict[str, Any] = {name: one for name, one in columns.items() if one.ndim == 1 and _key(name) not in places}
    in_degrees = True if places in _DEGREES else False if options.columns else None
    return FoundPoints(form, **found, fields=fields, in_degrees=in_degrees)


def _key(name: str) -> str:
    """A name as the groups have it; ParaView's points may be called anything that begins so."""
    return re.sub(r"^points[a-z]*(?=[012]$)", "points", plain(name))


def _renamed(columns: Mapping[str, NDArray[Any]], names: str | Sequence[str] | None) -> Mapping[str, NDArray[Any]]:
    """The columns in their order under other names; those called _ are passed over."""
    if names is None:
        return columns
    if len(names) != len(columns):
        raise ValueError(f"{option('columns')} names {len(names)} columns, and it has {len(columns)}")
    return {name: one for name, one in zip(names, columns.values(), strict=True) if name not in ("", "_", "-")}


def unpacked(colors: NDArray[Any]) -> NDArray[np.uint8]:
    """(n, 3) colours of (n,) numbers of four bytes, 0xRRGGBB each, also where these bytes are called a float."""
    whole = np.ascontiguousarray(colors).view(np.uint32 if colors.dtype.isnative else ">u4")
    return np.stack([whole >> 16 & 255, whole >> 8 & 255, whole & 255], -1).astype(np.uint8)


def _first_of(groups: Iterable[Names], known: Iterable[str]) -> Names | None:
    return next((names for names in groups if set(names) <= set(known)), None)


COUNTS = (3, 4, 6, 7, 9)  # x y z, then an intensity, a colour, a normal, or two of them
_LOOKED_AT = 1000  # rows
_UNIT = 0.9  # of the normals have length 1
_FEW = 32  # values of labels, among as many rows
_NORMAL, _COLOR, _INTENSITY = ("nx", "ny", "nz"), ("red", "green", "blue"), ("intensity",)
_USUAL = ((), _INTENSITY, _COLOR, _NORMAL, (*_INTENSITY, *_COLOR), (*_NORMAL, *_COLOR), (*_COLOR, *_NORMAL))


def found_by_number(table: NDArray[Any], form: str, name: str, note: Note, options: CloudOptions) -> FoundPoints:
    """The points of a table (n, c) without names. Raises ValueError for fewer than 3 columns."""
    count = table.shape[1]
    if count < 3:
        raise ValueError(f"it has {count} column{'s' if count > 1 else ''}, expected x, y, z and what belongs to them")
    if options.columns is not None:
        return found_in(dict(enumerate(table.T)), form, options)  # type: ignore[arg-type]
    some = table[:: -(-len(table) // _LOOKED_AT)] if len(table) else table
    names, is_clear = _by_content(some)
    if not is_clear or names not in _USUAL:
        given = ",".join(["x", "y", "z", *names])
        note(f"{name}: its {count} columns are taken as {given}; pass {option('columns', 'x,y,z,...')} if they are not")
    return found_in(dict(zip(["x", "y", "z", *names], table.T, strict=True)), form, options)


def _by_content(some: NDArray[Any]) -> tuple[Names, bool]:
    """What the columns after x, y and z are, by their numbers, and whether nothing else would fit."""
    names, is_clear, k, count = list[str](), True, 3, some.shape[1]
    while k < count:
        three = some[:, k : k + 3]
        if k + 3 <= count and "nx" not in names and _are_normals(three):
            found = _NORMAL
        elif k + 3 <= count and "red" not in names and _are_colors(three):
            later = k + 4 <= count and "intensity" not in names and _are_colors(some[:, k + 1 : k + 4])
            begins = _color_begins(some[:, k : k + 4].astype(np.float64)) if later else 0
            is_clear &= begins is not None
            found = _COLOR if begins == 0 else _INTENSITY
        else:
            found = (_single(some[:, k], names, k),)
        names += found
        k += len(found)
    return tuple(names), is_clear


def _color_begins(four: NDArray[np.float64]) -> int | None:
    """At which of four columns that may all be colours the three of a colour begin; None where both may be."""
    few = [_is_few(column) for column in four.T]
    if few[0] != few[3]:
        return int(few[0])
    red, green, blue = (np.ptp(one) for one in four.T[:3])
    if not (red and green and blue and np.ptp(four[:, 3])):
        return None
    together = np.asarray(np.corrcoef(four.T))
    first, last = together[0, 1], together[2, 3]  # red and green go together, more than light and red
    if abs(first - last) > 0.2 and max(first, last) < 0.999:
        return int(last > first)
    return None


def _single(column: NDArray[Any], names: Sequence[str], k: int) -> str:
    if names[-1:] == ["blue"] and len(column) and np.ptp(column) == 0 and column[0] in (1, 255):
        return "alpha"
    if _is_few(column) and "label" not in names:
        return "label"
    return f"column{k + 1}" if "intensity" in names else "intensity"


def _is_few(column: NDArray[Any]) -> bool:
    """Whether the numbers are whole ones, few of them and each often, as of labels."""
    values = np.unique(column)
    is_whole = bool(np.isfinite(values).all() and (values % 1 == 0).all())
    return is_whole and len(values) <= min(_FEW, 1 + len(column) // 8)


def _are_normals(values: NDArray[Any]) -> bool:
    if values.dtype.kind != "f" or not len(values):
        return False
    lengths = np.linalg.norm(values.astype(np.float64), axis=1)
    known = lengths[lengths > 0]
    return len(known) > len(values) / 2 and bool((np.abs(known - 1) < 0.02).mean() > _UNIT)


def _are_colors(values: NDArray[Any]) -> bool:
    """0 to 1, or whole numbers of 8 or 16 bits; a column of zeros alone is none."""
    if not len(values) or not (np.isfinite(values).all() and values.min() >= 0) or values.max() == 0:
        return False
    return bool(values.max() <= 1 or (values.max() <= 65535 and (values % 1 == 0).all()))


TEXTS = (".xyz", ".pts", ".ptx", ".asc", ".xyzn", ".xyzrgb", ".xyzi", ".xyzl")  # names that hold nothing else
_COMMENT = re.compile(rb"\s*(#|//|%|!)")
_HEAD = 1 << 16  # bytes in which the first point lies
_AT_A_TIME = 1 << 22  # bytes
_BOM = b"\xef\xbb\xbf"
UTF_16 = b"\xff\xfe", b"\xfe\xff"


class Head(NamedTuple):
    """What comes before the points."""

    at: int  # where they begin
    columns: int
    names: list[str]
    counted: int | None
    has_decimal_commas: bool


def read_text_points(path: FilePath, note: Note, options: CloudOptions) -> FoundPoints:
    """The points of a text. Raises ValueError for one that holds anything else, or lines of different length."""
    data = _as_utf8(read_bytes(path, options.max_pixels, CLOUD_TEXT))
    with naming(path, "cannot be read as a point cloud", (ValueError,)):
        head = read_text_head(data[:_HEAD])
        if head is None:
            raise ValueError("no line of its beginning holds x, y and z")
        body = data[head.at :]
        del data
        if any(sign in body for sign in (b"#", b"//", b"%", b"!")):
            body = re.sub(rb"(?:#|//|%|!)[^\r\n]*", b"", body)
        body = _spaced(body, head.has_decimal_commas)
        if head.counted is not None:  # texts of several scans count the points of each
            body = re.sub(rb"(?m)^[ \t]*\d+[ \t]*$", b"", body)
        table = _table_of_text(body, head)
        if head.counted is not None and head.counted != len(table):
            note(f"{path}: its first line counts {head.counted} points, and it has {len(table)}: these are read")
        check_points(len(table), path, options.max_pixels)
        if has_positions(head.names) and options.columns is None:
            names = [*head.names, *(f"column{k + 1}" for k in range(len(head.names), head.columns))]
            if len(names) > head.columns:
                way_out = f"pass {option('columns', 'x,y,z')}"
                raise ValueError(f"it names {len(names)} columns, and has {head.columns}: {way_out}")
            columns = dict[str, NDArray[Any]]()
            for k, name in enumerate(names):
                columns[name if name not in columns else f"{name}{k + 1}"] = table[:, k]
            return found_in(columns, "text, columns by their names", options)
        return found_by_number(table, f"text, {head.columns} columns", str(path), note, options)


def _as_utf8(data: bytes) -> bytes:
    """A text without its mark; those of PowerShell have two bytes a letter."""
    is_wide = data.startswith(UTF_16)
    return data.decode("utf-16", "replace").encode() if is_wide else data.removeprefix(_BOM)


def read_text_head(data: bytes) -> Head | None:
    """What lies before the first point in the beginning of a text; None if there is no point."""
    data = _as_utf8(data[: len(data) // 2 * 2])
    at, names, count, words_seen = 0, list[str](), None, 0
    for line in data.splitlines(keepends=True):
        comment = _COMMENT.match(line)
        line_names = _names(line[comment.end() :] if comment else line)
        has_commas = (b";" in line and b"," in line) or _DECIMAL_COMMAS.fullmatch(line) is not None
        numbers = None if comment else _numbers(line, has_commas)
        if numbers is not None and len(numbers) >= 3:
            return Head(at, len(numbers), names, count, has_commas)
        if comment is None and line_names:
            words_seen += 1
            if numbers is not None and len(numbers) == 1 and numbers[0] % 1 == 0 and count is None:
                count = int(numbers[0])
            elif numbers is None and words_seen <= 2:
                names = line_names
            else:
                return None
        elif has_positions(line_names):
            names = line_names
        at += len(line)
    return None


def shows_points(data: bytes, head: Head) -> bool:
    """Whether the beginning of a text has colours or normals beside three numbers."""
    lines = _spaced(data[head.at :], head.has_decimal_commas).splitlines()[:-1]
    rows = parse_numbers(b"\n".join(lines).decode("ascii", "replace"))
    return rows.size > 0 and rows.size % head.columns == 0 and are_points(rows.reshape(-1, head.columns))


def are_points(rows: NDArray[Any]) -> bool:
    """Whether rows of a table have colours or normals beside three numbers."""
    return not {"red", "nx"}.isdisjoint(_by_content(rows)[0])


_DECIMAL_COMMAS = re.compile(rb"\s*(?:[-+]?\d+,\d+(?:[eE][-+]?\d+)?(?:[\s|]+|$)){3,}")


def _spaced(text: bytes, has_decimal_commas: bool) -> bytes:
    """The same text with points in its numbers and blanks between them."""
    commas = text.replace(b",", b"." if has_decimal_commas else b" ")
    return commas.replace(b";", b" ").replace(b"|", b" ")


def _names(line: bytes) -> list[str]:
    """The words of a line. Between commas, semicolons or tabs they may have blanks; units in brackets do not count."""
    text = re.sub(r"[\[(][^\])]*[\])]", "", line.decode("utf-8", "replace")).strip()
    sign = next((one for one in ";\t,|" if text.count(one) >= 2), None)
    words = re.split(r"[\s,;|]+", text) if sign is None else text.split(sign)
    words = [word.strip(" \t\"',;|") for word in words]
    return words if all(words) else [word for word in words if word]


def _numbers(line: bytes, has_decimal_commas: bool = False) -> list[float] | None:
    line = _spaced(line, has_decimal_commas)
    try:
        return [float(word) for word in line.split()] or None
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
    wrong = next((k for k, line in enumerate(lines) if len(_numbers(line, False) or ()) != columns), 0)
    text = shown(lines[wrong].decode("utf-8", "replace").strip())
    return ValueError(f"point {first + wrong} is {text}, expected {columns} numbers as in the lines before it")
