"""Depth pictures of a room made of planes, and what sensors and networks make of it."""

import numpy as np

F = 525 / 4  # pixels
_RANDOM = np.random.default_rng(8)


def room(height=120, width=160, noise=0.0):
    """(h, w) z in metres: floor, ceiling, two walls, a far wall and a box, 1.0 to 5 m away."""
    v, u = np.mgrid[:height, :width]
    x, y = (u - (width - 1) / 2) / F, (v - (height - 1) / 2) / F
    with np.errstate(divide="ignore"):
        sides = [distance / side.clip(0) for distance, side in ((1.2, y), (1.4, -y), (1.5, x), (1.3, -x))]
    z = np.minimum.reduce([*sides, np.full_like(x, 5.0), 4.5 / (1 + 0.3 * x + 0.1 * y)])
    box = (np.abs(x + 0.1) < 0.12) & (np.abs(y - 0.25) < 0.12)
    z[box] = (1.6 / (1 + 0.9 * x))[box]
    return z * (1 + noise * _RANDOM.standard_normal(z.shape))


def stretched(values, top=255):
    """Values laid from 0 to the top, as whole numbers."""
    return np.round((values - values.min()) / np.ptp(values) * top).astype(np.uint8 if top == 255 else np.uint16)


def kinect_disparity(metres):
    """Raw disparity of a first Kinect: eighths of a pixel, 2047 where the depth is 0."""
    known = metres > 0
    return np.where(known, np.round(1091.5 - 348 / np.where(known, metres, 1)), 2047).astype(np.uint16)
