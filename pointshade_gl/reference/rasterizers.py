"""Both rasterisers on the CPU: what splats.vert, splats.frag and splats.comp do around the mirrored functions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..camera import Camera
from .camera import pixel_ray
from .splat import (
    ENDLESS,
    FLAT,
    Footprint,
    carry_footprint,
    footprint_covers,
    footprint_extent,
    footprint_inverse_depth,
    inverse_depth_slope,
    invert_footprint,
    lies_on_plane,
    splat_bend,
    splat_bends,
    splat_is_ahead,
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


class Splats(NamedTuple):
    """n splats to carry into the view; a splat of merged pixels has the number of the first."""

    centre: np.ndarray  # (n, 2) source pixels
    z: np.ndarray  # (n,)
    normal: np.ndarray  # (n, 3)
    size: np.ndarray  # (n,) side or diameter, source pixels
    source_index: np.ndarray  # (n,) the source pixel's number, row by row


def single_splats(depth: np.ndarray, normals: np.ndarray, size: np.ndarray) -> Splats:
    """A splat for every pixel. size (1,) or (h*w,) source pixels; normals 0 where missing."""
    v, u = np.nonzero(depth)
    index = v * depth.shape[1] + u
    sizes = np.broadcast_to(size, depth.size)[index].astype(F)
    return Splats(np.stack([u, v], -1).astype(F), depth[v, u], normals[v, u], sizes, index)


def merged_splats(
    depth: np.ndarray, normals: np.ndarray, source: Camera, tolerance: float, view: np.ndarray | None = None
) -> Splats:
    """Blocks of 4x4 and of 2x2 pixels on one plane as one splat each, the others by themselves.

    view  (4, 4) source axes to target axes: blocks that bend in it are not merged; None is a view that bends none
    """
    height, width = depth.shape
    pad = ((0, -height % 4), (0, -width % 4))
    z, n = np.pad(depth, pad), np.pad(normals, (*pad, (0, 0)))
    grid = np.stack(np.meshgrid(np.arange(z.shape[1]), np.arange(z.shape[0])), -1).astype(F)
    found, drawn = [], z == 0
    for side in (4, 2):
        first_z, first_n, corner = z[::side, ::side], n[::side, ::side], grid[::side, ::side]
        intrinsics = np.array(source.intrinsics, F)
        slope = inverse_depth_slope(
            first_n, pixel_ray(corner, intrinsics), np.where(first_z > 0, first_z, F(1)), intrinsics
        )
        on_plane = np.ones(first_z.shape, bool)
        for y in range(side):
            for x in range(side):
                there, off = z[y::side, x::side], np.broadcast_to(np.array([x, y], F), corner.shape)
                on_plane &= lies_on_plane(there, off, first_z, slope, tolerance)
        on_plane &= ~drawn[::side, ::side]
        middle = np.full(2, 0.5 * (side - 1), F)
        centre_z = F(1) / (F(1) / np.where(first_z > 0, first_z, F(1)) + (slope * middle).sum(-1))
        if view is not None:
            splat = carry_footprint(corner + middle, centre_z, first_n, intrinsics, view, intrinsics)
            on_plane &= (splat.inverse_depth > 0) & (splat_bends(splat, splat_reach(F(side), False)) <= FLAT)
        u, v = corner[on_plane].astype(int).T
        sizes = np.full(len(u), side, F)
        found.append(Splats(corner[on_plane] + middle, centre_z[on_plane], first_n[on_plane], sizes, v * width + u))
        drawn |= on_plane.repeat(side, 0).repeat(side, 1)
    left = np.where(drawn[:height, :width], F(0), depth)
    found.append(single_splats(left, normals, np.ones(1, F)))
    return Splats(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def covered_pairs(
    splats: Splats, source: Camera, target: Camera, view: np.ndarray, near: float, is_round: bool
) -> Pairs:
    """Every pixel of every splat's box is tried."""
    shown, reach = splats.size > 0, splat_reach(splats.size, is_round)
    intrinsics = np.array(source.intrinsics, F), np.array(target.intrinsics, F)
    splat = carry_footprint(splats.centre, splats.z, splats.normal, intrinsics[0], view, intrinsics[1])
    bend = splat_bend(splat, reach)
    shown &= splat_is_ahead(splat, near) & (splat_bends(splat, reach) < ENDLESS)
    extent = footprint_extent(splat, reach, is_round)
    edge = np.array([target.width, target.height]) - 1
    low = np.maximum(np.ceil(np.maximum(splat.centre - extent, -0.5)).astype(int), 0)
    high = np.minimum(np.floor(np.minimum(splat.centre + extent, edge + 0.5)).astype(int), edge)
    across, down = np.moveaxis(np.where(shown[:, None], np.maximum(high - low + 1, 0), 0), -1, 0)
    which = np.repeat(np.arange(len(shown)), across * down)
    place = np.arange(len(which)) - np.repeat(np.cumsum(across * down) - across * down, across * down)
    q = low[which] + np.stack([place % np.maximum(across[which], 1), place // np.maximum(across[which], 1)], -1)
    to_source = invert_footprint(splat.to_target)[which]
    keep = footprint_covers(to_source, bend[which], q.astype(F) - splat.centre[which], reach[which], is_round)
    which = which[keep]
    return Pairs(Footprint(*(part[which] for part in splat)), to_source[keep], splats.source_index[which], q[keep])


def source_ids(pairs: Pairs, near: float, target: Camera) -> np.ndarray:
    """(h, w) int: the source pixel that each target pixel shows, -1 for none: the result of the points."""
    z_clip = F(1) - F(2) * F(near) * pairs.splat.inverse_depth
    window = np.round((z_clip * F(0.5) + F(0.5)).astype(float) * DEPTH_STEPS)
    order = np.lexsort((pairs.source_index, window))[::-1]  # farthest first: the nearest writes last and stays
    result = np.full((target.height, target.width), -1)
    result[pairs.q[order, 1], pairs.q[order, 0]] = pairs.source_index[order]
    return result


def nearest(pairs: Pairs, target: Camera) -> np.ndarray:
    """(h, w) float32: the greatest 1/z of each target pixel, 0 for none: the result of the compute rasteriser."""
    offset = pairs.q.astype(F) - pairs.splat.centre
    result = np.zeros((target.height, target.width), F)
    place = pairs.q[:, 1], pairs.q[:, 0]
    np.maximum.at(result, place, footprint_inverse_depth(pairs.splat, pairs.to_source, offset))
    return result


def buffer_depths(near: float, inverse_depth: np.ndarray) -> np.ndarray:
    """(h, w) float32 window depth 1 - near/z as a depth buffer keeps it."""
    window = np.clip(F(1) - F(near) * inverse_depth, F(0), F(1)).astype(float)
    return (np.round(window * DEPTH_STEPS) / DEPTH_STEPS).astype(F)
