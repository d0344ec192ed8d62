"""Films of a room with true depth, and what a network makes of them: another scale and shift in every picture."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

FOCAL = 0.87  # of the width


@dataclass
class Film:
    """colors (n, h, w, 3) uint8, depth (n, h, w) true z, raw (n, h, w) of a network, shots: the first of each."""

    colors: np.ndarray
    depth: np.ndarray
    raw: np.ndarray
    shots: tuple[int, ...]


def _texture(points, seed):
    """(..., 3) colours that depend on the place in the world."""
    rng, points = np.random.default_rng(seed), points.astype(np.float32)
    total = np.full(points.shape, 0.45, np.float32)
    for scale in (1.5, 4, 9, 20):
        waves = rng.normal(0, scale, (3, 3, 3)).astype(np.float32)
        phases = rng.uniform(0, 6.3, (3, 3)).astype(np.float32)
        for k in range(3):
            total += np.float32(0.05) * np.sin(points @ waves[k] + phases[k])
    return total


@lru_cache(maxsize=32)  # a film or two: what a network makes of one is made again and again
def picture(seed, center, turn, objects, size=(320, 240), part=None):
    """Colours and z of a room: a back wall, a floor, a side wall, balls; `objects` are (place, radius) in the room.

    part  from 0 to 1: which part of a wider picture
    """
    width, height = size
    v, u = np.mgrid[:height, :width].astype(float)
    u += 0 if part is None else np.rint((part - 0.5) * 0.8 * width)
    x, y = (u - (width - 1) / 2) / (FOCAL * width), (v - (height - 1) / 2) / (FOCAL * width)
    rays = np.stack([x, y, np.ones_like(x)], axis=2)
    c, s = np.cos(turn), np.sin(turn)
    world = rays @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    best = np.full((height, width), np.inf)
    kind = np.zeros((height, width), int)
    center, a = np.asarray(center, float), np.einsum("ijk,ijk->ij", world, world)
    planes = (((0.1, 0, 1), 4.5), ((0, 1, 0), 1.2), ((1, 0, 0), 2.6), ((-1, 0, 0), 2.6))
    with np.errstate(all="ignore"):
        for k, (normal, offset) in enumerate(planes):
            t = (offset - center @ normal) / (world @ np.array(normal, float))
            nearer = (t > 0.05) & (t < best)
            best, kind = np.where(nearer, t, best), np.where(nearer, k, kind)
        for k, (place, radius) in enumerate(objects):
            off = center - np.asarray(place, float)
            b, q = world @ off, off @ off - radius**2
            root = b * b - a * q
            t = (-b - np.sqrt(root)) / a
            nearer = (root > 0) & (t > 0.05) & (t < best)
            best, kind = np.where(nearer, t, best), np.where(nearer, 10 + k, kind)
    points = center + world * best[..., None]
    local = points.copy()
    for k, (place, _) in enumerate(objects):
        local[kind == 10 + k] -= np.asarray(place, float)
    colors = np.zeros((height, width, 3), np.float32)
    for one in np.unique(kind):
        at = kind == one
        colors[at] = _texture(local[at], seed + int(one))
    colors.flags.writeable = best.flags.writeable = False
    return colors, best


def film(seed, motion="still", frames=24, noise=0.02, cut=None, hand=True, size=(320, 240), kind="affine"):
    """Make a film; `cut` is the first picture of another room.

    motion  still, slide or turn of the camera, or crop: parts of a wide picture
    """
    rng = np.random.default_rng(seed)
    balls = [
        ((rng.uniform(-1.2, 1.2), rng.uniform(-0.3, 0.9), rng.uniform(1.8, 3.5)), rng.uniform(0.2, 0.45))
        for _ in range(4)
    ]
    colors, depth, raw = [], [], []
    for k in range(frames):
        room = seed if cut is None or k < cut else seed + 1000
        along = k / max(1, frames - 1)
        objects = list(balls)
        if room != seed:
            objects = [((-x, y, z - 0.4), r * 1.2) for (x, y, z), r in balls]
        if hand and 0.25 < along < 0.75:
            objects.append(((1.3 - 2.2 * (along - 0.25) / 0.5, 0.15, 0.75), 0.17))
        center = ((along - 0.5) * 1.2 if motion == "slide" else 0, 0, 0)
        turn = (along - 0.5) * 0.7 if motion == "turn" else 0
        color, z = picture(room, center, turn, tuple(objects), size, along if motion == "crop" else None)
        color = np.clip((color * rng.uniform(0.97, 1.03) + rng.normal(0, 0.008, color.shape)) * 255, 0, 255)
        inverse = 1 / z * (1 + rng.normal(0, noise, z.shape))
        if kind == "minmax":
            one = (inverse - inverse.min()) / np.ptp(inverse)
        elif kind == "8bit":
            one = np.rint((inverse - inverse.min()) / np.ptp(inverse) * 255).astype(np.uint8)
        else:
            one = inverse * np.exp(rng.uniform(-1, 1)) + rng.uniform(-0.3, 0.3)
        colors.append(color.astype(np.uint8))
        depth.append(z)
        raw.append(one if one.dtype == np.uint8 else one.astype(np.float32))
    return Film(np.array(colors), np.array(depth), np.array(raw), (0,) if cut is None else (0, cut))
