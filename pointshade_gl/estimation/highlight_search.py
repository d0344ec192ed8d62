"""Searches for the light direction and the Phong exponent that explain the highlights of an image, and refines both."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .highlight_samples import NEIGHBOURS, Array, Guess, Samples, lit, pairs_of, weigh, weighted_median
from .light_fit import FoundLight

Values = NDArray[np.float64]
SEARCHED = 20.0  # degrees that the light may be off
EXPONENTS, WIDEST, SHARPEST = (10.0, 30.0, 90.0), 5.0, 200.0
NEAR, NEAREST = 0.7, 1.5  # depth of the scene over the distance of a near light
STRIDE, ANYWHERE = 6.0, 150  # degrees between the directions of the search; and how many there are from all sides
TRUSTED = 0.002, 0.06  # share of the differences that the light is worth if it is off by so much, radians
FEW_PAIRS, MORE_PAIRS, MANY_PAIRS, EVERY = 2_500, 12_000, 40_000, 1 << 40
STARTS, STEPS, TRIES = 3, 12, 4  # of the refinement
SMALL = 0.005  # difference of linear light below which all count alike


def axes_around(direction: Array) -> tuple[Array, Array]:
    """Return two unit directions perpendicular to a third and to each other."""
    across = np.cross(direction, np.eye(3, dtype=np.float32)[np.argmin(abs(direction))])
    across /= np.linalg.norm(across)
    return across, np.cross(direction, across)


def search(s: Samples, light: FoundLight, ambient: float) -> Guess | None:
    """Search for the light and exponent that explain most, near the known direction of the light or on all sides."""
    trusted = np.array(light.direction, np.float32) if light.is_sure else None
    directions = directions_all_round(ANYWHERE) if trusted is None else directions_around(trusted, SEARCHED, STRIDE)
    found: list[tuple[float, Guess]] = []
    for nearness in (0.0, NEAR) if light.is_sure else (0.0,):
        for direction in directions:
            guess = Guess(direction, nearness, 1.0)
            lighted = lit(s, guess, ambient)
            for exponent in EXPONENTS:
                value = weigh(*pairs_of(s, lighted, exponent, FEW_PAIRS)).value
                found.append((value, guess._replace(exponent=exponent)))
    found.sort(key=lambda x: -x[0])
    if found[0][0] <= 0:
        return None
    starts: list[Guess] = []
    for _, guess in found:
        if all(guess.direction @ g.direction < 0.985 or guess.exponent != g.exponent for g in starts):
            starts.append(guess)
        if len(starts) == STARTS:
            break
    candidates = [_refined(s, start, ambient, MORE_PAIRS, trusted) for start in starts]
    best = max(candidates, key=lambda g: weigh(*pairs_of(s, lit(s, g, ambient), g.exponent, MORE_PAIRS)).value)
    return _refined(s, best, ambient, MANY_PAIRS, trusted)


class Spot:
    """Pairs of samples around one candidate highlight, for its refinement.

    before  (n, 3) their differences in linear light
    """

    def __init__(self, s: Samples, guess: Guess, ambient: float, most: int):
        self._samples, self._guess, self._ambient = s, guess, ambient
        self._across, self._up = axes_around(guess.direction)
        light = lit(s, guess, ambient)
        near = np.flatnonzero(light.glint > np.log(0.02) / (0.6 * guess.exponent))
        half = len(NEIGHBOURS)  # the other half are the same pairs
        one, other, calm = s.pairs(near, half, max(len(near) * half // most, 1))
        scale = np.minimum(light.shading[one], light.shading[other]) * calm
        self._one, self._other = one, other
        self._gains = scale / light.shading[one], scale / light.shading[other]
        self.before = s.color[one] * self._gains[0][:, None] - s.color[other] * self._gains[1][:, None]

    def guess(self, p: Values) -> Guess:
        """Return the candidate with parameters p: two turns of the direction, nearness, log of the exponent."""
        direction = self._guess.direction + p[0] * self._across + p[1] * self._up
        direction = (direction / np.linalg.norm(direction)).astype(np.float32)
        return Guess(direction, float(p[2]), float(np.clip(np.exp(p[3]), WIDEST, SHARPEST)))

    def change(self, p: Values) -> Array:
        """Return (n,) the differences that a highlight of strength 1 with parameters p makes in the pairs."""
        guess = self.guess(p)
        highlight = np.exp(guess.exponent * lit(self._samples, guess, self._ambient).glint).astype(np.float32)
        change = highlight[self._one] * self._gains[0] - highlight[self._other] * self._gains[1]
        return change.astype(np.float32, copy=False)

    def turns(self, direction: Array) -> Values:
        """Return (2,) the turns that lead to a direction nearby."""
        return np.array([direction @ self._across, direction @ self._up], np.float64)


def _refined(s: Samples, start: Guess, ambient: float, most: int, trusted: Array | None) -> Guess:
    for _ in range(2):  # around where the highlight turns out to be
        spot = Spot(s, start, ambient, most)
        if len(spot.before) < 60:
            return start
        start = _fitted(spot, start, trusted)
    return start


def _fitted(spot: Spot, start: Guess, trusted: Array | None) -> Guess:
    """Refine a candidate by Levenberg-Marquardt steps on the L1 norm of the remaining differences, as reweighted least
    squares (Schlossmacher 1973)."""
    p, steps = np.array([0, 0, start.nearness, np.log(start.exponent), 0]), np.diag([0.01] * 2 + [0.05] * 3)
    home, pull = np.zeros(5), np.zeros(5)
    change = spot.change(p)
    if trusted is not None:
        home[:2], pull[:2] = spot.turns(trusted), TRUSTED[0] / TRUSTED[1] ** 2 * abs(spot.before).sum()
    safe = np.where(abs(change) > 1e-6, change, 1e-6)
    p[4] = weighted_median((spot.before / safe[:, None]).ravel().astype(np.float32), np.repeat(abs(change), 3))
    left = spot.before - p[4] * change[:, None]
    cost, damping = abs(left).sum() + pull @ (p - home) ** 2, 1e-2
    for _ in range(STEPS):
        slopes = [p[4] * (spot.change(p + step) - change) / step.sum() for step in steps[:4]]
        slopes = np.stack([*slopes, change], -1)
        weight = 1 / (abs(left) + SMALL)
        curve = (slopes * weight.sum(-1)[:, None]).T @ slopes + 2 * np.diag(pull)
        force = slopes.T @ (weight * left).sum(-1) - 2 * pull * (p - home)
        for _ in range(TRIES):
            new = p + np.linalg.solve(curve + damping * np.diag(np.diag(curve) + 1e-8 * weight.sum()), force)
            new[2] = np.clip(new[2], 0, NEAREST)
            new_change = spot.change(new)
            new_left = spot.before - new[4] * new_change[:, None]
            new_cost = abs(new_left).sum() + pull @ (new - home) ** 2
            if new_cost < cost:
                break
            damping *= 8
        else:
            break
        is_done = cost - new_cost < 3e-4 * cost
        p, change, left, cost, damping = new, new_change, new_left, new_cost, 0.2 * damping
        if is_done:
            break
    return spot.guess(p)


def directions_all_round(count: int) -> Array:
    """Return (count, 3) unit directions, most of them from the camera's side."""
    k = np.arange(count) + 0.5
    turn, z = k * np.pi * (1 + 5**0.5), 0.2 - 1.2 * k / count
    ring = np.sqrt(1 - z * z)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), z], -1).astype(np.float32)


def directions_around(middle: Array, degrees: float, step: float) -> list[Array]:
    """Return unit directions on a triangular grid around a middle one."""
    across, up = axes_around(middle)
    count = int(degrees / step) + 1
    found = []
    for i in range(-count, count + 1):
        for j in range(-count, count + 1):
            x, y = (i + 0.5 * (j % 2)) * step, j * step * 0.75**0.5
            if np.hypot(x, y) <= degrees:
                direction = middle + np.radians(x) * across + np.radians(y) * up
                found.append((direction / np.linalg.norm(direction)).astype(np.float32))
    return found
