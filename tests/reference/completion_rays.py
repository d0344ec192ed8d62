"""Mirror of shaders/common/completion_rays.glsl, for n cells at once."""

from __future__ import annotations

import numpy as np

from .completion import (
    MANY,
    SIDE,
    agrees,
    candidate_of,
    color_vote,
    elect,
    elected,
    hidden_below_at,
    moved_plane,
    unpack_color,
)
from .texels import texel_at, texel_or_zero
from .upsample_vote import color_likeness
from .vectors import length

F = np.float32
RAYS, AROUND, STOPS, REGION, ALIKE = 16, 12, 2, 4, F(0.1)
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


def cast_rays(
    near_planes: np.ndarray,
    other_planes: np.ndarray,
    colors_map: np.ndarray,
    cell: np.ndarray,
    hidden_below: np.ndarray,
    is_alone: bool,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the planes (n, 4) and the evidence (n, 2)."""
    own, plane = texel_at(colors_map, cell), texel_at(near_planes, cell)
    lacks, has_own = own[:, 3] > 0, (plane[:, 3] >= MANY) & (not is_alone)
    planes = np.where((lacks & has_own)[:, None], _with_share(plane, 1), F(0))
    evidence = np.zeros((len(cell), 2), F)
    asked = np.flatnonzero(lacks & ~has_own)
    if len(asked):
        found = _ask(near_planes, other_planes, colors_map, cell[asked], own[asked], hidden_below[asked], is_alone)
        planes[asked], evidence[asked] = found
    return planes, evidence


def _ask(near_planes, other_planes, colors_map, cell, own, hidden_below, is_alone):
    count, last = len(cell), np.array(colors_map.shape[1::-1]) - 1
    missing = unpack_color(own[:, 2])
    candidates = np.zeros((count, RAYS, STOPS, 2, 4), F)
    likeness = np.zeros((count, RAYS, STOPS, 2), F)
    meeting = np.zeros(count, int)
    for ray in range(RAYS):
        stops = np.zeros(count, int)
        for k in range(1, last.max() + 2):
            there = cell + np.floor(F(k) * ray_direction(ray) + F(0.5)).astype(int)
            held = np.clip(there, 0, last)
            there_is = (there == held).all(-1) & (texel_at(near_planes, held)[:, 3] > 0) & (stops < STOPS)
            n = np.flatnonzero(there_is)
            off = (cell - there)[n].astype(F)
            for layer, layer_map in enumerate((near_planes, other_planes)):
                one, color = texel_at(layer_map, there[n]), texel_at(colors_map, there[n])[:, layer]
                alike = color_likeness(unpack_color(color), missing[n])
                votes = color_vote(alike) * np.minimum(one[:, 3] / MANY, F(1)) / length(off)[:, 0]
                moved = moved_plane(one[:, :3], F(SIDE) * off)
                candidates[n, ray, stops[n], layer] = candidate_of(moved, votes, hidden_below[n])
                likeness[n, ray, stops[n], layer] = alike
            stops[n] += 1
        meeting += stops > 0
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
