"""Judges the poses of several frames, on reduced copies of them, by how well they agree; finds wrong ones."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scene.camera import Camera
from .multi_view import NARROWEST, SPREADS, Comparison

# Two frames contradict each other if more than this share of their points does: between these two, and so many times
# the usual share of the set, which noise raises
LEAST, MOST, USUAL = 0.1, 0.5, 2.0
CLEARLY = 0.3  # with fewer, something may have moved; then a wrong pose shows in the spread of all other points, too
Pair = tuple[int, int]


class Contradictions(NamedTuple):
    """Which frames' depths contradict those of others, where both see the same."""

    frames: frozenset[int]  # that fit none of the others, of which more fit each other
    undecided: bool  # whether others contradict each other, and nobody knows which are wrong


def contradictions(comparisons: Mapping[Pair, Comparison], count: int) -> Contradictions:
    """Find the frames with wrong poses, from comparisons of pairs (i, j).

    Frames that agree form groups. A frame is wrong if it contradicts a group with more members than contradict it.
    """
    contradicts, agreed = _contradicts(comparisons), np.zeros((count, count), bool)
    for pair, is_off in contradicts.items():
        agreed[pair] = agreed[pair[::-1]] = not is_off
    groups = _groups(agreed)
    against = [pair for pair, is_off in contradicts.items() if is_off and not groups[pair]]
    wrong: set[int] = set()
    for group in groups:
        opponents = {other for i, j in against for one, other in ((i, j), (j, i)) if group[one]}
        wrong |= opponents if group.sum() > len(opponents) else set()
    return Contradictions(frozenset(wrong), any(i not in wrong and j not in wrong for i, j in against))


def _contradicts(comparisons: Mapping[Pair, Comparison]) -> dict[Pair, bool]:
    """Return, for each pair of frames that see the same, whether they contradict each other."""
    both_ways: dict[Pair, list[Comparison]] = {}
    for (i, j), one in comparisons.items():
        both_ways.setdefault((min(i, j), max(i, j)), []).append(one)
    known = {pair: ways for pair, ways in both_ways.items() if np.isfinite([one.apart for one in ways]).any()}
    if not known:
        return {}
    # what lies nearer than a frame expects hides the rest from it: only the other frame can show it
    aparts = np.array([np.nanmax([one.apart for one in ways]) for ways in known.values()])
    spreads = np.array([min(one.spread for one in ways) for ways in known.values()])
    is_apart = aparts > np.clip(USUAL * np.quantile(aparts, 0.25, method="lower"), LEAST, MOST)
    is_spread = spreads > USUAL * max(np.quantile(spreads, 0.25, method="lower"), NARROWEST / SPREADS)
    return dict(zip(known, (is_apart & (is_spread | (aparts > CLEARLY))).tolist(), strict=True))


