"""Finds the bumps that sensors leave on planes: lumps, ripples and bands that are wider than the fits of normals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.noise import Noise

LATERAL = 0.8  # pixels by which depths are displaced, as in bumpy_planes.glsl
STEEP = 0.7  # share of the deviation from which on it may be all displacement
SHAPELESS = 4.0  # shape up to which a window shows a plane; noise has 1 to 5
GROWN = 2.0  # on a plane, a window of twice the width deviates less than so many times more
FEWEST, FEWEST_SHARE = 20, 0.12  # such windows, and their share of all: sensors .21 to .54, rough rock up to .07
CALM = 0.1  # the quantile of their deviations: all that are no plane deviate more
LARGEST = 4.0  # times the noise between near pixels that bumps may be: sensors .6 to 2; shelves 40
SHARED = 0.75  # correlation of near pixels from which on bumps may exceed steps: sensors 1 and more, stairs 0 to .5
LONELY = 0.8  # steps that bumps may be where near pixels share less: larger ones would be shared
ROUNDED = 0.33  # steps up to which rounding alone deviates: 0.29, if errors are random


def find_bumps(windows: NDArray[np.float32], noise: Noise) -> float:
    """Return the standard deviation of w = 1/z about the planes of a frame, 0.0 if it shows none or no bumps on them.

    windows  (rows, columns, 4) from bumpy_windows.frag with MEASURE: deviation of w in a window, negative where samples
             are missing, and in one twice as wide; shape; slope of w per pixel
    noise    of the frame
    """
    wide, far, shape, slope = np.moveaxis(windows.astype(np.float64), -1, 0)
    lateral = LATERAL * slope
    flat = (wide > 0) & (shape < SHAPELESS) & (far < GROWN * wide)
    if np.count_nonzero(flat) < max(FEWEST, FEWEST_SHARE * np.count_nonzero(wide > 0)):
        return 0.0
    facing = flat & (lateral < STEEP * wide)
    used = facing if np.count_nonzero(facing) >= FEWEST else flat
    own = np.sqrt(np.maximum(wide**2 - lateral**2, (1 - STEEP) ** 2 * wide**2))[used]
    bumps = float(np.quantile(own, CALM))
    near = noise.relative**2 * np.hypot(1, noise.correlation) / max(noise.sigma, 1e-30)
    rounded = noise.domain == "1/z" and bumps < ROUNDED * noise.step
    lonely = noise.correlation < SHARED and bumps > LONELY * noise.step
    return 0.0 if rounded or lonely or bumps > LARGEST * near else bumps
