"""The mesh between the pixels of a frame on the CPU: what grid_planes.frag and grid.comp do around grid.glsl."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pointshade_gl.scene.camera import Camera
from pointshade_gl.scene.normal_methods import Step

from .camera import mean_focal_length
from .grid import (
    FIRST,
    QUARTER,
    SECOND,
    Piece,
    carry_plane,
    code_reach,
    code_triangles,
    covers_corner,
    edge_piece,
    edge_reach,
    edge_slope,
    grid_code,
    invert_carried,
    is_level,
    piece_inverse_depth,
    piece_pixels,
    plane_piece,
    square_pieces,
    square_plane,
    square_triangles,
    triangle_piece,
)
from .rasterizers import rim_pairs
from .rim_splat import draws_rim
from .splat import carry_footprint, splat_is_ahead
from .splat_corners import surface_at
from .texels import texel_or_zero

F = np.float32


class Squares(NamedTuple):
    """All squares of a frame, those included that have only some corners in it; n of them."""

    first: np.ndarray  # (n, 2) int, from -1 on
    w: np.ndarray  # (n, 4) 1/z of the corners, 0 where there is none
    triangles: np.ndarray  # (n,) int


def triangle_map_of(surface_map: np.ndarray, source: Camera, max_step: Step) -> np.ndarray:
    """(h, w) float32, the codes of grid_triangles.frag; surface_map (h, w, 4), unit normal and depth."""
    padded = np.pad(np.concatenate([surface_map[..., :3], np.abs(surface_map[..., 3:])], -1), ((0, 1), (0, 1), (0, 0)))
    corners = padded[:-1, :-1], padded[:-1, 1:], padded[1:, :-1], padded[1:, 1:]
    height, width = surface_map.shape[:2]
    pixel = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1)
    intrinsics = np.array(source.intrinsics, F)
    triangles = square_triangles(*corners, pixel.astype(F), intrinsics, np.array(max_step, F))
    known = surface_map[..., 3] != 0
    reach = np.full((height, width, 4), 0.5, F)
    reach[known] = edge_reach(surface_map, pixel[known], intrinsics)
    return grid_code(triangles, reach)


def squares_of(surface_map: np.ndarray, triangle_map: np.ndarray) -> Squares:
    height, width = surface_map.shape[:2]
    first = np.stack(np.meshgrid(np.arange(-1, width), np.arange(-1, height)), -1).reshape(-1, 2)
    z = np.abs([texel_or_zero(surface_map, first + off)[..., 3] for off in ((0, 0), (1, 0), (0, 1), (1, 1))])
    w = np.where(z > 0, F(1) / np.where(z > 0, z, F(1)), F(0))
    codes = texel_or_zero(triangle_map[..., None], first)[..., 0]
    return Squares(first, np.moveaxis(w, 0, -1).astype(F), code_triangles(codes))


def planes_of(squares: Squares, shape: tuple[int, int], focal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) the planes of squares, and (n,) how many in a row and in a column share each.

    That is 0 for squares that are drawn in pieces, -1 for those drawn with another one. shape: of the frame
    """
    rows, columns = shape[0] + 1, shape[1] + 1
    whole = (squares.triangles & (FIRST + SECOND) == FIRST + SECOND).reshape(rows, columns)
    w = np.zeros((rows + 2, columns + 2), F)  # 1/z of the pixels from -1 on
    w[:-2, :-2] = squares.w[:, 0].reshape(rows, columns)
    plane, side = np.zeros((rows, columns, 3), F), np.zeros((rows, columns), int)
    for size in (1, 2):
        at = np.s_[: rows // size * size : size, : columns // size * size : size]
        v, u = np.mgrid[at]
        corners = np.stack([w[v, u], w[v, u + size], w[v + size, u], w[v + size, u + size]], -1)
        found = square_plane(corners) / np.array((size, size, 1), F)
        is_one = np.ones(v.shape, bool)
        for k in range((size + 1) ** 2):
            x, y = k % (size + 1), k // (size + 1)
            if max(x, y) < size:
                is_one &= whole[v + y, u + x]
            is_one &= is_level(w[v + y, u + x], np.array((x, y), F), found, focal)
        together = [(v[is_one] + k // size, u[is_one] + k % size) for k in range(size * size)]
        for other in together:
            side[other] = -1
        plane[together[0]], side[together[0]] = found[is_one], size
    return plane.reshape(-1, 3), side.ravel()


def pieces_of(
    surface_map: np.ndarray, triangle_map: np.ndarray, source: Camera, rims: np.ndarray
) -> tuple[Piece, np.ndarray]:
    """All pieces, and the first pixels (n, 2) of their squares. rims (h, w): pixels that are drawn as rims."""
    squares, intrinsics = squares_of(surface_map, triangle_map), np.array(source.intrinsics, F)
    plane, side = planes_of(squares, surface_map.shape[:2], mean_focal_length(intrinsics))
    flat = side > 0
    found = [(plane_piece(plane[flat], side[flat].astype(F)), squares.first[flat])]
    odd = Squares(*(part[side == 0] for part in squares))
    pieces = square_pieces(odd.w, odd.triangles)
    for number in (FIRST, SECOND):
        some = Squares(*(part[pieces & number != 0] for part in odd))
        is_second = np.full(len(some.first), number == SECOND)
        found.append((triangle_piece(some.w, some.triangles, is_second), some.first))
    for corner in range(4):
        some = Squares(*(part[pieces & QUARTER << corner != 0] for part in odd))
        found.append(_outer_pieces(some, corner, surface_map, triangle_map, intrinsics, rims))
    parts, first = zip(*found, strict=True)
    return Piece(*(np.concatenate(values) for values in zip(*parts, strict=True))), np.concatenate(first)


def _outer_pieces(
    some: Squares, corner: int, surface_map: np.ndarray, triangle_map: np.ndarray, source: np.ndarray, rims: np.ndarray
) -> tuple[Piece, np.ndarray]:
    """What the pixels at one corner cover of squares."""
    pixel = some.first + np.array((corner & 1, corner >> 1))
    reach = code_reach(triangle_map[pixel[:, 1], pixel[:, 0]])
    side = reach[:, [0 if corner & 1 else 2, 1 if corner >> 1 else 3]]
    shown = (side > 1).any(-1) | ~rims[pixel[:, 1], pixel[:, 0]]
    some, pixel, reach, side = Squares(*(part[shown] for part in some)), pixel[shown], reach[shown], side[shown]
    surface = surface_at(surface_map, pixel)
    slope = edge_slope(surface, pixel.astype(F), side > 1, source)
    corners = np.full(len(pixel), corner)
    return edge_piece(F(1) / surface[:, 3], some.triangles, corners, slope, reach), some.first


def drawn_as_rims(surface_map: np.ndarray, source: Camera, target: Camera, view: np.ndarray, near: float) -> np.ndarray:
    """(h, w) bool"""
    found = np.zeros(surface_map.shape[:2], bool)
    v, u = np.nonzero(surface_map[..., 3] < 0)
    pixel, intrinsics = np.stack([u, v], -1), (np.array(source.intrinsics, F), np.array(target.intrinsics, F))
    own = surface_at(surface_map, pixel)
    splat = carry_footprint(pixel.astype(F), own[:, 3], own[:, :3], intrinsics[0], view, intrinsics[1])
    found[v, u] = splat_is_ahead(splat, near) & draws_rim(splat, own[:, 3], *intrinsics)
    return found


def ends_of(triangle_map: np.ndarray) -> np.ndarray:
    """(h, w) bool: the pixels that triangles do not cover all around."""
    triangles = np.pad(code_triangles(triangle_map), ((1, 0), (1, 0)))
    around = [covers_corner(triangles[1 - y or None :, 1 - x or None :][: len(triangle_map), : triangle_map.shape[1]],
                            x + 2 * y) for y in (0, 1) for x in (0, 1)]  # fmt: skip
    return ~np.logical_and.reduce(around)


def nearest_of_grid(
    surface_map: np.ndarray,
    triangle_map: np.ndarray,
    source: Camera,
    target: Camera,
    view: np.ndarray,
    near: float,
) -> np.ndarray:
    """(h, w) float32: the greatest 1/z of a mesh at each target pixel, 0 for none."""
    rims = drawn_as_rims(surface_map, source, target, view, near)
    piece, first = pieces_of(surface_map, triangle_map, source, rims)
    cameras = np.array(source.intrinsics, F), view, np.array(target.intrinsics, F)
    carried = carry_plane(piece.plane, first.astype(F), *cameras)
    box = piece_pixels(piece, carried, np.array((target.width, target.height)), near)
    across, down = np.maximum(box[:, 2:] - box[:, :2] + 1, 0).T
    which = np.repeat(np.arange(len(box)), across * down)
    k = np.arange(len(which)) - np.repeat(np.cumsum(across * down) - across * down, across * down)
    wide = np.maximum(across[which], 1)
    q = box[which, :2] + np.stack([k % wide, k // wide], -1)
    own = Piece(*(values[which] for values in piece))
    result = np.zeros((target.height, target.width), F)
    np.maximum.at(result, (q[:, 1], q[:, 0]), piece_inverse_depth(own, invert_carried(carried)[which], q, near))
    index = np.flatnonzero(rims & ends_of(triangle_map))
    ends = rim_pairs(surface_map, index, source, target, view, near)
    np.maximum.at(result, (ends.q[:, 1], ends.q[:, 0]), ends.inverse_depth)
    return result