def _groups(linked: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return, (n, n), which of n things hang together, each with itself too. linked: (n, n), which pairs do."""
    groups = np.eye(len(linked), dtype=bool) | linked
    for _ in range(len(linked).bit_length()):
        groups = groups @ groups
    return groups


LONGER_SIDE = 320  # pixels of the copy, about
BLURS = 3  # how often the brightness is blurred, each time twice as wide
LEAST_NOISE = 0.015  # of brightness: what a compressed picture shows where there is nothing
FLAT = 0.001  # contrast of brightness that is none, where noise was rounded away
_KERNEL = np.array([1, 4, 6, 4, 1], np.float32) / 16
_IMPULSE = np.zeros((65, 65), np.float32)
_IMPULSE[32, 32] = 1
Floats = NDArray[np.float32]


class Brightness(NamedTuple):
    """Blurred brightness and its slope."""

    maps: Floats  # (h * w, 3): the brightness, its change to the next column, and to the next row
    slope_noise: float  # standard deviation of either slope on a surface of one colour

    @property
    def value(self) -> Floats:
        """Return the brightness alone, (h * w,)."""
        return self.maps[:, 0]


class ReducedFrame:
    """What a frame's pose is found from.

    camera      of the reduced picture, (h, w)
    points      (h * w, 3) float32, camera axes
    normals     (h * w, 3) float32, unit, camera axes; 0 where the point is not used: missing, at a step, seen flat
    brightness  (h, w) float32, square root of the linear luminance, 0 to 1; None without colours
    """

    def __init__(self, camera: Camera, surface: Floats, brightness: Floats | None):
        """surface: (h, w, 4), unit normal and depth, 0 where the point is not used."""
        self.camera, self.brightness = camera, brightness
        depth = surface[..., 3:]
        self.points = (camera.rays().astype(np.float32) * depth).reshape(-1, 3)
        self.normals = np.where(depth > 0, surface[..., :3], np.float32(0)).reshape(-1, 3)
        self._is_known = depth.reshape(-1) > 0
        self._samples: dict[int, NDArray[np.intp]] = {}

    @cached_property
    def planes(self) -> Floats:
        """Return each point's normal and the distance of its plane from the camera, (h * w, 4)."""
        distances = np.einsum("nk,nk->n", self.normals, self.points)
        return np.concatenate([self.normals, distances[:, None]], -1)

    @property
    def points_known(self) -> int:
        """Return the number of points that are used."""
        return int(np.count_nonzero(self._is_known))

    @cached_property
    def middle(self) -> NDArray[np.float64]:
        """Return the median of the points, (3,) camera axes; 0 without any."""
        known = self.points[self._is_known]
        return np.median(known, axis=0).astype(np.float64) if len(known) else np.zeros(3)

    @cached_property
    def radius(self) -> float:
        """Return the median distance of the points from their middle; 0 without any."""
        known = self.points[self._is_known]
        return float(np.median(np.linalg.norm(known - self.middle, axis=1))) if len(known) else 0.0

    @cached_property
    def is_textured(self) -> bool:
        """Return whether there is more in the brightness than noise."""
        if self.brightness is None:
            return False
        return float(np.quantile(np.abs(self.texture), 0.9)) > self._noise + FLAT

    def samples(self, step: int) -> NDArray[np.intp]:
        """Return the numbers of the points that are used, on every step-th column and row."""
        if step not in self._samples:
            is_known = self._is_known.reshape(self.camera.height, self.camera.width)
            v, u = np.nonzero(is_known[step // 2 :: step, step // 2 :: step])
            self._samples[step] = (v * step + step // 2) * self.camera.width + u * step + step // 2
        return self._samples[step]

    def pixels(self, at: NDArray[np.floating]) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
        """Return the pixels in which points (..., 3) in camera axes are seen, 0 outside, and whether inside, (...)."""
        camera = self.camera
        with np.errstate(all="ignore"):
            u, v = (np.rint(place) for place in camera.pixel_at(at[..., 0], at[..., 1], at[..., 2]))
            inside = (at[..., 2] > 0) & (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height)
            return np.where(inside, v * camera.width + u, 0).astype(np.intp), inside

    @cached_property
    def blurred(self) -> list[Brightness]:
        """Return the brightness, which must be known, at each level of blur."""
        assert self.brightness is not None
        levels = []
        for shown, impulse in zip(_blurs(self.brightness), _blurs(_IMPULSE), strict=True):
            along_v, along_u = np.gradient(shown)
            gain = float(np.sqrt((np.gradient(impulse, axis=1) ** 2).sum()))
            levels.append(Brightness(np.stack([shown, along_u, along_v], -1).reshape(-1, 3), gain * self._noise))
        return levels

    @cached_property
    def texture(self) -> Floats:
        """Return the brightness without what is finer or coarser than some pixels, (h * w,). It must be known."""
        return self.blurred[0].value - self.blurred[-1].value

    @cached_property
    def texture_noise(self) -> float:
        """Return the standard deviation of the texture of a surface of one colour."""
        finest, *_, coarsest = _blurs(_IMPULSE)
        return float(np.sqrt(((finest - coarsest) ** 2).sum())) * max(self._noise, LEAST_NOISE)

    @cached_property
    def _noise(self) -> float:
        """Return the standard deviation of the brightness's noise, from the median size of its second differences."""
        if self.brightness is None:
            return 0.0
        rows = self.brightness[:-2] - 2 * self.brightness[1:-1] + self.brightness[2:]
        # the mask of Immerkaer 1996 hardly answers to structure; the median leaves out where it does
        mask = rows[:, :-2] - 2 * rows[:, 1:-1] + rows[:, 2:]
        return 1.4826 * float(np.median(np.abs(mask))) / 6 if mask.size else 0.0


def _blurs(picture: Floats) -> list[Floats]:
    """Return a picture at each level of blur: each blurs the last one by five weights with gaps (a trous) between."""
    levels = []
    for gap in (1 << level for level in range(BLURS)):
        for axis in (0, 1):
            pad = [(2 * gap, 2 * gap) if k == axis else (0, 0) for k in range(2)]
            wide, count = np.pad(picture, pad, "edge"), picture.shape[axis]
            parts = (wide.take(range(k * gap, k * gap + count), axis) for k in range(5))
            picture = sum(weight * part for weight, part in zip(_KERNEL, parts, strict=True))  # type: ignore[assignment]
        levels.append(picture)
    return levels


LEAST_COSINE = 0.7  # between the normals of two points that may be the same
DARKEST, BRIGHTEST = 0.1, 0.97  # brightness beyond which nothing is compared: clipped, or only noise
FEWEST = 20  # of values of which a median is trusted
Array = NDArray[np.floating]


class PlacedFrame(NamedTuple):
    """Points of a frame where its pose puts them."""

    numbers: NDArray[np.intp]  # (n,) of the points in the frame
    points: Array  # (n, 3) world
    normals: Array  # (n, 3) world


class Matches(NamedTuple):
    """Points of one frame that lie on the surface of another, n of them.

    Differences are in shares of the depth, in the first frame less the second.
    """

    numbers: NDArray[np.intp]  # (n,) of the points in their frame
    pixels: NDArray[np.intp]  # (n,) of the other frame, where they lie
    points: Array  # (n, 3) the other's, world: what is symmetric fixes no turn, exactly
    depth: Array  # (n,) z in the other frame
    apart: Array  # (n,) along the other's normal, over depth
    normals: Array  # (n, 3) the other's, world
    cosines: Array  # (n,) between both normals
    brighter: Array  # (n,) the other's brightness less the point's; NaN where not compared
    slopes: Array  # (n, 3) derivative of `brighter` by the point's place, world
    seen: int  # points of the first frame that the other should show: nothing in it lies before them


def placed(frame: ReducedFrame, pose: Array, step: int) -> PlacedFrame:
    """Return every step-th point of a frame, and of its columns, in the world. pose: (4, 4) camera-to-world."""
    numbers = frame.samples(step)
    turn = pose[:3, :3].astype(np.float32)
    points = frame.points[numbers] @ turn.T + pose[:3, 3].astype(np.float32)
    return PlacedFrame(numbers, points, frame.normals[numbers] @ turn.T)


def count_seen(points: PlacedFrame, target: ReducedFrame, pose: Array, gate: float) -> int:
    """Return how many points another frame should show, as `find_matches` counts them."""
    return int(np.count_nonzero(_project(points, target, pose).behind < gate))


def find_matches(
    points: PlacedFrame, own: Brightness | None, target: ReducedFrame, pose: Array, gate: float, level: int
) -> Matches | None:
    """Return the points that lie on the surface of another frame; None if it shows none of them.

    own    the brightness of the points' frame at this level of blur; None without colours
    pose   (4, 4) camera-to-world of the other frame
    gate   share of the depth within which a point may lie on its surface
    """
    found = _project(points, target, pose)
    if not len(found.behind):
        return None
    turn, place = pose[:3, :3].astype(np.float32), pose[:3, 3].astype(np.float32)
    near = np.flatnonzero(np.abs(found.behind) < gate)
    pixels, at, some = found.pixels[near], found.at[near], found.some[near]
    planes = target.planes[pixels]
    apart = (np.einsum("nk,nk->n", planes[:, :3], at) - planes[:, 3]) / at[:, 2]
    normals = planes[:, :3] @ turn.T
    cosines = np.einsum("nk,nk->n", normals, points.normals[some])
    kept = np.flatnonzero((np.abs(apart) < gate) & (cosines > LEAST_COSINE))
    pixels, at, numbers = pixels[kept], at[kept], points.numbers[some[kept]]
    brighter, slopes = np.full(len(kept), np.nan, np.float32), np.zeros((len(kept), 3), np.float32)
    if own is not None and target.brightness is not None:
        brighter, slopes = _brighter(own.value[numbers], target, level, pixels, at)
        slopes = slopes @ turn.T
    surface = target.points[pixels] @ turn.T + place
    result = numbers, pixels, surface, at[:, 2], apart[kept], normals[kept], cosines[kept], brighter, slopes
    return Matches(*result, int(np.count_nonzero(found.behind < gate)))


class _Projected(NamedTuple):
    """Points where another frame knows its surface, n of them."""

    some: NDArray[np.intp]  # which points
    pixels: NDArray[np.intp]
    at: Array  # (n, 3) in the other's camera axes
    behind: Array  # how far behind its surface, a share of the surface's depth


def _project(points: PlacedFrame, target: ReducedFrame, pose: Array) -> _Projected:
    turn, place = pose[:3, :3].astype(np.float32), pose[:3, 3].astype(np.float32)
    at = (points.points - place) @ turn
    pixels, inside = target.pixels(at)
    some: NDArray[np.intp] = np.flatnonzero(inside & (target.points[pixels, 2] > 0))
    pixels, at = pixels[some], at[some]
    return _Projected(some, pixels, at, at[:, 2] / target.points[pixels, 2] - 1)


def _brighter(own: Array, target: ReducedFrame, level: int, pixels: NDArray[np.intp], at: Array) -> tuple[Array, Array]:
    """Return by how much another frame is brighter than points in its pixels, exposures matched, and the slope of that.

    at (n, 3) and the slope: in its camera axes
    """
    camera, shown = target.camera, target.blurred[level].maps[pixels]
    u, v = camera.pixel_at(at[:, 0], at[:, 1], at[:, 2])
    row, column = np.divmod(pixels, camera.width)
    theirs = shown[:, 0] + shown[:, 1] * (u - column) + shown[:, 2] * (v - row)
    is_shown = (np.minimum(own, theirs) > DARKEST) & (np.maximum(own, theirs) < BRIGHTEST)
    gain = float(np.median(theirs[is_shown] / own[is_shown])) if np.count_nonzero(is_shown) >= FEWEST else 1.0
    across, along, z = at[:, 0] / at[:, 2], at[:, 1] / at[:, 2], at[:, 2]
    by_u, by_v = shown[:, 1] * camera.fx / z, shown[:, 2] * camera.fy / z
    slopes = np.stack([by_u, by_v, -(by_u * across + by_v * along)], -1).astype(np.float32)
    return np.where(is_shown, theirs - gain * own, np.nan).astype(np.float32), slopes


LEAST_SPREAD = 1e-4  # of depths that agree, a share of the depth
NARROWEST_BAND, WIDEST_BAND = 0.004, 0.03  # of the band in which two frames agree, a share of the depth
BAND_SPREADS = 3.0  # that the band holds
LEAST_AGREEMENT = 0.75  # of what two frames share must lie within the band
PLAIN_AGREEMENT = 0.96  # the same of frames that were moved far and have no texture
NEAR = 0.05  # of the scene's distance: motions that need no further proof
USUAL_AGREEMENT = 0.93  # of what is usual in the set: with less a frame is placed again
LEAST_CORRELATION = 0.4  # of two textures, a share of what their noise allows
USUAL_CORRELATION = 0.6  # of the better half of the set's pairs
TEXTURED = 0.5  # correlation that noise allows from which on there is a texture to speak of
Matrix = NDArray[np.float64]


class Judgement(NamedTuple):
    """How well frames agree, one value for each."""

    agreement: Matrix  # share of what is shared with others that lies within the band
    grouped: NDArray[np.bool_]  # whether it hangs together with an anchor by pairs that fit
    is_far: NDArray[np.bool_]  # whether it was moved so far that its pose needs more proof
    overlap: Matrix  # share of its points that the other frame with most of them should show
    each: Matrix  # spread of the depths' differences; NaN without overlap
    spread: float  # of depths where frames agree
    correlation: float  # of textures near the given poses, a share of what noise allows; NaN without any

    def is_weak(self) -> NDArray[np.bool_]:
        """Return which frames agree too little, by themselves or beside the others."""
        return self.agreement < max(LEAST_AGREEMENT, USUAL_AGREEMENT * float(np.median(self.agreement)))

    def is_doubtful(self) -> NDArray[np.bool_]:
        """Return which frames another pose may fit better."""
        return (self.is_weak() | ~self.grouped) & (self.overlap > 0)

    def is_wrong(self) -> NDArray[np.bool_]:
        """Return which frames do not belong where they are."""
        return ((self.is_weak() & self.is_far) | ~self.grouped) & (self.overlap > 0)


def judge(
    found: Sequence[tuple[int, int, Matches]],  # of frame i in frame j: i, j, matches
    frames: Sequence[ReducedFrame],
    points: Sequence[int],  # of each frame that were looked for in the others
    anchors: Collection[int],  # numbers of the frames whose poses are right
    moved: Matrix,  # (n, n) how far pairs of frames were moved against each other, a share of the scene's distance
    spread: float | None,  # of depths where frames agree; None measures it, where each frame agrees best
) -> Judgement:
    """Return how well frames agree."""
    count = len(points)
    seen, agree = np.zeros((2, count, count))  # of pairs, both ways together
    textures = np.zeros((5, count, count))  # see _texture_sums
    apart: dict[tuple[int, int], list[NDArray[np.floating]]] = {}
    overlap = np.zeros(count)
    for i, j, one in found:
        apart.setdefault((min(i, j), max(i, j)), []).append(one.apart)
        overlap[i] = max(overlap[i], one.seen / points[i])
    spreads = {pair: spread_of(values, LEAST_SPREAD) for pair, values in apart.items()}
    if spread is None:
        best = [min((one for pair, one in spreads.items() if k in pair), default=np.nan) for k in range(count)]
        spread = float(np.nanmedian(best)) if np.isfinite(best).any() else LEAST_SPREAD
    band = min(max(BAND_SPREADS * spread, NARROWEST_BAND), WIDEST_BAND)
    for i, j, one in found:
        both = ([i, j], [j, i])
        seen[both] += one.seen
        agree[both] += np.count_nonzero(np.abs(one.apart) < band)
        textures[:, both[0], both[1]] += _texture_sums(frames[i], frames[j], one)[:, None]
    shares = agree / np.maximum(seen, 1)
    fits, correlation = _fit(shares, textures, moved)
    agreement = agree.sum(0) / np.maximum(seen.sum(0), 1)
    each = [[one for pair, values in apart.items() if k in pair for one in values] for k in range(count)]
    each = np.array([spread_of(values, 0.0) if values else np.nan for values in each])
    is_far = moved[:, list(anchors)].min(1) >= NEAR
    return Judgement(agreement, connected(fits, anchors), is_far, overlap, each, spread, correlation)


def _texture_sums(frame: ReducedFrame, other: ReducedFrame, one: Matches) -> Matrix:
    """Return sums over matches: of the product of both textures, of their squares, and of their noises' squares."""
    if frame.brightness is None or other.brightness is None or not len(one.numbers):
        return np.zeros(5)
    own, theirs = frame.texture[one.numbers].astype(np.float64), other.texture[one.pixels].astype(np.float64)
    noises = len(own) * np.array([frame.texture_noise**2, other.texture_noise**2])
    return np.array([own @ theirs, own @ own, theirs @ theirs, *noises])


def _fit(shares: Matrix, textures: Matrix, moved: Matrix) -> tuple[NDArray[np.bool_], float]:
    """Return which pairs of frames agree as only right poses make them, and how their textures correlate."""
    # a floor slides along itself unseen, and so does a wall beside it: far from the given pose textures must agree, too
    product, own, theirs, own_noise, their_noise = textures
    squares = np.maximum(own * theirs, 1e-30)
    signal = np.maximum(own - own_noise, 0) * np.maximum(theirs - their_noise, 0)
    possible = np.sqrt(signal / squares)
    correlation = product / np.sqrt(squares) / np.maximum(possible, 1e-9)
    textured, is_near = possible >= TEXTURED, moved < NEAR
    agree = shares >= max(LEAST_AGREEMENT, USUAL_AGREEMENT * _better_half(shares[shares > 0]))
    alike = correlation >= max(LEAST_CORRELATION, USUAL_CORRELATION * _better_half(correlation[textured]))
    proven = np.where(textured, agree & alike, shares >= PLAIN_AGREEMENT)
    some = textured & is_near & (shares >= LEAST_AGREEMENT)
    usual = float(product[some].sum() / np.sqrt(signal[some]).sum()) if some.any() else np.nan
    return np.where(is_near, shares >= LEAST_AGREEMENT, proven), usual


def _better_half(values: Matrix) -> float:
    """Return the median of the better half of values, 0 without any."""
    return float(np.quantile(values, 0.75)) if len(values) else 0.0


def connected(linked: NDArray[np.bool_], anchors: Collection[int]) -> NDArray[np.bool_]:
    """Return which of n things hang together with some of them. linked: (n, n)."""
    return np.any(_groups(linked)[list(anchors)], axis=0)


def spread_of(values: Sequence[NDArray[np.floating]], least: float) -> float:
    """Return the standard deviation of what agrees, by the median size of all; NaN does not count."""
    every = np.abs(np.concatenate(values)) if len(values) else np.zeros(0)
    every = every[np.isfinite(every)]
    return max(1.4826 * float(np.median(every)), least) if len(every) else max(least, 1e-9)
