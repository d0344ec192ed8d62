"""Reads camera poses from a file of any form: quaternions, matrices, JSON, COLMAP. The content decides which it is.

A new form is a reader in `read_poses`; names that say what a matrix is are in pose_key_names.py. Each gives
poses camera-to-world in OpenCV axes as the form defines them; what a file means in truth is checked against the depth
(pose_convention.py).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...notes.words import shown
from ...scene.camera import check_pose, from_matrices, from_quaternions, inverted
from ..access.content import MATLAB, FilePath, parse_json, read_head, read_text
from ..access.limits import MAX_PIXELS
from ..arrays.array_files import NUMPY, read_npy, read_numbers
from ..arrays.sintel import SINTEL, read_cam
from ..cameras.colmap_model import read_colmap_images
from .pose_key_names import PoseList, from_json, from_text, from_words

WRITTEN = "# pointshade_gl: number"  # with this the files begin that this package writes, in TUM's form
_COLUMNS = 64  # of a row, at most


def load_pose(path: FilePath) -> NDArray[np.float64]:
    """(4, 4) camera-to-world, OpenCV axes, from a file of numbers as for `pose_of`. Raises OSError or ValueError."""
    return pose_of(read_numbers(path), str(path))


def pose_of(numbers: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    """(4, 4) camera-to-world from 16 or 12 numbers of a matrix, row by row, or from tx ty tz qx qy qz qw, which a time
    stamp may precede. Raises ValueError, naming it, for anything else.
    """
    if numbers.size in (12, 16):
        return check_pose(from_matrices(numbers.reshape(1, -1))[0], name)
    if numbers.size not in (7, 8):
        raise ValueError(
            f"{name} must hold a matrix of 4x4 or 3x4, or tx ty tz qx qy qz qw, got {numbers.size} numbers"
        )
    place, turn = numbers[None, -7:-4], numbers[None, -4:]
    if not abs(np.linalg.norm(turn) - 1) < 0.01:
        raise ValueError(f"{name} must end with qx qy qz qw of length 1, got {shown(turn[0].tolist())}")
    return check_pose(from_quaternions(place, turn)[0], name)


def read_poses(path: Path, max_pixels: float = MAX_PIXELS) -> PoseList:
    """All poses of a file. Raises ValueError, naming the file, if it holds none."""
    head = read_head(path)
    if head.startswith(MATLAB):
        from ..arrays.matlab import read_matrix_mat  # only here

        arrays = {name: array.ravel().tolist() for name, array in read_matrix_mat(path, max_pixels).items()}
        return _checked(from_words(arrays), path, "arrays of other kinds")
    if head.startswith(NUMPY):
        array = read_npy(path, max_pixels)
        columns = array.shape[-2] * array.shape[-1] if array.ndim > 1 else 1
        found = _from_rows(array.astype(np.float64).reshape(-1, columns))
        return _checked(found, path, f"an array of shape {array.shape}")
    if head.startswith(SINTEL):
        return PoseList(inverted(read_cam(path, max_pixels)[1][None]))
    if path.suffix.lower() == ".bin":
        return PoseList(*read_colmap_images(path, max_pixels), metric=False)
    text = read_text(path, max_pixels)
    if text.lstrip()[:1] in ("{", "["):
        try:
            data = parse_json(text, max_pixels)
        except ValueError as error:
            raise ValueError(f"{path} {error}") from None
        return _checked(from_json(data, path, max_pixels), path, "JSON without poses")
    if (found := _from_colmap(text) or _from_named_rows(text)) is not None:
        return found
    header, rows = _read_rows(text)
    if text.startswith(WRITTEN) and rows is not None and rows.shape[1] == 8 and np.abs(rows[:, 0]).max() < 2**31:
        return PoseList(from_quaternions(rows[:, 1:4], rows[:, 4:]), numbers=rows[:, 0].astype(int).tolist())
    found = (_from_header(header, rows) or _from_rows(rows)) if rows is not None else None
    found = found or _from_blocks(text) or from_text(text, path)
    return _checked(found, path, "a text" if rows is None else f"rows of {rows.shape[1]} numbers")


def _checked(found: PoseList | None, path: Path, got: str) -> PoseList:
    if found is None or not len(found.poses):
        raise ValueError(
            f"{path} holds no poses: expected t x y z qx qy qz qw, or a matrix of 3x4 or 4x4, for each frame, got {got}"
        )
    return found


def _read_rows(text: str) -> tuple[list[str], NDArray[np.float64] | None]:
    """The names in the first line, if it has names, and (n, columns) the numbers; None if rows differ in length."""
    lines = [line for line in (line.split("#")[0].replace(",", " ").split() for line in text.splitlines()) if line]
    header = lines.pop(0) if lines and not _all_numbers(lines[0][:_COLUMNS]) else []
    if not lines or len({len(line) for line in lines}) != 1 or len(lines[0]) > _COLUMNS:
        return header, None
    lines = [line for line in lines if _all_numbers(line)]
    return header, np.array(lines, np.float64) if lines else None


def _all_numbers(words: list[str]) -> bool:
    try:
        return bool([float(word) for word in words])
    except ValueError:
        return False


def _from_header(header: list[str], rows: NDArray[np.float64]) -> PoseList | None:
    """A table whose columns have names, such as StrayScanner's odometry.csv: timestamp, frame, x, ..., qw."""
    columns = {re.sub(r"[^a-z0-9]", "", name.lower()): k for k, name in enumerate(header)}
    place = [columns.get(f"t{axis}", columns.get(axis, columns.get(f"p{axis}"))) for axis in "xyz"]
    turn = [columns.get(f"q{axis}") for axis in "xyzw"]
    if None in place or None in turn or len(header) != rows.shape[1]:
        return None
    poses = from_quaternions(rows[:, place], rows[:, turn])  # type: ignore[index]
    named = columns.get("frame", columns.get("index", columns.get("id")))
    names = None if named is None else [f"{number:.0f}" for number in rows[:, named]]
    time = columns.get("timestamp", columns.get("time"))
    return PoseList(poses, names, None if time is None else rows[:, time])


