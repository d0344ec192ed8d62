"""Corrects or finds the poses of frames before they are drawn as one object, and says what it did."""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable, Sequence
from dataclasses import replace
from math import comb
from typing import TYPE_CHECKING, Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import Count
from ..gpu.drawables import Drawables
from ..gpu.points.point_objects import ShownSet
from ..notes.notes import print_note
from ..notes.words import counted
from ..scene.appearance import Appearance
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.node import Matrix, Node, Placed, contents_of
from ..scene.objects import PointObject
from .gpu_scene import GpuScene, surface_of

if TYPE_CHECKING:
    from ..estimation.agreement import ReducedFrame
    from ..estimation.alignment import Fit
    from ..estimation.pose_search import FoundPose

REFINED = 4, 16, 64  # sets of a stream after which its cameras are aligned again, and the poses averaged
MOVED, LEAST_MOVED = 2.0, 5e-4  # times the spread of depths, and more by so much of them: a camera was moved
MOST_RIGS = 8  # of streams that are remembered
MOST_SETS = 2  # of frames that are
Content = Any  # of a node


class Aligned(NamedTuple):
    """Frames with corrected poses, and what became of each."""

    given: tuple[Frame, ...]
    frames: tuple[Frame, ...]
    fits: tuple[Fit, ...]

    @classmethod
    def of(cls, frames: Sequence[Frame], fits: Sequence[Fit]) -> Aligned:
        """Return frames at the poses that were found for them."""
        moved = (
            frame if np.array_equal(fit.pose, frame.pose) else frame.at(fit.pose)
            for frame, fit in zip(frames, fits, strict=True)
        )
        return cls(tuple(frames), tuple(moved), tuple(fits))


class Keyframe(NamedTuple):
    """An object whose frames are aligned: what is drawn in its place, and the cameras of its streams."""

    content: PointObject
    aligned: Aligned
    cameras: Hashable  # None without streams


class Rig:
    """Cameras of streams that stand still: their frames share one alignment."""

    def __init__(self, aligned: Aligned):
        self.fits, self.sets, self.refined, self.spreads = aligned.fits, 1, 0, np.zeros(0)

    def refine(self, fits: Sequence[Fit]) -> None:
        """Average the poses with those that newer frames gave."""
        self.refined += 1
        share = 1 / (1 + self.refined)
        self.fits = tuple(
            old if not new.placed
            else old._replace(pose=_between(old.pose, new.pose, share), after=new.after, agrees=new.agrees)
            if old.placed
            else new
            for old, new in zip(self.fits, fits, strict=True)
        )  # fmt: skip

    def moved_cameras(self, spreads: NDArray[np.float64]) -> list[int]:
        """Return the numbers of frames that agree much less with all others than they did.

        spreads  (n,) of the depths between each frame and the other that agrees best with it, as shares of the depth
        """
        if not len(self.spreads):
            self.spreads = spreads
        self.spreads = np.minimum(self.spreads, spreads)
        is_moved = np.isfinite(spreads) & (spreads > MOVED * self.spreads + LEAST_MOVED)
        return np.flatnonzero(is_moved).tolist()


