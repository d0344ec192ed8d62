"""Makes a scene of a point cloud: upright, and seen as one walks up to a thing."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..notes.words import option
from .appearance import Look
from .camera import Camera, orbit_pose
from .cloud_axes import USUAL_FRONT
from .graph import FOV, Scene
from .node import Node
from .point_cloud import SAMPLE, STRAY, CloudLook, PointCloud, direction_of

MARGIN = 1.08  # share of the distance from which the cloud fills the picture
ASIDE, ABOVE = 30.0, 25.0  # degrees from which a cloud is seen that no camera took


def scene_of(*clouds: PointCloud, names: Sequence[str] = ()) -> Scene:
    """Return the scene of clouds that lie in one world, upright as the first of them says.

    One that has a front, or y down (as a camera's), is seen from the front, others from above. names: of their nodes.
    """
    camera, pose = Camera.from_fov(FOV, 640, 480), _facing(clouds[0])
    if some := [cloud for cloud in clouds if len(cloud)]:
        pose[:3, 3] += _stand_off(some, camera, pose[:3, :3])
    names = names or [""] * len(clouds)
    return Scene(tuple(Node(cloud, name=name) for cloud, name in zip(clouds, names, strict=True)), camera, pose)


def styled(cloud: PointCloud, given: dict[str, Any]) -> PointCloud:
    """Return a cloud with options of `render`, those that were given. Raises ValueError for those that it has not."""
    check_of_clouds(given)
    return cloud.styled(**given) if given else cloud


def given_by(look: Look, plain: Look | None = None) -> dict[str, Any]:
    """Return the options of a look that are others than those of a plain one, by name."""
    plain = plain or Look()
    return {name: one for name, one in look.options.items() if np.ndim(one) or one != getattr(plain, name)}


def is_of_clouds(name: str) -> bool:
    """Return whether clouds have this option of a look."""
    return name in CloudLook.__annotations__


def check_of_clouds(given: Iterable[str]) -> None:
    """Raises ValueError for options of a look that clouds have not."""
    if others := [option(name) for name in given if not is_of_clouds(name)]:
        are, them = ("is", "it") if len(others) == 1 else ("are", "them")
        raise ValueError(f"{', '.join(others)} {are} for frames, and this is a point cloud: leave {them} out")


def _stand_off(clouds: Sequence[PointCloud], camera: Camera, turn: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where, (3,), a camera turned so stands to see all of some clouds but stray points."""
    corners = np.concatenate([cloud.main_corners for cloud in clouds])
    middle = (corners.min(0) + corners.max(0)) / 2
    away = max(_away(cloud, camera, turn, middle) for cloud in clouds)
    return middle - turn[:, 2] * max(MARGIN * away, 1e-6)


def _away(cloud: PointCloud, camera: Camera, turn: NDArray[np.float64], middle: NDArray[np.float64]) -> float:
    """Return how far before the middle one sees all of a cloud but stray points."""
    some = cloud.positions[:: -(-len(cloud) // SAMPLE)]
    x, y, z = ((some + (cloud.origin - middle)) @ turn).T
    reach = cloud.reach(1 - STRAY)
    half = (camera.width - 1) / 2 / camera.fx, (camera.height - 1) / 2 / camera.fy  # of the picture, at depth 1
    across = [(np.abs(one) + reach * math.hypot(1, side)) / side for one, side in zip((x, y), half, strict=True)]
    return float(np.quantile(np.maximum(*across) - z, 1 - STRAY))


def _facing(cloud: PointCloud) -> NDArray[np.float64]:
    """Return the pose of a camera at the world's origin that sees the cloud upright."""
    ahead, down = -direction_of(cloud.front or USUAL_FRONT[cloud.up]), -cloud.up_direction
    pose = np.eye(4)
    pose[:3, :3] = np.stack([np.cross(down, ahead), down, ahead], -1)
    return pose if cloud.front or cloud.up == "-y" else orbit_pose(pose, (0, 0, 0), ASIDE, ABOVE)
