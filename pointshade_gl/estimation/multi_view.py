"""Weighs several frames of one object against each other, and merges their points."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scene.camera import moved
from ..scene.frame import Frame
from ..scene.noise import Choice

COMPARED = 16  # others that a frame is compared with, at most: those seen from nearest by
NARROWEST, WIDEST = 0.004, 0.04  # of the band, a share of 1/z
FINEST = 0.0005  # of frames without noise, where they are compared pixel by pixel
SPREADS = 3.0  # of the differences between frames that the band holds
FARTHEST = 0.1  # a greater difference is another surface
FEWEST = 20  # samples that are enough for a median
LEAST_GAIN = 0.01  # log of a difference in exposure that is worth correcting
PRIMARY = 3  # views that carry the picture
FADING = 2.5  # times as far as these, others have faded out
FAINT = 0.02  # their weight then
BESIDE_ONE = 0.1  # so near to a frame without noise, in units of `distances`, others begin to fade
DISSOLVED = 0.8  # weight at which none of a view's splats is primary any more
STEADY = 0.05  # by which share the band may differ from the one that was voted with, before all is voted again
APART = 0.02  # of the depth: a surface that lies so much farther than a point contradicts it
JUDGED = 0.2  # of the samples that two frames share, those that neither hides from the other, at least
NO_OVERLAP = 1e29  # what is greater stands for it, see view_difference.frag
DARKER = 0.99  # share of a frame that is not darker than others by more than noise
LEAST_EXCESS = 1.5  # steps of 255: what is brighter by less is no highlight
Matrix = NDArray[np.float64]


class SetReport(NamedTuple):
    """What was found out about n frames that are drawn as one object."""

    choices: tuple[Choice, ...]  # what estimated each frame's normals
    band: float  # share of 1/z within which two frames see the same surface
    gains: NDArray[np.float64]  # (n, 3) what each frame's linear colours are multiplied by
    points: NDArray[np.int64]  # (n,) points of each frame
    distrusted: NDArray[np.int64]  # (n,) how many of them are not trusted
    importances: NDArray[np.float64]  # (n,) weights of the frames in the picture, 1 if primary


class Comparison(NamedTuple):
    """How one frame's depth and colours differ from another's where both see the same."""

    spread: float  # standard deviation of the depths' differences, as a share of the depth; infinite without overlap
    log_ratios: NDArray[np.float64]  # (3,) of linear colours; NaN where unknown
    apart: float = np.nan  # share of the points that the other should see, and sees through; NaN where unknown


def compared(samples: NDArray[np.float32], colored: bool = True) -> Comparison:
    """Summarise the differences between two frames by their medians.

    samples  (n, 4) from view_difference.frag: relative excess of the other frame's depth, log ratios of three colours
    colored  False where a frame has no colours: then the ratios mean nothing
    """
    excess = samples[:, 0]
    shared = excess < NO_OVERLAP
    judged = shared & (excess > -APART)  # what lies behind a surface is hidden from it
    # the share of points that float before what the other frame sees there
    enough = judged.sum() >= max(FEWEST, JUDGED * shared.sum())
    apart = float((excess[judged] > APART).mean()) if enough else np.nan
    close = np.abs(excess) < FARTHEST
    if close.sum() < FEWEST:
        return Comparison(np.inf, _fixed([np.nan] * 3), apart)
    near = samples[close].astype(np.float64)
    spread = 1.4826 * float(np.median(np.abs(near[:, 0])))
    ratios = [channel[np.abs(channel) < 10] for channel in near[:, 1:].T]
    known = [float(np.median(ratio)) if len(ratio) >= FEWEST and colored else np.nan for ratio in ratios]
    return Comparison(spread, _fixed(known), apart)


def _fixed(values: list[float]) -> NDArray[np.float64]:
    """Return a read-only array: steps recognise it by identity, since NaN never equals itself."""
    array = np.array(values)
    array.flags.writeable = False
    return array


def distances(frames: Sequence[Frame], pose: Matrix) -> NDArray[np.float64]:
    """Return, (n,), how differently each frame's camera saw the scene from one at this pose."""
    there = np.linalg.inv(pose) @ np.stack([frame.pose for frame in frames])
    turns = np.arccos(np.clip((np.trace(there[:, :3, :3], axis1=1, axis2=2) - 1) / 2, -1, 1))
    # radians, and ways over the frame's median depth
    return turns + np.linalg.norm(there[:, :3, 3], axis=1) / np.array([frame.scale for frame in frames])


