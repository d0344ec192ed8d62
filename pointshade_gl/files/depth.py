"""Depth pictures of every format: from a file to its raw numbers, one channel, nothing scaled."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..notes import Note
from ..wording import option
from .arrays import NUMPY, parse_numbers, read_npy, read_npz
from .content import FilePath, check_size, open_regular, read_head
from .exr import EXR, read_exr
from .limits import MAX_PIXELS, PICTURE_TEXT, check_pixels
from .pictures import NotAPictureError, read_image

_GAP = rb"(?:\s|#[^\n]*\n)+"
_NUMBER = _GAP + rb"(\d{1,9})"
_PGM = re.compile(rb"P([25])" + 3 * _NUMBER + rb"\s")
_HEADER = 4096  # bytes of the longest PGM header
_ZIP, _PNG = b"PK", b"\x89PNG"
_ROWS = 500  # looked at to find the byte order
_SMOOTHER = (
    8  # swapped bytes are wrong if swapping them back makes a picture so many times smoother; sensors: 80 to 500
)


def read_depth(path: FilePath, note: Note, max_pixels: float = MAX_PIXELS) -> NDArray[Any]:
    """(h, w) raw values of a depth picture, in the type that is stored. The content decides the format, not the suffix.

    Raises OSError if the path is not a file, ValueError if it is not a depth picture, if it has more than max_pixels
    pixels, and for EXR without its extra.
    """
    head = read_head(path)
    name = str(path)
    if head.startswith(NUMPY):
        raw = read_npy(path, max_pixels)
    elif head.startswith(_ZIP):
        raw = read_npz(path, note, max_pixels)
    elif head.startswith(EXR):
        raw = read_exr(path, max_pixels)
    elif head[:2] in (b"P2", b"P5"):
        raw = _read_pgm(Path(path), note, max_pixels)
    else:
        if head.startswith(_PNG) and head[24:25] == b"\x10" and head[25:26] != b"\0":
            raise ValueError(f"{name} has several channels of 16 bits, expected a depth picture of one channel")
        try:
            raw = read_image(path, max_pixels)
        except NotAPictureError as error:
            way = f"pass depth in one of them as {option('depth', 'FILE')}"
            raise ValueError(f"{error}, NumPy (.npy, .npz) and EXR: {way}") from None
    return one_channel(raw, name)


def one_channel(array: NDArray[Any], name: str) -> NDArray[Any]:
    """(h, w) of an array (h, w), (h, w, 1), (1, h, w) or of equal channels. Raises ValueError for any other."""
    if array.dtype.kind not in "iuf":
        raise ValueError(f"{name} must hold integer or floating point depth, got {array.dtype}")
    shape = array.shape
    if array.ndim > 2:
        array = array.reshape([n for n in shape if n != 1] if shape.count(1) == len(shape) - 2 else shape)
    if array.ndim == 3 and array.shape[2] in (3, 4):
        color = array[..., :3]
        if np.array_equal(color, np.broadcast_to(color[..., :1], color.shape), equal_nan=color.dtype.kind == "f"):
            return array[..., 0]
        if array.dtype == np.uint8:
            raise ValueError(
                f"{name} is a colour-mapped picture of depth (its red, green and blue differ): the distances cannot "
                "be recovered from it, pass the raw depth (16-bit PNG, .npy or EXR)"
            )
        raise ValueError(f"{name} has {array.shape[2]} channels that differ, expected depth in one channel")
    if array.ndim != 2 or 0 in array.shape:
        raise ValueError(f"{name} must have shape (h, w), got {shape}")
    return array


def _read_pgm(path: Path, note: Note, max_pixels: float) -> NDArray[Any]:
    """Not by Pillow, which stretches the values to 65535 if the file's maximum is lower."""
    with open_regular(path) as file:
        header = _PGM.match(file.read(_HEADER))
        if not header:
            raise ValueError(f"{path} is a PGM with a broken header")
        kind, width, height, maximum = (int(text) for text in header.groups())
        if not (0 < maximum < 65536 and width and height):
            raise ValueError(f"{path} is a PGM of {width}x{height} with maximum {maximum}: there is no such picture")
        check_pixels(width, height, str(path), max_pixels)
        dtype, count = np.dtype(">u2" if maximum > 255 else "u1"), width * height
        if kind == 2:
            check_size(file, path, max_pixels, PICTURE_TEXT)
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
    raw = values.astype(dtype.newbyteorder("=")).reshape(height, width)
    if kind == 5 and maximum > 255 and _is_swapped(raw):
        note(f"{path}: 16-bit PGM in the wrong byte order (the right one is big-endian), read byte-swapped")
        return raw.byteswap()
    return raw


def _is_swapped(raw: NDArray[np.uint16]) -> bool:
    """Whether neighbouring pixels agree far better with the two bytes swapped: then the low byte came first."""
    raw = raw[:: max(1, raw.shape[0] // _ROWS)]
    if not (raw & 255).any():
        return False  # 8 bits stored in the high byte: swapped they would be smoother and wrong
    return _roughness(raw) > _SMOOTHER * _roughness(raw.byteswap())


def _roughness(raw: NDArray[np.uint16]) -> float:
    """The mean step between horizontal neighbours that both have a depth."""
    values = raw.astype(np.int32)
    known = (values[:, 1:] > 0) & (values[:, :-1] > 0)
    steps = np.abs(np.diff(values, axis=1))[known]
    return float(steps.mean()) if steps.size else 0.0
