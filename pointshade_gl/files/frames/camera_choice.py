"""Chooses a frame's camera: the caller's, that of a file beside it, of the photograph's lens, or a usual one."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ...notes.notes import Note
from ...notes.words import option
from ...scene.camera import Camera
from ..access.file_name_patterns import CODINGS, COMMON_CAMERAS
from ..access.safe_paths import Folder, places_of
from ..cameras.camera_files import read_intrinsics
from ..cameras.intrinsics import Intrinsics, Size, merged, place_camera, shows_the_same
from ..index.folder_cameras import Cameras, find_cameras
from ..index.folders import FrameFiles
from .frame_parts import Parts, ReadOptions, is_path

ASSUMED = "the assumed camera"
_USUAL_FOV = 60.0  # degrees
_NAMES = 5  # folders of a path by which a data set is known


def choose_camera(parts: Parts, options: ReadOptions, note: Note) -> Intrinsics | None:
    """Return the caller's camera, with what the file beside the pictures adds; else the file's, or the photo's lens."""
    source, name = _said_camera(parts, options, note), parts.name
    if source is None or not name or options.depth_scale or options.depth_kind or source.depth_scale:
        return source
    # what neither its file nor the caller says about the depth is that of a data set known by names
    seen = "\n".join("/".join(one.parts[-_NAMES:]) for one in places_of(Path(name))).lower()
    known = next((one for one in CODINGS if re.search(one.known_by, seen)), None)
    if known is None or source.depth_kind:
        return source
    taken = option("depth_kind", known.depth_kind)
    if known.depth_scale is not None:
        taken += f", {option('depth_scale', known.depth_scale)}"
    note(f"{Path(name).name} looks like {known.title}: taken as {taken}")
    return replace(source, depth_scale=known.depth_scale, depth_kind=known.depth_kind)


def _said_camera(parts: Parts, options: ReadOptions, note: Note) -> Intrinsics | None:
    if options.intrinsics is not None:
        return merged(read_intrinsics(options.intrinsics, note, options.max_pixels), parts.filed)
    if parts.filed is None and options.fov is None and is_path(parts.color):
        from ..cameras.exif import camera_from_exif  # only here

        found = camera_from_exif(parts.color, options.max_pixels)
        if found:
            focal = f"focal length {found.numbers[0]:.0f} px"
            note(f"no camera is known, the lens of {Path(parts.color).name} is taken (EXIF): {focal}")
        return found
    return parts.filed


def find_filed(place: Folder, files: Sequence[FrameFiles], options: ReadOptions, note: Note) -> Cameras:
    """Return the cameras in a folder; beside a caller's camera intrinsics.json may still state what the depth is."""
    if options.intrinsics is None and options.fov is None:
        return find_cameras(place, files, note, options.max_pixels)
    if not (place.path / "intrinsics.json").is_file():
        return Cameras(None)
    try:
        return Cameras(find_cameras(place, (), lambda _: None, options.max_pixels).shared)
    except ValueError:
        note(f"{place.path / 'intrinsics.json'} is no camera file, and is not used")
        return Cameras(None)


def assumed_camera(size: Size, is_of_sensor: bool, missing: str, note: Note) -> Intrinsics:
    """Return a camera that is usual for a picture of this size, and say so: depth in metres alone does not tell it.

    is_of_sensor  whether depth has a unit, so that it may be a depth camera's; else it is seen as by a phone
    missing       why no file has a camera
    """
    width, height = size
    way_out = f"pass {option('intrinsics')} (fx,fy,cx,cy or a file) or {option('fov')} (vertical degrees)"
    if is_of_sensor and size in COMMON_CAMERAS:
        title, text = COMMON_CAMERAS[size]
        note(f"no camera is known{missing}: that of {title} is assumed, usual for {width}x{height} ({text}); {way_out}")
        fx, fy, cx, cy = map(float, text.split(","))
        return Intrinsics(ASSUMED, (fx, fy, cx, cy), size)
    focal = max(size) / 2 / math.tan(math.radians(_USUAL_FOV) / 2)
    note(
        f"no camera is known{missing}: a field of view of {_USUAL_FOV:g} degrees across the longer side is assumed; "
        f"{way_out}"
    )
    return Intrinsics(ASSUMED, (focal, focal, (width - 1) / 2, (height - 1) / 2), size)


def make_camera(source: Intrinsics | None, fov: float | None, depth: Size, color: Size | None, note: Note) -> Camera:
    """The camera of a depth picture under colours of these sizes. Raises ValueError if it is of neither.

    source  None only with a field of view
    """
    if color and not shows_the_same(color, depth):
        note(
            f"color is {color[0]}x{color[1]} and depth {depth[0]}x{depth[1]}, of another aspect ratio: "
            f"they do not look registered; pass the right colour as {option('color', 'FILE')}"
        )
    if fov is not None:
        return Camera.from_fov(fov, *depth)
    assert source is not None, "one is assumed where none is known"
    return place_camera(source, depth, color, note)
