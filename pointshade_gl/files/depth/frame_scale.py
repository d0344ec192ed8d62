"""Scale and shift of depth from picture to picture of a film, where a network gives each its own.

What has not changed shows them. A picture is compared with an earlier one on small copies: blocks of it are looked for
there, those whose colours agree vote, and the values of both, v and w, obey w = a v + b. The line is the one with the
most support of many drawn through two points (MSAC, Torr and Zisserman 2000), then that of the reduced major axis, as
the noise is in both. Earlier pictures are few: the first one of a shot, and the next ones where little of those is left
in view, so that errors do not add up from each to the next.

Where the camera turns, inverse depth itself changes: what is at D in the earlier picture is at r D, as r = cos(turn) -
x sin(turn) of its distance lies along the new axis. Then (w - o) r = a v + b, where o is what infinity has in the
values of the shot; it shows in the first pictures of the turn. Whichever law the values obey better holds.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .picture_matching import Matched, Pairs, Small, matched, small_copy

_ENOUGH = 0.5  # of the blocks agree: the picture is compared with the same one further on
_CUT = 0.12  # of the blocks agree in no earlier picture: another shot
_KEPT = 6  # earlier pictures
_DRAWN, _JUDGES = 300, 1000  # lines, and points that judge them
_FAR_OFF, _SURELY_NEAR = 0.05, 0.004  # of the shot's range: no pair of a line is farther off it, and some always belong
_RANGES, _RARE = 16, 0.01  # of values that count alike, and the share of all points that a range needs for that
_NEAR = 2.5  # deviations
_LEAST_CHANGE, _LEAST_MOVING, _MOST_CHANGE = 0.005, 0.015, 0.12  # of a scale in metres: else it is no breath
_MOST, _LEAST_SURE = 0.6, 0.05  # of the ratios are near their middle; their deviation
_CLEARLY = 0.97  # of the other law's error
_SURE = 4  # pictures
_LITTLE = 0.003  # of a distance: so little is no turn
_USUAL, _DOUBT = -0.25, 10.0  # infinity in ranges of the values below the smallest, and the weight of that guess
_ROUNDS = 6
_FEWEST = 60  # points


class Line(NamedTuple):
    """w = a v + b: values of one picture in those of the shot's first."""

    a: float = 1.0
    b: float = 0.0
    is_first: bool = False  # of a shot


