"""A room of painted planes with a ball: exact depth and colours, whose edges lie on each other."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from PIL import Image

FOCAL, WIDTH, HEIGHT = 250.0, 320, 240
PAINTS = np.array([[210, 190, 160], [120, 90, 60], [190, 140, 130], [230, 228, 225], [140, 160, 200], [200, 60, 50]])
CAMERA = {"fx": FOCAL, "fy": FOCAL, "cx": (WIDTH - 1) / 2, "cy": (HEIGHT - 1) / 2, "width": WIDTH, "height": HEIGHT}
BALL, RADIUS = np.array([0.3, 0.4, 2.1]), 0.4


def seen(offset: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """(h, w, 3) uint8 colours and (h, w) z in metres, from a camera so many metres to the right."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    ray = np.stack([(u - CAMERA["cx"]) / FOCAL, (v - CAMERA["cy"]) / FOCAL, np.ones((HEIGHT, WIDTH))], axis=2)
    turned = ray @ np.array([[0.98, 0, -0.2], [0, 1, 0], [0.2, 0, 0.98]])  # walls are seen at a slant
    x, y, z = np.moveaxis(turned, 2, 0)
    walls = [(z, 3.2), (y, 1.0), (x, 1.3 - offset), (-y, 1.2), (-x, 1.6 + offset)]
    with np.errstate(divide="ignore"):
        lengths = np.stack([np.where(side > 0, at / side, np.inf) for side, at in walls])
    length, wall = lengths.min(axis=0), lengths.argmin(axis=0)
    center = BALL - (offset, 0, 0)
    square, half = (turned**2).sum(2), turned @ center
    inside = half**2 - square * (center @ center - RADIUS**2)
    near = np.where(inside > 0, (half - np.sqrt(inside.clip(0))) / square, np.inf)
    wall, length = np.where(near < length, 5, wall), np.minimum(near, length)
    tiles = np.floor((turned * length[..., None] + (offset, 0, 0)) / 0.3).sum(axis=2) % 2
    return (PAINTS[wall] * (0.7 + 0.3 * tiles)[..., None]).astype(np.uint8), length


def millimetres(depth: np.ndarray) -> np.ndarray:
    return np.rint(depth * 1000).astype(np.uint16)


def write(folder: Path, color: np.ndarray, depth: np.ndarray, camera: dict | None = CAMERA) -> Path:
    """color.png, depth.png in millimetres, and camera.json."""
    folder.mkdir(parents=True, exist_ok=True)
    Image.fromarray(color).save(folder / "color.png")
    Image.fromarray(millimetres(depth)).save(folder / "depth.png")
    if camera is not None:
        (folder / "camera.json").write_text(json.dumps(camera))
    return folder
