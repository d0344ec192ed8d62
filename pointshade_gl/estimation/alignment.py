"""Corrects the poses of several frames of one thing, so that their depths and colours agree."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence, Set
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .agreement import (
    LEAST_SPREAD,
    WIDEST_BAND,
    Judgement,
    Matches,
    ReducedFrame,
    connected,
    count_seen,
    find_matches,
    judge,
    placed,
    spread_of,
)

NOISE_SHARE = 10.0  # times what noise alone adds to the equations must be there before a motion counts as fixed
LEAST_FIXED = 0.1  # share of an equation's weight along a motion that must be more than noise
Matrix = NDArray[np.float64]
Floats = NDArray[np.floating]


class Equations(NamedTuple):
    """What residuals of one pair of frames ask of a motion of the first, (turns * radius, shift), world axes."""

    matrix: Matrix  # (6, 6)
    vector: Matrix  # (6,)
    noise: Matrix  # (6, 6) what noise alone would add to the matrix


def pair_equations(
    points: Matrix, directions: Floats, residuals: Floats, weights: Matrix, noise: Floats, radius: float
) -> Equations:
    """Return the equations of residuals (n,) that grow as a point moves along a direction.

    points      (n, 3) relative to the scene's middle
    directions  (n, 3) derivatives of the residuals; noise (n,) is the variance of each component
    radius      of the scene: turns count as the way of a point so far from the middle
    """
    arms = np.hstack([np.cross(points, directions) / radius, directions])
    weighted = arms * weights[:, None]
    return Equations(weighted.T @ arms, weighted.T @ residuals, _noise_matrix(points / radius, weights * noise))


def _noise_matrix(points: Matrix, weights: Matrix) -> Matrix:
    """Return the sum of weights times A A^T, A = [[p]x; 1]: what directions of random noise add to the equations."""
    total, first = weights.sum(), weights @ points
    second = (points * weights[:, None]).T @ points
    cross = np.array([[0, -first[2], first[1]], [first[2], 0, -first[0]], [-first[1], first[0], 0]])
    result = np.empty((6, 6))
    result[:3, :3] = np.trace(second) * np.eye(3) - second
    result[:3, 3:], result[3:, :3] = cross, cross.T
    result[3:, 3:] = total * np.eye(3)
    return result


class Joint:
    """The equations of all frames: of the geometry and of the colours, each with its noise."""

    def __init__(self, count: int):
        self.count = count
        self.matrices = np.zeros((2, 6 * count, 6 * count))
        self.noises = np.zeros((2, 6 * count, 6 * count))
        self.vector = np.zeros(6 * count)

    def add(self, i: int, j: int, kind: int, found: Equations) -> None:
        """Add what residuals of frame i in frame j ask. kind: 0 of the geometry, 1 of the colours."""
        at, other = slice(6 * i, 6 * i + 6), slice(6 * j, 6 * j + 6)
        for sums, block in ((self.matrices[kind], found.matrix), (self.noises[kind], found.noise)):
            sums[at, at] += block
            sums[other, other] += block
            sums[at, other] -= block
            sums[other, at] -= block
        self.vector[at] += found.vector
        self.vector[other] -= found.vector

    def solved(self, free: NDArray[np.bool_]) -> tuple[Matrix, Matrix]:
        """Return (count, 6) steps of the frames that are free to move, and (n, count, 6) motions that nothing fixes."""
        some = np.repeat(free, 6)
        matrices, noises = (sums[:, some][:, :, some] for sums in (self.matrices, self.noises))
        steps, loose = solved_motions(matrices, noises, self.vector[some])
        result, motions = np.zeros(6 * self.count), np.zeros((len(loose), 6 * self.count))
        result[some], motions[:, some] = steps, loose
        return result.reshape(-1, 6), motions.reshape(-1, self.count, 6)


def solved_motions(matrices: Matrix, noises: Matrix, vector: Matrix) -> tuple[Matrix, Matrix]:
    """Return the step that solves the equations along all motions that they fix, (n,), and the others, (m, n).

    Noise in normals and slopes fills the equations along motions that it cannot fix, such as sliding along a plane:
    what it adds is known, and what exceeds it must be a tenth of the whole. Matrices (2, n, n) are those of the
    geometry and the colours; noises the same of noise alone.
    """
    whole = matrices.sum(0)
    scale = max(float(np.trace(whole)) / max(len(whole), 1), 1e-300)
    informed = np.zeros_like(whole)
    for matrix, noise in zip(matrices, noises, strict=True):
        values, vectors = np.linalg.eigh(matrix - NOISE_SHARE * noise)
        informed += (vectors * np.maximum(values, 0)) @ vectors.T
    inverse = np.linalg.inv(np.linalg.cholesky(whole + 1e-9 * scale * np.eye(len(whole))))
    shares, basis = np.linalg.eigh(inverse @ informed @ inverse.T)
    motions = basis.T @ inverse  # rows, of which each is a unit of the whole
    is_fixed = shares >= LEAST_FIXED
    fixed = motions[is_fixed]
    return -fixed.T @ (fixed @ vector), motions[~is_fixed]


def motion_matrix(step: Matrix, radius: float) -> Matrix:
    """Return the (4, 4) motion of a step (6,): a turn about the middle by its first three over the radius, a shift."""
    turn, result = step[:3] / radius, np.eye(4)
    angle = float(np.linalg.norm(turn))
    x, y, z = turn / max(angle, 1e-300)
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    result[:3, :3] += np.sin(angle) * across + (1 - np.cos(angle)) * across @ across
    result[:3, 3] = step[3:]
    return result


def motion_of(pose: Matrix, given: Matrix, radius: float) -> Matrix:
    """Return the step (6,) whose motion leads from one pose to another, both (4, 4) and about the middle."""
    turn = pose[:3, :3] @ given[:3, :3].T
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    sine = float(np.linalg.norm(axis))
    angle = float(np.arctan2(sine, (np.trace(turn) - 1) / 2))
    return np.concatenate([axis * (radius * angle / max(sine, 1e-300)), pose[:3, 3] - turn @ given[:3, 3]])


LEAST_OVERLAP = 0.08  # of a frame's points that another must show, for the two to be compared
MOST_SAMPLES = 600_000  # of all pairs together in one iteration
TUKEY = 4.685  # spreads beyond which a difference does not count (Tukey's biweight)
NORMAL_NOISE = 1.386  # median of 1 - cosine between two normals, over the variance of one of their components
LONGEST_STEP = 0.06  # of a frame in one iteration, a share of the scene's distance
LEAST_LIGHT = 1 / 255  # spread of brightness that agrees, at least: 8 bits tell no more, however alike most are
SETTLED = 6e-4  # of a level's gate: a shorter step ends it
SHOWN = 2  # pixels, doubled by each blur, that depths may be apart where brightness still leads the right way
FEWEST = 20  # samples that two frames must share
Pair = tuple[int, int]


class Level(NamedTuple):
    """How the poses are refined, coarse to fine."""

    step: int  # columns and rows between samples
    gate: float  # share of the depth within which points may be the same
    blur: int  # of the brightness
    most: int  # iterations
    least_spread: float  # of depths, a share of them: what is farther apart counts, though most agrees better


LEVELS = Level(8, 0.2, 2, 20, 0.02), Level(4, 0.06, 1, 12, 0.006), Level(2, 0.03, 0, 6, 0.0)


class PosedFrames:
    """Frames with poses that are being corrected.

    scale   distance of the scene from the cameras
    middle  of it, (3,) world; turns are about it
    radius  of it
    anchors numbers of the frames that keep their poses: the first ones, or the first of each group that overlaps
    """

    def __init__(self, frames: Sequence[ReducedFrame], poses: Sequence[Matrix], known: int = 1):
        self.frames = frames
        self.middle = poses[0][:3, :3] @ frames[0].middle + poses[0][:3, 3]
        self.radius = max(frame.radius for frame in frames) or 1.0
        self.scale = float(np.median([np.linalg.norm(frame.middle) for frame in frames])) or 1.0
        self.given = [pose.copy() for pose in poses]
        self.by_colors = True  # whether brightness leads, too
        self.anchors = set(range(known))
        if known == 1:
            linked = np.zeros((len(poses), len(poses)), bool)
            for i, j in self.pairs(poses):
                linked[i, j] = linked[j, i] = True
            groups = [connected(linked, [k]) for k in range(len(poses)) if linked[k].any()]
            self.anchors = {int(np.argmax(group)) for group in groups} or {0}

    def pairs(self, poses: Sequence[Matrix], without: Set[int] = frozenset()) -> list[Pair]:
        """Return the pairs (i, j) of frames of which i shows enough that j should show, too."""
        numbers = [k for k in range(len(self.frames)) if k not in without]
        least = [max(LEAST_OVERLAP * len(frame.samples(LEVELS[0].step)), FEWEST) for frame in self.frames]
        found, level = [], LEVELS[0]
        for i in numbers:
            points = placed(self.frames[i], poses[i], level.step)
            others = (j for j in numbers if j != i)
            found += [(i, j) for j in others if count_seen(points, self.frames[j], poses[j], level.gate) >= least[i]]
        return found

    def matches(
        self, poses: Sequence[Matrix], level: Level, pairs: Sequence[Pair], by_colors: bool = False
    ) -> Iterator[tuple[int, int, Matches]]:
        """Yield the matches of pairs that have any; pairs of one first frame follow one another."""
        last, points, own = -1, None, None
        for i, j in pairs:
            if i != last:
                frame, last = self.frames[i], i
                points = placed(frame, poses[i], level.step)
                own = frame.blurred[level.blur] if by_colors and frame.brightness is not None else None
            assert points is not None
            found = find_matches(points, own, self.frames[j], poses[j], level.gate, level.blur)
            if found is not None:
                yield i, j, found

    def refine(
        self, poses: Sequence[Matrix], free: Collection[int], without: Set[int] = frozenset(),
        levels: Sequence[Level] = LEVELS, advance: Callable[[], object] = lambda: None,
    ) -> tuple[list[Matrix], Matrix]:  # fmt: skip
        """Return better poses of the frames that are free to move, and (n, count, 6) motions that nothing fixes.

        Those of `without` are compared with none.
        """
        poses, loose = list(poses), np.zeros((0, len(poses), 6))
        for level in levels:
            pairs = [(i, j) for i, j in self.pairs(poses, without) if i in free or j in free]
            seen = {k for pair in pairs for k in pair}
            is_free = np.array([k in free and k in seen for k in range(len(poses))])
            level = self._affordable(level, pairs)
            for _ in range(level.most):
                joint = self._equations(poses, level, pairs)
                if joint is None:
                    return poses, loose
                steps, loose = joint.solved(is_free)
                longest = float(np.linalg.norm(steps.reshape(-1, 3), axis=1).max())
                steps *= min(1.0, LONGEST_STEP * self.scale / max(longest, 1e-300))
                poses = [self._moved(pose, step) for pose, step in zip(poses, steps, strict=True)]
                if longest < SETTLED * self.scale * level.gate:
                    break
            advance()
        return poses, loose

    def _affordable(self, level: Level, pairs: Sequence[Pair]) -> Level:
        step = level.step
        while sum(len(self.frames[i].samples(step)) for i, _ in pairs) > MOST_SAMPLES and step < 64:
            step *= 2
        return level._replace(step=step)

    def _moved(self, pose: Matrix, step: Matrix) -> Matrix:
        if not step.any():
            return pose
        motion, moved = motion_matrix(step, self.radius), pose.copy()
        moved[:3, :3] = motion[:3, :3] @ pose[:3, :3]
        moved[:3, 3] = motion[:3, :3] @ (pose[:3, 3] - self.middle) + motion[:3, 3] + self.middle
        return moved

    def moved(self, poses: Sequence[Matrix], k: int) -> float:
        """Return how far a frame's points lie from where its given pose puts them, root of the mean square."""
        change = poses[k] - self.given[k]
        points = self.frames[k].points[self.frames[k].samples(LEVELS[0].step)]
        ways = points @ change[:3, :3].T + change[:3, 3]
        return float(np.sqrt((ways**2).sum(-1).mean())) if len(ways) else float(np.linalg.norm(change[:3, 3]))

    def held(self, poses: Sequence[Matrix], loose: Matrix) -> list[Matrix]:
        """Return poses without what they moved along motions that nothing fixes. loose: (n, count, 6)."""
        moved = [motion_of(self._about_middle(pose), self._about_middle(given), self.radius)
                 for pose, given in zip(poses, self.given, strict=True)]  # fmt: skip
        basis, _ = np.linalg.qr(loose.reshape(len(loose), -1).T)
        back = (basis @ (basis.T @ np.concatenate(moved))).reshape(-1, 6)
        return [self._moved(pose, -step) for pose, step in zip(poses, back, strict=True)]

    def _about_middle(self, pose: Matrix) -> Matrix:
        result = pose.copy()
        result[:3, 3] -= self.middle
        return result

    def _equations(self, poses: Sequence[Matrix], level: Level, pairs: Sequence[Pair]) -> Joint | None:
        """Return the equations of all pairs, weighted by the spread of all their differences together."""
        matches = self.matches(poses, level, pairs, self.by_colors)
        found = [(i, j, one) for i, j, one in matches if len(one.points)]
        if not found:
            return None
        every = [one for *_, one in found]
        usual = spread_of([one.apart for one in every], max(LEAST_SPREAD, level.least_spread))
        cosines = np.concatenate([one.cosines for one in every])
        normal_noise = max(float(np.median(1 - cosines)), 0.0) / NORMAL_NOISE
        light = spread_of([one.brighter for one in every], LEAST_LIGHT)
        joint = Joint(len(self.frames))
        for i, j, one in found:
            points = (one.points - self.middle).astype(np.float64)
            spread = spread_of([one.apart], usual)  # more where frames are still far from where they belong
            weights = _tukey(one.apart / spread) / (one.depth * spread) ** 2
            noise = np.full(len(points), normal_noise)
            distances = one.apart * one.depth
            joint.add(i, j, 0, pair_equations(points, one.normals, distances, weights, noise, self.radius))
            target = self.frames[j]
            is_near = spread * abs(target.camera.fx) < SHOWN << level.blur
            colored = np.flatnonzero(np.isfinite(one.brighter) & (weights > 0) & is_near)
            if len(colored):
                brighter, usual_light = one.brighter[colored], spread_of([one.brighter], light)
                shown = _tukey(brighter / usual_light) / usual_light**2
                focal = abs(target.camera.fx * target.camera.fy) / one.depth[colored] ** 2
                noise = focal * target.blurred[level.blur].slope_noise ** 2
                joint.add(
                    i, j, 1, pair_equations(points[colored], one.slopes[colored], brighter, shown, noise, self.radius)
                )
        return joint

    def judged(
        self, poses: Sequence[Matrix], without: Set[int] = frozenset(), spread: float | None = None
    ) -> Judgement:
        """Return how well the frames agree, of which those of `without` are compared with none; spread: see `judge`."""
        pairs = self.pairs(poses, without)
        level = self._affordable(LEVELS[1]._replace(gate=WIDEST_BAND), pairs)
        found = list(self.matches(poses, level, pairs))
        points = [len(frame.samples(level.step)) for frame in self.frames]
        pairs = zip(map(self._about_middle, poses), map(self._about_middle, self.given), strict=True)
        motions = [pose @ np.linalg.inv(given) for pose, given in pairs]
        steps = [[motion_of(one, other, self.radius) for other in motions] for one in motions]
        moved = np.linalg.norm(steps, axis=-1) / self.scale
        return judge(found, self.frames, points, self.anchors, moved, spread)


