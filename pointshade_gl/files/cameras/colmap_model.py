"""Reads COLMAP's binary model: cameras.bin and images.bin (src/colmap/scene/reconstruction_io of COLMAP)."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...scene.camera import Matrices, from_quaternions, inverted
from ..access.content import read_bytes
from ..access.limits import MAX_PIXELS
from .intrinsics import Intrinsics

# Numbers of each camera model, by COLMAP's number of the model. Where they begin f, cx, cy there is one focal length.
_SINGLE = {0: 3, 2: 4, 3: 5, 8: 4, 9: 5}
_DOUBLE = {1: 4, 4: 8, 5: 8, 6: 12, 7: 5, 10: 12}


def read_colmap_cameras(path: Path, max_pixels: float = MAX_PIXELS) -> list[Intrinsics]:
    """The cameras in their order, lens distortion left out. Raises ValueError for any other content."""
    data, found = read_bytes(path, max_pixels), []
    try:
        (count,), at = struct.unpack_from("<Q", data), 8
        for _ in range(count):
            _, model, width, height = struct.unpack_from("<iiQQ", data, at)
            size = _SINGLE.get(model) or _DOUBLE[model]
            numbers = struct.unpack_from(f"<{size}d", data, at + 24)
            fx, fy, cx, cy = (numbers[0], *numbers[:3]) if model in _SINGLE else numbers[:4]
            # COLMAP counts from the picture's corner
            found.append(Intrinsics(str(path), (fx, fy, cx - 0.5, cy - 0.5), (width, height)))
            at += 24 + 8 * size
    except (struct.error, KeyError):
        raise ValueError(f"{path} holds no cameras of COLMAP's") from None
    if not found:
        raise ValueError(f"{path} holds no camera")
    return found


def read_colmap_images(path: Path, max_pixels: float = MAX_PIXELS) -> tuple[Matrices, list[str]]:
    """(n, 4, 4) camera-to-world in OpenCV axes, and the pictures' names. Raises ValueError for any other content."""
    data, rows, names = read_bytes(path, max_pixels), [], []
    try:
        (count,), at = struct.unpack_from("<Q", data), 8
        for _ in range(count):
            rows.append(struct.unpack_from("<7d", data, at + 4))
            end = data.index(b"\0", at + 64)
            names.append(data[at + 64 : end].decode("utf-8", "replace"))
            (points,) = struct.unpack_from("<Q", data, end + 1)
            at = end + 9 + 24 * points
    except (struct.error, ValueError, OverflowError):
        raise ValueError(f"{path} holds no images of COLMAP's") from None
    turned: NDArray[np.float64] = np.array(rows, np.float64).reshape(-1, 7)
    return inverted(from_quaternions(turned[:, 4:], turned[:, [1, 2, 3, 0]])), names
