"""Finds the cameras of a folder's frames, and their poses, by file name and content; assigns those of a file."""

from __future__ import annotations

import re
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
from ..access import known_names
from ..access.content import MAX_PIXELS, FilePath, followed, parse_object, read_text
from ..access.folders import Folder, ListedFile, from_root, key_of, numbers_in, places_of
from ..arrays.named_numbers import named_of
from ..cameras.camera_files import read_intrinsics, read_transforms
from ..cameras.intrinsics import Intrinsics, from_named, shows_the_same
from ..cameras.pose_files import PoseList, note_alone, read_poses
from ..pictures.picture_files import png_size
from .folder_frames import FrameFiles, matches, nearest, own_files

_PARENTS = 2  # folders above the frames' own in which their camera may lie: scene/seq-01, set/test/000048
CLOSE = 0.02  # seconds between a picture and its pose, as in the TUM benchmark's own tools
MOST_NAMED = 4  # names of a file that an error lists
Poses = list[NDArray[np.float64] | None]


class Cameras(NamedTuple):
    """What a folder states about the camera of each of its frames."""

    shared: Intrinsics | None  # the camera of all frames; None if it is unknown, or if each frame has one of its own
    own: Sequence[Intrinsics | None] = ()
    missing: str = ""  # why there is none: the files that were looked at, for a sentence; else ""

    def of(self, number: int) -> Intrinsics | None:
        """The camera of a frame, counted from 0."""
        return (self.own[number] if number < len(self.own) else None) or self.shared


def find_cameras(place: Folder, frames: Sequence[FrameFiles], note: Note, max_pixels: float = MAX_PIXELS) -> Cameras:
    """Find the cameras of a folder's frames; a note names the file. Raises ValueError for a bad intrinsics.json."""
    items = _belonging(place, known_names.CAMERA_SUFFIXES, frames)
    beside = _twins(place, known_names.CAMERA_SUFFIXES, frames)
    own = _one_each(items, frames, note, max_pixels) or _one_each(beside, frames, note, max_pixels)
    if own:
        return Cameras(None, own)
    failed: list[str] = []
    of_color = False  # whether, by its name, the first depth was projected into the colour camera
    if frames:
        depth = frames[0].depth
        name = depth.relative_to(place.path) if depth.is_relative_to(place.path) else depth.name
        of_color = known_names.REGISTERED.search(str(name).lower()) is not None
    ranked = [*_nearest(_by_rank(items, of_color), frames), *_nearest(_by_rank(beside, of_color), frames)]
    for item in [*ranked, *_in_parents(place, frames)]:
        try:
            found = read_intrinsics(place.check(item.path), note, max_pixels, of_color)
        except (ValueError, OSError) as error:
            if item.name == "intrinsics.json":
                raise
            failed.append(f"{item.path.name} ({cut(str(error).removeprefix(str(item.path)).strip(': '), 120)})")
            continue
        if item.name != "intrinsics.json":
            note(f"the camera is read from {item.path}")
        own = _in_transforms(item, frames, max_pixels) or _by_frame(item, frames, max_pixels)
        return Cameras(found, own)
    known = _of_data_set(place, items, frames, note, max_pixels)
    return Cameras(known, (), f" (not understood: {', '.join(failed[:2])})" if failed else "")


def _nearest(items: Sequence[ListedFile], frames: Sequence[FrameFiles]) -> list[ListedFile]:
    """Sort by the number of folders shared with the first frame, most first: a folder may hold several data sets. Then
    come those called like one of its folders: poses/kitchen.txt for depth/kitchen/0001.png."""
    if not frames:
        return list(items)
    here = {*from_root(frames[0].depth).parents}
    names = {one.name.lower() for one in here}
    shared = cache(lambda folder: len(here & {folder, *folder.parents}))
    numbers = numbers_in(frames[0].key)
    near = lambda item: (-shared(from_root(item.path.parent)), item.stem not in names, item.numbers != numbers)  # noqa: E731
    return sorted(items, key=near)


def _twins(place: Folder, suffixes: Sequence[str], frames: Sequence[FrameFiles]) -> list[ListedFile]:
    """The files about frames in the trees beside that of their depth, see `Listing.twins`."""
    return place.listing.twins(frames[0].depth.parent, suffixes) if frames and place.root is None else []


def _belonging(place: Folder, suffixes: Sequence[str], frames: Sequence[FrameFiles]) -> list[ListedFile]:
    """The files of a folder that may be about its frames: another recording may lie beside or below them.

    They lie where one of the frames does, above, or in folders that are called for what they hold; not among pictures
    of others.
    """
    items = place.listing.files(place.path, place.levels, suffixes)
    if not frames or not any(item.level for item in items):
        return items
    own = {folder for path in (frames[0].depth, frames[0].color) if path for folder in path.parents}
    if frames[0].depth.parent == place.path:
        pictures = place.listing.files(place.path, place.levels, known_names.PICTURE_SUFFIXES)
        others = {item.path.parent for item in pictures if item.level} - own
        items = [item for item in items if item.path.parent not in others]

    def belongs(item: ListedFile) -> bool:
        folders = item.name.rpartition("/")[0]
        of_pictures = item.folder_words & (known_names.DEPTH | known_names.COLOR)
        return item.path.parent in own or bool(of_pictures or known_names.ABOUT_FRAMES.search(folders))

    return [item for item in items if not item.level or belongs(item)]


