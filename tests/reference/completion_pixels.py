"""Mirror of shaders/common/completion_pixels.glsl, for n pixels at once."""

from __future__ import annotations

import numpy as np

from .camera import pixel_ray
from .completion import (
    MANY,
    SIDE,
    candidate_of,
    cell_middle,
    color_vote,
    elect,
    elected,
    moved_plane,
    unpack_color,
)
from .inverse_depth import normal_of_slope, relative_step
from .rim_marks import is_rim
from .splat_corners import unmarked
from .texels import texel_at, texel_or_zero
from .upsample_vote import color_likeness, gaussian
from .vectors import normalize

F = np.float32
NEIGHBOURHOOD, COMPLETED = 1.0, F(0.5)
CROSS = np.array([(-1, 0), (1, 0), (0, -1), (0, 1)])


def complete_pixel(
    near_planes: np.ndarray,
    other_planes: np.ndarray,
    colors_map: np.ndarray,
    plane_map: np.ndarray,
    pixel: np.ndarray,
    color: np.ndarray,
    hidden_below: np.ndarray,
    source: np.ndarray,
) -> np.ndarray:
    cell, candidates = pixel // SIDE, []
    for k in range(9):
        there = cell + np.array([k % 3 - 1, k // 3 - 1])
        near_plane, colors = texel_or_zero(near_planes, there), texel_or_zero(colors_map, there)
        has_own = near_plane[:, 3] >= MANY
        completed = texel_or_zero(plane_map, there)
        other_plane = np.where(has_own[:, None], texel_or_zero(other_planes, there), completed)
        off = pixel.astype(F) - cell_middle(there)
        closeness = gaussian(off / F(SIDE), NEIGHBOURHOOD)
        certainty = (
            np.minimum(near_plane[:, 3] / MANY, F(1)),
            np.where(has_own, np.minimum(other_plane[:, 3] / MANY, F(1)), COMPLETED * other_plane[:, 3]),
        )
        theirs = colors[:, 0], np.where(has_own, colors[:, 1], colors[:, 2])
        for plane, certain, packed in zip((near_plane, other_plane), certainty, theirs, strict=True):
            votes = certain * (color_vote(color_likeness(unpack_color(packed), color)) * closeness)
            candidates.append(candidate_of(moved_plane(plane[:, :3], off), votes, hidden_below))
    everyone = np.stack(candidates, 1)
    plane = elected(everyone, elect(everyone))
    found = (plane[:, 3] > 0) & (texel_at(plane_map, cell)[:, 3] > 0)
    w = np.where(found, plane[:, 0], F(1))
    ray = pixel_ray(pixel.astype(F), source)
    normal = normal_of_slope((plane[:, 1] / w, plane[:, 2] / w), (ray[:, 0], ray[:, 1]), source)
    surface = np.concatenate([normal, (F(1) / w)[:, None]], -1)
    return np.where(found[:, None], surface, F(0))


def depth_or_zero(surface_map: np.ndarray, pixel: np.ndarray) -> np.ndarray:
    return np.abs(texel_or_zero(surface_map, pixel)[..., 3])


def join_completed(
    surface_map: np.ndarray, completed_map: np.ndarray, pixel: np.ndarray, source: np.ndarray, beyond: float
) -> np.ndarray:
    own, completed = texel_at(surface_map, pixel), texel_at(completed_map, pixel)
    is_completed, is_known = completed[:, 3:] > 0, own[:, 3:] != 0
    beside = [texel_or_zero(completed_map, pixel + off)[:, 3] for off in CROSS]
    joined = np.where(is_completed, completed, np.where(is_known, unmarked(own), F(1)))
    depth = [
        np.maximum(there, depth_or_zero(surface_map, pixel + off)) for there, off in zip(beside, CROSS, strict=True)
    ]
    steps = np.stack([relative_step(joined[:, 3], there) for there in depth], -1)
    rim = is_rim(steps, pixel.T.astype(F), surface_map.shape[1::-1], source, 0.0)
    marked = np.concatenate([joined[:, :3], np.where(rim, -joined[:, 3], joined[:, 3])[:, None]], -1)
    is_new = is_completed | (is_known & (np.max(beside, 0) > 0)[:, None])
    found = np.where(is_new, marked, own)
    away = np.concatenate([normalize(pixel_ray(pixel.astype(F), source)), np.full((len(pixel), 1), beyond, F)], -1)
    return np.where((found[:, 3:] == 0) & (beyond > 0), away, found)
