"""Cameras and poses, and the conventions of the whole project, stated here once.

Axes      OpenCV and Open3D: x right, y down, z forward. A pose is a 4x4 camera-to-world matrix.
World     the frame's own camera, unless the frame has a pose.
Pixels    centres at integer coordinates, row 0 on top; `u = fx*x/z + cx`, `v = fy*y/z + cy`.
Depth     z along the optical axis, metres (any unit works as long as poses and lights use it too).
Normals   unit, camera axes, towards the camera.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .wording import option

SMALLEST, LARGEST = 1e-6, 1e9  # pixels of a focal length, either way along its axis; the largest also of a centre
FAR = 1e30  # no pose is further away: squares of it are still numbers


@dataclass(frozen=True)
class Camera:
    """A pinhole camera: focal lengths and principal point in pixels, size in pixels.

    `fy` may be negative (a picture whose rows run upwards, as in ICL-NUIM).
    Raises ValueError for a focal length or a size that no camera has.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    def __post_init__(self) -> None:
        for name in ("fx", "fy", "cx", "cy"):
            value = float(getattr(self, name))
            if not abs(value) <= LARGEST:  # NaN fails the test
                raise ValueError(f"camera {name} must be a finite number of pixels, up to {LARGEST:g}, got {value}")
            object.__setattr__(self, name, value)
        if self.fx < SMALLEST:
            raise ValueError(f"camera fx must be above 0 pixels, got {self.fx:g}")
        if abs(self.fy) < SMALLEST:
            raise ValueError(f"camera fy must not be 0 pixels, got {self.fy:g}")
        for name in ("width", "height"):
            value = getattr(self, name)
            if int(value) != value or value < 1:
                raise ValueError(f"camera {name} must be a whole number of pixels above 0, got {value}")
            object.__setattr__(self, name, int(value))

    @classmethod
    def from_fov(cls, fov_y_degrees: float, width: int, height: int) -> Camera:
        """A camera with square pixels and a centred principal point from its vertical field of view."""
        if not 0 < fov_y_degrees < 180:
            raise ValueError(f"{option('fov')} must lie between 0 and 180 degrees, got {fov_y_degrees:g}")
        focal = height / 2 / math.tan(math.radians(fov_y_degrees) / 2)
        return cls(focal, focal, (width - 1) / 2, (height - 1) / 2, width, height)

    @property
    def intrinsics(self) -> tuple[float, float, float, float]:
        """(fx, fy, cx, cy), pixels."""
        return self.fx, self.fy, self.cx, self.cy

    def resized(self, width: int, height: int) -> Camera:
        """The same view on another grid of pixels; the picture's outer edges stay where they are."""
        sx, sy = width / self.width, height / self.height
        cx, cy = (self.cx + 0.5) * sx - 0.5, (self.cy + 0.5) * sy - 0.5
        return Camera(self.fx * sx, self.fy * sy, cx, cy, width, height)

    def fitted(self, width: int, height: int) -> Camera:
        """The whole view, undistorted, in the middle of a picture of another size and shape."""
        scale = min(width / self.width, height / self.height)
        cx = (self.cx - (self.width - 1) / 2) * scale + (width - 1) / 2
        cy = (self.cy - (self.height - 1) / 2) * scale + (height - 1) / 2
        return Camera(self.fx * scale, self.fy * scale, cx, cy, width, height)


class Eye(NamedTuple):
    """Who looks: a camera, where it stands, and how near something may come to it."""

    camera: Camera
    pose: NDArray[np.float64]  # (4, 4) camera-to-world
    near: float  # z along the axis, world units: what comes closer is cut away


def check_pose(pose: ArrayLike | None, name: str = "pose") -> NDArray[np.float64]:
    """A camera-to-world matrix as float64 (4, 4), read-only; None is the identity.

    Raises ValueError unless it is a rotation and a translation (to 1 %, so that rounded text files pass).
    """
    matrix = np.eye(4) if pose is None else np.array(pose, dtype=np.float64)
    if matrix.shape != (4, 4):
        raise ValueError(f"{name} must have shape (4, 4), got {matrix.shape}")
    wrong = ~(np.abs(matrix) < FAR)  # NaN compares false
    if wrong.any():
        raise ValueError(f"{name} must be finite, got {wrong.sum()} entries that are NaN, infinite or beyond {FAR:g}")
    rotation = matrix[:3, :3]
    if np.abs(matrix[3] - (0, 0, 0, 1)).max() > 1e-6 or np.abs(rotation.T @ rotation - np.eye(3)).max() > 0.01:
        raise ValueError(f"{name} must be camera-to-world, a rotation and a translation over (0, 0, 0, 1)")
    if np.linalg.det(rotation) < 0:
        raise ValueError(f"{name} mirrors: its rotation has determinant -1; OpenCV axes are x right, y down, z forward")
    matrix.flags.writeable = False
    return matrix


def view_matrix(source_pose: NDArray[np.float64], target_pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """The matrix that takes points from the source camera's axes into the target camera's."""
    return np.linalg.inv(target_pose) @ source_pose


def orbit_pose(
    pose: ArrayLike | None,
    pivot: ArrayLike,
    yaw: float = 0.0,
    pitch: float = 0.0,
    dolly: float = 0.0,
    upright: ArrayLike | None = None,
) -> NDArray[np.float64]:
    """The pose after the camera went round a point of the world, still looking at it as before.

    pivot   (3,) world point
    yaw     degrees; above 0 the camera moves to its right and sees more of the object's right side
    pitch   degrees; above 0 the camera moves up and looks down
    dolly   share of the way to the pivot: 0.5 goes half the way, below 0 goes away; must stay below 1
    upright (3,) world axis, either way along it, that yaw turns round; None is the camera's own vertical
    """
    if not all(math.isfinite(x) for x in (yaw, pitch, dolly)) or dolly >= 1:
        angles = f"{option('yaw')} and {option('pitch')}"
        raise ValueError(f"{angles} must be finite and {option('dolly')} below 1, got {yaw}, {pitch}, {dolly}")
    start = check_pose(pose)
    a, b = math.radians(yaw), math.radians(pitch)
    x, y, z = axis = _down(start, upright)
    across = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
    turn_y = math.cos(a) * np.eye(3) + (1 - math.cos(a)) * np.outer(axis, axis) + math.sin(a) * across
    turn_x = np.array([[1, 0, 0], [0, math.cos(b), math.sin(b)], [0, -math.sin(b), math.cos(b)]])
    target = np.asarray(pivot, np.float64)
    seen = start[:3, :3].T @ (target - start[:3, 3])  # the pivot in the camera's own axes
    turn = turn_y @ turn_x
    result = np.eye(4)
    result[:3, :3] = start[:3, :3] @ turn
    result[:3, 3] = start[:3, 3] + start[:3, :3] @ (seen - (1 - dolly) * (turn @ seen))
    return result


def _down(pose: NDArray[np.float64], upright: ArrayLike | None) -> NDArray[np.float64]:
    """The vertical as a camera sees it, (3,) in its axes, pointing down its picture."""
    if upright is None:
        return np.array([0.0, 1.0, 0.0])
    axis = pose[:3, :3].T @ np.asarray(upright, np.float64)
    return axis / (np.linalg.norm(axis) * (1 if axis[1] >= 0 else -1))
