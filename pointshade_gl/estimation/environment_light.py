"""What surfaces reflect of an environment: spherical harmonics, also in other axes, and maps for highlights."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene.appearance import Material
from ..scene.light import unit

Array = NDArray[np.float64]
WIDTH, SHARP_WIDTH = 64, 128  # columns of a lobe's map; of a lobe's above this exponent
SHARP = 100.0
NARROWEST = 0.6  # columns of its map, the standard deviation of the narrowest lobe that a map shows without gaps
MOST = 16  # exponents that have maps of their own in a picture
FINEST = 64  # rows, at least, where a picture is cut off: the edge runs through pixels


def radiance_bands(picture: NDArray[Any], hidden_below: NDArray[Any] | None = None) -> Array:
    """Return the radiance (9, 3) as real spherical harmonics of order 2, with their constants multiplied in.

    From the unit direction (x, y, z) comes c0 + (c1 x + c2 y + c3 z) + (c4 xy + c5 yz + c6 xz + c7 (3 z^2 - 1) +
    c8 (x^2 - y^2)). The irradiance / pi of an unoccluded surface with the normal (x, y, z) is the same sum with the
    factors 1, 2/3 and 1/4 on the bands (Ramamoorthi and Hanrahan 2001).

    picture       (h, w, 3) radiance
    hidden_below  (3,) up, in the picture's axes: what lies below the horizon is black, as a floor hides it; None hides
                  nothing
    """
    if hidden_below is not None:
        picture = above_horizon(picture, hidden_below)
    height, width = picture.shape[:2]
    rows = _elevation_integrals(_elevations(height))
    columns = _azimuth_integrals(2 * math.pi * (np.arange(width + 1) / width - 0.5))
    sums = np.einsum("ir,rcj,kc->ikj", rows, picture.astype(np.float64), columns, optimize=True)
    one, sine, flat, flat_sine, flat_squared, sine_squared = range(6)
    every, cosine_a, sine_a, both, cosine_a_squared, sine_a_squared = range(6)
    first = sums[flat, cosine_a], sums[sine, every], sums[flat, sine_a]
    mixed = sums[flat_sine, cosine_a], sums[flat_sine, sine_a], sums[flat_squared, both]
    return np.stack([
        sums[one, every] / (4 * math.pi),
        *(part * 3 / (4 * math.pi) for part in first),
        *(part * 15 / (4 * math.pi) for part in mixed),
        (3 * sums[flat_squared, sine_a_squared] - sums[one, every]) * 5 / (16 * math.pi),
        (sums[flat_squared, cosine_a_squared] - sums[sine_squared, every]) * 15 / (16 * math.pi),
    ])  # fmt: skip


def above_horizon(picture: NDArray[Any], up: NDArray[Any]) -> Array:
    """Return the picture (h, w, 3) with black below the horizon; what straddles it keeps the share that lies above.

    Small ones come back with whole multiples of their rows and columns. up (3,): in the picture's axes.
    """
    finer = math.ceil(FINEST / picture.shape[0])
    picture = np.repeat(np.repeat(picture, finer, 0), finer, 1)
    height, width = picture.shape[:2]
    x, y, z = unit(up)
    elevation = _middles(_elevations(height))[:, None]
    azimuth = 2 * math.pi * ((np.arange(width) + 0.5) / width - 0.5)
    ahead, aside = x * np.cos(azimuth) + z * np.sin(azimuth), z * np.cos(azimuth) - x * np.sin(azimuth)
    over = np.sin(elevation) * y + np.cos(elevation) * ahead
    by_row = abs(np.cos(elevation) * y - np.sin(elevation) * ahead) * math.pi / height
    by_column = abs(np.cos(elevation) * aside) * 2 * math.pi / width
    share = np.clip(0.5 + over / np.maximum(by_row + by_column, 1e-12), 0, 1)
    return picture * share[..., None]


def lobe_map(picture: NDArray[Any], exponent: float, width: int | None = None) -> NDArray[np.float32]:
    """Return the mean radiance in a Phong lobe, (exponent + 1) / (2 pi) cos^exponent, round each direction.

    picture   (h, w, 3) radiance
    exponent  0 or above; that of a lobe too narrow for the map counts as the highest that the map shows (about 290 at
              64 columns, 1150 at 128)
    width     even, columns of the map; None is 64, and 128 above an exponent of 100

    Returns (width / 2, width, 3), a picture like the environment's, to be looked up with bilinear weights.
    """
    width = width or (SHARP_WIDTH if exponent > SHARP else WIDTH)
    exponent = min(exponent, (width / (2 * math.pi * NARROWEST)) ** 2)
    height, fine = width // 2, 2 * width  # the environment in cells of half the map's
    cells = _resampled(picture, width, fine)
    edges = _elevations(width)
    ours, theirs = _middles(_elevations(height)), _middles(edges)
    turned = np.cos(2 * math.pi * (np.arange(fine) - 0.5) / fine)  # middles of the map lie between those of cells
    sines, cosines = np.outer(np.sin(ours), np.sin(theirs)), np.outer(np.cos(ours), np.cos(theirs))
    along = sines[..., None] + cosines[..., None] * turned
    weights = np.where(along > 0, np.maximum(along, 0) ** exponent, 0)  # 0 ** 0 is 1
    weights *= -np.diff(np.sin(edges))[:, None]  # by solid angle
    waves = np.fft.rfft(weights, axis=2).conj().transpose(2, 0, 1) @ np.fft.rfft(cells, axis=1).transpose(1, 0, 2)
    sums = np.fft.irfft(waves, fine, axis=0)[::2].transpose(1, 0, 2)  # one turn of the lobe is a convolution
    return np.maximum(sums / weights.sum((1, 2))[:, None, None], 0).astype(np.float32)


def lobe_maps(picture: NDArray[Any], exponents: Sequence[float]) -> NDArray[np.float32]:
    """Return maps of the lobes of several exponents, one above the other, (n h, w, 3)."""
    width = SHARP_WIDTH if max(exponents) > SHARP else WIDTH
    return np.concatenate([lobe_map(picture, exponent, width) for exponent in exponents])


def exponents_of(materials: Iterable[Material]) -> tuple[float, ...]:
    """Return the exponents of highlights of which there are maps, rising."""
    return tuple(sorted({one.shininess for one in materials if one.specular > 0}))[:MOST]


def nearest_lobe(exponents: Sequence[float], shininess: float) -> int:
    """Return the number of the map for a material."""
    return min(range(len(exponents)), key=lambda k: abs(math.log(exponents[k] / shininess)))


def _elevations(rows: int) -> Array:
    """Return the elevations between the rows, from the zenith down, (rows + 1,) radians."""
    return math.pi * (0.5 - np.arange(rows + 1) / rows)


def _middles(edges: Array) -> Array:
    return (edges[1:] + edges[:-1]) / 2


def _elevation_integrals(edges: Array) -> Array:
    """Return the integrals over each row, by solid angle, (6, rows): of 1, sin, cos, sin cos, cos^2 and sin^2."""
    sine, cosine = np.sin(edges), np.cos(edges)
    flat = (edges + sine * cosine) / 2
    antiderivatives = [sine, sine**2 / 2, flat, -(cosine**3) / 3, sine - sine**3 / 3, sine**3 / 3]
    return -np.diff(antiderivatives, axis=1)


def _azimuth_integrals(edges: Array) -> Array:
    """Return the integrals over each column, (6, columns): of 1, cos, sin, sin cos, cos^2 and sin^2."""
    sine, cosine = np.sin(edges), np.cos(edges)
    product = sine * cosine
    antiderivatives = [edges, sine, -cosine, sine**2 / 2, (edges + product) / 2, (edges - product) / 2]
    return np.diff(antiderivatives, axis=1)


def _resampled(picture: NDArray[Any], rows: int, columns: int) -> Array:
    """Return the picture (h, w, 3) with so many rows and columns: the mean radiance of each cell."""
    height, width = picture.shape[:2]
    down = _shares(-np.sin(_elevations(height)), -np.sin(_elevations(rows)))
    along = _shares(np.linspace(0, 1, width + 1), np.linspace(0, 1, columns + 1))
    return np.einsum("rh,hwj,cw->rcj", down, picture.astype(np.float64), along, optimize=True)


def _shares(theirs: Array, ours: Array) -> Array:
    """Return how much of each of our intervals is each of theirs; both are rising edges."""
    overlap = np.minimum(ours[1:, None], theirs[1:]) - np.maximum(ours[:-1, None], theirs[:-1])
    return np.maximum(overlap, 0) / np.diff(ours)[:, None]


def sh_rotation(bands: NDArray[np.float64], turn: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return bands (9, 3), see `radiance_bands`, for directions in other axes; turn (3, 3) leads to the bands' own."""
    c4, c5, c6, c7, c8 = bands[4:]
    form = 0.5 * np.array([[2 * (c8 - c7), c4, c6], [c4, -2 * (c7 + c8), c5], [c6, c5, 4 * c7]])  # of the second order
    form = np.einsum("ki,klc,lj->ijc", turn, form, turn)
    xx, yy, zz = form[0, 0], form[1, 1], form[2, 2]
    mixed = 2 * form[0, 1], 2 * form[1, 2], 2 * form[0, 2]
    return np.stack([bands[0], *(turn.T @ bands[1:4]), *mixed, zz / 2, (xx - yy) / 2])
