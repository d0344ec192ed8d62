"""Mirror of shaders/common/grid.glsl, for n squares, pieces or pixels at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .camera import mean_focal_length, pixel_ray
from .depth_lookup import BEFORE, HIDDEN_PIXELS, NEARBY, SAME_SURFACE, carry_back, look_up_error
from .inverse_depth import facing_slope, relative_step
from .splat import inverse_depth_slope, lies_on_plane
from .splat_corners import Corners, corners_at, four, surface_at
from .texels import texel_or_zero
from .vectors import dot, length, normalize, texel

F = np.float32
FIRST, SECOND = 1, 2
OTHER_DIAGONAL = 4
CODES = 8
QUARTER = 4
LEVEL, SEAM = F(0.05), F(0.02)
STEEPEST, STEEP_END = F(10), F(1)
ON_MESH = F(0.0005)
NO_SIDE = np.array((0, 0, 1), F)


class Piece(NamedTuple):
    plane: np.ndarray  # (n, 3)
    box: np.ndarray  # (n, 4)
    side: np.ndarray  # (n, 3)


class GridSeen(NamedTuple):
    at: np.ndarray  # (n, 2)
    inverse_depth: np.ndarray  # (n,)
    pixel: np.ndarray  # (n, 2) int
    triangle: np.ndarray  # (n,) int
    is_whole: np.ndarray  # (n,) bool
    corners: Corners


def is_joined(
    own: np.ndarray, other: np.ndarray, pixel: np.ndarray, off: np.ndarray, intrinsics: np.ndarray, max_step: np.ndarray
) -> np.ndarray:
    z, other_z = own[..., 3], other[..., 3]
    known = (z > 0) & (other_z > 0)
    if max_step.any():
        return known & (np.abs(z - other_z) <= max_step[0] + max_step[1] * np.minimum(z, other_z))
    safe, other_safe = np.where(known, z, F(1)), np.where(known, other_z, F(1))
    slope = inverse_depth_slope(own[..., :3], pixel_ray(pixel, intrinsics), safe, intrinsics)
    other_slope = inverse_depth_slope(other[..., :3], pixel_ray(pixel + off, intrinsics), other_safe, intrinsics)
    one = lies_on_plane(other_z, off, z, slope, float(SAME_SURFACE))
    return one | lies_on_plane(z, -off, other_z, other_slope, float(SAME_SURFACE))


def square_triangles(
    a: np.ndarray,
    b: np.ndarray,
    c: np.ndarray,
    d: np.ndarray,
    pixel: np.ndarray,
    intrinsics: np.ndarray,
    max_step: np.ndarray,
) -> np.ndarray:
    right, down = np.array((1, 0), F), np.array((0, 1), F)
    above = is_joined(a, b, pixel, right, intrinsics, max_step)
    below = is_joined(c, d, pixel + down, right, intrinsics, max_step)
    left = is_joined(a, c, pixel, down, intrinsics, max_step)
    beside = is_joined(b, d, pixel + right, down, intrinsics, max_step)
    rising = is_joined(b, c, pixel + right, down - right, intrinsics, max_step)
    falling = is_joined(a, d, pixel, right + down, intrinsics, max_step)
    usual = FIRST * (above & left & rising) + SECOND * (below & beside & rising)
    others = FIRST * (above & beside & falling) + SECOND * (left & below & falling)
    return np.where((usual == 0) & (others != 0), OTHER_DIAGONAL + others, usual)


def hides(
    surface_map: np.ndarray, pixel: np.ndarray, off: np.ndarray, z: np.ndarray, slope: np.ndarray, focal: np.ndarray
) -> np.ndarray:
    there = np.abs(texel_or_zero(surface_map, pixel + off)[..., 3])
    rise = focal * (relative_step(z, there) - dot(slope, np.asarray(off, F))[..., 0])
    return (there > 0) & (rise > BEFORE)


def edge_reach(surface_map: np.ndarray, pixel: np.ndarray, source: np.ndarray) -> np.ndarray:
    own, ray, focal = surface_at(surface_map, pixel), pixel_ray(pixel.astype(F), source), mean_focal_length(source)
    z = own[..., 3]
    slope = z[..., None] * inverse_depth_slope(own[..., :3], ray, z, source)
    steep = slope - np.stack(facing_slope((ray[..., 0], ray[..., 1]), source), -1)
    reach = np.full((*z.shape, 4), 0.5, F)
    for k, outward in enumerate(np.array([(-1, 0), (0, -1), (1, 0), (0, 1)])):
        goes_on = focal * np.abs(dot(steep, outward.astype(F))[..., 0]) < STEEPEST
        for off in range(1, HIDDEN_PIXELS + 1):
            goes_on &= hides(surface_map, pixel, off * outward, z, slope, focal)
            reach[..., k] += goes_on
    for k in range(4 * HIDDEN_PIXELS * HIDDEN_PIXELS):
        right, down = 2 * (k & 1), 1 + (k & 2)
        off, outward = np.array((k >> 2 & 1, k >> 3)) + 1, np.array((right - 1, down - 2))
        is_reached = (reach[..., right] > off[0]) & (reach[..., down] > off[1])
        stops = is_reached & ~hides(surface_map, pixel, off * outward, z, slope, focal)
        reach[..., down] = np.where(stops, F(0.5), reach[..., down])
    return reach


def edge_slope(own: np.ndarray, pixel: np.ndarray, is_hidden: np.ndarray, source: np.ndarray) -> np.ndarray:
    ray, z = pixel_ray(pixel, source), own[..., 3:]
    slope = inverse_depth_slope(own[..., :3], ray, own[..., 3], source)
    facing = np.stack(facing_slope((ray[..., 0], ray[..., 1]), source), -1) / z
    most = STEEP_END / (mean_focal_length(source) * z)
    return np.where(is_hidden, slope, facing + np.clip(slope - facing, -most, most))


def grid_code(triangles: np.ndarray, reach: np.ndarray) -> np.ndarray:
    return triangles.astype(F) + F(CODES) * (np.floor(reach) @ np.array((1, 4, 16, 64), F))


def code_triangles(code: np.ndarray) -> np.ndarray:
    return code.astype(int) & (CODES - 1)


def code_reach(code: np.ndarray) -> np.ndarray:
    hidden = code.astype(int) // CODES
    return F(0.5) + np.stack([hidden >> k & 3 for k in (0, 2, 4, 6)], -1).astype(F)


def first_side(triangles: np.ndarray) -> np.ndarray:
    other = np.asarray(triangles & OTHER_DIAGONAL)[..., None] != 0
    return np.where(other, np.array((1, -1, 0), F), np.array((-1, -1, 1), F))


def triangle_plane(w: np.ndarray, triangles: np.ndarray, is_second: np.ndarray) -> np.ndarray:
    a, b, c, d = np.moveaxis(w, -1, 0)
    is_other = triangles & OTHER_DIAGONAL != 0
    right, down = np.where(is_second, d - c, b - a), np.where(is_second != is_other, d - b, c - a)
    return np.stack([right, down, np.where(is_second & ~is_other, b + c - d, a)], -1)


def square_plane(w: np.ndarray) -> np.ndarray:
    a, b, c, d = np.moveaxis(w, -1, 0)
    right, down = F(0.5) * (b - a + d - c), F(0.5) * (c - a + d - b)
    return np.stack([right, down, F(0.25) * (a + b + c + d) - F(0.5) * (right + down)], -1)


def covers_corner(triangles: np.ndarray, corner: np.ndarray | int) -> np.ndarray:
    there, is_other = triangles & (FIRST + SECOND), triangles & OTHER_DIAGONAL != 0
    by_first = (there == FIRST) & (corner == np.where(is_other, 1, 0))
    by_second = (there == SECOND) & (corner == np.where(is_other, 2, 3))
    return (there == FIRST + SECOND) | by_first | by_second


def is_level(w: np.ndarray, place: np.ndarray, plane: np.ndarray, focal: np.ndarray) -> np.ndarray:
    expected = plane[..., 0] * place[..., 0] + plane[..., 1] * place[..., 1] + plane[..., 2]
    return focal * np.abs(w - expected) < LEVEL * w


def square_pieces(w: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    pieces = triangles & (FIRST + SECOND)
    for k in range(4):
        pieces = pieces + np.where((w[..., k] > 0) & ~covers_corner(triangles, k), QUARTER << k, 0)
    return pieces


def plane_piece(plane: np.ndarray, side: np.ndarray) -> Piece:
    none = np.zeros_like(side)
    return Piece(plane, np.stack([none, none, side, side], -1), np.broadcast_to(NO_SIDE, plane.shape))


def triangle_piece(w: np.ndarray, triangles: np.ndarray, is_second: np.ndarray) -> Piece:
    plane, side = triangle_plane(w, triangles, is_second), first_side(triangles)
    box = np.broadcast_to(np.array((0, 0, 1, 1), F), w.shape)
    return Piece(plane, box, np.where(is_second[..., None], -side, side))


def edge_piece(w: np.ndarray, triangles: np.ndarray, corner: np.ndarray, slope: np.ndarray, reach: np.ndarray) -> Piece:
    at = np.stack([corner & 1, corner >> 1], -1).astype(F)
    box = np.concatenate([at - reach[..., :2] * at, at + reach[..., 2:] * (1 - at)], -1)
    first, alone = (triangles & FIRST != 0)[..., None], (triangles & (FIRST + SECOND) == 0)[..., None]
    side = np.where(first, -first_side(triangles), first_side(triangles))
    plane = np.concatenate([slope, (w - dot(slope, at)[..., 0])[..., None]], -1)
    return Piece(plane, box, np.where(alone, NO_SIDE, side))


def carry_plane(
    plane: np.ndarray, square: np.ndarray, source: np.ndarray, view: np.ndarray, target: np.ndarray
) -> np.ndarray:
    """(n, 3, 3), which takes columns."""
    turn, shift = view[:3, :3], view[:3, 3]
    first = pixel_ray(square, source) @ turn.T + shift * plane[..., 2:]
    right = turn[:, 0] / source[0] + shift * plane[..., :1]
    down = turn[:, 1] / source[1] + shift * plane[..., 1:2]
    lens = np.array([(target[0], 0, target[2]), (0, target[1], target[3]), (0, 0, 1)], F)
    return lens @ np.stack([right, down, first], -1)


def invert_carried(carried: np.ndarray) -> np.ndarray:
    a, b, c = np.moveaxis(carried, -1, 0)
    x, y, s = np.cross(b, c), np.cross(c, a), np.cross(a, b)
    volume = dot(a, x)[..., None]
    return np.where(volume == 0, F(0), np.stack([x, y, s], -2) / np.where(volume == 0, F(1), volume))


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def piece_pixels(piece: Piece, carried: np.ndarray, target_size: np.ndarray, near: float) -> np.ndarray:
    """(n, 4) int: columns and rows of the first pixel and the last."""
    size, low_corner = np.asarray(target_size, F), piece.box + SEAM * np.array((-1, -1, 1, 1), F)
    places = [np.stack([low_corner[..., i], low_corner[..., j], np.ones(len(low_corner), F)], -1)
              for j in (1, 3) for i in (0, 2)]  # fmt: skip
    at = np.stack([(carried @ place[..., None])[..., 0] for place in places], 1)
    before = np.stack([near * dot(piece.plane, place)[..., 0] for place in places], 1) <= at[..., 2]
    x, y, z = np.moveaxis(at, -1, 0)
    beside = [(x < -z).all(1), (y < -z).all(1), (x > size[0] * z).all(1), (y > size[1] * z).all(1)]
    ratio = at[..., :2] / at[..., 2:]
    low, high = np.clip(np.ceil(ratio.min(1)), 0, size), np.clip(np.floor(ratio.max(1)), -1, size - 1)
    everything = np.concatenate([np.zeros(2), size - 1])
    box = np.where(np.expand_dims(before.all(1), 1), np.concatenate([low, high], -1), everything)
    unseen = ~before.any(1) | np.any(np.array(beside), axis=0)
    return np.where(np.expand_dims(unseen, 1), np.array((0, 0, -1, -1)), np.nan_to_num(box)).astype(int)


def piece_inverse_depth(piece: Piece, seen: np.ndarray, target_pixel: np.ndarray, near: float) -> np.ndarray:
    one = np.concatenate([target_pixel, np.ones((len(target_pixel), 1))], -1).astype(F)
    place = (seen @ one[..., None])[..., 0]
    z = place[..., 2:]
    off = np.concatenate([place[..., :2] - piece.box[..., :2] * z, piece.box[..., 2:] * z - place[..., :2]], -1)
    inverse_depth, side = dot(piece.plane, place)[..., 0], dot(piece.side, place)
    is_inside = ((off + SEAM * z).min(-1) >= 0) & (side >= -SEAM * z)[..., 0]
    is_ahead = (z[..., 0] > 0) & (inverse_depth > 0) & (near * inverse_depth <= 1)
    return np.where(is_inside & is_ahead, inverse_depth, F(0))


def triangle_weights(triangle: np.ndarray, place: np.ndarray) -> np.ndarray:
    x, y = np.moveaxis(place, -1, 0)
    none = np.zeros_like(x)
    usual = [(1 - x - y, x, y, none), (none, 1 - y, 1 - x, x + y - 1)]
    other = [(1 - x, x - y, none, y), (1 - y, none, y - x, x)]
    kinds = [np.stack(weights, -1) for weights in (*usual, *other)]
    known = [np.asarray(triangle == kind)[..., None] for kind in (FIRST, SECOND, OTHER_DIAGONAL + FIRST)]
    return np.select(known, kinds[:3], kinds[3])


def edge_inverse_depth(
    surface_map: np.ndarray, triangle_map: np.ndarray, pixel: np.ndarray, at: np.ndarray, source: np.ndarray
) -> np.ndarray:
    own, off = surface_at(surface_map, pixel), at - pixel.astype(F)
    reach = code_reach(triangle_map[pixel[..., 1], pixel[..., 0]])
    side = np.where(off > 0, reach[..., 2:], reach[..., :2])
    reaches = (own[..., 3] > 0) & (np.abs(off) <= side + 2 * SEAM).all(-1)
    own = np.where(reaches[..., None], own, F(1))
    slope = edge_slope(own, pixel.astype(F), side > 1, source)
    return np.where(reaches, F(1) / own[..., 3] + dot(slope, off)[..., 0], F(0))


def edge_error(
    surface_map: np.ndarray,
    triangle_map: np.ndarray,
    pixel: np.ndarray,
    at: np.ndarray,
    w_at: np.ndarray,
    source: np.ndarray,
) -> np.ndarray:
    w, marked = edge_inverse_depth(surface_map, triangle_map, pixel, at, source), texel(surface_map, pixel)[..., 3]
    error = np.where(w > 0, np.abs(w - w_at), F(1e30))
    as_rim = np.where(marked < 0, look_up_error(marked, pixel.astype(F), at, w_at), F(1e30))
    return np.minimum(error, as_rim) / w_at + NEARBY * length(at - pixel.astype(F))[..., 0]


def edge_pixel(
    surface_map: np.ndarray, triangle_map: np.ndarray, at: np.ndarray, w_at: np.ndarray, source: np.ndarray
) -> np.ndarray:
    last = np.array(surface_map.shape[1::-1]) - 1
    pixel = np.clip(np.floor(at + F(0.5)).astype(int), 0, last)
    least = edge_error(surface_map, triangle_map, pixel, at, w_at, source)
    fits, across = least <= ON_MESH, 2 * HIDDEN_PIXELS + 2
    for k in range(across * across):
        off = np.array((k % across, k // across)) - HIDDEN_PIXELS
        other = np.clip(np.floor(at).astype(int) + off, 0, last)
        error = edge_error(surface_map, triangle_map, other, at, w_at, source)
        better = ~fits & (error < least)
        pixel, least = np.where(better[..., None], other, pixel), np.where(better, error, least)
    return pixel


@np.errstate(divide="ignore", invalid="ignore")
def look_up_grid(
    surface_map: np.ndarray,
    triangle_map: np.ndarray,
    inverse_depth: np.ndarray,
    target_pixel: np.ndarray,
    source: np.ndarray,
    view: np.ndarray,
    target: np.ndarray,
) -> GridSeen:
    back = carry_back(target_pixel, inverse_depth, target, view, source)
    at, w_at = back[..., :2], back[..., 2]
    corners, last = corners_at(surface_map, at), np.array(surface_map.shape[1::-1]) - 1
    place, low = at - np.floor(at), corners.low
    is_inside = (np.floor(at).astype(int) == low).all(-1)
    triangles = np.where(is_inside, code_triangles(triangle_map[low[..., 1], low[..., 0]]), 0)
    one = np.concatenate([place, np.ones_like(place[..., :1])], -1)
    which = np.where(dot(first_side(triangles), one)[..., 0] >= 0, FIRST, SECOND)
    w = F(1) / np.abs(np.stack([corner[..., 3] for corner in corners[2:]], -1))
    on_mesh = dot(triangle_plane(w, triangles, which == SECOND), one)[..., 0]
    fits = (triangles & which != 0) & (np.abs(on_mesh - w_at) <= ON_MESH * w_at)
    nearest = np.clip(np.floor(at + F(0.5)).astype(int), 0, last)
    edge = edge_pixel(surface_map, triangle_map, at, w_at, source)
    on_mesh = np.where(fits, on_mesh, edge_inverse_depth(surface_map, triangle_map, edge, at, source))
    ahead = pixel_ray(at, source) @ view[2, :3] + view[2, 3] * on_mesh
    return GridSeen(
        at,
        np.where(np.abs(on_mesh - w_at) <= ON_MESH * w_at, on_mesh / ahead, inverse_depth),
        np.where(fits[..., None], nearest, edge),
        np.where(fits, which + (triangles & OTHER_DIAGONAL), 0),
        fits & (triangles & (FIRST + SECOND) == FIRST + SECOND),
        corners,
    )


def grid_color_position(seen: GridSeen) -> np.ndarray:
    return np.where(seen.is_whole[..., None], seen.at, seen.pixel.astype(F))


def mix_corners(
    seen: GridSeen, a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, own: np.ndarray
) -> np.ndarray:
    weight = triangle_weights(seen.triangle, seen.at - np.floor(seen.at))
    mixed = sum(weight[..., k : k + 1] * value for k, value in enumerate((a, b, c, d)))
    return np.where((seen.triangle == 0)[..., None], own, mixed)


def grid_normal(surface_map: np.ndarray, seen: GridSeen) -> np.ndarray:
    a, b, c, d = (corner[..., :3] for corner in seen.corners[2:])
    return normalize(mix_corners(seen, a, b, c, d, texel(surface_map, seen.pixel)[..., :3]))


def grid_light(light_map: np.ndarray, seen: GridSeen) -> np.ndarray:
    a, b, c, d = (texel(light_map, pixel)[..., :3] for pixel in four(seen.corners.low, seen.corners.high))
    return mix_corners(seen, a, b, c, d, texel(light_map, seen.pixel)[..., :3])


def triangle_normal(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
    n = np.cross((q - p) / p[..., 2:], (r - p) / p[..., 2:]).astype(F)
    size = length(n)
    facing = n / np.where(size > 0, np.where(dot(n, p) > 0, -size, size), F(1))
    return np.where(size > 0, facing, -normalize(p))


@np.errstate(divide="ignore", invalid="ignore")
def grid_facet(surface_map: np.ndarray, seen: GridSeen, source: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The middle and the facet."""
    low, offsets = seen.corners.low.astype(F), np.array([(0, 0), (1, 0), (0, 1), (1, 1)], F)
    pairs = zip(offsets, seen.corners[2:], strict=True)
    a, b, c, d = (pixel_ray(low + off, source) * np.abs(corner[..., 3:]) for off, corner in pairs)
    second, other = ((seen.triangle & kind != 0)[..., None] for kind in (SECOND, OTHER_DIAGONAL))
    p = np.where(other, np.where(second, c, b), np.where(second, d, a))
    q = np.where(other, np.where(second, a, d), np.where(second, c, b))
    r = np.where(other, np.where(second, d, a), np.where(second, b, c))
    own, alone = surface_at(surface_map, seen.pixel), (seen.triangle == 0)[..., None]
    middle = np.where(alone, pixel_ray(seen.pixel.astype(F), source) * own[..., 3:], (p + q + r) / F(3))
    return middle, np.where(alone, own[..., :3], triangle_normal(p, q, r))
