"""Reads transforms.json as nerfstudio, instant-ngp and Polycam's converters write it: pictures, cameras and poses."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...notes.words import shown
from ...scene.camera import OPENGL
from ..access.content import parse_object, read_text
from ..access.folder_listing import natural
from ..access.limits import MAX_PIXELS
from ..arrays.named_numbers import named_of
from .camera_key_names import from_named
from .intrinsics import Intrinsics, merged


class Entry(NamedTuple):
    """One frame: names of its files, (4, 4) camera-to-world in OpenCV axes, its own camera if the file has several."""

    color: str | None
    depth: str | None
    pose: NDArray[np.float64]
    camera: Intrinsics | None


def read_transforms(path: Path, max_pixels: float = MAX_PIXELS) -> list[Entry]:
    """The frames of a transforms.json, by the numbers in their names. Raises ValueError for another content."""
    data = parse_object(read_text(path, max_pixels), path, max_pixels)
    frames, scale = data.get("frames", []), data.get("applied_scale")
    if not isinstance(frames, list):
        raise ValueError(f"{path}: frames must be a list, got {shown(frames)}")
    per_metre = scale if isinstance(scale, int | float) and scale > 0 else 1.0
    shared = from_named(named_of({key: value for key, value in data.items() if key != "frames"}), str(path))
    entries = [_entry(frame, per_metre, path) for frame in frames]
    if shared:  # it may say the unit of the depth for all
        entries = [one._replace(camera=merged(one.camera, shared[0])) if one.camera else one for one in entries]
    return sorted(entries, key=lambda one: natural(one.color or one.depth or ""))


@np.errstate(invalid="ignore", over="ignore")  # poses are checked later
def _entry(frame: Any, per_metre: float, path: Path) -> Entry:
    try:
        pose = np.array(frame["transform_matrix"], np.float64).reshape(4, 4) @ OPENGL
        pose[:3, 3] /= per_metre
    except (KeyError, TypeError, ValueError, OverflowError):
        raise ValueError(f"{path}: every frame must have a transform_matrix of 4x4 numbers") from None
    color, depth = frame.get("file_path"), frame.get("depth_file_path", frame.get("depth_path"))
    own = {key: value for key, value in frame.items() if key != "transform_matrix"}
    cameras = from_named(named_of(own), str(path)) if "fl_x" in own else []
    return Entry(
        color if isinstance(color, str) else None,
        depth if isinstance(depth, str) else None,
        pose,
        cameras[0] if cameras else None,
    )
