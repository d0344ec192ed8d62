"""The controller: what a user's action changes, and what else it asks for. No GL, no window, no files.

The mouse turns moves, buttons and the wheel into changes of the State, or of the light that it holds. The help in the
window shows its table.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, field, replace
from itertools import chain, repeat

import numpy as np
from numpy.typing import NDArray

from ..scene.camera import Camera
from ..scene.light import Light, Vector
from ..scene.orbit import DEGREES, END_TEXT, OWN_LIGHT, OrbitStage, Pair, State, rims_from
from .events import Command, Effect, Event, Open, Remember, Scrub, ShowMessage, TurnAround
from .keys import STAYS, press_key
from .state import Shown, Snapshot

CATCH_UP = 3.0  # how fast the light approaches the mouse, per rim that the mouse moves
CLICK_REACH = 4.0  # pixels at scale 1: who moves less while a button is down, clicks
DOUBLE_CLICK = 0.4  # seconds between two clicks that are one double click
MOMENT = 0.25  # seconds that the mouse stays where it holds the light on purpose
STAYING_REACH = 0.1  # rims: who moves less in a moment, stays
MOUSE = (
    ("mouse", "move the light (in light mode)"), ("click", "place the light: it stays until L"),
    ("Ctrl+Shift+drag", "move the light (always)"), ("Shift+wheel", "move the light nearer or farther"),
    ("right drag", "turn the environment"),
    ("drag", "orbit"), ("Ctrl+drag, middle drag", "pan"), ("wheel", "zoom"),
    ("double click", "turn around this point, or the middle"),
    ("click, drag the bar", "jump through a sequence"),
    ("drop files", "open a folder, depth, a scene, clouds"),
)  # fmt: skip


@dataclass(frozen=True)
class Dwell:
    """Where the mouse held the light on purpose: where it stayed for a moment, not where it came through on its way."""

    kept: Pair = (0.0, 0.0)  # the light that was held on purpose
    around: Pair = (0.0, 0.0)  # the mouse has been near this place since then
    since: float = 0.0
    last: Pair | None = None  # the light after the last move

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
    """Turns moves, buttons and the wheel into changes of the State. The light never jumps when the mouse takes it."""

    drag: str = ""  # "orbit", "pan", "light", "environment", or "" when no button is down
    drags: int = 0  # how many there have been
    clicks: int = 0  # 1 after an event that ended a click, 2 after one that began a double click, otherwise 0
    button: str = ""  # that began the drag
    last: Pair | None = None  # where it was
    dwell: Dwell = Dwell()
    pressed: Event | None = None  # what began the drag, while the mouse has not left the place
    clicked: Event | None = None  # what began the last click, if that was the last press

    @property
    def turns(self) -> bool:
        """Whether it moves the viewer."""
        return self.drag in ("orbit", "pan") and self.pressed is None

    def handle(
        self, event: Event, state: State, stage: OrbitStage, camera: Camera, scale: float = 1.0
    ) -> tuple[Mouse, State]:
        """Return mouse and state after the event, in a picture of this camera. scale: pixels are so much smaller than
        usual."""
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
            return mouse, state.orbited(dx, dy, min(camera.width, camera.height), stage)
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
    return replace(state, light_at=(float(after[0] + left * (x - was_x)), float(after[1] + left * (y - was_y))))


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
    """A light of another kind, as the mouse holds it: its place and direction come from the State. side: width and
    height of a new area light, world units."""
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


BAR = 26.0  # height of the timeline, pixels at scale 1: a line of text, a bar below it


@dataclass(frozen=True)
class ControllerInputs:
    """What the controller knows of the window, and does not change."""

    camera: Camera | None  # fitted to the picture; None while the window is minimised
    width: int  # of the window beside the panel, as height, pixels
    height: int
    scale: float = 1.0  # pixels are so much smaller than usual
    total: int | None = None  # how many frames the timeline is for; None: it has no bar
    shown: Shown | None = None  # the frame, the views or the scene


@dataclass(frozen=True)
class Control:
    """All that events change."""

    now: Snapshot  # view, lights and look
    mouse: Mouse = field(default_factory=Mouse)  # what it was doing
    unplaced: State | None = None  # the state before the last click, if that has placed the light
    is_scrubbing: bool = False  # the mouse was pressed on the timeline, and not yet released

    def with_state(self, state: State) -> Control:
        """Return the same with another state of view, light and look."""
        return replace(self, now=self.now._replace(state=state))


Answer = tuple[Control, tuple[Effect, ...]]


def controller(control: Control, place: ControllerInputs, event: Event, is_taken: bool = False) -> Answer:
    """Return what is there after an event, and what else is to be done, in this order. is_taken: by the timeline
    (`is_for_timeline`) or the panel: for keys and mouse it does not count."""
    is_scrubbing, scrubbed = _is_scrubbing(control, place, event), []
    if is_scrubbing and place.total and event.kind in ("press", "move"):  # the frame below the mouse is shown
        index = int(event.x / max(place.width, 1) * place.total)
        scrubbed = [Scrub(min(max(index, 0), place.total - 1))]
    ends = event.kind == "release" and event.key == "left"
    control = replace(control, is_scrubbing=is_scrubbing and not ends)
    if event.kind == "refresh":
        return control, (Command.REDRAW,)
    if event.kind == "text" or (event.kind == "key" and is_taken):
        return control, ()
    if event.kind == "key":
        state, effects = press_key(control.now, place.shown, event.key, event.ctrl, event.shift)
        return control.with_state(state), (*effects, Remember())
    is_away = is_taken or event.kind == "drop"  # with files in the hand the pointer was on its way, too
    control, effects = _point(control, place, replace(event, kind="leave") if is_away else event)
    return control, (*scrubbed, *effects, *([Open(event.paths)] if event.kind == "drop" else []))


def is_for_timeline(control: Control, place: ControllerInputs, event: Event) -> bool:
    """Return whether the timeline takes an event: from where the mouse is pressed on it to where it is released."""
    return event.kind in ("press", "move", "release") and _is_scrubbing(control, place, event)


def hides_pointer(control: Control, place: ControllerInputs, event: Event, is_taken: bool) -> bool:
    """Return whether the light's marker stands for the pointer, after an event was handled."""
    is_over = is_taken or _is_over_bar(place, event)
    state = control.now.state
    return state.light_mode and state.is_lit and not is_over and not control.mouse.turns


