"""Prints notes: one sentence for every guess that the package makes, unless the caller collects them."""

from __future__ import annotations

import re
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Note = Callable[[str], None]
MOST = 5  # notes that a command prints


_told: set[str] | None = None  # all notes of the running command; in Python each is printed
_most = MOST
_lock = threading.Lock()  # threads share these two
_renamed: set[tuple[str, str]] = set()  # what was said already
_taken: ContextVar[list[str] | None] = ContextVar("taken", default=None)  # instead of being printed


def print_note(text: str) -> None:
    """Print a note to stderr, in a line that begins with `note:`. See `few_notes` for the command line."""
    taken = _taken.get()
    if taken is not None:
        taken.append(text)
    elif _passes(text):
        sys.stderr.write(f"note: {text}\n")


def _passes(text: str) -> bool:
    """Remember a note, and return whether to print it: of a command each once, and only the first ones."""
    with _lock:
        if _told is None:
            return True
        is_new = text not in _told
        _told.add(text)
        return is_new and len(_told) <= _most


@contextmanager
def few_notes() -> Iterator[None]:
    """Print only the first notes inside, each once; a last one says how many more there were."""
    global _told, _most
    told, _most = set[str](), MOST
    _told = told
    try:
        yield
    finally:
        _told = None
        more = len(told) - _most if _most else 0
        if more > 0:
            tail = "see all with pointshade info INPUT, none with --quiet"
            print_note(f"{more} more note{'s' if more > 1 else ''}: {tail}")


def note_new_name(old: str, new: str) -> None:
    """Print once that an option has another name now."""
    if (old, new) not in _renamed:
        _renamed.add((old, new))
        print_note(f"{old} is called {new} now: the older name goes with the next version")


def silence() -> None:
    """Print no more notes, until `few_notes` ends."""
    global _most
    if _told is not None:
        _most = 0


@contextmanager
def taken() -> Iterator[list[str]]:
    """Collect notes in a list instead, also of threads that `prefetched` starts: another process prints them."""
    notes: list[str] = []
    token = _taken.set(notes)
    try:
        yield notes
    finally:
        _taken.reset(token)


def once(note: Note) -> Note:
    """Wrap a note function to pass on each kind of note once, from any thread. Numbers make no other kind."""
    told: set[str] = set()
    lock = threading.Lock()

    def tell(text: str) -> None:
        kind = re.sub(r"\d+", "#", text)
        with lock:
            if kind not in told:
                told.add(kind)
                note(text)

    return tell
