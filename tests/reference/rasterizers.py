"""Both rasterisers on the CPU: what splats.vert, splats.frag and splats.comp do around the mirrored functions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pointshade_gl.scene.camera import Camera

from .camera import pixel_ray
from .depth_lookup import hidden_mark, pixel_of
from .rim_splat import draws_rim, is_hidden, meet_rim, rim_box
from .rims import Rim, estimate_rim
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
from .splat_corners import surface_at

F = np.float32
DEPTH_STEPS = float(2**24 - 1)  # the depth buffer is 24-bit fixed point


class Pairs(NamedTuple):
    """Every (splat, target pixel that it covers), n of them."""

    splat: Footprint  # of the pair
    inverse_depth: np.ndarray  # (n,) of the splat there
    source_index: np.ndarray  # (n,) the source pixel's number, row by row
    q: np.ndarray  # (n, 2) the target pixel
    is_rim: np.ndarray  # (n,)
    is_hidden: np.ndarray  # (n,) behind others in its frame


class Splats(NamedTuple):
    """n splats to carry into the view; a splat of merged pixels has the number of the first."""

    centre: np.ndarray  # (n, 2) source pixels
    z: np.ndarray  # (n,)
    normal: np.ndarray  # (n, 3)
    size: np.ndarray  # (n,) side or diameter, source pixels
    source_index: np.ndarray  # (n,) the source pixel's number, row by row


def single_splats(depth: np.ndarray, normals: np.ndarray, size: np.ndarray) -> Splats:
    """A splat for every pixel. size (1,) or (h*w,) source pixels; normals 0 where missing; depth negative at rims."""
    v, u = np.nonzero(depth)
    index = v * depth.shape[1] + u
    sizes = np.broadcast_to(size, depth.size)[index].astype(F)
    return Splats(np.stack([u, v], -1).astype(F), np.abs(depth[v, u]), normals[v, u], sizes, index)


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
    """What the splats cover, all of them drawn as footprints."""
    shown, reach = splats.size > 0, splat_reach(splats.size, is_round)
    intrinsics = np.array(source.intrinsics, F), np.array(target.intrinsics, F)
    splat = carry_footprint(splats.centre, splats.z, splats.normal, intrinsics[0], view, intrinsics[1])
    bend = splat_bend(splat, reach)
    shown &= splat_is_ahead(splat, near) & (splat_bends(splat, reach) < ENDLESS)
    extent = footprint_extent(splat, reach, is_round)
    which, q = _pixels_of(np.concatenate([splat.centre - extent, splat.centre + extent], -1), shown, target)
    to_source, offset = invert_footprint(splat.to_target)[which], q.astype(F) - splat.centre[which]
    keep = footprint_covers(to_source, bend[which], offset, reach[which], is_round)
    which, q, to_source, offset = which[keep], q[keep], to_source[keep], offset[keep]
    found = Footprint(*(part[which] for part in splat))
    depth, index = footprint_inverse_depth(found, to_source, offset), splats.source_index[which]
    return Pairs(found, depth, index, q, *np.zeros((2, len(q)), bool))


def rim_pairs(
    surface_map: np.ndarray, index: np.ndarray, source: Camera, target: Camera, view: np.ndarray, near: float
) -> Pairs:
    """What rims cover: the source pixels with these numbers (n,)."""
    pixel = pixel_of(index, source.width)
    centre, own, cameras = pixel.astype(F), surface_at(surface_map, pixel), _cameras(source, target, view)
    splat, rim = carry_footprint(centre, own[:, 3], own[:, :3], *cameras), estimate_rim(surface_map, pixel, cameras[0])
    box = rim_box(rim, centre, own, *cameras)
    which, q = _pixels_of(box, splat_is_ahead(splat, near), target)
    its, there = Rim(*(part[which] for part in rim)), q.astype(F)
    met, off = meet_rim(its, centre[which], own[which], splat.inverse_depth[which], there, *cameras)
    keep = met > 0
    which, q, met, off = which[keep], q[keep], met[keep], off[keep]
    its, found = Rim(*(part[keep] for part in its)), Footprint(*(part[which] for part in splat))
    return Pairs(found, met, index[which], q, np.ones(len(which), bool), is_hidden(its, off))


def drawn_pairs(
    splats: Splats, surface_map: np.ndarray, source: Camera, target: Camera, view: np.ndarray, near: float
) -> Pairs:
    """What splats of size 1 and of merged pixels cover; rims are drawn as such."""
    marked = (surface_map[..., 3].ravel()[splats.source_index] < 0) & (splats.size == 1)
    cameras = _cameras(source, target, view)
    footprint = carry_footprint(splats.centre, splats.z, splats.normal, *cameras)
    rims = marked & draws_rim(footprint, splats.z, cameras[0], cameras[2])
    others = Splats(*(part[~rims] for part in splats))
    drawn = covered_pairs(others, source, target, view, near, False)
    found = rim_pairs(surface_map, splats.source_index[rims], source, target, view, near)
    splat = Footprint(*map(_joined, drawn.splat, found.splat))
    return Pairs(splat, *map(_joined, drawn[1:], found[1:]))


def source_ids(pairs: Pairs, near: float, target: Camera) -> tuple[np.ndarray, np.ndarray]:
    """(h, w) int: the source pixel that each target pixel shows, -1 for none; (h, w) float32: 1/z of rims, else 0.

    The result of the points.
    """
    window = window_depths(pairs, near)
    order = np.argsort(window, kind="stable")[::-1]  # farthest first: the nearest, of equals the first, writes last
    ids, depth = np.full((target.height, target.width), -1), np.zeros((target.height, target.width), F)
    place = pairs.q[order, 1], pairs.q[order, 0]
    ids[place] = pairs.source_index[order]
    depth[place] = np.where(pairs.is_rim, (F(1) - window.astype(F)) / F(near), F(0))[order]
    return ids, depth


def window_depths(pairs: Pairs, near: float) -> np.ndarray:
    """(n,) window depth as a depth buffer keeps it: of splats that of their centres, of rims their own."""
    z_clip = F(1) - F(2) * F(near) * pairs.splat.inverse_depth
    window = np.where(pairs.is_rim, F(1) - F(near) * pairs.inverse_depth, z_clip * F(0.5) + F(0.5)).astype(float)
    return np.round(window * DEPTH_STEPS) / DEPTH_STEPS


def nearest(pairs: Pairs, target: Camera) -> np.ndarray:
    """(h, w) float32: the greatest 1/z of each target pixel, 0 for none: the result of the compute rasteriser.

    The last bit says that it is hidden in its frame.
    """
    result = np.zeros((target.height, target.width), np.uint32)
    bits = np.ascontiguousarray(pairs.inverse_depth, F).view(np.uint32)
    np.maximum.at(result, (pairs.q[:, 1], pairs.q[:, 0]), hidden_mark(bits, pairs.is_hidden))
    return result.view(F)


def buffer_depths(near: float, inverse_depth: np.ndarray) -> np.ndarray:
    """(h, w) float32 window depth 1 - near/z as a depth buffer keeps it."""
    window = np.clip(F(1) - F(near) * inverse_depth, F(0), F(1)).astype(float)
    return (np.round(window * DEPTH_STEPS) / DEPTH_STEPS).astype(F)


def _pixels_of(box: np.ndarray, shown: np.ndarray, target: Camera) -> tuple[np.ndarray, np.ndarray]:
    """All pixels of the view in boxes (n, 4): number of the box, and the pixel (m, 2); shown (n,) says which count."""
    edge = np.array([target.width, target.height]) - 1
    low = np.maximum(np.ceil(np.maximum(box[:, :2], -0.5)).astype(int), 0)
    high = np.minimum(np.floor(np.minimum(box[:, 2:], edge + 0.5)).astype(int), edge)
    across, down = np.moveaxis(np.where(shown[:, None], np.maximum(high - low + 1, 0), 0), -1, 0)
    which = np.repeat(np.arange(len(shown)), across * down)
    place = np.arange(len(which)) - np.repeat(np.cumsum(across * down) - across * down, across * down)
    wide = np.maximum(across[which], 1)
    return which, low[which] + np.stack([place % wide, place // wide], -1)


def _cameras(source: Camera, target: Camera, view: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return np.array(source.intrinsics, F), view, np.array(target.intrinsics, F)


def _joined(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.concatenate([one, other])
