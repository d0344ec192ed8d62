"""Where things are in a scene: bounds, what a camera can see of them, and the views of lights. No GL here."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .camera import Camera
from .frame import Frame
from .scene import Mesh, Placed, PointObject, Scene
from .shading import Light, count_views

Matrix = NDArray[np.float64]
FAR_AWAY = (
    1000.0  # a directional light's camera stands this many radii of the scene off: its rays are parallel to 0.001
)
FOV = 45.0  # degrees from top to bottom, of a scene without a camera
CONTACT = 0.003  # of the scene's radius
FACES = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], np.float64)  # of a point light


class ShadowView(NamedTuple):
    """One picture that a light takes of the scene."""

    camera: Camera
    pose: Matrix  # (4, 4) camera-to-world
    near: float
    contact: float  # world units by which an occluder must be nearer to the light than what it shades


def world_of(placed: Placed) -> Matrix:
    """(4, 4) from the content's own axes to the world: of a point object from its frame's camera."""
    content: Any = placed.content
    return placed.world @ content.frame.pose if isinstance(content, PointObject) else placed.world


def rigid_part(world: Matrix, name: str) -> tuple[Matrix, float]:
    """Rotation and translation, (4, 4), and the one scale of a transform.

    Raises ValueError for what a point object cannot have: another scale along one axis, a shear, a mirror.
    """
    linear = world[:3, :3]
    scale = float(np.cbrt(np.linalg.det(linear)))
    if scale <= 0 or np.abs(linear.T @ linear / scale**2 - np.eye(3)).max() > 0.01:
        raise ValueError(
            f"node {name!r}: a point object takes rotation, translation and one scale for all axes, "
            f"got\n{np.round(linear, 4).tolist()}"
        )
    rigid = world.copy()
    rigid[:3, :3] = linear / scale
    return rigid, scale


def corners(content: Mesh | PointObject) -> NDArray[np.float64]:
    """(8, 3) corners of a box round the content, in its own axes; (0, 3) when it has no points."""
    if isinstance(content, PointObject):
        return _frame_corners(content.frame)
    points = content.positions[np.unique(content.faces)] if content.faces.size else content.positions[:0]
    return _box(points.min(0), points.max(0)) if len(points) else np.zeros((0, 3))


def _frame_corners(frame: Frame) -> NDArray[np.float64]:
    if not frame.points_known:
        return np.zeros((0, 3))
    (left, top, right, bottom), c, z = frame.box, frame.camera, frame.depth_range
    x = (np.array([left, right]) - 0.5 - c.cx) / c.fx
    y = (np.array([top, bottom]) - 0.5 - c.cy) / c.fy
    at = np.array([[x_ * z_, y_ * z_, z_] for z_ in z for x_ in x for y_ in y])
    return _box(at.min(0), at.max(0))


def _box(low: NDArray[Any], high: NDArray[Any]) -> NDArray[np.float64]:
    return np.array([[(low, high)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)], np.float64)


def is_in_view(box: NDArray[np.float64], world: Matrix, camera: Camera, pose: Matrix, near: float) -> bool:
    """Whether a box may show in the picture: False only when it lies wholly outside one side of the view."""
    if not len(box):
        return False
    view = np.linalg.inv(pose) @ world
    x, y, z = (box @ view[:3, :3].T + view[:3, 3]).T
    u, v = camera.fx * x + (camera.cx + 0.5) * z, camera.fy * y + (camera.cy + 0.5) * z
    outside = (u < 0, u > camera.width * z, v < 0, v > camera.height * z, z < near)
    return not any(side.all() for side in outside)


def coarser_step(frame: Frame, world: Matrix, camera: Camera, pose: Matrix) -> int:
    """1, 2, 4 .. : every how many-th pixel of a frame is enough for a view in which several fall into one pixel.

    Judged at the nearest corner of the object's box, so that no part of it is drawn too coarsely.
    """
    view = np.linalg.inv(pose) @ world
    depth = (_frame_corners(frame) @ view[:3, :3].T + view[:3, 3])[:, 2]
    nearest = float(depth.min()) if len(depth) else 0.0
    if nearest <= 0:
        return 1
    scale = float(np.cbrt(abs(np.linalg.det(world[:3, :3]))))
    spread = frame.depth.max() / frame.camera.fx * scale  # between neighbours, world units, at most
    pixels = spread * camera.fx / nearest
    return int(2 ** np.clip(np.floor(np.log2(1 / pixels)), 0, 5))


def coarser(frame: Frame, step: int) -> Frame:
    """Every step-th pixel of a frame; the colours stay as fine as they are."""
    first, c = (step - 1) // 2, frame.camera
    depth = frame.depth[first::step, first::step]
    height, width = depth.shape
    camera = Camera(c.fx / step, c.fy / step, (c.cx - first) / step, (c.cy - first) / step, width, height)
    return Frame(frame.color, depth, camera, frame.pose)


def bounding_sphere(placed: list[Placed]) -> tuple[NDArray[np.float64], float]:
    """Centre (3,) and radius of a sphere round everything, world; radius 1 round the origin without anything."""
    found = [box @ world_of(p)[:3, :3].T + world_of(p)[:3, 3] for p in placed if len(box := corners(p.content))]
    if not found:
        return np.zeros(3), 1.0
    points = np.concatenate(found)
    centre = (points.min(0) + points.max(0)) / 2
    return centre, max(float(np.linalg.norm(points - centre, axis=1).max()), 1e-6)


def framed(scene: Scene) -> Scene:
    """The scene with a camera: its own, or one that looks as its pose does and sees everything."""
    if scene.camera is not None:
        return scene
    centre, radius = bounding_sphere([p for p in scene.placed() if not isinstance(p.content, Light)])
    pose = np.array(scene.pose)
    pose[:3, 3] = centre - pose[:3, 2] * 1.05 * radius / math.sin(math.radians(FOV / 2))
    return replace(scene, camera=Camera.from_fov(FOV, 640, 480), pose=pose)


def shadow_views(light: Light, centre: NDArray[np.float64], radius: float, side: int) -> list[ShadowView]:
    """The pictures that a light takes of what lies within a sphere: one, or six of a point light. side in pixels."""
    if light.position is None:
        direction = np.array(light.direction, np.float64) / np.linalg.norm(np.array(light.direction))
        distance = FAR_AWAY * radius
        focal = (side / 2 - 2) * (distance - radius) / radius
        position, directions, near = centre - distance * direction, [direction], distance - 1.1 * radius
    else:
        position = np.array(light.position)
        away = float(np.linalg.norm(position - centre))
        near = max(away - 1.1 * radius, 0.002 * radius)
        if count_views(light) == 1:
            assert light.direction is not None
            directions, focal = [np.array(light.direction)], (side / 2 - 2) / math.tan(math.radians(light.cone[1]))
        else:
            directions, focal = list(FACES), side / 2 - 2.0
    camera = Camera(focal, focal, (side - 1) / 2, (side - 1) / 2, side, side)
    return [ShadowView(camera, _looking(position, direction), near, CONTACT * radius) for direction in directions]


def _looking(position: NDArray[np.float64], direction: NDArray[np.float64]) -> Matrix:
    """The pose of a camera at a position that looks along a direction, turned round it much the same for its like."""
    z = direction / np.linalg.norm(direction)
    x = np.cross(z, np.eye(3)[int(abs(z[0]) > 0.7)])
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([x, np.cross(z, x), z], -1), position
    return pose
