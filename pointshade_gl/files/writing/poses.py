"""Writes the poses of frames, in the form of the TUM benchmark, or by their names."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import check_count, check_path, check_type, items_of
from ...notes.words import shown
from ...scene.camera import quaternion_of
from ...scene.frame import Frame
from ..access.atomic_write import check_place, written_whole
from ..access.content import FilePath
from ..access.written_suffixes import FOUND_POSES, POSES, check_suffix
from ..poses.pose_files import WRITTEN

_HEADER = f"{WRITTEN} tx ty tz qx qy qz qw: camera-to-world, axes of OpenCV (x right, y down, z forward), metres\n"


def check_poses_path(path: FilePath) -> Path:
    """The path, for a check before long work. Raises ValueError or OSError if `save_poses` cannot write there."""
    path = check_path(path)
    check_suffix(path, POSES, "the suffix of poses")
    return check_place(path)


def save_poses(path: FilePath, frames: Iterable[Frame], numbers: Sequence[int] | None = None) -> None:
    """Write the poses of frames as a text in the form of the TUM benchmark, completely or not at all.

    Each frame has a line `number tx ty tz qx qy qz qw`: the camera's place in metres and its turn as a quaternion,
    camera-to-world, in the axes of OpenCV. `load_frame` and `open_source` read it as `poses`, and the command line as
    --poses.

    Parameters
    ----------
    path : path
        The file, .txt.
    frames : iterable of Frame
        Such as `align_frames` returns.
    numbers : sequence of int, optional
        Of the frames in their folder, counted from 0, if they are only some of it. The default is their order.

    Raises
    ------
    ValueError
        For another suffix, no frames, or another count of numbers than of frames.
    TypeError
        For anything but frames.
    OSError
        If the folder does not exist.
    """
    path, found = check_poses_path(path), items_of(frames)
    if found is None:
        raise TypeError(f"frames must be an iterable of frames, got {shown(frames)}")
    poses = [check_type(frame, Frame, f"frame {k}").pose for k, frame in enumerate(found)]
    stamps = range(len(poses)) if numbers is None else [check_count(one, "each number") for one in numbers]
    if len(set(stamps)) < len(stamps):
        raise ValueError(f"each frame needs a number of its own, got {shown(list(stamps))}")
    if not poses or len(stamps) != len(poses):
        raise ValueError(f"poses need one frame or more, and a number for each, got {len(poses)} and {len(stamps)}")
    save_numbered_poses(path, dict(zip(stamps, poses, strict=True)))


def save_numbered_poses(path: Path, poses: Mapping[int, NDArray[np.float64]]) -> None:
    """Write poses (4, 4) as `save_poses` does, by the numbers of their frames."""
    lines = (
        " ".join([str(number), *(f"{value:.17g}" for value in (*pose[:3, 3], *quaternion_of(pose[:3, :3])))])
        for number, pose in poses.items()
    )
    _write(path, _HEADER + "\n".join(lines) + "\n")


def check_found_path(path: Path) -> Path:
    """The path, for a check before long work. Raises ValueError or OSError if `save_found_poses` cannot write there."""
    check_suffix(path, FOUND_POSES, "the suffix of poses")
    return check_place(path)


def save_found_poses(path: Path, poses: Mapping[str, NDArray[np.float64] | None]) -> None:
    """Write poses (4, 4), camera-to-world in OpenCV's axes and metres, completely or not at all; None is left out.

    .json is `{"name": [[...], ...], ...}`, .txt as `save_poses` writes it.
    """
    known = {name: (k, pose) for k, (name, pose) in enumerate(poses.items()) if pose is not None}
    if path.suffix.lower() == ".json":
        rows = (
            f" {json.dumps(name, ensure_ascii=False)}: {json.dumps(one.tolist())}" for name, (_, one) in known.items()
        )
        _write(path, "{\n" + ",\n".join(rows) + "\n}\n")
    else:
        save_numbered_poses(path, dict(known.values()))


def _write(path: Path, text: str) -> None:
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
