"""Finds the poses of a folder's frames, and assigns those of a file that the caller names."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import check_path
from ...notes.notes import Note
from ...notes.words import counted, cut
from ...scene.camera import check_pose
from ..access.content import MAX_PIXELS, FilePath
from ..access.folders import Folder, ListedFile, from_root, numbers_in
from ..access.known_names import FRAME_POSES, NOT_A_POSE, POSE_SUFFIXES, POSES
from ..cameras.pose_files import PoseList, read_poses
from .folder_frames import FrameFiles, nearest, own_files

CLOSE = 0.02  # seconds between a picture and its pose, as in the TUM benchmark's own tools
Poses = list[NDArray[np.float64] | None]


class FoundPoses(NamedTuple):
    """For each frame (4, 4) camera-to-world in OpenCV axes, unchecked, None without one."""

    poses: Poses
    source: str = ""  # the file that has them
    metric: bool = True  # their unit is the metre; COLMAP's and those that follow from them have any unit


def find_poses(place: Folder, frames: Sequence[FrameFiles], note: Note, max_pixels: float = MAX_PIXELS) -> FoundPoses:
    """The poses of a folder's frames. Raises ValueError for a file that is called like one of poses and holds none."""
    folder = place.path
    items = [item for item in place.listing.files(folder, 2, POSE_SUFFIXES) if not NOT_A_POSE.search(item.name)]
    taken = cache(lambda: {path for one in frames for path in (one.depth, one.color, one.valid)})
    single = own_files(items, frames, FRAME_POSES, lambda item: item.suffix == ".log" or item.path in taken())
    example = next((path for path in single if path), None)
    if example and _holds_a_pose(example, max_pixels):
        first = _named(folder, example)
        note(f"poses are read from files such as {first}")
        listed = [read_poses(path, max_pixels) if path else None for path in single]
        metric = all(one.metric for one in listed if one)
        return FoundPoses([one.poses[0] if one else None for one in listed], first, metric)
    found = [item for item in _by_rank(items) if item.path not in taken()]
    for item in found:
        listed = read_poses(item.path, max_pixels)
        poses = match_poses(item.path, listed, frames, note)
        if poses is None:
            note(f"{item.path} has {len(listed.poses)} poses for {len(frames)} frames: it is not used")
        else:
            also = [_named(folder, other.path) for other in found if other is not item][:3]
            note(f"poses are read from {_named(folder, item.path)}" + (f", not from {', '.join(also)}" if also else ""))
            return FoundPoses(poses, _named(folder, item.path), listed.metric)
    return FoundPoses([None] * len(frames))


def _named(folder: Path, path: Path) -> str:
    return path.relative_to(folder).as_posix()


def _holds_a_pose(path: Path, max_pixels: float) -> bool:
    """Whether it is a file with one pose, and not of another kind, such as a camera."""
    try:
        return len(read_poses(path, max_pixels).poses) == 1
    except ValueError:
        return False


def _by_rank(items: Sequence[ListedFile]) -> list[ListedFile]:
    """Files that may hold the poses of all frames, the best known names first."""
    return list(dict.fromkeys(item for name in POSES for item in items if name.fullmatch(item.name)))


def match_poses(path: Path, found: PoseList, frames: Sequence[FrameFiles], note: Note) -> Poses | None:
    """Return a pose for each frame; None if it is unclear which belongs to which."""
    if found.numbers is not None:
        named = dict(zip(found.numbers, found.poses, strict=True))
        return _partly(path, [named.get(one.number) for one in frames], note)
    if found.names is not None and (poses := _by_name(path, found, frames, note)):
        return poses
    times = np.array([one.time for one in frames if one.time is not None])
    given = found.times
    if given is not None and len(times) == len(frames) and given.min() <= times.max() and times.min() <= given.max():
        near = nearest(times, given)
        far = int(np.count_nonzero(np.abs(given[near] - times) > CLOSE))
        if far:
            note(f"{path}: {far} of {len(frames)} pictures have no pose within {CLOSE:g} s and get the nearest")
        return list(found.poses[near])
    if len(found.poses) == len(frames):
        return list(found.poses)
    numbers = [numbers_in(one.key)[-1:] for one in frames]
    if all(number and 0 <= number[0] < len(found.poses) for number in numbers):
        return [found.poses[number[0]] for number in numbers]
    return None


def _by_name(path: Path, found: PoseList, frames: Sequence[FrameFiles], note: Note) -> Poses | None:
    for same in (_stem, lambda name: numbers_in(_stem(name)), lambda name: numbers_in(_stem(name))[-1:]):
        named = {same(name): pose for name, pose in zip(found.names or [], found.poses, strict=True)}
        named.pop((), None)  # names without numbers have nothing in common
        result = [named.get(same(one.depth.name), named.get(same((one.color or one.depth).name))) for one in frames]
        if (poses := _partly(path, result, note)) is not None:
            return poses
    return None


def _partly(path: Path, poses: Poses, note: Note) -> Poses | None:
    """Return the poses of frames, and note how many have none; None if all have none."""
    without = sum(pose is None for pose in poses)
    if without == len(poses):
        return None
    if without:
        count = f"{without} of {len(poses)} pictures"
        note(f"{path} has no pose for {count}: alone they are drawn at the origin, merged views leave them out")
    return poses


def _stem(name: str) -> str:
    return Path(name.replace("\\", "/")).stem.lower()


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
    own = None if all(one.depth.stem in stems for one in frames) else _by_names(names, [source])
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
        places = _by_names(found.names, inputs)
    else:
        places = range(len(inputs)) if len(inputs) == len(found.poses) else None
    if places is None:
        raise ValueError(
            f"{path} holds {_counted(found)}, expected one for each of {len(inputs)} INPUTs: "
            f"{', '.join(map(str, inputs))}"
        )
    return [check_pose(found.poses[k], f"{path}: pose {k}") for k in places]


def _by_names(names: Sequence[str], inputs: Sequence[FilePath]) -> list[int] | None:
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
