"""Views of traced scenes whose poses are off, and how far things are from where they belong."""

from __future__ import annotations

from functools import partial

import numpy as np

import pointshade_gl as ps
from pointshade_gl.bench.tracing import TracedSurface, as_frame, patch, plane, sphere, trace

CAMERA = ps.Camera(150, 150, 79.5, 59.5, 160, 120)
MIDDLE = np.array([0.0, 0.1, 2.0])
YAWS = (0.0, -16.0, 17.0, 9.0, -7.0)


def patterned(points: np.ndarray) -> np.ndarray:
    """Waves that repeat themselves."""
    x, y, z = np.moveaxis(points, -1, 0)
    tones = [np.sin(23 * x + 5 * y) * np.cos(19 * y - 9 * z), np.cos(31 * z + 7 * x), np.sin(11 * x - 13 * y + 5 * z)]
    return 0.4 + 0.2 * np.stack(tones, -1)


def rippled(points: np.ndarray, count: int, widest: float) -> np.ndarray:
    """A sum of so many waves, of up to about so many radians a metre."""
    rng = np.random.default_rng(8)
    ripples, phases = rng.normal(0, widest, (3, count)), rng.uniform(0, 6, count)
    tone = 0.45 + 0.24 / np.sqrt(count) * np.sin(points @ ripples + phases).sum(-1)
    return np.repeat(tone[..., None], 3, -1).clip(0.05, 0.95)


painted = partial(rippled, count=48, widest=20)  # nowhere the same
waves = partial(rippled, count=16, widest=12)  # nearly repeats itself, also upside down


def plain(points: np.ndarray) -> np.ndarray:
    return np.full((*points.shape[:-1], 3), 0.5)


def tiled(points: np.ndarray) -> np.ndarray:
    """Tiles of 25 cm."""
    return np.where(np.floor(4 * points).sum(-1, keepdims=True) % 2 > 0, [0.7, 0.5, 0.35], [0.45, 0.33, 0.2])


def corner(paint=painted) -> list[TracedSurface]:
    """A floor, a wall, two boxes' fronts and a ball."""
    return [
        plane((0, -1, -0.1), (0, 0.7, 2), paint),
        plane((0.3, 0, -1), (0, 0, 3), paint),
        patch((-0.5, 0.4, 2.1), (0.25, 0, 0.1), (0, 0.3, 0), paint),
        patch((0.45, 0.35, 1.8), (0.15, 0, -0.12), (0, 0.35, 0), paint),
        sphere((0.05, 0.35, 2.2), 0.3, paint),
    ]


def one_plane(paint=plain) -> list[TracedSurface]:
    return [plane((0.2, -0.1, -1), (0, 0, 2.2), paint)]


def two_planes(paint=plain) -> list[TracedSurface]:
    return [plane((0.9, 0, -1), (0, 0, 2), paint), plane((-0.9, 0, -1), (0, 0, 2), paint)]


def ball_before_plane(paint=plain) -> list[TracedSurface]:
    return [plane((0, 0, -1), (0, 0, 2.6), paint), sphere((0, 0.1, 1.8), 0.45, paint)]


def views(scene: list[TracedSurface], count: int = 3, noise: float = 0.0) -> list[ps.Frame]:
    """Frames of a scene at their true poses. noise: of the depth at 1 m, m; it grows with the square."""
    rng = np.random.default_rng(4)
    return [view_from(scene, ps.orbit_pose(None, MIDDLE, yaw, yaw / 4), noise, rng) for yaw in YAWS[:count]]


def view_from(scene: list[TracedSurface], pose: np.ndarray, noise: float, rng: np.random.Generator) -> ps.Frame:
    """What a camera at a pose sees. noise: of the depth at 1 m, m."""
    frame = as_frame(trace(scene, CAMERA, pose), CAMERA, pose)
    depth = frame.depth + noise * frame.depth**2 * rng.normal(0, 1, frame.depth.shape)
    color = np.clip(frame.color + rng.normal(0, 2 * bool(noise), frame.color.shape), 0, 255).astype(np.uint8)
    return ps.Frame(color, np.maximum(depth, 0), CAMERA, pose)


def turned(degrees: float, axis: np.ndarray) -> np.ndarray:
    """(3, 3) a turn about an axis."""
    x, y, z = axis / np.linalg.norm(axis)
    across, angle = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), np.radians(degrees)
    return np.eye(3) + np.sin(angle) * across + (1 - np.cos(angle)) * across @ across


def disturbed(frames: list[ps.Frame], metres: float, degrees: float, seed: int = 1) -> list[ps.Frame]:
    """Frames whose poses, but the first one's, are off by so much in some direction."""
    rng, result = np.random.default_rng(seed), frames[:1]
    for frame in frames[1:]:
        shift, axis, pose = rng.normal(0, 1, 3), rng.normal(0, 1, 3), frame.pose.copy()
        pose[:3, :3] = turned(degrees, axis) @ pose[:3, :3]
        pose[:3, 3] += metres * shift / np.linalg.norm(shift)
        result.append(frame.at(pose))
    return result


def off(frame: ps.Frame, true: ps.Frame) -> float:
    """How far the points of a frame lie from where they belong: the root of the mean square, m."""
    points = true.camera.rays()[::4, ::4].reshape(-1, 3) * true.depth[::4, ::4].reshape(-1, 1)
    difference = frame.pose - true.pose
    return float(np.sqrt(((points @ difference[:3, :3].T + difference[:3, 3]) ** 2).sum(-1).mean()))


def off_surface(frame: ps.Frame, true: ps.Frame) -> float:
    """The same along the normals: what lies in the wrong place of its own plane counts as right."""
    hits = true.depth
    rays = true.camera.rays()
    points = rays * hits[..., None]
    normals = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    some = slice(8, -8, 6), slice(8, -8, 6)
    difference = frame.pose - true.pose
    shift = points[some] @ difference[:3, :3].T + difference[:3, 3]
    along = (shift * (normals[some] @ true.pose[:3, :3].T)).sum(-1)
    return float(np.median(np.abs(along)))
