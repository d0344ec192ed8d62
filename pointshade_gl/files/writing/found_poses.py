"""Writes poses of frames by their names, or in the form of the TUM benchmark."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...scene.rotation import quaternion_of
from ..access.atomic_write import check_place, written_whole
from ..access.written_suffixes import FOUND_POSES, check_suffix

_HEADER = (
    "# pointshade_gl: number tx ty tz qx qy qz qw: camera-to-world, axes of OpenCV (x right, y down, z forward), metres"
)


def check_poses_path(path: Path) -> Path:
    """Return the path, for a check before long work. Raises ValueError or OSError if nothing can be written there."""
    check_suffix(path, FOUND_POSES, "the suffix of poses")
    return check_place(path)


def save_found_poses(path: Path, poses: Mapping[str, NDArray[np.float64] | None]) -> None:
    """Write poses (4, 4), camera-to-world in OpenCV's axes and metres, completely or not at all; None is left out.

    .json is `{"name": [[...], ...], ...}`, .txt has a line `number tx ty tz qx qy qz qw` for each.
    """
    known = [(k, name, pose) for k, (name, pose) in enumerate(poses.items()) if pose is not None]
    if path.suffix.lower() == ".json":
        rows = (f" {json.dumps(name, ensure_ascii=False)}: {json.dumps(pose.tolist())}" for _, name, pose in known)
        text = "{\n" + ",\n".join(rows) + "\n}\n"
    else:
        numbers = ((k, *pose[:3, 3], *quaternion_of(pose[:3, :3])) for k, _, pose in known)
        text = "\n".join([_HEADER, *(" ".join(f"{value:.17g}" for value in row) for row in numbers)]) + "\n"
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
