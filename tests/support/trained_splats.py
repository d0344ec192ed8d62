"""Trained splats of known shape: a ball over a floor, made of discs that are partly transparent."""

import numpy as np

import pointshade_gl as ps

BALL, RADIUS = np.array([0.0, -0.6, 0.0]), 0.5


def gaussians_of(normals, wide, rng, degree=0, **more):
    """Flat splats across normals, as wide as that."""
    count = len(normals)
    half = np.stack([-normals[:, 1], normals[:, 0], np.zeros(count), 1 + normals[:, 2]], -1)  # turns z to the normal
    half[np.linalg.norm(half, axis=1) < 1e-6] = (1, 0, 0, 0)
    scales = np.stack(
        [wide * rng.uniform(0.6, 1.4, count), wide * rng.uniform(0.6, 1.4, count), np.full(count, wide / 15)], -1
    )
    harmonics = rng.normal(0, 0.15, (count, {1: 3, 2: 8, 3: 15}[degree], 3)) if degree else None
    base = rng.uniform(0.2, 0.9, (count, 3))
    return ps.Gaussians(scales, half, rng.uniform(0.4, 0.95, count), base, harmonics, **more)


def ball_over_floor(count=1500, seed=5, degree=0, floor=True, wide=0.06, **more):
    """A cloud, y down, of a ball and a square floor at y = 0."""
    rng = np.random.default_rng(seed)
    ball = rng.normal(size=(count, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    places, normals = BALL + RADIUS * ball, ball
    if floor:
        level = np.stack(
            [rng.uniform(-1.5, 1.5, 2 * count), np.zeros(2 * count), rng.uniform(-1.5, 1.5, 2 * count)], -1
        )
        places = np.concatenate([places, level])
        normals = np.concatenate([normals, np.broadcast_to([0.0, -1, 0], level.shape)])
    held = gaussians_of(normals, wide, rng, degree, **more)
    return ps.PointCloud(places.astype(np.float32), gaussians=held, splat="gaussian", shading="auto")


def looking_down(size=(96, 72), away=3.0, fov=40):
    """A camera that sees it all, and its pose."""
    eye = np.array([0.5, -1.4, -away])
    ahead = BALL + np.array([0, 0.25, 0]) - eye
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0, -1.0, 0])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([right, np.cross(ahead, right), ahead], 1), eye
    return ps.Camera.from_fov(fov, *size), pose
