"""Opens container files: depth with colour, camera, pose or mask, for one or more frames.

A container is known by its first bytes, then by the names inside. A new kind is a row of _READERS.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ...notes.notes import Note
from ..access.content import FilePath, read_head
from ..access.limits import MAX_PIXELS
from ..arrays.array_files import NUMPY
from ..arrays.array_roles import MAYBE_INVERSE, find_roles, is_named
from ..arrays.hdf5 import HDF5, MATLAB_73
from ..arrays.matlab import MATLAB_5, matlab_5_arrays
from ..arrays.pcd import is_pcd
from ..arrays.stored_arrays import NpyArray, Stored, npz_arrays
from ..arrays.zip_archive import ZIP, Archive
from .contents import Contents
from .data_sets import open_hdf5
from .heic import is_heic, open_heic
from .networks import open_arrays
from .organised import open_pcd
from .record3d import Unpacked, open_record3d

_Reader = Callable[[FilePath, Note, float], "Sequence[Contents] | None"]


def open_container(path: FilePath, note: Note, max_pixels: float = MAX_PIXELS) -> Sequence[Contents] | None:
    """The frames of a container, each read when it is asked for, from any thread; None for any other file or folder.

    Containers are .npz and .npy with more than a depth picture, HDF5, MATLAB's .mat, Record3D's recordings (.r3d, its
    zipped exports, or their folder), photographs with depth (HEIC) and organised point clouds (PCD). Raises OSError if
    the path does not exist, ValueError for a container without depth, for a broken or too large one, and without the
    extra that it needs.
    """
    if any((Path(path) / name).is_file() for name in ("metadata", "metadata.json")):
        return open_record3d(Unpacked(Path(path), max_pixels), note, max_pixels)
    if Path(path).is_dir():
        return None
    head = read_head(path)
    reader = next((reader for is_kind, reader in _READERS if is_kind(head)), None)
    return reader(path, note, max_pixels) if reader else None


def _open_npy(path: FilePath, note: Note, max_pixels: float) -> Sequence[Contents] | None:
    """Points, or several depth pictures; one of these is no container."""
    array = NpyArray(path)
    shape = tuple(side for side in array.shape if side != 1)
    if len(shape) != 3 or array.dtype.kind != "f" or 0 in shape or shape[2] == 4:
        return None
    if shape[2] != 3:
        return open_arrays(str(path), {"depth": array}, note, max_pixels)
    some = array.part(()).reshape(shape)[:: max(1, shape[0] // 64)]
    is_grey = np.array_equal(some, np.broadcast_to(some[..., :1], some.shape), equal_nan=True)
    return None if is_grey else open_arrays(str(path), {"points": array}, note, max_pixels)


def _open_zip(path: FilePath, note: Note, max_pixels: float) -> Sequence[Contents] | None:
    archive = Archive(path, max_pixels)
    if not archive.names or not all(name.endswith(".npy") for name in archive.names):
        return open_record3d(archive, note, max_pixels)
    arrays = npz_arrays(archive)
    return None if _is_plain(arrays) else open_arrays(str(path), arrays, note, max_pixels)


def _is_plain(arrays: dict[str, Stored]) -> bool:
    """Whether the only array is a depth picture, called so or by a name that says nothing."""
    name, array = next(iter(arrays.items()), ("", None))
    is_picture = array is not None and math.prod(array.shape) == math.prod(sorted(array.shape)[-2:])
    says_nothing = not is_named(name, MAYBE_INVERSE) and set(find_roles([name])) <= {"depth"}
    return len(arrays) == 1 and is_picture and says_nothing


_READERS: tuple[tuple[Callable[[bytes], bool], _Reader], ...] = (
    (lambda head: head.startswith(NUMPY), _open_npy),
    (lambda head: head.startswith(ZIP), _open_zip),
    (lambda head: head.startswith(HDF5), open_hdf5),
    (lambda head: head.startswith(MATLAB_73), lambda path, note, most: open_hdf5(path, note, most, is_matlab=True)),
    (
        lambda head: head.startswith(MATLAB_5),
        lambda path, note, most: open_arrays(str(path), matlab_5_arrays(path, most), note, most),
    ),
    (is_heic, open_heic),
    (is_pcd, open_pcd),
)
