"""Reads and writes OpenEXR images with the library of that name; their header is parsed here, for their size."""

from __future__ import annotations

import struct
from importlib.util import find_spec
from io import BufferedReader
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.words import cut
from ..access.atomic_write import error_of
from ..access.content import FilePath, import_extra, naming, open_regular
from ..access.limits import FILE_BYTES, MAX_PIXELS, check_limit, check_pixels

EXR = b"\x76\x2f\x31\x01"
_DEEP, _PARTS = 0x800, 0x1000  # flags in the version
_LONGEST = 2**20  # bytes of the list of channels


def read_exr(path: FilePath, max_pixels: float = MAX_PIXELS) -> NDArray[Any]:
    """(h, w) depth from an EXR picture. Raises ValueError for a broken or too large one, and without the extra."""
    channels = _read_channels(path, max_pixels)
    return channels[_pick_channel(channels, str(path))]


def read_exr_colors(path: FilePath, max_pixels: float = MAX_PIXELS) -> NDArray[np.float32]:
    """(h, w, 3) linear RGB from an EXR picture; grey is repeated. Raises ValueError as `read_exr`, and without both."""
    channels = _read_channels(path, max_pixels)
    layers = [key[:-1] for key in channels if key.endswith("R")]
    for layer in sorted(layers, key=len):  # "", then such as "ViewLayer.Combined."
        if layer[-1:] in ("", ".") and all(f"{layer}{one}" in channels for one in "GB"):
            return np.stack([channels[f"{layer}{one}"] for one in "RGB"], -1).astype(np.float32)
    if len(channels) != 1:
        raise ValueError(f"{path} has the channels {', '.join(channels)}: expected R, G and B")
    return np.repeat(next(iter(channels.values()))[..., None], 3, -1).astype(np.float32)


def _read_channels(path: FilePath, max_pixels: float) -> dict[str, NDArray[Any]]:
    """The arrays of a picture, by the names of its channels. Raises ValueError."""
    library = import_extra("OpenEXR", "exr", f"{path} is an EXR picture")
    _check_header(path, max_pixels)
    broken = naming(path, "is a broken or truncated EXR picture")  # for RuntimeError, ValueError and TypeError
    with broken, library.File(str(path), separate_channels=True) as file:
        return {name: np.array(channel.pixels) for name, channel in file.channels().items()}


def check_exr(path: FilePath) -> None:
    """Raises ValueError without the extra that writes EXR pictures."""
    if find_spec("OpenEXR") is None:
        raise ValueError(f"cannot write {path}: pip install 'pointshade-gl[exr]' for .exr; .npy works without")


def write_exr(path: FilePath, channels: dict[str, NDArray[Any]]) -> None:
    """Writes arrays by the names of their channels: (h, w), or (h, w, 4) for RGBA. Raises OSError if it cannot."""
    import OpenEXR  # only here: an optional extra

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    arrays = {name: np.ascontiguousarray(values, np.float32) for name, values in channels.items()}
    try:
        with OpenEXR.File(header, arrays) as file:
            file.write(str(path))
    except RuntimeError as error:
        raise error_of(cut(error)) from None


def _check_header(path: FilePath, max_pixels: float) -> None:
    """Raises ValueError for too many pixels, in all channels and parts together, and for deep pictures."""
    with open_regular(path) as file:
        try:
            _, version = struct.unpack("<4si", file.read(8))
            parts = [_read_part(file)]
            while version & _PARTS and (part := _read_part(file)):
                parts.append(part)
            sizes = [_size_of(part) for part in parts]
        except (ValueError, KeyError, struct.error) as error:
            raise ValueError(f"{path} is a broken or truncated EXR picture: its header has no {error}") from None
    if version & _DEEP:
        raise ValueError(f"{path} is a deep EXR picture, with several depths a pixel: expected one")
    for width, height, _ in sizes:
        check_pixels(width, height, str(path), max_pixels)
    total = sum(width * height * depth for width, height, depth in sizes)
    check_limit(total, f"{path} has {total} bytes in all channels", max_pixels, FILE_BYTES)


def _read_part(file: BufferedReader) -> dict[bytes, bytes]:
    """The attributes of a part that say how large it is; none at the end of all parts."""
    found: dict[bytes, bytes] = {}
    while name := _read_name(file):
        _read_name(file)
        (size,) = struct.unpack("<i", file.read(4))
        if size < 0 or (name == b"channels" and size > _LONGEST):
            raise ValueError("end")
        if name in (b"dataWindow", b"channels"):
            found[name] = file.read(size)
        else:
            file.seek(size, 1)
    return found


def _read_name(file: BufferedReader) -> bytes:
    name = b""
    while (letter := file.read(1)) != b"\0":
        if not letter or len(name) > 255:
            raise ValueError("end")
        name += letter
    return name


def _size_of(part: dict[bytes, bytes]) -> tuple[int, int, int]:
    """Width, height, and bytes of a pixel in all channels."""
    left, top, right, bottom = struct.unpack("<4i", part[b"dataWindow"])
    if right < left or bottom < top:
        raise ValueError("pixels")
    rest, depth = part[b"channels"], 0
    while rest[:1] != b"\0":
        _, _, rest = rest.partition(b"\0")
        depth += 2 if struct.unpack_from("<i", rest)[0] == 1 else 4
        rest = rest[16:]
    return right - left + 1, bottom - top + 1, depth


def _pick_channel(channels: dict[str, NDArray[Any]], name: str) -> str:
    """Depth among EXR channels: the only one, one called depth or Z (not beside X: those are normals), Y or V, grey.

    Y comes after all others: it is luminance in a picture with Z, or the same as Z in ours.
    """
    if len(channels) == 1:
        return next(iter(channels))
    for key in sorted(channels, key=lambda name: name.endswith("Y")):
        layer, _, last = key.rpartition(".")
        beside = f"{layer}.X" if layer else "X"
        if "depth" in key.lower() or (last in ("Z", "Y") and beside not in channels) or key == "V":
            return key
    keys = [key for key in ("R", "G", "B") if key in channels]
    if keys and all(np.array_equal(channels[keys[0]], channels[key], equal_nan=True) for key in keys):
        return keys[0]
    raise ValueError(
        f"{name} has the channels {', '.join(channels)}, which differ: expected one, or one called Z or depth"
    )
