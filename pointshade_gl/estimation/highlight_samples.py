"""Samples a colour image for the highlight search: pairs of pixels on the same smooth piece of surface."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]
Indices = NDArray[np.int64]
NEIGHBOURS = (1, 0), (0, 1), (3, 0), (0, 3), (6, 2), (2, -6), (10, 6), (6, -10)  # samples between those of a pair
QUIET = 0.015  # difference of linear light between samples of a surface without texture
THIRDS = np.full(3, 1 / 3, np.float32)  # a mean over channels, much faster than mean()
LEAST = 0.02  # difference that a highlight of strength 1 makes in a pair that says something
SAME_SURFACE = 0.02  # of the depth, off the neighbour's tangent plane
BEND = 0.9  # cosine between neighbours of one surface


class Guess(NamedTuple):
    """A candidate light: unit direction from the scene's middle, scene's depth over its distance, Phong exponent."""

    direction: Array
    nearness: float
    exponent: float


class Lit(NamedTuple):
    """Samples under a light, (m,) each: diffuse plus ambient light, and log of r . l (mirrored ray, light)."""

    shading: Array
    glint: Array


class Pairs(NamedTuple):
    """Pairs of samples, one of which the highlight brightens more than the other.

    one     (n,) the first sample
    ratio   (n, 3) difference of their albedo over the difference of the highlight: the strength that would explain it
    weight  (n,) difference of the highlight, linear light
    """

    one: Indices
    ratio: Array
    weight: Array

    def only(self, chosen: NDArray[np.bool_]) -> Pairs:
        return Pairs(self.one[chosen], self.ratio[chosen], self.weight[chosen])


class Evidence(NamedTuple):
    """What pairs show about a highlight: the strength that explains most, how much it explains, and how surely."""

    strength: float
    gain: float
    sureness: float

    @property
    def value(self) -> float:
        return self.gain * self.sureness * (1 if self.strength > 0 else -1)


class Samples:
    """The known samples of a small copy of a frame.

    n, r, color, points  (m, 3) float32: unit normals, mirrored directions to the eye, linear light, positions
    n_p, r_p, far        (m,) the dot products of normals, mirrored directions and points with the points
    piece                (h, w) number of the smooth piece of surface, -1 where there is none
    partners             (m, 16) other samples of the same piece, -1 where there is none
    """

    def __init__(self, colors: Array, surfaces: Array, rays: Array):
        self.piece = smooth_pieces(surfaces, rays)
        surfaces = smoothed(surfaces, self.piece)
        known = (colors[..., 3] > 0) & (self.piece >= 0)
        self.shape = known.shape
        self.at = np.random.default_rng(0).permutation(np.flatnonzero(known))  # so that the first few stand for all
        surface, ray = surfaces.reshape(-1, 4)[self.at], rays.reshape(-1, 3)[self.at]
        self.n, self.points = surface[:, :3], ray * surface[:, 3:]
        self.color = colors.reshape(-1, 4)[self.at, :3]
        eye = -ray / np.linalg.norm(ray, axis=-1, keepdims=True)
        self.r = 2 * (self.n * eye).sum(-1, keepdims=True) * self.n - eye
        self.n_p, self.r_p, self.far = ((a * self.points).sum(-1) for a in (self.n, self.r, self.points))
        self.middle = np.median(self.points, 0) if len(self.at) else np.zeros(3, np.float32)
        self.partners = self._partners(known)
        self.calm = self._calm()

    def _partners(self, known: NDArray[np.bool_]) -> Indices:
        height, width = self.shape
        number = np.full(known.size, -1)
        number[self.at] = np.arange(len(self.at))
        v, u = np.divmod(self.at, width)
        found = []
        for du, dv in [*NEIGHBOURS, *((-du, -dv) for du, dv in NEIGHBOURS)]:
            inside = (v + dv >= 0) & (v + dv < height) & (u + du >= 0) & (u + du < width)
            other = np.where(inside, self.at + dv * width + du, self.at)
            same = inside & (self.piece.ravel()[other] == self.piece.ravel()[self.at])
            found.append(np.where(same, number[other], -1))
        return np.stack(found, -1)

    def _calm(self) -> Array:
        """Return (m, 16) weights of the pairs with each partner: near 1 on pieces with little texture, 0 with much."""
        known = self.partners >= 0
        grey = self.color @ THIRDS
        change = abs(grey[:, None] - grey[self.partners])
        piece = self.piece.ravel()[self.at]
        calm = np.zeros(change.shape, np.float32)
        for number in np.unique(piece):
            own = piece == number
            for k in range(len(NEIGHBOURS)):
                found = change[own, k][known[own, k]]
                if len(found):
                    calm[own, k] = calm[own, k + len(NEIGHBOURS)] = QUIET / (np.median(found) + QUIET)
        return calm

    def pairs(self, ones: Indices, others: int, every: int = 1) -> tuple[Indices, Indices, Array]:
        """Return the two samples and the calm of pairs of `ones` with the first of their partners, some or all."""
        one, other = np.repeat(ones, others), self.partners[ones, :others].ravel()
        kept = np.flatnonzero(other >= 0)[::every]
        return one[kept], other[kept], self.calm[ones, :others].ravel()[kept]

    def toward(self, guess: Guess) -> Array:
        """Return a candidate's light as (4,) l and q, see FoundHighlights."""
        q = np.float32(guess.nearness / max(float(self.middle[2]), 1e-6))
        return np.append(guess.direction + q * self.middle, q).astype(np.float32)


