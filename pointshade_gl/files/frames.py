"""Files become frames: finds the pictures, the camera and the pose, reads them, and prints every guess."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from ..camera import Camera
from ..checks import check_path
from ..frame import Frame
from ..notes import Note, print_note
from ..wording import option
from .assembly import Assembled, Parts, ReadOptions, assemble, is_path
from .builtin import builtin_folder
from .content import FilePath
from .folders import FrameFiles, check_folder, find_color
from .limits import MAX_PIXELS
from .names import Folder
from .sequences import find_filed, first_readable, open_folder


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
    """A frame from a folder, from a depth file, or from single files and arrays.

    folder       of a frame, or of a sequence, of which the first frame is taken, in any layout that files/known.py
                 lists; a depth file, whose colour and camera may lie beside it; or a built-in frame: "vase"
    color        a picture or (h, w, 3|4) uint8, instead of the folder's; there may be none
    depth        a picture, .npy, .npz, EXR or (h, w) array, instead of the folder's
    intrinsics   a file (see files/camera_files.py), 'fx,fy,cx,cy', four numbers or a Camera
    fov          vertical field of view in degrees, instead of intrinsics
    depth_scale  raw values per metre (1000: millimetres, TUM 5000); the default is that of the camera's file,
                 else 1000 for integers and 1 for floating point
    depth_kind   z, ray, plane, inverse or disparity; the default is that of the camera's file, else z
    baseline     metres between the cameras of a disparity
    pose         a file (see `load_pose`) or a (4, 4) camera-to-world matrix
    allow_outside  let depth.txt and rgb.txt name files outside the folder
    max_pixels   of a picture; the default passes 12 288 x 8 192. Other limits follow from it (see `files.limits`).
    notes        called with one sentence for every guess; the default prints it to stderr

    Raises ValueError, TypeError or OSError, in one sentence, for files that cannot be read right.
    """
    options = ReadOptions(intrinsics, fov, depth_scale, depth_kind, baseline, pose, max_pixels)
    return read_frame(folder, depth, color, options, allow_outside, notes or print_note).frame


def read_frame(
    source: FilePath | Folder | None, depth: Any, color: Any, options: ReadOptions, allow_outside: bool, note: Note
) -> Assembled:
    """As `load_frame`, with how the files were understood."""
    if source is None:
        if depth is None:
            raise ValueError(f"a frame needs depth: pass a folder with depth.*, or {option('depth', 'FILE')}")
        return assemble(Parts(_given(depth), _given(color)), options, note)
    if not isinstance(source, Folder):
        path = builtin_folder(source)
        if path.is_file():
            if depth is not None:
                raise ValueError(f"{path} is a file and would be the depth: leave out {option('depth')}, or the file")
            return _from_parts(Folder(path.parent, allow_outside), path, color, options, note)
        source = Folder(check_folder(path), allow_outside)
    if depth is not None or color is not None:
        return _from_parts(source, depth, color, options, note)
    sequence = open_folder(source, options, note)
    index, read = first_readable(sequence)
    if len(sequence) > 1:
        note(f"{source.path} is a sequence of {len(sequence)} frames: {sequence.files[index].depth.name} is taken")
    return read


def _given(value: Any) -> Any:
    return check_path(value) if is_path(value) else value


def _from_parts(place: Folder, depth: Any, color: Any, options: ReadOptions, note: Note) -> Assembled:
    """A frame of a folder with its depth, its colour or both given by the caller."""
    files: list[FrameFiles] = []
    if depth is None:
        depth = open_folder(place, options, note).files[0].depth
    if is_path(depth):
        files = [FrameFiles(Path(depth))]
    if color is None and is_path(depth):
        color = find_color(place.path, Path(depth), note)
        if color is None:
            note(f"{place.path} has no colour picture (color.*, rgb.*, image.*): the surface is light grey")
    for path in (depth, color):
        if is_path(path):
            place.check(Path(path))
    cameras = find_filed(place, files, options, note)
    return assemble(Parts(_given(depth), _given(color), cameras.of(0), missing=cameras.missing), options, note)
