"""Estimates the light in a photograph, one direction and ambient light, from its colours and normals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .light_pairs import Array, Pairs, find_pairs

FEWEST = 150.0  # pairs, by their weights
TEXTURE = 0.12  # difference of log brightness that is due to texture
STRENGTHS = 0.3, 1.0, 4.0, 12.0  # of the direction's light over ambient light, at which the search begins
TURNS = 80  # directions at which it begins
FEW = 1200  # pairs that decide where it goes on
STARTS = 3
STEPS = 20  # of the fit
# Measured on 770 ray-traced scenes, 304 of them under ambient light: of those none was taken for lit from a side.
UNEXPLAINED = 0.9  # of the misfit without a direction: at most so much may be left
EVIDENCE = 0.6  # share of that misfit that is explained, times the number of tiles that it is explained in
SEEN = 0.13  # least difference of log brightness by which the direction shows in pairs of exactly one hue
SURE = 5.0, 12.0  # standard errors that the change of the light over the picture is worth; and times the evidence
MISSED = 0.3  # of that difference: what other functions of the normals may say beside the light
COARSE = 0.3  # difference of log brightness that smooth texture makes
FLAT = 1.1  # ratio of most to least light that is not worth a change


@dataclass(frozen=True)
class FoundLight:
    """The light in a picture: a surface with normal n receives ambient + max(n . direction, 0), up to a factor.

    direction  (3,) unit, towards the light, camera axes
    ambient    strength of the ambient light over that of the directional light
    white      the light that leaves colours as they are: only a twentieth of the picture has more
    tells      whether the picture shows its light well enough to divide it out
    why        the reason if it does not
    """

    direction: tuple[float, float, float] = (0.0, 0.0, -1.0)
    ambient: float = 1e3
    white: float = 1e3
    tells: bool = False
    why: str = ""

    @property
    def values(self) -> tuple[float, float, float, float]:
        """Direction and ambient light, as the shaders take them."""
        return *self.direction, self.ambient


class Fit(NamedTuple):
    """A fitted light g, (3,): a normal n receives 1 + max(n . g, 0); the misfit; and the covariance of g, (3, 3)."""

    light: Array
    cost: float
    covariance: NDArray[np.float64]


def fit_light(colors: Array, surfaces: Array, seed: int = 0) -> FoundLight:
    """Estimate the light in a picture.

    colors    (h, w, 4) linear RGB and 1, or 0 where unknown or clipped
    surfaces  (h, w, 4) unit normals, camera axes, towards the camera, and depth; 0 where unknown
    """
    pairs = find_pairs(colors, surfaces, seed)
    if pairs.weight.sum() < FEWEST:
        return FoundLight(why="it shows too little of rounded surfaces")
    fits = [_refined(start, pairs) for start in _starts(pairs)]
    best = min(fits, key=lambda fit: fit.cost)
    normals = surfaces[..., :3][surfaces[..., :3].any(-1)]
    return _judged(best, pairs, normals)


def _judged(fit: Fit, pairs: Pairs, normals: Array) -> FoundLight:
    """Convert a fit to a light, and judge whether it can be trusted for these normals, (n, 3)."""
    strength = max(float(np.linalg.norm(fit.light)), 1e-3)
    x, y, z = (fit.light / strength).tolist()
    low, white, high = np.percentile(1 + np.maximum(normals @ fit.light, 0), (0.5, 95, 99.5))
    evidence = _evidence(fit, pairs)
    seen = _seen(fit, pairs)
    if high < FLAT * low or seen * pairs.weight.mean() < SEEN:
        why = "nearly all of its light is ambient"
    elif evidence < EVIDENCE:
        why = "its brightness does not follow the normals"
    elif _missed(fit, pairs) > MISSED * seen:
        why = "its texture follows the normals, or there are several lights"
    elif _sureness(fit, normals) < max(SURE[0], SURE[1] / evidence):
        why = "its parts do not agree"
    else:
        why = ""
    return FoundLight((x, y, z), 1 / strength, float(white) / strength, not why, why)


def _seen(fit: Fit, pairs: Pairs) -> float:
    """Return the difference of log brightness that the directional light makes in the pairs, root mean square.

    Where colours change smoothly, brightness does as well, and the pairs hardly ever have exactly one hue.
    """
    one, two = (np.log1p(np.maximum(normals @ fit.light, 0)) for normals in (pairs.one, pairs.two))
    return float(np.sqrt(np.average((one - two) ** 2, weights=pairs.weight)))


def _evidence(fit: Fit, pairs: Pairs) -> float:
    """Return the share of the misfit that the light explains, if enough, else 0, times the number of its tiles."""
    misses = [_miss(light, pairs)[0] for light in (0 * fit.light, fit.light)]
    before, after = (np.bincount(pairs.tile, pairs.weight * _robust(miss)) for miss in misses)
    gains = before - after
    share = gains.sum() / max(before.sum(), 1e-9)
    tiles = gains.sum() ** 2 / max(np.square(gains).sum(), 1e-9)
    return float(share * tiles) if share > 1 - UNEXPLAINED else 0.0


def _sureness(fit: Fit, normals: Array) -> float:
    """Return by how many standard errors the light changes over the picture."""
    along = normals @ fit.light
    shading = 1 + np.maximum(along, 0)
    slopes = normals * ((along > 0) / shading)[:, None]
    slopes -= slopes.mean(0)
    error = np.einsum("ni,ij,nj->n", slopes, fit.covariance, slopes).mean()
    return float(np.sqrt(np.log(shading).var() / max(error, 1e-12)))


def _missed(fit: Fit, pairs: Pairs) -> float:
    """Return what normals explain of the brightness beyond the light, in units of `_seen`, as smooth texture
    or other lights do: by spherical harmonics of first and second order (Ramamoorthi, Hanrahan 2001)."""
    miss = _miss(fit.light, pairs)[0]
    slopes = _harmonics(pairs.one) - _harmonics(pairs.two)
    pull = pairs.weight / (1 + (miss / COARSE) ** 2)
    curve = (slopes * pull[:, None]).T @ slopes + 1e-3 * pull.sum() * np.eye(slopes.shape[1])
    found = slopes @ np.linalg.solve(curve, slopes.T @ (pull * miss))
    return float(np.sqrt(np.average(found**2, weights=pairs.weight)))


def _harmonics(normals: Array) -> Array:
    x, y, z = normals.T
    return np.stack([x, y, z, x * y, y * z, z * x, x * x - y * y, 3 * z * z - 1], -1)


def _miss(light: Array, pairs: Pairs) -> tuple[Array, Array, Array]:
    """Return the log brightness differences that the light leaves unexplained, and n . light of both pixels."""
    one, two = pairs.one @ light, pairs.two @ light
    return pairs.brighter - np.log1p(np.maximum(one, 0)) + np.log1p(np.maximum(two, 0)), one, two


def _robust(miss: Array) -> Array:
    """Return the robust cost of each difference: 0 to 1, however large it is (Geman, McClure 1985)."""
    square = miss * miss
    return square / (square + TEXTURE**2)


def _starts(pairs: Pairs) -> list[Array]:
    """Return the best lights of a grid on all sides, judged by a few of the pairs, as starts for the fit."""
    few = slice(FEW)
    k = np.arange(TURNS) + 0.5
    z, turn = 1 - 2 * k / TURNS, k * np.pi * (1 + 5**0.5)
    ring = np.sqrt(1 - z * z)
    directions = np.stack([ring * np.cos(turn), ring * np.sin(turn), z]).astype(np.float32)
    one, two = (np.maximum(normals[few] @ directions, 0) for normals in (pairs.one, pairs.two))
    costs = []
    for strength in STRENGTHS:
        miss = pairs.brighter[few, None] - np.log((1 + strength * one) / (1 + strength * two))
        costs.append(pairs.weight[few] @ _robust(miss))
    best = np.argsort(np.concatenate(costs))[:STARTS]
    return [STRENGTHS[b // TURNS] * directions[:, b % TURNS] for b in best]


def _refined(light: Array, pairs: Pairs) -> Fit:
    """Refine a light by Levenberg-Marquardt steps on the robust misfit; the covariance is a jackknife over tiles."""
    damping, (miss, one, two) = 1e-2, _miss(light, pairs)
    cost = float(pairs.weight @ _robust(miss))
    for _ in range(STEPS):
        slopes, pull = _slopes(miss, one, two, pairs)
        curve = (slopes * pull[:, None]).T @ slopes
        step = np.linalg.solve(curve + damping * np.diag(np.diag(curve) + 1e-6), slopes.T @ (pull * miss))
        new = (light + step).astype(np.float32)
        found = _miss(new, pairs)
        new_cost = float(pairs.weight @ _robust(found[0]))
        if new_cost >= cost:
            damping *= 8
            if damping > 1e3:
                break
            continue
        is_done = cost - new_cost < 1e-5 * cost
        light, cost, damping, (miss, one, two) = new, new_cost, 0.3 * damping, found
        if is_done:
            break
    return Fit(light, cost, _covariance(pairs, miss, *_slopes(miss, one, two, pairs)))


def _covariance(pairs: Pairs, miss: Array, slopes: Array, pull: Array) -> NDArray[np.float64]:
    """Return the covariance of the light by a jackknife: how far it moves, in one step, when each tile is left out."""
    tiles = np.unique(pairs.tile)
    forces, curves = np.zeros((len(tiles), 3)), np.zeros((len(tiles), 3, 3))
    for k, tile in enumerate(tiles):
        own = pairs.tile == tile
        forces[k] = slopes[own].T @ (pull * miss)[own]
        curves[k] = (slopes[own] * pull[own, None]).T @ slopes[own]
    moves = np.linalg.solve(curves.sum(0) - curves + 1e-6 * np.eye(3), forces[..., None])[..., 0]
    return moves.T @ moves


def _slopes(miss: Array, one: Array, two: Array, pairs: Pairs) -> tuple[Array, Array]:
    """Return (n, 3) the derivatives of the differences with respect to the light, and (n,) their weights."""
    slopes = pairs.one * ((one > 0) / (1 + np.maximum(one, 0)))[:, None]
    slopes -= pairs.two * ((two > 0) / (1 + np.maximum(two, 0)))[:, None]
    return slopes, pairs.weight * (TEXTURE**2 / (miss * miss + TEXTURE**2)) ** 2


def describe_light(light: FoundLight) -> str:
    """Describe the light that was found in one line."""
    if not light.tells:
        return f"unlight: the picture does not tell its light, {light.why}: its colours stay as they are"
    x, y, z = light.direction
    sides = [
        name
        for name, much in (("left", -x), ("right", x), ("above", -y), ("below", y), ("the camera", -z), ("behind", z))
        if much > 0.35
    ]
    share = 100 * light.ambient / (1 + light.ambient)
    return f"unlight: its light comes from {' and '.join(sides)}, {share:.0f} % of it is ambient"
