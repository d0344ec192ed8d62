"""The highlights of a picture: where its geometry says that they are, how sharp and how strong.

One light makes them all. A highlight is S = max(r . l, 0)^n (Phong 1975), r the mirrored direction to the eye. The
place of the light and n explain most of the differences between neighbours, by their L1 norm, for which the best
strength is a weighted median. Colours alone cannot tell a highlight from white paint.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .light_fit import FoundLight

Array = NDArray[np.float32]
Values = NDArray[np.float64]
Indices = NDArray[np.int64]
NEIGHBOURS = (1, 0), (0, 1), (3, 0), (0, 3), (6, 2), (2, -6), (10, 6), (6, -10)  # samples between those of a pair
SEARCHED = 20.0  # degrees that the light may be off
EXPONENTS, WIDEST, SHARPEST = (10.0, 30.0, 90.0), 5.0, 200.0
NEAR, NEAREST = 0.7, 1.5  # depth of the scene over the distance of a near light
AMBIENT = 0.1, 0.4  # of the direction's light, where the picture does not tell its light
STRIDE, ANYWHERE = 6.0, 150  # degrees between the directions of the search; and how many there are from all sides
TRUSTED = 0.002, 0.06  # share of the differences that the light is worth if it is off by so much, radians
FEW_PAIRS, MORE_PAIRS, MANY_PAIRS, EVERY = 2_500, 12_000, 40_000, 1 << 40
STARTS, STEPS, TRIES = 3, 12, 4  # of the refinement
SMALL = 0.005  # difference of linear light below which all count alike
WEAKEST = 0.05  # strength, linear light, that is worth while
WHITE = 0.4  # weakest channel of a highlight over its strongest
SECTORS = 8
UNEVEN = 0.4  # by how much the sectors around a highlight may differ from its strength, root mean square
# Times the evidence of any spot of the texture: where the light is known, where it is not.
STANDS_OUT = 1.2, 3.0
SHADOW, TEXTURE = 0.25, 0.1  # ambient over direct light, and difference of log brightness due to texture
AGREES = 0.96  # evidence of shading by a light over that by any other
SHADED = 0.8  # share of its highlight below which a sample shows that it has none
QUIET = 0.015  # difference of linear light between samples of a surface without texture
THIRDS = np.full(3, 1 / 3, np.float32)  # a mean over channels, much faster than mean()
LEAST = 0.02  # difference that a highlight of strength 1 makes in a pair that says something
SAME_SURFACE = 0.02  # of the depth, off the neighbour's tangent plane
BEND = 0.9  # cosine between neighbours of one surface


@dataclass(frozen=True, eq=False)
class FoundHighlights:
    """The highlights in a picture.

    light      (4,) l and q: the light comes to a point p from l - q p, normalized, camera axes
    exponent   n, how sharp they are
    strengths  (h, w, 2) float32: what they add to linear light where they are brightest, and depth, of blocks of pixels
    tells      whether there are highlights that can be taken out
    why        what keeps it from telling
    """

    light: tuple[float, float, float, float]
    exponent: float
    strengths: Array
    tells: bool
    why: str = ""


class Guess(NamedTuple):
    """A light: unit direction from the middle of the scene, depth of the scene over its distance, and exponent."""

    direction: Array
    nearness: float
    exponent: float


class Lit(NamedTuple):
    """Samples in a light, (m,) each: their light over that of the direction, and the log of r . l."""

    shading: Array
    glint: Array


class Pairs(NamedTuple):
    """Pairs of samples, of which a highlight brightens one.

    one     (n,) the first sample
    ratio   (n, 3) difference of their albedo over that of the highlight
    weight  (n,) difference of the highlight, linear light
    """

    one: Indices
    ratio: Array
    weight: Array

    def only(self, chosen: NDArray[np.bool_]) -> Pairs:
        return Pairs(self.one[chosen], self.ratio[chosen], self.weight[chosen])


class Evidence(NamedTuple):
    """What pairs say: the strength that explains most, how much it explains, and how surely."""

    strength: float
    gain: float
    sureness: float

    @property
    def value(self) -> float:
        return self.gain * self.sureness * (1 if self.strength > 0 else -1)


class Samples:
    """A small copy of a frame.

    n, r, color, points  (m, 3) float32: unit normals, mirrored directions to the eye, linear light, and where they are
    n_p, r_p, far        (m,) the dot products of normals, mirrored directions and points with the points
    piece                (h, w) number of the smooth piece of surface, -1 where none
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
        """(m, 16) how little the texture of each piece varies between partners: they count that much."""
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

    def toward(self, guess: Guess) -> Array:
        """(4,) l and q, see FoundHighlights."""
        q = np.float32(guess.nearness / max(float(self.middle[2]), 1e-6))
        return np.append(guess.direction + q * self.middle, q).astype(np.float32)