def _tukey(values: NDArray[np.floating]) -> Matrix:
    """Return weights of values in spreads, 0 from TUKEY on."""
    return np.maximum(1 - (values.astype(np.float64) / TUKEY) ** 2, 0) ** 2


WELL_REGISTERED = 0.7  # correlation of textures from which on colours surely lie on the depth
REGISTERED = 0.33  # and which they have at least where by depth alone poses are right
ROUNDS = 4  # of placing frames again and solving all
STEPS = len(LEVELS) + ROUNDS
WORSE = 0.005  # by so much less agreement than with the given pose a frame gets that back
OWN_SHARE = 0.1  # of a motion that nothing fixes, from which on a frame takes part in it


class Fit(NamedTuple):
    """What became of one frame's pose."""

    pose: Matrix  # (4, 4) camera-to-world
    placed: bool  # whether it is known; otherwise it is the given one
    leads: bool  # whether it kept its pose, which others follow
    moved: float  # how far its points were moved, root of the mean square, m
    overlap: float  # share of its points that other frames should show, too
    before: float  # spread of the depths' differences with the given poses, a share of the depth; NaN without overlap
    after: float  # the same with the new ones
    agreed: float  # share of what it has in common with others that lay within the band, with the given poses
    agrees: float  # the same with the new ones
    by_colors: bool  # whether brightness led, too
    loose: tuple[Matrix, ...]  # motions (6,) that nothing fixes, turn and shift in world axes, of length 1