@dataclass
class FrameScale:
    """Follows a film: `of` gives the line of each picture, which must come in their order.

    focal       length in widths of the picture
    is_inverse  whether values are inverse depth, up to a line
    is_metric   whether they are metres, of which the factor alone may change, by up to a tenth
    may_move    whether that is looked for where the camera moves, too
    """

    focal: float = 0.87
    is_inverse: bool = True
    is_metric: bool = False
    may_move: bool = True
    _infinity: Infinity = field(default_factory=lambda: Infinity())
    _earlier: list[Small] = field(default_factory=list)
    _last: Small | None = None
    _places: NDArray[np.int_] | None = None  # where blocks are likely: as far on as from the picture before
    _before: NDArray[np.int_] | None = None
    _turns: int = 0  # pictures that showed a turn of the camera, less those that showed none
    _origin: float = 0.0  # of the shot's first values, and their range: lines are fitted in these units
    _unit: float = 1.0

    def of(self, values: NDArray[np.floating], colors: NDArray[np.uint8] | None) -> Line:
        """Return the line of the next picture.

        values  (h, w), NaN or infinite where unknown
        colors  (h', w', 3) of the same view, or None
        """
        small = small_copy(values, colors)
        line = self._line(small)
        if line.is_first:
            self._start(small)
            return Line(is_first=True)
        self._last = small.moved_by(line.a, line.b)
        return Line(line.a * self._unit, line.b * self._unit + self._origin)

    def _start(self, small: Small) -> None:
        """Begin a shot."""
        known = small.values[small.known] if small.known.any() else np.array([0.0, 1.0])
        low, high = (0.0, 1.0) if self.is_metric else np.percentile(known, (2, 98))
        self._origin, self._unit = float(low), float(high - low) or 1.0
        self._last = small.moved_by(1 / self._unit, -self._origin / self._unit)
        self._earlier, self._places, self._before, self._infinity = [self._last], None, None, Infinity()
        self._turns = 0

    def _go_on(self, places: NDArray[np.int_] | None, is_same: bool) -> None:
        """Expect that all moves on as it did, as long as pictures are compared with the same one."""
        going = is_same and places is not None and self._before is not None
        self._places = 2 * places - self._before if going else places  # type: ignore[operator]
        self._before = places

    def _line(self, small: Small) -> Line:
        if self._last is None:
            return Line(is_first=True)
        at_hand, count = self._earlier[-1], len(self._earlier)
        found = matched(small, at_hand, self._places, self.focal)
        if found.agreeing < _ENOUGH:
            found = self._other(small, found)
        self._go_on(found.places, is_same=len(self._earlier) == count and self._earlier[-1] is at_hand)
        if found.agreeing < _CUT:
            return Line(is_first=True)
        if self.is_metric:
            is_seen = found.agreeing >= _ENOUGH and (found.is_still or self.may_move)
            return _steady_line(found) if is_seen else Line()
        return self._line_of(found) or Line(is_first=True)

    def _line_of(self, found: Matched) -> Line | None:
        """Return the line of the shot's values. Whether the camera turned is decided by several pictures."""
        pairs = found.pairs
        plain = fitted_line(pairs.seen, pairs.earlier)
        if plain is None or found.is_still or not self.is_inverse or np.ptp(pairs.turned) < _LITTLE:
            return plain
        learned = self._infinity.learned(pairs, self._beyond(pairs, self._infinity) or plain)
        turned = self._beyond(pairs, learned)
        if turned is None:
            return plain
        o, off = learned.value, pairs.earlier - (plain.a * pairs.seen + plain.b)
        off_turned = pairs.earlier - o - (turned.a * pairs.seen + turned.b) / pairs.turned
        costs = [float(np.minimum(np.abs(one), _FAR_OFF).mean()) for one in (off, off_turned)]
        vote = (costs[1] < _CLEARLY * costs[0]) - (costs[0] < _CLEARLY * costs[1])
        self._turns = max(-_SURE, min(_SURE, self._turns + vote))
        if self._turns <= 0:
            return plain
        self._infinity = learned
        return Line(turned.a, turned.b + o)

    def _beyond(self, pairs: Pairs, infinity: Infinity) -> Line | None:
        """Return the line of what the turn left of the values above infinity's."""
        return fitted_line(pairs.seen, (pairs.earlier - infinity.value) * pairs.turned)

    def _other(self, small: Small, found: Matched) -> Matched:
        """Return how the picture agrees with one that it has more in common with than with the one at hand."""
        assert self._last is not None
        for place, one in enumerate(self._earlier[:-1]):
            again = matched(small, one, None, self.focal)
            if again.agreeing >= _ENOUGH:
                self._earlier.append(self._earlier.pop(place))
                return again
        newer = matched(small, self._last, None, self.focal)
        if newer.agreeing <= found.agreeing:
            return found
        self._earlier = [*self._earlier[-_KEPT + 1 :], self._last]
        return newer


@dataclass(frozen=True)
class Infinity:
    """What infinity has in the values of a shot, in its units, as its pictures have shown; a guess until then."""

    weight: float = 0.0
    total: float = 0.0

    @property
    def value(self) -> float:
        return (self.total + _DOUBT * _USUAL) / (self.weight + _DOUBT)

    def learned(self, pairs: Pairs, line: Line) -> Infinity:
        """Return it with what one turn shows: w = a v / r + b / r + o."""
        off = (pairs.earlier - self.value) * pairs.turned - (line.a * pairs.seen + line.b)
        near = np.abs(off) <= _NEAR * 1.4826 * max(float(np.median(np.abs(off))), 1e-9)
        v, w, r = pairs.seen[near], pairs.earlier[near], pairs.turned[near]
        terms = np.stack([v / r, 1 / r, np.ones_like(r)], axis=1)
        normal = terms.T @ terms
        try:
            inverse = np.linalg.inv(normal)
        except np.linalg.LinAlgError:
            return self
        found = float((inverse @ (terms.T @ w))[2])
        sigma = float(np.std(w - terms @ (inverse @ (terms.T @ w))))
        certain = 1 / max(float(inverse[2, 2]) * sigma**2, 1e-12)
        return Infinity(self.weight + certain, self.total + certain * found)


