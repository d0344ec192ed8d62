"""Chooses a frame's camera: the caller's, that of a file beside it, of the photograph's lens, or a usual one."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

from ...messages.formatting import option
from ...messages.notes import Note
from ...scene.camera import Camera
from ..access.file_name_patterns import CODINGS, COMMON_CAMERAS
from ..access.safe_paths import places_of
from ..cameras.camera_files import read_intrinsics
from ..cameras.intrinsics import Intrinsics, Size, merged, place_camera, shows_the_same
from .frame_parts import Parts, ReadOptions, is_path

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


def assumed_camera(size: Size, note: Note) -> Intrinsics:
    """Return the usual lens of a phone, for depth of no unit, whose shape is a guess anyway."""
    focal = max(size) / 2 / math.tan(math.radians(_USUAL_FOV) / 2)
    note(
        f"no camera is known, a field of view of {_USUAL_FOV:g} degrees across the longer side is assumed: "
        f"pass {option('fov')} (vertical degrees)"
    )
    return Intrinsics("the assumed camera", (focal, focal, (size[0] - 1) / 2, (size[1] - 1) / 2), size)


def make_camera(
    source: Intrinsics | None, fov: float | None, depth: Size, color: Size | None, missing: str, note: Note
) -> Camera:
    """The camera of a depth picture under colours of these sizes. Raises ValueError if none is known, or of neither.

    missing  why no file has one, to end an error with
    """
    if color and not shows_the_same(color, depth):
        note(
            f"color is {color[0]}x{color[1]} and depth {depth[0]}x{depth[1]}, of another aspect ratio: "
            f"they do not look registered; pass the right colour as {option('color', 'FILE')}"
        )
    if fov is not None:
        return Camera.from_fov(fov, *depth)
    if source is None:
        title, numbers = COMMON_CAMERAS.get(depth, ("", ""))
        often = f"; for this size often {option('intrinsics', numbers)} ({title})" if title else ""
        raise ValueError(
            f"the camera is unknown: pass {option('intrinsics')} (fx,fy,cx,cy or a file) "
            f"or {option('fov')} (vertical degrees), such as 50{often}{missing}"
        )
    return place_camera(source, depth, color, note)
