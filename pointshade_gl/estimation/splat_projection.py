"""Trained splats as a camera sees them: ellipses, the farthest first (EWA: Zwicker et al. 2001); their normals."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scene.camera import Eye
from ..scene.cloud import PointCloud
from ..scene.gaussians import AT_A_TIME, FAINT, Gaussians, harmonics_at
from .by_threads import by_threads
from .cloud_estimates import outward

BLUR = np.float32(0.3)  # pixels squared: what the training adds to each ellipse
ASIDE = 1.3  # half pictures aside beyond which the slope of a ray counts no further
THIN = 1e-4  # of an ellipse: what is thinner has the depth slope of this
TURNED = 0.05  # cosine: normals that point away by less stay so, as round an outline some do
COLUMNS = 10  # of a row: place (2), arms (3), depth from the reference, colour (3) and opacity
SURFACE_COLUMNS = 15  # then normal (3) and slope of the depth (2)

Rows = NDArray[np.float32]


class SplatView(NamedTuple):
    """A cloud of splats in a view.

    turn, shift  (3, 3) and (3,): from the positions of the cloud to the axes of the eye
    normals      (n, 3) of the surface in the cloud's axes, 0 for what is not lit; None: only colours are wanted
    is_lit       whether the colours are those of a surface, the same from everywhere
    """

    cloud: PointCloud
    turn: NDArray[np.float64]
    shift: NDArray[np.float64]
    normals: NDArray[np.float32] | None = None
    is_lit: bool = False


def project_splats(views: Sequence[SplatView], eye: Eye, reference: float) -> Rows:
    """Return (m, COLUMNS or SURFACE_COLUMNS) the splats that an eye sees of some clouds, the farthest first.

    The arms l11, l21, l22 take a circle to the ellipse of one deviation: x = l11 a, y = l21 a + l22 b, pixels.

    reference  depth from which depths count: their squares keep more digits
    """
    parts = [(view, slice(k, k + AT_A_TIME)) for view in views for k in range(0, len(view.cloud), AT_A_TIME)]
    found = by_threads(lambda one: _project(*one, eye, reference), parts)
    width = SURFACE_COLUMNS if any(view.normals is not None for view in views) else COLUMNS
    rows = np.concatenate(found) if found else np.empty((0, width), np.float32)
    return np.take(rows, np.argsort(-rows[:, 5], kind="stable"), 0)


def _project(view: SplatView, rows: slice, eye: Eye, reference: float) -> Rows:
    cloud, camera = view.cloud, eye.camera
    held = cloud.gaussians
    assert held is not None, "a cloud of splats"
    turn = view.turn.astype(np.float32)
    start = (view.shift + view.turn @ cloud.origin).astype(np.float64)
    local = np.ascontiguousarray(cloud.positions[rows].T)
    x, y, away = turn @ local.astype(np.float32) + (start - [0, 0, reference]).astype(np.float32)[:, None]
    z = away + np.float32(reference)
    ahead = z > eye.near
    if not ahead.all():
        x, y, z, away = x[ahead], y[ahead], z[ahead], away[ahead]
    near = 1 / z
    x, y = x * near, y * near
    fx, fy = np.float32(camera.fx), np.float32(camera.fy)
    u, v = fx * x + np.float32(camera.cx), fy * y + np.float32(camera.cy)
    ends = (np.float32(ASIDE * side / 2 / abs(f)) for side, f in ((camera.width, fx), (camera.height, fy)))
    across, down = (
        (fx * near, fy * near),
        tuple(np.clip(one, -end, end) for one, end in zip((x, y), ends, strict=True)),
    )
    covariance = held.covariances[:, rows]
    covariance = covariance if ahead.all() else covariance[:, ahead]
    way_x, way_y = (
        f * (turn[k][:, None] - slope * turn[2][:, None]) for k, f, slope in zip((0, 1), across, down, strict=True)
    )
    moved_x, moved_y = _times(covariance, way_x), _times(covariance, way_y)
    xx, xy, yy = (np.einsum("in,in->n", *pair) for pair in ((way_x, moved_x), (way_x, moved_y), (way_y, moved_y)))
    opacity = held.opacities[rows]
    opacity = opacity if ahead.all() else opacity[ahead]
    wide_x, wide_y = xx + BLUR, yy + BLUR
    area = wide_x * wide_y - xy * xy
    if held.antialiased:
        opacity = opacity * np.sqrt(np.maximum(xx * yy - xy * xy, 0) / area)
    reach = np.sqrt(2 * np.log(np.maximum(opacity / np.float32(FAINT), 1)))
    reach_x, reach_y = reach * np.sqrt(wide_x), reach * np.sqrt(wide_y)
    seen = (opacity >= FAINT * (1 - 1e-4)) & (u + reach_x > -0.5) & (u - reach_x < camera.width - 0.5)
    seen = np.flatnonzero(seen & (v + reach_y > -0.5) & (v - reach_y < camera.height - 0.5) & (area > 0))
    made = np.empty((len(seen), COLUMNS if view.normals is None else SURFACE_COLUMNS), np.float32)
    which = np.flatnonzero(ahead)[seen] + rows.start
    first = np.sqrt(wide_x[seen])
    made[:, 0], made[:, 1], made[:, 2], made[:, 3] = u[seen], v[seen], first, xy[seen] / first
    made[:, 4], made[:, 5] = np.sqrt(area[seen]) / first, away[seen]
    made[:, 6:9] = _colors(view, held, which, start)
    made[:, 9] = opacity[seen]
    if view.normals is not None:
        normals = view.normals[which] @ turn.T
        normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-20)[:, None]
        x, y = x[seen], y[seen]
        away = (normals[:, 0] * x + normals[:, 1] * y + normals[:, 2]) / np.sqrt(x * x + y * y + 1)
        made[:, 10:13] = np.where(away[:, None] > TURNED, -normals, normals)
        made[:, 13:15] = _slopes(moved_x[:, seen], moved_y[:, seen], xx[seen], xy[seen], yy[seen], turn[2])
    return made


def _times(covariance: NDArray[np.float32], way: NDArray[Any]) -> NDArray[Any]:
    """Return (3, n): symmetric matrices, (6, n), times vectors (3, n)."""
    xx, xy, xz, yy, yz, zz = covariance
    x, y, z = way
    return np.stack([xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z])


def _slopes(
    moved_x: NDArray[Any], moved_y: NDArray[Any], xx: NDArray[Any], xy: NDArray[Any], yy: NDArray[Any],
    ahead: NDArray[np.float32],
) -> NDArray[Any]:  # fmt: skip
    """Return (n, 2) by how much the depth where a splat is densest along the ray changes for each pixel aside."""
    deep_x, deep_y = ahead @ moved_x, ahead @ moved_y
    least = THIN * (xx + yy) + np.float32(1e-9)
    xx, yy = xx + least, yy + least
    area = xx * yy - xy * xy
    return np.stack([(deep_x * yy - deep_y * xy) / area, (deep_y * xx - deep_x * xy) / area], -1)


def _colors(
    view: SplatView, held: Gaussians, which: NDArray[np.integer], start: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Return (m, 3) sRGB, not cut off above 1: as seen from the eye, or of degree 0 where they are a surface's."""
    base = held.base[which]
    if held.harmonics is None or view.is_lit:
        return np.maximum(base, 0)
    eye = np.linalg.solve(view.turn, -start).astype(np.float32)
    way = view.cloud.positions[which].astype(np.float32).T - eye[:, None]
    way /= np.sqrt(np.einsum("kn,kn->n", way, way))
    shown = harmonics_at(held.degree, way)
    return np.maximum(base + np.einsum("kn,nkc->nc", shown, held.harmonics[which].astype(np.float32)), 0)


