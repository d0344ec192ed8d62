"""Frames whose poses are being corrected: which share something, what moves them, how well they agree."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence, Set
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .agreement import LEAST_SPREAD, WIDEST, Judgement, connected, judge, spread_of
from .frame_matches import Matches, count_seen, find_matches, placed
from .pose_graph import Joint, motion_matrix, motion_of, pair_equations
from .reduced_frame import ReducedFrame

LEAST_OVERLAP = 0.08  # of a frame's points that another must show, for the two to be compared
MOST_SAMPLES = 600_000  # of all pairs together in one iteration
TUKEY = 4.685  # spreads beyond which a difference does not count (Tukey's biweight)
NORMAL_NOISE = 1.386  # median of 1 - cosine between two normals, over the variance of one of their components
LONGEST_STEP = 0.06  # of a frame in one iteration, a share of the scene's distance
LEAST_LIGHT = 1e-4  # spread of brightness that agrees
SETTLED = 6e-4  # of a level's gate: a shorter step ends it
SHOWN = 2  # pixels, doubled by each blur, that depths may be apart where brightness still leads the right way
FEWEST = 20  # samples that two frames must share
Matrix = NDArray[np.float64]
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
        self.anchors = self._first_of_groups(poses) if known == 1 else set(range(known))

    def _first_of_groups(self, poses: Sequence[Matrix]) -> set[int]:
        """Return the first of each group of frames that overlap; frames alone are in none."""
        linked = np.zeros((len(poses), len(poses)), bool)
        for i, j in self.pairs(poses):
            linked[i, j] = linked[j, i] = True
        groups = [connected(linked, [k]) for k in range(len(poses)) if linked[k].any()]
        return {int(np.argmax(group)) for group in groups} or {0}

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
                own = frame.blurred(level.blur) if by_colors and frame.brightness is not None else None
            assert points is not None
            found = find_matches(points, own, self.frames[j], poses[j], level.gate, level.blur)
            if found is not None:
                yield i, j, found

    def refine(
        self, poses: Sequence[Matrix], free: Collection[int], without: Set[int] = frozenset(),
        levels: Sequence[Level] = LEVELS, told: Callable[[], object] = lambda: None,
    ) -> tuple[list[Matrix], Matrix]:  # fmt: skip
        """Return better poses of the frames that are free to move, and (n, count, 6) motions that nothing fixes.

        without  frames that are not compared with any
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
            told()
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
                noise = focal * target.blurred(level.blur).slope_noise ** 2
                joint.add(
                    i, j, 1, pair_equations(points[colored], one.slopes[colored], brighter, shown, noise, self.radius)
                )
        return joint

    def judged(
        self, poses: Sequence[Matrix], without: Set[int] = frozenset(), spread: float | None = None
    ) -> Judgement:
        """Return how well the frames agree.

        without  frames that are not compared with any
        spread   of the depths' differences where frames agree; None measures it
        """
        pairs = self.pairs(poses, without)
        level = self._affordable(LEVELS[1]._replace(gate=WIDEST), pairs)
        found = list(self.matches(poses, level, pairs))
        points = [len(frame.samples(level.step)) for frame in self.frames]
        return judge(found, self.frames, points, self.anchors, self._moved_pairs(poses), spread)

    def _moved_pairs(self, poses: Sequence[Matrix]) -> Matrix:
        """Return (n, n) how far each two frames were moved against each other, a share of the scene's distance."""
        both = [
            (self._about_middle(pose), self._about_middle(given)) for pose, given in zip(poses, self.given, strict=True)
        ]
        motions = [pose @ np.linalg.inv(given) for pose, given in both]
        steps = [[motion_of(one, other, self.radius) for other in motions] for one in motions]
        return np.linalg.norm(steps, axis=-1) / self.scale


def _tukey(values: NDArray[np.floating]) -> Matrix:
    """Return weights of values in spreads, 0 from TUKEY on."""
    return np.maximum(1 - (values.astype(np.float64) / TUKEY) ** 2, 0) ** 2
