"""Reads arrays from .npy and .npz files frame by frame: of many frames only one is in memory."""

from __future__ import annotations

import math
import threading
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..access.content import FilePath, naming, open_regular
from ..access.limits import FILE_BYTES, check_limit
from .array_files import BROKEN, read_exactly, read_header
from .array_roles import find_roles
from .zip_archive import Archive


class Stored(Protocol):
    """An array in a file."""

    shape: tuple[int, ...]
    dtype: np.dtype

    def part(self, index: tuple[int, ...]) -> NDArray[Any]:
        """array[index], from any thread. Raises ValueError if the file is damaged, or the part too large."""
        ...


class NpyArray:
    """The array of an .npy file. Raises ValueError for a broken one, and for one with Python objects."""

    def __init__(self, path: FilePath):
        with open_regular(path) as file, naming(path, BROKEN):
            self.shape, is_fortran, self.dtype = read_header(file)
            start, order = file.tell(), "F" if is_fortran else "C"
            size = math.prod(self.shape)
            file.seek(0, 2)
            if file.tell() - start < size * self.dtype.itemsize:
                raise ValueError(f"it has {file.tell() - start} of {size * self.dtype.itemsize} bytes")
            self._array = np.memmap(path, self.dtype, "r", start, self.shape, order) if size else np.empty(self.shape)

    def part(self, index: tuple[int, ...]) -> NDArray[Any]:
        return np.array(self._array[index])


class NpzArray:
    """One array of an .npz archive, in which successive frames are unpacked once. Raises ValueError if it is broken."""

    def __init__(self, archive: Archive, member: str):
        self._archive, self._name, self._lock = archive, f"{archive.path}/{member}", threading.Lock()
        with naming(self._name, BROKEN):
            self._stream = archive.open(member)
            self.shape, self._is_fortran, self.dtype = read_header(self._stream)
            self._start = self._stream.tell()

    def part(self, index: tuple[int, ...]) -> NDArray[Any]:
        lead = 0 if self._is_fortran else len(index)
        shape = self.shape[lead:]
        size = math.prod(shape) * self.dtype.itemsize
        check_limit(size, f"{self._name} has {size} bytes of shape {shape}", self._archive.max_pixels, FILE_BYTES)
        place = int(np.ravel_multi_index(index, self.shape[:lead])) if lead else 0
        with self._lock, naming(self._name, BROKEN):
            self._stream.seek(self._start + place * size)
            array = read_exactly(self._stream, size).view(self.dtype)
        return array.reshape(shape, order="F")[index] if self._is_fortran else array.reshape(shape)


def npz_arrays(archive: Archive) -> dict[str, Stored]:
    """The arrays of numbers of an .npz archive by name. Raises ValueError for other content under a name of ROLES."""
    arrays: dict[str, Stored] = {}
    for member in archive.names:
        name = member.removesuffix(".npy")
        try:
            arrays[name] = NpzArray(archive, member)
        except ValueError:
            if find_roles([name]):
                raise
    return arrays


class HeldArray:
    """An array that is in memory."""

    def __init__(self, array: NDArray[Any]):
        self.shape, self.dtype, self._array = array.shape, array.dtype, array

    def part(self, index: tuple[int, ...]) -> NDArray[Any]:
        return self._array[index]
