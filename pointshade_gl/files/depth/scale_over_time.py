"""One scale for the depth of a whole film, where a network gives each picture its own."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import option
from ...scene.camera import Camera
from .depth_kinds import METRIC, Decoded

WIDE = 160  # pixels of the small copies
_BLOCK = 8  # pixels of a block's side
_REACH, _FAR_REACH = 3, 6  # pixels around a likely place in which a block is looked for, and around another one
_NOISE, _UNLIKE = 0.012, 0.06  # colours that differ by so much are alike in any case; by more they never are
_GAIN = (0.5, 2.0)  # of the exposure between two pictures
_STEEP = 0.12  # of the values' range inside a pixel of the small copy: an edge, which does not vote
_MOVED = 0.1  # of the blocks: fewer moved nowhere
_SURELY = 0.5  # of the blocks were found where they were likely: no other place is tried
_BORDER = 80  # pixels around the earlier picture in which nothing is found
_FEWEST = 60  # points


class MatchedPairs(NamedTuple):
    """Values where colours agree: of the picture, of the earlier one, and what a turn made of these (n,)."""

    seen: NDArray[np.float64]
    earlier: NDArray[np.float64]
    turned: NDArray[np.float64]


@dataclass(frozen=True)
class Small:
    """A small copy: colours (h, w, 3) from 0 to 1, values (h, w), where they are known and smooth (h, w)."""

    colors: NDArray[np.float32]
    values: NDArray[np.float64]
    known: NDArray[np.bool_]

    def on_line(self, a: float, b: float) -> Small:
        """Return it with the values a v + b."""
        return Small(self.colors, a * self.values + b, self.known)


class Matched(NamedTuple):
    """How a picture agrees with an earlier one."""

    agreeing: float  # share of its blocks that are found there
    # (rows, columns, 2) how far (down, across) each block moved, in pixels of the small copies
    places: NDArray[np.int_] | None
    pairs: MatchedPairs  # values where colours agree
    is_still: bool  # whether what agrees is where it was
    growth: float = 0.0  # how much wider the earlier picture shows it, less 1


def small_copy(values: NDArray[np.floating], colors: NDArray[np.uint8] | None) -> Small:
    """Return means over squares of pixels, of a size that blocks fill."""
    height, width = values.shape
    step = max(1, round(width / WIDE))
    rows, columns = (max(1, side // step // _BLOCK) * _BLOCK for side in (height, width))
    rows, columns = min(rows, height // step), min(columns, width // step)
    squares = np.asarray(values[: rows * step, : columns * step], np.float64).reshape(rows, step, columns, step)
    squares = squares.swapaxes(1, 2).reshape(rows, columns, step * step)
    known: NDArray[np.bool_] = np.asarray(np.isfinite(squares).all(axis=2))
    squares = np.where(known[..., None], squares, 0)
    inside = squares.max(axis=2) - squares.min(axis=2)
    means = squares.mean(axis=2)
    if known.any():
        low, high = np.percentile(means[known], (2, 98))
        known &= inside <= np.maximum(_STEEP * (high - low), 4 * np.median(inside[known]))
    return Small(_small_colors(colors, (height, width), (rows, columns), step), means, known)


def _small_colors(
    colors: NDArray[np.uint8] | None, size: tuple[int, int], small: tuple[int, int], step: int
) -> NDArray[np.float32]:
    """Return the colours of the same squares; all alike without any."""
    if colors is None:
        return np.full((*small, 3), 0.5, np.float32)
    from PIL import Image

    ratio = colors.shape[0] / size[0], colors.shape[1] / size[1]
    box = 0, 0, small[1] * step * ratio[1], small[0] * step * ratio[0]
    picture = Image.fromarray(np.ascontiguousarray(colors[..., :3]))
    return np.asarray(picture.resize((small[1], small[0]), Image.Resampling.BOX, box), np.float32) / np.float32(255)


def matched(small: Small, earlier: Small, likely: NDArray[np.int_] | None, focal: float) -> Matched:
    """Look for the blocks of a picture in an earlier one; likely: `Matched.places` of the picture before."""
    nothing = Matched(0.0, None, MatchedPairs(*np.empty((3, 0))), False)
    if small.colors.shape != earlier.colors.shape or min(small.values.shape) < _BLOCK:
        return nothing
    blocks = tuple(side // _BLOCK for side in small.values.shape)
    found = nothing._replace(agreeing=-1.0)
    if likely is not None:
        found = _blocks_at(small, earlier, likely, focal, _REACH)
    for shift in {(0, 0), _phase_shift(small.colors, earlier.colors)} if found.agreeing < _SURELY else ():
        again = _blocks_at(small, earlier, np.broadcast_to(np.array(shift), (*blocks, 2)), focal, _FAR_REACH)
        found = again if again.agreeing > found.agreeing else found
    return found


def _phase_shift(colors: NDArray[np.float32], earlier: NDArray[np.float32]) -> tuple[int, int]:
    """Return (down, across) of the whole picture (phase correlation, Kuglin and Hines 1975)."""
    grey = [picture.mean(axis=2, dtype=np.float64) for picture in (colors, earlier)]
    fade = np.outer(*(np.hanning(side + 2)[1:-1] for side in grey[0].shape))  # to the borders
    one, other = ((picture - picture.mean()) * fade for picture in grey)
    cross = np.fft.rfft2(other) * np.conj(np.fft.rfft2(one))
    peaks = np.fft.irfft2(cross / np.maximum(np.abs(cross), 1e-9), s=one.shape)
    down, across = np.unravel_index(int(np.argmax(peaks)), peaks.shape)
    rows, columns = one.shape
    return int(down) - rows * (2 * int(down) > rows), int(across) - columns * (2 * int(across) > columns)


def _blocks_at(small: Small, earlier: Small, likely: NDArray[np.int_], focal: float, reach: int) -> Matched:
    rows, columns = small.values.shape
    v, u = np.mgrid[:rows, :columns]
    near = [at + _spread(likely[..., k]) for k, at in enumerate((v, u))]
    there = [np.clip(at, 0, side - 1) for at, side in zip(near, (rows, columns), strict=True)]
    one, at_likely = small.colors.mean(axis=2), earlier.colors[there[0], there[1]].mean(axis=2)
    both = (one > 0.04) & (at_likely > 0.04) & (one < 0.97) & (at_likely < 0.97)
    gain = float(np.clip(np.median(at_likely[both] / one[both]), *_GAIN)) if both.sum() > _FEWEST else 1.0
    seen = small.colors * np.float32(gain)
    grey, other = seen.mean(axis=2), np.pad(earlier.colors.mean(axis=2), _BORDER, constant_values=np.inf)
    span = 2 * reach + 1
    costs = np.empty((span, span, rows // _BLOCK, columns // _BLOCK))
    for k, j in np.ndindex(span, span):
        y, x = (np.clip(at + step - reach + _BORDER, 0, side + 2 * _BORDER - 1)
                for at, step, side in zip(near, (k, j), (rows, columns), strict=True))  # fmt: skip
        costs[k, j] = _block_means(np.abs(grey - other[y, x]))
        costs[k, j] += 1e-5 * max(abs(k - reach), abs(j - reach))  # nothing to see: as the others
    places, fine = _best_places(costs, likely)
    y, x = (at + _spread(places[..., k]) for k, at in enumerate((v, u)))
    inside = (y >= 0) & (y < rows) & (x >= 0) & (x < columns)
    y, x = np.where(inside, y, 0), np.where(inside, x, 0)
    off = np.where(inside, np.abs(seen - earlier.colors[y, x]).mean(axis=2), np.inf)
    cost = _block_means(off)
    known = cost[np.isfinite(cost)]
    limit = min(max(2.5 * np.percentile(known, 25), _NOISE), _UNLIKE) if known.size else _NOISE
    agreeing = cost < limit
    good = _spread(agreeing) & (off < 2 * limit) & small.known & earlier.known[y, x]
    is_still = bool(agreeing.any()) and places[agreeing].any(axis=1).mean() < _MOVED
    found, here = (small.values[good], earlier.values[y, x][good]), (v[good], u[good])
    moved = [_spread(fine[..., k])[good] for k in range(2)]
    turned = np.ones(found[0].size) if is_still else _turned(here, moved, focal, (rows, columns))
    if agreeing.any():
        places = np.where(agreeing[..., None], places, np.median(places[agreeing], axis=0).astype(int))
    return Matched(float(agreeing.mean()), places, MatchedPairs(*found, turned), is_still, _growth(here, moved))


def _spread(blocks: NDArray[Any]) -> NDArray[Any]:
    return np.repeat(np.repeat(blocks, _BLOCK, axis=0), _BLOCK, axis=1)


def _best_places(costs: NDArray[np.float64], likely: NDArray[np.int_]) -> tuple[NDArray[np.int_], NDArray[np.float64]]:
    """Return (rows, columns, 2) where each block is found: in whole pixels, and between them by a parabola."""
    span, _, rows, columns = costs.shape
    k, j = np.divmod(costs.reshape(span * span, rows, columns).argmin(axis=0), span)
    places = likely + np.stack([k, j], axis=2) - span // 2
    fine = places.astype(np.float64)
    v, u = np.mgrid[:rows, :columns]
    for axis, at in enumerate((k, j)):
        near = [np.clip(at + step, 0, span - 1) for step in (-1, 0, 1)]
        low, middle, high = (costs[(one, j, v, u) if axis == 0 else (k, one, v, u)] for one in near)
        with np.errstate(all="ignore"):
            off = (low - high) / (2 * (low - 2 * middle + high))
        fine[..., axis] += np.where(np.isfinite(off) & (at > 0) & (at < span - 1), np.clip(off, -0.5, 0.5), 0)
    return places, fine


def _turned(
    here: tuple[NDArray[np.int_], NDArray[np.int_]], moved: list[NDArray[np.float64]], focal: float,
    size: tuple[int, int],
) -> NDArray[np.float64]:  # fmt: skip
    """Return (n,) how much of a point's distance lies along the axis now, if a turn of the camera moved it."""
    share, pixel = np.ones(here[0].size), 1 / (focal * size[1])
    for at, step, side in zip(here, moved, size, strict=True):
        x, y = (at - (side - 1) / 2) * pixel, (at + step - (side - 1) / 2) * pixel
        angles = np.arctan(y) - np.arctan(x)
        turn = float(np.median(angles)) if angles.size else 0.0
        near = np.abs(angles - turn) <= max(3 * pixel, abs(turn))
        turn = float(angles[near].mean()) if near.any() else turn
        share = share * (np.cos(turn) - x * np.sin(turn))
    return share


