"""Text over the picture: what was said last, for a few seconds, and how Pillow draws it, the help and the timeline."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from ..messages.notes import print_warning

SECONDS = 4.0
CLOSES = "(a key or a click closes this)"
BACKDROP, BRIGHT, DIM = (16, 17, 20, 200), (238, 238, 238, 255), (170, 176, 186, 255)
Sections = Sequence[tuple[str, Sequence[tuple[str, str]]]]  # a title, and rows of two columns
POINTS = 14  # height of a letter's box, pixels at scale 1


class Messages:
    """Keeps the text that is shown. What threads skip waits until the window's own thread tells it.

    kept  what stays until the user has read it; "" if nothing does
    """

    def __init__(self) -> None:
        self.kept = ""
        self._said, self._until = "", float("inf")
        self._skipped: deque[str] = deque()  # from the threads that read streams
        self._told: set[str] = set()

    @property
    def text(self) -> str:
        """All that is shown; "" if nothing is."""
        return "\n".join(filter(None, (self.kept and f"{self.kept}\n{CLOSES}", self._said)))

    def keep(self, text: str) -> None:
        """Shows why something failed until `clear`, in place of what was said before, and prints it."""
        self.kept, self._said, self._until = text, "", float("inf")
        print_warning(text)

    def say(self, text: str, seconds: float | None = None) -> None:
        self._said, self._until = text, time.perf_counter() + (SECONDS if seconds is None else seconds)

    def skip(self, text: str) -> None:
        """Says later, and once, why a frame was skipped. For any thread."""
        self._skipped.append(text)

    def update(self, now: float) -> None:
        """Tells what was skipped, and takes the text away when its time is over."""
        while self._skipped:
            if (text := self._skipped.popleft()) not in self._told:  # a sequence that repeats meets it again
                self._told.add(text)
                self.say(f"skipped: {text}")
                print_warning(f"skipped: {text}")
        if self._until < now:
            self._said, self._until = "", float("inf")

    def clear(self) -> None:
        self.kept, self._said, self._until = "", "", float("inf")

    def patience(self, now: float) -> float | None:
        """Seconds until `update` has something to do; None: not before something is said."""
        if self._skipped:
            return 0.0
        return max(self._until - now, 0.0) if self._until < float("inf") else None


def draw_message(text: str, scale: float, width: int) -> NDArray[np.uint8]:
    """A line on a dark strip, or several lines that are as wide as the window at most: (h, w, 4) uint8."""
    font = ImageFont.load_default(POINTS * scale)
    pad = round(7 * scale)
    parts = [line for part in text.split("\n") for line in _broken(part, font, width - 2 * pad)]
    lines = [_shortened(line, font, width - 2 * pad) for line in parts]
    wide = min(round(max(map(font.getlength, lines))) + 2 * pad, width)
    line = round(1.3 * POINTS * scale)
    image = Image.new("RGBA", (max(wide, 1), len(lines) * line + pad), BACKDROP)
    for k, part in enumerate(lines):
        ImageDraw.Draw(image).text((pad, (pad + line) / 2 + k * line), part, BRIGHT, font, anchor="lm")
    return np.asarray(image)


def _broken(text: str, font: Any, width: float) -> list[str]:
    """The text in lines; only a word that is longer alone is wider."""
    lines = [""]
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}" if lines[-1] else word
        if lines[-1] and font.getlength(longer) > width:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines


def _shortened(line: str, font: Any, width: float) -> str:
    """The line, or as much of its beginning and its end as is no wider."""
    if font.getlength(line) <= width:
        return line
    kept = next((n for n in range(len(line) - 1, 0, -1) if font.getlength(_cut(line, n)) <= width), 1)
    return _cut(line, kept)


def _cut(line: str, kept: int) -> str:
    return f"{line[: kept // 3]}…{line[len(line) - (kept - kept // 3) :]}"


def draw_strip(text: str, share: float | None, scale: float, width: int, high: int) -> NDArray[np.uint8]:
    """A line of text, and below it a bar that is filled to a share (None: no bar): (high, width, 4) uint8."""
    font, bar = ImageFont.load_default(0.95 * POINTS * scale), round(5 * scale)
    pad = round(10 * scale)
    wide = width if share is not None else min(round(font.getlength(text)) + 2 * pad, width)
    image = Image.new("RGBA", (max(wide, 1), high), (*BACKDROP[:3], 150))
    draw = ImageDraw.Draw(image)
    draw.text((pad, (high - bar) / 2), _shortened(text, font, width - 2 * pad), BRIGHT, font, anchor="lm")
    if share is not None:
        draw.rectangle((0, high - bar, width, high), (90, 94, 102, 230))
        draw.rectangle((0, high - bar, round(share * width), high), (255, 214, 140, 255))
    return np.asarray(image)


def draw_table(sections: Sections, scale: float, width: int, height: int) -> NDArray[np.uint8]:
    """Sections with a title and rows of two columns: (h, w, 4) uint8, shrunk and if need be cut to fit the window."""
    needed = _table(sections, scale)
    fit = min(1.0, width / needed.shape[1], height / needed.shape[0])
    return needed if fit == 1 else _table(sections, max(scale * fit * 0.98, 1 / POINTS))[:height, :width]


def _table(sections: Sections, scale: float) -> NDArray[np.uint8]:
    font = ImageFont.load_default(POINTS * scale)
    rows = [row for _, section in sections for row in section]
    pad, line = round(16 * scale), round(1.4 * POINTS * scale)
    second = pad + max(font.getlength(left) for left, _ in rows) + round(20 * scale)
    width = second + max(font.getlength(right) for _, right in rows) + pad
    height = 2 * pad + (len(rows) + 1.6 * len(sections) - 0.6) * line
    image = Image.new("RGBA", (round(width), round(height)), (*BACKDROP[:3], 232))
    draw = ImageDraw.Draw(image)
    y = pad + line / 2
    for title, section in sections:
        draw.text((pad, y), title, DIM, font, anchor="lm")
        y += line
        for left, right in section:
            draw.text((pad, y), left, (255, 214, 140, 255), font, anchor="lm")
            draw.text((second, y), right, BRIGHT, font, anchor="lm")
            y += line
        y += 0.6 * line
    return np.asarray(image)
