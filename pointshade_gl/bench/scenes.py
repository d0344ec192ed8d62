"""Scenes whose depth, normals and depth edges are known exactly. Normal estimators are measured on them.

The world is the camera of `standard_camera`. Widths in pixels hold for that camera.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..scene.camera import Camera, check_pose
from .shapes import box, pose_at, relief, rod, sheet, torus
from .solids import grey
from .tracing import NEIGHBOURS, Array, Surface, moved, plane, sphere, trace
from .vase import VASE_POSE, vase_scene

MIDDLE = 1.5  # metres to the middle of the scenes
GAP = 0.01  # a surface ends where a pixel's tangent plane misses the neighbour by more than this share of depth
REACH = 2  # pixels this near to a depth edge count as its surroundings


@dataclass(frozen=True)
class KnownScene:
    """What a perfect camera would see.

    depth (h, w) float32 metres, 0 = nothing; normals (h, w, 3) float32, unit, camera axes, towards the camera;
    edge (h, w), pixels within 2 of a jump in depth. Where a surface borders on nothing is no edge.
    """

    name: str
    camera: Camera
    depth: NDArray[np.float32]
    normals: NDArray[np.float32]
    edge: NDArray[np.bool_]


def standard_camera(width: int, height: int) -> Camera:
    """The view that the scenes are composed for: 63 degrees wide, like most depth cameras."""
    focal = width * 525 / 640
    return Camera(focal, focal, (width - 1) / 2, (height - 1) / 2, width, height)


def wall() -> Surface:
    return plane((0.15, -0.1, -1), (0, 0, 2.6), grey)


def tilted(degrees: float, roll: float, low: float, high: float) -> list[Surface]:
    return [moved(sheet(20, low, high), pose_at((0, 0, MIDDLE), pitch=degrees, roll=roll))]


def turned_vase(_: Camera) -> list[Surface]:
    """The built-in scene, close up and in front of a wall."""
    to_camera = pose_at((0, 0.02, -0.22)) @ np.linalg.inv(VASE_POSE)
    return [moved(part, to_camera) for part in vase_scene()] + [plane((0.1, 0, -1), (0, 0, 1.1), grey)]


def stairs(_: Camera) -> list[Surface]:
    """Nine steps away from a camera that looks down on them, and five plates in the air: pure jumps in depth."""
    down = np.linalg.inv(pose_at((0, 0, 0), pitch=12))
    parts = [moved(plane((0, 0, -1), (0, 0, 5), grey), down)]
    for k in range(9):
        parts.append(moved(box((1.1, 0.08, 0.13)), down @ pose_at((0, 0.7 - 0.15 * k, 1.2 + 0.25 * k))))
    for k in range(5):
        place = pose_at((0.65 - 0.12 * k, -0.15 - 0.04 * k, 1.3 + 0.2 * k), yaw=-15)
        parts.append(moved(box((0.12, 0.2, 0.02)), down @ place))
    return parts


def rods(camera: Camera) -> list[Surface]:
    """Ribbons 1, 2 and 3 pixels wide in five directions, tilted along their length, and 3-pixel rods.

    No estimator can find the normal of a rod of 1 or 2 pixels from its depth: such rods would measure luck.
    """
    pixel = MIDDLE / camera.fx
    parts = [wall()]
    for k in range(15):
        width, direction = 1 + k % 3, (0, 90, 20, 45, 70)[k // 3]
        x, y = (k % 5 - 2) * 0.33 + 0.02, (k // 5 - 1) * 0.42
        parts.append(moved(sheet(width * pixel / 2, -0.17, 0.17), pose_at((x, y, MIDDLE), pitch=35, roll=direction)))
    for x, roll in ((-0.5, 0), (-0.17, 80), (0.16, 35), (0.49, 60)):
        parts.append(moved(rod(1.5 * pixel, 0.14), pose_at((x, 0.21, MIDDLE), pitch=20, roll=roll)))
    return parts


def waves(camera: Camera) -> list[Surface]:
    """Waves from a fifth of the picture's width down to 5 pixels, 37 degrees steep everywhere."""
    long, short = 0.19 * camera.width, 5.0
    rate = np.log(long / short) / camera.width
    pixel = MIDDLE / camera.fx

    def height(x: Array, y: Array) -> Array:
        u = x / pixel + camera.width / 2
        length = long * np.exp(-rate * u)
        phase = 2 * np.pi / long * np.expm1(rate * u) / rate
        return MIDDLE + 0.12 * length * pixel * np.sin(phase) * (0.6 + 0.4 * np.sin(9 * y))

    return [relief(height, MIDDLE - 0.1, MIDDLE + 0.1)]


def overlap(_: Camera) -> list[Surface]:
    """A box and two balls, one in front of the other, in front of a wall."""
    cube = moved(box((0.3, 0.3, 0.3)), pose_at((0.25, 0.08, 1.75), 40, 25))
    return [wall(), cube, sphere((-0.2, 0.05, 1.15), 0.25, grey), sphere((0.03, -0.2, 1.3), 0.12, grey)]


SCENES: dict[str, Callable[[Camera], list[Surface]]] = {
    "plane": lambda _: [plane((0, 0, -1), (0, 0, MIDDLE), grey)],
    "tilted-60": lambda _: tilted(60, 30, -1.5, 5),
    "grazing-85": lambda _: tilted(85, 70, -1.2, 4),
    "sphere": lambda _: [wall(), sphere((0.05, 0.02, MIDDLE), 0.45, grey)],
    "torus": lambda _: [wall(), moved(torus(0.36, 0.13), pose_at((0, 0, 1.4), 25, 50))],
    "vase": turned_vase,
    "stairs": stairs,
    "rods": rods,
    "waves": waves,
    "overlap": overlap,
}


def make_scene(name: str, standard: Camera, camera: Camera | None = None, pose: ArrayLike | None = None) -> KnownScene:
    """The scene composed for the `standard` camera, seen by any camera (None: the standard one) at any pose."""
    camera = camera or standard
    hits = trace(SCENES[name](standard), camera, pose)
    normals = hits.normals @ check_pose(pose)[:3, :3]
    edge = near_depth_edge(hits.depth, normals, camera)
    return KnownScene(name, camera, hits.depth.astype(np.float32), normals.astype(np.float32), edge)


def near_depth_edge(depth: Array, normals: Array, camera: Camera, reach: int = REACH) -> NDArray[np.bool_]:
    """Pixels within `reach` of a jump in depth: two neighbours, each off the other's tangent plane.

    Creases and grazing planes, where depth only changes fast, do not count.
    """
    rays = camera.rays()
    jump = np.zeros(depth.shape, bool)
    off = (normals * rays).sum(-1) * depth  # distance of the tangent plane from the eye
    for a, b in NEIGHBOURS:
        with np.errstate(divide="ignore", invalid="ignore"):
            there = [off[i] / (normals[i] * rays[j]).sum(-1) / depth[j] - 1 for i, j in ((a, b), (b, a))]
            apart = (np.abs(there[0]) > GAP) & (np.abs(there[1]) > GAP) & (depth[a] > 0) & (depth[b] > 0)
        jump[a] |= apart
        jump[b] |= apart
    grown = np.pad(jump, reach)  # both sides of the jump are marked already
    for _ in range(reach - 1):
        grown[1:-1] |= grown[:-2] | grown[2:]
        grown[:, 1:-1] |= grown[:, :-2] | grown[:, 2:]
    return grown[reach:-reach, reach:-reach] & (depth > 0)
