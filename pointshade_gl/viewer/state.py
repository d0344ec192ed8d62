"""What a window shows, and all that is undone of it: frames, views or a scene, their view, lights and switches; and the
picture of them, as `Renderer.render` is asked for it."""

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
from ..renderer.requests import RenderRequest
from ..scene.appearance import Material
from ..scene.camera import Camera
from ..scene.cloud import CloudStyle, PointCloud
from ..scene.frame import Frame
from ..scene.graph import Scene, shaded, without_environment
from ..scene.light import Light
from ..scene.node import Node, clouds_in, with_drawn
from ..scene.orbit import UPPER_LEFT, OrbitStage, Pair, State
from ..scene.settings import Metering

VIEWS = 8  # that are merged unless another number is asked for


@dataclass(frozen=True, eq=False)
class Views:
    """Frames of one thing that are drawn as one object."""

    frames: tuple[Frame, ...]  # all of them, also those that are off
    names: tuple[str, ...]  # of the frames, for the panel
    home: Frame  # the frame whose camera and pose the viewer starts from
    on: tuple[bool, ...]  # the switch of each frame; one at least is on
    kind: str = "frame"  # what the names are of, in front of each name

    @classmethod
    def of(cls, found: Mapping[int, Frame], home: int = -1) -> Views:
        """Frames of a sequence by their numbers, all on. home: the number of one of them; otherwise it is the first."""
        first = next(iter(found.values()))
        return cls(tuple(found.values()), tuple(map(str, found)), found.get(home, first), (True,) * len(found))

    @cached_property
    def shown(self) -> tuple[Frame, ...]:
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
    camera = shown.picture_camera
    assert camera is not None  # `framed` gave scenes a camera
    return camera


def check_views(views: int | str | Sequence[int]) -> int | Sequence[int] | None:
    """How many views are merged, or which; None for "all". Raises ValueError for anything else."""
    if isinstance(views, tuple | list):
        return tuple(check_count(k, f"{option('views')} must hold numbers of frames; each") for k in views)
    return None if views == "all" else check_count(views, f"{option('views')} must be 'all', or it", 2)


MAX_CLOUD_SIZE = 100.0  # pixels or spacings
MIN_CLOUD_SIZE = 0.1
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
    """Return a scene with larger or smaller points of its clouds, and a message."""

    def look(cloud: PointCloud) -> CloudStyle:
        number, unit = size_of(cloud)
        larger = number * factor
        return {"point_size": with_unit(min(max(larger, MIN_CLOUD_SIZE), MAX_CLOUD_SIZE) if unit else larger, unit)}

    changed = restyled(scene, look)
    number, unit = size_of(clouds_of(changed)[0])
    end = {MIN_CLOUD_SIZE: ", the smallest", MAX_CLOUD_SIZE: ", the largest"}.get(number, "") if unit else ""
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
    """All that is undone: view, lights, look and switches. Whether help, panel and readout are shown is not."""

    state: State
    stage: OrbitStage
    held: Light  # the kind of light that the mouse holds
    lights: tuple[Light, ...]  # the others
    number: int = 0  # of the light that the mouse holds
    names: tuple[str, ...] = ()  # of the lights, by their numbers; those without one may be missing at the end
    switches: Switches = ()  # of what is shown: views or nodes that are off, how clouds look

    def shows(self, other: Snapshot) -> bool:
        """Whether all that is undone is the same."""
        return self.beside(other) == other

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
        """Something may have changed by a step. Changes of one kind with no longer pause (seconds) are one step. kind:
        None: a step of its own; "place": it takes the light back to where it was after the step before."""
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


