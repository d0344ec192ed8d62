"""Reads camera poses from a file of any form, and finds out which convention they follow."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import shown
from ...scene.camera import AXES, OPENGL, Camera, Matrices, check_pose, from_matrices, from_quaternions, inverted
from ...scene.frame import Frame
from ..access.content import MATLAB, MAX_PIXELS, FilePath, parse_json, read_head, read_text
from ..arrays.named_numbers import named_of, read_named
from ..arrays.numpy_files import NUMPY, SINTEL, read_cam, read_npy, read_numbers
from .camera_files import read_colmap_images, read_transforms
from .intrinsics import word

_IN_LIST = re.compile(r"\.\d+\.")  # one of several values, such as the objects that a camera sees
_TO_WORLD = ("cameraposearframe", "alignedpose", "camerapose", "pose", "cam2world", "c2w", "transformmatrix")
_TO_CAMERA = (  # cameraviewtransform: Omniverse's; camerartmatrix: 2D-3D-S'
    "cameraviewtransform", "camerartmatrix", "extrinsic", "extrinsics", "w2c", "rotationtranslationmatrix",
)  # fmt: skip
_OF_OPENGL = ("cameraposearframe", "transformmatrix", "cameraviewtransform")  # in its axes


class PoseList(NamedTuple):
    """The poses of a file in its order, and what assigns them to frames: names or time stamps, or neither."""

    poses: Matrices
    names: list[str] | None = None
    times: NDArray[np.float64] | None = None
    metric: bool = True  # their unit is the metre; structure from motion has any unit
    numbers: list[int] | None = None  # of the frames in their folder, counted from 0, in a file that this package wrote


@np.errstate(invalid="ignore", over="ignore")  # poses are checked later
def from_json(data: Any, path: Path, max_pixels: float) -> PoseList | None:
    if isinstance(data, dict) and "frames" in data:
        entries = read_transforms(path, max_pixels)
        names = [entry.color or entry.depth or "" for entry in entries]
        return PoseList(np.array([entry.pose for entry in entries]).reshape(-1, 4, 4), names, metric=False)
    for read in _JSON:
        try:
            found = read(named_of(data) if read in (from_words, _from_bop) else data)
        except (KeyError, TypeError, ValueError, OverflowError):
            continue
        if found is not None:
            return found
    return None


def _from_parameters(data: Any) -> PoseList | None:
    """Open3D's camera parameters, world-to-camera, and its PoseGraph, camera-to-world; matrices are by columns."""
    if "extrinsic" in data:
        data = {"parameters": [data]}
    if "parameters" in data:
        rows = np.array([one["extrinsic"] for one in data["parameters"]], np.float64)
        return PoseList(inverted(rows.reshape(-1, 4, 4).transpose(0, 2, 1)))
    if "nodes" in data:
        rows = np.array([one["pose"] for one in data["nodes"]], np.float64)
        return PoseList(rows.reshape(-1, 4, 4).transpose(0, 2, 1))
    return None


def _from_record3d(data: Any) -> PoseList | None:
    """Record3D's metadata: qx qy qz qw x y z of each frame, camera-to-world in ARKit's axes."""
    if not isinstance(data, dict) or not {"poses", "w", "h"} <= data.keys():
        return None
    rows = np.array(data["poses"], np.float64).reshape(-1, 7)
    return PoseList(from_quaternions(rows[:, 4:], rows[:, :4]) @ OPENGL)


def _from_cells(data: Any) -> PoseList | None:
    """Polycam's camera of one frame: t_00 to t_23, camera-to-world in ARKit's axes."""
    if "t_00" not in data:
        return None
    cells = [data[f"t_{row}{column}"] for row in range(3) for column in range(4)]
    return PoseList(from_matrices(np.array([cells], np.float64)) @ OPENGL)


def _from_bop(named: Mapping[str, list[float]]) -> PoseList | None:
    """BOP's scene_camera.json and T-LESS' info.yml: world-to-camera, millimetres, by number."""
    turned = [name.rpartition(".")[0] for name, part in named.items() if word(name) == "camrw2c" and len(part) == 9]
    pairs = {group: (named[f"{group}.cam_R_w2c"], named.get(f"{group}.cam_t_w2c", ())) for group in turned}
    pairs = {group: pair for group, pair in pairs.items() if len(pair[1]) == 3}
    if not pairs:
        return None
    turns = np.array([turn for turn, _ in pairs.values()], np.float64).reshape(-1, 3, 3)
    places = np.array([place for _, place in pairs.values()], np.float64).reshape(-1, 3, 1) / 1000
    return PoseList(inverted(from_matrices(np.concatenate([turns, places], 2).reshape(-1, 12))), list(pairs))


