"""The content of a scene node together with its world transform: bounding box, axes and scale in world space."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .mesh import Mesh
from .node import Node
from .point_cloud import PointCloud
from .point_object import PointObject
from .rotation import is_rotation, moved
from .values import frozen

Matrix = NDArray[np.float64]
ROUNDING = 1e-12  # a scale this near to 1 is 1
SAME_PLACE = 1e-6  # share of a frame's scale by which poses may differ that are one
Way = tuple[Any, int]  # from a root to a node: the way to its parent, None for a root, and which child it is


@dataclass(frozen=True, eq=False)
class Placed:
    """The content of a node with its place in the world."""

    content: Any
    world: Matrix  # (4, 4) node-to-world
    node: Node
    way: Way

    @cached_property
    def path(self) -> tuple[int, ...]:
        """Which child of which child the node is."""
        path: list[int] = []
        way = self.way
        while way is not None:
            way, k = way
            path.append(k)
        return tuple(path[::-1])

    @cached_property
    def axes(self) -> Matrix:
        """Return (4, 4) to the world from the axes of the content's points; those of a point object are its camera's
        axes, of several frames those of the first."""
        return self.world @ self.content.frame.pose if isinstance(self.content, PointObject) else self.world

    @property
    def members(self) -> tuple[Placed, ...]:
        """Return each frame of a point object as if it was placed alone."""
        return (self,) if self.content.is_single else self._members

    @cached_property
    def _members(self) -> tuple[Placed, ...]:
        return tuple(Placed(member, self.world, self.node, self.way) for member in self.content.members)

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """(n, 3) corners of a box round the content, of each frame one, world; (0, 3) when it has no points."""
        content: PointObject | PointCloud | Mesh = self.content
        if isinstance(content, PointObject) and not content.is_single:
            return np.concatenate([member.corners for member in self.members])
        if isinstance(content, PointObject):
            reach = content.look.farthest_reach
            return self._to_world(content.frame.corners if reach <= 0.5 else content.frame.splat_corners(reach))
        return self._to_world(content.corners)

    @cached_property
    def main_corners(self) -> NDArray[np.float64]:
        """The same without stray points of frames and clouds."""
        is_frame = isinstance(self.content, PointObject)
        if is_frame and not self.content.is_single:
            return np.concatenate([member.main_corners for member in self.members])
        if isinstance(self.content, PointCloud):
            return self._to_world(self.content.main_corners)
        return self._to_world(self.content.frame.main_corners) if is_frame else self.corners

    @property
    def grain(self) -> float:
        """Return how wide a pixel of a frame is at its median distance, world units."""
        camera = self.content.frame.camera
        return self.content.scale * self.rigid_axes[1] / (0.5 * (abs(camera.fx) + abs(camera.fy)))

    def seen_from(self, pose: Matrix) -> Matrix:
        """Return a world pose as a rigid pose, (4, 4), in the axes of a point object's frames."""
        seen = np.linalg.inv(self.world) @ pose
        seen[:3, :3] /= np.cbrt(np.linalg.det(seen[:3, :3]))
        return seen

    def is_own_view(self, pose: Matrix) -> bool:
        """Return whether somebody at a world pose sees a frame as its own camera does."""
        return np.allclose(self.rigid_axes[0], pose, rtol=0, atol=SAME_PLACE * self.content.frame.scale)

    def _to_world(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        return moved(points, self.axes)

    @cached_property
    def rigid_axes(self) -> tuple[Matrix, float]:
        """Return `axes` as rotation and translation, (4, 4), and the one scale that the node gives a point object.

        Raises ValueError for what a point object cannot have: a scale that differs by axis, a shear, a mirror.
        """
        linear = self.world[:3, :3]
        scale = float(np.cbrt(np.linalg.det(linear)))
        if scale <= 0 or not is_rotation(linear / scale, 0.01):
            raise ValueError(
                f"{self.node.title}: a point object takes rotation, translation and one scale for all axes, "
                f"got {np.round(linear, 4).tolist()}"
            )
        scale = 1.0 if abs(scale - 1) < ROUNDING else scale
        rigid = self.axes.copy()
        rigid[:3, :3] /= scale
        return frozen(rigid), scale
