"""MATLAB's .mat files: version 5 by SciPy, version 7.3, which is HDF5, by h5py."""

from __future__ import annotations

import math
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..wording import cut
from .content import FilePath, open_regular, read_head
from .hdf5 import MATLAB_73, hdf5_arrays
from .limits import FILE_BYTES, MAX_PIXELS, check_limit
from .stored import Stored

MATLAB_5 = b"MATLAB 5.0"
_TYPES = {
    "double": "f8", "single": "f4", "logical": "?", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8",
}  # fmt: skip
_SMALL = 65536  # numbers of an array that may be a camera, a pose, or some thousand poses


def read_matrix_mat(path: FilePath, max_pixels: float = MAX_PIXELS) -> dict[str, NDArray[Any]]:
    """The small arrays of numbers in a .mat file, by their names, in MATLAB's order of axes.

    Raises OSError if the path is not a file, ValueError for another or a broken file and without the extra.
    """
    head = read_head(path)
    if head.startswith(MATLAB_73):
        arrays, is_transposed = hdf5_arrays(path, max_pixels), True
    elif head.startswith(MATLAB_5):
        arrays, is_transposed = matlab_5_arrays(path, max_pixels), False
    else:
        raise ValueError(f"{path} is not a MATLAB file of version 5 or 7.3")
    small = {name: array.part(()) for name, array in arrays.items() if math.prod(array.shape) <= _SMALL}
    return {name: array.T if is_transposed else array for name, array in small.items()}


def matlab_5_arrays(path: FilePath, max_pixels: float = MAX_PIXELS) -> dict[str, Stored]:
    """The arrays of numbers in a .mat file of version 5. Raises ValueError for a broken one and without the extra."""
    listed = _call(path, "whosmat")
    return {
        name: _Variable(path, name, shape, np.dtype(_TYPES[kind]), max_pixels)
        for name, shape, kind in listed
        if kind in _TYPES
    }


class _Variable:
    """An array in a .mat file of version 5, which can only be read whole."""

    def __init__(self, path: FilePath, name: str, shape: tuple[int, ...], dtype: np.dtype, max_pixels: float):
        self._path, self._name, self._max_pixels = path, name, max_pixels
        self.shape, self.dtype = shape, dtype

    def part(self, index: tuple[int, ...]) -> NDArray[Any]:
        size = math.prod(self.shape) * self.dtype.itemsize
        title = f"{self._path}/{self._name} has {size} bytes of shape {self.shape}"
        check_limit(size, title, self._max_pixels, FILE_BYTES)
        return np.asarray(_call(self._path, "loadmat", variable_names=[self._name])[self._name])[index]


def _call(path: FilePath, function: str, **options: Any) -> Any:
    open_regular(path).close()
    try:
        return getattr(_import_scipy(path), function)(str(path), appendmat=False, **options)
    except MemoryError:
        raise
    except Exception as error:  # broken bytes make SciPy raise of everything
        if str(error).startswith(f"{path} "):
            raise
        raise ValueError(f"{path} is a broken or truncated MATLAB file: {cut(error)}") from None


def _import_scipy(path: FilePath) -> ModuleType:
    try:
        import scipy.io  # only here: an optional extra
    except ImportError:
        raise ValueError(f"{path} is a MATLAB file: pip install 'pointshade-gl[mat]' to read it") from None
    return scipy.io
