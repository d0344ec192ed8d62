"""The room that fills every layout, seen through any camera, and what must come out of a layout."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

VIEWS = (5, 7, 9, 11)  # of the 23; neighbours see mostly the same
GL = np.diag([1.0, -1.0, -1.0, 1.0])  # OpenGL camera axes (x right, y up, z backward) to OpenCV's


@dataclass(frozen=True)
class Pinhole:
    """A camera of OpenCV's convention: pixel centres at integers. Focal lengths and principal point in pixels."""

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    @property
    def matrix(self) -> np.ndarray:
        """K, (3, 3)."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1]], float)

    def sized(self, width: int, height: int) -> Pinhole:
        """The same view on another grid; the picture's outer edges stay where they are."""
        x, y = width / self.width, height / self.height
        cx, cy = (self.cx + 0.5) * x - 0.5, (self.cy + 0.5) * y - 0.5
        return Pinhole(self.fx * x, self.fy * y, cx, cy, width, height)


SMALL = Pinhole(262.3, 261.1, 151.2, 117.7, 320, 240)  # nothing about it can be guessed
PHONE = Pinhole(213.1, 213.1, 128.9, 94.6, 256, 192)  # depth of an iPhone's lidar


@dataclass(frozen=True)
class View:
    """color (h, w, 3) uint8; depth (h, w) float32 metres, 0 missing; pose (4, 4) camera-to-world, OpenCV axes."""

    color: np.ndarray
    depth: np.ndarray
    pose: np.ndarray


class Room:
    """A few views of the living room (Augmented ICL-NUIM, Choi 2015), in a world that is nobody's camera."""

    def __init__(self, folder: Path):
        world = np.eye(4)
        world[:3, :3] = Rotation.from_rotvec((0.5, -0.9, 0.3)).as_matrix()
        world[:3, 3] = 1.2, -0.7, 0.4
        listed = np.loadtxt(folder / "poses_tum.txt")
        self.colors = [np.asarray(Image.open(folder / "color" / f"{k:03d}.jpg")) for k in VIEWS]
        self.depths = [np.asarray(Image.open(folder / "depth" / f"{k:03d}.png")) / np.float32(1000) for k in VIEWS]
        self.poses = []
        for k in VIEWS:
            pose = np.eye(4)
            pose[:3, :3] = Rotation.from_quat(listed[k, 4:]).as_matrix()
            pose[:3, 3] = listed[k, 1:4]
            self.poses.append(world @ pose)

    def through(self, camera: Pinhole, count: int = 3, larger: float = 1) -> list[View]:
        """The first views as this camera would have taken them: the nearest pixel's colour and depth.

        larger  the room is so many times its size: for cameras that stand in streets
        """
        u = np.rint((np.arange(camera.width) - camera.cx) / camera.fx * 525 + 319.5).astype(int)
        v = np.rint((np.arange(camera.height) - camera.cy) / camera.fy * 525 + 239.5).astype(int)
        outside = ((v < 0) | (v > 479))[:, None] | ((u < 0) | (u > 639))
        at = np.ix_(v.clip(0, 479), u.clip(0, 639))
        views = []
        for color, depth, pose in zip(self.colors[:count], self.depths, self.poses, strict=False):
            seen, color = depth[at], color[at]
            seen[outside], color[outside] = 0, 0
            place = pose.copy()
            place[:3, 3] *= larger
            views.append(View(color, seen * np.float32(larger), place))
        return views


@dataclass(frozen=True)
class Expected:
    """What must come out of a layout.

    source   what is typed: a folder or a file
    camera   of the depth
    views    in their order
    options  that must be given even by somebody who knows the program, because nothing in the layout says them
    poses    whether the poses are in it
    color    whether the colour is in it
    metric   False: depth is known up to scale and offset of its inverse
    sparse   fewer depths than those may come out
    pixels   by how much fx, fy, cx and cy may be wrong
    metres   by how much a camera's place may be wrong
    or_says  the first command may instead end in an error that matches this pattern, or guess with such a note ...
    then     ... and must be right with these options more
    or_notes wrong poses are forgiven where a note matches this pattern
    """

    source: Path
    camera: Pinhole
    views: list[View]
    options: dict[str, Any] = field(default_factory=dict)
    poses: bool = True
    color: bool = True
    metric: bool = True
    sparse: bool = False
    pixels: float = 0.1
    metres: float = 0.002
    or_says: str | None = None
    then: dict[str, Any] = field(default_factory=dict)
    or_notes: str | None = None


def without_camera(camera: Pinhole, **more: Any) -> dict[str, Any]:
    """The fields of an Expected for a layout that holds no camera: right, or an error that asks for it."""
    given = (camera.fx, camera.fy, camera.cx, camera.cy)
    return {"or_says": r"intrinsics|fov", "then": {"intrinsics": given, **more}}
