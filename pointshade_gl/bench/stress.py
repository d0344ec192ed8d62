"""What goes wrong with depth: noise, rounding, holes, odd units and odd cameras, each with increasing strength."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from zlib import crc32

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from ..scene.camera import Camera
from .scenes import MIDDLE
from .shapes import pose_at

Depth = NDArray[np.float64]
Spoil = Callable[[Depth, float, Generator], Depth]
BASELINE = 525 * 0.075  # focal length in pixels times metres between the eyes of a Kinect
BLOB_RADII = 2.0, 6.0  # pixels


def generator(seed: int, *names: str) -> Generator:
    """Random numbers that depend on their purpose (names), not on what was measured before."""
    return np.random.default_rng([seed, *(crc32(name.encode()) for name in names)])


def add_noise(depth: Depth, millimetres: float, random: Generator) -> Depth:
    return depth + random.normal(0, millimetres / 1000, depth.shape)


def add_smooth_noise(depth: Depth, millimetres: float, random: Generator) -> Depth:
    """Noise that neighbours share, like that of filters in cameras: blurred over 5 pixels, then as strong as before."""
    noise = random.normal(0, 1, depth.shape)
    for axis in (0, 1):
        noise = sum((w * np.roll(noise, k, axis) for k, w in enumerate((1, 4, 6, 4, 1))), np.zeros_like(noise))
    return depth + noise / noise.std() * millimetres / 1000


def add_outliers(depth: Depth, percent: float, random: Generator) -> Depth:
    """Single pixels that are wrong by up to a tenth of their depth."""
    wrong = random.random(depth.shape) * 100 < percent
    return np.where(wrong, depth * random.uniform(0.9, 1.1, depth.shape), depth)


def add_kinect_noise(depth: Depth, factor: float, random: Generator) -> Depth:
    """Nguyen, Izadi, Lovell 2012, axial part."""
    return depth + random.normal(0, factor, depth.shape) * (0.0012 + 0.0019 * (depth - 0.4) ** 2)


def round_depth(depth: Depth, millimetres: float, _: Generator) -> Depth:
    return np.round(depth * 1000 / millimetres) * millimetres / 1000


def round_disparity(depth: Depth, pixels: float, _: Generator) -> Depth:
    steps = np.maximum(np.round(BASELINE / np.where(depth > 0, depth, np.inf) / pixels), 1)
    return BASELINE / (steps * pixels)


def drop_pixels(depth: Depth, percent: float, random: Generator) -> Depth:
    return np.where(random.random(depth.shape) * 100 < percent, 0, depth)


def drop_blobs(depth: Depth, percent: float, random: Generator) -> Depth:
    """Discs of 2 to 6 pixels radius until that share of the picture is gone."""
    h, w = depth.shape
    gone = np.zeros((h, w), bool)
    while gone.mean() * 100 < percent:
        for _ in range(max(1, h * w // 20_000)):
            v, u, radius = random.integers(h), random.integers(w), random.uniform(*BLOB_RADII)
            top, left = max(v - 6, 0), max(u - 6, 0)
            rows, columns = np.ogrid[top : min(v + 7, h), left : min(u + 7, w)]
            gone[top : v + 7, left : u + 7] |= (rows - v) ** 2 + (columns - u) ** 2 <= radius**2
    return np.where(gone, 0, depth)


def drop_both(depth: Depth, percent: float, random: Generator) -> Depth:
    """Half of the share are single pixels, half are blobs."""
    return drop_blobs(drop_pixels(depth, percent / 2, random), percent / 2, random)


def scale_to(depth: Depth, distance: float, _: Generator, unit: float = 1) -> Depth:
    """The whole scene made so large or small that its middle is `distance` metres away; depth in `unit` per metre."""
    return depth * (distance * unit / MIDDLE)


def everything(depth: Depth, factor: float, random: Generator) -> Depth:
    """A sensor's bad day: Kinect noise, millimetres, 5 % holes."""
    return drop_both(round_depth(add_kinect_noise(depth, factor, random), 1, random), 5, random)


def untouched(depth: Depth, _: float, __: Generator) -> Depth:
    return depth


def telephoto(camera: Camera, factor: float) -> tuple[Camera, ArrayLike]:
    """A longer lens from further away: the scene's middle keeps its size in pixels."""
    lens = Camera(camera.fx * factor, camera.fy * factor, camera.cx, camera.cy, camera.width, camera.height)
    return lens, pose_at((0, 0, MIDDLE * (1 - factor)))


def wide_angle(camera: Camera, factor: float) -> tuple[Camera, ArrayLike]:
    """A shorter lens at the same place."""
    lens = Camera(camera.fx / factor, camera.fy / factor, camera.cx, camera.cy, camera.width, camera.height)
    return lens, np.eye(4)


@dataclass(frozen=True)
class Condition:
    """One kind of damage to depth, at one strength."""

    title: str
    spoil: Spoil
    strength: float = 0.0


@dataclass(frozen=True)
class Stress:
    """One kind of damage at increasing strengths: to the depth (`spoil`), or to the camera (`look`)."""

    title: str
    axis: str
    strengths: tuple[float, ...]
    spoil: Spoil = untouched
    look: Callable[[Camera, float], tuple[Camera, ArrayLike]] | None = None


CONDITIONS = {
    "clean": Condition("clean", untouched),
    "16-bit": Condition("16-bit steps of 0.2 mm", round_depth, 0.2),
    "1mm-steps": Condition("1 mm steps", round_depth, 1),
    "1mm-noise": Condition("1 mm noise", add_noise, 1),
    "kinect": Condition("Kinect noise", add_kinect_noise, 1),
    "disparity": Condition("1/8 px disparity", round_disparity, 1 / 8),
    "holes-5": Condition("5 % holes", drop_both, 5),
    "holes-20": Condition("20 % holes", drop_both, 20),
    "bad-day": Condition("Kinect, 1 mm steps, 5 % holes", everything, 1),
}

DISTANCES = (0.01, 0.1, 1.0, 10.0, 100.0, 1000.0)
SHARES = (1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 40.0)
STRESSES = {
    "noise": Stress("Gaussian noise", "sigma, mm", (0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30), add_noise),
    "smooth-noise": Stress("noise shared by neighbours", "sigma, mm", (0.03, 0.1, 0.3, 1, 3, 10, 30), add_smooth_noise),
    "sensor-noise": Stress("Kinect noise", "times a Kinect's", (0.03, 0.1, 0.3, 1, 2, 4, 8), add_kinect_noise),
    "steps": Stress("depth in steps", "step, mm", (0.02, 0.05, 0.2, 0.5, 1, 2, 5, 10, 20), round_depth),
    "disparity-steps": Stress(
        "disparity in steps", "step, px", (1 / 256, 1 / 64, 1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1), round_disparity
    ),
    "outliers": Stress("wild pixels", "wrong, %", (0.1, 0.3, 1, 3, 10, 20), add_outliers),
    "hole-pixels": Stress("missing pixels", "missing, %", SHARES, drop_pixels),
    "hole-blobs": Stress("missing blobs", "missing, %", SHARES, drop_blobs),
    "distance-m": Stress("scene scaled, metres", "distance, m", DISTANCES, scale_to),
    "distance-mm": Stress("scene scaled, millimetres", "distance, m", DISTANCES, partial(scale_to, unit=1000)),
    "telephoto": Stress("long lens", "times the focal length", (1, 4, 16, 64, 256, 1024), look=telephoto),
    "wide-angle": Stress("short lens", "divisor of the focal length", (1, 2, 4, 8, 16), look=wide_angle),
}
