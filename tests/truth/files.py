"""What make_truth.py wrote, as arrays and as frames and lights of pointshade_gl."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import pointshade_gl as ps

from .lamps import Lamp

MATTE = ps.Material(ambient=0, diffuse=1, specular=0)


@dataclass(frozen=True)
class View:
    """What is truly seen: depth (h, w), 0 = nothing; normals (h, w, 3) and points (h, w, 3) in the source's axes.

    albedo   (h, w, 3) uint8 sRGB
    visible  (h, w) whether a ray from the source camera reaches the point, within its picture or not
    """

    pose: np.ndarray
    depth: np.ndarray
    normals: np.ndarray
    points: np.ndarray
    albedo: np.ndarray
    visible: np.ndarray


class Truth:
    """One scene: its views by angle, its lamps, and the frame that its camera takes.

    every  takes the middle one of so many pixels each way; odd
    """

    def __init__(self, path: Path, every: int = 1):
        self.path, self.name = path, path.stem
        stored = np.load(path)
        about = json.loads(str(stored["about"]))
        fx, fy, cx, cy, width, height = about["camera"]
        self.camera = ps.Camera(fx, fy, cx, cy, int(width), int(height)).resized(width // every, height // every)
        self.about = json.dumps(about | {"camera": [*self.camera.intrinsics, self.camera.width, self.camera.height]})
        middle = slice(every // 2, None, every)
        self._arrays = {name: stored[name][middle, middle] for name in stored.files if name != "about"}
        self.lamps = [Lamp(**{key: as_tuple(value) for key, value in lamp.items()}) for lamp in about["lamps"]]
        self.up = np.array(about["up"])
        self._poses = {int(yaw): np.array(pose) for yaw, pose in about["poses"].items()}
        self.source = self.view(0)
        self.frame = ps.Frame(self.source.albedo, self.source.depth, self.camera)

    @property
    def angles(self) -> list[int]:
        return sorted(self._poses)

    def lit_angles(self, lamp: Lamp) -> list[int]:
        return [yaw for yaw in self.angles if f"{lamp.name}_{yaw}" in self._arrays]

    def view(self, yaw: int) -> View:
        pose, depth = self._poses[yaw], self._arrays[f"depth_{yaw}"]
        points = (rays(self.camera) * depth[..., None]) @ pose[:3, :3].T + pose[:3, 3]
        given = (self._arrays[f"{name}_{yaw}"] for name in ("normals", "albedo", "visible"))
        normals, albedo, visible = given
        return View(pose, depth, normals.astype(float), points, albedo, visible)

    def light(self, lamp: Lamp, yaw: int) -> np.ndarray:
        """(h, w, 3) linear: the path-traced picture."""
        return self._arrays[f"{lamp.name}_{yaw}"].astype(float)


def load(folder: Path) -> list[Truth]:
    """All scenes of a folder. Raises FileNotFoundError if there is none."""
    paths = sorted(folder.glob("*.npz"))
    if not paths:
        raise FileNotFoundError(f"{folder} holds no truth: make it with tests.truth.make_truth")
    return [Truth(path) for path in paths]


def as_light(lamp: Lamp, **changes) -> ps.Light:
    given = {"intensity": lamp.intensity, "position": lamp.position, "direction": lamp.direction, "shadow": True}
    if lamp.position is not None:
        given["attenuation"] = (0, 0, 1)
    if lamp.cone is not None:
        given["cone"] = lamp.cone
    return ps.Light(**given | changes)


def rays(camera: ps.Camera) -> np.ndarray:
    """(h, w, 3) through the pixels' middles, of length 1 along the axis."""
    v, u = np.mgrid[: camera.height, : camera.width]
    return np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], -1)


def as_tuple(value):
    return tuple(value) if isinstance(value, list) else value