def _by_rank(items: Sequence[ListedFile], of_color: bool = False) -> list[ListedFile]:
    """Files that may hold a camera: the best known names first, those nearest to the folder first among them."""
    found, other = [], r"depth" if of_color else r"colou?r|rgb"
    for item in items:
        rank = next((k for k, name in enumerate(known_names.CAMERAS) if name.fullmatch(item.name)), None)
        if rank is not None and not known_names.NOT_A_CAMERA.search(item.name):
            is_others = rank > 0 and re.search(other, item.name) is not None
            found.append((is_others, rank, item.level, item))
    return [item for *_, item in sorted(found, key=lambda one: one[:3])]


def _in_parents(place: Folder, frames: Sequence[FrameFiles]) -> list[ListedFile]:
    """The same in the folders above, nearest first; then where links lead to, of the folder and of the first frame."""
    found: list[ListedFile] = []
    above = [one for here in places_of(place.path) for one in list(here.parents)[:_PARENTS]]
    if frames and frames[0].depth.is_symlink():
        above += list(followed(frames[0].depth).parents)[: _PARENTS + 1]
    for one in dict.fromkeys(above):
        if one != one.parent:
            items = place.listing.files(one, 0, known_names.CAMERA_SUFFIXES)
            found += [item for item in _by_rank(items) if not known_names.TRANSFORMS.fullmatch(item.name)]
    return found


def _one_each(
    items: Sequence[ListedFile], frames: Sequence[FrameFiles], note: Note, max_pixels: float
) -> list[Intrinsics | None]:
    """Return for each frame the camera in a file of its own; empty if fewer than half of several frames have one."""
    files = own_files(items, frames, known_names.FRAME_CAMERAS, lambda item: known_names.NOT_A_CAMERA.search(item.name))
    try:
        found = [read_intrinsics(path, lambda _: None, max_pixels) if path else None for path in files]
    except (ValueError, OSError):
        return []  # of another kind, such as poses
    if found:
        note(f"each frame has its camera in a file such as {next(path for path in files if path)}")
    return found


def _in_transforms(item: ListedFile, frames: Sequence[FrameFiles], max_pixels: float) -> list[Intrinsics | None]:
    """The frames' own cameras in a transforms.json, where it has them."""
    if not known_names.TRANSFORMS.fullmatch(item.path.name.lower()):
        return []
    entries = read_transforms(item.path, max_pixels)
    named = {Path(name).stem: one.camera for one in entries for name in (one.color, one.depth) if name and one.camera}
    return [named.get((one.color or one.depth).stem, named.get(one.depth.stem)) for one in frames] if named else []


def _by_frame(item: ListedFile, frames: Sequence[FrameFiles], max_pixels: float) -> list[Intrinsics | None]:
    """The frames' own cameras in a JSON that has an object for each, by name or number: ScanNet++, BOP."""
    if item.suffix != ".json" or len(frames) < 2:
        return []
    data = parse_object(read_text(item.path, max_pixels), item.path, max_pixels)
    values = {key_of(name.lower()): one for name, one in data.items() if isinstance(one, dict)}
    if not values:
        return []
    files = [ListedFile(item.path.with_name(key), key) for key in values]
    named = [path.name if path else "" for path in matches([one.key for one in frames], files)]
    found = [from_named(named_of(values.get(name, {})), str(item.path)) for name in named]
    return [one[0] if one else None for one in found] if len(set(named)) > 1 else []


def _of_data_set(
    place: Folder, items: Sequence[ListedFile], frames: Sequence[FrameFiles], note: Note, max_pixels: float
) -> Intrinsics | None:
    """The published camera of a data set that is recognised by the names of its folder and files."""
    folder = place.path
    lists = [item for item in items if not item.level and re.fullmatch(r"(rgb|depth|assoc\w*)\.txt", item.name)]
    heads = [read_text(item.path, max_pixels)[:400] for item in lists]
    names = [item.path.name for item in place.listing.files(folder, 1) if item.suffix in (".freiburg",)]
    names += [item.path.name for item in lists]
    files = [(path, 3) for one in frames[:1] for path in (one.depth, one.color) if path]
    names += ["/".join(one.parts[-most:]) for path, most in [(folder, 2), *files] for one in places_of(path)]
    seen = "\n".join([*names, *heads]).lower()
    first = next((one.depth for one in frames[:9] if one.depth.is_file()), None)  # one may be missing
    size = None if first is None else png_size(first)
    for known in known_names.DATA_SETS:
        is_like = size is not None and known.is_resized and shows_the_same(known.size, size)
        if (size in (None, known.size) or is_like) and re.search(known.known_by, seen):
            numbers = ",".join(f"{number:g}" for number in known.numbers)
            taken = f"its published camera ({numbers}) and {known.depth_scale:g} depth units per metre are taken"
            note(f"no camera is in {folder}, which looks like {known.title}: {taken}")
            return Intrinsics(known.title, known.numbers, known.size, known.depth_scale)
    return None


