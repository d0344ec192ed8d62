"""Reads COLMAP's dense depth maps: *.geometric.bin and *.photometric.bin."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..access.content import FilePath, naming, open_regular, read_head
from ..access.limits import MAX_PIXELS, check_pixels
from .array_files import read_exactly

_HEADER = re.compile(rb"(\d{1,9})&(\d{1,9})&(\d{1,9})&")
_LONGEST = 64  # bytes


def is_colmap_depth(head: bytes) -> bool:
    """Whether a file with these first bytes is one of COLMAP's arrays."""
    return _HEADER.match(head) is not None


def read_colmap_depth(path: FilePath, max_pixels: float = MAX_PIXELS) -> NDArray[Any]:
    """(h, w) float32, 0 where missing, in the reconstruction's units. Raises OSError or ValueError for another file."""
    header = _HEADER.match(read_head(path, _LONGEST))
    if header is None:
        raise ValueError(f"{path} is not a depth of COLMAP: expected width&height&1& before its values")
    width, height, channels = map(int, header.groups())
    if channels != 1 or not width or not height:
        raise ValueError(f"{path} is an array of {width}x{height} pixels and {channels} channels, expected one channel")
    check_pixels(width, height, str(path), max_pixels)
    with open_regular(path) as file, naming(path, "is truncated", (ValueError,)):
        file.seek(header.end())
        values = read_exactly(file, 4 * width * height)
    return values.view("<f4").astype(np.float32).reshape(height, width)
