"""What an interactive view orbits around: the object's centre, the distance of its light, and which way is up."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .frame import Frame
from .frame_arrays import probing_step
from .graph import Scene
from .point_cloud import PointCloud

Axis = tuple[float, float, float]
VERTICAL: Axis = (0.0, 1.0, 0.0)


@dataclass(frozen=True)
class Stage:
    """What the viewer moves around. Stage and State are in *view axes*: x right, y down in the picture.

    pivot    (3,) the object's middle, as the frame's own camera sees it
    radius   the light's distance from the pivot
    upright  (3, 3) from the camera's axes to view axes and back: with a negative fy the camera's y points up
    axis     (3,) that yaw turns about, view axes: the picture's vertical, or the up of point clouds
    """

    pivot: NDArray[np.float64]
    radius: float
    upright: NDArray[np.float64]
    axis: Axis = VERTICAL

    @classmethod
    def of(cls, frame: Frame | Scene) -> Stage:
        """Return the stage of a frame or scene. The light moves outside most of it, but not behind the camera."""
        if isinstance(frame, Scene):
            return cls._of_scene(frame)
        pivot = frame.pose[:3, :3].T @ (frame.pivot - frame.pose[:3, 3])
        h, w = frame.depth.shape
        step = probing_step(frame.depth)
        v, u = np.mgrid[0:h:step, 0:w:step]
        z = frame.depth[::step, ::step].astype(np.float64)
        points = frame.camera.unproject(z, np.stack([u, v], -1))[z > 0]
        extent = np.quantile(np.linalg.norm(points - pivot, axis=1), 0.8) if len(points) else 0.0
        radius = float(np.clip(1.5 * extent, 0.5 * pivot[2], pivot[2]))
        upright = np.diag([1.0, np.sign(frame.camera.fy), 1.0])
        return cls(upright @ pivot, radius, upright)

    def is_as(self, other: Stage) -> bool:
        """Return whether two stages are the same."""
        return (self.radius, self.axis) == (other.radius, other.axis) and all(
            np.array_equal(*both) for both in ((self.pivot, other.pivot), (self.upright, other.upright))
        )

    @classmethod
    def _of_scene(cls, scene: Scene) -> Stage:
        pose, (centre, radius) = np.asarray(scene.pose), scene.bounds
        pivot = pose[:3, :3].T @ (centre - pose[:3, 3])
        pivot = np.array([0.0, 0.0, max(pivot[2], 0.1 * radius)])  # what the camera looks at stays in the middle
        stage = cls(pivot, min(radius, float(pivot[2])), np.eye(3))
        if any(isinstance(p.content, PointCloud) for p in scene.things):
            x, y, z = pose[:3, :3].T @ scene.upright
            return replace(stage, axis=(float(x), float(y), float(z)))
        return stage
