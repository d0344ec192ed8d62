"""Finds the parts of a picture in an earlier one of its film: blocks of small copies whose colours agree.

Blocks are looked for where those of the picture before were found, a little further on, else by the shift of the whole
picture. With them go values of both pictures, and how much of a distance lies along the axis if the camera turned.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

WIDE = 160  # pixels of the small copies
_BLOCK = 8  # pixels of a block's side
_REACH, _FAR_REACH = 3, 6  # pixels around a likely place in which a block is looked for, and around another one
_NOISE, _UNLIKE = 0.012, 0.06  # colours that differ by so much are alike in any case; by more they never are
_GAIN = (0.5, 2.0)  # of the exposure between two pictures
_STEEP = 0.12  # of the values' range inside a pixel of the small copy: an edge, which does not vote
_MOVED = 0.1  # of the blocks: fewer moved nowhere
_SURELY = 0.5  # of the blocks were found where they were likely: no other place is tried
_BORDER = 80  # pixels around the earlier picture in which nothing is found
_FEWEST = 60  # points


class Pairs(NamedTuple):
    """Values where colours agree: of the picture, of the earlier one, and what a turn made of these (n,)."""

    seen: NDArray[np.float64]
    earlier: NDArray[np.float64]
    turned: NDArray[np.float64]


@dataclass(frozen=True)
class Small:
    """A small copy: colours (h, w, 3) from 0 to 1, values (h, w), where they are known and smooth (h, w)."""

    colors: NDArray[np.float32]
    values: NDArray[np.float64]
    known: NDArray[np.bool_]

    def moved_by(self, a: float, b: float) -> Small:
        """Return it with the values a v + b."""
        return Small(self.colors, a * self.values + b, self.known)


class Matched(NamedTuple):
    """How a picture agrees with an earlier one.

    agreeing  share of its blocks that are found there
    places    (rows, columns, 2) how far (down, across) each block moved, in pixels of the small copies
    pairs     values where colours agree
    is_still  whether what agrees is where it was
    growth    how much wider the earlier picture shows it, less 1
    """

    agreeing: float
    places: NDArray[np.int_] | None
    pairs: Pairs
    is_still: bool
    growth: float = 0.0


def small_copy(values: NDArray[np.floating], colors: NDArray[np.uint8] | None) -> Small:
    """Return means over squares of pixels, of a size that blocks fill."""
    height, width = values.shape
    step = max(1, round(width / WIDE))
    rows, columns = (max(1, side // step // _BLOCK) * _BLOCK for side in (height, width))
    rows, columns = min(rows, height // step), min(columns, width // step)
    squares = np.asarray(values[: rows * step, : columns * step], np.float64).reshape(rows, step, columns, step)
    squares = squares.swapaxes(1, 2).reshape(rows, columns, step * step)
    known: NDArray[np.bool_] = np.asarray(np.isfinite(squares).all(axis=2))
    squares = np.where(known[..., None], squares, 0)
    inside = squares.max(axis=2) - squares.min(axis=2)
    means = squares.mean(axis=2)
    if known.any():
        low, high = np.percentile(means[known], (2, 98))
        known &= inside <= np.maximum(_STEEP * (high - low), 4 * np.median(inside[known]))
    return Small(_small_colors(colors, (height, width), (rows, columns), step), means, known)


def _small_colors(
    colors: NDArray[np.uint8] | None, size: tuple[int, int], small: tuple[int, int], step: int
) -> NDArray[np.float32]:
    """Return the colours of the same squares; all alike without any."""
    if colors is None:
        return np.full((*small, 3), 0.5, np.float32)
    from PIL import Image

    ratio = colors.shape[0] / size[0], colors.shape[1] / size[1]
    box = 0, 0, small[1] * step * ratio[1], small[0] * step * ratio[0]
    picture = Image.fromarray(np.ascontiguousarray(colors[..., :3])).resize(
        (small[1], small[0]), Image.Resampling.BOX, box
    )
    return np.asarray(picture, np.float32) / np.float32(255)


def matched(small: Small, earlier: Small, likely: NDArray[np.int_] | None, focal: float) -> Matched:
    """Look for the blocks of a picture in an earlier one.

    likely  where those of the picture before were found in it, as `Matched.places`
    focal   length in widths of the picture
    """
    if small.colors.shape != earlier.colors.shape or min(small.values.shape) < _BLOCK:
        return Matched(0.0, None, Pairs(*np.empty((3, 0))), False)
    blocks = tuple(side // _BLOCK for side in small.values.shape)
    found = Matched(-1.0, None, Pairs(*np.empty((3, 0))), False)
    if likely is not None:
        found = _blocks_at(small, earlier, likely, focal, _REACH)
    for shift in {(0, 0), _phase_shift(small.colors, earlier.colors)} if found.agreeing < _SURELY else ():
        again = _blocks_at(small, earlier, np.broadcast_to(np.array(shift), (*blocks, 2)), focal, _FAR_REACH)
        found = again if again.agreeing > found.agreeing else found
    return found


def _phase_shift(colors: NDArray[np.float32], earlier: NDArray[np.float32]) -> tuple[int, int]:
    """Return (down, across) of the whole picture (phase correlation, Kuglin and Hines 1975)."""
    one, other = (_details(picture) for picture in (colors, earlier))
    cross = np.fft.rfft2(other) * np.conj(np.fft.rfft2(one))
    peaks = np.fft.irfft2(cross / np.maximum(np.abs(cross), 1e-9), s=one.shape)
    down, across = np.unravel_index(int(np.argmax(peaks)), peaks.shape)
    rows, columns = one.shape
    return int(down) - rows * (2 * int(down) > rows), int(across) - columns * (2 * int(across) > columns)


def _details(colors: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the brightness without its mean, faded to the borders."""
    grey = colors.mean(axis=2, dtype=np.float64)
    fade = np.outer(*(np.hanning(side + 2)[1:-1] for side in grey.shape))
    return (grey - grey.mean()) * fade


