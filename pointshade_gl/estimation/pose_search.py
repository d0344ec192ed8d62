"""Finds the poses of a few frames of one thing of which nothing is known, and how sure they are."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scene.camera import inverted
from .agreement import BLURS, LEAST_COSINE, ReducedFrame
from .alignment import FEWEST, LEVELS, Fit, PosedFrames, align

NEAR, BESIDE = 0.02, 0.06  # share of the depth, along the normal and along the ray, within which a point agrees
FRONT = 0.04  # share of the depth by which a point lies before what is seen: it should have hidden it
FAINT = 0.003  # contrast of brightness that counts as much as noise
FIRST, AT_ONCE = 300, 500  # points by which all poses are tried; poses that are tried at once
ROUGH, FINE = 1.0, 4.0  # weights of a point before what is seen, beside one that agrees: of rough and of refined poses
Matrix = NDArray[np.float64]
Floats = NDArray[np.floating]
Flags = NDArray[np.bool_]


class Trial(NamedTuple):
    """How poses fare, (n,) each; the mean over both frames."""

    overlap: Floats  # share of the points that the other frame should show, the smaller of both frames
    agreement: Floats  # share of those that lie on the other's surface
    agreed: Floats  # share of all points that do
    front: Floats  # share of all points that would hide what the other frame shows
    like: Floats  # correlation of blurred brightness where points agree, -1 to 1
    detail: Floats  # the same of what blurring takes away; 0 without colours or texture

    def evidence(self, strict: float = FINE) -> Floats:
        """Return how much speaks for each pose. strict: weight of points before what is seen."""
        looks = 0.5 + np.maximum(self.like, 0) / 2 + np.maximum(self.detail, 0)
        return np.maximum(self.agreed - strict * self.front, 0) * looks


def try_poses(first: ReducedFrame, second: ReducedFrame, poses: Matrix, count: int = FIRST) -> Trial:
    """Return how poses fare, by so many points of each frame. poses: (n, 4, 4) the second's, in the first's axes."""
    parts = [poses[k : k + AT_ONCE] for k in range(0, len(poses), AT_ONCE)]
    there = [_one_way(first, second, part, count) for part in parts]
    back = [_one_way(second, first, inverted(part), count) for part in parts]
    ways = [[np.concatenate(one) for one in zip(*found, strict=True)] for found in (there, back)]
    seen, agreed, front, like, detail = ((one + other) / 2 for one, other in zip(*ways, strict=True))
    overlap = np.minimum(ways[0][0], ways[1][0])
    return Trial(overlap, agreed / np.maximum(seen, 1e-9), agreed, front, like, detail)


def some_points(frame: ReducedFrame, count: int) -> NDArray[np.intp]:
    """Return the numbers of so many points all over a frame, the same each time."""
    every = frame.samples(2)
    return every[np.random.default_rng(0).permutation(len(every))[:count]]


def _one_way(target: ReducedFrame, frame: ReducedFrame, poses: Matrix, count: int) -> tuple[Floats, ...]:
    """Return shares of the frame's points that the target should show, that agree, that lie before it; likenesses."""
    numbers = some_points(frame, count)
    turns = poses[:, :3, :3].astype(np.float32).swapaxes(1, 2)
    at = frame.points[numbers] @ turns + poses[:, None, :3, 3].astype(np.float32)
    pixels, inside = target.pixels(at)
    there, normals = target.points[pixels], target.normals[pixels]
    depth = there[..., 2]
    behind = np.where(inside & (depth > 0), at[..., 2] - depth, np.inf) / np.maximum(depth, 1e-9)
    apart = np.abs(np.einsum("npk,npk->np", normals, at - there))
    cosines = np.einsum("npk,npk->np", normals, frame.normals[numbers] @ turns)
    fits = (np.abs(behind) < BESIDE) & (apart < NEAR * depth) & (cosines > LEAST_COSINE)
    like = detail = np.zeros(len(poses))
    if frame.brightness is not None and target.brightness is not None:
        own, shown = ([one.value[numbers] for one in frame.blurred], [one.value[pixels] for one in target.blurred])
        like = _correlation(own[-1], shown[-1], fits)
        detail = _correlation(own[0] - own[-1], shown[0] - shown[-1], fits)  # of what more blur takes away from less
    total = max(len(numbers), 1)
    shares = (one.sum(1) / total for one in (behind < FRONT, fits, behind < -FRONT))
    return *shares, like, detail


