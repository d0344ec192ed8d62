"""Reads the files of MPI Sintel (Butler 2012), which begin with the number 202021.25: .dpt is depth, .cam a camera and
pose.

LINEMOD's .dpt (Hinterstoisser 2012) has rows and columns instead, and then millimetres in 16 bits.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..access.content import FilePath, read_bytes
from ..access.limits import MAX_PIXELS, check_pixels

SINTEL = struct.pack("<f", 202021.25)
_CAMERA = 9 + 12  # numbers: K, and world-to-camera 3x4


def read_dpt(path: FilePath, max_pixels: float = MAX_PIXELS) -> NDArray[Any]:
    """(h, w) float32 metres (Sintel) or uint16 millimetres (LINEMOD). Raises ValueError for any other content."""
    data = read_bytes(path, max_pixels)
    is_sintel = data.startswith(SINTEL)
    start, dtype = (12, "<f4") if is_sintel else (8, "<u2")
    if len(data) < start:
        raise ValueError(f"{path} is a .dpt of {len(data)} bytes, expected a size and values")
    first, second = struct.unpack_from("<2i", data, start - 8)
    width, height = (first, second) if is_sintel else (second, first)
    check_pixels(width, height, str(path), max_pixels)
    expected = start + width * height * np.dtype(dtype).itemsize
    if min(width, height) < 1 or len(data) != expected:
        raise ValueError(f"{path} is a .dpt of {width}x{height} pixels and {len(data)} bytes, expected {expected}")
    values = np.frombuffer(data, dtype, offset=start)
    return values.astype(values.dtype.newbyteorder("=")).reshape(height, width)


def read_cam(path: FilePath, max_pixels: float = MAX_PIXELS) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(9,) K row after row and (4, 4) world-to-camera. Raises ValueError for a file of another size."""
    data = read_bytes(path, max_pixels)
    if len(data) != 4 + 8 * _CAMERA:
        raise ValueError(f"{path} has {len(data)} bytes, expected {4 + 8 * _CAMERA} of a .cam")
    numbers = np.frombuffer(data, "<f8", offset=4).astype(np.float64)
    pose = np.eye(4)
    pose[:3] = numbers[9:].reshape(3, 4)
    return numbers[:9], pose