class Aligner:
    """Aligns the frames of objects, once each, and once for all frames of streams whose cameras stand still."""

    def __init__(self, gpu_scene: GpuScene):
        self._gpu_scene = gpu_scene
        self._objects: WeakKeyDictionary[PointObject, Keyframe] = WeakKeyDictionary()
        self._sets: dict[Hashable, Aligned] = {}  # by the frames and how their surface is found, the last ones last
        self._scene: tuple[Scene, Scene] | None = None  # the last one, and with its frames aligned
        self._rigs: dict[Hashable, Rig] = {}  # by what identifies the cameras, the last ones last

    def align(self, frames: Sequence[Frame], look: Appearance, count: Count) -> Aligned:
        """Return frames with corrected poses; there is a note on each that could not be placed."""
        fits = self._fits(frames, [frame.pose for frame in frames], look, count)
        for text in notes_on(frames, fits):
            print_note(text)
        return Aligned.of(frames, fits)

    def _fits(
        self, frames: Sequence[Frame], poses: Sequence[Matrix], look: Appearance, count: Count
    ) -> tuple[Fit, ...]:
        first, reduced = count.done, []
        for frame in frames:
            reduced.append(self._gpu_scene.read_reduced(frame, look))
            count.step()
        from ..estimation.alignment import align  # only here: most pictures align nothing

        fits = align(reduced, poses, count.step)
        count.step(alignment_steps(len(frames)) - (count.done - first))  # if there was less to do
        return tuple(fits)

    def aligned(self, scene: Scene, count: Count | None = None) -> Scene:
        """Return a scene in which the frames of each object that asks for it are aligned."""
        if not any(_asks(p.content) for p in scene.instances):
            return scene
        if self._scene is None or self._scene[0] is not scene:
            self._scene = scene, scene.with_every_node(lambda node: self._changes(node, count or Count()))
        return self._scene[1]

    def steps_of(self, scene: Scene) -> int:
        """Return how many steps `aligned` will count."""
        if self._scene is not None and self._scene[0] is scene:
            return 0
        objects = {p.content for p in scene.instances if _asks(p.content) and p.content not in self._objects}
        new = {(one.frames, surface_of(one.look)) for one in objects} - self._sets.keys()
        return sum(alignment_steps(len(frames)) for frames, _ in new if _cameras_of(frames) not in self._rigs)

    def found(self, drawables: Drawables) -> dict[Placed, Aligned]:
        """Return what was found about the poses of objects that were drawn."""
        known = {one.content: one.aligned for one in self._objects.values()}
        return {p: known[p.content] for p in drawables if p.content in known}

    def watch(self, drawables: Drawables) -> None:
        """Forget the alignment of streams of which a camera was moved since, and tell it."""
        if not self._rigs:
            return
        known = {one.content: one.cameras for one in self._objects.values() if one.cameras is not None}
        for p, drawn in drawables.items():
            cameras = known.get(p.content)
            if cameras not in self._rigs or not isinstance(drawn, ShownSet):
                continue
            if moved := self._rigs[cameras].moved_cameras(drawn.consensus.spreads):
                who = f"the camera of frame {moved[0]}" if len(moved) == 1 else f"one of the cameras of frames {moved}"
                print_note(f"{who} was moved: the frames are aligned again")
                del self._rigs[cameras]

    def _changes(self, node: Node, count: Count) -> dict[str, object]:
        return {"content": tuple(self._aligned(part, count) for part in contents_of(node))}

    def _aligned(self, part: Content, count: Count) -> Content:
        if not _asks(part):
            return part
        if part not in self._objects:
            found = self._of_set(part, count)
            drawn = PointObject(found.frames, look=replace(part.look, align=False))
            self._objects[part] = Keyframe(drawn, found, _cameras_of(part.frames))
        return self._objects[part].content

    def _of_set(self, part: PointObject, count: Count) -> Aligned:
        """Align frames, once for all looks of them."""
        key, cameras = (part.frames, surface_of(part.look)), _cameras_of(part.frames)
        if key in self._sets:
            self._sets[key] = self._sets.pop(key)  # the last one now
        else:
            aligned = self._of_rig(cameras, part, count) if cameras else self.align(part.frames, part.look, count)
            self._sets[key] = aligned
            while len(self._sets) > MOST_SETS:
                del self._sets[next(iter(self._sets))]
        return self._sets[key]

    def _of_rig(self, cameras: Hashable, part: PointObject, count: Count) -> Aligned:
        """Align frames of streams: those of cameras that are known already take over their poses."""
        rig = self._rigs.get(cameras)
        if rig is None:
            self._rigs[cameras] = Rig(self.align(part.frames, part.look, count))
            while len(self._rigs) > MOST_RIGS:
                del self._rigs[next(iter(self._rigs))]
            return Aligned.of(part.frames, self._rigs[cameras].fits)
        rig.sets += 1
        # earlier where a camera that gave no depth at first is not placed yet
        is_power, are_placed = rig.sets & (rig.sets - 1) == 0, all(fit.placed for fit in rig.fits)
        if rig.sets in REFINED or (is_power and not are_placed):
            rig.refine(self._fits(part.frames, [fit.pose for fit in rig.fits], part.look, Count()))
        return Aligned.of(part.frames, rig.fits)


