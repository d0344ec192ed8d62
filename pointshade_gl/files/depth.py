"""Depth pictures of every format: a file comes in, its raw numbers come out, one channel, nothing scaled."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..notes import Note
from .content import FilePath, read_head
from .pictures import read_image

_GAP = rb"(?:\s|#[^\n]*\n)+"
_PGM = re.compile(rb"P([25])" + _GAP + rb"(\d+)" + _GAP + rb"(\d+)" + _GAP + rb"(\d+)\s")
_NUMPY, _ZIP, _EXR, _PNG = b"\x93NUMPY", b"PK", b"\x76\x2f\x31\x01", b"\x89PNG"
_SMOOTHER = 8  # so many times rougher than its byte-swapped self is a wrong one; real sensors show 80 to 500


def read_depth(path: FilePath, note: Note) -> NDArray[Any]:
    """(h, w) raw values of a depth picture, of the type that is stored; the content tells the format, not the suffix.

    Raises OSError for what is no file, ValueError for what is no depth picture and for EXR without its extra.
    """
    head = read_head(path)
    name = str(path)
    if head.startswith((_NUMPY, _ZIP)):
        raw = _load_numpy(path, note)
    elif head.startswith(_EXR):
        raw = _read_exr(path)
    elif head[:2] in (b"P2", b"P5"):
        raw = _read_pgm(Path(path), note)
    else:
        if head.startswith(_PNG) and head[24:25] == b"\x10" and head[25:26] != b"\0":
            raise ValueError(f"{name} has several channels of 16 bits, expected a depth picture of one channel")
        raw = read_image(path)
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


def _load_numpy(path: FilePath, note: Note) -> NDArray[Any]:
    try:
        with Path(path).open("rb") as file:  # opened here: np.load forgets to close a broken archive
            loaded = np.load(file, allow_pickle=False)
            if isinstance(loaded, np.ndarray):
                return loaded
            arrays = {key: np.asarray(loaded[key]) for key in loaded.files}
    except Exception as error:  # NumPy and zipfile raise of everything for broken bytes
        raise ValueError(f"{path} is a broken NumPy file, or one with Python objects: {error}") from None
    if len(arrays) > 1 and "depth" in arrays:
        note(f"{path} holds {', '.join(arrays)}: depth is taken")
        return arrays["depth"]
    if len(arrays) != 1:
        raise ValueError(f"{path} must hold one array or one named depth, got {', '.join(arrays) or 'none'}")
    return next(iter(arrays.values()))


def _read_pgm(path: Path, note: Note) -> NDArray[Any]:
    """Not by Pillow, which stretches the values to 65535 when the file's maximum is lower."""
    data = path.read_bytes()
    header = _PGM.match(data)
    if not header:
        raise ValueError(f"{path} is a PGM with a broken header")
    kind, width, height, maximum = (int(text) for text in header.groups())
    if not (0 < maximum < 65536 and width and height):
        raise ValueError(f"{path} is a PGM of {width}x{height} with maximum {maximum}: no such picture can be")
    dtype, count = np.dtype(">u2" if maximum > 255 else "u1"), width * height
    body = data[header.end() :]
    if kind == 2:
        words = body.split()[:count]
        if not all(word.isdigit() and len(word) < 9 for word in words):
            raise ValueError(f"{path} is a PGM of text, expected nothing but whole numbers after its header")
        values = np.array([min(int(word), maximum) for word in words], dtype)
    else:
        values = np.frombuffer(body[: min(count * dtype.itemsize, len(body) & -dtype.itemsize)], dtype)
    if values.size < count:
        raise ValueError(f"{path} is truncated: expected {count} pixels, got {values.size}")
    raw = values.astype(dtype.newbyteorder("=")).reshape(height, width)
    if kind == 5 and maximum > 255 and _is_swapped(raw):
        note(f"{path}: 16-bit PGM in the wrong byte order (the right one is big-endian), read byte-swapped")
        return raw.byteswap()
    return raw


def _is_swapped(raw: NDArray[np.uint16]) -> bool:
    """Whether neighbouring pixels agree far better with the two bytes exchanged: then the low byte came first."""
    if not (raw & 255).any():
        return False  # 8 bits stored in the high byte: swapped they would be smoother and wrong
    return _roughness(raw) > _SMOOTHER * _roughness(raw.byteswap())


def _roughness(raw: NDArray[np.uint16]) -> float:
    """The mean step between horizontal neighbours that both have a depth."""
    values = raw.astype(np.int32)
    known = (values[:, 1:] > 0) & (values[:, :-1] > 0)
    steps = np.abs(np.diff(values, axis=1))[known]
    return float(steps.mean()) if steps.size else 0.0


def _read_exr(path: FilePath) -> NDArray[Any]:
    try:
        import OpenEXR  # only here: an optional extra
    except ImportError:
        raise ValueError(f"{path} is an EXR picture: pip install 'pointshade-gl[exr]' to read it") from None
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            channels = {name: np.array(channel.pixels) for name, channel in file.channels().items()}
    except Exception as error:  # the library raises RuntimeError, ValueError and TypeError for broken files
        raise ValueError(f"{path} is a broken or truncated EXR picture: {error}") from None
    return _pick_channel(channels, str(path))


def _pick_channel(channels: dict[str, NDArray[Any]], name: str) -> NDArray[Any]:
    """Depth among EXR channels: the only one, one called depth or Z (not beside X: those are normals), Y or V, grey."""
    if len(channels) == 1:
        return next(iter(channels.values()))
    for key, pixels in channels.items():
        layer, _, last = key.rpartition(".")
        beside = f"{layer}.X" if layer else "X"
        if "depth" in key.lower() or (last in ("Z", "Y") and beside not in channels) or key == "V":
            return pixels
    keys = [key for key in ("R", "G", "B") if key in channels]
    if keys and all(np.array_equal(channels[keys[0]], channels[key], equal_nan=True) for key in keys):
        return channels[keys[0]]
    raise ValueError(
        f"{name} has the channels {', '.join(channels)}, which differ: expected one, or one called Z or depth"
    )
