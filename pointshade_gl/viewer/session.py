"""What is open in a window and how it is seen, and what actions of the user do to that. No GL, no window."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..scene.camera import Camera
from .controller import Answer, Control
from .document import Document
from .events import (
    Command,
    Effect,
    PlayEffect,
    Remember,
    RemoveLight,
    Scrub,
    Seek,
    ShowFrame,
    ShowMessage,
    TakeLight,
)
from .keys import when_seen
from .mouse import added, removed, taking, titles
from .overlay import Messages
from .playback import TimelineBar
from .state import Shown, Snapshot, as_switched, camera_of, pose_of, switches_of


class Session:
    """A frame, a stream of frames or a scene that is shown, with its view and its lights.

    document  what is open
    frame     of it is shown
    state, stage, held, lights, light_number, light_names  are those of a Moment
    messages  what is said
    """

    def __init__(self, document: Document, messages: Messages):
        self.messages = messages
        self.show(document, document.first, document.start)
        self._control = Control(self.moment)
        self._news = ""  # to be said once what is shown is seen
        self._wanted: int | None = None  # the frame that was chosen on the timeline

    def show(self, document: Document, frame: Shown, moment: Snapshot) -> None:
        """Show a frame of a document, as it was at a moment."""
        self.document, self.frame, self.moment = document, frame, moment

    @property
    def moment(self) -> Snapshot:
        """All that is undone, as it is."""
        lights = self.held, self.lights, self.light_number, self.light_names
        return Snapshot(self.state, self.stage, *lights, switches_of(self.frame))

    @moment.setter
    def moment(self, moment: Snapshot) -> None:
        self.state, self.stage, self.held, self.lights, self.light_number, self.light_names, switches = moment
        self.frame = as_switched(self.frame, switches)

    @property
    def control(self) -> Control:
        """All that events change, as the application may have changed it since the last one."""
        return replace(self._control, now=self.moment)

    def take(self, answer: Answer) -> None:
        """Become what the controller made of an event, and do what else it asks for."""
        self._control, asked = answer
        self.moment = self._control.now
        for effect in asked:
            self.perform(effect)

    def perform(self, effect: Effect) -> None:
        """Do what a key, the mouse or the panel asks for (see events.py)."""
        match effect:
            case ShowMessage(text):
                self.say(text)
            case Remember(kind, seconds, pause):
                self.document.history.act(self.moment, kind, seconds, pause)
            case Command.DROP_STEP:
                self.document.history.drop_step(self.moment)
            case Command.UNDO:
                self._go_back(self.document.history.undo(self.moment), "undone", "nothing to undo")
            case Command.REDO:
                self._go_back(self.document.history.redo(self.moment), "done again", "nothing to do again")
            case Command.RESET:
                self._go_to(self.document.restart(self.frame))
            case TakeLight(number):
                self._take_light(number)
            case Command.ADD_LIGHT:
                self._go_to(added(self.moment, self.pose))
            case RemoveLight(number):
                self._go_to(removed(number, self.moment, self.pose))
            case ShowFrame(frame):
                self.frame = frame
            case Scrub(index):
                self._wanted = index
            case _:
                assert isinstance(effect, PlayEffect)  # all others need the window
                self._follow(*self.document.playback.obey(effect, self.frame))
                self.document.history.follow(self.moment)  # what is shown now has other switches

    def say(self, text: str) -> None:
        """Show a line of text for a few seconds."""
        self.messages.say(text)

    def _go_back(self, moment: Snapshot | None, done: str, nothing: str) -> None:
        if moment:
            self._go_to(moment)
        self.say(done if moment else nothing)

    def _take_light(self, number: int) -> None:
        """The light that the mouse held stays where it is."""
        if number != self.light_number:
            self._go_to(taking(number, self.moment, self.pose))
            names = self.light_titles
            self.say(f"the mouse holds {names[number]}, light {number + 1} of {len(names)}{when_seen(self.state)}")

    def _go_to(self, moment: Snapshot) -> None:
        """Help and panel stay, which are not undone."""
        self.moment = moment.beside(self.moment)

    @property
    def light_titles(self) -> list[str]:
        """What the lights are called, with their names in the scene."""
        return titles(self.moment)

    @property
    def own_camera(self) -> Camera:
        """The frame's or the scene's own camera."""
        return camera_of(self.frame)

    @property
    def pose(self) -> NDArray[np.float64]:
        """(4, 4) camera-to-world of the frame's or the scene's own camera."""
        return pose_of(self.frame)

    @property
    def strip(self) -> TimelineBar | None:
        """What the timeline shows; None where frames do not play."""
        return self.document.playback.strip(self.frame)

    def play(self, now: float) -> None:
        """Show the frame that is due, or the views once they are merged."""
        playback = self.document.playback
        if playback.is_merging:
            views, self._news = playback.merged()
            self._follow(views, "")
            if views is None:
                self.tell_news()
        elif not self._control.is_scrubbing and (frame := playback.advance(self.frame, now)):
            self.frame = frame

    def tell_news(self) -> None:
        """Say what is seen now."""
        news, self._news = self._news, ""
        if news:
            self.say(news)

    def seek(self) -> None:
        """Show the frame that was chosen on the timeline, if one was."""
        wanted, self._wanted = self._wanted, None
        if wanted is not None:
            self._follow(self.document.playback.obey(Seek(wanted), self.frame)[0], "")

    def plays_in(self, now: float) -> float | None:
        """Return the seconds until something plays; None: no limit."""
        return None if self._control.is_scrubbing else self.document.playback.patience(self.frame, now)

    def _follow(self, frame: Shown | None, text: str) -> None:
        """Shows the frame, unless it stays, and says the text, if there is one."""
        if frame is not None:
            self.frame = frame
        if text:
            self.say(text)