def _from_nerfies(data: Any) -> PoseList | None:
    """Nerfies' camera of one frame: the turn is world-to-camera, the position is the camera's."""
    if not {"orientation", "position"} <= data.keys():
        return None
    turn = np.array(data["orientation"], np.float64).reshape(3, 3).T
    place = np.array(data["position"], np.float64).reshape(3, 1)
    return PoseList(from_matrices(np.hstack([turn, place]).reshape(1, 12)), metric=False)


def _by_frame(data: Any) -> PoseList | None:
    """An object for each frame, by its name, with a pose in it: ScanNet++."""
    found = {name: from_words(named_of(one)) for name, one in data.items() if isinstance(one, dict)}
    poses = {name: one.poses[0] for name, one in found.items() if one is not None}
    return PoseList(np.array([*poses.values()]), [*poses]) if len(poses) > 1 else None


def _from_named_matrices(data: Any) -> PoseList | None:
    """A matrix by the name of each frame, or a list of matrices; `pose` and `w2c` are no names of frames."""
    names = list(data) if isinstance(data, dict) else None
    if names is not None and not {*_TO_WORLD, *_TO_CAMERA}.isdisjoint(map(word, names)):
        return None
    rows = np.array(data if names is None else list(data.values()), np.float64).reshape(len(data), -1)
    return PoseList(from_matrices(rows), names) if rows.shape[1] in (12, 16) else None


def from_words(named: Mapping[str, list[float]]) -> PoseList | None:
    """Read one matrix among other values of a frame, by a name that is known; the first of the table wins."""
    own = {name: numbers for name, numbers in named.items() if len(numbers) in (12, 16)}
    own = {name: numbers for name, numbers in own.items() if not _IN_LIST.search(name)} or own
    numbers = {word(name): numbers for name, numbers in reversed(own.items())}
    key = next((key for key in (*_TO_WORLD, *_TO_CAMERA) if key in numbers), None)
    if key is None:
        return None
    pose = from_matrices(np.array([numbers[key]], np.float64))
    if not pose[0, :3, 3].any() and pose[0, 3, :3].any():  # programs that multiply from the left write it so
        pose = pose.transpose(0, 2, 1)
    pose = pose if key in _TO_WORLD else inverted(pose)
    return PoseList(pose @ OPENGL if key in _OF_OPENGL else pose)


_JSON = (
    _from_parameters, _from_record3d, _from_cells, _from_bop, _from_named_matrices, _from_nerfies, _by_frame,
    from_words,
)  # fmt: skip
WRITTEN = "# pointshade_gl: number"  # with this the files begin that this package writes, in TUM's form
_COLUMNS = 64  # of a row, at most


def load_pose(path: FilePath) -> NDArray[np.float64]:
    """(4, 4) camera-to-world, OpenCV axes, from a file of numbers as for `pose_of`. Raises OSError or ValueError."""
    return pose_of(read_numbers(path), str(path))


def note_alone(path: FilePath, note: Note) -> None:
    """A note that the axes of a single pose are a guess: only views that overlap show what poses mean."""
    turned = "where y is up (OpenGL) turn it: pose @ diag(1, -1, -1, 1)"
    taken = "one pose is taken as x right, y down, z forward, camera to world unless its name tells"
    note(f"{path}: {taken}, which nothing shows; {turned}")


