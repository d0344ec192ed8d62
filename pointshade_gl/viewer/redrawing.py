"""When a window is drawn: after something that it depends on has changed, and while it is refined."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..scene.camera import Camera
from ..scene.frame import Frame
from .rate import Rate
from .refining import Refining

if TYPE_CHECKING:
    from .viewer import Viewer


class Redrawing:
    """Draws a viewer's window, and remembers what it shows.

    refining  how many samples it shows
    rate      of the pictures that differ
    drawn     how often it was drawn
    """

    def __init__(self) -> None:
        self.refining, self.rate, self.drawn = Refining(), Rate(), 0
        self._shown: Any = None

    def forget(self) -> None:
        """The window lost its content."""
        self._shown = None

    def patience(self, viewer: Viewer, now: float) -> float | None:
        """Seconds until it must be drawn; None: not before something changes."""
        if viewer.camera is None:
            return None
        if _content(viewer) != self._shown or is_settling(viewer):
            return 0.0
        return self.refining.patience(_picture(viewer), now, most_samples(viewer, viewer.camera))

    def draw(self, viewer: Viewer) -> None:
        """Draws it now, unless it is minimised."""
        if (camera := viewer.camera) is None:
            return
        content, picture, now = _content(viewer), _picture(viewer), time.perf_counter()
        if not self.refining.shows(picture):
            self.rate.tick(now)
        samples = self.refining.following(picture, now, most_samples(viewer, camera))
        history = viewer.opened.history
        history.follow(viewer.moment)
        viewer.screen.draw(viewer, camera, viewer.messages.text, not viewer.pointing.turns, samples)
        history.act(viewer.moment, "panel", time.perf_counter())
        self._shown = content
        self.drawn += 1


def most_samples(viewer: Viewer, camera: Camera | None) -> int:
    """Of the picture as it is: a photograph seen as it was taken has no more than one, and stays sharp."""
    state, stage = viewer.state, viewer.stage
    is_own = isinstance(viewer.frame, Frame) and camera == viewer.own_camera
    is_there = np.allclose(state.pose(stage), np.eye(4), rtol=0, atol=1e-9 * stage.radius)
    return 1 if is_own and is_there and not state.is_lit else viewer.samples


def is_settling(viewer: Viewer) -> bool:
    """Whether the panel has not yet answered all that it was told."""
    return viewer.state.panel and viewer.screen.panel.settling > 0


def _picture(viewer: Viewer) -> tuple[Any, ...]:
    """Everything that the picture below marker, text and panel depends on."""
    state = replace(viewer.state, help=False, panel=False)
    return state, viewer.lights, viewer.held, viewer.frame, viewer.camera


def _content(viewer: Viewer) -> tuple[Any, ...]:
    """Everything that the window's content depends on. Another size of the window is another camera."""
    over = viewer.state.help, viewer.state.panel, viewer.messages.text, viewer.pointing.turns, viewer.strip
    return *_picture(viewer), viewer.window.scale, *over
