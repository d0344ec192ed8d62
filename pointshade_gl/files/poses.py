"""The poses of a sequence, from the files that TUM, Open3D and nerfstudio write."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..camera import check_pose
from ..notes import Note
from ..wording import shown
from .arrays import read_numbers
from .content import FilePath, parse_object, read_text
from .folders import Pair, nearest
from .limits import MAX_PIXELS

CLOSE = 0.02  # seconds between a picture and its pose, as in the TUM benchmark's own tools
OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])  # y up and z backwards, to ours and back
Poses = list[NDArray[np.float64] | None]


def load_pose(path: FilePath) -> NDArray[np.float64]:
    """(4, 4) camera-to-world from a text file of 16 numbers, a JSON list or .npy; OpenCV axes.

    Raises OSError if the path is not a file, ValueError if it does not hold a pose.
    """
    numbers = read_numbers(path)
    if numbers.size != 16:
        raise ValueError(f"{path} must hold a 4x4 matrix, got {numbers.size} numbers")
    return check_pose(numbers.reshape(4, 4), str(path))


def find_poses(folder: Path, pairs: Sequence[Pair], note: Note, max_pixels: float = MAX_PIXELS) -> Poses:
    """For each frame (4, 4) camera-to-world in OpenCV axes, unchecked; None where the folder says nothing.

    Reads groundtruth.txt or poses_tum.txt (t x y z qx qy qz qw), trajectory.log (Open3D) or transforms.json
    (nerfstudio). Raises ValueError for a file with another content.
    """
    readers = {
        "groundtruth.txt": _from_tum,
        "poses_tum.txt": _from_tum,
        "trajectory.log": _from_log,
        "transforms.json": _from_transforms,
    }
    found = [folder / name for name in readers if (folder / name).is_file()]
    if not found:
        return [None] * len(pairs)
    if len(found) > 1:
        note(f"{folder} has poses in {', '.join(path.name for path in found)}: {found[0].name} is taken")
    return readers[found[0].name](found[0], pairs, note, max_pixels)


def _from_tum(path: Path, pairs: Sequence[Pair], note: Note, max_pixels: float) -> Poses:
    rows = _rows(path, 8, "t x y z qx qy qz qw", max_pixels)
    times = np.array([pair.time for pair in pairs if pair.time is not None])
    if len(times) < len(pairs) or times.max() < rows[:, 0].min() or times.min() > rows[:, 0].max():
        return [_from_quaternion(row[1:]) for row in rows] if _fit(path, rows, pairs, note) else [None] * len(pairs)
    near = nearest(times, rows[:, 0])
    far = int(np.count_nonzero(np.abs(rows[near, 0] - times) > CLOSE))
    if far:
        note(f"{path}: {far} of {len(pairs)} pictures have no pose within {CLOSE:g} s and get the nearest")
    return [_from_quaternion(rows[i, 1:]) for i in near]


def _from_log(path: Path, pairs: Sequence[Pair], note: Note, max_pixels: float) -> Poses:
    rows = _rows(path, 19, "three numbers and a 4x4 matrix", max_pixels)
    return list(rows[:, 3:].reshape(-1, 4, 4)) if _fit(path, rows, pairs, note) else [None] * len(pairs)


def _from_transforms(path: Path, pairs: Sequence[Pair], note: Note, max_pixels: float) -> Poses:
    frames = parse_object(read_text(path, max_pixels), path, max_pixels).get("frames", [])
    if not isinstance(frames, list):
        raise ValueError(f"{path}: frames must be a list, got {shown(frames)}")
    poses: dict[str, NDArray[np.float64]] = {}
    for entry in frames:
        matrix = _matrix(entry, path) @ OPENGL
        names = (entry.get(key) for key in ("file_path", "depth_file_path"))
        poses |= {Path(name).stem: matrix for name in names if isinstance(name, str)}
    result = [poses.get(pair.depth.stem, poses.get((pair.color or pair.depth).stem)) for pair in pairs]
    unnamed = sum(pose is None for pose in result)
    if unnamed:
        note(f"{path} has no pose for {unnamed} of {len(pairs)} pictures: they stay at the origin")
    return result


def _fit(path: Path, rows: NDArray[np.float64], pairs: Sequence[Pair], note: Note) -> bool:
    """Whether there is one pose for each frame."""
    if len(rows) == len(pairs):
        return True
    note(f"{path} has {len(rows)} poses for {len(pairs)} frames: it is not used")
    return False


def _rows(path: Path, columns: int, what: str, max_pixels: float) -> NDArray[np.float64]:
    numbers = read_numbers(path, max_pixels)
    if not numbers.size or numbers.size % columns:
        raise ValueError(f"{path} must hold {what} for each pose, got {numbers.size} numbers")
    return numbers.reshape(-1, columns)


def _matrix(entry: Any, path: Path) -> NDArray[np.float64]:
    try:
        return np.asarray(entry["transform_matrix"], np.float64).reshape(4, 4)
    except (KeyError, TypeError, ValueError, OverflowError):
        raise ValueError(f"{path}: every frame must have a transform_matrix of 4x4 numbers") from None


@np.errstate(invalid="ignore", over="ignore")  # (0, 0, 0, 0) becomes NaN, which the check of poses refuses
def _from_quaternion(row: NDArray[np.float64]) -> NDArray[np.float64]:
    """(4, 4) from x y z qx qy qz qw."""
    x, y, z, w = row[3:] / np.linalg.norm(row[3:])
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    pose[:3, 3] = row[:3]
    return pose
