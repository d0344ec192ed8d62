"""Events of the window, and the effects that they ask for beyond another state: small plain values.

Events are independent of the window library. Effects are performed by Session and Viewer alone.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from enum import Enum
from time import perf_counter
from typing import Literal

from .state import PAUSE, Shown

EventKind = Literal["key", "text", "move", "press", "release", "wheel", "leave", "drop", "refresh"]


@dataclass(frozen=True)
class Event:
    """One action of the user.

    Parameters
    ----------
    kind : str
        "key" (pressed or repeated), "text" (a character was typed), "move", "press", "release", "wheel", "leave" (the
        pointer left the window), "drop" (files were dropped onto the window), "refresh" (the window lost its content).
    key : str
        For "key": the letter, digit or sign on the user's keyboard, upper case, or "SPACE", "LEFT", "RIGHT", "UP",
        "DOWN", "HOME", "END", "TAB", "ENTER", "BACKSPACE", "DELETE", "ESCAPE", "F11", and of the keypad "KP0" to "KP9"
        and "KP."; for "text": the character; for "press" and "release": "left", "middle" or "right".
    x, y : float
        Position of the pointer in pixels of the picture, from the upper left corner.
    steps : float
        Of the wheel; above 0: away from the user.
    ctrl, shift : bool
        Whether they are held down; Command counts as Ctrl.
    paths : tuple of str
        The files and folders that were dropped.
    time : float
        Seconds, of a clock that stands still while the window draws and cannot see events.
    """

    kind: EventKind
    key: str = ""
    x: float = 0.0
    y: float = 0.0
    steps: float = 0.0
    ctrl: bool = False
    shift: bool = False
    paths: tuple[str, ...] = ()
    time: float = field(default_factory=perf_counter, compare=False)


class Effect:
    """What an action of the user asks for, beyond another state of view, lights and look."""


class PlayEffect(Effect):
    """Of these, what frames that play do. verb: what that is called where nothing plays."""

    verb = ""


class Command(Effect, Enum):
    """What needs no number, and what it does."""

    DROP_STEP = "make the last step a part of the one that follows"
    UNDO = "take back the last change of view, lights, look or switches"
    REDO = "make the change again that was undone last"
    RESET = "bring back view, lights, look and switches as at the start"
    ADD_LIGHT = "add a light, which the mouse holds"
    SAVE_PICTURE = "write the picture to a new file"
    TOGGLE_PANEL = "open or close the panel"
    REDRAW = "draw the window, which lost its content"
    FRAME_OBJECT = "show all of the object, in the middle of the picture"
    TOGGLE_FULL_SCREEN = "fill the screen, or go back to the window's own place and size"
    OPEN_FILES = "ask for files, and show what they hold"
    OPEN_FOLDER = "ask for a folder, and show what it holds"
    LEAVE = "leave the full screen, or else close the window"
    CLOSE = "close the window"


class PlayCommand(PlayEffect, Enum):
    """What needs no number either; its value is the verb."""

    TOGGLE_PAUSE = "play"
    TOGGLE_LOOP = "repeat"
    TOGGLE_MERGE = "merge"

    @property
    def verb(self) -> str:
        return self.value


@dataclass(frozen=True)
class Seek(PlayEffect):
    """Show the frame of a sequence with this number, counted from the end if it is below 0."""

    index: int
    verb = "jump to"


@dataclass(frozen=True)
class StepFrames(PlayEffect):
    """Pause, and step one frame forwards (1) or back (-1)."""

    direction: int
    verb = "step through"


@dataclass(frozen=True)
class ChangeRate(PlayEffect):
    """Play frames faster (a factor above 1) or slower."""

    factor: float
    verb = "play"


@dataclass(frozen=True)
class Scrub(Effect):
    """Show the frame of a sequence with this number before the next picture."""

    index: int


@dataclass(frozen=True)
class ShowMessage(Effect):
    """Show a line of text for a few seconds."""

    text: str


@dataclass(frozen=True)
class Remember(Effect):
    """Make what has changed a step that can be undone, see `History.act`."""

    kind: Hashable = None
    time: float = 0.0
    pause: float = PAUSE


@dataclass(frozen=True)
class TakeLight(Effect):
    """Let the mouse take the light with this number."""

    number: int


@dataclass(frozen=True)
class RemoveLight(Effect):
    """Take the light with this number away."""

    number: int


@dataclass(frozen=True)
class TurnAround(Effect):
    """Let drags turn around the point that is seen at a pixel."""

    x: float
    y: float


@dataclass(frozen=True)
class ShowFrame(Effect):
    """Show something else of what is open."""

    frame: Shown


@dataclass(frozen=True)
class Open(Effect):
    """Show what files or folders hold."""

    paths: tuple[str, ...]
