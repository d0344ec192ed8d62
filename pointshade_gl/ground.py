"""Where the ground lies: under all that is visible."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .frame import Frame
from .light import Light, unit
from .scene import Placed, PointObject, Scene
from .view import upright_of

SUNK = 0.001  # share of a frame's points that may lie below the ground: noise must not decide about it
LIGHT = Light(shadow=True, angle=12)  # from the viewer's upper left, unless others are given: a shadow needs one


def up_of(source: Frame | Scene) -> NDArray[np.float64]:
    """(3,) unit, world: which way is up. Of a scene `Scene.upright`; of a frame, which has no known up direction, up in
    its picture."""
    camera, down = source.camera, np.asarray(source.pose)[:3, 1]
    assert camera is not None, "only scenes without a frame have none"
    down = down * np.sign(camera.fy)
    upright = upright_of(source)
    return unit(-down if upright is None else upright if upright @ down < 0 else -upright)


def ground_under(scene: Scene, up: tuple[float, float, float]) -> NDArray[np.float64]:
    """(4,) the ground: its normal, unit, upwards, and the height of the world's origin above it."""
    normal = unit(up)
    lowest = [_lowest(member, normal) for p in scene.things for member in _members(p)]
    return np.append(normal, -min(lowest, default=0.0))


def _members(placed: Placed) -> tuple[Placed, ...]:
    return placed.members if isinstance(placed.content, PointObject) else (placed,)


def _lowest(placed: Placed, up: NDArray[np.float64]) -> float:
    """How far a frame or a mesh lies along an axis at least, world units; 0 without points."""
    along, shift = placed.axes[:3, :3].T @ up, up @ placed.axes[:3, 3]
    if not isinstance(placed.content, PointObject):
        return float((placed.content.positions @ along).min(initial=0.0) + shift)
    depth, c = placed.content.frame.depth, placed.content.frame.camera
    across, down = (np.arange(c.width) - c.cx) / c.fx * along[0], (np.arange(c.height) - c.cy) / c.fy * along[1]
    heights = (depth * (across + down[:, None] + along[2]))[depth > 0]
    return float((np.quantile(heights, SUNK) if heights.size else 0.0) + shift)


def seen_ground(ground: NDArray[np.float64], pose: NDArray[np.float64]) -> tuple[float, ...]:
    """The ground in the axes of somebody at a pose (4, 4): its normal, and the height of the eye above it."""
    return (*(pose[:3, :3].T @ ground[:3]).tolist(), float(ground[:3] @ pose[:3, 3] + ground[3]))