def fit_highlights(colors: Array, surfaces: Array, rays: Array, light: FoundLight) -> FoundHighlights:
    """The highlights of a picture.

    colors    (h, w, 4) linear RGB and 1, or 0 where unknown or clipped
    surfaces  (h, w, 4) unit normals, camera axes, towards the camera, and depth
    rays      (h, w, 3) from the camera through the samples, z = 1
    light     the direction from which they roughly come; where it does not tell, they may come from anywhere
    """
    samples = Samples(colors, surfaces, rays)
    if len(samples.at) < 300:
        return _none("it shows too little")
    ambient = light.ambient if light.tells else float(np.clip(light.ambient, *AMBIENT))
    found = _search(samples, light, ambient)
    if found is None:
        return _none("no highlights found")
    pairs = pairs_of(samples, lit(samples, found, ambient), found.exponent, EVERY)[0]
    strength = weigh(pairs).strength
    if why := _doubt(pairs, strength, found.exponent):
        return _none(why)
    uneven = _unevenness(samples, found, pairs, strength)
    if uneven > UNEVEN:
        return _none("no highlights found, what looks like one has another shape")
    least = STANDS_OUT[not light.tells] * max(1, 4 * uneven)
    if not _stands_out(samples, found, strength, ambient, least):
        return _none("no highlights found that stand out from its texture")
    if not light.tells and not _shades(samples, found, strength):
        return _none("no highlights found where its shading says that the light is")
    strengths = _strengths(samples, found, pairs, strength, ambient)
    if not strengths.any():
        return _none("no highlights found, what looks like one is texture")
    strengths = np.stack([strengths, surfaces[..., 3]], -1)
    x, y, z, q = samples.toward(found).tolist()
    return FoundHighlights((x, y, z, q), found.exponent, strengths, True)


def describe_highlights(found: FoundHighlights) -> str:
    """What was found, in one line."""
    if not found.tells:
        return f"remove-highlights: {found.why}: the picture's colours stay as they are"
    share = 100 * float((found.strengths[..., 0] > 0).mean())
    strength = float(found.strengths[..., 0].max())
    return (
        f"remove-highlights: strength {strength:.2f}, shininess {found.exponent:.0f}, on {share:.0f} % of the picture"
    )


def _none(why: str) -> FoundHighlights:
    return FoundHighlights((0.0, 0.0, -1.0, 0.0), 1.0, np.zeros((1, 1, 2), np.float32), False, why)


def _doubt(pairs: Pairs, strength: float, exponent: float) -> str:
    """Why what was found is no highlight."""
    if strength < WEAKEST:
        return "no highlights found that could be seen"
    if not WIDEST * 1.05 < exponent < SHARPEST * 0.9:
        return "no highlights found, what looks like one is too wide or too sharp"
    colors = [weighted_median(pairs.ratio[:, k], pairs.weight) for k in range(3)]
    if min(colors) < WHITE * max(colors):
        return "no highlights found, what looks like one is coloured"
    return ""


def _unevenness(s: Samples, found: Guess, pairs: Pairs, strength: float) -> float:
    """By how much the sectors around a highlight differ from its strength, root mean square, over that."""
    l_q = s.toward(found)
    to = l_q[:3] - l_q[3] * s.points[pairs.one]
    off = s.r[pairs.one] - to / np.linalg.norm(to, axis=-1, keepdims=True)
    across, up = _axes(found.direction)
    sector = np.floor((np.arctan2(off @ up, off @ across) / (2 * np.pi) + 0.5) * SECTORS).astype(int) % SECTORS
    of_each = [one for k in range(SECTORS) if len((one := pairs.only(sector == k)).weight)]
    shares = np.array([one.weight.sum() for one in of_each]) / pairs.weight.sum()
    if (shares > 0.05).sum() < 3:
        return np.inf
    strengths = np.array([weigh(one).strength if len(one.weight) > 30 else strength for one in of_each])
    return float(np.sqrt(shares @ (strengths / strength - 1) ** 2))


def _axes(direction: Array) -> tuple[Array, Array]:
    """Two unit directions across a third."""
    across = np.cross(direction, np.eye(3, dtype=np.float32)[np.argmin(abs(direction))])
    across /= np.linalg.norm(across)
    return across, np.cross(direction, across)