def _correlation(one: Floats, other: Floats, fits: Flags) -> Floats:
    """Return the correlation (n,) of values (p,) or (n, p) where these belong together (n, p), less if faint."""
    count = np.maximum(fits.sum(1), 1)
    one, other = (
        np.where(fits, part - ((part * fits).sum(1) / count)[:, None], 0) for part in (np.atleast_2d(one), other)
    )
    lengths = ((part**2).sum(1) + count * FAINT**2 for part in (one, other))
    return (one * other).sum(1) / np.sqrt(next(lengths) * next(lengths))


PLACES = 400  # of a frame that are described, about
RINGS, ANGLES = 4, 24  # samples of a patch
LEAST_PIXELS = 3.0  # radius of a patch in its picture
FAINT_PATCH = 0.02  # contrast of brightness that counts half
HEIGHTS = 1.5  # weight of heights beside brightness
ALIKE = 4  # places of the other frame that each is paired with


class Patches(NamedTuple):
    """Places of a frame and their surroundings, n of them."""

    points: Floats  # (n, 3) m, camera axes
    axes: Floats  # (n, 3, 3) camera axes: rows are two tangents and the normal
    bright: Floats  # (n, RINGS, ANGLES) brightness, of mean 0 and length 1, less where it is faint
    heights: Floats  # (n, RINGS, ANGLES) above the tangent plane, in radii, -1 to 1, over the root of their number


class PosePairs(NamedTuple):
    """Places of two frames that look alike, n pairs."""

    first: NDArray[np.intp]  # (n,) number of the place in the first frame
    second: NDArray[np.intp]  # (n,) and in the second
    turns: Floats  # (n,) radians about the normal from the first's tangents to the second's


def find_patches(frame: ReducedFrame, radius: float) -> Patches:
    """Return the surroundings of distinct places all over a frame.

    They are read on the tangent plane in metres, so that they are the same from any side and distance (as viewpoint
    invariant patches: Wu et al. 2008); heights above it distinguish shapes without texture. radius: of a patch, m.
    """
    numbers = _distinct(frame, radius)
    points, normals = frame.points[numbers], frame.normals[numbers]
    aside = np.where(np.abs(normals[:, :1]) < 0.9, np.eye(3, dtype=np.float32)[0], np.eye(3, dtype=np.float32)[1])
    first = aside - normals * (aside * normals).sum(1, keepdims=True)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    axes = np.stack([first, np.cross(normals, first), normals], 1)
    turns = 2 * np.pi * np.arange(ANGLES, dtype=np.float32) / ANGLES
    rings = radius * np.arange(1, RINGS + 1, dtype=np.float32)[:, None] / RINGS
    flat = np.stack([rings * np.cos(turns), rings * np.sin(turns)], -1)
    pixels, inside = frame.pixels(points[:, None, None] + np.einsum("rac,nck->nrak", flat, axes[:, :2]))
    there = frame.points[pixels]
    heights = np.einsum("nrak,nk->nra", there - points[:, None, None], normals) / radius
    heights = np.where(inside & (there[..., 2] > 0), np.clip(heights, -1, 1), 0) / np.sqrt(RINGS * ANGLES)
    bright = np.zeros_like(heights)
    if frame.brightness is not None:
        gap = radius * abs(frame.camera.fx) / (RINGS * np.maximum(points[:, 2], 1e-6))  # pixels between two rings
        level = np.clip(np.log2(gap / 2).astype(int), 0, BLURS - 1)
        every = np.stack([frame.blurred[k].value for k in range(BLURS)])
        shown = every[level[:, None, None], pixels]
        usual = (shown * inside).sum((1, 2), keepdims=True) / np.maximum(inside.sum((1, 2), keepdims=True), 1)
        shown = np.where(inside, shown - usual, 0)
        bright = shown / np.sqrt((shown**2).sum((1, 2), keepdims=True) + RINGS * ANGLES * FAINT_PATCH**2)
    return Patches(points, axes, bright, heights)


