"""Pictures as few bytes: what cannot be predicted from the pixels before, packed. decode.js reads it.

A *plane* is a picture of whole numbers. Each pixel is predicted from those on its left and above by the median of two
of them and their plane (Weinberger, Seroussi, Sapiro 2000: LOCO-I), and the error is kept. Of pixels that are not known
nothing is kept: they repeat their left neighbour, in the first column the one above, so that predictions go on.
"""

from __future__ import annotations

import zlib

import numpy as np
from numpy.typing import NDArray

Whole = NDArray[np.int64]
Known = NDArray[np.bool_]
MISSING, POINT, RIM = 0, 1, 2  # what a pixel of a surface is


def code_depth(depth: NDArray[np.floating], step: float) -> tuple[Whole, float]:
    """Depths above 0 as multiples of a step of their logarithm, counted from the nearest: and that one's depth.

    The logarithm, as an error by a share of the depth moves a point by the same share of its distance everywhere.
    """
    depth = np.asarray(depth, np.float64)
    nearest = float(depth.min()) if depth.size else 1.0
    return np.rint(np.log(depth / nearest) / step).astype(np.int64), nearest


def code_normals(normals: NDArray[np.floating], bits: int) -> Whole:
    """Unit normals (n, 3) as places on an octahedron, (n, 2) whole numbers (Meyer et al. 2010).

    It is unfolded so that normals towards the camera lie in the middle, away from its seams.
    """
    n = np.asarray(normals, np.float64)
    x, y, z = (n / np.abs(n).sum(1, keepdims=True)).T
    sign = [np.where(v >= 0, 1.0, -1.0) for v in (x, y)]
    away = z > 0
    u = np.where(away, (1 - np.abs(y)) * sign[0], x)
    v = np.where(away, (1 - np.abs(x)) * sign[1], y)
    return np.rint((np.stack([u, v], -1) * 0.5 + 0.5) * (2**bits - 1)).astype(np.int64)


def repeated(values: Whole, known: Known) -> Whole:
    """The plane, (h, w), where pixels that are not known repeat what is before them."""
    height, width = values.shape
    rows = np.maximum.accumulate(np.where(known[:, 0], np.arange(height), -1))
    filled = np.where(known, values, 0)
    filled[:, 0] = np.where(rows >= 0, values[np.maximum(rows, 0), 0], 0)
    columns = np.maximum.accumulate(np.where(known, np.arange(width), 0), axis=1)
    return np.take_along_axis(filled, columns, 1)


def predicted(plane: Whole) -> Whole:
    """Each pixel by those on its left (a), above (b) and before that (c); the first one is 0."""
    a, b, c = (np.zeros_like(plane) for _ in range(3))
    a[:, 1:], b[1:], c[1:, 1:] = plane[:, :-1], plane[:-1], plane[:-1, :-1]
    b[0] = c[0] = a[0]
    a[1:, 0] = c[1:, 0] = b[1:, 0]
    return np.clip(a + b - c, np.minimum(a, b), np.maximum(a, b))


def code_plane(values: Whole, known: Known) -> tuple[bytes, int]:
    """The errors of the known pixels as `code_errors` codes them."""
    plane = repeated(values, known)
    return code_errors((plane - predicted(plane))[known])


def code_errors(error: Whole) -> tuple[bytes, int]:
    """Numbers that are mostly small: all low bytes first; and how many bytes each has.

    0, -1, 1, -2, 2 ... become 0, 1, 2, 3, 4, so that high bytes are seldom other than 0.
    """
    zigzag = np.where(error < 0, -2 * error - 1, 2 * error)
    count = max((int(zigzag.max(initial=0)).bit_length() + 7) // 8, 1)
    return b"".join(((zigzag >> (8 * k)) & 255).astype(np.uint8).tobytes() for k in range(count)), count


def code_colors(colors: NDArray[np.uint8], known: Known) -> bytes:
    """Colours (h, w, 3) without loss: green, and by how much red and blue differ from it, modulo 256."""
    red, green, blue = np.moveaxis(colors.astype(np.int64), -1, 0)
    parts = []
    for plane in (green, (red - green) & 255, (blue - green) & 255):
        filled = repeated(plane, known)
        parts.append(((filled - predicted(filled))[known] & 255).astype(np.uint8).tobytes())
    return b"".join(parts)


def pack(data: bytes) -> bytes:
    """As DecompressionStream("deflate") unpacks it. The highest level takes five times as long to save 2 %."""
    packer = zlib.compressobj(6, zlib.DEFLATED, zlib.MAX_WBITS, 9, zlib.Z_FILTERED)
    return packer.compress(data) + packer.flush()