def _from_rows(rows: NDArray[np.float64]) -> PoseList | None:
    """A row for each pose: its length says which form it has."""
    columns = rows.shape[1]
    if columns == 8 or (columns == 9 and _are_turns(rows[:, 4:8])):  # RTAB-Map adds the number of a node
        return PoseList(from_quaternions(rows[:, 1:4], rows[:, 4:8]), None, rows[:, 0])
    if columns == 7:
        return _from_seven(rows)
    if columns in (13, 17):
        return PoseList(from_matrices(rows[:, 1:]), [f"{number:.0f}" for number in rows[:, 0]], rows[:, 0])
    if columns in (12, 16):
        return PoseList(from_matrices(rows))
    if columns == 18:  # Virtual KITTI: frame, camera, world-to-camera
        rows = rows[rows[:, 1] == rows[0, 1]]
        return PoseList(inverted(from_matrices(rows[:, 2:])), [f"{number:.0f}" for number in rows[:, 0]])
    if columns == 4:
        is_square = len(rows) % 4 == 0 and (len(rows) % 3 or (rows[3::4, :3] == 0).all())
        side = 16 if is_square else 12
        return PoseList(from_matrices(rows.reshape(-1, side))) if rows.size % side == 0 else None
    return None


@np.errstate(all="ignore")
def _are_turns(rows: NDArray[np.float64]) -> bool:
    """Whether these are quaternions: their length is 1."""
    return bool(np.median(abs(np.linalg.norm(rows, axis=1) - 1)) < 0.01)


def _from_seven(rows: NDArray[np.float64]) -> PoseList:
    """x y z qx qy qz qw; qw qx qy qz x y z (Washington); or t, turn about an axis, x y z (ARKit: world-to-camera)."""
    if _are_turns(rows[:, 3:]):
        return PoseList(from_quaternions(rows[:, :3], rows[:, 3:]))
    if _are_turns(rows[:, :4]):
        return PoseList(from_quaternions(rows[:, 4:], rows[:, [1, 2, 3, 0]]))
    angles = np.linalg.norm(rows[:, 1:4], axis=1, keepdims=True)
    axes = rows[:, 1:4] / np.maximum(angles, 1e-12)
    turns = np.hstack([axes * np.sin(angles / 2), np.cos(angles / 2)])
    return PoseList(inverted(from_quaternions(rows[:, 4:], turns)), None, rows[:, 0])


def _from_blocks(text: str) -> PoseList | None:
    """Open3D's and 3DMatch's log: three numbers, then a 4x4 matrix, for each pose."""
    numbers = re.sub(r"#[^\n]*", "", text).replace(",", " ").split()
    if not numbers or len(numbers) % 19 or not _all_numbers(numbers):
        return None
    rows = np.array(numbers, np.float64).reshape(-1, 19)
    return PoseList(rows[:, 3:].reshape(-1, 4, 4))


def _from_colmap(text: str) -> PoseList | None:
    """COLMAP's images.txt: `id qw qx qy qz tx ty tz camera name`, world-to-camera, and a line of points after each."""
    lines = [line.split() for line in text.splitlines() if line.strip() and not line.startswith("#")]
    lines = [words for words in lines if len(words) == 10 and _all_numbers(words[:9]) and not _all_numbers(words[9:])]
    if not lines:
        return None
    rows = np.array([words[1:8] for words in lines], np.float64)
    poses = inverted(from_quaternions(rows[:, 4:], rows[:, [1, 2, 3, 0]]))
    return PoseList(poses, [words[9] for words in lines], metric=False)


def _from_named_rows(text: str) -> PoseList | None:
    """Lines of one or more pictures' names and a matrix: Matterport3D's `scan depth.png color.jpg 1 0 0 ...`."""
    names, rows = [], []
    for line in text.splitlines():
        words = line.split()
        if len(words) > 16 and re.fullmatch(r".*\.(png|jpe?g)", words[-17].lower()) and _all_numbers(words[-16:]):
            names.append(words[-17])
            rows.append([float(number) for number in words[-16:]])
    return PoseList(from_matrices(np.array(rows)), names) if rows else None