def _search(s: Samples, light: FoundLight, ambient: float) -> Guess | None:
    """The light and exponent that explain most, near the direction that is known."""
    trusted = np.array(light.direction, np.float32) if light.tells else None
    found: list[tuple[float, Guess]] = []
    for nearness in (0.0, NEAR) if light.tells else (0.0,):
        for direction in directions_around(trusted, SEARCHED, STRIDE) if trusted is not None else _sides(ANYWHERE):
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
    refined = [_refined(s, start, ambient, MORE_PAIRS, trusted) for start in starts]
    best = max(refined, key=lambda g: weigh(*pairs_of(s, lit(s, g, ambient), g.exponent, MORE_PAIRS)).value)
    return _refined(s, best, ambient, MANY_PAIRS, trusted)


class Spot:
    """Pairs of samples around a highlight.

    before  (n, 3) their differences
    """

    def __init__(self, s: Samples, guess: Guess, ambient: float, most: int):
        self._samples, self._guess, self._ambient = s, guess, ambient
        self._across, self._up = _axes(guess.direction)
        light = lit(s, guess, ambient)
        near = np.flatnonzero(light.glint > np.log(0.02) / (0.6 * guess.exponent))
        half = len(NEIGHBOURS)  # the other half are the same pairs
        one, other = np.repeat(near, half), s.partners[near, :half].ravel()
        calm = s.calm[near, :half].ravel()
        every = max(len(one) // most, 1)
        kept = np.flatnonzero(other >= 0)[::every]
        one, other, calm = one[kept], other[kept], calm[kept]
        scale = np.minimum(light.shading[one], light.shading[other]) * calm
        self._one, self._other = one, other
        self._gains = scale / light.shading[one], scale / light.shading[other]
        self.before = s.color[one] * self._gains[0][:, None] - s.color[other] * self._gains[1][:, None]

    def guess(self, p: Values) -> Guess:
        """p: turns of the direction, nearness, log of the exponent."""
        direction = self._guess.direction + p[0] * self._across + p[1] * self._up
        direction = (direction / np.linalg.norm(direction)).astype(np.float32)
        return Guess(direction, float(p[2]), float(np.clip(np.exp(p[3]), WIDEST, SHARPEST)))

    def change(self, p: Values) -> Array:
        """(n,) the differences that a highlight of strength 1 makes."""
        guess = self.guess(p)
        highlight = np.exp(guess.exponent * lit(self._samples, guess, self._ambient).glint).astype(np.float32)
        change = highlight[self._one] * self._gains[0] - highlight[self._other] * self._gains[1]
        return change.astype(np.float32, copy=False)

    def turns(self, direction: Array) -> Values:
        """(2,) of a direction nearby."""
        return np.array([direction @ self._across, direction @ self._up], np.float64)


def _refined(s: Samples, start: Guess, ambient: float, most: int, trusted: Array | None) -> Guess:
    for _ in range(2):  # around where the highlight turns out to be
        spot = Spot(s, start, ambient, most)
        if len(spot.before) < 60:
            return start
        start = _fitted(spot, start, trusted)
    return start


def _fitted(spot: Spot, start: Guess, trusted: Array | None) -> Guess:
    """Levenberg-Marquardt steps on the L1 norm of what is left, reweighted (Schlossmacher 1973)."""
    p, pull, steps = (
        np.array([0, 0, start.nearness, np.log(start.exponent), 0]),
        np.zeros(5),
        np.diag([0.01] * 2 + [0.05] * 3),
    )
    home = np.zeros(5)
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


def _stands_out(s: Samples, found: Guess, strength: float, ambient: float, least: float) -> bool:
    """Whether no other light explains more than a share of what is left without the highlights: texture has no spots.

    least  times that evidence
    """
    lighted = lit(s, found, ambient)
    value = weigh(*pairs_of(s, lighted, found.exponent, FEW_PAIRS)).value
    highlight = strength * np.exp(found.exponent * lighted.glint)
    rest = copy(s)
    rest.color = np.maximum(s.color - highlight[:, None], 0.1 * s.color)
    for direction in _sides(50):
        other = lighted._replace(glint=lit(rest, Guess(direction, 0.0, 1.0), ambient).glint)
        for exponent in EXPONENTS:
            if least * abs(weigh(*pairs_of(rest, other, exponent, FEW_PAIRS)).value) > value:
                return False
    return True


def _shades(s: Samples, found: Guess, strength: float) -> bool:
    """Whether brightness follows the light of the highlights, as far as one can tell, as well as any other light."""
    glint = lit(s, found, AMBIENT[0]).glint
    rest = np.maximum(s.color - (strength * np.exp(found.exponent * glint))[:, None], 0.1 * s.color)
    brightness = np.log(np.maximum(rest @ THIRDS, 1e-3))
    half = len(NEIGHBOURS)
    one, other, calm = np.repeat(np.arange(len(s.at)), half), s.partners[:, :half].ravel(), s.calm[:, :half].ravel()
    kept = np.flatnonzero(other >= 0)[::3]
    one, other, calm = one[kept], other[kept], calm[kept]
    shading = np.log(SHADOW + np.maximum(s.n @ np.concatenate([found.direction[None], _sides(100)]).T, 0))
    slopes = (shading[one] - shading[other]) * calm[:, None]
    follows = np.tanh((brightness[one] - brightness[other]) / TEXTURE) @ slopes
    evidence = follows / np.sqrt(np.square(slopes).sum(0) + 1e-9)
    return bool(evidence[0] > AGREES * max(float(evidence.max()), 0.0))


def _sides(count: int) -> Array:
    """(count, 3) unit directions, most of them from the side of the camera."""
    k = np.arange(count) + 0.5
    turn, z = k * np.pi * (1 + 5**0.5), 0.2 - 1.2 * k / count
    ring = np.sqrt(1 - z * z)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), z], -1).astype(np.float32)


