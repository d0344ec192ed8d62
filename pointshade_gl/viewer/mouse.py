"""What the mouse does: moves, buttons and the wheel change the State, or the light that it holds.

The help in the window shows the same table.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, replace
from itertools import chain, repeat

import numpy as np
from numpy.typing import NDArray

from ..scene.camera import Camera
from ..scene.light import Light, Vector
from ..scene.orbit import DEGREES, OWN_LIGHT, OrbitStage, Pair, State, rims_from
from .events import Event
from .state import Snapshot

CATCH_UP = 3.0  # how fast the light approaches the mouse, per rim that the mouse moves
CLICK_REACH = 4.0  # pixels at scale 1: who moves less while a button is down, clicks
DOUBLE_CLICK = 0.4  # seconds between two clicks that are one double click
MOMENT = 0.25  # seconds that the mouse stays where it holds the light on purpose
STAYING_REACH = 0.1  # rims: who moves less in a moment, stays
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
        if math.dist(mouse, self.around) > STAYING_REACH:
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
        self, event: Event, state: State, stage: OrbitStage, camera: Camera, scale: float = 1.0
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
            clicked = self.clicked if self.pressed else None
            return replace(mouse, drag="", pressed=None, clicks=int(clicked is not None), clicked=clicked), state
        if event.kind == "leave" and not self.drag:  # the light stays where it was held before the mouse's way out
            held = self.dwell.left(event.time, state.light_at) if state.light_mode else state.light_at
            return replace(mouse, last=None), replace(state, light_at=held)
        if event.kind == "move" and not _is_same_place(event, self.pressed, scale):
            return mouse._move(event, state, stage, camera)
        return mouse, state

    def _press(self, event: Event, scale: float) -> Mouse:
        left = "orbit" if not event.ctrl else "light" if event.shift else "pan"
        drag = {"left": left, "middle": "pan", "right": "environment"}.get(event.key, "")
        mouse = replace(self, drag=drag, drags=self.drags + 1, button=event.key, last=(event.x, event.y), clicked=None)
        if drag != "orbit":
            return mouse
        before = self.clicked
        if before and _is_same_place(event, before, scale) and event.time - before.time < DOUBLE_CLICK:
            return replace(mouse, pressed=event, clicks=2)
        return replace(mouse, pressed=event, clicked=event)

    def _move(self, event: Event, state: State, stage: OrbitStage, camera: Camera) -> tuple[Mouse, State]:
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


def _move_light(last: Pair, now: Pair, state: State, stage: OrbitStage, camera: Camera) -> State:
    """The light follows the mouse. If they are apart when the mouse takes it, the gap shrinks with each move."""
    middle = state.middle(stage, camera)
    before, after = rims_from(middle, *last, camera), rims_from(middle, *now, camera)
    left = math.exp(-CATCH_UP * math.dist(before, after))
    (x, y), (was_x, was_y) = state.light_at, before
    return replace(state, light_at=(after[0] + left * (x - was_x), after[1] + left * (y - was_y)))


def _is_same_place(event: Event, other: Event | None, scale: float) -> bool:
    return other is not None and math.dist((event.x, event.y), (other.x, other.y)) < CLICK_REACH * scale


KINDS = ("point", "spot", "directional", "area")
GOLDEN = cmath.rect(1, math.pi * (3 - 5**0.5))  # around the object: no two of many lights come to the same place
NEAR_LIGHT = 0.4  # rims of the first one beside a light that comes from the viewer
_SOMEWHERE, _FORWARD = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)  # the State knows where the light is


def kind_of(light: Light) -> str:
    """One of KINDS."""
    if light.is_area:
        return "area"
    return "spot" if light.is_spot else "directional" if light.position is None else "point"


def as_kind(light: Light, kind: str, side: float) -> Light:
    """A light of another kind, as the mouse holds it: its place and direction come from the State.

    side  width and height of a new area light, world units
    """
    if kind == "directional":
        return replace(light, position=None, direction=_FORWARD, radius=0.0, size=None)
    made = replace(light, position=_SOMEWHERE, direction=None if kind == "point" else _FORWARD, angle=0.0, size=None)
    return replace(made, radius=0.0, size=(side, side)) if kind == "area" else made


def taking(number: int, now: Snapshot, pose: NDArray[np.float64]) -> Snapshot:
    """The mouse takes the light with this number; the one that it held stays where it is. pose: of the own camera."""
    every = _by_number(now, now.state.light(now.stage, pose, now.held))
    held, *others = every[number:] + every[:number]
    state = now.state.with_light(held, now.stage, pose)
    return now._replace(state=state, held=held, lights=tuple(others), number=number)


def added(now: Snapshot, pose: NDArray[np.float64]) -> Snapshot:
    """One more light, beside the one that the mouse held, which stays where it is; the mouse holds the new one."""
    lights = _by_number(now, now.state.light(now.stage, pose, now.held))
    at = complex(*now.state.light_at)
    at = at * GOLDEN if abs(at) > 0.2 * NEAR_LIGHT else complex(NEAR_LIGHT)
    color, intensity = State.light_color, State.light_intensity
    state = replace(now.state, light_at=(at.real, at.imag), light_color=color, light_intensity=intensity)
    names = (*now.names, *[""] * (len(lights) + 1 - len(now.names)))
    return now._replace(state=state, held=OWN_LIGHT, lights=tuple(lights), number=len(lights), names=names)


def removed(number: int, now: Snapshot, pose: NDArray[np.float64]) -> Snapshot:
    """Without the light with this number. If the mouse held it, it takes the one before. One light always stays."""
    if not now.lights:
        return now
    names = tuple(name for k, name in enumerate(now.names) if k != number)
    if number == now.number:
        now = taking(max(number - 1, 0) if number else 1, now, pose)
    every = _by_number(now, now.held)
    del every[number]
    held = now.number - (number < now.number)
    return now._replace(lights=tuple((every[held:] + every[:held])[1:]), number=held, names=names)


def placed(now: Snapshot, place: Vector, pose: NDArray[np.float64]) -> Snapshot:
    """The light that the mouse holds goes to a place in the world, and stays there; a directional one shines along it,
    which is no place then but a direction. It stays if there is none."""
    light = now.state.light(now.stage, pose, now.held)
    if light.position is not None:
        light = replace(light, position=place)
    elif any(place):
        light = replace(light, direction=place)
    state = replace(now.state.with_light(light, now.stage, pose), light_mode=False)
    return now._replace(state=state)


def _by_number(now: Snapshot, held: Light) -> list[Light]:
    """All lights; held: the one that the mouse holds, where it is."""
    every = [held, *now.lights]
    first = -now.number % len(every)
    return every[first:] + every[:first]


def titles(now: Snapshot) -> list[str]:
    """How lists call lights, by their numbers: 'lamp (spot)', or without a name 'light 2 (spot)'."""
    lights = zip(_by_number(now, now.held), chain(now.names, repeat("")), strict=False)
    return [f"{name or f'light {number}'} ({kind_of(light)})" for number, (light, name) in enumerate(lights, 1)]
