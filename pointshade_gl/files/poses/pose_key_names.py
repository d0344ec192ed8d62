"""Reads poses by the names of their numbers: JSON of Open3D, BOP, Polycam, nerfstudio and others, and texts.

A new word is a row of _POSE_WORDS, a form of its own a reader in `from_json`.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...scene.camera import OPENGL, Matrices, from_matrices, inverted
from ..arrays.named_numbers import Named, named_of, read_named
from ..cameras.camera_key_names import word
from ..cameras.transforms_json import read_transforms

_IN_LIST = re.compile(r"\.\d+\.")  # one of several values, such as the objects that a camera sees
_POSE_WORDS = {  # whether it leads to the world, and whether its camera has OpenGL's axes
    "cameraposearframe": (True, True),
    "alignedpose": (True, False),
    "camerapose": (True, False),
    "pose": (True, False),
    "cam2world": (True, False),
    "c2w": (True, False),
    "transformmatrix": (True, True),
    "cameraviewtransform": (False, True),  # Omniverse
    "camerartmatrix": (False, False),  # 2D-3D-S
    "extrinsic": (False, False),
    "extrinsics": (False, False),
    "w2c": (False, False),
    "rotationtranslationmatrix": (False, False),
}


class PoseList(NamedTuple):
    """The poses of a file in its order, and what says to which frames they belong: names or time stamps, or neither.

    metric   their unit is the metre; structure from motion has any unit
    numbers  of the frames in their folder, counted from 0, in a file that this package wrote
    """

    poses: Matrices
    names: list[str] | None = None
    times: NDArray[np.float64] | None = None
    metric: bool = True
    numbers: list[int] | None = None


@np.errstate(invalid="ignore", over="ignore")  # poses are checked later
def from_text(text: str, path: Path) -> PoseList | None:
    """Numbers with names: MVSNet's `extrinsic` above its matrix, T-LESS' info.yml. MVSNet's have any unit."""
    named = read_named(text, path)
    found = _from_bop(named) or from_words(named)
    return found._replace(metric="extrinsic" not in named) if found else None


@np.errstate(invalid="ignore", over="ignore")  # poses are checked later
def from_json(data: Any, path: Path, max_pixels: float) -> PoseList | None:
    if isinstance(data, dict) and "frames" in data:
        entries = read_transforms(path, max_pixels)
        names = [entry.color or entry.depth or "" for entry in entries]
        return PoseList(np.array([entry.pose for entry in entries]).reshape(-1, 4, 4), names, metric=False)
    for read in (_from_parameters, _from_cells, _from_bop, _from_named_matrices, _from_nerfies, _by_frame, from_words):
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


def _from_cells(data: Any) -> PoseList | None:
    """Polycam's camera of one frame: t_00 to t_23, camera-to-world in ARKit's axes."""
    if "t_00" not in data:
        return None
    pose = np.eye(4)
    pose[:3] = [[data[f"t_{row}{column}"] for column in range(4)] for row in range(3)]
    return PoseList((pose @ OPENGL)[None])


def _from_bop(named: Named) -> PoseList | None:
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
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.array(data["orientation"], np.float64).reshape(3, 3).T, data["position"]
    return PoseList(pose[None], metric=False)


def _by_frame(data: Any) -> PoseList | None:
    """An object for each frame, by its name, with a pose in it: ScanNet++."""
    found = {name: from_words(named_of(one)) for name, one in data.items() if isinstance(one, dict)}
    poses = {name: one.poses[0] for name, one in found.items() if one is not None}
    return PoseList(np.array([*poses.values()]), [*poses]) if len(poses) > 1 else None


def _from_named_matrices(data: Any) -> PoseList | None:
    """A matrix by the name of each frame, or a list of matrices."""
    values = list(data.values()) if isinstance(data, dict) else data
    rows = np.array(values, np.float64).reshape(len(values), -1)
    if rows.shape[1] not in (12, 16):
        return None
    return PoseList(from_matrices(rows), list(data) if isinstance(data, dict) else None)


def from_words(named: Named) -> PoseList | None:
    """Read one matrix among other values of a frame, by a name that says what it is; the first of the table wins."""
    own = {name: numbers for name, numbers in named.items() if len(numbers) in (12, 16)}
    own = {name: numbers for name, numbers in own.items() if not _IN_LIST.search(name)} or own
    numbers = {word(name): numbers for name, numbers in reversed(own.items())}
    for key, (to_world, is_opengl) in _POSE_WORDS.items():
        if key in numbers:
            pose = _by_rows(from_matrices(np.array([numbers[key]], np.float64)))
            pose = pose if to_world else inverted(pose)
            return PoseList(pose @ OPENGL if is_opengl else pose)
    return None


def _by_rows(poses: Matrices) -> Matrices:
    """Transpose matrices whose translation is in the last row, as programs write them that multiply from the left."""
    is_turned = (poses[:, :3, 3] == 0).all() and bool(poses[:, 3, :3].any())
    return poses.transpose(0, 2, 1) if is_turned else poses
