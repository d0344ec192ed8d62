"""The small truth that lies beside the tests, and what of a picture disagrees with it."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
from PIL import Image

import pointshade_gl as ps

from .files import as_light, as_tuple
from .lamps import Lamp

FOLDER = Path(__file__).parent / "kept"
PICTURES = {
    "table": ("albedo_0", "sun_0", "sun_15", "point_0"),
    "stairs": ("albedo_0", "albedo_5", "albedo_30", "sun_0", "sun_5", "sun_30", "spot_15"),
    "corner": ("albedo_15", "spot_0", "sun_15", "sun_30"),
    "plant": ("albedo_0", "albedo_15", "sun_0", "point_15"),
}
FINE = 3  # pixels of a picture across one of the frame
UNASKED = 128  # alpha where a frame cannot know the truth
WRONG = 24  # steps of 255 by which a pixel lies outside of all that truth shows around it


class Kept:
    """A scene's frame, a second one from 30 degrees, its lamps, and its true pictures."""

    def __init__(self, name: str):
        arrays = np.load(FOLDER / f"{name}.npz")
        about = json.loads(str(arrays["about"]))
        fx, fy, cx, cy, width, height = about["camera"]
        self.name, self.camera = name, ps.Camera(fx, fy, cx, cy, int(width), int(height))
        self.poses = {int(yaw): np.array(pose) for yaw, pose in about["poses"].items()}
        self.lamps = {lamp["name"]: Lamp(**{k: as_tuple(v) for k, v in lamp.items()}) for lamp in about["lamps"]}
        self.frame = ps.Frame(arrays["albedo"], arrays["depth"], self.camera)
        self.second = ps.Frame(arrays["albedo_30"], arrays["depth_30"], self.camera, self.poses[30])

    def light(self, name: str) -> ps.Light:
        return as_light(self.lamps[name])

    def picture(self, lamp: str, yaw: int) -> np.ndarray:
        """(3 h, 3 w, 4) uint8, see keep.py."""
        with Image.open(FOLDER / f"{self.name}_{lamp}_{yaw}.png") as image:
            return np.asarray(image)


@cache
def scene(name: str) -> Kept:
    return Kept(name)


def wrong(picture: np.ndarray, truth: np.ndarray, steps: float = WRONG) -> np.ndarray:
    """(h, w) bool: pixels whose colour, before black, or alpha is not among those of truth around them.

    Around are 2/3 of a pixel of the frame, or of the picture where its pixels are larger.

    picture  (h, w, 4) uint8, of any size
    truth    (3 H, 3 W, 4) uint8, the same view. Where its alpha is UNASKED everything is right.
    """
    low, high = around(truth, max(2, round(2 * truth.shape[0] / FINE / picture.shape[0])))
    v, u = ((np.arange(n) + 0.5) * m / n - 0.5 for n, m in zip(picture.shape[:2], truth.shape[:2], strict=True))
    at = np.ix_(np.rint(v).astype(int), np.rint(u).astype(int))
    colour = before_black(picture)
    return ((colour < low[at] - steps) | (colour > high[at] + steps)).any(-1)


def around(truth: np.ndarray, reach: int) -> tuple[np.ndarray, np.ndarray]:
    """The least and the most of the colours and alphas within so many fine pixels, (h, w, 4)."""
    unasked = (truth[..., 3] == UNASKED)[..., None]
    colour = before_black(truth)
    low, high = (np.where(unasked, edge, colour) for edge in (-255, 510))
    for axis in (0, 1):
        low, high = np.minimum.reduce(shifted(low, axis, reach)), np.maximum.reduce(shifted(high, axis, reach))
    return low, high


def shifted(picture: np.ndarray, axis: int, reach: int) -> list[np.ndarray]:
    """The picture (h, w, 4), moved along an axis by -reach to reach pixels; edges are repeated."""
    at = np.arange(picture.shape[axis])
    return [np.take(picture, np.clip(at + k, 0, len(at) - 1), axis) for k in range(-reach, reach + 1)]


def before_black(picture: np.ndarray) -> np.ndarray:
    alpha = picture[..., 3:].astype(float)
    return np.concatenate([picture[..., :3] * alpha / 255, alpha], -1)


def at_size(truth: np.ndarray, height: int, width: int) -> np.ndarray:
    """The true picture at another size, by its nearest pixels; UNASKED is opaque."""
    v, u = ((np.arange(n) + 0.5) * m / n - 0.5 for n, m in zip((height, width), truth.shape[:2], strict=True))
    picture = truth[np.ix_(np.rint(v).astype(int), np.rint(u).astype(int))].copy()
    picture[..., 3][picture[..., 3] == UNASKED] = 255
    return picture
