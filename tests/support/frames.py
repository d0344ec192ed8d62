"""Small frames for the tests, 160x120, computed here: smooth ones and difficult ones."""

from __future__ import annotations

import numpy as np

import pointshade_gl as ps
from pointshade_gl.bench.tracing import as_frame, plane, sphere_and_wall, trace

CAMERA = ps.Camera(131.0, 131.0, 79.5, 59.5, 160, 120)


def checks(points: np.ndarray) -> np.ndarray:
    squares = np.floor(points[..., 0] * 8) + np.floor(points[..., 1] * 8)
    return np.where(squares[..., None] % 2 < 1, (0.7, 0.3, 0.2), (0.2, 0.4, 0.6))


def tilted_plane() -> ps.Frame:
    return as_frame(trace([plane((0.5, 0.2, -1), (0, 0, 1.5), checks)], CAMERA), CAMERA)


def sphere() -> ps.Frame:
    return as_frame(trace(sphere_and_wall()[:1], CAMERA), CAMERA)


def sphere_before_wall() -> ps.Frame:
    return as_frame(trace(sphere_and_wall(), CAMERA), CAMERA)


def step() -> ps.Frame:
    """Two walls facing the camera, 1.2 m and 2 m away."""
    near = trace([plane((0, 0, -1), (0, 0, 1.2), checks)], CAMERA)
    far = trace([plane((0, 0, -1), (0, 0, 2.0), checks)], CAMERA)
    left = np.arange(160) < 80
    color = np.where(left[:, None], as_frame(near, CAMERA).color, as_frame(far, CAMERA).color)
    return ps.Frame(color.astype(np.uint8), np.where(left, near.depth, far.depth), CAMERA)


def holes() -> ps.Frame:
    """The sphere in front of its wall with a fifth of the pixels missing."""
    frame = sphere_before_wall()
    missing = np.random.default_rng(7).random(frame.depth.shape) < 0.2
    return ps.Frame(frame.color, np.where(missing, 0, frame.depth), CAMERA)


def noisy() -> ps.Frame:
    """The sphere in front of its wall, seen by a sensor with 2 mm of noise."""
    frame = sphere_before_wall()
    noise = np.random.default_rng(11).normal(0, 0.002, frame.depth.shape)
    return ps.Frame(frame.color, np.where(frame.depth > 0, frame.depth + noise, 0), CAMERA)


def single_pixel() -> ps.Frame:
    depth = np.zeros((120, 160), np.float32)
    depth[40, 100] = 1.5
    return ps.Frame(np.full((120, 160, 3), (200, 120, 40), np.uint8), depth, CAMERA)


def all_missing() -> ps.Frame:
    return ps.Frame(np.full((120, 160, 3), 99, np.uint8), np.zeros((120, 160), np.float32), CAMERA)
