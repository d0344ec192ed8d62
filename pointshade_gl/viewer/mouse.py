"""What the mouse does: moves, buttons and the wheel change the State. The help in the window shows the same table."""

from __future__ import annotations

import math
from dataclasses import replace

from ..scene.camera import Camera
from ..scene.orbit_state import Pair, State, rims_from
from ..scene.orbit_target import Stage
from .dwell import Dwell
from .events import Event

CATCH_UP = 3.0  # how fast the light approaches the mouse, per rim that the mouse moves
HAND = 4.0  # pixels at scale 1: who moves less while a button is down, clicks
DOUBLE = 0.4  # seconds between two clicks that are one double click
MOUSE = (
    ("mouse", "move the light (in light mode)"),
    ("click", "place the light: it stays until L, clicks leave it alone"),
    ("Ctrl+Shift+drag", "move the light (always)"),
    ("Shift+wheel", "move the light nearer or farther"),
    ("drag", "orbit"),
    ("Ctrl+drag, middle drag", "pan"),
    ("wheel", "zoom"),
    ("double click", "turn around this point, or the object's middle"),
    ("click, drag on the bar", "jump through a sequence"),
    ("drop files", "open a folder, a depth file, a scene, or depth and colour"),
)


class Mouse:
    """Turns moves, buttons and the wheel into changes of the State. The light never jumps when the mouse takes it.

    drag    "orbit", "pan", "light", or "" when no button is down
    drags   how many there have been
    clicks  1 after an event that ended a click, 2 after one that began a double click, otherwise 0
    """

    def __init__(self) -> None:
        self.drag, self.drags, self.clicks = "", 0, 0
        self._button = ""  # that began the drag
        self._last: Pair | None = None
        self._dwell = Dwell()
        self._pressed: Event | None = None  # while the mouse has not left the place
        self._clicked: Event | None = None  # what began the last click, if that was the last press

    @property
    def turns(self) -> bool:
        """Whether it moves the viewer."""
        return self.drag in ("orbit", "pan") and self._pressed is None

    def handle(self, event: Event, state: State, stage: Stage, camera: Camera, scale: float = 1.0) -> State:
        """The state after the event, in a picture of this camera. scale: pixels are so much smaller than usual."""
        self.clicks = 0
        if event.kind == "wheel":
            return state.light_reached(event.steps) if event.shift else state.zoomed(event.steps)
        if event.kind == "press" and not self.drag:
            self._press(event, scale)
        elif event.kind == "release" and event.key == self._button:
            self._release()
        elif event.kind == "leave" and not self.drag:
            return self._leave(event, state)
        elif event.kind == "move" and not _is_same_place(event, self._pressed, scale):
            self._pressed = None
            last, self._last = self._last or (event.x, event.y), (event.x, event.y)
            return self._move(last, event, state, stage, camera)
        return state

    def _press(self, event: Event, scale: float) -> None:
        before, self._clicked = self._clicked, None
        self._last, self._button = (event.x, event.y), event.key
        if event.key == "middle" or (event.key == "left" and event.ctrl and not event.shift):
            self.drag = "pan"
        elif event.key == "left":
            self.drag = "light" if event.ctrl else "orbit"
        self.drags += 1
        if self.drag != "orbit":
            return
        self._pressed = event
        if before and _is_same_place(event, before, scale) and event.time - before.time < DOUBLE:
            self.clicks = 2
        else:
            self._clicked = event

    def _release(self) -> None:
        self.drag = ""
        if self._pressed and self._clicked:
            self.clicks = 1
        elif not self._pressed:
            self._clicked = None
        self._pressed = None

    def _leave(self, event: Event, state: State) -> State:
        """The light stays where it was held before the mouse began its way out."""
        self._last = None
        return replace(state, light_at=self._dwell.leave(event.time, state.light_at)) if state.light_mode else state

    def _move(self, last: Pair, event: Event, state: State, stage: Stage, camera: Camera) -> State:
        now = event.x, event.y
        dx, dy = now[0] - last[0], now[1] - last[1]
        if self.drag == "orbit":
            return state.orbited(dx, dy, min(camera.width, camera.height))
        if self.drag == "pan":
            return state.panned(dx, dy, camera.fx)
        if now == last or (self.drag != "light" and not state.light_mode):
            return state
        moved = self._move_light(last, now, state, stage, camera)
        if not self.drag:
            rims = rims_from((0, 0), *now, camera)
            self._dwell.move(event.time, rims, state.light_at, moved.light_at)
        return moved

    def _move_light(self, last: Pair, now: Pair, state: State, stage: Stage, camera: Camera) -> State:
        """The light follows the mouse. If they are apart when the mouse takes it, the gap shrinks with each move."""
        middle = state.middle(stage, camera)
        before, after = rims_from(middle, *last, camera), rims_from(middle, *now, camera)
        left = math.exp(-CATCH_UP * math.dist(before, after))
        (x, y), (was_x, was_y) = state.light_at, before
        return replace(state, light_at=(after[0] + left * (x - was_x), after[1] + left * (y - was_y)))


def _is_same_place(event: Event, other: Event | None, scale: float) -> bool:
    return other is not None and math.dist((event.x, event.y), (other.x, other.y)) < HAND * scale