def fitted_line(seen: NDArray[np.float64], earlier: NDArray[np.float64]) -> Line | None:
    """Return the rising line that most pairs of values obey, what is near counting like what is far; None if none is.

    earlier  in units of the shot's range
    """
    if seen.size < _FEWEST or np.ptp(seen) == 0:
        return None
    weights = _rarity(earlier)
    rng = np.random.default_rng(0)
    chances = np.cumsum(weights) / weights.sum()
    first, second = np.minimum(np.searchsorted(chances, rng.random((2, _DRAWN))), seen.size - 1)
    with np.errstate(all="ignore"):
        a = (earlier[second] - earlier[first]) / (seen[second] - seen[first])
        b = earlier[first] - a * seen[first]
    rising = np.isfinite(a) & (a > 0)
    if not rising.any():
        return None
    a, b = a[rising], b[rising]
    judges = np.minimum(np.searchsorted(chances, rng.random(_JUDGES)), seen.size - 1)
    off = np.abs(a[:, None] * seen[judges] + b[:, None] - earlier[judges])
    best = int(np.argmin(np.minimum(off, _FAR_OFF).mean(axis=1)))
    return _refined(seen, earlier, float(a[best]), float(b[best]))


def _rarity(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n,) weights, by which each range of values counts alike, if it has a few."""
    low, high = np.percentile(values, (1, 99))
    places = np.clip((values - low) / max(high - low, 1e-30) * _RANGES, 0, _RANGES - 1).astype(int)
    counts = np.bincount(places, minlength=_RANGES)
    return 1 / np.maximum(counts, values.size * _RARE)[places]


def _refined(seen: NDArray[np.float64], earlier: NDArray[np.float64], a: float, b: float) -> Line:
    """Return the reduced major axis of the pairs near a line."""
    limit = _FAR_OFF
    for _ in range(_ROUNDS):
        off = np.abs(earlier - (a * seen + b))
        near = off <= limit
        if near.sum() < _FEWEST:
            break
        v, w = seen[near], earlier[near]
        share = _rarity((a * v + b + w) / 2)  # between both: by one alone its noise would decide
        share /= share.sum()
        means = share @ v, share @ w
        spreads = [float(np.sqrt(share @ (one - mean) ** 2)) for one, mean in zip((v, w), means, strict=True)]
        if not min(spreads) > 0:
            break
        a = spreads[1] / spreads[0]
        b = float(means[1] - a * means[0])
        limit = min(limit, max(_NEAR * 1.4826 * float(np.median(off[near])), _SURELY_NEAR))
    return Line(a, b)


def _steady_line(found: Matched) -> Line:
    """Return the factor of metres that breathe; exactly 1 where the change is none, or may be of the world.

    Who goes ahead sees all grow as its distance shrinks: the product of both does not change.
    """
    seen, earlier, turned = found.pairs
    near = (seen > 0) & (earlier > 0)
    if near.sum() < _FEWEST:
        return Line()
    plain = earlier[near] / seen[near]
    ratios = min(plain, plain / turned[near], key=_spread_of)
    middle, spread = float(np.median(ratios)), _spread_of(ratios)
    least = _LEAST_CHANGE if found.is_still else _LEAST_MOVING
    has_gone = not found.is_still and abs(found.growth) > _LEAST_MOVING
    factor = middle * (1 + found.growth) if has_gone else middle
    is_one = np.mean(np.abs(ratios - middle) < max(3 * spread, 0.01)) > _MOST and spread < _LEAST_SURE
    changed = least < min(abs(middle - 1), abs(factor - 1)) and abs(factor - 1) < _MOST_CHANGE
    return Line(factor, 0.0) if is_one and changed else Line()


def _spread_of(ratios: NDArray[np.float64]) -> float:
    """Return the deviation of ratios by their middle distance from the middle."""
    return 1.4826 * float(np.median(np.abs(ratios - np.median(ratios))))
