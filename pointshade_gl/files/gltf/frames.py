"""Reads and writes the frames that the extras of a glTF node name; they lie in folders beside the glTF file."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from ...notes.notes import Note
from ...scene.frame import Frame
from ..access.builtin import FRAMES
from ..access.content import split_numbers
from ..access.limits import MAX_PIXELS
from ..access.safe_paths import Folder
from ..frames.frame_files import load_frame
from ..pictures.picture_files import save_image
from .buffers import inside
from .cameras_and_lights import FLIP
from .checks import numbers

_NUMBERS = ("fov", "depth_scale", "baseline")
_FILES = ("depth", "color", "intrinsics", "pose")  # options of load_frame that may name a file
FRAME_KEYS = ("frame", *_FILES, *_NUMBERS, "depth_kind")

# Where the frames of read scenes came from, with absolute paths: saving names these files instead of writing them anew.
_sources: WeakKeyDictionary[Frame, dict[str, Any]] = WeakKeyDictionary()


def read_frame(said: dict[str, Any], folder: Folder, note: Note, max_pixels: float = MAX_PIXELS) -> Frame:
    """The frame that extras describe. `save_scene` describes it in the same way. Raises ValueError or OSError."""
    given = dict(said)
    for key in _FILES:
        value = given.get(key)
        # a text of four numbers is intrinsics; everywhere else "1.5" is the name of a file
        if isinstance(value, str) and not (key == "intrinsics" and split_numbers(value)):
            given[key] = inside(folder, value)
    for key in _NUMBERS:
        if key in given:
            given[key] = numbers(given[key], (), key).item()
    place = given.pop("frame", None)
    if place not in (*FRAMES, None):
        place = inside(folder, place)
        if not place.is_dir():
            given.setdefault("depth", place)
            place = None
    pose = given.pop("pose", None)
    placed = pose if isinstance(pose, Path) else numbers(FLIP if pose is None else pose, (4, 4), "pose")
    fenced = Folder(place, folder.allow_outside, folder.path) if isinstance(place, Path) else place
    frame = load_frame(fenced, **given, pose=placed, max_pixels=max_pixels, notes=note)
    _sources[frame] = given | {key: value for key, value in (("frame", place), ("pose", pose)) if value is not None}
    return frame


def write_frame(frame: Frame, folder: Path, name: str, stage: Callable[[str], Path]) -> dict[str, Any]:
    """The extras that name a frame: its source, or files staged under this name. Raises ValueError without a point."""
    if said := _refer(frame, folder):
        return said
    if not frame.points_known:
        raise ValueError("its frame has no known depth, nothing to write")
    if frame.color is not None:
        save_image(stage(f"{name}/color.png"), frame.color)
    save_image(stage(f"{name}/depth.npy"), frame.depth)
    camera = {key: getattr(frame.camera, key) for key in ("width", "height", "fx", "fy", "cx", "cy")}
    stage(f"{name}/intrinsics.json").write_text(json.dumps(camera | {"depth_scale": 1.0}, indent=2) + "\n")
    return {"frame": name} | ({} if np.array_equal(frame.pose, FLIP) else {"pose": frame.pose.tolist()})


def _refer(frame: Frame, folder: Path) -> dict[str, Any] | None:
    """Return the extras by which a frame was read, if a file in this folder can use them; else None."""
    said = _sources.get(frame)
    if said is None:
        return None
    root = folder.resolve()
    if any(isinstance(value, Path) and not value.is_relative_to(root) for value in said.values()):
        return None
    named = {key: value.relative_to(root).as_posix() for key, value in said.items() if isinstance(value, Path)}
    return said | named
