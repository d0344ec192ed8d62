"""The chain of gpu/surface/refinement.py and gpu/surface/refinement.py on the CPU, around the mirrored functions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .flying_pixel_mixing import find_mixing
from .flying_pixel_snap import needs_snap, snap_sample
from .inverse_depth import pixel_grid
from .picture import rescale_position
from .upsample_vote import GUIDE_SPAN, calm_around, is_calm, is_cut_out, mean_color, mix_facets, vote_surface

F = np.float32


def guide_colors(picture: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Mean colours of the samples of a depth picture of this size (width, height): (height, width, 3) float32.

    picture (h, w, 3|4) float32 0..1
    """
    small = np.array(size, F)
    span = GUIDE_SPAN * F(picture.shape[1]) / small[0]
    return mean_color(picture, _pixels(size).astype(F), small, span).reshape(size[1], size[0], 3)


def snapped(
    depth: np.ndarray,
    surface: np.ndarray,
    guide: np.ndarray,
    intrinsics: np.ndarray,
    estimate: Callable[[np.ndarray], np.ndarray],
) -> np.ndarray:
    """The surface (h, w, 4) of a depth picture (h, w), its mixed samples snapped. guide: see `guide_colors`.

    estimate  the surface of a depth picture
    """
    mixing = find_mixing(depth, pixel_grid(depth))
    unmixed = estimate(np.where(mixing[..., 0] > 0, F(0), depth))
    every = _pixels(depth.shape[::-1])
    pixel = every[needs_snap(unmixed, mixing, every, intrinsics)]
    here = pixel[:, 1], pixel[:, 0]
    found = snap_sample(unmixed, guide, pixel, F(1) / depth[here], intrinsics)
    result = unmixed.copy()
    result[here] = np.where(found[:, 3:] > 0, found, surface[here])
    return result


def upsampled(
    surface: np.ndarray, guide: np.ndarray, picture: np.ndarray, intrinsics: np.ndarray, size: tuple[int, int]
) -> np.ndarray:
    """The surface (h, w, 4) at a larger size (width, height), voted by the picture (h, w, 3|4) 0..1."""
    large, small = np.array(size, F), np.array(surface.shape[1::-1], F)
    calm = is_calm(surface, _pixels(surface.shape[1::-1]), intrinsics).reshape(surface.shape[:2])
    pixel = _pixels(size).astype(F)
    at = rescale_position(pixel, large, small)
    result = mix_facets(surface, at, intrinsics)
    edge = np.flatnonzero(calm_around(calm, at) == 0)
    color = mean_color(picture, pixel[edge], large, F(picture.shape[1]) / large[0])
    result[edge] = vote_surface(surface, guide, at[edge], color, intrinsics)
    result[is_cut_out(picture, pixel, large)] = 0
    return result.reshape(size[1], size[0], 4)


def _pixels(size: tuple[int, ...]) -> np.ndarray:
    """(w * h, 2) int, row by row."""
    return np.stack(np.meshgrid(np.arange(size[0]), np.arange(size[1])), -1).reshape(-1, 2)
