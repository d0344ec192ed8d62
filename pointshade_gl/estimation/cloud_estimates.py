"""What is estimated about a point cloud: its noise, its spacing, and which side of its surface is outside."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .by_threads import by_threads, parts_of

TERMS = 6  # of a surface of second degree
Positions = NDArray[np.floating[Any]]  # (n, 3)
Normals = NDArray[np.float32]  # (n, 3)
Numbers = NDArray[np.integer]  # of points


def surface_residuals(
    offsets: NDArray[np.float64], known: NDArray[np.bool_], shares: Sequence[float]
) -> NDArray[np.float64]:
    """Return the standard deviation of points from surfaces of second degree, as `shares` of the places have less.

    offsets  (m, k, 3) neighbours of m places, about 1 in size, of which known (m, k) ones exist
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


SPACING_SAMPLE = 1 << 14  # points
ASKED = 192  # of these, whose nearest neighbours are looked for
NEAREST = 16
SMALLEST = 1e-30  # what is less float32 cannot square


def any_of(vectors: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Return (n,) which of (n, 3) are not 0; `any` takes five times as long."""
    return (vectors[:, 0] != 0) | (vectors[:, 1] != 0) | (vectors[:, 2] != 0)


class Spacing(NamedTuple):
    """The spacing, 1 where there is none, and how many places there are, as a share of the points."""

    length: float
    distinct: float


def estimate_spacing(positions: NDArray[np.float32]) -> Spacing:
    """Estimate sqrt(area / n) of the surface that points sample, from a part of them; those in one place count once."""
    rng = np.random.default_rng(0)
    count = len(positions)
    part = positions if count <= SPACING_SAMPLE else positions[np.unique(rng.integers(0, count, SPACING_SAMPLE))]
    places = np.unique(part, axis=0).astype(np.float64)
    if len(places) < 2:
        return Spacing(1.0, 1 / max(count, 1))
    asked = places[rng.choice(len(places), min(ASKED, len(places)), replace=False)]
    nearest = min(NEAREST, len(places) - 1)
    squares = sum((asked[:, k, None] - places[:, k]) ** 2 for k in range(3))
    reach = math.sqrt(np.median(np.partition(squares, nearest, axis=1)[:, nearest]))
    total = _all_places(len(places), len(part), count)
    length = reach * math.sqrt(math.pi / nearest * len(places) / total)
    return Spacing(length, total / count) if length > SMALLEST else Spacing(1.0, 1.0)


def _all_places(seen: int, part: int, count: int) -> float:
    """Return in how many places all points lie, if a part of them, at random, lies in so many."""
    # with m points in each place, one is seen with probability 1 - (1 - part / count)^m: the m that fits
    if seen == part or part == count:
        return float(count if seen == part else seen)
    low, high = 1.0, float(count)
    for _ in range(60):
        middle = math.sqrt(low * high)
        expected = count / middle * -math.expm1(middle * math.log1p(-part / count))
        low, high = (middle, high) if expected > seen else (low, middle)
    return count / high


DIRECTIONS = 42
ORIENTED_SAMPLE = 200_000  # points that are looked at; the others get their sides from these
CELL, NEAR = 3.0, 2.0  # spacings: width of a cell of the pictures, and how far behind the nearest a point is seen
WIDEST = 2048  # cells along a side of a picture
STRAY = 0.001  # share of the points on each side of an axis that may lie outside of all pictures
SHEET = 0.5  # of what is seen of a point: a sheet shows both sides
HANDED = 8.0  # how much more a distance counts across the surface than along it
STEPS = 6  # from cells of 2 spacings to those of 64
COMPARED = 3  # known points of a cell


def outward(positions: Positions, normals: Normals, up: NDArray[np.float64]) -> tuple[Normals, bool]:
    """Return normals, (n, 3) and 0 where unknown, that point to where their points are seen from, and whether the
    surface is a sheet: that has no outside, and is looked at from above. up (3,) unit.
    """
    is_known = any_of(normals)
    known = np.flatnonzero(is_known)
    rng = np.random.default_rng(0)
    sample = known if len(known) <= ORIENTED_SAMPLE else np.sort(rng.choice(known, ORIENTED_SAMPLE, replace=False))
    if not len(sample):
        return normals, False
    middle = np.median(positions[sample], axis=0)
    points = (positions[sample] - middle).astype(np.float32)
    spacing = estimate_spacing(points).length
    votes, is_sheet = _votes(points, normals[sample], spacing, up)
    oriented = normals.copy()
    oriented[sample[votes < 0]] *= -1
    decided = sample[votes != 0]
    is_known[decided] = False
    rest = np.flatnonzero(is_known)
    _hand_on(positions, oriented, decided, rest, middle, spacing)
    return oriented, is_sheet


BESIDE = 8  # the number of the neighbour whose distance shows how dense points are
LIKE, FLAT = 0.7, 0.4  # a scan's spacing grows with the distance: correlation, spread of logarithms,
POWER = 0.75, 1.7  # and how fast
OVER_EACH_OTHER, FARTHER, ALONG = 0.15, 0.2, 4  # share of its points, logarithm of distances, neighbours by direction


def is_scan(positions: Positions, place: NDArray[np.float64]) -> bool:
    """Return whether points are spread as a scanner at a place, (3,), sees them.

    Their spacing grows with their distance, and in each direction there is one surface.
    """
    rng = np.random.default_rng(0)
    count = len(positions)
    part = positions if count <= SPACING_SAMPLE else positions[np.unique(rng.integers(0, count, SPACING_SAMPLE))]
    part = part[(part != place).any(1)].astype(np.float64)
    if len(part) < ASKED:
        return False
    asked = rng.choice(len(part), min(2 * ASKED, len(part)), replace=False)
    local = (part - np.median(part, axis=0)).astype(np.float32)
    squares = sum((local[asked, k, None] - local[:, k]) ** 2 for k in range(3))
    beside = np.partition(squares, BESIDE, axis=1)[:, BESIDE]
    asked, beside = asked[beside > 0], beside[beside > 0]
    if len(asked) < ASKED / 2:
        return False
    offsets = part - place
    away = np.linalg.norm(offsets, axis=1)
    x, y = np.log(away[asked]), np.log(beside) / 2
    x, y = x - x.mean(), y - y.mean()
    xx, xy, yy = (float(one.mean()) for one in (x * x, x * y, y * y))
    if yy < FLAT**2 or xy < LIKE * math.sqrt(xx * yy) or not POWER[0] * xx < xy < POWER[1] * xx:
        return False
    ways = (offsets / away[:, None]).astype(np.float32)
    cosines = ways[asked] @ ways.T
    cosines[np.arange(len(asked)), asked] = -2
    near = np.argpartition(-cosines, ALONG, axis=1)[:, :ALONG]
    differs = np.abs(np.log(away[near] / away[asked, None])) > FARTHER
    return float(differs.mean()) < OVER_EACH_OTHER


def facing(positions: Positions, normals: Normals, seen_from: NDArray[np.float64]) -> Normals:
    """Return normals that point to where a scanner stood: (3,), or (n, 3) for each point."""
    away = np.einsum("nk,nk->n", normals, seen_from - positions) < 0
    return np.where(away[:, None], -normals, normals)


def fibonacci_sphere(count: int) -> NDArray[np.float64]:
    """Return (count, 3) directions, evenly spread (Gonzalez 2010)."""
    k = np.arange(count)
    z = 1 - (2 * k + 1) / count
    angle = k * math.pi * (3 - math.sqrt(5))
    radius = np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], -1)


def _votes(
    points: NDArray[np.float32], normals: NDArray[np.float32], spacing: float, up: NDArray[np.float64]
) -> tuple[NDArray[np.float32], bool]:
    """Return for each point > 0 if its normal points to where it is seen from; and whether the cloud is a sheet."""
    all_votes, above, weights = (np.zeros(len(points), np.float32) for _ in range(3))
    directions = fibonacci_sphere(DIRECTIONS)
    every = by_threads(partial(_seen, np.ascontiguousarray(points.T), spacing), directions)
    for direction, seen in zip(directions, every, strict=True):
        cosine = normals[seen] @ direction.astype(np.float32)
        vote = cosine * np.abs(cosine)
        all_votes[seen] += vote
        weights[seen] += np.abs(vote)
        if direction @ up > 0:
            above[seen] += vote
    some = weights > 0
    is_sheet = bool(some.any() and np.median(np.abs(all_votes[some]) / weights[some]) < SHEET)
    return (above if is_sheet else all_votes), is_sheet


def _seen(points: NDArray[np.float32], spacing: float, direction: NDArray[np.float64]) -> NDArray[np.integer]:
    """Return which points, (3, n), are seen from far away in a direction."""
    u = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    u /= np.linalg.norm(u)
    # three products instead of a matrix's: its own threads would wait for each other
    x, y, z = points
    axes = (u, np.cross(direction, u), direction)
    across, down, near = (x * float(a) + y * float(b) + z * float(c) for a, b, c in axes)
    step = 1 + len(near) // 20000
    low, high = np.quantile(np.stack([across[::step], down[::step]]), (STRAY, 1 - STRAY), axis=1)
    cell = max(CELL * spacing, float((high - low).max()) / WIDEST)
    width, height = ((high - low) / cell).astype(int) + 3
    column = np.clip((across - low[0]) / cell + 1, 0, width - 1).astype(np.int32)
    row = np.clip((down - low[1]) / cell + 1, 0, height - 1).astype(np.int32)
    at = row * width + column
    nearest = np.full(width * height, -np.inf, np.float32)
    np.maximum.at(nearest, at, near)
    return np.flatnonzero(near >= nearest[at] - np.float32(NEAR * spacing))


def _hand_on(
    positions: Positions, normals: Normals, known: Numbers, rest: Numbers, middle: NDArray[Any], spacing: float
) -> None:
    """Turn the normals of the rest as those of known points near them, in cells that grow until they hold some."""
    side = 2 * spacing
    for _ in range(STEPS):
        if not len(rest) or not len(known):
            return
        keys = _cell_numbers(positions[known] - middle, side)
        order = np.argsort(keys, kind="stable")
        known = known[order]
        near = _Known(keys[order], positions[known], normals[known])

        def hand(part: slice, near: _Known = near, side: float = side, rest: Numbers = rest) -> NDArray[np.bool_]:
            """Turn the normals of a part; returns for which there are none near."""
            some = rest[part]
            places, own = np.take(positions, some, 0), np.take(normals, some, 0)
            cosine = _nearest_cosine(near, _cell_numbers(places - middle, side), places, own)
            normals[some[cosine < 0]] *= -1
            return cosine == 0

        rest = rest[np.concatenate(by_threads(hand, parts_of(len(rest))))]
        side *= 2


class _Known(NamedTuple):
    """Points whose normals are known, sorted by their cells."""

    cells: NDArray[np.int64]
    positions: Positions
    normals: Normals


def _nearest_cosine(
    near: _Known, cells: NDArray[np.int64], positions: Positions, normals: Normals
) -> NDArray[np.float32]:
    """Return the cosine between each normal and that of the nearest of a few known points in its cell; 0 if there are
    none.
    """
    best, cosines = np.full(len(cells), np.inf, np.float32), np.zeros(len(cells), np.float32)
    first, last = np.searchsorted(near.cells, cells), len(near.cells) - 1
    for step in range(COMPARED):
        at = np.minimum(first + step, last)
        has = np.flatnonzero((near.cells[at] == cells) & (first + step <= last))
        at = at[has]
        n = np.take(near.normals, at, 0)
        offset = (np.take(positions, has, 0) - np.take(near.positions, at, 0)).astype(np.float32)
        across = np.einsum("nk,nk->n", offset, n)
        distance = np.einsum("nk,nk->n", offset, offset) + HANDED * across**2
        closer = distance < best[has]
        cosine = np.einsum("nk,nk->n", np.take(normals, has, 0), n)
        best[has[closer]], cosines[has[closer]] = distance[closer], cosine[closer]
    return cosines


def _cell_numbers(offsets: NDArray[np.floating[Any]], side: float) -> NDArray[np.int64]:
    """Return a number for the cell of each point; far cells may share one."""
    index = np.clip(np.floor(offsets / side), -(1 << 20), (1 << 20) - 1).astype(np.int64) + (1 << 20)
    return (index[:, 0] << 42) | (index[:, 1] << 21) | index[:, 2]