def smooth_pieces(surfaces: Array, rays: Array) -> Indices:
    """Label the smooth pieces of surface: (h, w) the number of each sample's piece, -1 where there is no surface."""
    height, width = surfaces.shape[:2]
    points, normals, depth = rays * surfaces[..., 3:], surfaces[..., :3], surfaces[..., 3]
    number = np.arange(height * width).reshape(height, width)
    ones, others = [], []
    for one, other in (((slice(None), slice(-1)), (slice(None), slice(1, None))), ((slice(-1),), (slice(1, None),))):
        step = points[other] - points[one]
        off = np.maximum(abs((step * normals[one]).sum(-1)), abs((step * normals[other]).sum(-1)))
        nearer = np.minimum(depth[one], depth[other])
        joined = ((normals[one] * normals[other]).sum(-1) > BEND) & (off < SAME_SURFACE * nearer)
        ones.append(number[one][joined])
        others.append(number[other][joined])
    a, b, label = np.concatenate(ones), np.concatenate(others), number.ravel()
    while (label[a] != label[b]).any():
        least = np.minimum(label[a], label[b])
        label = label.copy()
        np.minimum.at(label, label[a], least)
        np.minimum.at(label, label[b], least)
        label = label[label]
    return np.where(depth > 0, label.reshape(height, width), -1)


def smoothed(surfaces: Array, piece: Indices) -> Array:
    """Average each normal with those of its eight neighbours on the same piece, nearer ones counting more."""
    result = surfaces.copy()
    for axis in (0, 1):
        total = 2 * result[..., :3]
        for k in (-1, 1):
            total += np.roll(result[..., :3], k, axis) * (np.roll(piece, k, axis) == piece)[..., None]
        result[..., :3] = total / np.maximum(np.linalg.norm(total, axis=-1, keepdims=True), 1e-9)
    return result


def lit(s: Samples, guess: Guess, ambient: float) -> Lit:
    l_q = s.toward(guess)
    to, q = l_q[:3], l_q[3]
    shorter = 1 / np.sqrt(np.maximum(to @ to - 2 * q * (s.points @ to) + q * q * s.far, 1e-12))  # length of l - q p
    facing = (s.n @ to - q * s.n_p) * shorter
    glint = np.maximum((s.r @ to - q * s.r_p) * shorter, 1e-6)
    glint[facing <= 0] = 1e-6
    return Lit(ambient + np.maximum(facing, 0), np.log(glint))


def pairs_of(s: Samples, light: Lit, exponent: float, most: int) -> tuple[Pairs, float]:
    """Return about `most` pairs near the highlights, and the factor by which there are more of them."""
    near = np.flatnonzero(light.glint > np.log(0.03) / exponent)
    few = near[: most // s.partners.shape[1]]
    a, b, calm = s.pairs(few, s.partners.shape[1])
    one, other = light.shading[a], light.shading[b]
    change = np.exp(exponent * light.glint[a]) / one - np.exp(exponent * light.glint[b]) / other
    weight = abs(change) * np.minimum(one, other)
    says = np.flatnonzero(weight > LEAST)
    a, b = a[says], b[says]
    albedo = s.color[a] / one[says, None] - s.color[b] / other[says, None]
    ratio, weight = (albedo / change[says, None]).astype(np.float32), (weight[says] * calm[says]).astype(np.float32)
    return Pairs(a, ratio, weight), len(near) / max(len(few), 1)


def weigh(pairs: Pairs, factor: float = 1.0) -> Evidence:
    """Return the strength that leaves the smallest differences in the pairs, each of which stands for `factor`."""
    if len(pairs.weight) < 30:
        return Evidence(0.0, 0.0, 0.0)
    strength = weighted_median(pairs.ratio.ravel(), np.repeat(pairs.weight, 3))
    gains = pairs.weight * ((abs(pairs.ratio) - abs(pairs.ratio - strength)) @ THIRDS)
    gain = float(gains.sum())
    return Evidence(strength, gain * factor, gain / max(float(np.sqrt((gains * gains).sum())), 1e-12))


def weighted_median(values: Array, weights: Array) -> float:
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(total, total[-1] / 2)]])
