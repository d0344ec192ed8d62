"""The window's events as small plain values, independent of the window library."""

from __future__ import annotations

import time
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Event:
    """One action of the user.

    kind       "key" (pressed or repeated), "text" (a character was typed), "move", "press", "release", "wheel",
               "leave" (the pointer left the window), "drop" (files were dropped onto the window), "refresh" (the window
               lost its content)
    key        for "key": the letter, digit or sign on the user's keyboard, upper case, or "SPACE", "LEFT", "RIGHT",
               "UP", "DOWN", "HOME", "END", "TAB", "ENTER", "BACKSPACE", "DELETE", "ESCAPE"; for "text": the character;
               for "press" and "release": "left", "middle" or "right"
    x, y       position of the pointer in pixels of the picture, from the upper left corner
    steps      of the wheel; above 0: away from the user
    ctrl, shift  whether they are held down; Command counts as Ctrl
    paths      of the files and folders that were dropped
    time       seconds, of a clock that stands still while the window draws and cannot see events
    """

    kind: str
    key: str = ""
    x: float = 0.0
    y: float = 0.0
    steps: float = 0.0
    ctrl: bool = False
    shift: bool = False
    paths: tuple[str, ...] = ()
    time: float = field(default_factory=time.perf_counter, compare=False)