def align(
    frames: Sequence[ReducedFrame], poses: Sequence[Matrix],
    advance: Callable[[], object] = lambda: None, known: int = 1,
) -> list[Fit]:  # fmt: skip
    """Correct the poses of frames of one thing; the first keeps its own.

    Frames are compared in pairs that show the same: by how far the points of one lie off the planes of the other
    (Chen, Medioni 1991; by projection: Blais, Levine 1995), and by how much brighter they are (Park, Zhou, Koltun
    2017). One Gauss-Newton step moves all frames at once. A motion that neither depth nor colours fix is left as given,
    and so is a frame that afterwards agrees too little with the others, or less than before.

    advance   called after each level, and before each round of checks: at most STEPS times
    known  how many of the first frames have right poses
    """
    work = PosedFrames(frames, poses, known)
    free = set(range(len(frames))) - work.anchors
    found, loose = work.refine(poses, free, advance=advance)
    if not _are_registered(work, found, free):
        work.by_colors = False
        found, loose = work.refine(poses, free)
    kept: set[int] = set()
    for _ in range(ROUNDS):
        advance()
        again, kept = _guarded(work, found, kept)
        if all(one is other for one, other in zip(again, found, strict=True)):
            break
        found, loose = work.refine(again, free - kept, kept, LEVELS[1:])
    if len(loose):
        found, loose = work.refine(work.held(found, loose), free - kept, kept, LEVELS[-1:])
    after = work.judged(found)
    before = work.judged(poses, spread=after.spread)
    fits = []
    for k, pose in enumerate(found):
        own: tuple[Matrix, ...] = ()
        if len(loose):
            sizes = np.linalg.norm(loose, axis=(1, 2))[:, None]
            _, shares, motions = np.linalg.svd(loose[:, k] / sizes)
            own = tuple(motions[: len(shares)][shares > OWN_SHARE])
        is_placed, leads = k not in kept and after.overlap[k] > 0, k in work.anchors
        spreads, agreed = (before.each[k], after.each[k]), (before.agreement[k], after.agreement[k])
        moved = work.moved(found, k)
        fits.append(Fit(pose, is_placed, leads, moved, after.overlap[k], *spreads, *agreed, work.by_colors, own))
    return fits


