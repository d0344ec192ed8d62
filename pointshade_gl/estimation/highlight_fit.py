"""Estimates the specular highlights in a colour image from its surface geometry: position, sharpness and strength.

One light makes them all. A highlight is S = max(r . l, 0)^n (Phong 1975), r the mirrored direction to the eye. The
place of the light and n explain most of the differences between neighbours, by their L1 norm, for which the best
strength is a weighted median. Colours alone cannot distinguish a highlight from white paint.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass

import numpy as np

from .highlight_samples import NEIGHBOURS, THIRDS, Array, Guess, Pairs, Samples, lit, pairs_of, weigh, weighted_median
from .highlight_search import EVERY, EXPONENTS, FEW_PAIRS, SHARPEST, WIDEST, axes_around, directions_all_round, search
from .light_fit import FoundLight

AMBIENT = 0.1, 0.4  # of the direction's light, where the picture does not show its light
WEAKEST = 0.05  # strength, linear light, that is worth while
WHITE = 0.4  # weakest channel of a highlight over its strongest
SECTORS = 8
UNEVEN = 0.4  # by how much the sectors around a highlight may differ from its strength, root mean square
# Times the evidence of any spot of the texture: where the light is known, where it is not.
STANDS_OUT = 1.2, 3.0
SHADOW, TEXTURE = 0.25, 0.1  # ambient over direct light, and difference of log brightness due to texture
AGREES = 0.96  # evidence of shading by a light over that by any other
SHADED = 0.8  # share of its highlight below which a sample shows that it has none


@dataclass(frozen=True, eq=False)
class FoundHighlights:
    """The highlights that were found in a picture.

    light      (4,) l and q: at a point p the light comes from the direction l - q p, normalized, camera axes
    exponent   n, the Phong exponent: how sharp the highlights are
    strengths  (h, w, 2) float32 for blocks of pixels: linear light that a highlight adds at its brightest, and depth
    tells      whether there are highlights that can be removed
    why        the reason if there are none
    """

    light: tuple[float, float, float, float]
    exponent: float
    strengths: Array
    tells: bool
    why: str = ""


def fit_highlights(colors: Array, surfaces: Array, rays: Array, light: FoundLight) -> FoundHighlights:
    """Find the highlights of a picture, or the reason why none can be removed.

    colors    (h, w, 4) linear RGB and 1, or 0 where unknown or clipped
    surfaces  (h, w, 4) unit normals, camera axes, towards the camera, and depth
    rays      (h, w, 3) from the camera through the samples, z = 1
    light     the main light of the picture: the search starts from its direction, or from all sides if it is unknown
    """
    samples = Samples(colors, surfaces, rays)
    if len(samples.at) < 300:
        return _none("it shows too little")
    ambient = light.ambient if light.is_sure else float(np.clip(light.ambient, *AMBIENT))
    found = search(samples, light, ambient)
    if found is None:
        return _none("no highlights found")
    pairs = pairs_of(samples, lit(samples, found, ambient), found.exponent, EVERY)[0]
    strength = weigh(pairs).strength
    if why := _doubt(pairs, strength, found.exponent):
        return _none(why)
    uneven = _unevenness(samples, found, pairs, strength)
    if uneven > UNEVEN:
        return _none("no highlights found, what looks like one has another shape")
    least = STANDS_OUT[not light.is_sure] * max(1, 4 * uneven)
    if not _stands_out(samples, found, strength, ambient, least):
        return _none("no highlights found that stand out from its texture")
    if not light.is_sure and not _shades(samples, found, strength):
        return _none("no highlights found where its shading says that the light is")
    strengths = _strengths(samples, found, pairs, strength, ambient)
    if not strengths.any():
        return _none("no highlights found, what looks like one is texture")
    strengths = np.stack([strengths, surfaces[..., 3]], -1)
    x, y, z, q = samples.toward(found).tolist()
    return FoundHighlights((x, y, z, q), found.exponent, strengths, True)


def describe_highlights(found: FoundHighlights) -> str:
    """Describe the highlights that were found in one line."""
    if not found.tells:
        return f"remove-highlights: {found.why}: the picture's colours stay as they are"
    share = 100 * float((found.strengths[..., 0] > 0).mean())
    how = f"strength {float(found.strengths[..., 0].max()):.2f}, shininess {found.exponent:.0f}"
    return f"remove-highlights: {how}, on {share:.0f} % of the picture"


def _none(why: str) -> FoundHighlights:
    return FoundHighlights((0.0, 0.0, -1.0, 0.0), 1.0, np.zeros((1, 1, 2), np.float32), False, why)


def _doubt(pairs: Pairs, strength: float, exponent: float) -> str:
    """Return why a candidate that brightens pairs of samples cannot be a highlight; "" if it may be one."""
    if strength < WEAKEST:
        return "no highlights found that could be seen"
    if not WIDEST * 1.05 < exponent < SHARPEST * 0.9:
        return "no highlights found, what looks like one is too wide or too sharp"
    colors = [weighted_median(pairs.ratio[:, k], pairs.weight) for k in range(3)]
    if min(colors) < WHITE * max(colors):
        return "no highlights found, what looks like one is coloured"
    return ""


def _unevenness(s: Samples, found: Guess, pairs: Pairs, strength: float) -> float:
    """Return how far a candidate is from round: root mean square deviation of the strength of SECTORS sectors around
    it, as a share of its strength; infinite if it lies in fewer than three of them."""
    l_q = s.toward(found)
    to = l_q[:3] - l_q[3] * s.points[pairs.one]
    off = s.r[pairs.one] - to / np.linalg.norm(to, axis=-1, keepdims=True)
    across, up = axes_around(found.direction)
    sector = np.floor((np.arctan2(off @ up, off @ across) / (2 * np.pi) + 0.5) * SECTORS).astype(int) % SECTORS
    of_each = [one for k in range(SECTORS) if len((one := pairs.only(sector == k)).weight)]
    shares = np.array([one.weight.sum() for one in of_each]) / pairs.weight.sum()
    if (shares > 0.05).sum() < 3:
        return np.inf
    strengths = np.array([weigh(one).strength if len(one.weight) > 30 else strength for one in of_each])
    return float(np.sqrt(shares @ (strengths / strength - 1) ** 2))


def _stands_out(s: Samples, found: Guess, strength: float, ambient: float, least: float) -> bool:
    """Return whether the highlights explain `least` times as much as any other light; else they may be texture."""
    lighted = lit(s, found, ambient)
    value = weigh(*pairs_of(s, lighted, found.exponent, FEW_PAIRS)).value
    highlight = strength * np.exp(found.exponent * lighted.glint)
    rest = copy(s)
    rest.color = np.maximum(s.color - highlight[:, None], 0.1 * s.color)
    for direction in directions_all_round(50):
        other = lighted._replace(glint=lit(rest, Guess(direction, 0.0, 1.0), ambient).glint)
        for exponent in EXPONENTS:
            if least * abs(weigh(*pairs_of(rest, other, exponent, FEW_PAIRS)).value) > value:
                return False
    return True


def _shades(s: Samples, found: Guess, strength: float) -> bool:
    """Return whether the diffuse shading supports the light of the highlights as well as any other light."""
    glint = lit(s, found, AMBIENT[0]).glint
    rest = np.maximum(s.color - (strength * np.exp(found.exponent * glint))[:, None], 0.1 * s.color)
    brightness = np.log(np.maximum(rest @ THIRDS, 1e-3))
    one, other, calm = s.pairs(np.arange(len(s.at)), len(NEIGHBOURS), 3)
    shading = np.log(SHADOW + np.maximum(s.n @ np.concatenate([found.direction[None], directions_all_round(100)]).T, 0))
    slopes = (shading[one] - shading[other]) * calm[:, None]
    follows = np.tanh((brightness[one] - brightness[other]) / TEXTURE) @ slopes
    evidence = follows / np.sqrt(np.square(slopes).sum(0) + 1e-9)
    return bool(evidence[0] > AGREES * max(float(evidence.max()), 0.0))


def _strengths(s: Samples, found: Guess, pairs: Pairs, strength: float, ambient: float) -> Array:
    """Return (h, w) the strength of the highlight: 0 on pieces without it, and around samples too dark to have it."""
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
    """Return the strength on one smooth piece, from its own pairs: `strength` or less, 0 if they show about none."""
    own = weigh(pairs)
    is_shown = own.sureness > 3 and 0.25 * strength < own.strength < 2.5 * strength
    return min(strength, 2 * own.strength) if is_shown else 0.0
