"""Places the ground plane: at a given height, on a detected floor, or under the lowest point in view."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.cloud import PointCloud
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.light import Light, unit
from ..scene.node import Placed
from ..scene.objects import PointObject
from ..scene.viewpoint import upright_of
from .floor_detection import shown_floor
from .undersides import lowest_main_point, lowest_point

GUESSED = 50.0  # degrees by which a floor may lean in the picture of a frame, whose up direction nobody knows,
TOLD = 12.0  # and from a scene's up direction, or a given one
LIGHT = Light(shadow=True, angle=12)  # from the viewer's upper left, unless others are given: a shadow needs one


def up_of(source: Frame | Scene) -> NDArray[np.float64]:
    """Return the direction that is up, (3,) unit, world: of a scene `Scene.upright`; of a frame, which has no known up
    direction, the normal of the floor that it shows, or up in its picture."""
    return up_and_floor(source)[0]


def up_and_floor(source: Frame | Scene) -> tuple[NDArray[np.float64], bool]:
    """Return the direction of `up_of`, and whether it is that of a floor which a frame shows."""
    camera, pose = source.camera, np.asarray(source.pose)
    assert camera is not None, "only scenes without a frame have none"
    up = np.array([0, -np.sign(camera.fy), 0])
    if isinstance(source, Frame):
        floor = shown_floor(source, up, GUESSED)
        return unit(pose[:3, :3] @ (up if floor is None else floor[:3])), floor is not None
    up, upright = pose[:3, :3] @ up, upright_of(source)
    return unit(up if upright is None else upright if upright @ up > 0 else -upright), False


def ground_under(scene: Scene, up: tuple[float, float, float], height: float | None = None) -> NDArray[np.float64]:
    """Return the ground plane, (4,): its unit normal, upwards, and the height of the world's origin above it.

    up      (3,) unit, world
    height  of the ground, world units along up; None finds it. If the lowest object shows a floor, that is the ground,
            with the floor's slope.
    """
    normal = unit(up)
    if height is not None:
        return np.append(normal, -height)
    members = [placed.members if isinstance(placed.content, PointObject) else (placed,) for placed in scene.things]
    found = [_under(member, normal) for several in members for member in several]
    return min(found, key=lambda one: one[0], default=(0.0, np.append(normal, 0.0)))[1]


def _under(placed: Placed, up: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
    """Return the lowest position of a frame, a mesh or a cloud along up, world units (0 without points), and the ground
    plane under it, (4,)."""
    along, shift = placed.axes[:3, :3].T @ up, up @ placed.axes[:3, 3]
    if isinstance(placed.content, PointCloud):
        lowest = lowest_main_point(placed.content, along) + float(shift)
    elif not isinstance(placed.content, PointObject):
        lowest = float((placed.content.positions @ along).min(initial=0.0) + shift)
    elif (floor := _floor(placed, up)) is not None:
        middle = placed.corners.mean(0)
        return up @ middle - (floor[:3] @ middle + floor[3]) / (floor[:3] @ up), floor
    else:
        lowest = float(lowest_point(placed.content.frame, along) + shift)
    return lowest, np.append(up, -lowest)


def _floor(placed: Placed, up: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the floor that a frame shows, (4,), world; None without one."""
    scale = float(np.cbrt(np.linalg.det(placed.axes[:3, :3])))
    rotation, origin = placed.axes[:3, :3] / scale, placed.axes[:3, 3]
    floor = shown_floor(placed.content.frame, rotation.T @ up, TOLD)
    if floor is None:
        return None
    normal = rotation @ floor[:3]
    return np.append(normal, scale * floor[3] - normal @ origin)


def seen_ground(ground: NDArray[np.float64], pose: NDArray[np.float64]) -> tuple[float, ...]:
    """Return a ground plane in the axes of a camera at a pose (4, 4): its normal, and the height of the eye over it."""
    return (*(pose[:3, :3].T @ ground[:3]).tolist(), float(ground[:3] @ pose[:3, 3] + ground[3]))
