"""Reads arrays from HDF5 files, and from MATLAB's files of version 7.3 and later, which are HDF5."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..access.content import FilePath, import_extra, naming, open_regular
from ..access.limits import FILE_BYTES, MAX_PIXELS, PARTS, check_limit
from .stored_arrays import Stored

HDF5 = b"\x89HDF\r\n\x1a\n"
MATLAB_73 = b"MATLAB 7.3"


def hdf5_arrays(path: FilePath, max_pixels: float = MAX_PIXELS) -> dict[str, Stored]:
    """The arrays of numbers of an HDF5 file, by their paths inside. Links to other files are not followed."""
    h5py, arrays = import_extra("h5py", "hdf5", f"{path} is an HDF5 file"), {}

    def visit(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or item.dtype.kind not in "biuf" or item.shape is None:
            return
        check_limit(len(arrays), f"{path} has {len(arrays)} arrays", max_pixels, PARTS)
        if not item.external and not item.is_virtual and item.attrs.get("MATLAB_class") != b"char":
            arrays[name] = _Dataset(path, name, item, max_pixels)

    open_regular(path).close()
    kinds = OSError, ValueError, RuntimeError, KeyError
    with naming(path, "is a broken or truncated HDF5 file", kinds), h5py.File(path, "r") as file:
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
        check_limit(size, f"{title} has {size} bytes of shape {self.shape}", self._max_pixels, FILE_BYTES)
        h5py = import_extra("h5py", "hdf5", f"{self._path} is an HDF5 file")
        kinds = OSError, RuntimeError, KeyError
        with naming(title, "is broken or truncated", kinds), h5py.File(self._path, "r") as file:
            return np.asarray(file[self._name][index])