def _blocks_at(small: Small, earlier: Small, likely: NDArray[np.int_], focal: float, reach: int) -> Matched:
    """Find the blocks of a picture around likely places."""
    rows, columns = small.values.shape
    v, u = np.mgrid[:rows, :columns]
    near = [at + _spread(likely[..., k]) for k, at in enumerate((v, u))]
    there = [np.clip(at, 0, side - 1) for at, side in zip(near, (rows, columns), strict=True)]
    gain = _gain(small.colors, earlier.colors[there[0], there[1]])
    seen = small.colors * np.float32(gain)
    grey, other = seen.mean(axis=2), np.pad(earlier.colors.mean(axis=2), _BORDER, constant_values=np.inf)
    span = 2 * reach + 1
    costs = np.empty((span, span, rows // _BLOCK, columns // _BLOCK))
    for k, j in np.ndindex(span, span):
        y, x = (np.clip(at + step - reach + _BORDER, 0, side + 2 * _BORDER - 1)
                for at, step, side in zip(near, (k, j), (rows, columns), strict=True))  # fmt: skip
        costs[k, j] = _block_means(np.abs(grey - other[y, x]))
        costs[k, j] += 1e-5 * max(abs(k - reach), abs(j - reach))  # nothing to see: as the others
    places, fine = _best_places(costs, likely)
    y, x = (at + _spread(places[..., k]) for k, at in enumerate((v, u)))
    inside = (y >= 0) & (y < rows) & (x >= 0) & (x < columns)
    y, x = np.where(inside, y, 0), np.where(inside, x, 0)
    off = np.where(inside, np.abs(seen - earlier.colors[y, x]).mean(axis=2), np.inf)
    cost = _block_means(off)
    known = cost[np.isfinite(cost)]
    limit = min(max(2.5 * np.percentile(known, 25), _NOISE), _UNLIKE) if known.size else _NOISE
    agreeing = cost < limit
    good = _spread(agreeing) & (off < 2 * limit) & small.known & earlier.known[y, x]
    is_still = bool(agreeing.any()) and places[agreeing].any(axis=1).mean() < _MOVED
    found = small.values[good], earlier.values[y, x][good]
    moved = [_spread(fine[..., k])[good] for k in range(2)]
    turned = np.ones(found[0].size) if is_still else _turned((v[good], u[good]), moved, focal, (rows, columns))
    if agreeing.any():
        places = np.where(agreeing[..., None], places, np.median(places[agreeing], axis=0).astype(int))
    return Matched(float(agreeing.mean()), places, Pairs(*found, turned), is_still, _growth((v[good], u[good]), moved))


def _spread(blocks: NDArray[Any]) -> NDArray[Any]:
    """Return what blocks have at each of their pixels."""
    return np.repeat(np.repeat(blocks, _BLOCK, axis=0), _BLOCK, axis=1)


def _best_places(costs: NDArray[np.float64], likely: NDArray[np.int_]) -> tuple[NDArray[np.int_], NDArray[np.float64]]:
    """Return (rows, columns, 2) where each block is found: in whole pixels, and between them by a parabola."""
    span, _, rows, columns = costs.shape
    flat = costs.reshape(span * span, rows, columns).argmin(axis=0)
    k, j = np.divmod(flat, span)
    places = likely + np.stack([k, j], axis=2) - span // 2
    fine = places.astype(np.float64)
    v, u = np.mgrid[:rows, :columns]
    for axis, at in enumerate((k, j)):
        near = [np.clip(at + step, 0, span - 1) for step in (-1, 0, 1)]
        low, middle, high = (costs[(one, j, v, u) if axis == 0 else (k, one, v, u)] for one in near)
        with np.errstate(all="ignore"):
            off = (low - high) / (2 * (low - 2 * middle + high))
        fine[..., axis] += np.where(np.isfinite(off) & (at > 0) & (at < span - 1), np.clip(off, -0.5, 0.5), 0)
    return places, fine


def _turned(
    here: tuple[NDArray[np.int_], NDArray[np.int_]], moved: list[NDArray[np.float64]], focal: float,
    size: tuple[int, int],
) -> NDArray[np.float64]:  # fmt: skip
    """Return (n,) how much of a point's distance lies along the axis now, if a turn of the camera moved it."""
    share, pixel = np.ones(here[0].size), 1 / (focal * size[1])
    for at, step, side in zip(here, moved, size, strict=True):
        x, y = (at - (side - 1) / 2) * pixel, (at + step - (side - 1) / 2) * pixel
        angles = np.arctan(y) - np.arctan(x)
        turn = float(np.median(angles)) if angles.size else 0.0
        near = np.abs(angles - turn) <= max(3 * pixel, abs(turn))
        turn = float(angles[near].mean()) if near.any() else turn
        share = share * (np.cos(turn) - x * np.sin(turn))
    return share


def _growth(here: tuple[NDArray[np.int_], NDArray[np.int_]], moved: list[NDArray[np.float64]]) -> float:
    """Return how much farther apart things are after they moved, less 1."""
    off = [one - one.mean() for one in here] if here[0].size else [np.zeros(1)] * 2
    spread = sum(float(one @ one) for one in off)
    return sum(float(one @ step) for one, step in zip(off, moved, strict=True)) / spread if spread > 0 else 0.0


def _gain(colors: NDArray[np.float32], earlier: NDArray[np.float32]) -> float:
    """Return how much brighter the earlier picture is."""
    one, other = colors.mean(axis=2), earlier.mean(axis=2)
    both = (one > 0.04) & (other > 0.04) & (one < 0.97) & (other < 0.97)
    return float(np.clip(np.median(other[both] / one[both]), *_GAIN)) if both.sum() > _FEWEST else 1.0


def _block_means(values: NDArray[np.floating]) -> NDArray[np.floating]:
    rows, columns = values.shape
    return values.reshape(rows // _BLOCK, _BLOCK, columns // _BLOCK, _BLOCK).mean(axis=(1, 3))
