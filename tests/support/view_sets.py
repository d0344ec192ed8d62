"""Small sets of views for the tests: a sphere before a wall, traced from several places round it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

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


def write_views(folder: Path, views: list[ps.Frame], lost: tuple[int, ...] = ()) -> Path:
    """A folder with a sequence of views, their depth in millimetres; those in `lost` have no pose."""
    for name in ("color", "depth", "pose"):
        (folder / name).mkdir(parents=True)
    camera = views[0].camera
    (folder / "intrinsics.txt").write_text(f"{camera.fx} 0 {camera.cx}\n0 {camera.fy} {camera.cy}\n0 0 1\n")
    for k, view in enumerate(views):
        Image.fromarray(view.color).save(folder / "color" / f"{k}.png")
        Image.fromarray(np.round(view.depth * 1000).astype(np.uint16)).save(folder / "depth" / f"{k}.png")
        np.savetxt(folder / "pose" / f"{k}.txt", np.full((4, 4), -np.inf) if k in lost else view.pose)
    return folder
