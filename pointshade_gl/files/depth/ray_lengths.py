"""Recognises depth that stores each pixel's ray length instead of z: planes are flat in only one of the two.

A plane has 1/z linear in pixels; the ray to the same point is n = |((u - cx)/fx, (v - cy)/fy, 1)| times as long, so of
lengths r it is n/r that is linear. Renderers write r (SceneNet RGB-D, InteriorNet, Hypersim), sensors z. Only depth as
smooth as a renderer's shows it; all other is left as it is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene.camera import Camera

_ACROSS = 5  # windows along the picture's shorter side; those a quarter of one apart are looked at
_POINTS = 12  # of a window along a side
_FLAT = 0.25  # of what the other reading would bend: so flat a plane is
_BENT = (0.6, 1.6)
_LEAST = 2e-4  # of the depth: a bend that can be seen
_FEWEST, _SHARE = 12, 0.8  # windows that show a plane, and how many of them must agree


@np.errstate(all="ignore")
def is_ray_length(depth: NDArray[np.floating], camera: Camera) -> bool:
    """Return whether (h, w) depth, 0 where unknown, is the length of rays: only as such are its planes flat."""
    side = min(depth.shape) // _ACROSS
    step = max(1, side // _POINTS)
    if side < _POINTS // 2:
        return False
    v, u = np.mgrid[0 : depth.shape[0] : step, 0 : depth.shape[1] : step]
    x, y = camera.ray_at(u, v)
    longer = np.sqrt(1 + x**2 + y**2)
    values = depth[::step, ::step].astype(np.float64)
    inverse = np.where(values > 0, 1 / values, np.nan)
    as_z, as_ray, bend = (_bends(one) for one in (inverse, longer * inverse, longer))
    seen = np.isfinite(as_z) & (bend > _LEAST)
    rays = seen & (as_ray < _FLAT * bend) & (as_z > _BENT[0] * bend) & (as_z < _BENT[1] * bend)
    axes = seen & (as_z < _FLAT * bend) & (as_ray > _BENT[0] * bend) & (as_ray < _BENT[1] * bend)
    shown = int(np.count_nonzero(rays) + np.count_nonzero(axes))
    return shown >= _FEWEST and int(np.count_nonzero(rays)) > _SHARE * shown


def _bends(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n,) how far the values of each window lie off a plane, over their mean; NaN where some are unknown."""
    windows = np.lib.stride_tricks.sliding_window_view(values, (_POINTS, _POINTS))
    windows = windows[:: _POINTS // 4, :: _POINTS // 4].reshape(-1, _POINTS**2)
    y, x = np.mgrid[:_POINTS, :_POINTS].reshape(2, -1) - (_POINTS - 1) / 2
    terms = np.stack([np.ones_like(x), x, y], axis=1)
    off = windows - windows @ np.linalg.pinv(terms).T @ terms.T
    return np.sqrt(np.square(off).mean(axis=1)) / np.abs(windows.mean(axis=1))
