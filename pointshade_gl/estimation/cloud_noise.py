"""The noise of a point cloud: how far points lie off a smooth surface through their neighbours."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

TERMS = 6  # of a surface of second degree


def surface_residuals(
    offsets: NDArray[np.float64], known: NDArray[np.bool_], shares: Sequence[float]
) -> NDArray[np.float64]:
    """Return the standard deviation of points from surfaces of second degree: quantiles of several places.

    offsets  (m, k, 3) neighbours of m places, about 1 in size
    known    (m, k) which of these there are
    shares   of the places that have less
    """
    weight = known.astype(np.float64)
    count = weight.sum(1)
    usable = count >= 2 * TERMS
    if not usable.any():
        return np.zeros(len(shares))
    offsets, weight, count = offsets[usable], weight[usable], count[usable]
    mean = np.einsum("mk,mki->mi", weight, offsets) / count[:, None]
    offsets = offsets - mean[:, None]
    covariance = np.einsum("mk,mki,mkj->mij", weight, offsets, offsets)
    axes = np.linalg.eigh(covariance)[1]  # the normal first
    z, x, y = np.moveaxis(np.einsum("mki,mij->mkj", offsets, axes), -1, 0)
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], -1)
    weighted = terms * weight[..., None]
    products = np.einsum("mki,mkj->mij", weighted, terms) + 1e-9 * np.eye(TERMS)
    factors = np.linalg.solve(products, np.einsum("mki,mk->mi", weighted, z)[..., None])[..., 0]
    rest = z - np.einsum("mki,mi->mk", terms, factors)
    return np.sqrt(np.quantile((weight * rest**2).sum(1) / (count - TERMS), shares))
