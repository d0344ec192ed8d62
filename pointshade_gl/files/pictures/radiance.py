"""Reads Radiance pictures (.hdr): linear colours with a common exponent, flat or in run lengths of either kind."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from ..access.content import FilePath, naming, read_bytes
from ..access.limits import MAX_PIXELS, check_pixels

RADIANCE = b"#?"  # the first bytes
_SIZE = re.compile(rb"([-+])([XY]) (\d{1,9}) ([-+])([XY]) (\d{1,9})\n")
_HEADER = 2**16  # bytes, at most
_REPEATED = b"\1\1\1"  # a colour that says how often the one before is repeated


def read_radiance(path: FilePath, max_pixels: float = MAX_PIXELS) -> NDArray[np.float32]:
    """Return (h, w, 3) linear RGB. Its EXPOSURE is not undone, as in most programs.

    Raises OSError if the path is not a file, ValueError for a broken or too large picture, and for colours in XYZ.
    """
    data = read_bytes(path, max_pixels)
    header, end, _ = data[:_HEADER].partition(b"\n\n")
    size = _SIZE.match(data, len(header) + 2)
    with naming(path, "is a broken or truncated Radiance picture"):
        if not end or not size or size[2] == size[5]:
            raise ValueError("its header has no size")
        if b"\nFORMAT=32-bit_rle_xyze" in header:
            raise ValueError(f"{path} has its colours in XYZ, expected RGB: convert it")
        count, length = int(size[3]), int(size[6])
        if not (count and length):
            raise ValueError("it has 0 pixels")
        check_pixels(length, count, str(path), max_pixels)
        pixels = _decoded(data, size.end(), count, length)
    rising, falling = (size[1], size[4]) if size[2] == b"Y" else (size[4], size[1])
    if size[2] == b"X":
        pixels = pixels.swapaxes(0, 1)
    pixels = pixels[:: 1 if rising == b"-" else -1, :: 1 if falling == b"+" else -1]
    return np.ldexp(pixels[..., :3].astype(np.float32), pixels[..., 3:].astype(np.int32) - 136)


def _decoded(data: bytes, at: int, count: int, length: int) -> NDArray[np.uint8]:
    """Return the (count, length, 4) mantissas and exponents of the lines."""
    lines = np.empty((count, length, 4), np.uint8)
    for number, line in enumerate(lines):
        try:
            if 8 <= length < 2**15 and data[at : at + 2] == b"\2\2" and data[at + 2] < 128:
                if length != int.from_bytes(data[at + 2 : at + 4], "big"):
                    raise ValueError
                at += 4
                for channel in range(4):
                    part, at = _run_lengths(data, at, length)
                    line[:, channel] = np.frombuffer(part, np.uint8)
            else:
                part, at = _repeats(data, at, length)
                line[:] = np.frombuffer(part, np.uint8).reshape(length, 4)
        except (IndexError, ValueError):
            raise ValueError(f"line {number} of {count} ends too early or too late") from None
    return lines


def _run_lengths(data: bytes, at: int, length: int) -> tuple[bytes | bytearray, int]:
    """Return one channel of a line, and where it ends: runs of one value, or values one by one."""
    line = bytearray()
    while len(line) < length:
        count = data[at]
        if count > 128:
            line += data[at + 1 : at + 2] * (count - 128)
            at += 2
        else:
            line += data[at + 1 : at + 1 + count]
            at += 1 + count
    return line, at


def _repeats(data: bytes, at: int, length: int) -> tuple[bytes | bytearray, int]:
    """Return a line of whole colours, some of which may say that the one before is repeated; and where it ends."""
    flat = data[at : at + 4 * length]
    if len(flat) == 4 * length and _REPEATED not in flat:
        return flat, at + 4 * length
    line, shift = bytearray(), 0
    while len(line) < 4 * length:
        color = data[at : at + 4]
        at += 4
        if len(color) < 4:
            raise IndexError
        if not color.startswith(_REPEATED):
            line += color
            shift = 0
            continue
        times = color[3] << shift
        if times > length or not line:
            raise ValueError
        line += line[-4:] * times
        shift += 8
    return line, at
