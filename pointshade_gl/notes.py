"""Notes: one sentence for every guess, printed unless the caller takes them."""

from __future__ import annotations

import re
import sys
import threading
from collections.abc import Callable

Note = Callable[[str], None]


def print_note(text: str) -> None:
    """Prints a note to stderr, in a line that begins with `note:`."""
    sys.stderr.write(f"note: {text}\n")


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
