"""Turns an environment's spherical harmonics into other axes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def turned_bands(bands: NDArray[np.float64], turn: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (9, 3) for directions in other axes.

    bands  (9, 3): radiance along a unit direction is c0 + c1 x + c2 y + c3 z + c4 xy + c5 yz + c6 xz + c7 (3 zz - 1)
           + c8 (xx - yy)
    turn   (3, 3) from those axes to the bands'
    """
    c4, c5, c6, c7, c8 = bands[4:]
    form = 0.5 * np.array([[2 * (c8 - c7), c4, c6], [c4, -2 * (c7 + c8), c5], [c6, c5, 4 * c7]])  # of the second order
    form = np.einsum("ki,klc,lj->ijc", turn, form, turn)
    xx, yy, zz = form[0, 0], form[1, 1], form[2, 2]
    mixed = 2 * form[0, 1], 2 * form[1, 2], 2 * form[0, 2]
    return np.stack([bands[0], *(turn.T @ bands[1:4]), *mixed, zz / 2, (xx - yy) / 2])
