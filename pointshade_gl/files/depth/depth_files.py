"""Reads depth images of every format as raw numbers, one channel, nothing scaled."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import option
from ..access.content import FilePath, check_size, open_regular, read_bytes, read_head
from ..access.limits import MAX_PIXELS, PICTURE_TEXT, check_pixels
from ..arrays.array_files import NUMPY, parse_numbers, read_npy, read_npz
from ..arrays.sintel import read_dpt
from ..pictures.exr import EXR, read_exr
from ..pictures.picture_files import NotAPictureError, read_image

_GAP = rb"(?:\s|#[^\n]*\n)+"
_NUMBER = _GAP + rb"(\d{1,9})"
_PGM = re.compile(rb"P([25])" + 3 * _NUMBER + rb"\s")
_HEADER = 4096  # bytes of the longest PGM header
_ZIP, _PNG = b"PK", b"\x89PNG"
_RAW = {1: "u1", 2: "<u2", 4: "<f4", 8: "<f8"}  # of headerless files, by the bytes of a value
_LEAST, _MOST = 1e-6, 1e6  # between which sizes of floats lie: integers read as floats lie elsewhere


def read_depth(path: FilePath, note: Note, max_pixels: float = MAX_PIXELS) -> NDArray[Any]:
    """(h, w) values of a depth picture as they are stored, (h, w, 3|4) uint8 of a colour-mapped one, by its content.

    Raises OSError if the path is not a file, ValueError for another or too large a picture, and without EXR's extra.
    """
    head = read_head(path)
    name = str(path)
    if head.startswith(NUMPY):
        raw = read_npy(path, max_pixels)
    elif head.startswith(_ZIP):
        raw = read_npz(path, note, max_pixels)
    elif head.startswith(EXR):
        raw = read_exr(path, max_pixels)
    elif Path(path).suffix.lower() == ".dpt":
        raw = read_dpt(path, max_pixels)
    elif head[:2] in (b"P2", b"P5"):
        raw = _read_pgm(Path(path), max_pixels)
    else:
        if head.startswith(_PNG) and head[24:25] == b"\x10" and head[25:26] != b"\0":
            raise ValueError(
                f"{name} has several channels of 16 bits, expected depth of one channel: pass another file"
            )
        try:
            raw = read_image(path, max_pixels)
        except NotAPictureError as error:
            way = f"pass depth in one of them as {option('depth', 'FILE')}, or the folder that holds it"
            raise ValueError(f"{error}, NumPy (.npy, .npz) and EXR: {way}") from None
    return one_channel(raw, name)


def read_raw(path: FilePath, width: int, height: int, max_pixels: float = MAX_PIXELS) -> NDArray[Any]:
    """(h, w) values of a file without a header, such as depth.bin or depth.raw, of a size that the camera's file says.

    The file's size decides the type: 1 and 2 bytes are unsigned integers, 4 and 8 floating point; 4 bytes that make no
    sensible float are integers. Little-endian; `depth_coding.decode` sees swapped ones. Raises ValueError for others.
    """
    check_pixels(width, height, str(path), max_pixels)
    data = read_bytes(path, max_pixels)
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


def one_channel(array: NDArray[Any], name: str) -> NDArray[Any]:
    """(h, w) of an array (h, w), (h, w, 1), (1, h, w) or equal channels; differing (h, w, 3|4) uint8 stay."""
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
            return array
        raise ValueError(f"{name} has {array.shape[2]} channels that differ, expected depth in one channel")
    if array.ndim != 2 or 0 in array.shape:
        raise ValueError(f"{name} must have shape (h, w), got {shape}")
    return array


def _read_pgm(path: Path, max_pixels: float) -> NDArray[Any]:
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
    return values.astype(dtype.newbyteorder("=")).reshape(height, width)
