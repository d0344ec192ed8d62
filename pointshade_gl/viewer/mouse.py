"""What the mouse does: moves, buttons and the wheel change the State. The help in the window shows the same table."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from ..scene.camera import Camera
from ..scene.orbit import DEGREES, Pair, Stage, State, rims_from
from .events import Event

CATCH_UP = 3.0  # how fast the light approaches the mouse, per rim that the mouse moves
HAND = 4.0  # pixels at scale 1: who moves less while a button is down, clicks
DOUBLE = 0.4  # seconds between two clicks that are one double click
MOMENT = 0.25  # seconds that the mouse stays where it holds the light on purpose
NEAR = 0.1  # rims: who moves less in a moment, stays
MOUSE = (
    ("mouse", "move the light (in light mode)"),
    ("click", "place the light: it stays until L"),
    ("Ctrl+Shift+drag", "move the light (always)"),
    ("Shift+wheel", "move the light nearer or farther"),
    ("right drag", "turn the environment"),
    ("drag", "orbit"),
    ("Ctrl+drag, middle drag", "pan"),
    ("wheel", "zoom"),
    ("double click", "turn around this point, or the middle"),
    ("click, drag the bar", "jump through a sequence"),
    ("drop files", "open a folder, depth, a scene, clouds"),
)


@dataclass(frozen=True)
class Dwell:
    """Where the mouse held the light on purpose: where it stayed for a moment, not where it came through on its way.

    kept    the light that was held on purpose
    around  the mouse has been near this place since then
    last    the light after the last move
    """

    kept: Pair = (0.0, 0.0)
    around: Pair = (0.0, 0.0)
    since: float = 0.0
    last: Pair | None = None

    def moved(self, time: float, mouse: Pair, before: Pair, after: Pair) -> Dwell:
        """Follow the mouse to a place, to which it took the light along. All places in rims, the time in seconds."""
        if self._is_on_purpose(time, before):
            return Dwell(before, mouse, time, after)
        if math.dist(mouse, self.around) > NEAR:
            return replace(self, around=mouse, since=time, last=after)
        return replace(self, last=after)

    def left(self, time: float, light: Pair) -> Pair:
        """Return the light's place after the mouse left: that before its way out."""
        return light if self._is_on_purpose(time, light) else self.kept

    def _is_on_purpose(self, time: float, light: Pair) -> bool:
        """If somebody else put the light there, that was on purpose, too."""
        return light != self.last or time - self.since >= MOMENT


@dataclass(frozen=True)
class Mouse:
    """Turns moves, buttons and the wheel into changes of the State. The light never jumps when the mouse takes it.

    drag     "orbit", "pan", "light", "environment", or "" when no button is down
    drags    how many there have been
    clicks   1 after an event that ended a click, 2 after one that began a double click, otherwise 0
    button   that began the drag
    last     where it was
    pressed  what began the drag, while the mouse has not left the place
    clicked  what began the last click, if that was the last press
    """

    drag: str = ""
    drags: int = 0
    clicks: int = 0
    button: str = ""
    last: Pair | None = None
    dwell: Dwell = Dwell()
    pressed: Event | None = None
    clicked: Event | None = None

    @property
    def turns(self) -> bool:
        """Whether it moves the viewer."""
        return self.drag in ("orbit", "pan") and self.pressed is None

    def handle(
        self, event: Event, state: State, stage: Stage, camera: Camera, scale: float = 1.0
    ) -> tuple[Mouse, State]:
        """Return mouse and state after the event, in a picture of this camera.

        scale  pixels are so much smaller than usual
        """
        mouse = replace(self, clicks=0)
        if event.kind == "wheel":
            return mouse, state.light_reached(event.steps) if event.shift else state.zoomed(event.steps)
        if event.kind == "press" and not self.drag:
            return mouse._press(event, scale), state
        if event.kind == "release" and event.key == self.button:
            return mouse._release(), state
        if event.kind == "leave" and not self.drag:
            return replace(mouse, last=None), mouse._leave(event, state)
        if event.kind == "move" and not _is_same_place(event, self.pressed, scale):
            return mouse._move(event, state, stage, camera)
        return mouse, state

    def _press(self, event: Event, scale: float) -> Mouse:
        drag = ""
        if event.key == "middle" or (event.key == "left" and event.ctrl and not event.shift):
            drag = "pan"
        elif event.key == "left":
            drag = "light" if event.ctrl else "orbit"
        elif event.key == "right":
            drag = "environment"
        mouse = replace(self, drag=drag, drags=self.drags + 1, button=event.key, last=(event.x, event.y), clicked=None)
        if drag != "orbit":
            return mouse
        before = self.clicked
        if before and _is_same_place(event, before, scale) and event.time - before.time < DOUBLE:
            return replace(mouse, pressed=event, clicks=2)
        return replace(mouse, pressed=event, clicked=event)

    def _release(self) -> Mouse:
        clicked = self.clicked if self.pressed else None
        return replace(self, drag="", pressed=None, clicks=int(clicked is not None), clicked=clicked)

    def _leave(self, event: Event, state: State) -> State:
        """The light stays where it was held before the mouse began its way out."""
        return replace(state, light_at=self.dwell.left(event.time, state.light_at)) if state.light_mode else state

    def _move(self, event: Event, state: State, stage: Stage, camera: Camera) -> tuple[Mouse, State]:
        now = event.x, event.y
        last, mouse = self.last or now, replace(self, pressed=None, last=now)
        dx, dy = now[0] - last[0], now[1] - last[1]
        if self.drag == "orbit":
            return mouse, state.orbited(dx, dy, min(camera.width, camera.height), stage.axis)
        if self.drag == "environment":
            return mouse, state.environment_turned(dx / min(camera.width, camera.height) * DEGREES)
        if self.drag == "pan":
            return mouse, state.panned(dx, dy, camera.fx)
        if now == last or (self.drag != "light" and not state.light_mode):
            return mouse, state
        moved = _move_light(last, now, state, stage, camera)
        if not self.drag:
            rims = rims_from((0, 0), *now, camera)
            mouse = replace(mouse, dwell=self.dwell.moved(event.time, rims, state.light_at, moved.light_at))
        return mouse, moved


def _move_light(last: Pair, now: Pair, state: State, stage: Stage, camera: Camera) -> State:
    """The light follows the mouse. If they are apart when the mouse takes it, the gap shrinks with each move."""
    middle = state.middle(stage, camera)
    before, after = rims_from(middle, *last, camera), rims_from(middle, *now, camera)
    left = math.exp(-CATCH_UP * math.dist(before, after))
    (x, y), (was_x, was_y) = state.light_at, before
    return replace(state, light_at=(after[0] + left * (x - was_x), after[1] + left * (y - was_y)))


def _is_same_place(event: Event, other: Event | None, scale: float) -> bool:
    return other is not None and math.dist((event.x, event.y), (other.x, other.y)) < HAND * scale
