"""The controller: what a user's action changes, and what else it asks for. No GL, no window, no files."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from ..scene.camera import Camera
from ..scene.orbit import State, rims_from
from .events import Command, Effect, Event, Open, Remember, Scrub, ShowMessage, TurnAround
from .keys import STAYS, press_key
from .mouse import Mouse
from .state import Shown, Snapshot

BAR = 26.0  # height of the timeline, pixels at scale 1: a line of text, a bar below it


@dataclass(frozen=True)
class ControllerInputs:
    """What the controller knows of the window, and does not change.

    camera         fitted to the picture; None while the window is minimised
    width, height  of the window beside the panel, pixels
    scale          pixels are so much smaller than usual
    total          how many frames the timeline is for; None: it has no bar
    shown          the frame, the views or the scene
    """

    camera: Camera | None
    width: int
    height: int
    scale: float = 1.0
    total: int | None = None
    shown: Shown | None = None


@dataclass(frozen=True)
class Control:
    """All that events change.

    now           view, lights and look
    mouse         what it was doing
    unplaced      the state before the last click, if that has placed the light
    is_scrubbing  the mouse was pressed on the timeline, and not yet released
    """

    now: Snapshot
    mouse: Mouse = field(default_factory=Mouse)
    unplaced: State | None = None
    is_scrubbing: bool = False

    def with_state(self, state: State) -> Control:
        """Return the same with another state of view, light and look."""
        return replace(self, now=self.now._replace(state=state))


Answer = tuple[Control, tuple[Effect, ...]]


def controller(control: Control, place: ControllerInputs, event: Event, is_taken: bool = False) -> Answer:
    """Return what is there after an event, and what else is to be done, in this order.

    is_taken  by the timeline (`is_for_timeline`) or the panel: for keys and mouse it does not count
    """
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
        return control, (Remember(("drag", mouse.drags), pause=math.inf),)
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
