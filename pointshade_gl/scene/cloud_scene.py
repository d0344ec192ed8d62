"""Makes a scene of a point cloud: upright, and seen as one walks up to a thing."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..messages.formatting import option
from .camera import Camera, orbit_pose
from .graph import FOV, Scene
from .node import Node
from .point_cloud import SAMPLE, STRAY, CloudLook, PointCloud

AHEAD = {"-y": (0, 0, 1), "y": (0, 0, -1), "z": (0, 1, 0), "-z": (0, 1, 0), "x": (0, 1, 0), "-x": (0, 1, 0)}
MARGIN = 1.08  # share of the distance from which the cloud fills the picture
ASIDE, ABOVE = 30.0, 25.0  # degrees from which a cloud is seen that no camera took


def scene_of(cloud: PointCloud) -> Scene:
    """Return the scene of a cloud alone. Its y down (as a camera's), it is seen from its own axes, else from above."""
    camera, pose = Camera.from_fov(FOV, 640, 480), _facing(cloud)
    if len(cloud):
        pose[:3, 3] += _stand_off(cloud, camera, pose[:3, :3])
    return Scene((Node(cloud),), camera, pose)


def styled(cloud: PointCloud, given: dict[str, Any]) -> PointCloud:
    """Return a cloud with options of `render`, those that were given. Raises ValueError for those that it has not."""
    if others := [option(name) for name in given if name not in CloudLook.__annotations__]:
        raise ValueError(f"{', '.join(others)} is for frames, and this is a point cloud: leave it out")
    return cloud.styled(**given) if given else cloud


def _stand_off(cloud: PointCloud, camera: Camera, turn: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where, (3,), a camera turned so stands to see all of a cloud but stray points."""
    middle = cloud.main_corners.mean(0)
    some = cloud.positions[:: -(-len(cloud) // SAMPLE)]
    x, y, z = ((some + (cloud.origin - middle)) @ turn).T
    across = np.maximum(
        np.abs(x) / ((camera.width - 1) / 2) * camera.fx, np.abs(y) / ((camera.height - 1) / 2) * camera.fy
    )
    away = float(np.quantile(across - z, 1 - STRAY))
    return middle - turn[:, 2] * max(MARGIN * away, 1e-6)


def _facing(cloud: PointCloud) -> NDArray[np.float64]:
    """Return the pose of a camera at the world's origin that sees the cloud upright."""
    ahead, down = np.array(AHEAD[cloud.up], np.float64), -cloud.up_direction
    pose = np.eye(4)
    pose[:3, :3] = np.stack([np.cross(down, ahead), down, ahead], -1)
    return pose if cloud.up == "-y" else orbit_pose(pose, (0, 0, 0), ASIDE, ABOVE)