def _growth(here: tuple[NDArray[np.int_], NDArray[np.int_]], moved: list[NDArray[np.float64]]) -> float:
    """Return how much farther apart points are after they moved, less 1."""
    off = [one - one.mean() for one in here] if here[0].size else [np.zeros(1)] * 2
    spread = sum(float(one @ one) for one in off)
    return sum(float(one @ step) for one, step in zip(off, moved, strict=True)) / spread if spread > 0 else 0.0


def _block_means(values: NDArray[np.floating]) -> NDArray[np.floating]:
    rows, columns = values.shape
    return values.reshape(rows // _BLOCK, _BLOCK, columns // _BLOCK, _BLOCK).mean(axis=(1, 3))


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


class Line(NamedTuple):
    """w = a v + b: values of one picture in those of the shot's first."""

    a: float = 1.0
    b: float = 0.0
    is_first: bool = False  # of a shot


@dataclass
class FrameScale:
    """Follows a film: `of` gives the line of each picture, which must come in their order."""

    focal: float = 0.87  # length in widths of the picture
    is_inverse: bool = True  # whether values are inverse depth, up to a line
    is_metric: bool = False  # whether they are metres, of which the factor alone may change, by up to a tenth
    may_move: bool = True  # whether that is looked for where the camera moves, too
    _infinity: FarOffset = field(default_factory=lambda: FarOffset())
    _earlier: list[Small] = field(default_factory=list)
    _last: Small | None = None
    _places: NDArray[np.int_] | None = None  # where blocks are likely: as far on as from the picture before
    _before: NDArray[np.int_] | None = None
    _turns: int = 0  # pictures that showed a turn of the camera, less those that showed none
    _origin: float = 0.0  # of the shot's first values, and their range: lines are fitted in these units
    _unit: float = 1.0

    def of(self, values: NDArray[np.floating], colors: NDArray[np.uint8] | None) -> Line:
        """Return the line of the next picture: values (h, w), not finite where unknown, colours (h', w', 3)."""
        small = small_copy(values, colors)
        line = self._line(small)
        if not line.is_first:
            self._last = small.on_line(line.a, line.b)
            return Line(line.a * self._unit, line.b * self._unit + self._origin)
        known = small.values[small.known] if small.known.any() else np.array([0.0, 1.0])
        low, high = (0.0, 1.0) if self.is_metric else np.percentile(known, (2, 98))
        self._origin, self._unit = float(low), float(high - low) or 1.0
        self._last = small.on_line(1 / self._unit, -self._origin / self._unit)
        self._earlier, self._places, self._before, self._infinity = [self._last], None, None, FarOffset()
        self._turns = 0
        return Line(is_first=True)

    def _line(self, small: Small) -> Line:
        if self._last is None:
            return Line(is_first=True)
        at_hand, count = self._earlier[-1], len(self._earlier)
        found = matched(small, at_hand, self._places, self.focal)
        if found.agreeing < _ENOUGH:
            found = self._other(small, found)
        is_same = len(self._earlier) == count and self._earlier[-1] is at_hand
        goes_on = is_same and found.places is not None and self._before is not None  # as it did
        self._places = 2 * found.places - self._before if goes_on else found.places  # type: ignore[operator]
        self._before = found.places
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

    def _beyond(self, pairs: MatchedPairs, infinity: FarOffset) -> Line | None:
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
class FarOffset:
    """What infinity has in the values of a shot, in its units, as its pictures have shown; a guess until then."""

    weight: float = 0.0
    total: float = 0.0

    @property
    def value(self) -> float:
        return (self.total + _DOUBT * _USUAL) / (self.weight + _DOUBT)

    def learned(self, pairs: MatchedPairs, line: Line) -> FarOffset:
        """Return it with what one turn shows: w = a v / r + b / r + o."""
        off = (pairs.earlier - self.value) * pairs.turned - (line.a * pairs.seen + line.b)
        near = np.abs(off) <= _NEAR * 1.4826 * max(float(np.median(np.abs(off))), 1e-9)
        v, w, r = pairs.seen[near], pairs.earlier[near], pairs.turned[near]
        terms = np.stack([v / r, 1 / r, np.ones_like(r)], axis=1)
        try:
            inverse = np.linalg.inv(terms.T @ terms)
        except np.linalg.LinAlgError:
            return self
        found = float((inverse @ (terms.T @ w))[2])
        sigma = float(np.std(w - terms @ (inverse @ (terms.T @ w))))
        certain = 1 / max(float(inverse[2, 2]) * sigma**2, 1e-12)
        return FarOffset(self.weight + certain, self.total + certain * found)


def fitted_line(seen: NDArray[np.float64], earlier: NDArray[np.float64]) -> Line | None:
    """Return the rising line that most pairs of values obey, near ones counting like far ones; None if none does."""
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
    return 1 / np.maximum(np.bincount(places, minlength=_RANGES), values.size * _RARE)[places]


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
    """Return the factor of metres that breathe; exactly 1 where the change is none, or may be of the world."""
    seen, earlier, turned = found.pairs
    near = (seen > 0) & (earlier > 0)
    if near.sum() < _FEWEST:
        return Line()
    plain = earlier[near] / seen[near]
    ratios = min(plain, plain / turned[near], key=_spread_of)
    middle, spread = float(np.median(ratios)), _spread_of(ratios)
    least = _LEAST_CHANGE if found.is_still else _LEAST_MOVING
    has_gone = not found.is_still and abs(found.growth) > _LEAST_MOVING
    # who goes ahead sees all grow as its distance shrinks: the product of both does not change
    factor = middle * (1 + found.growth) if has_gone else middle
    is_one = np.mean(np.abs(ratios - middle) < max(3 * spread, 0.01)) > _MOST and spread < _LEAST_SURE
    changed = least < min(abs(middle - 1), abs(factor - 1)) and abs(factor - 1) < _MOST_CHANGE
    return Line(factor, 0.0) if is_one and changed else Line()


def _spread_of(ratios: NDArray[np.float64]) -> float:
    """Return the deviation of ratios by their middle distance from the middle."""
    return 1.4826 * float(np.median(np.abs(ratios - np.median(ratios))))


ScaleName = Literal["auto", "keep"]
SCALES: tuple[ScaleName, ...] = get_args(ScaleName)


_PATIENCE = 8  # pictures


class ScaledFrame(NamedTuple):
    """How a picture's values become metres: those at the two ends of depth without a scale, or a factor."""

    low: float = 0.0
    high: float = 0.0
    factor: float = 1.0

    @property
    def ends(self) -> tuple[float, float] | None:
        return (self.low, self.high) if self.high > self.low else None


class FilmScale:
    """The scale of each picture of a film. From any thread.

    may_breathe   whether metres may be a network's
    is_networks   whether they surely are: then they breathe while the camera moves, too
    """

    def __init__(self, may_breathe: bool, is_networks: bool, note: Note):
        self.lock = threading.RLock()
        self._may_breathe, self._is_networks, self._note = may_breathe, is_networks, note
        self._follower: FrameScale | None = None
        self._found: list[ScaledFrame] = []
        self._first = ScaledFrame()
        self.is_over = False  # nothing to follow: depth has a scale

    def of(
        self, index: int, decoded: Decoded, colors: NDArray[Any] | None, camera: Camera, read: Callable[[int], object]
    ) -> ScaledFrame:
        """Return how to lay the depth of a picture, by its number; read: reads an earlier one, which comes here."""
        if not self.is_over and not self._found and index == 0:
            self._begin(decoded)
        for before in range(len(self._found), index):
            if self.is_over or len(self._found) > before:
                continue
            try:
                read(before)
            except (ValueError, OSError):  # it is passed over
                self._found.append(self._found[-1] if self._found else ScaledFrame())
        if self.is_over:
            return ScaledFrame()
        if index == len(self._found):
            self._found.append(self._next(index, decoded, colors, camera))
        return self._found[index]

    def _begin(self, decoded: Decoded) -> None:
        coding = decoded.coding
        is_relative = coding.scale is None and coding.kind in ("z", "inverse")
        is_floating = decoded.values.dtype.kind == "f" and coding.kind in METRIC
        self.is_over = not (is_relative or (is_floating and self._may_breathe))
        is_inverse, may_move = coding.kind == "inverse", self._is_networks
        self._follower = FrameScale(is_inverse=is_inverse, is_metric=not is_relative, may_move=may_move)
        if is_relative:
            self._note(
                "each frame's depth has a scale of its own: one is found for all, from what does not change; "
                f"pass {option('scale_frames', 'keep')} to leave each as it is"
            )

    def _next(self, index: int, decoded: Decoded, colors: NDArray[Any] | None, camera: Camera) -> ScaledFrame:
        if self._follower is None:  # the first ones could not be read
            self._begin(decoded)
        assert self._follower is not None
        self._follower.focal = abs(camera.fx) / camera.width
        values = np.asarray(decoded.values, np.float32)
        unknown = ~np.isfinite(values) if not self._follower.is_metric else ~(np.isfinite(values) & (values > 0))
        line = self._follower.of(np.where(unknown, np.float32(np.nan), values), colors)
        if self._follower.is_metric:
            # metres that do not breathe at first are followed no further: nobody then waits for earlier frames
            is_steady = line.a == 1 and all(one.factor == 1 for one in self._found)
            self.is_over = is_steady and not self._is_networks and index >= _PATIENCE
            return ScaledFrame(factor=line.a)
        if line.is_first:
            if index:
                self._note(f"frame {index} begins another shot: its depth has a scale of its own")
            known = values[~unknown]
            self._first = ScaledFrame(float(known.min()), float(known.max())) if known.size else ScaledFrame()
            return self._first
        return ScaledFrame((self._first.low - line.b) / line.a, (self._first.high - line.b) / line.a)