def alignment_steps(frames: int) -> int:
    """Return how many steps aligning so many frames counts: each is read, then there are levels and checks."""
    from ..estimation.alignment import STEPS  # only here

    return frames + STEPS


def _cameras_of(frames: Sequence[Frame]) -> Hashable:
    """Return what identifies the cameras of streams and where they stand; None if a frame is of no stream."""
    if any(frame.source is None for frame in frames):
        return None
    return tuple((frame.source, frame.camera, frame.pose.tobytes()) for frame in frames)


def _between(one: Matrix, other: Matrix, share: float) -> Matrix:
    """Return a pose between two that are near each other, by a share of the way."""
    mixed = (1 - share) * one + share * other
    left, _, right = np.linalg.svd(mixed[:3, :3])
    mixed[:3, :3] = left @ right
    return mixed


def _asks(part: Content) -> bool:
    return isinstance(part, PointObject) and part.look.align and not part.is_single


def notes_on(frames: Sequence[Frame], fits: Sequence[Fit]) -> list[str]:
    """Return sentences about frames whose poses stay as given, in whole or in part, and about their colours."""
    count = len(fits)
    kept = [k for k, fit in enumerate(fits) if not fit.placed and count > 1]
    lonely = [k for k in kept if not fits[k].overlap]
    unsure = [k for k in kept if fits[k].overlap]
    notes = []
    if not all(fit.by_colors for fit in fits):
        alone = "the colours of the frames do not lie on their depth, which alone aligns them"
        notes.append(f"{alone}: are depth and colour pictures registered?")
    if lonely:
        notes.append(f"{_named(lonely, count, 'shares', 'share')} too little with the others: {_stays(lonely)}")
    if unsure:
        near = "its given pose" if len(unsure) == 1 else "their given poses"
        why = f"near {near} too little agrees with the others"
        notes.append(f"{_named(unsure, count)} could not be aligned, for {why}: {_stays(unsure)}")
    for few in sorted({len(fit.loose) for fit in fits if fit.placed} - {0}):
        loose = [k for k, fit in enumerate(fits) if fit.placed and len(fit.loose) == few]
        motions = _motions(frames[loose[0]], fits[loose[0]])
        whose = "" if len(loose) == 1 else f"of frame {loose[0]}: "
        free = f"neither depth nor colours fix {counted(few, 'motion')} of 6 ({whose}{motions})"
        notes.append(f"{_named(loose, count)}: {free}: there {_stays(loose)}")
    return notes


def _named(numbers: Sequence[int], count: int, one: str = "", several: str = "") -> str:
    """Return `frame 3 of 8 shares` or `frames 3, 5 of 8 share`."""
    names, words = ", ".join(map(str, numbers)), ("frame", one) if len(numbers) == 1 else ("frames", several)
    return f"{words[0]} {names} of {count} {words[1]}".rstrip()


def _stays(numbers: Sequence[int]) -> str:
    return "the given pose stays" if len(numbers) == 1 else "the given poses stay"


def _motions(frame: Frame, fit: Fit) -> str:
    """Return which motions of a frame nothing fixes, in its camera's axes."""
    axes = frame.pose[:3, :3].T
    texts = []
    for motion in fit.loose:
        turn, shift = axes @ motion[:3], axes @ motion[3:]
        kind, axis = ("turns about", turn) if np.linalg.norm(turn) > np.linalg.norm(shift) else ("shifts along", shift)
        axis = axis / np.linalg.norm(axis) * np.sign(axis[np.argmax(np.abs(axis))])
        texts.append(kind + " ({:.1f}, {:.1f}, {:.1f})".format(*(axis + 0.0)))
    return ", ".join(texts)


MOST_SEARCHED = 8  # frames: each is searched for beside each other