def _distinct(frame: ReducedFrame, radius: float) -> NDArray[np.intp]:
    """Return the numbers of points at corners of the brightness or of the surface, the best of each of equal cells."""
    shape = frame.camera.height, frame.camera.width
    normals, depth = frame.normals.reshape(*shape, 3), frame.points[:, 2].reshape(shape)
    strength = _corners(normals) / 2
    if frame.brightness is not None:
        strength = strength + _corners(frame.blurred[1].value.reshape(*shape, 1))
    is_large = (depth > 0) & (radius * abs(frame.camera.fx) > LEAST_PIXELS * depth)
    cell = max(int(np.sqrt(is_large.sum() / PLACES)), 2)
    rows, columns = (size // cell for size in shape)
    cells = np.where(is_large, strength, -1)[: rows * cell, : columns * cell]
    cells = cells.reshape(rows, cell, columns, cell).swapaxes(1, 2).reshape(rows, columns, cell * cell)
    best = cells.argmax(-1)
    v, u = np.arange(rows)[:, None] * cell + best // cell, np.arange(columns) * cell + best % cell
    return (v * shape[1] + u)[cells.max(-1) >= 0]


def _corners(picture: Floats) -> Floats:
    """Return how much a picture (h, w, channels) changes in all directions (Shi, Tomasi 1994), 1 where it does most."""
    if min(picture.shape[:2]) < 2:
        return np.zeros(picture.shape[:2], picture.dtype)
    along_v, along_u = np.gradient(picture, axis=(0, 1))
    uu, uv, vv = (_mean(one.sum(-1)) for one in (along_u**2, along_u * along_v, along_v**2))
    found = np.maximum((uu + vv) / 2 - np.sqrt(((uu - vv) / 2) ** 2 + uv**2), 0)
    return found / max(float(np.quantile(found, 0.95)), 1e-12)


def _mean(picture: Floats) -> Floats:
    """Return the mean over 5x5 pixels."""
    for axis in (0, 1):
        wide = np.pad(picture, [(3, 2) if k == axis else (0, 0) for k in (0, 1)], "edge").cumsum(axis)
        picture = (np.roll(wide, -5, axis) - wide).take(range(picture.shape[axis]), axis) / 5
    return picture


def pair_alike(first: Patches, second: Patches) -> PosePairs:
    """Return pairs of each place of a frame with those of the other that look most like it, turned at will.

    A patch is compared at all turns at once, by the Fourier transform along its rings.
    """
    waves = np.zeros((len(first.points), len(second.points), ANGLES // 2 + 1), np.complex64)
    for weight, one, other in ((1, first.bright, second.bright), (2 * HEIGHTS, first.heights, second.heights)):
        one, other = (np.fft.rfft(part, axis=-1).astype(np.complex64) for part in (one, other))
        for k in range(waves.shape[-1]):
            waves[..., k] += weight * (one[..., k].conj() @ other[..., k].T)
    likeness = np.fft.irfft(waves, ANGLES, axis=-1).astype(np.float32)
    best = likeness.argmax(-1)
    highest = np.take_along_axis(likeness, best[..., None], -1)[..., 0]
    highest -= HEIGHTS * (second.heights**2).sum((1, 2))  # of (one - other)^2 what differs within a row
    j = np.argsort(-highest, axis=1, kind="stable")[:, :ALIKE]
    i, j = np.repeat(np.arange(len(j)), j.shape[1]), j.ravel()
    before, middle, after = (likeness[i, j, (best[i, j] + k) % ANGLES] for k in (-1, 0, 1))
    part = (after - before) / np.maximum(2 * (2 * middle - before - after), 1e-9)  # the top of a parabola
    return PosePairs(i, j, 2 * np.pi * (best[i, j] + np.clip(part, -0.5, 0.5)) / ANGLES)


REFINED = 8  # different poses that are refined
DIFFERENT, OTHER = 0.15, 0.05  # shares of the distance by which poses differ, before and after they are refined
SPREAD = 60  # points by which poses are distinguished
CLOSELY = 4000  # points by which refined poses are judged
LEAST_OVERLAP, SURE_OVERLAP = 0.1, 0.25  # share of the points that both show
LEAST_AGREEMENT, SURE_AGREEMENT = 0.8, 0.9  # share of those that lie on the other's surface
MOST_FRONT, SURE_FRONT = 0.05, 0.01  # share of those that would hide what the other shows
LEAST_LIKE, SURE_LIKE = 0.4, 0.7  # correlation of brightness
RIVAL, SURE_RIVAL = 0.9, 0.7  # of the evidence, for another pose


class Link(NamedTuple):
    """What is known of where a frame stands beside another."""

    pose: Matrix  # (4, 4) camera to the other's camera
    evidence: float  # for it
    is_found: bool
    doubt: str  # why it may be wrong, or is not found; nothing if it is sure

    @property
    def is_sure(self) -> bool:
        """Return whether nothing speaks against it."""
        return self.is_found and not self.doubt


def find_link(first: ReducedFrame, second: ReducedFrame, one: Patches, other: Patches) -> Link:
    """Return where the second frame stands beside the first, by the patches of both."""
    if min(len(one.points), len(other.points), *(len(frame.samples(2)) for frame in (first, second))) < FEWEST:
        return Link(np.eye(4), 0.0, False, "too few points have depth")
    poses = _poses_of(one, other, pair_alike(one, other))
    rough = try_poses(first, second, poses).evidence(ROUGH)
    refined, loose = [], []  # better poses, and how many motions nothing fixes
    for k in _different(poses, rough, second, DIFFERENT):
        start = [np.eye(4), poses[k]]
        (_, pose), motions = PosedFrames([first, second], start).refine(start, {1}, levels=LEVELS[:2])
        refined.append(pose)
        loose.append(len(motions))
    poses = np.array(refined)
    trial = try_poses(first, second, poses, CLOSELY)
    evidence = trial.evidence()
    best, *others = _different(poses, evidence, second, OTHER)
    rival = float(evidence[others[0]] / max(evidence[best], 1e-9)) if others else 0.0
    has_colors = first.brightness is not None and second.brightness is not None
    return Link(poses[best], float(evidence[best]), *_verdict(trial, best, loose[best], rival, has_colors))


def is_same(pose: Matrix, other: Matrix, frame: ReducedFrame) -> bool:
    """Return whether two poses (4, 4) of a frame are one, but for the last refinement."""
    return bool(_apart(pose[None], other, frame)[0] < OTHER)


def _poses_of(one: Patches, other: Patches, pairs: PosePairs) -> Matrix:
    """Return the poses (n, 4, 4) of the second frame in the first's axes that lay patches of pairs on each other."""
    cosine, sine, zero = np.cos(pairs.turns), np.sin(pairs.turns), np.zeros_like(pairs.turns)
    turns = np.stack([cosine, sine, zero, -sine, cosine, zero, zero, zero, zero + 1], -1).reshape(-1, 3, 3)
    poses = np.tile(np.eye(4), (len(turns), 1, 1))
    poses[:, :3, :3] = one.axes[pairs.first].swapaxes(1, 2) @ turns @ other.axes[pairs.second]
    poses[:, :3, 3] = one.points[pairs.first] - (poses[:, :3, :3] @ other.points[pairs.second][..., None])[..., 0]
    return poses


def _different(poses: Matrix, evidence: NDArray[np.floating], frame: ReducedFrame, least: float) -> list[int]:
    """Return the numbers of poses of a frame that lie so far from all better ones, the best first."""
    left, chosen = np.argsort(-evidence, kind="stable"), []
    while len(left) and len(chosen) < REFINED:
        chosen.append(int(left[0]))
        left = left[_apart(poses[left], poses[left[0]], frame) > least]
    return chosen


def _apart(poses: Matrix, pose: Matrix, frame: ReducedFrame) -> Matrix:
    """Return by how much poses (n, 4, 4) of a frame move its points from another, as a share of their distance."""
    points, change = frame.points[some_points(frame, SPREAD)].astype(np.float64), poses - pose
    moved = points @ change[:, :3, :3].swapaxes(1, 2) + change[:, None, :3, 3]
    return np.sqrt((moved**2).sum(-1).mean(-1)) / max(float(np.linalg.norm(frame.middle)), 1e-9)


def _verdict(trial: Trial, best: int, loose: int, rival: float, has_colors: bool) -> tuple[bool, str]:
    """Return whether pose number `best` of a trial is found, and why it is doubtful.

    loose  motions that nothing fixes; rival: evidence for another pose, as a share of that for it
    """
    overlap, agreement, _, front, like, detail = (float(values[best]) for values in trial)
    front, colors = front / max(overlap, 1e-9), (like + detail) / 2 if has_colors else 1.0
    if overlap < LEAST_OVERLAP or agreement < LEAST_AGREEMENT or front > MOST_FRONT or colors < LEAST_LIKE:
        return False, "no pose makes the frames agree"
    if loose:
        return False, f"neither depth nor colours fix {loose} of 6 motions"
    if rival > RIVAL:
        return False, "another pose fits as well"
    if rival > SURE_RIVAL:
        return True, "another pose fits nearly as well"
    if overlap < SURE_OVERLAP:
        return True, f"both show the same in only {100 * overlap:.0f} % of their points"
    if agreement < SURE_AGREEMENT or front > SURE_FRONT:
        return True, f"only {100 * agreement:.0f} % of what both show agrees"
    return True, "" if colors >= SURE_LIKE else "the colours hardly agree"


RADIUS = 0.045  # of a patch, a share of what the picture is wide at the frames' distance
Links = Mapping[tuple[int, int], Link]  # by the numbers of two frames, both ways: the second's place beside the first


class FoundPose(NamedTuple):
    """What became of a frame."""

    fit: Fit  # not placed: it was not found
    doubt: str  # why the pose may be wrong, or is not found; nothing if it is sure


def search_poses(
    frames: Sequence[ReducedFrame], poses: Sequence[Matrix], advance: Callable[[], object] = lambda: None
) -> list[FoundPose]:
    """Find the poses of frames of one thing; the first keeps its own, and those that are not found theirs.

    Two places that look alike on their tangent planes are a whole pose of one frame beside another. All of these are
    tried: depths and brightness agree or contradict. The best are refined, and one is believed if no other comes near
    it. Frames are joined to the first by what most speaks for (a maximum spanning tree) and aligned all at once.

    advance  called after each pair of frames, and after each level of the alignment
    """
    radius = RADIUS * max(frame.middle[2] * frame.camera.width / abs(frame.camera.fx) for frame in frames)
    patches = [find_patches(frame, float(radius)) for frame in frames]
    links: dict[tuple[int, int], Link] = {}
    for i, j in combinations(range(len(frames)), 2):
        links[i, j] = link = find_link(frames[i], frames[j], patches[i], patches[j])
        links[j, i] = link._replace(pose=inverted(link.pose[None])[0])
        advance()
    beside, parents = _joined(links)
    group = sorted(beside)
    fits = align([frames[k] for k in group], [poses[0] @ beside[k] for k in group], advance)
    placed = {k: fit for k, fit in zip(group, fits, strict=True) if fit.placed or k == 0}
    doubts = _doubts(frames, links, parents, placed)
    lost = fits[0]._replace(placed=False, overlap=0.0, agreed=0.0, agrees=0.0, loose=())
    return [FoundPose(placed.get(k, lost._replace(pose=poses[k])), doubt) for k, doubt in enumerate(doubts)]


def _joined(links: Links) -> tuple[dict[int, Matrix], dict[int, int]]:
    """Return the poses beside the first frame of all that hang together with it, and what each was joined to."""
    beside, parents = {0: np.eye(4)}, {}
    while True:
        ends = [(i, j) for (i, j), link in links.items() if link.is_found and i in beside and j not in beside]
        if not ends:
            return beside, parents
        i, j = max(ends, key=lambda pair: links[pair].evidence)
        beside[j], parents[j] = beside[i] @ links[i, j].pose, i


def _doubts(
    frames: Sequence[ReducedFrame],
    links: Links,
    parents: Mapping[int, int],  # to which each frame was joined
    fits: Mapping[int, Fit],  # of the frames that are placed
) -> list[str]:
    """Return for each frame why its pose may be wrong or is not found; nothing if sure links lead to the first."""
    sure = [(i, j) for (i, j), link in links.items() if link.is_sure and i in fits and j in fits]
    known, broken = {0}, set()
    for _ in frames:
        known |= {j for i, j in sure if i in known}
    for i, j in sure:
        if not is_same(links[i, j].pose, np.linalg.inv(fits[i].pose) @ fits[j].pose, frames[j]):
            broken |= {i, j} - {0}

    def doubt(k: int) -> str:
        if k in fits and k in known - broken:
            return ""
        if k in broken:
            return "pairs of frames contradict each other"
        if k in parents and k not in fits:
            return "the frames do not agree when all are aligned at once"
        if k in parents:
            return links[parents[k], k].doubt or f"so is frame {parents[k]}, beside which it was found"
        return max((link for (_, j), link in links.items() if j == k), key=lambda link: link.evidence).doubt

    return [doubt(k) for k in range(len(frames))]