def _are_registered(work: PosedFrames, poses: list[Matrix], free: Set[int]) -> bool:
    """Return whether colours lie on the depth: where poses are right by depth alone, textures must agree, too."""
    if work.judged(poses).correlation < WELL_REGISTERED:
        work.by_colors = False
        poses, _ = work.refine(poses, free, levels=LEVELS[-1:])
        work.by_colors = True
        return not work.judged(poses).correlation < REGISTERED
    return True


def _guarded(work: PosedFrames, poses: list[Matrix], kept: set[int]) -> tuple[list[Matrix], set[int]]:
    """Place doubtful frames again, each alone among the others; return the poses, and the frames that keep the given.

    The given pose may lead elsewhere when the others already lie where they belong.
    """
    poses = list(poses)
    judged = work.judged(poses)
    doubtful = {k for k in np.flatnonzero(judged.is_doubtful()).tolist() if k not in work.anchors | kept}
    for k in sorted(doubtful, key=lambda k: judged.agreement[k]):
        again = poses.copy()
        again[k] = work.given[k]
        others = doubtful - {k}
        again, _ = work.refine(again, {k}, others | kept)
        now = [work.judged(one, others | kept, judged.spread) for one in (poses, again)]
        if now[1].agreement[k] > now[0].agreement[k]:
            poses = again
        if not now[1].is_doubtful()[k]:
            doubtful = others
    kept = kept | _outcasts(work, poses, kept)
    return [work.given[k] if k in kept else pose for k, pose in enumerate(poses)], kept


def _outcasts(work: PosedFrames, poses: list[Matrix], without: Set[int]) -> set[int]:
    """Return which frames do not fit the others, or fit them less than at the given poses.

    The worst half of those is taken out before the others are asked again: a wrong frame spoils its neighbours' share.
    """
    found: set[int] = set()
    while True:
        after = work.judged(poses, without | found)
        before = work.judged(work.given, without | found, after.spread)
        bad = after.is_wrong() | (after.agreement < before.agreement - WORSE)
        bad[list(work.anchors)] = False
        if not bad.any():
            return found
        found |= set(np.flatnonzero(bad & (after.agreement <= np.median(after.agreement[bad]))).tolist())