CELL = 2.2  # times the median of the longest deviations is a cell wide
LEAST = 0.05  # opacity: fainter ones are fog
_EDGE = 1 << 20  # cells along a side, at most
_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def splat_normals(
    positions: NDArray[np.floating], held: Gaussians, up: NDArray[np.float64], wide: float = CELL
) -> NDArray[np.float32]:
    """Return (n, 3) unit, outward: across which the splats of a cell and those round it are spread least.

    wide  cells in median lengths
    """
    count, side = len(positions), wide * held.median_length
    if not count or side <= 0:
        return np.zeros((count, 3), np.float32)
    low = positions.min(0)
    side = max(side, float(np.ptp(positions, 0).max()) / _EDGE)
    places = ((positions - low) / side).astype(np.int64) + 1
    steps = np.array([1, *np.cumprod(places.max(0)[:2] + 2)], np.int64)
    keys = places @ steps
    cells, cell = np.unique(keys, return_inverse=True)
    sums = _moments((positions - low).astype(np.float64), held, cell, len(cells))
    around = _with_neighbours(cells, sums, steps)
    middle = around[1:4] / around[0]
    spread = np.empty((len(cells), 3, 3))
    for k, (i, j) in enumerate(_PAIRS):
        spread[:, i, j] = spread[:, j, i] = around[4 + k] / around[0] - middle[i] * middle[j]
    flat = np.linalg.eigh(spread)[1][:, :, 0].astype(np.float32)
    own = (sums[1:4] / sums[0]).T.astype(np.float32)
    return outward(own, flat, up)[0][cell]


def _moments(local: NDArray[np.float64], held: Gaussians, cell: NDArray[np.integer], count: int) -> NDArray[np.float64]:
    """Return (10, cells): weight, its products with the places, and with their squares and the splats' own spread."""
    weight = held.opacities * (held.opacities > LEAST) + np.float32(1e-6)
    columns = [weight, *(weight * local[:, k] for k in range(3))]
    columns += [
        weight * (local[:, i] * local[:, j] + own) for (i, j), own in zip(_PAIRS, held.covariances, strict=True)
    ]
    return np.stack([np.bincount(cell, one, count) for one in columns]).astype(np.float64, copy=False)


def _with_neighbours(
    cells: NDArray[np.int64], sums: NDArray[np.float64], steps: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return the sums with half of those of the cells beside, a quarter over edges and an eighth over corners."""
    found = np.zeros_like(sums)
    for step in product((-1, 0, 1), repeat=3):
        keys = cells + np.array(step) @ steps
        at = np.searchsorted(cells, keys).clip(0, len(cells) - 1)
        share = np.where(cells[at] == keys, 0.5 ** np.abs(step).sum(), 0.0)
        found += sums[:, at] * share
    return found
