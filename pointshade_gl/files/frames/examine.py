"""Examines a file or a folder: what it holds and how it is read, for `pointshade info`."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ...scene.frame import Frame
from ..access.content import FilePath
from .frame_files import read_frame
from .frame_parts import Assembled, ReadOptions


class Examined(NamedTuple):
    """A frame, how its files were understood, and the notes that reading it gave."""

    read: Assembled
    notes: list[str]

    @property
    def frame(self) -> Frame:
        return self.read.frame


def examine(source: FilePath | None, allow_outside: bool = False, **load_options: Any) -> Examined:
    """Reads a frame as `load_frame` does, and raises as it does. Of a sequence that is its first readable frame.

    load_options  those of `load_frame`, except notes
    """
    notes: list[str] = []
    color, depth = load_options.pop("color", None), load_options.pop("depth", None)
    options = ReadOptions(**load_options)
    return Examined(read_frame(source, depth, color, options, allow_outside, notes.append), notes)


def facts(examined: Examined) -> dict[str, dict[str, Any]]:
    """What was found, by subject; numbers are plain, lengths in metres, so that programs can read it as JSON."""
    read, frame = examined.read, examined.frame
    camera, found = frame.camera, read.found
    known = frame.depth[frame.depth > 0]
    low, middle, high = (float(f"{value:.6g}") for value in np.quantile(known, (0, 0.5, 1)))
    sides = (camera.width, camera.fx), (camera.height, camera.fy)
    color = None if frame.color is None else list(frame.color.shape[1::-1])
    return {
        "frames": {"count": found.frames, "shown": found.shown},
        "depth": {
            "file": found.depth,
            "size": [camera.width, camera.height],
            "stored": read.stored,
            "kind": read.coding.kind,
            "units_per_metre": read.coding.scale,
            "why": read.coding.why,
            "range": [low, high],
            "median": middle,
            "missing": round(1 - frame.points_known / frame.depth.size, 4),
        },
        "color": {"file": found.color, "size": color},
        "camera": {
            **{key: getattr(camera, key) for key in ("fx", "fy", "cx", "cy")},
            "fov": [round(math.degrees(2 * math.atan(side / 2 / abs(focal))), 2) for side, focal in sides],
            "from": read.camera_from,
        },
        "poses": {"count": found.poses, "from": found.poses_from or None},
    }
