"""What the window tells: one small value for each event, free of the window library."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Event:
    """One thing that the user did.

    kind       "key" (pressed or repeated), "move", "press", "release", "wheel", "leave" (the pointer has left),
               "refresh" (the window's content is lost)
    key        of a key: the letter, digit or sign on the user's keyboard, upper case, or "SPACE", "LEFT", "RIGHT",
               "ESCAPE"; of a press or release: "left", "middle" or "right"
    x, y       where the pointer is, pixels of the picture, from the upper left corner
    steps      of the wheel, above 0 away from the user
    ctrl, shift  whether they were held; Command counts as Ctrl
    """

    kind: str
    key: str = ""
    x: float = 0.0
    y: float = 0.0
    steps: float = 0.0
    ctrl: bool = False
    shift: bool = False
