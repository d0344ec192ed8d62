"""Reads arrays from .npy, .npz and text files. The header is checked first: it may promise any amount of data."""

from __future__ import annotations

import math
import re
from array import array
from io import BufferedIOBase, BytesIO
from typing import Any, cast

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import shown
from ..access.content import FilePath, naming, open_regular, read_head, read_text
from ..access.limits import MAX_PIXELS, TEXT_BYTES, check_limit
from .zip_archive import METHODS

NUMPY = b"\x93NUMPY"
_TO_BLANKS = str.maketrans(dict.fromkeys(",;[]()", " "))
_BLOCK = 2**20  # bytes read at once
_HEADER = 10_000  # bytes of the longest header, as in NumPy
BROKEN = "is a broken NumPy file, or one with Python objects"


def read_npy(path: FilePath, max_pixels: float = MAX_PIXELS, share: float | None = None) -> NDArray[Any]:
    """The array of an .npy file. Raises ValueError for a broken one, for Python objects and for too many values."""
    with open_regular(path) as file:
        return _read(file, str(path), max_pixels, share)


def read_npz(path: FilePath, note: Note, max_pixels: float = MAX_PIXELS) -> NDArray[Any]:
    """The only array of an .npz file, or its depth; others stay packed. Raises ValueError for what `read_npy` does."""
    import zipfile  # only here

    # zipfile raises of everything for broken bytes
    with open_regular(path) as file, naming(path, BROKEN), zipfile.ZipFile(file) as archive:
        members = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
        listed = ", ".join([*members][:8]) + (" and more" if len(members) > 8 else "")
        if len(members) != 1 and "depth" not in members:
            raise ValueError(f"{path} must hold one array or one named depth, got {listed or 'none'}")
        member = members["depth"] if len(members) > 1 else next(iter(members.values()))
        if member.compress_type not in METHODS:
            raise ValueError(f"{path} {BROKEN}: it is packed in another way than NumPy does it")
        with archive.open(member) as stream:
            depth = _read(cast(BufferedIOBase, stream), str(path), max_pixels, None)
    if len(members) > 1:
        note(f"{path} holds {listed}: depth is taken")
    return depth


def read_numbers(path: FilePath, max_pixels: float = MAX_PIXELS) -> NDArray[np.float64]:
    """(n,) all numbers of a text, .json or .npy file, row after row. Raises ValueError for any other content."""
    if read_head(path).startswith(NUMPY):
        numbers = read_npy(path, max_pixels, TEXT_BYTES)
        if numbers.dtype.kind not in "iuf":
            raise ValueError(f"{path} must hold numbers only, got {numbers.dtype}")
        return numbers.astype(np.float64).ravel()
    text = read_text(path, max_pixels)
    found = parse_numbers(re.sub(r"#[^\r\n]*", "", text).translate(_TO_BLANKS))
    if not found.size:
        raise ValueError(f"{path} must hold numbers only, got {shown(text[:40])}")
    return found


def parse_numbers(text: str) -> NDArray[np.float64]:
    """(n,) the numbers between the blanks of a text; none if it holds anything else."""
    found = array("d")  # 8 bytes a number, where a list takes 80; so words are split a few thousand at a time
    try:
        for part in re.finditer(r"(?s).{1,65536}\S*", text):
            found.extend(map(float, part[0].split()))
    except ValueError:
        return np.empty(0)
    return np.array(found)


def _read(stream: BufferedIOBase, name: str, max_pixels: float, share: float | None) -> NDArray[Any]:
    with naming(name, BROKEN):  # NumPy raises of everything, too
        shape, is_fortran, dtype = read_header(stream)
    pixels = math.prod(shape[:-1] if len(shape) > 2 and shape[-1] in (3, 4) else shape)
    check_limit(pixels, f"{name} has {shown(pixels)} values of shape {shown(shape)}", max_pixels, share)
    with naming(name, BROKEN, (ValueError,)):
        array = read_exactly(stream, math.prod(shape) * dtype.itemsize)
    return array.view(dtype).reshape(shape, order="F" if is_fortran else "C")


def read_exactly(stream: BufferedIOBase, size: int) -> NDArray[np.uint8]:
    """The next bytes of a stream. Raises ValueError if it has fewer."""
    array = np.empty(size, np.uint8)
    data, done = array.data, 0
    while done < size:
        got = stream.readinto(data[done : done + _BLOCK])
        if not got:
            raise ValueError(f"it has {done} of {size} bytes")
        done += got
    return array


def read_header(stream: BufferedIOBase, kinds: str = "biuf") -> tuple[tuple[int, ...], bool, np.dtype]:
    """Shape, whether columns come first, and type of an .npy file. Raises ValueError for anything but plain numbers.

    kinds  of types, as NumPy calls them; with V also records of plain numbers
    """
    version = npy.read_magic(stream)
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"its version is {version[0]}.{version[1]}, known are 1.0 and 2.0")
    size = stream.read(2 * version[0])
    length = int.from_bytes(size, "little")
    if length > _HEADER:
        raise ValueError(f"its header has {length} bytes")
    header = BytesIO(size + stream.read(length))
    read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, is_fortran, dtype = read(header)
    parts = [dtype[name] for name in dtype.names] if dtype.names else [dtype]
    if dtype.kind not in kinds or any(one.kind not in "biuf" for one in parts) or min(shape, default=0) < 0:
        raise ValueError(f"it holds {dtype} of shape {shown(shape)}")
    return shape, is_fortran, dtype