def pose_of(numbers: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    """(4, 4) camera-to-world from a matrix of 16 or 12 numbers, row by row, or from [time] tx ty tz qx qy qz qw. Raises
    ValueError, with the name, for anything else."""
    if numbers.size in (12, 16):
        return check_pose(from_matrices(numbers.reshape(1, -1))[0], name)
    if numbers.size not in (7, 8):
        expected = "a matrix of 4x4 or 3x4, or tx ty tz qx qy qz qw"
        raise ValueError(f"{name} must hold {expected}, got {numbers.size} numbers")
    place, turn = numbers[None, -7:-4], numbers[None, -4:]
    if not abs(np.linalg.norm(turn) - 1) < 0.01:
        raise ValueError(f"{name} must end with qx qy qz qw of length 1, got {shown(turn[0].tolist())}")
    return check_pose(from_quaternions(place, turn)[0], name)


def read_poses(path: Path, max_pixels: float = MAX_PIXELS) -> PoseList:
    """All poses of a file. Raises ValueError, naming the file, if it holds none."""
    head = read_head(path)
    if head.startswith(MATLAB):
        from ..arrays.matlab import read_matrix_mat  # only here

        return _checked(from_words(read_matrix_mat(path, max_pixels)), path, "arrays of other kinds")
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
        data = parse_json(text, max_pixels, path)
        return _checked(from_json(data, path, max_pixels), path, "JSON without poses")
    if (found := _from_colmap(text) or _from_named_rows(text)) is not None:
        return found
    header, rows = _read_rows(text)
    if text.startswith(WRITTEN) and rows is not None and rows.shape[1] == 8 and np.abs(rows[:, 0]).max() < 2**31:
        return PoseList(from_quaternions(rows[:, 1:4], rows[:, 4:]), numbers=rows[:, 0].astype(int).tolist())
    found = (_from_header(header, rows) or _from_rows(rows)) if rows is not None else None
    found = found or _from_blocks(text)
    if found is None:  # numbers with names: MVSNet's `extrinsic`, in any unit, above its matrix, T-LESS' info.yml
        named = read_named(text, path)
        with np.errstate(invalid="ignore", over="ignore"):  # poses are checked later
            found = _from_bop(named) or from_words(named)
        found = found and found._replace(metric="extrinsic" not in named)
    return _checked(found, path, "a text" if rows is None else f"rows of {rows.shape[1]} numbers")


def _checked(found: PoseList | None, path: Path, got: str) -> PoseList:
    if found is None or not len(found.poses):
        expected = "expected t x y z qx qy qz qw, or a matrix of 3x4 or 4x4, for each frame"
        raise ValueError(f"{path} holds no poses: {expected}, got {got}")
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

    def column(*names: str) -> int | None:
        return next((columns[name] for name in names if name in columns), None)

    place = [column(f"t{axis}", axis, f"p{axis}") for axis in "xyz"]
    turn = [column(f"q{axis}") for axis in "xyzw"]
    if None in place or None in turn or len(header) != rows.shape[1]:
        return None
    poses = from_quaternions(rows[:, place], rows[:, turn])  # type: ignore[index]
    named, time = column("frame", "index", "id"), column("timestamp", "time")
    return PoseList(poses, None if named is None else _numbers(rows, named), None if time is None else rows[:, time])


def _numbers(rows: NDArray[np.float64], column: int = 0) -> list[str]:
    """Whole numbers by which frames are named."""
    return [f"{number:.0f}" for number in rows[:, column]]


def _from_rows(rows: NDArray[np.float64]) -> PoseList | None:
    """A row for each pose: its length shows which form it has."""
    columns = rows.shape[1]
    if columns == 8 or (columns == 9 and _are_turns(rows[:, 4:8])):  # RTAB-Map adds the number of a node
        return PoseList(from_quaternions(rows[:, 1:4], rows[:, 4:8]), None, rows[:, 0])
    if columns == 7:
        return _from_seven(rows)
    if columns in (13, 17):
        return PoseList(from_matrices(rows[:, 1:]), _numbers(rows), rows[:, 0])
    if columns in (12, 16):
        return PoseList(from_matrices(rows))
    if columns == 18:  # Virtual KITTI: frame, camera, world-to-camera
        rows = rows[rows[:, 1] == rows[0, 1]]
        return PoseList(inverted(from_matrices(rows[:, 2:])), _numbers(rows))
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
    return PoseList(np.array(numbers, np.float64).reshape(-1, 19)[:, 3:].reshape(-1, 4, 4))


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


_SURE = 0.005  # of the depth, in the median: no other reading can be much better
AGREES = 0.03  # poses off by a few centimetres, noise of sensors
FAILS = 0.08
_BETTER = 0.4  # another reading must leave less than this share of the error
_POINTS = 4000  # of a view
_SEEN = 0.15  # of them must lie in the other view
_MOVED = 0.01  # poses that differ by less do not distinguish one reading from another
_SCALES = (1 / 5, 1000 / 6553.5, 1 / 4, 1 / 10, 1000 / 256, 10.0)  # of depth taken as millimetres: 5000, 6553.5, ...


@dataclass(frozen=True)
class Reading:
    """How poses and cameras are to be understood: as they are written, or in another convention that programs use."""

    to_world: bool = True  # the pose is camera-to-world
    axes: str = "opencv"  # of the camera that the pose means, one of AXES
    mirrored: bool = False  # fy has the other sign
    scale: float = 1.0  # the depth is to be multiplied by this
    pose_scale: float = 1.0  # the places of the poses are to be multiplied by this

    def pose(self, pose: NDArray[np.float64]) -> NDArray[np.float64]:
        """Convert a pose as it is written to (4, 4) camera-to-world in OpenCV axes."""
        pose = (pose if self.to_world else inverted(pose[None])[0]) @ AXES[self.axes]
        pose[:3, 3] *= self.pose_scale
        return pose

    def camera(self, camera: Camera) -> Camera:
        return replace(camera, fy=-camera.fy) if self.mirrored else camera

    def __str__(self) -> str:
        changes = {
            "poses lead from the world to the camera": not self.to_world,
            f"the poses' cameras have the axes of {self.axes}": self.axes != "opencv",
            "fy is negative": self.mirrored,
            f"a metre has {1000 / self.scale:g} depth units": self.scale != 1,
            f"the poses are {self.pose_scale:.4g} times as large": self.pose_scale != 1,
        }
        return ", ".join(text for text, is_made in changes.items() if is_made) or "as written"


class Finding(NamedTuple):
    """The reading under which the views agree best, and the median error of both as a share of the depth."""

    reading: Reading
    error: float
    error_as_written: float


def find_reading(frames: Sequence[Frame], may_scale: bool, metric_poses: bool) -> Finding | None:
    """Return how the poses of a few overlapping frames are to be understood; None if they do not show it.

    may_scale     the units of the depth were guessed, so that another scale may be right
    metric_poses  the unit of the poses is the metre; else it is fitted to the depth
    """
    with np.errstate(invalid="ignore"):  # of poses that are not finite
        pairs = [(a, b) for a, b in pairwise(frames) if _MOVED < abs(a.pose - b.pose).max() < np.inf]
    if not pairs:
        return None
    written = _error(pairs, Reading())
    if written < _SURE:
        return Finding(Reading(), written, written)
    scales = (1.0, *_SCALES) if may_scale and metric_poses else (1.0,)
    choices = product(scales, (False, True), AXES, (True, False))  # those with the fewest changes first
    readings = [Reading(to_world, axes, mirrored, scale) for scale, mirrored, axes, to_world in choices]
    errors = [(_error(pairs, one), one) for one in readings]
    least = min(error for error, _ in errors)
    # of those that fit alike the one with the fewest changes
    error, best = next((error, one) for error, one in errors if error <= 1.1 * least)
    if error > AGREES and not metric_poses:
        error, best = _fit_pose_scale(pairs)
    if error < AGREES and error < _BETTER * written:
        return Finding(best, error, written)
    return Finding(Reading(), written, written) if written < 1 else None


def _fit_pose_scale(pairs: Sequence[tuple[Frame, Frame]]) -> tuple[float, Reading]:
    """Return the error of the reading that fits best with a factor on the positions of the poses, and that reading."""
    readings = [Reading(to_world, axes) for axes in AXES for to_world in (True, False)]
    step = 1.25
    for smaller, larger in ((37, 18), (6, 6), (6, 6), (6, 6)):  # 1/3850 (millimetres) to 55 times, then finer and finer
        factors = [step**k for k in range(-smaller, larger + 1)]
        tried = [replace(one, pose_scale=one.pose_scale * factor) for one in readings for factor in factors]
        error, best = min(((_error(pairs, one), one) for one in tried), key=lambda found: found[0])
        readings, step = [best], step ** (1 / 5)
    return error, best


def _error(pairs: Sequence[tuple[Frame, Frame]], reading: Reading) -> float:
    return float(np.mean([_error_of(a, b, reading) for a, b in pairs]))


def _error_of(a: Frame, b: Frame, reading: Reading) -> float:
    """Return the median difference of the depths where both see the same, share of the depth; 1 without overlap."""
    step = max(1, int((a.depth.size / _POINTS) ** 0.5))
    v, u = np.mgrid[0 : a.depth.shape[0] : step, 0 : a.depth.shape[1] : step]
    z = a.depth[::step, ::step] * reading.scale
    u, v, z = (part[z > 0] for part in (u, v, z))
    from_camera, to_camera = reading.camera(a.camera), reading.camera(b.camera)
    x, y = from_camera.ray_at(u, v)
    relative = inverted(reading.pose(b.pose)[None])[0] @ reading.pose(a.pose)
    x, y, far = relative[:3, :3] @ np.array([x * z, y * z, z]) + relative[:3, 3:]
    with np.errstate(all="ignore"):
        column, row = (np.rint(part) for part in to_camera.pixel_at(x, y, far))
        inside = (far > 0) & (column >= 0) & (column < to_camera.width) & (row >= 0) & (row < to_camera.height)
    there = b.depth[row[inside].astype(int), column[inside].astype(int)] * reading.scale
    known = there > 0
    if known.sum() < _SEEN * len(z):
        return 1.0
    return float(min(1.0, np.median(abs(far[inside][known] / there[known] - 1))))