def _strengths(s: Samples, found: Guess, pairs: Pairs, strength: float, ambient: float) -> Array:
    """(h, w) strength: none on pieces that have no such highlight, and around samples too dark to have it."""
    piece = s.piece.ravel()
    of_pair = piece[s.at[pairs.one]]
    strengths = np.zeros(piece.size, np.float32)
    for number in np.unique(of_pair):
        strengths[piece == number] = _own_strength(pairs.only(of_pair == number), strength)
    missing = np.zeros(piece.size, bool)
    missing[s.at] = s.color.min(-1) < SHADED * strengths[s.at] * np.exp(found.exponent * lit(s, found, ambient).glint)
    missing = missing.reshape(s.piece.shape)
    for axis in (0, 1):
        missing |= np.roll(missing, 1, axis) | np.roll(missing, -1, axis)
    return np.where(missing, np.float32(0), strengths.reshape(s.piece.shape))


def _own_strength(pairs: Pairs, strength: float) -> float:
    """The strength on a piece, from its pairs: the same unless they say much less, none if they say about none."""
    own = weigh(pairs)
    return (
        min(strength, 2 * own.strength) if own.sureness > 3 and 0.25 * strength < own.strength < 2.5 * strength else 0.0
    )


def smooth_pieces(surfaces: Array, rays: Array) -> Indices:
    """(h, w): which smooth piece of surface each sample belongs to; -1 where there is none."""
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
    """With the mean normals of a sample and its eight neighbours on the same piece, nearer ones counting more."""
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
    """Pairs near the highlights, about as many as wanted, and how many times as many there are."""
    near = np.flatnonzero(light.glint > np.log(0.03) / exponent)
    few = near[: most // s.partners.shape[1]]
    a, b, calm = np.repeat(few, s.partners.shape[1]), s.partners[few].ravel(), s.calm[few].ravel()
    kept = b >= 0
    a, b, calm = a[kept], b[kept], calm[kept]
    one, other = light.shading[a], light.shading[b]
    change = np.exp(exponent * light.glint[a]) / one - np.exp(exponent * light.glint[b]) / other
    weight = abs(change) * np.minimum(one, other)
    says = np.flatnonzero(weight > LEAST)
    a, b = a[says], b[says]
    albedo = s.color[a] / one[says, None] - s.color[b] / other[says, None]
    ratio, weight = (albedo / change[says, None]).astype(np.float32), (weight[says] * calm[says]).astype(np.float32)
    return Pairs(a, ratio, weight), len(near) / max(len(few), 1)


def weigh(pairs: Pairs, factor: float = 1.0) -> Evidence:
    """The strength that leaves the least differences. factor: how many pairs each stands for."""
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


def directions_around(middle: Array, degrees: float, step: float) -> list[Array]:
    """Unit directions on a triangular grid."""
    across, up = _axes(middle)
    count = int(degrees / step) + 1
    found = []
    for i in range(-count, count + 1):
        for j in range(-count, count + 1):
            x, y = (i + 0.5 * (j % 2)) * step, j * step * 0.75**0.5
            if np.hypot(x, y) <= degrees:
                direction = middle + np.radians(x) * across + np.radians(y) * up
                found.append((direction / np.linalg.norm(direction)).astype(np.float32))
    return found
