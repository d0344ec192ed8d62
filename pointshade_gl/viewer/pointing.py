"""What the mouse does in a window: view and light move, clicks place the light and set the pivot, each as one step."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from ..scene.camera import Camera
from ..scene.orbit_state import State, rims_from
from .events import Event
from .messages import STAYS
from .mouse import Mouse

if TYPE_CHECKING:
    from .viewer import Viewer


class Pointing:
    """Gives a viewer the state that the mouse makes, and remembers the steps."""

    def __init__(self) -> None:
        self._mouse = Mouse()
        self._unplaced: State | None = None  # before the last click, if that has placed the light

    @property
    def turns(self) -> bool:
        """Whether the mouse moves the viewer."""
        return self._mouse.turns

    def handle(self, viewer: Viewer, event: Event, camera: Camera) -> None:
        """Does what the event asks for, in a picture of this camera."""
        mouse = self._mouse
        viewer.state = mouse.handle(event, viewer.state, viewer.stage, camera, viewer.window.scale)
        if mouse.drag:
            viewer.opened.history.act(viewer.moment, ("drag", mouse.drags), pause=math.inf)
        elif event.kind == "wheel":
            viewer.opened.history.act(viewer.moment, ("wheel", event.shift), event.time)
        elif mouse.clicks == 1:
            self._place_light(viewer, camera, event.x, event.y)
        if mouse.clicks == 2:
            self._set_pivot(viewer, camera, event.x, event.y)

    def _place_light(self, viewer: Viewer, camera: Camera, x: float, y: float) -> None:
        """The light goes to the pixel, and stays there. One that is kept already is left alone."""
        state = viewer.state
        self._unplaced = state if state.light_mode and state.is_lit else None
        if self._unplaced:
            place = rims_from(state.middle(viewer.stage, camera), x, y, camera)
            viewer.state = replace(state, light_mode=False, light_at=place)
            viewer.say(STAYS)
            viewer.opened.history.act(viewer.moment, "place", pause=-math.inf)

    def _set_pivot(self, viewer: Viewer, camera: Camera, x: float, y: float) -> None:
        """From now on orbits turn around the point that is seen at a pixel, or around the object's middle."""
        if self._unplaced:  # by the first of the two clicks
            viewer.state = replace(viewer.state, light_mode=True, light_at=self._unplaced.light_at)
            self._unplaced = None
            viewer.opened.history.drop_step(viewer.moment)
        found = viewer.screen.find_surface(viewer, camera, x, y)
        point = viewer.state.seen_middle(viewer.stage) if found is None else found
        viewer.say("drags turn around the object's middle" if found is None else "drags turn around this point")
        if point[2] > 0:
            pivoted = viewer.state.with_pivot(point, viewer.stage)
            viewer.state = pivoted if found else replace(pivoted, pivot=State().pivot)
        viewer.opened.history.act(viewer.moment)
