"""What a window does again and again: it sleeps, sees what the user did, plays, draws, and records."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from ..scene.camera import Camera
from .record import Recorder

if TYPE_CHECKING:
    from .viewer import Viewer

DISPLAY_RATE = 60.0  # pictures per second while on_frame is overridden


class Turns:
    """Makes a viewer's turns, from now on.

    animates  the application's on_frame keeps the pictures coming
    recorder  of the film, which shows what `camera` sees; None: there is none
    """

    def __init__(self, animates: bool, recorder: Recorder | None, camera: Camera):
        self.recorder = recorder
        self._animates, self._camera = animates, camera
        self._began = self._next_frame = time.perf_counter()

    def take(self, viewer: Viewer, wait: bool) -> None:
        """One turn: sleeps until there is something to do (if `wait`), and redraws if anything has changed."""
        viewer.window.wait(self.patience(viewer) if wait else 0)
        events, viewer.events[:] = list(viewer.events), []
        for event in events:
            viewer.handle(event)
        now = time.perf_counter()
        viewer.seek()
        viewer.play(now)
        if self._animates:
            viewer.on_frame(now - self._began)
            self._next_frame = now + 1 / DISPLAY_RATE
        viewer.messages.update(now)
        if viewer.redrawing.patience(viewer, now) == 0:
            viewer.redrawing.draw(viewer)
        if self.recorder:
            self._record(viewer, self.recorder)

    def patience(self, viewer: Viewer) -> float | None:
        """Seconds that the next turn may sleep; None: no limit."""
        now = time.perf_counter()
        reasons = [
            0.0 if viewer.events else None,
            max(self._next_frame - now, 0.0) if self._animates and viewer.camera else None,
            None if viewer.timeline.is_dragged else viewer.opened.playing.patience(viewer.frame, now),
            self.recorder.patience(now) if self.recorder else None,
            viewer.redrawing.patience(viewer, now),
            viewer.messages.patience(now),
        ]
        return min((seconds for seconds in reasons if seconds is not None), default=None)

    def _record(self, viewer: Viewer, recorder: Recorder) -> None:
        """The film has the samples of the window, if both show the same."""
        samples = viewer.redrawing.refining.samples if viewer.camera == self._camera else 1
        recorder.add(time.perf_counter(), lambda: viewer.screen.read(viewer, self._camera, samples))
