"""Mirror of shaders/common/upsample_vote.glsl, for n positions at once: vectors are (n, 2 to 4), numbers (n,)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .camera import pixel_ray
from .picture import rescale_position, sample_picture
from .splat import inverse_depth_slope, lies_on_plane
from .splat_corners import surface_at
from .texels import texel_at
from .vectors import dot, length, normalize, texel

F = np.float32
SAME_LAYER, VOTE_REACH, COLOR_REACH, VALUE_REACH = 0.03, 1.0, 0.1, 0.5
GUIDE_SPAN, CREASE, SAME_FACE, LEAST_FACE = 0.3333, 0.8, 0.99, 4.5


class Facet(NamedTuple):
    surface: np.ndarray  # (n, 4)
    pixel: np.ndarray  # (n, 2) float32
    slope: np.ndarray  # (n, 2)


def mean_color(picture: np.ndarray, position: np.ndarray, size: np.ndarray, span: float) -> np.ndarray:
    centre = rescale_position(position, size, np.array(picture.shape[1::-1], F))
    off = F(0.5) * max(F(span) - F(1), F(0))
    if off == 0:
        return sample_picture(picture, centre)
    corners = ((-off, -off), (off, -off), (-off, off), (off, off))
    a, b, c, d = (sample_picture(picture, centre + np.array(corner, F)) for corner in corners)
    return F(0.25) * ((a + b) + (c + d))


def is_cut_out(picture: np.ndarray, position: np.ndarray, size: np.ndarray) -> np.ndarray:
    if picture.shape[2] < 4:
        return np.zeros(len(position), bool)
    place = (position + F(0.5)) * (np.array(picture.shape[1::-1], F) / size)
    return texel(picture, place.astype(int))[..., 3] == 0


def gaussian(off: np.ndarray, reach: float) -> np.ndarray:
    return np.exp(-dot(off, off)[..., 0] / (F(2) * F(reach) * F(reach)))


def color_likeness(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    off = a - b
    return np.exp(-dot(off, off)[..., 0] / (F(2) * F(COLOR_REACH) * F(COLOR_REACH)))


def facet_at(surface_map: np.ndarray, pixel: np.ndarray, source: np.ndarray) -> Facet:
    inside = pixel == np.clip(pixel, 0, _last(surface_map))
    there = surface_at(surface_map, _nearest(surface_map, pixel))
    surface = np.where(inside.all(-1, keepdims=True), there, np.array([0, 0, 0, -1], F))
    at, known = pixel.astype(F), surface[..., 3] > 0
    normal = np.where(known[..., None], surface[..., :3], np.array([0, 0, -1], F))
    slope = inverse_depth_slope(normal, pixel_ray(at, source), np.where(known, surface[..., 3], F(1)), source)
    return Facet(surface, at, np.where(known[..., None], slope, F(0)))


def facet_reaches(facet: Facet, at: np.ndarray) -> np.ndarray:
    z = np.where(facet.surface[..., 3] > 0, facet.surface[..., 3], F(1))
    return F(1) / z + dot(facet.slope, at - facet.pixel)[..., 0]


def shares_layer(facet: Facet, own: Facet) -> np.ndarray:
    z, own_z = facet.surface[..., 3], own.surface[..., 3]
    on_plane = lies_on_plane(z, facet.pixel - own.pixel, own_z, own.slope, SAME_LAYER)
    return np.where(own_z <= 0, (own_z == 0) & (z == 0), on_plane)


def is_calm(surface_map: np.ndarray, pixel: np.ndarray, source: np.ndarray) -> np.ndarray:
    own = facet_at(surface_map, pixel, source)
    calm = own.surface[..., 3] > 0
    for k in range(25):
        facet = facet_at(surface_map, pixel + np.array([k % 5 - 2, k // 5 - 2]), source)
        alike = shares_layer(facet, own) & (_cosine(facet, own) > CREASE)
        calm &= (facet.surface[..., 3] < 0) | alike
    return calm.astype(F)


def calm_around(calm_map: np.ndarray, at: np.ndarray) -> np.ndarray:
    return np.min([texel_at(calm_map, _nearest(calm_map, _below(at) + _corner(k))) for k in range(4)], axis=0)


def add_facet(total: np.ndarray, weight: np.ndarray, facet: Facet, at: np.ndarray) -> np.ndarray:
    value = np.concatenate([facet.surface[..., :3], facet_reaches(facet, at)[..., None]], -1)
    return total + weight[..., None] * value


def mix_facets(surface_map: np.ndarray, at: np.ndarray, source: np.ndarray) -> np.ndarray:
    sum, total = np.zeros((len(at), 4), F), np.zeros(len(at), F)
    for k in range(4):
        facet = facet_at(surface_map, np.clip(_below(at) + _corner(k), 0, _last(surface_map)), source)
        closeness = np.maximum(F(1) - np.abs(at - facet.pixel), F(0))
        weight = closeness[..., 0] * closeness[..., 1]
        sum, total = add_facet(sum, weight, facet, at), total + weight
    return _mean(sum, total)


def win_vote(
    surface_map: np.ndarray,
    guide_map: np.ndarray,
    around: Sequence[Facet],
    at: np.ndarray,
    color: np.ndarray,
    source: np.ndarray,
) -> Facet:
    votes = [np.zeros(len(at), F) for _ in range(4)]
    for k in range(16):
        pixel = _below(at) + _of_16(k)
        facet = facet_at(surface_map, pixel, source)
        likeness = color_likeness(color, texel_at(guide_map, _nearest(guide_map, pixel))[..., :3])
        vote = gaussian(at - facet.pixel, VOTE_REACH) * likeness
        votes = [votes[j] + np.where(shares_layer(facet, around[j]), vote, F(0)) for j in range(4)]
    winner, most = around[0], votes[0]
    for j in range(1, 4):
        winner, most = _choose(votes[j] > most, around[j], winner), np.maximum(most, votes[j])
    return winner


def is_across_crease(own: Facet, other: Facet, at: np.ndarray) -> np.ndarray:
    front = facet_reaches(own, own.pixel) - facet_reaches(other, own.pixel)
    front = front + facet_reaches(other, other.pixel) - facet_reaches(own, other.pixel)
    return (facet_reaches(other, at) - facet_reaches(own, at)) * front > 0


def mix_layer(
    surface_map: np.ndarray, layer: Facet, own: Facet, other: Facet, at: np.ndarray, source: np.ndarray
) -> np.ndarray:
    both, face = np.zeros((len(at), 4), F), np.zeros((len(at), 4), F)
    both_total, face_total = np.zeros(len(at), F), np.zeros(len(at), F)
    sizes = np.zeros((2, len(at)), F)
    seen = _choose(is_across_crease(own, other, at), other, own)
    for k in range(16):
        facet = facet_at(surface_map, _below(at) + _of_16(k), source)
        shares = shares_layer(facet, layer)
        weight = np.where(shares, gaussian(at - facet.pixel, VALUE_REACH), F(0))
        face_weight = np.where(_cosine(facet, seen) > CREASE, weight, F(0))
        both, both_total = add_facet(both, weight, facet, at), both_total + weight
        face, face_total = add_facet(face, face_weight, facet, at), face_total + face_weight
        sizes += shares & np.array([_cosine(facet, one) > SAME_FACE for one in (own, other)])
    crease = (_cosine(own, other) < CREASE) & (sizes.min(0) > LEAST_FACE)
    return np.where(crease[..., None], _mean(face, face_total), _mean(both, both_total))


def closest_of(around: Sequence[Facet], layer: Facet, at: np.ndarray) -> Facet:
    closest = layer
    for facet in around:
        is_closer = _distance(facet, at) < _distance(closest, at)
        closest = _choose(is_closer & shares_layer(facet, layer), facet, closest)
    return closest


def closest_turned(around: Sequence[Facet], layer: Facet, own: Facet, at: np.ndarray) -> Facet:
    closest, least = own, np.full(len(at), F(1e30))
    for facet in around:
        is_turned = (_cosine(facet, own) < CREASE) & shares_layer(facet, layer)
        closer = is_turned & (_distance(facet, at) < least)
        closest, least = _choose(closer, facet, closest), np.where(closer, _distance(facet, at), least)
    return closest


def vote_surface(
    surface_map: np.ndarray, guide_map: np.ndarray, at: np.ndarray, color: np.ndarray, source: np.ndarray
) -> np.ndarray:
    around = [facet_at(surface_map, _below(at) + _corner(k), source) for k in range(4)]
    winner = win_vote(surface_map, guide_map, around, at, color, source)
    own = closest_of(around, winner, at)
    surface = mix_layer(surface_map, winner, own, closest_turned(around, winner, own, at), at, source)
    return np.where(winner.surface[..., 3:] > 0, surface, F(0))


def _below(at: np.ndarray) -> np.ndarray:
    """The upper left of the four pixels around a position."""
    return np.floor(at).astype(int)


def _corner(k: int) -> np.ndarray:
    return np.array([k % 2, k // 2])


def _of_16(k: int) -> np.ndarray:
    return np.array([k % 4 - 1, k // 4 - 1])


def _last(picture: np.ndarray) -> np.ndarray:
    return np.array(picture.shape[1::-1]) - 1


def _nearest(picture: np.ndarray, pixel: np.ndarray) -> np.ndarray:
    """The pixel to read: the outermost ones repeat, as where a sampler is read."""
    return np.clip(pixel, 0, _last(picture))


def _cosine(a: Facet, b: Facet) -> np.ndarray:
    return dot(a.surface[..., :3], b.surface[..., :3])[..., 0]


def _distance(facet: Facet, at: np.ndarray) -> np.ndarray:
    return length(facet.pixel - at)[..., 0]


def _choose(condition: np.ndarray, yes: Facet, no: Facet) -> Facet:
    return Facet(*(np.where(condition[..., None], a, b) for a, b in zip(yes, no, strict=True)))


def _mean(sum: np.ndarray, total: np.ndarray) -> np.ndarray:
    """Unit normal and depth of weighted sums of normals and of 1/z; 0 without any."""
    some = (total > 0)[..., None] & sum[..., :3].any(-1, keepdims=True)
    normal = normalize(np.where(some, sum[..., :3], F(1)))
    return np.where(some, np.concatenate([normal, total[..., None] / np.where(some, sum[..., 3:], F(1))], -1), F(0))
