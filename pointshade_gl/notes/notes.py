"""Notes: one sentence for every guess that the package makes. Unless the caller takes them, they are logged.

Notes are records of level INFO of the logger `pointshade_gl`, warnings of level WARNING. While the application has no
handler of its own for them, they are printed to stderr.
"""

from __future__ import annotations

import logging
import re
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from typing import Any

from .errors import check_function
from .words import printable

Note = Callable[[str], None]


class Doubt(str):
    """A note that things may not fit each other, which `pointshade info` repeats as its verdict."""

    __slots__ = ()


MOST = 5  # notes that a command prints

LOGGER = logging.getLogger("pointshade_gl")

_printed: set[str] | None = None  # all notes of the running command; in Python each is printed
_most = MOST
_lock = threading.Lock()  # threads share these two
_renamed: set[tuple[str, str]] = set()  # what was printed already
_taker: ContextVar[Note | None] = ContextVar("taker", default=None)  # gets notes instead of the logger


def print_note(text: str) -> None:
    """Log a note, which is printed as a line that begins with `note:`. See `few_notes` for the command line."""
    taker = _taker.get()
    if taker is not None:
        taker(text)
    elif _passes(text):
        LOGGER.info("%s", text)


def print_warning(text: str) -> None:
    """Log that something was left out, which is printed as a line that begins with `warning:`."""
    LOGGER.warning("%s", text)


class _ToStderr(logging.Handler):
    """Prints to the stderr of the moment, if there is one, unless the application has a handler for the record.

    Python's own handler of last resort would leave out notes, as they are no warnings.
    """

    def emit(self, record: logging.LogRecord) -> None:
        handlers = [*LOGGER.handlers, *(logging.root.handlers if LOGGER.propagate else ())]
        if sys.stderr is not None and handlers == [self]:
            kind = "note" if record.levelno < logging.WARNING else "warning"
            with suppress(OSError, ValueError):  # it is closed
                sys.stderr.write(f"{kind}: {printable(record.getMessage())}\n")


if LOGGER.level == logging.NOTSET:  # the application has not chosen one before
    LOGGER.setLevel(logging.INFO)
LOGGER.addHandler(_ToStderr())


def _passes(text: str) -> bool:
    """Remember a note, and return whether to print it: of a command each once, and only the first ones."""
    with _lock:
        if _printed is None:
            return True
        is_new = text not in _printed
        _printed.add(text)
        return is_new and len(_printed) <= _most


@contextmanager
def few_notes() -> Iterator[None]:
    """Print only the first notes inside, each once; a last one counts those that were left out."""
    global _printed, _most
    printed, _most = set[str](), MOST
    _printed = printed
    try:
        yield
    finally:
        _printed = None
        more = len(printed) - _most if _most else 0
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
    if _printed is not None:
        _most = 0


@contextmanager
def taken() -> Iterator[list[str]]:
    """Collect notes in a list instead, also of threads that `prefetched` starts: another process prints them."""
    notes: list[str] = []
    with taken_by(notes.append):
        yield notes


class taken_by:  # each picture pays for it: a class is half of a generator
    """Call a function of the caller's with each note instead; None changes nothing."""

    def __init__(self, notes: Note | None):
        self._notes, self._token = notes, None

    def __enter__(self) -> None:
        if self._notes is not None:
            self._token: Any = _taker.set(check_function(self._notes, "notes"))

    def __exit__(self, *error: object) -> None:
        if self._token is not None:
            _taker.reset(self._token)


def once(note: Note) -> Note:
    """Wrap a note function to pass on each kind of note once, from any thread. Numbers make no other kind."""
    printed: set[str] = set()
    lock = threading.Lock()

    def pass_on(text: str) -> None:
        kind = re.sub(r"\d+", "#", text)
        with lock:
            if kind not in printed:
                printed.add(kind)
                note(text)

    return pass_on