@dataclass(frozen=True, eq=False)
class ShownPicture:
    """A picture of what is shown, by a camera that is fitted to its size."""

    now: Snapshot  # view, lights and look
    shown: Shown  # the frame, the views or the scene
    camera: Camera
    # exposure and fill as of OutputSettings: found for the first picture, then the same, so that light is seen to
    # grow or fade
    metered: tuple[float | Metering, float | None] = "sensor", None
    plays: bool = False  # whether the next frame comes by itself

    @cached_property
    def content(self) -> tuple[Any, ...]:
        """Everything that it depends on, to be compared."""
        state = self.now.state
        if state.help or state.panel or state.readout is not None:
            state = replace(state, help=False, panel=False, readout=None)
        if not state.is_lit:  # the light may go on following the mouse
            return replace(state, light_at=UPPER_LEFT), self.shown, self.camera
        return state, self.now.lights, self.now.held, self.shown, self.camera

    def coarser(self, times: int) -> ShownPicture:
        """Return the same in so many times fewer pixels, both ways."""
        if times == 1:
            return self
        width, height = (max(round(side / times), 1) for side in (self.camera.width, self.camera.height))
        return replace(self, camera=self.camera.resized(width, height))

    @cached_property
    def pose(self) -> NDArray[np.float64]:
        """(4, 4) camera-to-world of who looks."""
        return self.shown.pose @ self.now.state.pose(self.now.stage)

    @cached_property
    def lights(self) -> list[Light]:
        """The light that the mouse holds, then the others."""
        held = self.now.state.light(self.now.stage, self.shown.pose, self.now.held)
        lights, is_kept = (held, *self.now.lights), self.now.state.shadows
        return [light if is_kept or not light.shadow else replace(light, shadow=False) for light in lights]

    def request(self, samples: int = 1, rests: bool = True) -> RenderRequest:
        """Return what a renderer is asked for. rests: it will be refined no more, or is already."""
        state, scene, views = self.now.state, scene_in(self.shown), views_in(self.shown)
        plain: dict[str, Any] = {"background": None, "ground": False, "ground_height": None, "samples": samples}
        plain["exposure"], plain["fill"] = self.metered
        if not rests and state.finish.ambient_occlusion is None and (self.plays or scene):
            plain["ambient_occlusion"] = False  # until it rests: it is found for each frame, in scenes for each view
        changes = {name: value for name, value in plain.items() if getattr(state.finish, name) != value}
        finish = replace(state.finish, **changes) if changes else state.finish
        if scene is None:
            look = state.look if state.lit else state.look.as_taken
            source: Any = views.shown if views else self.shown
            return RenderRequest(source, self.lights, look, self.camera, self.pose, finish=finish)
        scene = without_environment(scene) if finish.environment is None and scene.environment else scene
        shading = "none" if not state.lit else state.look.shading if state.look.shading != "phong" else None
        return RenderRequest(shaded(scene, shading), self.lights, camera=self.camera, pose=self.pose, finish=finish)

    @property
    def preparation(self) -> tuple[tuple[Any, ...], str] | None:
        """Return what must be found before this can be drawn, and takes long: something that compares as what that
        depends on, and what the user reads meanwhile; None if nothing does."""
        state, scene, views = self.now.state, scene_in(self.shown), views_in(self.shown)
        look = state.look if state.lit and state.finish.is_light else state.look.as_taken
        if scene:
            return tuple(placed.content for placed in scene.instances), "preparing the scene"
        if views is None:
            return ((self.shown,), "dividing the light out") if look.finds_light else None
        needs = replace(look.of_points, shading="none", material=Material())
        what = f"{len(views.shown)} views"
        titles = (look.remove_highlights, f"taking the highlights out of {what}"), (look.align, f"aligning {what}")
        return (views.shown, needs), next((title for on, title in titles if on), f"merging {what}")

    def most_samples(self, samples: int) -> int:
        """Return as many, or 1 for a photograph seen as it was taken: it has no more, and stays sharp."""
        return 1 if self._is_photograph else samples

    @cached_property
    def _is_photograph(self) -> bool:
        state, stage = self.now.state, self.now.stage
        is_own = frame_in(self.shown) is not None and self.camera == camera_of(self.shown)
        is_plain = state.finish.is_light and (not state.lit or state.look.shading == "none")
        is_there = is_own and is_plain and np.allclose(state.pose(stage), np.eye(4), rtol=0, atol=1e-9 * stage.radius)
        return bool(is_there)