class FoundPoses(NamedTuple):
    """For each frame (4, 4) camera-to-world in OpenCV axes, unchecked, None without one."""

    poses: Poses
    source: str = ""  # the file that has them
    metric: bool = True  # their unit is the metre; COLMAP's and those that follow from them have any unit


def find_poses(place: Folder, frames: Sequence[FrameFiles], note: Note, max_pixels: float = MAX_PIXELS) -> FoundPoses:
    """The poses of a folder's frames. Raises ValueError for a file that is called like one of poses and holds none."""
    folder, suffixes = place.path, known_names.POSE_SUFFIXES
    items = [*_nearest(_belonging(place, suffixes, frames), frames), *_nearest(_twins(place, suffixes, frames), frames)]
    items = [item for item in items if not known_names.NOT_A_POSE.search(item.name)]
    taken = cache(lambda: {path for one in frames for path in (one.depth, one.color, one.valid)})
    single = own_files(
        items, frames, known_names.FRAME_POSES, lambda item: item.suffix == ".log" or item.path in taken()
    )
    example = next((path for path in single if path), None)
    if example and _holds_a_pose(example, max_pixels):
        first = _named(folder, example)
        note(f"poses are read from files such as {first}")
        listed = [read_poses(path, max_pixels) if path else None for path in single]
        metric = all(one.metric for one in listed if one)
        return FoundPoses([one.poses[0] if one else None for one in listed], first, metric)
    # the best known names of files with the poses of all frames first
    ranked = dict.fromkeys(item for name in known_names.POSES for item in items if name.fullmatch(item.name))
    found = [item for item in ranked if item.path not in taken()]
    for item in found:
        try:
            listed = read_poses(item.path, max_pixels)
        except ValueError:
            if known_names.MAY_HOLD_POSES.fullmatch(item.name):
                continue
            raise
        poses = match_poses(item.path, listed, frames, note)
        if poses is None:
            note(f"{item.path} has {len(listed.poses)} poses for {len(frames)} frames: it is not used")
        else:
            also = [_named(folder, other.path) for other in found if other is not item][:3]
            note(f"poses are read from {_named(folder, item.path)}" + (f", not from {', '.join(also)}" if also else ""))
            return FoundPoses(poses, _named(folder, item.path), listed.metric)
    return FoundPoses([None] * len(frames))


def _named(folder: Path, path: Path) -> str:
    return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else str(path)


def _holds_a_pose(path: Path, max_pixels: float) -> bool:
    """Whether it is a file with one pose, and not of another kind, such as a camera."""
    try:
        return len(read_poses(path, max_pixels).poses) == 1
    except ValueError:
        return False


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
    """Return the poses of the frames of a source, from a file that lies anywhere, assigned as those of a folder's file.

    A pose by the name of the source, as for a camera among several that stand still, is that of all frames. Raises
    ValueError if it is unclear which pose belongs to which frame, OSError for a file that cannot be read.
    """
    path = check_path(path)
    found = read_poses(path, max_pixels)
    names = found.names or []
    stems = {Path(name).stem for name in names}
    own = None if all(one.depth.stem in stems for one in frames) else _by_names(names, [source])
    if own is not None:
        return FoundPoses([found.poses[own[0]]] * len(frames), str(path), found.metric)
    if (poses := match_poses(path, found, frames, note)) is None:
        got = f"{path} holds {_counted(found)}, and {source} has {counted(len(frames), 'frame')}"
        raise ValueError(f"{got}: expected one for each, by name, time stamp, number or order")
    if len(frames) == 1 and found.names is found.numbers is None:
        note_alone(path, note)
    return FoundPoses(poses, str(path), found.metric)


def poses_of_inputs(
    path: FilePath, inputs: Sequence[FilePath], max_pixels: float = MAX_PIXELS
) -> list[NDArray[np.float64]]:
    """Return (4, 4) camera-to-world for each of several inputs: by its name if the file has names, else in order.
    Raises ValueError for another number of poses, OSError for a file that cannot be read."""
    path = check_path(path)
    found = read_poses(path, max_pixels)
    if found.names is not None:
        places = _by_names(found.names, inputs)
    else:
        places = range(len(inputs)) if len(inputs) == len(found.poses) else None
    if places is None:
        expected = f"expected one for each of {len(inputs)} INPUTs: {', '.join(map(str, inputs))}"
        raise ValueError(f"{path} holds {_counted(found)}, {expected}")
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
