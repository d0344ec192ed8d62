"""Decides whether splats have rims: pixels at which a surface ends, drawn by its outline (shaders/common/rims.glsl)."""

from __future__ import annotations

import numpy as np


def has_rims(sizes: np.ndarray, splat: str) -> bool:
    """Return whether splats of these sizes, (1,) or (h*w,) source pixels, and shape have rims: squares of 1 do."""
    return splat == "footprint" and bool((sizes == 1).all())
