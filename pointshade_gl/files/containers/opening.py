"""Opens container files: depth with colour, camera, pose or mask, of one frame or many; and zipped folders."""

from __future__ import annotations

import atexit
import math
import re
import shutil
import tempfile
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import option, shown
from ...scene.values import median
from ..access.content import FILE_BYTES, MAX_PIXELS, FilePath, check_limit, open_regular, read_head
from ..arrays.compression import ZIP, Archive
from ..arrays.matlab import HDF5, MATLAB_5, MATLAB_73, matlab_5_arrays
from ..arrays.numpy_files import MAYBE_INVERSE, NUMPY, NpyArray, find_roles, is_named, npz_arrays
from ..arrays.ply_and_pcd import is_pcd
from ..pictures.hdr_files import EXR, exr_facts, read_rgbd_exr
from .array_frames import open_arrays, open_hdf5, open_pcd
from .container_contents import Contents
from .phones import Unpacked, has_gdepth, is_heic, open_heic, open_record3d, read_gdepth

_Reader = Callable[[FilePath, Note, float], "Sequence[Contents] | None"]


def open_container(path: FilePath, note: Note, max_pixels: float = MAX_PIXELS) -> Sequence[Contents] | None:
    """The frames of a container, each read when it is asked for, from any thread; None for any other file or folder.

    Containers are .npz and .npy with more than a depth picture, HDF5, MATLAB's .mat, Record3D's recordings (.r3d, its
    zipped exports, or their folder), photographs with depth (HEIC) and organised point clouds (PCD). Raises OSError if
    there is none, ValueError for one without depth, a broken or too large one, and without the extra that it needs.
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
    """Recorded frames, or arrays; a single depth picture, called so or by a meaningless name, is no container."""
    archive = Archive(path, max_pixels)
    if not archive.names or not all(name.endswith(".npy") for name in archive.names):
        return open_record3d(archive, note, max_pixels)
    arrays = npz_arrays(archive)
    if len(arrays) == 1:
        (name, array), *_ = arrays.items()
        is_picture = math.prod(array.shape) == math.prod(sorted(array.shape)[-2:])
        if is_picture and not is_named(name, MAYBE_INVERSE) and set(find_roles([name])) <= {"depth"}:
            return None
    return open_arrays(str(path), arrays, note, max_pixels)


def open_inside(
    path: Path, note: Note, max_pixels: float = MAX_PIXELS, channel: str | None = None, has_color: bool = False
) -> Contents | None:
    """What a depth picture says beyond its values: EXR with colours or of Unreal, JPEG with depth; None for others.
    has_color: a colour picture lies beside it: that is taken."""
    suffix = path.suffix.lower()
    if suffix in _JPEG:
        return read_gdepth(path, note, max_pixels) if channel is None else None
    if suffix != ".exr" or not read_head(path).startswith(EXR):
        return None
    facts = exr_facts(path)
    if not (facts.is_unreal or facts.has_alpha or (facts.has_colors and not has_color)):
        return None
    depth, color = read_rgbd_exr(path, max_pixels, channel)
    scale = _CENTIMETRES if facts.is_unreal or (facts.has_alpha and _is_in_centimetres(depth)) else None
    if scale is not None:
        way_out = f"pass {option('depth_scale', 1)} if it is in metres, {option('depth_scale', 1000)} in millimetres"
        note(f"{path} is taken as centimetres, as Unreal Engine writes them; {way_out}")
    return Contents(depth, None if has_color else color, depth_scale=scale)


def _is_in_centimetres(depth: NDArray[Any]) -> bool:
    """Whether a program that draws, and so knows no sensor's whole millimetres, wrote more than metres can be."""
    known = depth[np.isfinite(depth) & (depth > 0) & (depth < _SKY)]
    if not known.size or not _MOST_METRES < median(known) < _CENTIMETRES * _MOST_METRES:
        return False
    return bool((known != np.rint(known)).any())


def holds_color(path: Path) -> bool:
    suffix = path.suffix.lower()
    if suffix == ".npy":
        array = NpyArray(path, "biufV")
        return array.shape[2:] in ((4,), (6,), (7,)) or {"r", "g", "b"} <= {*(array.dtype.names or ())}
    return (suffix in _JPEG and has_gdepth(path)) or (suffix == ".exr" and exr_facts(path).has_colors)


_JPEG, _CENTIMETRES = (".jpg", ".jpeg"), 100.0
_MOST_METRES, _SKY = 200.0, 65500.0  # of the middle of a picture; from here on 16-bit floats mean "nothing"
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


_OUTSIDE = re.compile(r"[/\0]|[A-Za-z]:|(?:.*/)?\.\.(?:/|$)")  # absolute, with a drive, or upwards
_LEFT_OUT = re.compile(r"(?:.*/)?(?:__MACOSX/|\.)")  # hidden files, and macOS's twins
_REMEMBERED = 8  # archives


def is_zip_folder(path: FilePath, max_pixels: float = MAX_PIXELS) -> bool:
    """Whether a file is a zip archive of files, not of NumPy's arrays. Raises OSError, ValueError as `Archive` does."""
    if not read_head(path).startswith(ZIP):
        return False
    return any(not name.endswith(".npy") for name in Archive(path, max_pixels).names)


def unpack_folder(path: FilePath, max_pixels: float = MAX_PIXELS) -> Path:
    """The only folder of a zip archive, or its top; unpacked once. Raises as `Archive`, and for unsafe contents."""
    open_regular(path).close()
    state = Path(path).stat()
    return _unpack(Path(path).absolute(), (state.st_mtime_ns, state.st_size), max_pixels)


@lru_cache(_REMEMBERED)
def _unpack(path: Path, version: tuple[int, int], max_pixels: float) -> Path:
    """version  is another one when the file was written again"""
    archive = Archive(path, max_pixels)
    names = {name: name.replace("\\", "/") for name in archive.names}
    for name, plain in names.items():
        if _OUTSIDE.match(plain):
            raise ValueError(f"{path} names {shown(name)}, which lies outside it: it is not unpacked")
    names = {name: plain for name, plain in names.items() if not _LEFT_OUT.match(plain)}
    size = sum(map(archive.size, names))
    check_limit(size, f"{path} has {size} bytes when unpacked", max_pixels, FILE_BYTES)
    folder = Path(tempfile.mkdtemp(prefix="pointshade-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    for name, plain in names.items():
        place = folder / plain
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(archive.read(name))
    while len(entries := list(folder.iterdir())) == 1 and entries[0].is_dir():
        folder = entries[0]
    return folder
