"""Small sets of views for the tests: a sphere before a wall, traced from several places round it."""

from __future__ import annotations

import numpy as np

import pointshade_gl as ps
from pointshade_gl.bench.tracing import as_frame, sphere_and_wall, trace

from .frames import CAMERA

PIVOT = (0.05, 0.02, 1.7)
YAWS = (-12, 0, 14)


def pose_at(yaw: float, pitch: float = 0.0) -> np.ndarray:
    return ps.orbit_pose(None, PIVOT, yaw, pitch)


def three_views() -> list[ps.Frame]:
    """From the left, from ahead, and by a larger camera from the right."""
    cameras = CAMERA, CAMERA, CAMERA.resized(200, 150)
    return [seen_from(pose_at(yaw, yaw / 3), camera) for yaw, camera in zip(YAWS, cameras, strict=True)]


def seen_from(pose: np.ndarray, camera: ps.Camera = CAMERA) -> ps.Frame:
    return as_frame(trace(sphere_and_wall(), camera, pose), camera, pose)


def noisy(frame: ps.Frame, seed: int) -> ps.Frame:
    """With 3 mm of noise, and flying pixels beside the sphere: half of those between it and the wall."""
    rng, z = np.random.default_rng(seed), frame.depth
    padded = np.pad(z, 1, "edge")
    around = np.stack(
        [padded[1 + y : 1 + y + z.shape[0], 1 + x : 1 + x + z.shape[1]] for y in (-1, 0, 1) for x in (-1, 0, 1)]
    )
    flying = (around.max(0) > 1.1 * around.min(0)) & (rng.random(z.shape) < 0.5)
    mixed = around.min(0) + rng.random(z.shape) * (around.max(0) - around.min(0))
    return ps.Frame(frame.color, np.where(flying, mixed, z + rng.normal(0, 0.003, z.shape)), frame.camera, frame.pose)


def replaced(frame: ps.Frame, **changes) -> ps.Frame:
    values = {"color": frame.color, "depth": frame.depth, "camera": frame.camera, "pose": frame.pose}
    return ps.Frame(**(values | changes))
