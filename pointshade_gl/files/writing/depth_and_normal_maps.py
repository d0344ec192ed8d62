"""Writes depth maps and normal maps, whose pixels are numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import check_choice, check_path, depth_as_given
from ...checks.foreign_arrays import AnyArray, way_to
from ...notes.notes import Note, print_note
from ...notes.words import option
from ..access.atomic_write import check_place, written_whole
from ..access.content import FilePath
from ..access.written_suffixes import DEPTH, NORMALS, check_suffix
from ..pictures.exr import check_exr, write_exr
from ..pictures.picture_files import AXES, AxesName, normals_to_rgb, save_image, turned_normals, write_by_pillow


def check_depth_path(path: FilePath) -> Path:
    """The path, for a check before long work. Raises ValueError or OSError if `save_depth` cannot write there."""
    path = check_path(path)
    check_suffix(path, DEPTH, "the suffix of depth")
    return _check_map(path)


def save_depth(path: FilePath, depth: AnyArray, notes: Note = print_note) -> None:
    """Write depth completely or not at all: metres as floats, or millimetres in a .png of 16 bits; missing is 0.

    Parameters
    ----------
    path : path
        .exr gets the channel Z, as Nuke's depth.Z, and the same as Y, grey, for Blender and OpenCV; .tif and .tiff
        float pixels, .npy float32. A .png holds 1 mm to 65.535 m: other values are written as missing, and a note
        counts them.
    depth : (h, w) float
        Metres; 0, negative, NaN, infinite and masked mean missing.
    notes : callable
        Called with that note; the default prints it to stderr.

    Raises
    ------
    ValueError
        For another suffix or shape, for .exr without the extra `exr`, and if nothing fits into a .png.
    TypeError
        For values that are not floating point.
    OSError
        If the folder does not exist.
    """
    path = check_depth_path(path)
    metres = _known_depth(depth)
    if path.suffix.lower() == ".exr":
        with written_whole(path) as temporary:
            write_exr(temporary, {"Z": metres, "Y": metres})  # Z is depth's name, but Blender and OpenCV look for grey
    elif path.suffix.lower() == ".png":
        save_image(path, _millimetres(metres, path, notes))
    elif path.suffix.lower() == ".npy":
        save_image(path, metres)
    else:
        from PIL import Image

        with written_whole(path) as temporary, temporary.open("xb") as file:
            write_by_pillow(file, Image.fromarray(metres), "TIFF")


def _known_depth(depth: AnyArray) -> NDArray[np.float32]:
    array = depth_as_given(depth)
    if array.ndim != 2 or 0 in array.shape:
        raise ValueError(f"depth must have shape (h, w), got {array.shape}{way_to(array.shape, 'depth', depth)}")
    if array.dtype.kind != "f":
        raise TypeError(f"depth must be floating point metres, got {array.dtype}")
    with np.errstate(over="ignore"):
        metres = array.astype(np.float32)
    metres[~((metres > 0) & (metres < np.inf))] = 0
    return metres


def _millimetres(metres: NDArray[np.float32], path: Path, notes: Note) -> NDArray[np.uint16]:
    rounded = np.rint(metres * np.float64(1000))
    fits = (rounded >= 1) & (rounded <= 65535)
    known = np.count_nonzero(metres)
    lost = known - np.count_nonzero(fits)
    if lost and lost == known:
        raise ValueError(f"cannot write {path}: no depth lies within 1 mm to 65.535 m, use .exr, .tif or .npy")
    if lost:
        range_ = "outside 1 mm to 65.535 m, which 16 bits hold"
        notes(f"{path}: {lost} of {known} depths are {range_}, and become missing: .exr, .tif and .npy keep them")
    return np.where(fits, rounded, 0).astype(np.uint16)


def check_normals_path(path: FilePath, axes: str | None = None, bits: int = 8) -> Path:
    """The path, for a check before long work. Raises ValueError or OSError if `save_normals` cannot write there."""
    path = check_path(path)
    if axes is not None:
        check_choice(option("axes"), axes, tuple(AXES))
    if bits not in (8, 16):
        raise ValueError(f"{option('bits')} must be 8 or 16, got {bits}")
    if bits == 16 and path.suffix.lower() != ".png":
        raise ValueError(f"cannot write {path}: {option('bits', 16)} needs .png; .exr and .npy hold floats")
    check_suffix(path, NORMALS)
    return _check_map(path)


def save_normals(path: FilePath, normals: AnyArray, axes: AxesName | None = None, bits: Literal[8, 16] = 8) -> None:
    """Write normals completely or not at all: floats to .npy and .exr, colours to pictures.

    Parameters
    ----------
    path : path
        Its suffix chooses the format: .npy, .exr, .png, .jpg, .jpeg, .webp, .tif or .tiff.
    normals : (h, w, 3) float
        Unit vectors, camera axes; NaN where missing. Alpha is 0 there in pictures and in the RGBA channels of .exr.
    axes : {"opencv", "opengl", "directx"}, optional
        "opencv": the camera's own, x right, y down, z forward. "opengl": green up, blue towards the viewer, as in
        Blender and most normal maps. "directx": green down, blue towards the viewer. The default is "opencv" for .npy
        and "opengl" otherwise.
    bits : {8, 16}
        16 only for .png.

    Raises
    ------
    ValueError
        For unknown axes, for another shape, for a suffix that names no format or has not so many bits, and for .exr
        without the extra `exr`.
    TypeError
        For values that are not floating point.
    OSError
        If the folder does not exist.
    """
    path = check_normals_path(path, axes, bits)
    suffix = path.suffix.lower()
    axes = axes or ("opencv" if suffix == ".npy" else "opengl")
    if suffix not in (".npy", ".exr"):
        save_image(path, normals_to_rgb(normals, axes, bits))
        return
    turned, known = turned_normals(normals, axes)
    if suffix == ".npy":
        save_image(path, np.where(known[..., None], turned, np.float32(np.nan)))
        return
    with written_whole(path) as temporary:
        write_exr(temporary, {"RGBA": np.concatenate([turned, known[..., None]], -1)})


def _check_map(path: Path) -> Path:
    if path.suffix.lower() == ".exr":
        check_exr(path)
    return check_place(path)