def search(gpu_scene: GpuScene, frames: Sequence[Frame], look: Appearance, count: Count) -> list[FoundPose]:
    """Return the poses of frames of which nothing is known; the first keeps its own. Raises ValueError for too many."""
    if len(frames) > MOST_SEARCHED:
        raise ValueError(f"poses are searched for at most {MOST_SEARCHED} frames at once, got {len(frames)}")
    reduced = []
    for frame in frames:
        reduced.append(gpu_scene.read_reduced(frame, look))
        count.step()
    from ..estimation.pose_search import search_poses  # only here

    found = search_poses(reduced, [frame.pose for frame in frames], count.step)
    count.step(count.all - count.done)  # if there was less to do
    return found


def search_steps(frames: int) -> int:
    """Return how many steps a search counts: each frame is read, each pair is compared, then all are aligned."""
    from ..estimation.alignment import STEPS  # only here

    return frames + comb(frames, 2) + STEPS


def notes_on_search(found: Sequence[FoundPose]) -> list[str]:
    """Return a sentence for each frame that was not found, or not surely."""
    notes = []
    for k, one in enumerate(found):
        if one.doubt and k:
            said = "is doubtful" if one.fit.placed else "was not found and stays as given"
            notes.append(f"the pose of frame {k} of {len(found)} {said}: {one.doubt}")
    return notes


NEAREST = 3  # keyframes that a frame is aligned to
MOST_KEYFRAMES = 16  # that are remembered, of about 6 MB each
NEW_KEYFRAME = 0.7  # overlap with the others below which a frame becomes one
LOST = 5  # frames one after the other that fit none, of which the last becomes one: the camera is elsewhere
ROUND = 1.0  # turn, radians, that counts as much as a shift by the scene's distance


class _Keyframe(NamedTuple):
    reduced: ReducedFrame
    pose: Matrix  # corrected


class PoseTrack:
    """The corrected poses of one sequence: that of its first frame stays."""

    def __init__(self, gpu_scene: GpuScene, look: Appearance):
        self._gpu_scene, self._look = gpu_scene, look
        self._keyframes: deque[_Keyframe] = deque(maxlen=MOST_KEYFRAMES)
        self._correction = np.eye(4)  # of the last frame: from its given pose to the one that was found
        self._lost = 0  # frames up to now, one after the other, that fit no keyframe

    def follow(self, frame: Frame) -> Frame:
        """Return the next frame at its corrected pose; where it fits no keyframe, it is moved as the one before.

        The given pose is expected to be off by what the last one was: drift grows slowly.
        """
        reduced, start = self._gpu_scene.read_reduced(frame, self._look), self._correction @ frame.pose
        if not self._keyframes:
            if reduced.points_known:
                self._keyframes.append(_Keyframe(reduced, start))
            return frame
        near = sorted(self._keyframes, key=lambda one: _apart(one.pose, start, reduced))[:NEAREST]
        poses = [*(one.pose for one in near), start]
        from ..estimation.alignment import align  # only here

        *_, fit = align([*(one.reduced for one in near), reduced], poses, known=len(near))
        self._lost = 0 if fit.placed else self._lost + 1
        if self._lost == 1:
            text = "a frame of the sequence fits none before it: until one fits, poses are corrected as the last one"
            print_note(text)
        if reduced.points_known and (fit.overlap < NEW_KEYFRAME if fit.placed else self._lost % LOST == 0):
            self._keyframes.append(_Keyframe(reduced, fit.pose))
        self._correction = fit.pose @ np.linalg.inv(frame.pose)
        return frame.at(fit.pose)


def _apart(pose: Matrix, other: Matrix, frame: ReducedFrame) -> float:
    """Return how differently two poses show a frame's scene."""
    cosine = np.clip((np.trace(pose[:3, :3].T @ other[:3, :3]) - 1) / 2, -1, 1)
    scale = float(np.linalg.norm(frame.middle)) or 1.0
    return float(np.linalg.norm(pose[:3, 3] - other[:3, 3])) / scale + float(np.arccos(cosine)) / ROUND
