"""Mirror of shaders/common/completion_rays.glsl, for n cells at once."""

from __future__ import annotations

import numpy as np

from .completion import (
    MANY,
    NEARER,
    SIDE,
    agrees,
    candidate_of,
    color_vote,
    elect,
    elected,
    hidden_below_at,
    moved_plane,
    proven_share,
    unpack_color,
)
from .texels import texel_at, texel_or_zero
from .upsample_vote import color_likeness
from .vectors import length

F = np.float32
RAYS, AROUND, STOPS, REGION, ALIKE, BLOCK, MOST_STEPS = 16, 12, 2, 4, F(0.1), 8, F(65535)
HALF_TURN = ((1, 0), (1, 0.5), (1, 1), (0.5, 1), (0, 1), (-0.5, 1), (-1, 1), (-1, 0.5))


def ray_direction(ray: int) -> np.ndarray:
    along = np.array(HALF_TURN[ray % 8], F)
    return along if ray < 8 else -along


def cell_hidden_below(surface_map: np.ndarray, hidden_map: np.ndarray, cell: np.ndarray) -> np.ndarray:
    size = np.array(surface_map.shape[1::-1])
    lowest = np.full(len(cell), np.inf, F)
    for k in range(SIDE * SIDE):
        pixel = np.minimum(SIDE * cell + np.array([k % SIDE, k // SIDE]), size - 1)
        one = hidden_below_at(hidden_map, pixel, size)
        counts = (one > 0) & (texel_at(surface_map, pixel)[:, 3] == 0)
        lowest = np.where(counts, np.minimum(lowest, one), lowest)
    return np.where(np.isfinite(lowest), lowest, F(0))


def has_points(near_planes: np.ndarray, block: np.ndarray) -> np.ndarray:
    cells = BLOCK * block[:, None] + np.stack(np.meshgrid(*2 * [np.arange(BLOCK)]), -1).reshape(-1, 2)
    return (texel_or_zero(near_planes, cells.reshape(-1, 2))[:, 3] > 0).reshape(len(block), -1).any(1)


def steps_inside(cell: np.ndarray, direction: np.ndarray) -> np.ndarray:
    low = cell % BLOCK
    ahead = np.where(direction > 0, BLOCK - 1 - low, np.where(direction < 0, low, BLOCK))
    return ahead.min(-1)


def cell_on_ray(cell: np.ndarray, direction: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """steps: (n, 1)"""
    return cell + np.floor(steps * direction + F(0.5)).astype(int)


def is_asked(near_planes: np.ndarray, colors_map: np.ndarray, cell: np.ndarray, is_alone: bool) -> np.ndarray:
    return (texel_at(colors_map, cell)[:, 3] > 0) & (is_alone | (texel_at(near_planes, cell)[:, 3] < MANY))


def stops_of(
    near_planes: np.ndarray, colors_map: np.ndarray, cell: np.ndarray, direction: np.ndarray, is_alone: bool
) -> np.ndarray:
    """Return the steps (n, 2): every cell on the way is looked at, also in blocks without points."""
    steps, stops = np.zeros((len(cell), STOPS), F), np.zeros(len(cell), int)
    last = np.array(colors_map.shape[1::-1]) - 1
    asked = is_asked(near_planes, colors_map, cell, is_alone)
    for k in range(1, last.max() + 2):
        there = cell_on_ray(cell, direction, np.full((1, 1), k, F))
        held = np.clip(there, 0, last)
        meets = asked & (there == held).all(-1) & (texel_at(near_planes, held)[:, 3] > 0) & (stops < STOPS)
        n = np.flatnonzero(meets)
        steps[n, stops[n]] = k
        stops[n] += 1
    return steps


def stops_place(cell: np.ndarray, ray: np.ndarray | int, cells: np.ndarray) -> np.ndarray:
    return cell + cells * np.stack([np.asarray(ray) % SIDE, np.asarray(ray) // SIDE], -1)


def stops_map_of(near_planes: np.ndarray, colors_map: np.ndarray, is_alone: bool) -> np.ndarray:
    """Return the map of completion_stops.frag, (4 h, 4 w, 4) for (h, w) cells."""
    cells = np.array(colors_map.shape[1::-1])
    cell = np.stack(np.meshgrid(*map(np.arange, cells)), -1).reshape(-1, 2)
    stops = np.zeros((*SIDE * cells[::-1], 4), F)
    for ray in range(RAYS):
        u, v = stops_place(cell, ray, cells).T
        stops[v, u, :2] = stops_of(near_planes, colors_map, cell, ray_direction(ray), is_alone) / MOST_STEPS
    return stops


def cast_rays(
    near_planes: np.ndarray,
    other_planes: np.ndarray,
    colors_map: np.ndarray,
    stops_map: np.ndarray,
    cell: np.ndarray,
    hidden_below: np.ndarray,
    is_alone: bool,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the planes (n, 4) and the evidence (n, 2)."""
    own, plane = texel_at(colors_map, cell), texel_at(near_planes, cell)
    asks = is_asked(near_planes, colors_map, cell, is_alone)
    planes = np.where(((own[:, 3] > 0) & ~asks)[:, None], _with_share(plane, 1), F(0))
    evidence = np.zeros((len(cell), 2), F)
    asked = np.flatnonzero(asks)
    if len(asked):
        maps = near_planes, other_planes, colors_map, stops_map
        planes[asked], evidence[asked] = _ask(*maps, cell[asked], own[asked], hidden_below[asked], is_alone)
    return planes, evidence


def _ask(near_planes, other_planes, colors_map, stops_map, cell, own, hidden_below, is_alone):
    count, cells = len(cell), np.array(colors_map.shape[1::-1])
    missing = unpack_color(own[:, 2])
    candidates = np.zeros((count, RAYS, STOPS, 2, 4), F)
    likeness = np.zeros((count, RAYS, STOPS, 2), F)
    meeting = np.zeros(count, int)
    for ray in range(RAYS):
        steps = np.floor(texel_at(stops_map, stops_place(cell, ray, cells))[:, :STOPS] * MOST_STEPS + F(0.5))
        for stop in range(STOPS):
            n = np.flatnonzero(steps[:, stop])
            there = cell_on_ray(cell[n], ray_direction(ray), steps[n, stop, None])
            off = (cell[n] - there).astype(F)
            for layer, layer_map in enumerate((near_planes, other_planes)):
                one, color = texel_at(layer_map, there), texel_at(colors_map, there)[:, layer]
                alike = color_likeness(unpack_color(color), missing[n])
                votes = color_vote(alike) * np.minimum(one[:, 3] / MANY, F(1)) / length(off)[:, 0]
                moved = moved_plane(one[:, :3], F(SIDE) * off)
                candidates[n, ray, stop, layer] = candidate_of(moved, votes, hidden_below[n])
                likeness[n, ray, stop, layer] = alike
        meeting += steps[:, 0] > 0
    known = candidates[..., 3] > 0
    farthest = np.where(known, candidates[..., 0], F(1e30)).min((1, 2, 3), keepdims=True)
    is_doubted = (hidden_below > 0)[:, None, None, None] & (candidates[..., 0] > NEARER * farthest)
    candidates[..., 3] *= np.where(is_doubted, proven_share(likeness), F(1))
    everyone = candidates.reshape(count, -1, 4)
    w = elect(everyone)
    counts = (candidates[..., 3] > 0) & agrees(candidates[..., 0], w[:, None, None, None])
    alike = np.where(counts, likeness, F(0)).max((1, 2, 3))
    surrounded = meeting >= (RAYS if is_alone else AROUND)
    planes = np.where((is_alone & ~surrounded)[:, None], F(0), elected(everyone, w))
    return planes, np.stack([alike, np.where(surrounded & (not is_alone), F(0), F(1))], -1)


def settle_cell(plane_map: np.ndarray, evidence_map: np.ndarray, cell: np.ndarray) -> np.ndarray:
    own, doubtful = texel_at(plane_map, cell), texel_at(evidence_map, cell)[:, 1]
    alike, count = np.zeros(len(cell), F), np.zeros(len(cell), F)
    for v in range(-REGION, REGION + 1):
        for u in range(-REGION, REGION + 1):
            evidence = texel_or_zero(evidence_map, cell + np.array([u, v]))
            alike += evidence[:, 0] * evidence[:, 1]
            count += evidence[:, 1]
    unlike = (own[:, 3] * doubtful > 0) & (alike < ALIKE * count)
    return np.where(unlike[:, None], F(0), own)


def _with_share(plane: np.ndarray, share: float) -> np.ndarray:
    return np.concatenate([plane[:, :3], np.full((len(plane), 1), share, F)], -1)
