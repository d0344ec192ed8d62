"""What a window shows: a frame, a scene with clouds, or several views of one thing as one object."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import check_count
from ..notes.words import option
from ..scene.camera import Camera
from ..scene.cloud import CloudLook, PointCloud
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.node import Node, NodeOptions

VIEWS = 8  # that are merged unless another number is asked for


@dataclass(frozen=True, eq=False)
class Views:
    """Frames of one thing that are drawn as one object.

    frames  all of them, also those that are off
    names   of the frames, for the panel
    home    the frame whose camera and pose the viewer starts from
    on      the switch of each frame; one at least is on
    kind    what the names are of, in front of each name
    """

    frames: tuple[Frame, ...]
    names: tuple[str, ...]
    home: Frame
    on: tuple[bool, ...]
    kind: str = "frame"

    @classmethod
    def of(cls, found: Mapping[int, Frame], home: int = -1) -> Views:
        """Frames of a sequence by their numbers, all on. home: the number of one of them; otherwise it is the first."""
        first = next(iter(found.values()))
        return cls(tuple(found.values()), tuple(map(str, found)), found.get(home, first), (True,) * len(found))

    @cached_property
    def shown(self) -> tuple[Frame, ...]:
        """The frames that are on."""
        return tuple(frame for frame, on in zip(self.frames, self.on, strict=True) if on)

    @property
    def shown_names(self) -> list[str]:
        return [name for name, on in zip(self.names, self.on, strict=True) if on]

    @property
    def points_known(self) -> int:
        """How many points the frames that are on have."""
        return sum(frame.points_known for frame in self.shown)

    def switched(self, k: int, on: bool) -> Views:
        """The same with one frame switched on or off. The last one that is on stays on."""
        changed = (*self.on[:k], on, *self.on[k + 1 :])
        return replace(self, on=changed) if any(changed) else self

    def all_on(self) -> Views:
        return replace(self, on=(True,) * len(self.on))

    def with_frames(self, new: Sequence[Frame | None]) -> Views:
        """The same with new frames in the place of some (None: it stays). Home is the first one then."""
        frames = tuple(after or before for before, after in zip(self.frames, new, strict=True))
        return replace(self, frames=frames, home=frames[0])


Shown = Frame | Scene | Views


def home_of(shown: Shown) -> Frame | Scene:
    """Return whose camera looks."""
    return shown.home if isinstance(shown, Views) else shown


def camera_of(shown: Shown) -> Camera:
    """Return its own camera, in its own size."""
    home = home_of(shown)
    camera = home.picture_camera if isinstance(home, Frame) else home.camera
    assert camera is not None  # `framed` gave scenes a camera
    return camera


def pose_of(shown: Shown) -> NDArray[np.float64]:
    """Return (4, 4) camera-to-world of its own camera."""
    return np.asarray(home_of(shown).pose)


def check_views(views: int | str | Sequence[int]) -> int | Sequence[int] | None:
    """How many views are merged, or which; None for "all". Raises ValueError for anything else."""
    if isinstance(views, tuple | list):
        return tuple(check_count(k, f"{option('views')} must hold numbers of frames; each") for k in views)
    return None if views == "all" else check_count(views, f"{option('views')} must be 'all', or it", 2)


LARGEST = 100.0  # pixels or spacings
SMALLEST = 0.1
UNITS = {"x": "times the spacing of the points", "px": "pixels", "": "(world units)"}


def clouds_of(shown: Shown) -> list[PointCloud]:
    """Return the clouds of a scene, also those that are hidden; none of anything else."""
    nodes = (node for _, node in shown.every_node()) if isinstance(shown, Scene) else ()
    return [part for node in nodes for part in parts_of(node) if isinstance(part, PointCloud)]


def restyled(scene: Scene, look: Callable[[PointCloud], CloudLook]) -> Scene:
    """Return a scene whose clouds are drawn as a function of each says."""

    def changes(node: Node) -> NodeOptions:
        return {"content": tuple(p.styled(**look(p)) if isinstance(p, PointCloud) else p for p in parts_of(node))}

    return scene.with_every_node(changes)  # type: ignore[arg-type]


def resized(scene: Scene, factor: float) -> tuple[Scene, str]:
    """Return a scene with larger or smaller points of its clouds, and what there is to say."""

    def look(cloud: PointCloud) -> CloudLook:
        number, unit = size_of(cloud)
        return {"point_size": with_unit(_limited(number * factor, unit), unit)}

    changed = restyled(scene, look)
    number, unit = size_of(clouds_of(changed)[0])
    end = {SMALLEST: ", the smallest", LARGEST: ", the largest"}.get(number, "") if unit else ""
    return changed, f"point size: {number:g} {UNITS[unit]}{end}"


def size_of(cloud: PointCloud) -> tuple[float, str]:
    """Return the size of a cloud's points and its unit. Sizes of its own are 1."""
    return (1.0, "x") if cloud.sizes is not None and cloud.point_size is None else cloud.radius_rule


def with_unit(number: float, unit: str) -> float | str:
    """Return a size as `PointCloud.point_size` has it."""
    return f"{number:.3g}{unit}" if unit else float(f"{number:.3g}")


def _limited(number: float, unit: str) -> float:
    return min(max(number, SMALLEST), LARGEST) if unit else number


def parts_of(node: Node) -> tuple:
    """Return what a node holds."""
    return node.content if isinstance(node.content, tuple) else () if node.content is None else (node.content,)
