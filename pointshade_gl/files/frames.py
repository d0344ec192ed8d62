"""Files become frames: finds the pictures, reads them, and prints every guess."""

from __future__ import annotations

import dataclasses
from os import PathLike
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..camera import Camera
from ..checks import as_given, check_choice, check_positive
from ..frame import Frame
from ..notes import Note, print_note
from ..wording import option
from .builtin import builtin_folder
from .content import FilePath
from .depth import one_channel, read_depth
from .depth_coding import decode
from .depth_kinds import KINDS, Said, to_metres
from .folders import COLOR_NAMES, COLOR_SUFFIXES, DEPTH_NAMES, DEPTH_SUFFIXES, check_folder, find_pairs, find_picture
from .intrinsics import Intrinsics, place_camera, read_intrinsics
from .limits import MAX_PIXELS
from .names import Folder
from .pictures import read_image
from .poses import load_pose


def load_frame(
    folder: FilePath | Folder | None = None,
    *,
    color: FilePath | ArrayLike | None = None,
    depth: FilePath | ArrayLike | None = None,
    intrinsics: FilePath | ArrayLike | Camera | None = None,
    fov: float | None = None,
    depth_scale: float | None = None,
    depth_kind: str | None = None,
    baseline: float | None = None,
    pose: FilePath | ArrayLike | None = None,
    allow_outside: bool = False,
    max_pixels: float = MAX_PIXELS,
    notes: Note | None = None,
) -> Frame:
    """A frame from a folder with color.* (or rgb.*), depth.* and intrinsics.json, or from single files and arrays.

    folder       of a frame, or of a sequence with folders color/ and depth/, of which the first pictures are taken;
                 or the name of a built-in frame: "vase"
    color        a picture or (h, w, 3|4) uint8, instead of the folder's; there may be none
    depth        a picture, .npy, .npz, EXR or (h, w) array, instead of the folder's
    intrinsics   a file (ours, Open3D's, nerfstudio's, a text matrix), 'fx,fy,cx,cy', four numbers or a Camera
    fov          vertical field of view in degrees, instead of intrinsics
    depth_scale  raw values per metre (1000: millimetres, TUM 5000); the default is that of the intrinsics file, else
                 what the values show, else 1000 for integers and 1 for floating point
    depth_kind   z, ray, plane, inverse, disparity or kinect; the default is that of the intrinsics file, else what the
                 values show, else z
    baseline     metres between the cameras of a disparity
    pose         a file (see `load_pose`) or a (4, 4) camera-to-world matrix
    allow_outside  let depth.txt and rgb.txt name files outside the folder
    max_pixels   of a picture; the default passes 12 288 x 8 192. Other limits follow from it (see `files.limits`).
    notes        called with one sentence for every guess; the default prints it to stderr

    Raises ValueError, TypeError or OSError, in one sentence, for files that cannot be read right.
    """
    note = notes or print_note
    check_positive(max_pixels, option("max_pixels", beside_file=True))
    place = _open_folder(folder, allow_outside)
    depth, color = _find_pictures(place, depth, color, note, max_pixels)
    raw = read_depth(depth, note, max_pixels) if _is_path(depth) else _check_depth(depth)
    picture = read_color(color, max_pixels) if _is_path(color) else _check_color(color)
    source = _find_intrinsics(place, intrinsics, fov, note, max_pixels)
    camera = _make_camera(source, fov, raw, picture, note)
    if depth_kind is not None:
        check_choice(option("depth_kind"), depth_kind, KINDS)
    elif source and source.depth_kind is not None:
        check_choice("depth_kind", source.depth_kind, KINDS, f" in {source.name}")
    baseline = _filed_baseline(source) if baseline is None else baseline
    filed_scale = _filed_scale(source, raw, _is_path(depth))
    said = Said(depth_kind, depth_scale, source and source.depth_kind, filed_scale, baseline is not None)
    decoded = decode(raw, str(depth) if _is_path(depth) else "depth", said, note)
    metres = to_metres(decoded.values, camera, decoded.kind, decoded.scale, baseline, note, np.float32)
    del raw, decoded
    matrix: Any = load_pose(pose) if _is_path(pose) else pose
    frame = Frame(picture, metres, camera, matrix)
    if not frame.points_known:
        raise ValueError("depth must be known somewhere, got only missing values (0, negative, NaN or infinite)")
    return frame


def read_color(path: FilePath, max_pixels: float = MAX_PIXELS) -> NDArray[np.uint8]:
    """(h, w, 3|4) uint8 of any picture: palettes are looked up, grey is repeated, 16 bits become 8."""
    return to_color(read_image(path, max_pixels), str(path))