def turned_around(control: Control, point: tuple[float, float, float] | None) -> Answer:
    """Return what is there once drags turn around a point that is seen, (3,) view axes; None: the object's middle."""
    state, stage = control.now.state, control.now.stage
    text = "drags turn around the object's middle" if point is None else "drags turn around this point"
    pivot = state.seen_middle(stage) if point is None else point
    if pivot[2] > 0:
        state = state.with_pivot(pivot, stage)
        control = control.with_state(state if point else replace(state, pivot=State().pivot))
    return control, (ShowMessage(text), Remember())


def _is_over_bar(place: ControllerInputs, event: Event) -> bool:
    high = BAR * place.scale
    return bool(place.total) and 0 <= event.x < place.width and place.height - high <= event.y < place.height


def _is_scrubbing(control: Control, place: ControllerInputs, event: Event) -> bool:
    begins = event.kind == "press" and event.key == "left" and _is_over_bar(place, event)
    return control.is_scrubbing or begins


def _point(control: Control, place: ControllerInputs, event: Event) -> Answer:
    """View and light move with the mouse. A drag is one step, and so is a turn of the wheel."""
    if place.camera is None:
        return control, ()
    now = control.now
    mouse, state = control.mouse.handle(event, now.state, now.stage, place.camera, place.scale)
    control = replace(control.with_state(state), mouse=mouse)
    if mouse.clicks == 2:
        return _turn_around(control, event)
    if mouse.drag:
        turns = (state.yaw, state.pitch) != (now.state.yaw, now.state.pitch)
        ends = (ShowMessage(END_TEXT),) if turns and state.is_near_end(now.stage) else ()
        return control, (*ends, Remember(("drag", mouse.drags), pause=math.inf))
    if event.kind == "wheel":
        return control, (Remember(("wheel", event.shift), event.time),)
    return _place_light(control, place.camera, event) if mouse.clicks == 1 else (control, ())


def _place_light(control: Control, camera: Camera, event: Event) -> Answer:
    """The light goes to the pixel, and stays there. One that is kept already is left alone."""
    state = control.now.state
    if not (state.light_mode and state.is_lit):
        return replace(control, unplaced=None), ()
    place = rims_from(state.middle(control.now.stage, camera), event.x, event.y, camera)
    placed = control.with_state(replace(state, light_mode=False, light_at=place))
    return replace(placed, unplaced=state), (ShowMessage(STAYS), Remember("place", pause=-math.inf))


def _turn_around(control: Control, event: Event) -> Answer:
    """The second click of two takes back what the first did."""
    effects = (TurnAround(event.x, event.y),)
    if control.unplaced is None:
        return control, effects
    state = replace(control.now.state, light_mode=True, light_at=control.unplaced.light_at)
    return replace(control.with_state(state), unplaced=None), (Command.DROP_STEP, *effects)
