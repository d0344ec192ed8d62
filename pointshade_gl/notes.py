"""Notes: one sentence for every guess, printed unless the caller takes them."""

from __future__ import annotations

import re
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Note = Callable[[str], None]
MOST = 5  # notes that a command prints


class _Counter:
    """How many notes the running command has printed, and how many it has not. Threads share it."""

    def __init__(self, most: int):
        self.most, self.count, self.lock = most, 0, threading.Lock()

    def passes(self) -> bool:
        """Counts one more note: may it be printed?"""
        with self.lock:
            self.count += 1
            return self.count <= self.most


_counter: _Counter | None = None  # in Python all notes are printed


def print_note(text: str) -> None:
    """Prints a note to stderr, in a line that begins with `note:`. See `few_notes` for the command line."""
    if _counter is None or _counter.passes():
        sys.stderr.write(f"note: {text}\n")


@contextmanager
def few_notes() -> Iterator[None]:
    """Inside, only the first notes are printed; a last one says how many more there were."""
    global _counter
    counter = _counter = _Counter(MOST)
    try:
        yield
    finally:
        _counter = None
        more = counter.count - counter.most if counter.most else 0
        if more > 0:
            tail = "see all with pointshade info INPUT, none with --quiet"
            print_note(f"{more} more note{'s' if more > 1 else ''}: {tail}")


def silence() -> None:
    """Prints no notes any more, until `few_notes` ends."""
    if _counter is not None:
        _counter.most = 0


def once(note: Note) -> Note:
    """Passes on each kind of note once, from any thread. Notes that differ only in numbers are of one kind."""
    told: set[str] = set()
    lock = threading.Lock()

    def tell(text: str) -> None:
        kind = re.sub(r"\d+", "#", text)
        with lock:
            if kind not in told:
                told.add(kind)
                note(text)

    return tell