def to_color(image: NDArray[Any], name: str) -> NDArray[np.uint8]:
    """(h, w, 3|4) uint8 of a picture's values. Raises ValueError, with the name, for floating point."""
    if image.dtype.kind == "f":
        raise ValueError(f"{name} is a floating point picture, expected colours of 8 or 16 bits")
    if image.dtype != np.uint8:
        image = ((np.clip(image, 0, 65535).astype(np.uint32) * 255 + 32767) // 65535).astype(np.uint8)
    return np.repeat(image[..., None], 3, axis=2) if image.ndim == 2 else image


def _open_folder(folder: FilePath | Folder | None, allow_outside: bool) -> Folder | None:
    if folder is None or isinstance(folder, Folder):
        return folder
    return Folder(check_folder(builtin_folder(folder)), allow_outside)


def _is_path(value: Any) -> TypeGuard[FilePath]:
    return isinstance(value, str | PathLike)


def _check_depth(depth: Any) -> NDArray[Any]:
    return one_channel(as_given(depth, "depth must have shape (h, w)"), "depth")


def _check_color(color: Any) -> NDArray[Any] | None:
    if color is None:
        return None
    expected = "color must have shape (h, w, 3) or (h, w, 4)"
    array = as_given(color, expected)
    if array.ndim != 3 or 0 in array.shape:
        raise ValueError(f"{expected}, got {array.shape}")
    return array


def _find_pictures(place: Folder | None, depth: Any, color: Any, note: Note, max_pixels: float) -> tuple[Any, Any]:
    """Depth and colour: those that were passed, else the folder's."""
    if place is None:
        if depth is None:
            raise ValueError(f"a frame needs depth: pass a folder with depth.*, or {option('depth', 'FILE')}")
        return depth, color
    folder = place.path
    if depth is None and color is None:
        pairs = find_pairs(place, note, max_pixels)
        if pairs:
            depth, color, _ = pairs[0]
        if len(pairs) > 1:
            note(f"{folder} is a sequence of {len(pairs)} frames: {pairs[0].depth.name} is taken")
    if depth is None:
        depth = find_picture(folder, DEPTH_NAMES, DEPTH_SUFFIXES, None, note)
        if depth is None:
            raise FileNotFoundError(
                f"{folder} has no depth picture: expected depth.png (or {', '.join(DEPTH_SUFFIXES[:6])}...) "
                f"or a folder depth/ in it, or pass {option('depth', 'FILE')}"
            )
    if color is None:
        stem = Path(depth).stem if _is_path(depth) else None
        color = find_picture(folder, COLOR_NAMES, COLOR_SUFFIXES, stem, note)
        if color is None:
            note(f"{folder} has no color.* or rgb.* picture: the surface is light grey")
    for path in (depth, color):
        if _is_path(path):
            place.check(Path(path))
    return depth, color


def _find_intrinsics(
    place: Folder | None, intrinsics: Any, fov: float | None, note: Note, max_pixels: float
) -> Intrinsics | None:
    """The caller's intrinsics; what they do not say about the depth comes from the folder's file."""
    if intrinsics is not None and fov is not None:
        raise ValueError(f"pass {option('intrinsics')} or {option('fov')}, not both")
    # nerfstudio's file may hold poses only: it is read if nothing else says what the camera is
    names = ("intrinsics.json", "transforms.json") if intrinsics is None and fov is None else ("intrinsics.json",)
    paths = [place.path / name for name in names] if place else []
    filed = None
    for path in paths:
        if place and filed is None and path.is_file():
            filed = read_intrinsics(place.check(path), note, max_pixels)
    if intrinsics is None:
        return filed
    given = read_intrinsics(intrinsics, note, max_pixels)
    if filed is None:
        return given
    unsaid = {
        key: getattr(filed, key) for key in ("depth_scale", "depth_kind", "baseline") if getattr(given, key) is None
    }
    return dataclasses.replace(given, **unsaid)


def _make_camera(
    source: Intrinsics | None, fov: float | None, raw: NDArray[Any], picture: NDArray[Any] | None, note: Note
) -> Camera:
    depth = (raw.shape[1], raw.shape[0])
    color = None if picture is None else (picture.shape[1], picture.shape[0])
    if color and abs(color[0] / color[1] * depth[1] / depth[0] - 1) > 0.02:
        note(
            f"color is {color[0]}x{color[1]} and depth {depth[0]}x{depth[1]}, of another aspect ratio: "
            "they do not look registered"
        )
    if fov is not None:
        return Camera.from_fov(fov, *depth)
    if source is None:
        raise ValueError(
            f"the camera is unknown: pass {option('intrinsics')} (fx,fy,cx,cy or a file) "
            f"or {option('fov')} (vertical degrees)"
        )
    return place_camera(source, depth, color, note)


def _filed_scale(source: Intrinsics | None, raw: NDArray[Any], from_file: bool) -> float | None:
    """The depth_scale of the intrinsics file, if it is about this depth. Raises ValueError for an impossible one."""
    if source is None or source.depth_scale is None or (raw.dtype.kind == "f" and not from_file):
        return None  # the caller's own array of floats is in metres
    return check_positive(source.depth_scale, f"{source.name}: depth_scale")


def _filed_baseline(source: Intrinsics | None) -> float | None:
    """The baseline of the intrinsics file. Raises ValueError for an impossible one."""
    if source is None or source.baseline is None:
        return None
    return check_positive(source.baseline, f"{source.name}: baseline")
