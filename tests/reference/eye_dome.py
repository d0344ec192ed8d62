"""Mirror of shaders/common/eye_dome.glsl."""

from __future__ import annotations

import numpy as np

from .texels import texel_or_zero

F = np.float32
EYE_DOME_REACH = F(1.4) / F(480)
EYE_DOME_STRENGTH = F(8)
EYE_DOME_NEAREST = F(1.06)


def eye_dome_reach(height):
    return np.maximum(EYE_DOME_REACH * F(height), F(1))


def eye_dome_step(z, other):
    nearer = np.asarray(z, F) / np.where(other == 0, F(1), np.abs(other))
    return np.where(other == 0, F(1), np.clip(nearer, F(1), EYE_DOME_NEAREST)).astype(F)


def eye_dome(surface_map, pixel, z):
    """Return the share of light at pixels (..., 2) of depth z (...), between their neighbours in (h, w, 4)."""
    reach = eye_dome_reach(surface_map.shape[0])
    straight, aslant = (int(np.floor(far + F(0.5))) for far in (reach, reach * np.sqrt(F(0.5))))
    steps = np.ones(np.shape(z), F)
    for k in range(9):
        side = np.array([k % 3 - 1, k // 3 - 1])
        if side.any():
            offset = side * (straight if side[0] * side[1] == 0 else aslant)
            steps *= eye_dome_step(z, texel_or_zero(surface_map, pixel + offset)[..., 3])
    return np.exp(-EYE_DOME_STRENGTH * np.log2(steps))