def nearest_others(frames: Sequence[Frame]) -> list[list[int]]:
    """Return, for each frame, the numbers of those it is compared with: taken from nearby, nearest first."""
    found = []
    for k, frame in enumerate(frames):
        order = np.argsort(distances(frames, frame.pose), kind="stable")
        found.append([int(other) for other in order if other != k][:COMPARED])
    return found


def band_of(
    comparisons: Mapping[tuple[int, int], Comparison], before: float | None = None, narrowest: float = NARROWEST
) -> float:
    """Return the depth tolerance: by which share of 1/z two frames may differ on the same surface.

    It is estimated from the frames' own differences, so it covers noise and errors of poses without being given them.
    That of the time before stays if it is nearly right, because a new one repeats all votes.
    """
    spreads = [one.spread for one in comparisons.values() if np.isfinite(one.spread)]
    widest = SPREADS * float(np.median(spreads)) if spreads else narrowest
    widest = min(max(widest, narrowest), WIDEST)
    if before is not None and abs(widest / before - 1) < STEADY:
        return before
    return float(f"{widest:.2g}")


def best_spreads(comparisons: Mapping[tuple[int, int], Comparison], count: int) -> NDArray[np.float64]:
    """Return (count,) the spread of depths between each frame and the other that agrees best with it; inf if none."""
    spreads = np.full(count, np.inf)
    for pair, one in comparisons.items():
        for k in pair:
            spreads[k] = min(spreads[k], one.spread)
    return spreads


def gains_of(comparisons: Mapping[tuple[int, int], Comparison], count: int) -> NDArray[np.float64]:
    """Return (count, 3) factors on each frame's linear colours that make overlapping frames equally bright."""
    logs = np.zeros((count, 3))
    for channel in range(3):
        known = [(i, j, one.log_ratios[channel]) for (i, j), one in comparisons.items()]
        known = [(i, j, ratio) for i, j, ratio in known if np.isfinite(ratio)]
        if not known:
            continue
        system = np.zeros((len(known), count))
        for row, (i, j, _) in zip(system, known, strict=True):
            row[[i, j]] = 1, -1
        logs[:, channel] = np.linalg.lstsq(system, [-ratio for _, _, ratio in known], rcond=None)[0]
    return np.where(np.abs(logs).max() < LEAST_GAIN, 1.0, np.exp(logs))


def excess_noise(samples: NDArray[np.float32]) -> float:
    """Return by how much a frame is brighter than others without a highlight, in steps of 255.

    By as much as it is darker: noise, wrong poses and exposures, and colours that lie beside their depth do both.
    samples: (n, 4) from stage 2 of highlights.frag: mean excess, by how much it is darker, whether it is known.
    """
    darker = samples[samples[:, 2] > 0, 1]
    return max(float(np.quantile(darker, DARKER)), LEAST_EXCESS) if len(darker) else LEAST_EXCESS


def importances(
    frames: Sequence[Frame], eye: Matrix, wrong: Set[int] = frozenset(), is_exact: bool = False
) -> NDArray[np.float64]:
    """Return (n,) weights of the frames in a view from the pose `eye`, in their world: 1 for the PRIMARY nearest ones.

    The others fade with their distance, so that nothing pops as the viewer moves. Where no frame has noise, far ones
    contradict none, and fade only where one looks from the place of another, which then shows all as it is. Frames with
    wrong poses and frames without points weigh 0.
    """
    right = np.array([k not in wrong and frame.points_known > 0 for k, frame in enumerate(frames)])
    if not is_exact and right.sum() <= PRIMARY:
        return right.astype(np.float64)
    away = np.where(right, distances(frames, eye), np.inf)
    if is_exact:
        weights = right * _weight(min(away.min() / BESIDE_ONE, 1.0))
        weights[away.argmin()] = right.any()
        return weights
    reach = max(float(np.sort(away[right])[PRIMARY - 1]), 1e-9)
    share = np.clip((FADING * reach - away) / ((FADING - 1) * reach), 0, 1)
    return right * _weight(share)


def _weight(share: Any) -> Any:
    """Return the weight of a frame that has faded to a share; for an array, each."""
    return FAINT + (1 - FAINT) * share * share * (3 - 2 * share)


def is_primary(importance: Any) -> Any:
    """Return whether a frame of this weight carries the picture, or only fills gaps; for an array, each."""
    return importance > DISSOLVED


def primary_shares(importances: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n,) the share of each frame's splats that may hide those of others: 1 for a primary frame, soon 0."""
    # frames come and go splat by splat: where two frames contradict each other, nothing pops
    return np.clip((importances - DISSOLVED) / (1 - DISSOLVED), 0, 1)


