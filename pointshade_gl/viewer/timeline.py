"""The strip at the bottom of the window while frames play: which one it is of how many, and how fast they come."""

from __future__ import annotations

from typing import NamedTuple

from .events import Event
from .playback import Playback
from .together import Together

HEIGHT = 26.0  # pixels at scale 1: a line of text, a bar below it


class Strip(NamedTuple):
    """What it shows.

    text
    share  of the sequence that has been played, with the present frame; None where nobody knows how many come
    """

    text: str
    share: float | None


def strip_of(playback: Playback | Together | None, arriving: float | None) -> Strip | None:
    """What it shows of what plays; None while nothing does. arriving: frames per second that were measured."""
    if playback is None:
        return None
    rate = "paused" if playback.is_paused else f"{arriving:.0f} frames/s" if arriving else "playing"
    if isinstance(playback, Together):
        return Strip(rate, None)
    total = playback.total
    if total is None:
        return Strip(f"live, {rate}", None)
    asked = "as fast as they come" if playback.rate is None else f"{playback.rate:g} frames/s"
    loop = "loops" if playback.loops else "plays once"
    state = f", {'paused' if playback.is_paused else loop}"
    return Strip(f"frame {playback.index} (0 to {total - 1}), {asked}{state}", (playback.index + 1) / total)


class Timeline:
    """Takes the mouse from where it is pressed on the strip to where it is released."""

    def __init__(self) -> None:
        self.is_dragged = False
        self._wanted: int | None = None

    def handle(self, event: Event, total: int | None, width: float, height: float, scale: float) -> bool:
        """Whether an event is its own, in a picture of that size with a strip for that many frames."""
        if event.kind == "press" and event.key == "left" and self.is_over(event, total, width, height, scale):
            self.is_dragged = True
        was_dragged = self.is_dragged
        if was_dragged and total and event.kind in ("press", "move"):
            self._wanted = min(max(int(event.x / max(width, 1) * total), 0), total - 1)
        if event.kind == "release" and event.key == "left":
            self.is_dragged = False
        return was_dragged and event.kind in ("press", "move", "release")

    def is_over(self, event: Event, total: int | None, width: float, height: float, scale: float) -> bool:
        """Whether the pointer is over the bar."""
        return bool(total) and 0 <= event.x < width and height - HEIGHT * scale <= event.y < height

    def take(self) -> int | None:
        """The number of the frame that was chosen since the last call; None: none was."""
        wanted, self._wanted = self._wanted, None
        return wanted
