"""Undo and redo, and the switches of what is shown: what was before each step of the user."""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable
from dataclasses import replace
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

from ..scene.cloud import PointCloud
from ..scene.graph import Scene
from ..scene.light import Light
from ..scene.node import Node
from ..scene.orbit import OrbitStage, Pair, State
from .views import Shown, Views, parts_of

NodeSwitch = tuple[bool, tuple[Any, ...]]  # whether a node is visible; splat and point size of each of its clouds
Switches = tuple[bool | NodeSwitch, ...]
_known: WeakKeyDictionary[Scene, Switches] = WeakKeyDictionary()  # asked for at each event


def switches_of(shown: Shown) -> Switches:
    """Return one for each view, or one for each node of a scene; a frame has none."""
    if isinstance(shown, Views):
        return shown.on
    if not isinstance(shown, Scene):
        return ()
    if shown not in _known:
        _known[shown] = tuple(_switch_of(node) for _, node in shown.every_node())
    return _known[shown]


def as_switched(shown: Shown, switches: Switches) -> Shown:
    """Return what is shown, with other switches. Those of something else change nothing."""
    now = switches_of(shown)
    if now == switches or len(now) != len(switches):
        return shown
    if isinstance(shown, Views):
        return replace(shown, on=switches)
    assert isinstance(shown, Scene), "a frame has no switches"
    nodes = list(shown.every_node())
    for (path, node), before, after in zip(nodes, now, switches, strict=True):
        if before != after:
            shown = shown.with_node(path, **_changes(node, after))
    return shown


def _switch_of(node: Node) -> NodeSwitch:
    clouds = (part for part in parts_of(node) if isinstance(part, PointCloud))
    return node.visible, tuple((cloud.splat, cloud.point_size) for cloud in clouds)


def _changes(node: Node, switch: Any) -> Any:
    visible, looks = switch
    if not looks:
        return {"visible": visible}
    following = iter(looks)
    parts = []
    for part in parts_of(node):
        if isinstance(part, PointCloud):
            splat, size = next(following)
            part = part.styled(splat=splat, point_size=size)
        parts.append(part)
    return {"visible": visible, "content": tuple(parts)}


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