STEP = 1.25  # factor between two densities of points that count as equal, so that neighbours decide alike
BESIDE = 1  # pixels beside a point in which another frame's point takes its place
Mask = NDArray[np.bool_]


class FramePoints(NamedTuple):
    """The points of a frame."""

    frame: Frame
    surface: NDArray[np.float32]  # (h, w, 4) unit normal and depth, camera axes; depth 0 where there is no point
    is_trusted: Mask  # (h, w) whether other frames do not contradict a point


def kept_once(every: Sequence[FramePoints], band: float, overlap: int = 0) -> list[Mask]:
    """Return which points of each frame are kept, (h, w): trusted ones, and of those that lie on one place one.

    A place that several frames see, within `band` of 1/z, keeps the points of the frame that has them most densely
    there. What that leaves open at borders is closed with the points of others.

    overlap  trusted points so many pixels beside them are kept, too, so that no seam of surfaces gapes
    """
    known = [(one.surface[..., 3] > 0) & one.is_trusted for one in every]
    ranks = [_rank(one, k, len(every)) for k, one in enumerate(every)]
    others = nearest_others([one.frame for one in every])
    kept = [mask.copy() for mask in known]
    for k, one in enumerate(every):
        at = np.flatnonzero(known[k])
        own, worse = ranks[k].ravel()[at], np.zeros(len(at), np.bool_)
        for j, seen, pixels in _seen_by(one, at, every, others[k], band):
            worse[seen] |= known[j].ravel()[pixels] & (ranks[j].ravel()[pixels] > own[seen])
        kept[k].ravel()[at[worse]] = False
    for k, one in enumerate(every):
        at = np.flatnonzero(known[k] & ~kept[k])
        stands = np.zeros(len(at), np.bool_)
        for j, seen, pixels in _seen_by(one, at, every, others[k], band):
            stands[seen] |= _widened(kept[j]).ravel()[pixels]
        kept[k].ravel()[at[~stands]] = True
    for _ in range(overlap):
        kept = [_widened(one) & there for one, there in zip(kept, known, strict=True)]
    return kept


def _rank(one: FramePoints, number: int, count: int) -> NDArray[np.int32]:
    """Return how densely a frame's points lie, (h, w), in steps; of equal frames the first has the higher rank."""
    height, width = one.surface.shape[:2]
    camera, z = one.frame.camera, np.where(one.surface[..., 3] > 0, one.surface[..., 3], np.float64(1))
    x, y = camera.ray_at(np.arange(width)[None, :], np.arange(height)[:, None])
    nx, ny, nz = np.moveaxis(one.surface[..., :3], -1, 0)
    facing = np.abs(nx * x + ny * y + nz) / np.sqrt(x * x + y * y + 1)
    density = abs(camera.fx * camera.fy) * np.maximum(facing, 0.02) / z**2
    steps = np.floor(np.log(density) / np.log(STEP)).astype(np.int32)
    return steps * count + (count - 1 - number)


def _seen_by(
    one: FramePoints, at: NDArray[np.intp], every: Sequence[FramePoints], others: Sequence[int], band: float
) -> Iterator[tuple[int, NDArray[np.intp], NDArray[np.intp]]]:
    """Yield for each other frame which of the points `at` lie on its surface, and in which of its pixels."""
    width = one.surface.shape[1]
    z = one.surface[..., 3].ravel()[at].astype(np.float64)
    x, y = one.frame.camera.ray_at(at % width, at // width)
    points = np.stack([x * z, y * z, z], -1)
    for j in others:
        other = every[j]
        there = moved(points, np.linalg.inv(other.frame.pose) @ one.frame.pose)
        (height, width), camera = other.surface.shape[:2], other.frame.camera
        front = np.maximum(there[:, 2], 1e-9)
        u, v = (np.rint(at) for at in camera.pixel_at(there[:, 0], there[:, 1], front))
        seen = np.flatnonzero((there[:, 2] > 0) & (u >= 0) & (u < width) & (v >= 0) & (v < height))
        pixels = v[seen].astype(np.intp) * width + u[seen].astype(np.intp)
        depth = other.surface[..., 3].ravel()[pixels]
        agrees = (depth > 0) & (np.abs(1 - depth / front[seen]) < band * depth / front[seen] + 1e-12)
        yield j, seen[agrees], pixels[agrees]


def _widened(mask: Mask) -> Mask:
    """Return where a mask is true, or a pixel beside it is."""
    wide = np.pad(mask, BESIDE)
    height, width = mask.shape
    shifts = range(2 * BESIDE + 1)
    return np.logical_or.reduce([wide[v : v + height, u : u + width] for v in shifts for u in shifts])
