"""Both rasterisers on the CPU: what splats.vert and splats.frag, and splats.comp do around the mirrored functions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..camera import Camera
from .splat import (
    Footprint,
    carry_footprint,
    footprint_covers,
    footprint_extent,
    footprint_inverse_depth,
    invert_footprint,
    splat_reach,
)

F = np.float32
DEPTH_STEPS = float(2**24 - 1)  # the depth buffer is 24-bit fixed point


class Pairs(NamedTuple):
    """Every (splat, target pixel that it covers), n of them."""

    splat: Footprint  # of the pair
    to_source: np.ndarray  # (n, 4)
    source_index: np.ndarray  # (n,) the source pixel's number, row by row
    q: np.ndarray  # (n, 2) the target pixel


def covered_pairs(
    depth: np.ndarray,
    normals: np.ndarray,
    source: Camera,
    target: Camera,
    view: np.ndarray,
    near: float,
    size: np.ndarray,
    is_round: bool,
) -> Pairs:
    """size (1,) or (h*w,) source pixels; normals 0 where missing."""
    v, u = np.nonzero(depth)
    pixel = np.stack([u, v], -1)
    sizes = np.broadcast_to(size, depth.size)[v * source.width + u].astype(F)
    shown, reach = sizes > 0, splat_reach(sizes, is_round)
    intrinsics = np.array(source.intrinsics, F), np.array(target.intrinsics, F)
    splat = carry_footprint(pixel.astype(F), depth[v, u], normals[v, u], intrinsics[0], view, intrinsics[1])
    shown &= (splat.inverse_depth > 0) & (splat.inverse_depth * F(near) < 1)
    extent = footprint_extent(splat.to_target, reach, is_round)
    edge = np.array([target.width, target.height]) - 1
    low = np.maximum(np.ceil(np.maximum(splat.centre - extent, -0.5)).astype(int), 0)
    high = np.minimum(np.floor(np.minimum(splat.centre + extent, edge + 0.5)).astype(int), edge)
    across, down = np.moveaxis(np.where(shown[:, None], np.maximum(high - low + 1, 0), 0), -1, 0)
    which = np.repeat(np.arange(len(u)), across * down)
    place = np.arange(len(which)) - np.repeat(np.cumsum(across * down) - across * down, across * down)
    q = low[which] + np.stack([place % np.maximum(across[which], 1), place // np.maximum(across[which], 1)], -1)
    to_source = invert_footprint(splat.to_target)[which]
    keep = footprint_covers(to_source, q.astype(F) - splat.centre[which], reach[which], is_round)
    which = which[keep]
    return Pairs(Footprint(*(part[which] for part in splat)), to_source[keep], (v * source.width + u)[which], q[keep])


def source_ids(pairs: Pairs, near: float, target: Camera) -> np.ndarray:
    """(h, w) int: the source pixel that each target pixel shows, -1 for none: what the points leave."""
    z_clip = F(1) - F(2) * F(near) * pairs.splat.inverse_depth
    window = np.round((z_clip * F(0.5) + F(0.5)).astype(float) * DEPTH_STEPS)
    order = np.lexsort((pairs.source_index, window))[::-1]  # farthest first: the nearest writes last and stays
    result = np.full((target.height, target.width), -1)
    result[pairs.q[order, 1], pairs.q[order, 0]] = pairs.source_index[order]
    return result


def nearest(pairs: Pairs, target: Camera) -> np.ndarray:
    """(h, w) float32: the greatest 1/z of each target pixel, 0 for none: what the compute rasteriser leaves."""
    offset = pairs.q.astype(F) - pairs.splat.centre
    result = np.zeros((target.height, target.width), F)
    place = pairs.q[:, 1], pairs.q[:, 0]
    np.maximum.at(result, place, footprint_inverse_depth(pairs.splat, pairs.to_source, offset))
    return result
