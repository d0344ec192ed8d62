"""What a window shows, and all that is undone of it: frames, views or a scene, their view, lights and switches."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import check_count
from ..notes.words import option
from ..scene.camera import Camera
from ..scene.cloud import CloudStyle, PointCloud
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.light import Light
from ..scene.node import Node, clouds_in, with_drawn
from ..scene.orbit import OrbitStage, Pair, State

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
    def picture_camera(self) -> Camera:
        """The camera that the viewer starts from, in its own size."""
        return self.home.picture_camera

    @property
    def pose(self) -> NDArray[np.float64]:
        """(4, 4) camera-to-world of that camera."""
        return self.home.pose

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


def scene_in(shown: Shown | None) -> Scene | None:
    """Return what is shown if it is a scene."""
    return shown if isinstance(shown, Scene) else None


def views_in(shown: Shown) -> Views | None:
    """Return what is shown if it is several views of one thing."""
    return shown if isinstance(shown, Views) else None


def home_of(shown: Shown) -> Frame | Scene:
    """Return whose camera looks."""
    views = views_in(shown)
    return views.home if views else shown  # type: ignore[return-value]


def frame_in(shown: Shown) -> Frame | None:
    """Return what is shown if it is a single frame."""
    return shown.frames[0] if len(shown.frames) == 1 else None


def camera_of(shown: Shown) -> Camera:
    """Return its own camera, in its own size."""
    camera = shown.picture_camera
    assert camera is not None  # `framed` gave scenes a camera
    return camera


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
    scene = scene_in(shown)
    return [cloud for _, node in scene.every_node() for cloud in clouds_in(node)] if scene else []


def _restyled(node: Node, look: Callable[[PointCloud], Any]) -> dict[str, Any]:
    return with_drawn(node, lambda part: part.styled(**look(part)) if part.clouds else part)


def restyled(scene: Scene, look: Callable[[PointCloud], CloudStyle]) -> Scene:
    """Return a scene whose clouds are drawn as a function of each asks."""
    return scene.with_every_node(lambda node: _restyled(node, look))


def resized(scene: Scene, factor: float) -> tuple[Scene, str]:
    """Return a scene with larger or smaller points of its clouds, and what there is to say."""

    def look(cloud: PointCloud) -> CloudStyle:
        number, unit = size_of(cloud)
        larger = number * factor
        return {"point_size": with_unit(min(max(larger, SMALLEST), LARGEST) if unit else larger, unit)}

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


NodeSwitch = tuple[bool, tuple[Any, ...]]  # whether a node is visible; splat and point size of each of its clouds
Switches = tuple[bool | NodeSwitch, ...]
_known: WeakKeyDictionary[Scene, Switches] = WeakKeyDictionary()  # asked for at each event


def switches_of(shown: Shown) -> Switches:
    """Return one for each view, or one for each node of a scene; a frame has none."""
    if scene := scene_in(shown):
        if scene not in _known:
            _known[scene] = tuple(
                (node.visible, tuple((cloud.splat, cloud.point_size) for cloud in clouds_in(node)))
                for _, node in scene.every_node()
            )
        return _known[scene]
    return views.on if (views := views_in(shown)) else ()


def as_switched(shown: Shown, switches: Switches) -> Shown:
    """Return what is shown, with other switches. Those of something else change nothing."""
    now = switches_of(shown)
    if now == switches or len(now) != len(switches):
        return shown
    if views := views_in(shown):
        return replace(views, on=switches)
    scene = scene_in(shown)
    assert scene, "a frame has no switches"
    for (path, node), before, after in zip(list(scene.every_node()), now, switches, strict=True):
        scene = scene.with_node(path, **_changes(node, after)) if before != after else scene
    return scene


def _changes(node: Node, switch: Any) -> Any:
    visible, looks = switch
    following = iter(looks)
    content = _restyled(node, lambda _: dict(zip(("splat", "point_size"), next(following), strict=True)))
    return {"visible": visible, **(content if looks else {})}


STEPS = 200  # that can be undone
PAUSE = 0.7  # seconds between two changes of one kind that are one step: of the wheel, of a slider


class Snapshot(NamedTuple):
    """All that is undone: view, lights, look and switches. Whether help, panel and readout are shown is not.

    held    the kind of light that the mouse holds
    lights  the others
    number  of the light that the mouse holds
    names   of the lights, by their numbers; those without one may be missing at the end
    switches  of what is shown: views or nodes that are off, how clouds look
    """

    state: State
    stage: OrbitStage
    held: Light
    lights: tuple[Light, ...]
    number: int = 0
    names: tuple[str, ...] = ()
    switches: Switches = ()

    def shows(self, other: Snapshot) -> bool:
        """Whether all that is undone is the same."""
        return self.stage is other.stage and self.beside(other)._replace(stage=None) == other._replace(stage=None)

    def beside(self, now: Snapshot) -> Snapshot:
        """The same, with help, panel and readout as they are at another moment."""
        state = now.state
        return self._replace(state=replace(self.state, help=state.help, panel=state.panel, readout=state.readout))


class History:
    """Remembers the moments before the last steps."""

    def __init__(self, now: Snapshot):
        self._past: deque[Snapshot] = deque(maxlen=STEPS)
        self._future: deque[Snapshot] = deque(maxlen=STEPS)
        self._now = now
        self._rest: Pair = now.state.light_at  # where the light was after the last step
        self._kind: Hashable = None
        self._until = 0.0

    def follow(self, now: Snapshot) -> None:
        """Something changed that is no step: the light went with the mouse, an application moved something."""
        self._now = now

    def act(self, now: Snapshot, kind: Hashable = None, time: float = 0.0, pause: float = PAUSE) -> None:
        """Something may have changed by a step. Changes of one kind with no longer pause (seconds) are one step.

        kind  None: a step of its own; "place": it takes the light back to where it was after the step before
        """
        if now.shows(self._now):
            return
        if kind is None or kind != self._kind or time > self._until:
            before = self._now
            if kind == "place":
                before = before._replace(state=replace(before.state, light_at=self._rest))
            self._past.append(before)
        elif now.shows(self._past[-1]):  # there and back
            self.drop_step(now)
            return
        self._future.clear()
        self._kind, self._until = kind, time + pause
        self._settle(now)

    def undo(self, now: Snapshot) -> Snapshot | None:
        """What was before the last step; None if there is none."""
        return self._go(now, self._past, self._future)

    def redo(self, now: Snapshot) -> Snapshot | None:
        """What was before the last undo; None if another step was made since."""
        return self._go(now, self._future, self._past)

    def drop_step(self, now: Snapshot) -> None:
        """The last step becomes a part of the one that follows."""
        self._past.pop()
        self._kind = None
        self.follow(now)

    def withdraw(self, now: Snapshot) -> None:
        """The last step did not come to be: this is what was before it."""
        if self._past and now.shows(self._past[-1]):
            self._past.pop()
        self._kind = None
        self._settle(now)

    def _go(self, now: Snapshot, there: deque[Snapshot], back: deque[Snapshot]) -> Snapshot | None:
        if not there:
            return None
        back.append(now)
        self._kind = None
        self._settle(there.pop())
        return self._now

    def _settle(self, now: Snapshot) -> None:
        self._now, self._rest = now, now.state.light_at
