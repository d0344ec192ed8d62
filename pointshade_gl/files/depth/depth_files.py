"""Reads depth images as raw numbers: also of swapped or rotated bytes, spread over channels, or in colours of a map."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import cache
from itertools import permutations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import option
from ..access import content
from ..access.content import MAX_PIXELS, PICTURE_TEXT, FilePath
from ..access.known_names import asset
from ..arrays.numpy_files import NUMPY, parse_numbers, read_dpt, read_npy, read_npz
from ..pictures.hdr_files import EXR, read_exr, read_float_tiff
from ..pictures.picture_files import NotAPictureError, read_deep_colors, read_image
from .missing_depth import FAR, blocks
from .planes import measure_bending

_GAP = rb"(?:\s|#[^\n]*\n)+"
_NUMBER = _GAP + rb"(\d{1,9})"
_PGM = re.compile(rb"P([25])" + 3 * _NUMBER + rb"\s")
_HEADER = 4096  # bytes of the longest PGM header
_ZIP, _PNG = b"PK", b"\x89PNG"
TEXT_SUFFIXES = (".csv", ".txt")
_SEPARATORS = str.maketrans(",;\t", "   ")
_SMALLEST_TABLE = 8  # rows and columns
_POINTS = (3, 4, 6, 7)  # channels of points: x, y, z, perhaps with a colour in one, three or four more
_COLORS = {"red": ("red", "r"), "green": ("green", "g"), "blue": ("blue", "b"), "alpha": ("alpha", "a")}
_RAW = {1: "u1", 2: "<u2", 4: "<f4", 8: "<f8"}  # of headerless files, by the bytes of a value
_LEAST, _MOST = 1e-6, 1e6  # between which sizes of floats lie: integers read as floats lie elsewhere


def read_depth(path: FilePath, note: Note, max_pixels: float = MAX_PIXELS, channel: str | None = None) -> NDArray[Any]:
    """(h, w) values of a depth picture as they are stored, (h, w, 3|4) uint8 of a colour-mapped one, by its content.

    Of points (h, w, 3 to 7) floats. channel is the name or the number of the one to take.

    Raises OSError if the path is not a file, ValueError for another or too large a picture, and without EXR's extra.
    """
    head, name = content.read_head(path), str(path)
    if head.startswith(NUMPY):
        raw = _columns(read_npy(path, max_pixels, kinds="biufV"), name)
    elif head.startswith(_ZIP):
        raw, channel = read_npz(path, note, max_pixels, channel), None
    elif head.startswith(EXR):
        return read_exr(path, max_pixels, channel)
    elif Path(path).suffix.lower() == ".dpt":
        raw = read_dpt(path, max_pixels)
    elif head[:2] in (b"P2", b"P5"):
        raw = _read_pgm(Path(path), max_pixels)
    elif Path(path).suffix.lower() in TEXT_SUFFIXES and is_table(path):
        raw = _read_text(path, max_pixels)
    else:
        try:
            is_deep = head.startswith(_PNG) and head[24:25] == b"\x10" and head[25:26] != b"\0"
            raw = read_deep_colors(path, max_pixels) if is_deep else read_image(path, max_pixels)
        except NotAPictureError as error:
            found = read_float_tiff(path, max_pixels) if head[:2] in (b"II", b"MM") else None
            if found is not None:
                return one_channel(found, name, channel)
            way = f"pass depth in one of them as {option('depth', 'FILE')}, or the folder that holds it"
            raise ValueError(f"{error}, NumPy (.npy, .npz) and EXR: {way}") from None
    return one_channel(raw, name, channel)


def _columns(array: NDArray[Any], name: str) -> NDArray[Any]:
    """(h, w, 3|6) x, y, z and colours of an array of records; any other as it is."""
    names = array.dtype.names or ()
    if not names:
        return array
    taken = [key for key in "xyz" if key in names] or [key for key in ("depth", "z") if key in names][:1]
    colors = [key for key in "rgb" if key in names] if len(taken) == 3 else []
    if not taken:
        raise ValueError(f"{name} holds records of {', '.join(names)}, expected x, y and z, or depth")
    columns = [array[key].astype(np.float32) for key in (*taken, *(colors if len(colors) == 3 else ()))]
    return np.stack(columns, -1) if len(columns) > 1 else columns[0]


def is_table(path: FilePath) -> bool:
    """Whether a text begins with as many numbers in a line as a row of a picture has."""
    lines = content.read_head(path, 2**16).decode("utf-8", "replace").translate(_SEPARATORS).splitlines()
    return any(parse_numbers(line).size >= _SMALLEST_TABLE for line in lines[:2])


def _read_text(path: FilePath, max_pixels: float) -> NDArray[np.float64]:
    """(h, w) numbers of a text, a line for each row."""
    data = content.read_bytes(path, max_pixels, PICTURE_TEXT).decode("utf-8-sig", "replace")
    rows = [line for line in data.translate(_SEPARATORS).splitlines() if line.strip() and not line.startswith("#")]
    if rows and not parse_numbers(rows[0]).size:
        rows = rows[1:]  # a head
    widths = {len(row.split()) for row in rows}
    values = parse_numbers("\n".join(rows))
    if len(widths) != 1 or len(rows) * max(widths) != values.size or min(len(rows), *widths) < _SMALLEST_TABLE:
        expected = "expected a table of numbers, a line for each row of the picture"
        raise ValueError(f"{path} is no depth as text: {expected}")
    content.check_pixels(max(widths), len(rows), str(path), max_pixels)
    return values.reshape(len(rows), -1)


def read_raw(path: FilePath, width: int, height: int, max_pixels: float = MAX_PIXELS) -> NDArray[Any]:
    """(h, w) values of a bare file, such as depth.bin or depth.raw, of the size that the camera's file states.

    The file's size decides the type: 1 and 2 bytes are unsigned integers, 4 and 8 floating point; 4 bytes that make no
    sensible float are integers. Little-endian; `depth_coding.decode` sees swapped ones. Raises ValueError for others.
    """
    content.check_pixels(width, height, str(path), max_pixels)
    data = content.read_bytes(path, max_pixels)
    size, rest = divmod(len(data), width * height)
    if rest or size not in _RAW:
        raise ValueError(f"{path} has {len(data)} bytes, expected 1, 2, 4 or 8 for each of {width}x{height} pixels")
    values = np.frombuffer(data, _RAW[size])
    if size == 4:
        seen = np.abs(values[:: max(1, values.size // 4096)])
        seen = seen[seen != 0]
        if np.count_nonzero((seen > _LEAST) & (seen < _MOST)) < 0.5 * np.count_nonzero(np.isfinite(seen)):
            values = values.view("<u4")
    return values.astype(values.dtype.newbyteorder("="), copy=False).reshape(height, width)


def one_channel(array: NDArray[Any], name: str, channel: str | None = None) -> NDArray[Any]:
    """(h, w) of an array (h, w), (h, w, 1), (1, h, w) or equal channels; differing (h, w, 3|4) uint8 and points stay.
    channel: the one to take: red, green, blue or alpha, or its number from 0."""
    if array.dtype.kind not in "iuf":
        raise ValueError(f"{name} must hold integer or floating point depth, got {array.dtype}")
    shape = array.shape
    if array.ndim > 2:
        array = array.reshape([n for n in shape if n != 1] if shape.count(1) == len(shape) - 2 else shape)
    if channel is not None:
        return _chosen(array, name, channel)
    if array.ndim == 3 and array.shape[2] in _POINTS:
        colors = array[..., :3]
        if np.array_equal(colors, np.broadcast_to(colors[..., :1], colors.shape), equal_nan=colors.dtype.kind == "f"):
            return array[..., 0]
        if array.dtype.kind == "f" or (array.dtype == np.uint8 and array.shape[2] < 5):
            return array
        varied = [k for k in range(3) if np.ptp(array[..., k])]
        if len(varied) == 1:
            return array[..., varied[0]]
        way_out = f"pass {option('channel', 'NAME')}"
        raise ValueError(f"{name} has {array.shape[2]} channels that differ, expected depth in one channel: {way_out}")
    if array.ndim != 2 or 0 in array.shape:
        raise ValueError(f"{name} must have shape (h, w), got {shape}")
    return array


def _chosen(array: NDArray[Any], name: str, channel: str) -> NDArray[Any]:
    """The channel of this name or number."""
    count = array.shape[2] if array.ndim == 3 else 1
    number = next((k for k, names in enumerate(_COLORS.values()) if channel.lower() in names), None)
    number = int(channel) if channel.isdecimal() else number
    if number is None or number >= count:
        known = ", ".join(_COLORS) if count == 4 else ", ".join(map(str, range(count)))
        raise ValueError(f"{name} has no {option('channel', channel)}, only {known}")
    return array[..., number] if array.ndim == 3 else array


def _read_pgm(path: Path, max_pixels: float) -> NDArray[Any]:
    """Not by Pillow, which stretches the values to 65535 if the file's maximum is lower."""
    with content.open_regular(path) as file:
        header = _PGM.match(file.read(_HEADER))
        if not header:
            raise ValueError(f"{path} is a PGM with a broken header")
        kind, width, height, maximum = (int(text) for text in header.groups())
        if not (0 < maximum < 65536 and width and height):
            raise ValueError(f"{path} is a PGM of {width}x{height} with maximum {maximum}: there is no such picture")
        content.check_pixels(width, height, str(path), max_pixels)
        dtype, count = np.dtype(">u2" if maximum > 255 else "u1"), width * height
        if kind == 2:
            content.check_size(file, path, max_pixels, PICTURE_TEXT)
        file.seek(header.end())
        body = file.read() if kind == 2 else file.read(count * dtype.itemsize)
    if kind == 2:
        values = parse_numbers(body.decode("ascii", "replace"))[:count]
        if not values.size or not ((values >= 0) & (values == np.floor(values))).all():
            raise ValueError(f"{path} is a PGM of text, expected nothing but whole numbers after its header")
        values = values.clip(max=maximum).astype(dtype)
    else:
        values = np.frombuffer(body, dtype, len(body) // dtype.itemsize)
    if values.size < count:
        raise ValueError(f"{path} is truncated: expected {count} pixels, got {values.size}")
    return values.astype(dtype.newbyteorder("=")).reshape(height, width)


Codes = NDArray[np.uint16]
Counts = NDArray[np.int64]  # how many pixels have each of the 65536 codes

_ROWS, _FEW_ROWS = 500, 60  # looked at to count values, and to see how smooth they are
_SMOOTHER = 8  # sensors: 80 to 500 for bytes, 37 for confidence
MILLIMETRES = np.uint16(8191)  # the low 13 bits of Android's DEPTH16
_STEP = 256  # millimetres: the mean step between neighbours is less in any picture of depth
_HALF_NEAREST, _HALF_INFINITE = 0x2E00, 0x7C00  # 0.09 m; 65504 is one less than infinite
_DISTINCT = 50  # different values, at least, of which a coding is known
KINECT_MISSING = 2047  # of 11 bits
KINECT_FIRST, KINECT_LAST = 300, 1090  # from 0.44 m to where distances become infinite


def as_codes(raw: NDArray[Any]) -> Codes | None:
    """The values as uint16, if they are integers that fit; None for others and for 8 bits."""
    if raw.dtype == np.uint16:
        return raw
    if raw.dtype.kind not in "iu" or raw.dtype.itemsize < 2 or raw.min() < 0 or raw.max() > 65535:
        return None
    return raw.astype(np.uint16)


def count_codes(raw: Codes) -> Counts:
    """How many pixels of some rows have each code."""
    return np.bincount(raw[:: max(1, raw.shape[0] // _ROWS)].ravel(), minlength=65536)


def is_swapped(raw: Codes) -> bool:
    raw = _some_rows(raw)
    if not (raw & 255).any():
        return False  # 8 bits stored in the high byte: swapped they would be smoother and wrong
    return _roughness(raw) > _SMOOTHER * _roughness(raw.byteswap())


def has_confidence(raw: Codes) -> bool:
    """Whether it is Android's DEPTH16: millimetres in the low 13 bits, a code of confidence in the others."""
    # the code (0: 100 %, 1: 0 %, up to 7: 86 %) means little: a time-of-flight phone wrote 1 for 84 % of a good frame
    raw = _some_rows(raw)
    raw = np.where(raw < FAR, raw, 0)
    low = _roughness(raw & MILLIMETRES)
    return low < _STEP and _roughness(raw) > _SMOOTHER * low


def is_rotated(raw: Codes, counts: Counts) -> bool:
    """Whether it is SUN RGB-D's coding of millimetres d, (d << 3 | d >> 13): multiples of 8 up to 8191 mm."""
    # multiples of 16 are something else, such as 8 or 12 bits moved to the left
    many = counts.reshape(-1, 8).sum(axis=0)
    known = many.sum() - counts[0]
    # up to 16 and 24 m the lowest bits are 1 and 2
    if 10 * (many[0] - counts[0]) < known or many[3:].sum() > 0.001 * known or not counts[8::16].any():
        return False
    if np.count_nonzero(counts[8::8]) < _DISTINCT:
        return False
    raw = _some_rows(raw)
    return not many[1:].any() or 8 * _roughness(rotated_back(raw)) < _roughness(raw)


def rotated_back(raw: Codes) -> Codes:
    """Millimetres of SUN RGB-D's coding."""
    return np.bitwise_or(np.right_shift(raw, 3), np.left_shift(raw, 13))


def is_half(raw: Codes, counts: Counts) -> bool:
    """Whether the bits are those of 16-bit floats (CO3D, Mid-Air): as floats planes bend as depth, as integers not."""
    # as millimetres they would all lie between 11 and 32 m, the farthest at most twice as far as the nearest
    codes = np.flatnonzero(counts[: _HALF_INFINITE - 64])
    codes = codes[codes > 0]
    if codes.size < _DISTINCT or codes[0] < _HALF_NEAREST or counts[_HALF_INFINITE + 1 :].any():
        return False
    known = (raw > 0) & (raw < _HALF_INFINITE - 64)
    as_float = measure_bending(np.where(known, raw, 0).view(np.float16).astype(np.float32), known)
    as_integer = measure_bending(raw, known)
    return as_float is not None and as_integer is not None and as_float.along < 4 and as_integer.is_surely(6, np.inf)


def is_kinect(counts: Counts) -> bool:
    """Whether it is the raw disparity of the first Kinect: 11 bits, 2047 for missing, nothing from 1090 to there."""
    missing = counts[KINECT_MISSING]
    known = counts[KINECT_FIRST:KINECT_LAST].sum()
    others = counts.sum() - missing - known - counts[0]
    return missing > 0.005 * counts.sum() and missing > counts[0] and known > 0 and others < 0.001 * known


def _some_rows(raw: Codes) -> Codes:
    return raw[:: max(1, raw.shape[0] // _FEW_ROWS)]


def _roughness(raw: Codes) -> float:
    """The mean step between horizontal neighbours that both have a depth."""
    values = raw.astype(np.int32)
    known = (values[:, 1:] > 0) & (values[:, :-1] > 0)
    steps = np.abs(np.diff(values, axis=1))[known]
    return float(steps.mean()) if steps.size else 0.0


_CHANNEL_ROWS = 120  # looked at
_FEWEST = 30  # places where the higher byte changes by one
_CARRIED = 0.3  # of these the two together change by less than _STEP; in photographs hardly any
_CHANNEL_STEP = 128
_BETTER = 2.0  # times as often as in the other order
CARLA = (2**24 - 1) / 1000  # values a metre


def find_channels(image: NDArray[np.uint8]) -> tuple[int, ...] | None:
    """The channels of (h, w, 3|4) that hold the bytes of one number, the lowest first; None for any other picture."""
    some = image[:: max(1, image.shape[0] // _CHANNEL_ROWS)].astype(np.int32)
    varied = [k for k in range(image.shape[2]) if np.ptp(some[..., k])]
    if image.shape[2] == 4 and (found := _float_order(image)):
        return found
    if len(varied) not in (2, 3):
        return None
    orders = tuple(permutations(varied)) if len(varied) == 2 else ((0, 1, 2), (2, 1, 0))
    (other, _), (share, order) = sorted((_carried(some[..., one[-2]], some[..., one[-1]]), one) for one in orders)
    return order if share > _CARRIED and share > _BETTER * other else None


def _carried(low: NDArray[np.int32], high: NDArray[np.int32]) -> float:
    """Return how often the lower byte starts again where the higher one changes by one between neighbours."""
    up, whole = np.diff(high, axis=1), np.diff(low + 256 * high, axis=1)
    one = np.abs(up) == 1
    return float(np.mean(np.abs(whole[one]) < _CHANNEL_STEP)) if np.count_nonzero(one) >= _FEWEST else 0.0


def _float_order(image: NDArray[np.uint8]) -> tuple[int, ...] | None:
    """The order that makes floats from 1 cm to 10 km of four bytes: blue first, as OpenCV has it, or as they are."""
    for order in ((2, 1, 0, 3), (0, 1, 2, 3)):
        values = join_channels(image, order)
        known = values[(values != 0) & np.isfinite(values)]
        if known.size and np.mean((known > 0.01) & (known < 10_000)) > 0.9:
            return order
    return None


def join_channels(image: NDArray[Any], channels: tuple[int, ...]) -> NDArray[Any]:
    """(h, w) uint16 of two channels, uint32 of three, float32 of four, the lowest byte first."""
    if len(channels) == 4:
        return np.ascontiguousarray(image[..., list(channels)]).view("<f4")[..., 0].astype(np.float32)
    values = sum(image[..., channel].astype(np.uint32) << 8 * k for k, channel in enumerate(channels))
    return np.asarray(values, np.uint16 if len(channels) == 2 else np.uint32)


MAPS = {  # in the order of the rows, each with the colour of its upper end
    "Spectral_r": "red",
    "inferno": "pale yellow",
    "magma": "pale yellow",
    "viridis": "yellow",
    "plasma": "yellow",
    "turbo": "red",
    "jet": "red",
}
_SAMPLE = 4096  # pixels that decide which map it is
_NEAR = 24.0  # steps of 8 bits, red, green and blue together: so far JPEG moves a colour off its map
_COLOURFUL = 40  # between the largest and the smallest of red, green and blue: greys fit several maps
_FITS, _LONG = 0.9, 64  # the share of colourful pixels on the map, and how many of its 256 steps they use
_CALM = 12  # steps between neighbours, in the middle: a photograph whose colours fit jumps on the map


class Levels(NamedTuple):
    """What a colour-mapped picture holds: (h, w) float32, 0 to 255 along the map, NaN where the colour is not on it."""

    name: str
    values: NDArray[np.float32]


def read_levels(image: NDArray[np.uint8]) -> Levels | None:
    """The levels of a picture (h, w, 3|4), None if its colours lie on no known map. Transparent pixels are holes."""
    index = _find_map(image)
    if index is None:
        return None
    entries = _tables()[index]
    place = np.zeros(256**3, np.float32)  # of each colour met so far, and 1 more; pages are real once written
    values = np.empty(image.shape[:2], np.float32)
    for rows in blocks(values):
        codes = image[rows][..., :3].astype(np.uint32) @ np.array((65536, 256, 1), np.uint32)  # one number a colour
        met = np.unique(codes)
        new = met[place[met] == 0]
        place[new] = _places(np.stack([new >> 16, new >> 8 & 255, new & 255], axis=1), entries) + 1
        values[rows] = place[codes] - 1
        if image.shape[2] == 4:
            values[rows][image[rows][..., 3] == 0] = np.nan
    return Levels(list(MAPS)[index], values)


def ramp(name: str) -> NDArray[np.uint8]:
    """(256, 3) red, green and blue of a map of MAPS, from its lower end to its upper one."""
    return _tables()[list(MAPS).index(name)].astype(np.uint8)


def _find_map(image: NDArray[np.uint8]) -> int | None:
    """The map on which nearly all colours of a sample lie."""
    step = max(1, int(np.sqrt(image.shape[0] * image.shape[1] / _SAMPLE)))
    sample = image[step // 2 :: step, step // 2 :: step]
    if image.shape[2] == 4:
        sample = sample[sample[..., 3] > 0]
    colors = sample[..., :3].reshape(-1, 3)
    colors = colors[np.ptp(colors, axis=1) > _COLOURFUL]
    if 5 * len(colors) < sample[..., 0].size or not len(colors):
        return None
    off = [np.sqrt(_squared(colors, entries).min(axis=1)) for entries in _tables()]
    best = int(np.argmin([np.minimum(one, 2 * _NEAR).mean() for one in off]))
    near = off[best] < _NEAR
    if near.mean() < _FITS:
        return None
    entries = _tables()[best]
    low, high = np.quantile(_places(colors[near], entries), (0.02, 0.98))
    if high - low < _LONG:
        return None
    rows = image[:: max(1, image.shape[0] // 8), :1024, :3]  # in which neighbours must lie near each other on the map
    steps = np.abs(np.diff(_places(rows.reshape(-1, 3), entries).reshape(rows.shape[:2]), axis=1))
    return best if np.isfinite(steps).any() and np.nanquantile(steps, 0.75) < _CALM else None


def _places(colors: NDArray[Any], entries: NDArray[np.float32]) -> NDArray[np.float32]:
    """(n,) 0 to 255: the nearest entry of the map to each colour (n, 3), NaN where none is near."""
    result = np.empty(len(colors), np.float32)
    for start in range(0, len(colors), _SAMPLE):
        squared = _squared(colors[start : start + _SAMPLE], entries)
        nearest = squared.argmin(axis=1)
        near = np.take_along_axis(squared, nearest[:, None], axis=1)[:, 0] < _NEAR**2
        result[start : start + _SAMPLE] = np.where(near, nearest, np.nan)
    return result


def _squared(colors: NDArray[Any], entries: NDArray[np.float32]) -> NDArray[np.float32]:
    """(n, 256) squared distances; whole numbers below 2^24, so float32 holds them exactly."""
    colors = colors.astype(np.float32)
    return np.square(colors).sum(axis=1)[:, None] + np.square(entries).sum(axis=1) - 2 * colors @ entries.T


@cache
def _tables() -> NDArray[np.float32]:
    """(maps, 256, 3) red, green and blue from 0 to 255."""
    return read_image(asset("colormaps.png")).astype(np.float32)


SWAPPED, CONFIDENCE, ROTATED, HIGH_BYTE = "bytes swapped", "confidence dropped", "bits rotated back", "high byte taken"
HALF, NEGATED = "16-bit floats", "sign turned"
_OF_CODES: dict[str, Callable[[Codes], NDArray[Any]]] = {
    SWAPPED: lambda codes: codes.byteswap(),
    HALF: lambda codes: codes.view(np.float16).astype(np.float32),
    CONFIDENCE: lambda codes: codes & MILLIMETRES,
    ROTATED: rotated_back,
    HIGH_BYTE: lambda codes: (codes >> 8).astype(np.uint8),
}
CHANNELS = "bytes of the channels "  # and their numbers, the lowest first
LEVELS, REVERSED = "colours read back", "order reversed"


def repaired(raw: NDArray[Any], repairs: Sequence[str]) -> NDArray[Any]:
    """The values after these repairs. Raises ValueError for a picture of another type than they are made for."""
    for name in repairs:
        raw = _repaired(raw, name)
    if raw.ndim != 2:
        raise ValueError(f"depth must have shape (h, w), as the first one has, got {raw.shape}")
    return raw


def _repaired(raw: NDArray[Any], name: str) -> NDArray[Any]:
    if name == REVERSED:
        return 255 - raw
    if name == NEGATED:
        return -raw
    if name.startswith(CHANNELS):
        channels = tuple(int(digit) for digit in name.removeprefix(CHANNELS))
        if raw.ndim != 3 or max(channels) >= raw.shape[2]:
            raise ValueError("depth must be spread over channels, as the first one is")
        return join_channels(raw, channels)
    if name == LEVELS:
        levels = read_levels(raw) if raw.ndim == 3 else None
        if levels is None:
            raise ValueError("depth must be a colour-mapped picture, as the first one is")
        return levels.values
    codes = as_codes(raw)
    if codes is None:
        raise ValueError(f"depth must be of 16 bits, as the first one is, got {raw.dtype}")
    return _OF_CODES[name](codes)
