"""Reads arrays from MATLAB's .mat files and from HDF5."""

from __future__ import annotations

import math
import struct
import zlib
from io import BufferedReader
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..access import content
from ..access.content import FILE_BYTES, MAX_PIXELS, PARTS, FilePath
from .numpy_files import Stored

HDF5 = b"\x89HDF\r\n\x1a\n"
MATLAB_73 = b"MATLAB 7.3"


def hdf5_arrays(path: FilePath, max_pixels: float = MAX_PIXELS) -> dict[str, Stored]:
    """The arrays of numbers of an HDF5 file, by their paths inside. Links to other files are not followed."""
    h5py, arrays = content.import_extra("h5py", "hdf5", f"{path} is an HDF5 file"), {}

    def visit(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or item.dtype.kind not in "biuf" or item.shape is None:
            return
        content.check_limit(len(arrays), f"{path} has {len(arrays)} arrays", max_pixels, PARTS)
        if not item.external and not item.is_virtual and item.attrs.get("MATLAB_class") != b"char":
            arrays[name] = _Dataset(path, name, item, max_pixels)

    content.open_regular(path).close()
    kinds = OSError, ValueError, RuntimeError, KeyError
    with content.naming(path, "is a broken or truncated HDF5 file", kinds), h5py.File(path, "r") as file:
        file.visititems(visit)  # follows no links
    return arrays


class _Dataset:
    """An array in an HDF5 file, which is open only while a part is read."""

    def __init__(self, path: FilePath, name: str, item: Any, max_pixels: float):
        self._path, self._name, self._max_pixels = path, name, max_pixels
        self.shape: tuple[int, ...] = item.shape
        self.dtype: np.dtype = item.dtype
        self._block = math.prod(item.chunks or ())  # is unpacked as a whole

    def part(self, index: tuple[int, ...]) -> NDArray[Any]:
        size = max(math.prod(self.shape[len(index) :]), self._block) * self.dtype.itemsize
        title = f"{self._path}/{self._name}"
        content.check_limit(size, f"{title} has {size} bytes of shape {self.shape}", self._max_pixels, FILE_BYTES)
        h5py = content.import_extra("h5py", "hdf5", f"{self._path} is an HDF5 file")
        kinds = OSError, RuntimeError, KeyError
        with content.naming(title, "is broken or truncated", kinds), h5py.File(self._path, "r") as file:
            return np.asarray(file[self._name][index])


MATLAB_5 = b"MATLAB 5.0"
_HEADER = 128  # bytes before the first element; the last two of them give the order of bytes
_START = 4096  # bytes of an element that hold its flags, its sides and its name
_ARRAY, _PACKED = 14, 15
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
_COMPLEX = 0x800
_DAMAGE = ValueError, KeyError, struct.error, zlib.error
_SMALL = 65536  # numbers of an array that may be a camera, a pose, or some thousand poses


def matlab_5_arrays(path: FilePath, max_pixels: float = MAX_PIXELS) -> dict[str, Stored]:
    """The arrays of numbers in a .mat file of version 5, frames first. Raises ValueError for a broken file."""
    return {name: _Frames(array) for name, array in _list_arrays(path, max_pixels).items()}


def read_matrix_mat(path: FilePath, max_pixels: float = MAX_PIXELS) -> dict[str, list[float]]:
    """The numbers of the small arrays of a .mat file, row after row. Raises OSError or ValueError for others."""
    head = content.read_head(path)
    if head.startswith(MATLAB_73):
        new = hdf5_arrays(path, max_pixels).items()
        arrays = {name: one.part(()).T for name, one in new if math.prod(one.shape) <= _SMALL}
    elif head.startswith(MATLAB_5):
        old = _list_arrays(path, max_pixels).items()
        arrays = {name: one.read() for name, one in old if math.prod(one.shape) <= _SMALL}
    else:
        raise ValueError(f"{path} is not a MATLAB file of version 5 or 7.3")
    return {name: array.ravel().tolist() for name, array in arrays.items()}


class _Array(NamedTuple):
    """An array in a file: where its element lies, and how large it is."""

    path: FilePath
    name: str
    shape: tuple[int, ...]
    dtype: np.dtype
    order: str
    place: int
    size: int
    is_packed: bool
    max_pixels: float

    def read(self) -> NDArray[Any]:
        """Raises ValueError for more bytes than a picture may have, and if the file is broken."""
        count, title = math.prod(self.shape), f"{self.path}/{self.name}"
        size = count * self.dtype.itemsize
        content.check_limit(size, f"{title} has {size} bytes of shape {self.shape}", self.max_pixels, FILE_BYTES)
        with content.naming(title, "is broken or truncated", _DAMAGE):
            with content.open_regular(self.path) as file:
                data = _content(file, self.place, self.size, self.is_packed, size + _START)
            kind, start, length, _ = _element(data, _header_of(data, self.order).end, self.order)
            values = np.frombuffer(data[start : start + length], np.dtype(self.order + _TYPES[kind]))
            return values[:count].astype(self.dtype).reshape(self.shape, order="F")


class _Frames:
    """An array that can only be read whole. MATLAB counts frames by the last axis: it comes first here."""

    def __init__(self, array: _Array):
        shape, channels = array.shape, (1, 3, 4)
        is_stack = len(shape) == 3 and shape[2] not in channels and shape[2] <= shape[0]
        self._array, self._is_last = array, is_stack or (len(shape) == 4 and shape[2] in channels)
        self.shape, self.dtype = (shape[-1], *shape[:-1]) if self._is_last else shape, array.dtype

    def part(self, index: tuple[int, ...]) -> NDArray[Any]:
        array = self._array.read()
        return (np.moveaxis(array, -1, 0) if self._is_last else array)[index]


class _MatHeader(NamedTuple):
    kind: int
    shape: tuple[int, ...]
    name: str
    end: int


def _list_arrays(path: FilePath, max_pixels: float) -> dict[str, _Array]:
    found: dict[str, _Array] = {}
    with content.open_regular(path) as file, content.naming(path, "is a broken or truncated MATLAB file", _DAMAGE):
        order = {b"IM": "<", b"MI": ">"}[file.read(_HEADER)[126:]]
        end = file.seek(0, 2)
        place, count = _HEADER, 0
        while place + 8 <= end:
            file.seek(place)
            kind, size = struct.unpack(f"{order}2I", file.read(8))
            if size > end - place - 8:
                raise ValueError(f"an element has {end - place - 8} of {size} bytes")
            if kind in (_ARRAY, _PACKED):
                where = place + 8, size, kind == _PACKED
                header = _header_of(_content(file, *where, _START), order)
                if header.kind in _CLASSES and header.name:
                    dtype = np.dtype(_CLASSES[header.kind])
                    found[header.name] = _Array(path, header.name, header.shape, dtype, order, *where, max_pixels)
            place, count = place + 8 + size, count + 1
            content.check_limit(count, f"{path} has {count} arrays", max_pixels, PARTS)
    return found


def _content(file: BufferedReader, place: int, size: int, is_packed: bool, most: int) -> bytes:
    """The first bytes inside an array's element, up to so many."""
    file.seek(place)
    if not is_packed:
        return file.read(min(size, most))
    data = zlib.decompressobj().decompress(file.read(size), most + 8)
    return data[8:]  # the tag of what was packed


def _header_of(data: bytes, order: str) -> _MatHeader:
    """Of an array: its class (0 if its numbers are complex), its sides, its name, and where its values begin."""
    _, start, _, at = _element(data, 0, order)
    (flags,) = struct.unpack_from(f"{order}I", data, start)
    _, start, size, at = _element(data, at, order)
    shape = struct.unpack_from(f"{order}{min(size, 128) // 4}i", data, start)
    _, start, size, at = _element(data, at, order)
    if min(shape, default=-1) < 0:
        raise ValueError(f"an array has the sides {shape}")
    name = data[start : start + size].decode("latin-1")
    return _MatHeader(0 if flags & _COMPLEX else flags & 255, shape, name, at)


def _element(data: bytes, at: int, order: str) -> tuple[int, int, int, int]:
    """Type, start and size of an element's content, and where the next element begins."""
    kind, size = struct.unpack_from(f"{order}2I", data, at)
    if kind >> 16:  # small: type, size and up to four bytes in eight
        return kind & 0xFFFF, at + 4, kind >> 16, at + 8
    return kind, at + 8, size, at + 8 + -(-size // 8) * 8
