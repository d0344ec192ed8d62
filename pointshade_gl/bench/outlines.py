"""How far a drawn outline lies from the true one."""

from __future__ import annotations

import numpy as np

TOGETHER = 1 << 22  # pairs of pixels that are compared at once


def outline(mask: np.ndarray) -> np.ndarray:
    """(n, 2) pixels of a mask at its border, without those at the picture's."""
    inside = mask[1:-1, :-2] & mask[1:-1, 2:] & mask[:-2, 1:-1] & mask[2:, 1:-1]
    return np.argwhere(mask[1:-1, 1:-1] & ~inside) + 1


def outline_distance(drawn: np.ndarray, true: np.ndarray) -> float:
    """Pixels from the outline of one mask to the nearest of the other, mean; the picture's diagonal without any."""
    ours, theirs = outline(drawn).astype(np.float32), outline(true).astype(np.float32)
    if not len(ours) or not len(theirs):
        return float(np.hypot(*drawn.shape))
    parts = np.array_split(ours, -(-len(ours) * len(theirs) // TOGETHER))
    nearest = [np.sqrt(((part[:, None] - theirs) ** 2).sum(-1).min(1)) for part in parts]
    return float(np.concatenate(nearest).mean())
