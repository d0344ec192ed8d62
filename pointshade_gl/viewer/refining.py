"""How many samples the window shows: one while things move, more and more while nothing does."""

from __future__ import annotations

from typing import Any

REST = 0.2  # seconds that nothing moves before the picture is refined: moving must not wait for it
MORE = 3  # samples a turn: between two turns the window answers


class Refining:
    """Counts the samples of what is shown.

    samples  how many the picture has
    """

    def __init__(self) -> None:
        self.samples = 1
        self._shown: Any = None
        self._since = 0.0

    def shows(self, content: Any) -> bool:
        """Whether the last picture had this content."""
        return content == self._shown

    def following(self, content: Any, now: float, most: int) -> int:
        """How many samples the next picture has. It is drawn anew if its content has changed."""
        if content != self._shown:
            self._shown, self._since, self.samples = content, now, 1
        elif self.patience(content, now, most) == 0:
            self.samples = min(self.samples + MORE, most)
        return self.samples

    def patience(self, content: Any, now: float, most: int) -> float | None:
        """Seconds until more samples are due; None: they are not."""
        if content != self._shown or self.samples >= most:
            return None
        return max(self._since + REST - now, 0.0)
