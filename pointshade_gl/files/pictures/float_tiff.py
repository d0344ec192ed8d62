"""Reads TIFF of floating point numbers that Pillow does not know: of 16 and 64 bits, and of several channels."""

from __future__ import annotations

import math
import struct
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..access.content import FILE_BYTES, MAX_PIXELS, FilePath, check_limit, check_pixels, naming, read_bytes

_WIDTH, _HEIGHT, _BITS, _COMPRESSION, _OFFSETS, _CHANNELS, _ROWS, _SIZES = 256, 257, 258, 259, 273, 277, 278, 279
_PLANES, _PREDICTOR, _TILE_WIDTH, _TILE_HEIGHT, _TILES, _TILE_SIZES, _FORMAT = 284, 317, 322, 323, 324, 325, 339
_PLAIN, _DEFLATED = (1,), (8, 32946)
_TYPES = {1: "B", 3: "H", 4: "I"}  # of a tag's numbers
_FLOATS = 3
_MOST_TAGS, _MOST_NUMBERS = 256, 2**20


def read_float_tiff(path: FilePath, max_pixels: float = MAX_PIXELS) -> NDArray[Any] | None:
    """(h, w) or (h, w, n) floats of the first picture; None for one of another kind. Raises ValueError if broken."""
    data = read_bytes(path, max_pixels)
    with naming(path, "is a broken TIFF", (struct.error, KeyError, IndexError, zlib.error, ValueError)):
        order = {b"II*\0": "<", b"MM\0*": ">"}.get(data[:4])
        tags = _read_tags(data, order) if order else {}
        if tags.get(_FORMAT, (0,))[0] != _FLOATS:
            return None
        return _read_picture(data, order or "<", tags, str(path), max_pixels)


def _read_tags(data: bytes, order: str) -> dict[int, tuple[int, ...]]:
    """The numbers of the first directory."""
    (start,) = struct.unpack_from(f"{order}I", data, 4)
    (count,) = struct.unpack_from(f"{order}H", data, start)
    found = {}
    for k in range(min(count, _MOST_TAGS)):
        at = start + 2 + 12 * k
        tag, kind, many = struct.unpack_from(f"{order}HHI", data, at)
        if kind not in _TYPES or many > _MOST_NUMBERS:
            continue
        form = f"{order}{many}{_TYPES[kind]}"
        place = at + 8 if struct.calcsize(form) <= 4 else struct.unpack_from(f"{order}I", data, at + 8)[0]
        found[tag] = struct.unpack_from(form, data, place)
    return found


def _read_picture(
    data: bytes, order: str, tags: dict[int, tuple[int, ...]], name: str, max_pixels: float
) -> NDArray[Any]:
    (width,), (height,), bits = tags[_WIDTH], tags[_HEIGHT], set(tags[_BITS])
    channels, packing = tags.get(_CHANNELS, (1,))[0], tags.get(_COMPRESSION, _PLAIN)[0]
    predictor = tags.get(_PREDICTOR, (1,))[0]
    check_pixels(width, height, name, max_pixels)
    if not width or not height or len(bits) != 1 or not bits <= {16, 32, 64} or not 0 < channels < 9:
        raise ValueError(f"it has {width}x{height} pixels of {channels} channels of {bits} bits")
    if packing not in (*_PLAIN, *_DEFLATED) or predictor not in (1, 3) or (tags.get(_PLANES, (1,))[0] != 1 < channels):
        raise ValueError("it is packed in an unusual way: save it without compression, or as .npy")
    dtype = np.dtype(f"{order}f{bits.pop() // 8}")
    size = width * height * channels * dtype.itemsize
    check_limit(size, f"{name} has {size} bytes", max_pixels, FILE_BYTES)
    is_tiled = _TILES in tags
    across = tags[_TILE_WIDTH][0] if is_tiled else width
    down = tags[_TILE_HEIGHT][0] if is_tiled else min(height, tags.get(_ROWS, (height,))[0])
    check_pixels(across, down, name, max_pixels)
    if min(across, down) < 1:
        raise ValueError(f"its parts have {across}x{down} pixels")
    starts, sizes = (tags[_TILES], tags[_TILE_SIZES]) if is_tiled else (tags[_OFFSETS], tags[_SIZES])
    columns, result = math.ceil(width / across), np.zeros((height, width, channels), dtype.newbyteorder("="))
    for k in range(columns * math.ceil(height / down)):
        top, left = k // columns * down, k % columns * across
        rows = down if is_tiled else min(down, height - top)
        part = data[starts[k] : starts[k] + sizes[k]]
        length = rows * across * channels * dtype.itemsize
        if packing in _DEFLATED:
            part = zlib.decompressobj().decompress(part, length)
        values = np.frombuffer(part[:length], np.uint8).reshape(rows, -1)
        values = _summed(values, channels, dtype) if predictor == 3 else values
        block = np.ascontiguousarray(values).view(dtype).reshape(rows, across, channels)
        result[top : top + rows, left : left + across] = block[: height - top, : width - left]
    return result[..., 0] if channels == 1 else result


def _summed(rows: NDArray[np.uint8], channels: int, dtype: np.dtype) -> NDArray[np.uint8]:
    """Undoes the predictor of floats: sums of bytes, the highest bytes of a row first."""
    sums = np.cumsum(rows.reshape(len(rows), -1, channels), axis=1, dtype=np.uint8).reshape(
        len(rows), dtype.itemsize, -1
    )
    sums = sums if dtype.byteorder == ">" else sums[:, ::-1]
    return np.ascontiguousarray(sums.transpose(0, 2, 1)).reshape(len(rows), -1)
