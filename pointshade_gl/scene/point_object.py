"""A point object: one frame, or several frames of the same object, drawn as splats with a chosen appearance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from ..checks.arguments import check_type, is_a, items_of
from ..notes.words import counted, option, shown
from .appearance import FRAME_SPLATS, Look, LookOptions, Material
from .bounds import median
from .frame import Frame
from .point_cloud import PointCloud
from .values import Value

if TYPE_CHECKING:
    from typing_extensions import Unpack

MOST_FRAMES = 200  # of one object


@dataclass(frozen=True, eq=False)
class PointObject(Value):
    """A frame as an object of a scene: each pixel with a depth is a splat, lit like everything else.

    Parameters
    ----------
    frame : Frame or sequence of Frame
        Its pose places it under the node's transform. Up to 200 frames of one thing are drawn as one object by their
        poses, each from the points of its own depth. The first is kept as `frame`, the rest as `others`.
    material : Material, optional
        How the surface answers light, in place of a look.
    look : Look, optional
        How the object is drawn.
    others : sequence of Frame
        Further frames of the same thing.
    **options
        Values of `Look` in place of a look: `PointObject(frame, splat="round")`.

    Raises
    ------
    TypeError, ValueError
        As `Look` and `Look.for_frame`.
    TypeError
        For a look together with its values.
    ValueError
        For no frames or more than 200, and for several frames with splat="mesh" or with options that are arrays.
    """

    frame: Frame
    look: Look
    others: tuple[Frame, ...] = ()

    def __init__(
        self,
        frame: Frame | Sequence[Frame],
        material: Material | None = None,
        *,
        look: Look | None = None,
        others: Sequence[Frame] = (),
        **options: Unpack[LookOptions],
    ):
        if look is not None and (material is not None or options):
            raise TypeError("pass a look, or its values one by one, not both")
        if look is None:
            look = Look(Material() if material is None else material, **options)
        check_type(look, Look, "look")
        more = items_of(others)
        if more is None:
            raise TypeError(f"others must be a sequence of frames, got {shown(others)}")
        frame, *rest = check_frames((*check_frames(frame), *more))
        if rest:
            uniform(look)
        if rest and look.splat == "mesh":
            forms = option("splat", *FRAME_SPLATS[:-1])
            raise ValueError(f"a mesh is that of one frame, got {1 + len(rest)}: merge them with {forms}")
        object.__setattr__(self, "frame", frame)
        object.__setattr__(self, "look", look.for_frame(frame.depth))
        object.__setattr__(self, "others", tuple(rest))

    def __repr__(self) -> str:
        return f"PointObject({self.frame if self.is_single else counted(len(self.frames), 'frame')})"

    @property
    def is_single(self) -> bool:
        """Return whether there is one frame, not several of one thing."""
        return not self.others

    @property
    def frames(self) -> tuple[Frame, ...]:
        """Return all frames."""
        return self.frame, *self.others

    @property
    def members(self) -> tuple[PointObject, ...]:
        """Return each frame as a point object of its own."""
        return (self,) if self.is_single else self._members  # keeping itself, it would outlive its last use

    @cached_property
    def _members(self) -> tuple[PointObject, ...]:
        return tuple(PointObject(frame, look=self.look) for frame in self.frames)

    @property
    def points_known(self) -> int:
        """Return the number of points in the frames."""
        return sum(frame.points_known for frame in self.frames)

    @cached_property
    def scale(self) -> float:
        """Return the frame's scale; of several frames the median."""
        return median([frame.scale for frame in self.frames])


def uniform(look: Look) -> Look:
    """Return the look of several frames. Raises ValueError for arrays."""
    if not look.is_uniform:
        raise ValueError("options of several frames hold for all of them: arrays belong to one frame")
    return look


def check_frames(frames: Frame | Sequence[Frame]) -> tuple[Frame, ...]:
    """One frame or several as a tuple. Raises TypeError for anything else, ValueError for none or too many."""
    items = [frames] if isinstance(frames, Frame) else frames
    if any(isinstance(one, PointCloud) for one in (items if is_a(items, Sequence) else [items])):
        raise TypeError("a point cloud is no frame: draw it alone, or put it into a Node of a Scene as it is")
    if not is_a(items, Sequence) or is_a(items, str, bytes):
        raise TypeError(f"frame must be a Frame or a sequence of frames, got {shown(frames)}")
    if not 1 <= len(items) <= MOST_FRAMES:
        raise ValueError(f"an object has 1 to {MOST_FRAMES} frames, got {len(items)}")
    return tuple(check_type(item, Frame, "frame" if len(items) == 1 else f"frame {k}") for k, item in enumerate(items))
