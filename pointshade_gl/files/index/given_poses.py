"""Assigns the poses of a file that the caller names: to the frames of a folder, or to several inputs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import check_path
from ...notes.notes import Note
from ...notes.words import counted, cut
from ...scene.camera import check_pose
from ..access.content import FilePath
from ..access.limits import MAX_PIXELS
from ..access.safe_paths import from_root
from ..poses.pose_files import read_poses
from ..poses.pose_key_names import PoseList
from .folder_poses import FoundPoses, match_poses
from .folders import FrameFiles

MOST_NAMED = 4  # names of a file that an error lists
# What a file of poses may call an input: as it is typed, by the last part of its path, or that without a suffix.
_FORMS: tuple[Callable[[FilePath], str], ...] = (
    str,
    lambda one: str(Path(one)),
    lambda one: from_root(Path(one)).name,
    lambda one: from_root(Path(one)).stem,
)


def given_poses(
    path: FilePath, source: Path, frames: Sequence[FrameFiles], note: Note, max_pixels: float = MAX_PIXELS
) -> FoundPoses:
    """Return the poses of the frames of a source, from a file that lies anywhere.

    They are assigned as those of a file in a folder. If the file has a pose by the name of the source, as for a camera
    among several that stand still, it is that of all frames.

    Raises ValueError if it is unclear which pose belongs to which frame, OSError for a file that cannot be read.
    """
    path = check_path(path)
    found = read_poses(path, max_pixels)
    names = found.names or []
    stems = {Path(name).stem for name in names}
    own = None if all(one.depth.stem in stems for one in frames) else _by_name(names, [source])
    if own is not None:
        return FoundPoses([found.poses[own[0]]] * len(frames), str(path), found.metric)
    if (poses := match_poses(path, found, frames, note)) is None:
        raise ValueError(
            f"{path} holds {_counted(found)}, and {source} has {counted(len(frames), 'frame')}: expected one for each, "
            "by name, time stamp, number or order"
        )
    return FoundPoses(poses, str(path), found.metric)


def poses_of_inputs(
    path: FilePath, inputs: Sequence[FilePath], max_pixels: float = MAX_PIXELS
) -> list[NDArray[np.float64]]:
    """Return (4, 4) camera-to-world for each of several inputs: by its name if the file has names, else in order.

    Raises ValueError for another number of poses, OSError for a file that cannot be read.
    """
    path = check_path(path)
    found = read_poses(path, max_pixels)
    if found.names is not None:
        places = _by_name(found.names, inputs)
    else:
        places = range(len(inputs)) if len(inputs) == len(found.poses) else None
    if places is None:
        raise ValueError(
            f"{path} holds {_counted(found)}, expected one for each of {len(inputs)} INPUTs: "
            f"{', '.join(map(str, inputs))}"
        )
    return [check_pose(found.poses[k], f"{path}: pose {k}") for k in places]


def _by_name(names: Sequence[str], inputs: Sequence[FilePath]) -> list[int] | None:
    """Return which of the names is that of each input; None if one has none, or if it is unclear."""
    for form in _FORMS:
        known, asked = [form(name) for name in names], [form(one) for one in inputs]
        is_clear = len(set(asked)) == len(set(map(str, inputs)))
        if is_clear and all(known.count(one) == 1 for one in asked):
            return [known.index(one) for one in asked]
    return None


def _counted(found: PoseList) -> str:
    """Return how many poses there are, with their first names."""
    names = [cut(name, 40) for name in (found.names or [])[:MOST_NAMED]]
    more = ", ..." if len(found.poses) > MOST_NAMED else ""
    return counted(len(found.poses), "pose") + (f" ({', '.join(names)}{more})" if names else "")
