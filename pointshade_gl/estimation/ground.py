"""Floors and ground planes, and how far down the objects in a frame reach."""

from __future__ import annotations

import math
from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene.cloud import PointCloud
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.light import Light, unit
from ..scene.node import Placed
from ..scene.objects import Mesh, PointObject

Points = NDArray[np.float64]  # (n, 3)

SAMPLES = 4000  # points that are looked at
TRIES = 150  # planes through three points each
NEAR = 0.01  # by this share of its distance a point may lie off its plane
ROUNDS = 3  # of fitting, and of planes one below the other
SHARE = 0.1  # of all points that a floor has at least
BELOW = 0.01  # of all points that may lie below it,
THICK = 0.002  # by more than its noise and this share of their distance: a board on a floor is none
TOP = 0.9  # of its points lie below the ground that continues it: its own noise must not shade that


def shown_floor(frame: Frame, up: NDArray[np.float64], lean: float) -> NDArray[np.float64] | None:
    """Return a frame's floor, (4,): its unit normal, and the height of the camera above it; None without one.

    up    (3,) unit; all in the frame's axes
    lean  degrees between the floor's normal and up, at most
    """
    known = np.argwhere(frame.depth > 0)
    v, u = known[:: max(len(known) // SAMPLES, 1)].T  # evenly spread over the picture
    rest = points = frame.camera.unproject(frame.depth[v, u], np.stack([u, v], -1))
    steepest = math.cos(math.radians(lean))
    for _ in range(ROUNDS):
        plane = _largest_plane(rest, up, steepest)
        if plane is None or len(_on(points, plane)) < SHARE * len(points):
            return None
        heights = _heights(points, plane)
        own = heights[np.abs(heights) < _reach(points)]
        noise = 4 * 1.4826 * float(np.median(np.abs(own)))  # how far most points of the plane lie off it
        if (heights < -noise - THICK * points[:, 2]).mean() <= BELOW:
            return plane - (0, 0, 0, np.quantile(own, TOP))
        rest = points[heights < -_reach(points)]
    return None


def _largest_plane(points: Points, up: NDArray[np.float64], steepest: float) -> NDArray[np.float64] | None:
    """Return the plane, (4,), on which most points lie, among those that are level enough."""
    if len(points) < 3:
        return None
    a, b, c = points[np.random.default_rng(0).integers(0, len(points), (3, TRIES))]
    normals = np.cross(b - a, c - a)
    normals *= np.sign(normals @ up)[:, None] / np.maximum(np.linalg.norm(normals, axis=-1), 1e-12)[:, None]
    level = normals @ up >= steepest
    planes = np.column_stack([normals, -(normals * a).sum(-1)])[level]
    if not len(planes):
        return None
    best = planes[np.argmax([len(_on(points, plane)) for plane in planes])]
    for _ in range(ROUNDS):
        near = _on(points, best)
        middle = near.mean(0)
        normal = np.linalg.svd(near - middle, full_matrices=False)[2][2]  # by least squares
        normal = normal if normal @ up > 0 else -normal
        best = np.append(normal, -normal @ middle)
    return best if best[:3] @ up >= steepest else None


def _heights(points: Points, plane: NDArray[np.float64]) -> NDArray[np.float64]:
    return points @ plane[:3] + plane[3]


def _reach(points: Points) -> NDArray[np.float64]:
    return NEAR * points[:, 2]


def _on(points: Points, plane: NDArray[np.float64]) -> Points:
    return points[np.abs(_heights(points, plane)) < _reach(points)]


Array = NDArray[np.floating[Any]]
Index = NDArray[np.intp]

SUNK = 0.001  # share of the points that may lie lower than what is found: noise must not decide about it
LOWEST = 2000  # ends that are looked at
THIRD = 2  # lower ends that do not count: stray pixels
STEP = 0.05  # share of the depth by which neighbours on one surface differ at most
BESIDE = 2  # pixels of the same surface round an end, at least: a stray one has none
DEEP, LEAST = 12, 6  # pixels inward that a circle is laid through
ROUND = 0.2  # pixels by which they may lie off it
SIDE = 2  # ends on each side whose circles must agree: the median counts
NEAREST, FARTHEST = -0.3, 1.3  # pixels from the last one to the outline of its circle
STEEPEST = 2  # pixels that the last pixel of a surface is high, at most
INNER = 4  # pixels over which that is measured
ALONG = 3  # columns on each side that show where between two pixels an edge runs


def lowest_point(frame: Frame, along: Array) -> float:
    """Return the lowest position of a frame's objects, undersides too, along an axis (3,) of its camera."""
    depth, camera = frame.depth, frame.camera
    if not (depth > 0).any():
        return 0.0
    rays = camera.ray_at(np.arange(camera.width), np.arange(camera.height))
    heights = depth * (rays[0] * along[0] + rays[1][:, None] * along[1] + along[2])
    lowest = float(np.quantile(heights[depth > 0], SUNK))
    up, length = along / np.linalg.norm(along), float(np.linalg.norm(along))
    (x, y), twice_focal = rays, abs(camera.fx) + abs(camera.fy)
    if abs(up[0]) > abs(up[1]):  # turned upright
        depth, x, y, up = depth.T, y, x, up[[1, 0, 2]]
    if up[1] * (y[-1] - y[0]) > 0:
        depth, y = depth[::-1], y[::-1]
    bottoms = _bottoms(depth, x, y, up, twice_focal) * length
    return min(lowest, float(np.partition(bottoms, THIRD)[THIRD])) if len(bottoms) > THIRD else lowest


def _bottoms(depth: Array, x: Array, y: Array, up: Array, twice_focal: float) -> Array:
    """Return (n,) heights of the lower ends of objects in an upright image, including what goes on out of sight."""
    depth = np.pad(depth, ((DEEP, ALONG), (ALONG, ALONG)))
    x, y = np.pad(x, ALONG), np.pad(y, (DEEP, ALONG))
    ends = np.zeros(depth.shape, bool)  # where a surface ends downwards: the next pixel is missing, or farther away
    ends[:-1] = (depth[:-1] > 0) & ((depth[1:] == 0) | (depth[1:] > (1 + STEP) * depth[:-1]))
    row, column = np.nonzero(ends)
    first = np.argsort(_heights_in_rows(depth, x, y, up, row, column))[: 4 * LOWEST]
    row, column = row[first], column[first]
    beside = [_alike(depth[row + i, column + j], depth[row, column]) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]
    kept = np.sum(beside, axis=0) >= BESIDE
    row, column = row[kept][:LOWEST], column[kept][:LOWEST]
    if not len(row):
        return np.zeros(0)
    cut = row == depth.shape[0] - ALONG - 1  # by the picture's border
    here, rise = _heights_in_rows(depth, x, y, up, row, column), np.zeros(len(row))
    for k in range(1, INNER + 1):  # of as many as there are: noise counts least over the longest way
        is_there = _alike(depth[row - k, column], depth[row, column])
        rise = np.where(is_there, (_heights_in_rows(depth, x, y, up, row - k, column) - here) / k, rise)
    pixel = 2 * depth[row, column] / twice_focal
    straight = here - _edge(ends, row, column) * np.clip(rise, 0, STEEPEST * pixel)
    return np.where(cut, here, np.fmin(straight, _round_bottom(depth, x, y, up, row, column, pixel)))


def _heights_in_rows(depth: Array, x: Array, y: Array, up: Array, row: Index, column: Index) -> Array:
    return depth[row, column] * (x[column] * up[0] + y[row] * up[1] + up[2])


def _alike(a: NDArray[Any], b: NDArray[Any]) -> NDArray[np.bool_]:
    """Return whether two depths belong to one surface."""
    return (a > 0) & (b > 0) & (np.abs(a - b) < STEP * np.minimum(a, b))


def _edge(ends: NDArray[np.bool_], row: Index, column: Index) -> Array:
    """Return (n,) by how many pixels the outline runs below the ends, from a line through the middles of its steps."""
    off = np.arange(-ALONG, ALONG + 1)
    beside = ends[row[:, None, None] + off[:, None], column[:, None, None] + off]
    known, end = beside.any(1), (beside * off[:, None]).sum(1) / np.maximum(beside.sum(1), 1)
    count, x, xx = known.sum(1), (known * off).sum(1), (known * off * off).sum(1)
    level = (xx * end.sum(1) - x * (end * off).sum(1)) / np.maximum(count * xx - x * x, 1)
    return np.clip(0.5 + level, 0, 0.5)


def _round_bottom(depth: Array, x: Array, y: Array, up: Array, row: Index, column: Index, pixel: Array) -> Array:
    """Return (n,) heights of the lowest points of circles fitted to the pixels above the ends; NaN where they do not
    lie on a circle or the columns beside them disagree."""
    rows = row[:, None] - np.arange(DEEP)
    z = depth[rows, column[:, None]].astype(np.float64)
    points = np.stack([x[column][:, None] * z, y[rows] * z, z], -1)
    height = points @ up
    away = np.linalg.norm(points - height[..., None] * up, axis=-1)
    joined = np.concatenate([np.ones((len(row), 1), bool), _alike(z[:, 1:], z[:, :-1])], 1).cumprod(1) > 0
    middle, radius, error = _circle(away - away[:, :1], height - height[:, :1], joined)
    ray = np.stack([away[:, 0], height[:, 0]], -1)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    outline = (radius - np.abs(middle[:, 0] * ray[:, 1] - middle[:, 1] * ray[:, 0])) / pixel
    is_round = (joined.sum(1) >= LEAST) & (middle[:, 0] > 0) & (error < ROUND * pixel)
    is_round &= (outline > NEAREST) & (outline < FARTHEST)
    return _median_beside(np.where(is_round, height[:, 0] + middle[:, 1] - radius, np.nan), column)


def _median_beside(values: Array, column: Index) -> Array:
    """Return (n,) the median of each value and its neighbours by column, NaN unless most are known."""
    order = np.argsort(column, kind="stable")
    padded = np.pad(values[order], SIDE, constant_values=np.nan)
    found = np.empty_like(values)
    found[order] = np.sort(np.lib.stride_tricks.sliding_window_view(padded, 2 * SIDE + 1), -1)[:, SIDE]
    return found


def _circle(x: Array, y: Array, known: NDArray[np.bool_]) -> tuple[Array, Array, Array]:
    """Fit circles to rows of points by least squares (Kasa 1976): (n, 2) centres, (n,) radii, (n,) rms distances."""
    scale = np.maximum(np.abs(np.where(known, y, 0)).max(1), 1e-12)
    x, y = np.where(known, x, 0) / scale[:, None], np.where(known, y, 0) / scale[:, None]
    terms = np.stack([2 * x, 2 * y, known.astype(float)], -1)
    square = terms.transpose(0, 2, 1) @ terms + 1e-12 * np.eye(3)
    a, b, c = np.linalg.solve(square, (terms.transpose(0, 2, 1) @ (x * x + y * y)[..., None]))[..., 0].T
    radius = np.sqrt(np.maximum(c + a * a + b * b, 0))
    off = np.where(known, np.hypot(x - a[:, None], y - b[:, None]) - radius[:, None], 0)
    error = np.sqrt((off * off).sum(1) / np.maximum(known.sum(1), 1))
    return np.stack([a, b], -1) * scale[:, None], radius * scale, error * scale


GUESSED = 50.0  # degrees by which a floor may lean in the picture of a frame, whose up direction nobody knows,
GIVEN_UP = 12.0  # and from a scene's up direction, or a given one
LIGHT = Light(shadow=True, angle=12)  # from the viewer's upper left, unless others are given: a shadow needs one


def up_and_floor(source: Frame | Scene) -> tuple[NDArray[np.float64], bool]:
    """Return the direction that is up, (3,) unit, world, and whether it is that of a floor which a frame shows.

    Of a scene it is `Scene.upright`; of a frame the normal of the floor that it shows, or what is known to be up, or up
    in its picture.
    """
    camera, pose = source.camera, np.asarray(source.pose)
    assert camera is not None, "only scenes without a frame have none"
    up = np.array([0, -np.sign(camera.fy), 0])
    if isinstance(source, Frame) and (floor := shown_floor(source, up, GUESSED)) is not None:
        return unit(pose[:3, :3] @ floor[:3]), True
    if source.upright is None:
        return unit(pose[:3, :3] @ up), False
    return unit(source.upright if source.upright @ (pose[:3, :3] @ up) > 0 else -source.upright), False


def ground_under(scene: Scene, up: tuple[float, float, float], height: float | None = None) -> NDArray[np.float64]:
    """Return the ground plane, (4,): its unit normal, upwards, and the height of the world's origin above it.

    up      (3,) unit, world
    height  of the ground, world units along up; None finds it. If the lowest object shows a floor, that is the ground,
            with the floor's slope.
    """
    normal = unit(up)
    if height is not None:
        return np.append(normal, -height)
    found = [_under(member, normal) for placed in scene.instances for member in placed.members]
    return min(found, key=lambda one: one[0], default=(0.0, np.append(normal, 0.0)))[1]


def _under(placed: Placed, up: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
    """Return the lowest position of a frame, a mesh or a cloud along up, world units (0 without points), and the ground
    plane under it, (4,)."""
    along, shift = placed.axes[:3, :3].T @ up, up @ placed.axes[:3, 3]
    if placed.content.frames and (floor := _floor(placed, up)) is not None:
        middle = placed.corners.mean(0)
        return up @ middle - (floor[:3] @ middle + floor[3]) / (floor[:3] @ up), floor
    lowest = float(_lowest(placed.content, along) + shift)
    return lowest, np.append(up, -lowest)


@singledispatch
def _lowest(points: PointObject, along: Array) -> float:
    """Return the lowest position of a frame, a cloud but for stray points, or a mesh along an axis (3,) of its own."""
    return lowest_point(points.frame, along)


@_lowest.register
def _(cloud: PointCloud, along: Array) -> float:
    if not len(cloud):
        return 0.0
    below = cloud.reach(0.5) * float(np.linalg.norm(along)) if cloud.splat == "ball" else 0.0
    return float(np.quantile(cloud.main_points @ along, SUNK) + cloud.origin @ along) - below


@_lowest.register
def _(mesh: Mesh, along: Array) -> float:
    return float((mesh.positions @ along).min(initial=0.0))


def _floor(placed: Placed, up: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the floor that a frame shows, (4,), world; None without one."""
    scale = float(np.cbrt(np.linalg.det(placed.axes[:3, :3])))
    rotation, origin = placed.axes[:3, :3] / scale, placed.axes[:3, 3]
    floor = shown_floor(placed.content.frame, rotation.T @ up, GIVEN_UP)
    if floor is None:
        return None
    normal = rotation @ floor[:3]
    return np.append(normal, scale * floor[3] - normal @ origin)


def seen_ground(ground: NDArray[np.float64], pose: NDArray[np.float64]) -> tuple[float, ...]:
    """Return a ground plane in the axes of a camera at a pose (4, 4): its normal, and the height of the eye over it."""
    return (*(pose[:3, :3].T @ ground[:3]).tolist(), float(ground[:3] @ pose[:3, 3] + ground[3]))
