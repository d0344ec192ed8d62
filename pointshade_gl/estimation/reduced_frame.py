"""The reduced copy of a frame that its pose is found by: points, normals and blurred brightness on a coarse grid."""

from __future__ import annotations

from copy import copy
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scene.camera import Camera

LONGER_SIDE = 320  # pixels of the copy, about
BLURS = 3  # how often the brightness is blurred, each time twice as wide
LEAST_NOISE = 0.015  # of brightness: what a compressed picture shows where there is nothing
FLAT = 0.001  # contrast of brightness that is none, where noise was rounded away
_KERNEL = np.array([1, 4, 6, 4, 1], np.float32) / 16
_IMPULSE = np.zeros((65, 65), np.float32)
_IMPULSE[32, 32] = 1
Floats = NDArray[np.float32]


class Brightness(NamedTuple):
    """Blurred brightness and its slope."""

    maps: Floats  # (h * w, 3): the brightness, its change to the next column, and to the next row
    slope_noise: float  # standard deviation of either slope on a surface of one colour

    @property
    def value(self) -> Floats:
        """Return the brightness alone, (h * w,)."""
        return self.maps[:, 0]


class ReducedFrame:
    """What a frame's pose is found from.

    camera      of the reduced picture, (h, w)
    points      (h * w, 3) float32, camera axes
    normals     (h * w, 3) float32, unit, camera axes; 0 where the point is not used: missing, at a step, seen flat
    brightness  (h, w) float32, square root of the linear luminance, 0 to 1; None without colours
    """

    def __init__(self, camera: Camera, surface: Floats, brightness: Floats | None):
        """surface: (h, w, 4), unit normal and depth, 0 where the point is not used."""
        self.camera, self.brightness = camera, brightness
        depth = surface[..., 3:]
        self.points = (camera.rays().astype(np.float32) * depth).reshape(-1, 3)
        self.normals = np.where(depth > 0, surface[..., :3], np.float32(0)).reshape(-1, 3)
        self._is_known = depth.reshape(-1) > 0
        self._samples: dict[int, NDArray[np.intp]] = {}

    @cached_property
    def planes(self) -> Floats:
        """Return each point's normal and the distance of its plane from the camera, (h * w, 4)."""
        distances = np.einsum("nk,nk->n", self.normals, self.points)
        return np.concatenate([self.normals, distances[:, None]], -1)

    @property
    def points_known(self) -> int:
        """Return the number of points that are used."""
        return int(np.count_nonzero(self._is_known))

    @cached_property
    def middle(self) -> NDArray[np.float64]:
        """Return the median of the points, (3,) camera axes; 0 without any."""
        known = self.points[self._is_known]
        return np.median(known, axis=0).astype(np.float64) if len(known) else np.zeros(3)

    @cached_property
    def radius(self) -> float:
        """Return the median distance of the points from their middle; 0 without any."""
        known = self.points[self._is_known]
        return float(np.median(np.linalg.norm(known - self.middle, axis=1))) if len(known) else 0.0

    @cached_property
    def is_textured(self) -> bool:
        """Return whether there is more in the brightness than noise."""
        if self.brightness is None:
            return False
        return float(np.quantile(np.abs(self.texture), 0.9)) > self._noise + FLAT

    def without_brightness(self) -> ReducedFrame:
        """Return the same frame without its brightness."""
        result = copy(self)
        result.brightness = None
        return result

    def samples(self, step: int) -> NDArray[np.intp]:
        """Return the numbers of the points that are used, on every step-th column and row."""
        if step not in self._samples:
            is_known = self._is_known.reshape(self.camera.height, self.camera.width)
            v, u = np.nonzero(is_known[step // 2 :: step, step // 2 :: step])
            self._samples[step] = (v * step + step // 2) * self.camera.width + u * step + step // 2
        return self._samples[step]

    def pixels(self, at: NDArray[np.floating]) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
        """Return the pixels in which points (..., 3) in camera axes are seen, 0 outside, and whether inside, (...)."""
        camera = self.camera
        with np.errstate(all="ignore"):
            u, v = (np.rint(place) for place in camera.pixel_at(at[..., 0], at[..., 1], at[..., 2]))
            inside = (at[..., 2] > 0) & (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height)
            return np.where(inside, v * camera.width + u, 0).astype(np.intp), inside

    def blurred(self, level: int) -> Brightness:
        """Return the brightness at a level of blur, 0 to BLURS - 1. It must be known."""
        return self._blurred[level]

    @cached_property
    def _blurred(self) -> list[Brightness]:
        assert self.brightness is not None
        levels = []
        for shown, impulse in zip(_blurs(self.brightness), _blurs(_IMPULSE), strict=True):
            along_v, along_u = np.gradient(shown)
            gain = float(np.sqrt((np.gradient(impulse, axis=1) ** 2).sum()))
            levels.append(Brightness(np.stack([shown, along_u, along_v], -1).reshape(-1, 3), gain * self._noise))
        return levels

    @cached_property
    def texture(self) -> Floats:
        """Return the brightness without what is finer or coarser than some pixels, (h * w,). It must be known."""
        return self._blurred[0].value - self._blurred[-1].value

    @cached_property
    def texture_noise(self) -> float:
        """Return the standard deviation of the texture of a surface of one colour."""
        finest, *_, coarsest = _blurs(_IMPULSE)
        return float(np.sqrt(((finest - coarsest) ** 2).sum())) * max(self._noise, LEAST_NOISE)

    @cached_property
    def _noise(self) -> float:
        return 0.0 if self.brightness is None else picture_noise(self.brightness)


def picture_noise(picture: Floats) -> float:
    """Return the standard deviation of a picture's noise, from the median size of its second differences.

    The mask of Immerkaer 1996 hardly answers to structure; the median leaves out where it does.
    """
    rows = picture[:-2] - 2 * picture[1:-1] + picture[2:]
    mask = rows[:, :-2] - 2 * rows[:, 1:-1] + rows[:, 2:]
    return 1.4826 * float(np.median(np.abs(mask))) / 6 if mask.size else 0.0


def _blurs(picture: Floats) -> list[Floats]:
    """Return a picture at each level of blur.

    Each level blurs the last one by a kernel with gaps (a trous), so that all keep the size of the picture.
    """
    levels = []
    for level in range(BLURS):
        picture = _blur(picture, 1 << level)
        levels.append(picture)
    return levels


def _blur(picture: Floats, gap: int) -> Floats:
    """Blur by a kernel of five weights, so many pixels apart; the border is repeated."""
    for axis in (0, 1):
        pad = [(2 * gap, 2 * gap) if k == axis else (0, 0) for k in range(2)]
        wide, count = np.pad(picture, pad, "edge"), picture.shape[axis]
        parts = (wide.take(range(k * gap, k * gap + count), axis) for k in range(5))
        picture = sum(weight * part for weight, part in zip(_KERNEL, parts, strict=True))  # type: ignore[assignment]
    return picture
