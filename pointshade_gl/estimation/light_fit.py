"""Estimates the light in a photograph from its colours and normals, and keeps one for a stream."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scene.values import linear_to_srgb

Array = NDArray[np.floating]
Index = NDArray[np.int64]
LUMINANCE = np.array((0.2126, 0.7152, 0.0722), np.float32)
PAIRS = 6000
TRIES = 12  # candidates for each pair
ALIKE = 0.97  # cosine between normals that light hardly distinguishes
STEPS_BETWEEN = 6  # places between two pixels that are looked at
BEND, MOST_BEND = 12.0, 32.0  # degrees by which a surface turns in a pixel, and from place to place: creases turn more
JUMP = 0.08  # share of the depth by which these places differ, of one surface
DARK = 0.004  # linear light that is mostly noise


class LightPairs(NamedTuple):
    """n pairs of pixels: unit normals of both (n, 3); log ratio of their brightness and weight, (n,) each."""

    one: Array
    two: Array
    brighter: Array
    weight: Array


class Reach(NamedTuple):
    """Which pixels may be a pair."""

    # standard deviations of the way between them, from and to, shares of the picture's longer side
    way: tuple[float, float]
    hue: float  # difference of chromaticity between two materials
    connected: bool  # whether they lie on one surface, all the way


# The straight line between the pixels of a pair stays on one surface: no texture follows the normals of a rounded
# surface all around, but differently painted walls look the same as lit ones.
CONNECTED = Reach((0.025, 0.15), 0.03, True)
WIDE = Reach((0.025, 0.3), 0.015, False)


def find_pairs(colors: Array, surfaces: Array, reach: Reach, seed: int = 0) -> LightPairs:
    """Choose the pairs of pixels for `light_fit`, from the same arrays."""
    chance = np.random.default_rng(seed)
    height, width = colors.shape[:2]
    flat_surfaces, flat_colors = surfaces.reshape(-1, 4), colors.reshape(-1, 4)
    brightness = flat_colors[:, :3] @ LUMINANCE
    known = (flat_colors[:, 3] > 0) & (brightness > DARK)
    places = np.flatnonzero(known)
    if not len(places):
        return LightPairs(*np.zeros((2, 0, 3), np.float32), *np.zeros((2, 0), np.float32))
    first = places[chance.integers(0, len(places), TRIES * PAIRS)]
    far = np.exp(chance.uniform(np.log(reach.way[0]), np.log(reach.way[1]), len(first))) * max(width, height)
    way = np.rint(chance.normal(size=(2, len(first))) * far).astype(int)
    v, u = first // width, first % width
    inside = (v + way[0] >= 0) & (v + way[0] < height) & (u + way[1] >= 0) & (u + way[1] < width)
    first, second = first[inside], (first + way[0] * width + way[1])[inside]
    chosen = known[second]
    chosen &= (flat_surfaces[first, :3] * flat_surfaces[second, :3]).sum(-1) < ALIKE
    first, second = first[chosen], second[chosen]
    hue = flat_colors[:, :3] / np.maximum(flat_colors[:, :3].sum(-1, keepdims=True), 1e-6)
    weight = np.exp(-np.square(hue[first] - hue[second]).sum(-1) / reach.hue**2)
    chosen = np.flatnonzero(weight > 0.1)
    if reach.connected:
        chosen = chosen[_is_one_surface(flat_surfaces, first[chosen], second[chosen], width)]
    chosen = chosen[:PAIRS]
    first, second = first[chosen], second[chosen]
    brighter = np.log(brightness[first] / brightness[second])
    return LightPairs(flat_surfaces[first, :3], flat_surfaces[second, :3], brighter, weight[chosen])


def _is_one_surface(surfaces: Array, first: Index, second: Index, width: int) -> NDArray[np.bool_]:
    """Return whether neither normal nor depth jumps on the straight line between two pixels."""
    v, u = first // width, first % width
    down, right = second // width - v, second % width - u
    before, same = surfaces[first], np.ones(len(first), bool)
    bend = np.cos(np.radians(np.minimum(BEND * np.maximum(np.hypot(down, right) / STEPS_BETWEEN, 1), MOST_BEND)))
    for k in range(1, STEPS_BETWEEN + 1):
        row, column = (np.rint(at + way * (k / STEPS_BETWEEN)).astype(int) for at, way in ((v, down), (u, right)))
        here = surfaces[row * width + column]
        same &= (before[:, :3] * here[:, :3]).sum(-1) > bend
        same &= np.abs(here[:, 3] - before[:, 3]) < JUMP * before[:, 3]
        before = here
    return same


FEWEST = 150.0  # pairs, by their weights
TEXTURE = 0.12  # difference of log brightness that is due to texture
NOISE = 0.1  # the same, of pairs that may lie far apart
STRENGTHS = 0.3, 1.0, 4.0, 12.0  # of the direction's light over ambient light, at which the search begins
TURNS = 80  # directions at which it begins
FEW = 1200  # pairs that decide where it goes on
STARTS = 3
FIT_STEPS = 20  # of the fit
FLAT = 1.1  # ratio of most to least light that is not worth a change
COARSE = 0.3  # difference of log brightness that smooth texture makes
LEAST_AMBIENT = 0.1  # over direct light, where two fits are compared
# From no trust to all of it; measured on 480 generated scenes and photographs, 210 of them under ambient light.
SEEN = 0.07, 0.12  # difference of log brightness that the judge's light makes in pairs of exactly one hue
MADE = 0.1, 0.15  # difference that the light makes in these pairs
AGREED = 0.6, 0.85  # correlation of the shading by the two
MISSED = 0.25, 0.4  # what other functions of the normals show beside the judge's light, over `MADE`: from all to none
_AMBIENT = "nearly all of its light is ambient"


@dataclass(frozen=True)
class FoundLight:
    """The light in a picture: a surface with normal n receives ambient + max(n . direction, 0), up to a factor."""

    direction: tuple[float, float, float] = (0.0, 0.0, -1.0)  # (3,) unit, towards the light, camera axes
    ambient: float = 1e3  # strength of the ambient light over that of the directional light
    strength: float = 0.0  # 0..1: how far the picture shows that this is its light, and how far it is divided out
    why: str = ""  # what speaks against it, if the strength is not 1

    @property
    def is_shown(self) -> bool:
        """Whether the picture shows its light at all."""
        return self.strength > 0

    @property
    def is_sure(self) -> bool:
        """Whether nothing speaks against it."""
        return self.strength == 1


class Loss(NamedTuple):
    """A robust cost of differences, and by how much each of them pulls the fit."""

    cost: Callable[[Array], Array]
    pull: Callable[[Array], Array]


# 0 to 1, however large a difference is (Geman, McClure 1985)
BOUNDED = Loss(lambda miss: miss**2 / (miss**2 + TEXTURE**2), lambda miss: (TEXTURE**2 / (miss**2 + TEXTURE**2)) ** 2)
# the difference itself, but smooth at 0 (Charbonnier et al. 1994)
ABSOLUTE = Loss(lambda miss: np.sqrt(1 + (miss / NOISE) ** 2) - 1, lambda miss: 1 / np.sqrt(1 + (miss / NOISE) ** 2))


def fit_light(colors: Array, surfaces: Array, seed: int = 0) -> FoundLight:
    """Estimate the light in a picture.

    Pairs of pixels on one surface judge whether there is such a light; those from all over the picture show it.

    colors    (h, w, 4) linear RGB and 1, or 0 where unknown or clipped
    surfaces  (h, w, 4) unit normals, camera axes, towards the camera, and depth; 0 where unknown
    """
    near, wide = (find_pairs(colors, surfaces, reach, seed) for reach in (CONNECTED, WIDE))
    if min(near.weight.sum(), wide.weight.sum()) < FEWEST:
        return FoundLight(why="it shows too little of rounded surfaces")
    normals = surfaces[..., :3][surfaces[..., :3].any(-1)]
    judge, light = _fit(near, BOUNDED), _fit(wide, ABSOLUTE)
    size = max(float(np.linalg.norm(light)), 1e-3)
    x, y, z = (light / size).tolist()
    return FoundLight((x, y, z), 1 / size, *_judged(judge, light, near, normals))


def _judged(judge: Array, light: Array, pairs: LightPairs, normals: Array) -> tuple[float, str]:
    """Return how far a light can be trusted, 0..1, and what speaks against it most. judge: the best for these pairs."""
    low, high = np.percentile(1 + np.maximum(normals @ judge, 0), (0.5, 99.5))
    if high < FLAT * low:
        return 0.0, _AMBIENT
    made = _made(light, pairs)
    # Where colours change smoothly, brightness does as well, and the pairs hardly ever have exactly one hue.
    seen = _made(judge, pairs) * float(pairs.weight.mean())
    missed = _missed(judge, pairs) / made
    doubts = {
        _AMBIENT: _ramp(seen, *SEEN) * _ramp(made, *MADE),
        "its surfaces do not agree on the light": _ramp(_agreement(judge, light, normals), *AGREED),
        "its texture follows the normals, or there are several lights": 1 - _ramp(missed, *MISSED),
    }
    strength = float(np.prod(list(doubts.values())))
    return strength, min(doubts, key=doubts.__getitem__) if strength < 1 else ""


def _ramp(value: float, low: float, high: float) -> float:
    return float(np.clip((value - low) / (high - low), 0, 1))


def _agreement(one: Array, other: Array, normals: Array) -> float:
    """Return the correlation of the log shading by two lights over a picture."""
    logs = []
    for light in (one, other):
        size = max(float(np.linalg.norm(light)), 1e-3)
        logs.append(np.log(max(1 / size, LEAST_AMBIENT) + np.maximum(normals @ light / size, 0)))
    first, second = (log - log.mean() for log in logs)
    return float((first * second).sum() / max(np.sqrt((first**2).sum() * (second**2).sum()), 1e-9))


def _made(light: Array, pairs: LightPairs) -> float:
    """Return the difference of log brightness that a light makes in the pairs, root mean square."""
    one, two = (np.log1p(np.maximum(normals @ light, 0)) for normals in (pairs.one, pairs.two))
    return max(float(np.sqrt(np.average((one - two) ** 2, weights=pairs.weight))), 1e-6)


def _missed(light: Array, pairs: LightPairs) -> float:
    """Return the difference of log brightness that normals explain beyond the light, as texture or other lights do."""
    miss = _miss(light, pairs)[0]
    slopes = _harmonics(pairs.one) - _harmonics(pairs.two)
    pull = pairs.weight / (1 + (miss / COARSE) ** 2)
    curve = (slopes * pull[:, None]).T @ slopes + 1e-3 * pull.sum() * np.eye(slopes.shape[1])
    found = slopes @ np.linalg.solve(curve, slopes.T @ (pull * miss))
    return float(np.sqrt(np.average(found**2, weights=pairs.weight)))


def _harmonics(normals: Array) -> Array:
    """Return the spherical harmonics of first and second order (Ramamoorthi, Hanrahan 2001)."""
    x, y, z = normals.T
    return np.stack([x, y, z, x * y, y * z, z * x, x * x - y * y, 3 * z * z - 1], -1)


def _miss(light: Array, pairs: LightPairs) -> tuple[Array, Array, Array]:
    """Return the log brightness differences that the light leaves unexplained, and n . light of both pixels."""
    one, two = pairs.one @ light, pairs.two @ light
    return pairs.brighter - np.log1p(np.maximum(one, 0)) + np.log1p(np.maximum(two, 0)), one, two


def _fit(pairs: LightPairs, loss: Loss) -> Array:
    """Return the light g, (3,), that fits best: a normal n receives 1 + max(n . g, 0)."""
    fits = [_refined(start, pairs, loss) for start in _starts(pairs, loss)]
    return min(fits, key=lambda fit: fit[1])[0]


def _starts(pairs: LightPairs, loss: Loss) -> list[Array]:
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
        costs.append(pairs.weight[few] @ loss.cost(miss))
    best = np.argsort(np.concatenate(costs))[:STARTS]
    return [STRENGTHS[b // TURNS] * directions[:, b % TURNS] for b in best]


def _refined(light: Array, pairs: LightPairs, loss: Loss) -> tuple[Array, float]:
    """Refine a light by Levenberg-Marquardt steps on the robust misfit, and return it with that misfit."""
    damping, (miss, one, two) = 1e-2, _miss(light, pairs)
    cost = float(pairs.weight @ loss.cost(miss))
    for _ in range(FIT_STEPS):
        lit, other = ((part > 0) / (1 + np.maximum(part, 0)) for part in (one, two))
        slopes = pairs.one * lit[:, None] - pairs.two * other[:, None]  # of the differences, by the light
        pull = pairs.weight * loss.pull(miss)
        curve = (slopes * pull[:, None]).T @ slopes
        step = np.linalg.solve(curve + damping * np.diag(np.diag(curve) + 1e-6), slopes.T @ (pull * miss))
        new = (light + step).astype(np.float32)
        found = _miss(new, pairs)
        new_cost = float(pairs.weight @ loss.cost(found[0]))
        if new_cost >= cost:
            damping *= 8
            if damping > 1e3:
                break
            continue
        is_done = cost - new_cost < 1e-5 * cost
        light, cost, damping, (miss, one, two) = new, new_cost, 0.3 * damping, found
        if is_done:
            break
    return light, cost


def describe_light(light: FoundLight) -> str:
    """Describe the light that was found in one line."""
    if not light.is_shown:
        return f"unlight: the picture does not tell its light, {light.why}: its colours stay as they are"
    x, y, z = light.direction
    ways = {"left": -x, "right": x, "above": -y, "below": y, "the camera": -z, "behind": z}
    sides = [name for name, share in ways.items() if share > 0.35]
    share = 100 * light.ambient / (1 + light.ambient)
    text = f"unlight: its light comes from {' and '.join(sides)}, {share:.0f} % of it is ambient"
    return f"{text}; divided out by {100 * light.strength:.0f} %: {light.why}" if light.why else text


MARGIN = 0.5  # samples below the horizon: so far is lit for certain; as far again is not
MOST_TURNS = 4  # times the picture's sides: cells of the picture around the light


def visible_light(surfaces: Array, rays: Array, towards: tuple[float, float, float]) -> Array:
    """Return (h, w), 0..1, whether light from a direction reaches each sample past the others.

    In the angles around the direction of the light, its beams are straight rows, on which the distance from the axis
    through the eye stays the same. A sample lies in shadow where one nearer to the light is nearer to that axis.

    surfaces  (h, w, 4) normals and depth; 0 where unknown
    rays      (h, w, 3) from the camera through the samples, z = 1
    """
    height, width = surfaces.shape[:2]
    pixel = float(np.hypot(*(rays[-1, -1] - rays[0, 0])[:2]) / max(np.hypot(height - 1, width - 1), 1))
    if not pixel:
        return np.ones((height, width), np.float32)
    lengths = np.sqrt(np.square(rays) @ np.ones(3, np.float32))
    away = surfaces[..., 3] * lengths
    axes = _axes(np.array(towards), (rays[0, 0] + rays[-1, -1]) / 2).astype(np.float32)
    first, second, third = np.moveaxis(rays @ axes.T, -1, 0)
    cosine = np.clip(first / lengths, -1, 1)
    slant, sine = np.arccos(cosine), np.sqrt(1 - cosine**2)
    turn = np.arctan2(third, second)
    slants = _steps(slant, pixel, MOST_TURNS * (height + width))
    turns = _steps(turn, pixel / max(float(sine.max()), 1e-3), MOST_TURNS * (height + width))
    horizon = _horizon(away, rays, axes, slants, turns)
    column, row = (np.rint((at - steps[0]) / (steps[1] - steps[0])) for at, steps in ((slant, slants), (turn, turns)))
    nearest = horizon.take((row * horizon.shape[1] + column).astype(int))
    with np.errstate(invalid="ignore", divide="ignore"):
        below = (away - nearest / sine) / (away * pixel)
    below = np.clip(np.nan_to_num(below, nan=-1.0) / (2 * MARGIN) + 0.5, 0, 1)
    return np.where(surfaces[..., 3] > 0, 1 - below, np.float32(1))


def _axes(towards: NDArray[np.float64], view: Array) -> NDArray[np.float64]:
    """Return (3, 3): the direction of the light, the part of the view across it, and what is left."""
    first = towards / np.linalg.norm(towards)
    across = view - first * (first @ view)
    if np.linalg.norm(across) < 1e-6:
        across = np.cross(first, (1.0, 0.0, 0.0))
    across /= np.linalg.norm(across)
    return np.stack([first, across, np.cross(first, across)])


def _steps(angles: Array, step: float, most: int) -> Array:
    """Return angles at even steps over a range; at least two."""
    low, high = float(angles.min()), float(angles.max())
    count = int(np.clip(np.ceil((high - low) / step), 1, most)) + 1
    return np.linspace(low, low + max(high - low, step), count, dtype=np.float32)


def _horizon(away: Array, rays: Array, axes: Array, slants: Array, turns: Array) -> Array:
    """Return (turns, slants) the least distance from the axis of what lies nearer to the light; infinite if nothing."""
    height, width = away.shape
    cosine, sine = np.cos(slants), np.sin(slants)
    sides = np.outer(np.cos(turns), axes[1]) + np.outer(np.sin(turns), axes[2])
    x, y, z = (cosine * axes[0, k] + sine * sides[:, k, None] for k in range(3))
    with np.errstate(divide="ignore", invalid="ignore"):
        column, row = (
            np.rint((way / z - rays[0, 0, k]) * ((count - 1) / (rays[-1, -1, k] - rays[0, 0, k])))
            for k, way, count in ((0, x, width), (1, y, height))
        )
        place = row * width + column
    inside = (z > 0) & (column >= 0) & (column < width) & (row >= 0) & (row < height)
    depth = away.take(np.where(inside, place, 0).astype(int))
    least = np.full((len(turns), len(slants) + 1), np.inf, np.float32)
    least[:, 1:] = np.where(inside & (depth > 0), depth * sine, np.inf)
    return np.minimum.accumulate(least[:, :-1], 1)


Floats = NDArray[np.float32]
MOST_STOPS = 12.0  # stops: lamps in watts are that far from 1
BURNT = 0.003  # share of a photograph, of which white may burn out
WHITE = 0.9  # linear light of a photograph from which on it is burnt itself
HALVINGS = 13  # of the range: to 0.003 stops


def stops_to_match(lit: Floats, photograph: Floats) -> float:
    """Return the stops, to two digits, by which light is multiplied so that the medians of both are as bright.

    Both are (h, w, 4): linear light of the same surfaces, not cut off at 1, and 1; 0 where there is none. What no light
    reaches does not count.
    """
    reached = (lit[..., :3].max(-1) > 0) & (photograph[..., 3] > 0)
    light, own = (np.ascontiguousarray(one[reached, :3].T) for one in (lit, photograph))
    if not reached.any() or not (wanted := brightness(own)) > 0:
        return 0.0
    low, high = -MOST_STOPS, MOST_STOPS
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        if brightness(light * np.float32(2**middle)) < wanted:
            low = middle
        else:
            high = middle
    return round((low + high) / 2, 2)


def stops_to_burn(lit: Floats, photograph: Floats) -> float:
    """Return the stops, to two digits, at which a share of BURNT of what the photograph shows is lit beyond white.

    The arrays are those of `stops_to_match`. What is white in the photograph does not count.
    """
    shown = (lit[..., :3].max(-1) > 0) & (photograph[..., 3] > 0) & (photograph[..., :3].max(-1) < WHITE)
    if not shown.any():
        return MOST_STOPS
    return round(float(-np.log2(np.quantile(lit[shown, :3].max(-1), 1 - BURNT))), 2)


def brightness(light: Floats) -> float:
    """Return the median of the means of the channels, sRGB from 0 to 1, of linear light (3, n)."""
    return float(np.median(linear_to_srgb(np.minimum(light, np.float32(1))).mean(0)))
