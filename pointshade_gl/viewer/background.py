"""Work beside the window, in threads and other programs: long work, dialogs, recorded files."""

from __future__ import annotations

import shutil
import sys
import threading
from collections.abc import Callable
from contextvars import copy_context
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import Progress, endable
from ..files.pictures.picture_files import save_image
from ..notes.errors import Cancelled

GRACE = 0.05  # seconds that a turn waits for work: what ends so soon shows no bar


@dataclass(frozen=True, eq=False)
class Work:
    """What takes long."""

    title: str  # of what runs, for the user; "": nothing is shown
    do: Callable[[Progress], Any]  # is called in a thread, with a `Progress`; what it returns goes to `done`
    done: Callable[[Any], object]  # is called in the window's thread afterwards
    # is called there instead, with what was raised: Cancelled if the user has ended it
    failed: Callable[[BaseException], object]
    lends: bool = True  # the window's renderer is in use meanwhile: nobody else may draw
    # is called in the thread with a result that came after the user had ended it
    unused: Callable[[Any], object] = lambda _: None


class Background:
    """Does one work at a time.

    wake       called from the thread when the work has gone on, or has ended
    take_back  called when a work has ended that had the renderer
    grace      seconds that `start` waits for the end; None: as long as it takes
    """

    def __init__(self, wake: Callable[[], None], take_back: Callable[[], None] = lambda: None, grace: float = GRACE):
        self._wake, self._take_back = wake, take_back
        self.grace: float | None = grace
        self.work: Work | None = None
        self._steps = 0, 0  # done, and all
        self._is_ended = threading.Event()
        self._thread: Thread | None = None
        self._outcome: list[tuple[Any, BaseException | None]] = []  # one at most

    @property
    def lends(self) -> bool:
        """Return whether the renderer is in use."""
        return self.work is not None and self.work.lends

    @property
    def share(self) -> float:
        """Return how much of the work is done, from 0 to 1."""
        done, total = self._steps
        return min(done / total, 1.0) if total else 0.0

    @property
    def title(self) -> str:
        """Return what runs, in words; "" if nothing does that the user sees."""
        if self.work is None or not self.work.title:
            return ""
        return f"{self.work.title}: ending" if self._is_ended.is_set() else f"{self.work.title}     Esc ends it"

    def start(self, work: Work) -> None:
        """Begin a work, and see its end if it comes at once. Only while no other runs."""
        assert self.work is None, "one at a time"
        self.work, self._steps, self._outcome, self._is_ended = work, (0, 0), [], threading.Event()
        run = copy_context().run  # where notes go is the same in the thread
        self._thread = Thread(target=run, args=(self._run, work, self._is_ended, self._outcome), daemon=True)
        self._thread.start()
        self.join(self.grace)
        self.poll()

    def poll(self) -> None:
        if self.work is None or not self._outcome:
            return
        work, (result, error) = self.work, self._outcome[0]
        self._leave()
        if error is None:
            work.done(result)
        else:
            work.failed(error)

    def end(self) -> None:
        """End the work. One that lends the renderer goes on to where it can be left; others are left alone at once."""
        self._is_ended.set()
        if self.work is not None and not self.work.lends:
            self._outcome, self._thread = [(None, Cancelled("ended by the user"))], None
            self.poll()

    def finish(self) -> None:
        while self.work:
            self.join()
            self.poll()

    def close(self) -> None:
        """End the work, without a word. One that lends the renderer is waited for."""
        self._is_ended.set()
        if self.lends:
            self._leave()
        self.work = None

    def _leave(self) -> None:
        lent = self.lends
        self.join()
        self.work = self._thread = None
        if lent:
            self._take_back()

    def join(self, seconds: float | None = None) -> None:
        """Wait for the end of the work; None: as long as it takes."""
        if self._thread is not None:
            self._thread.join(seconds)

    def _run(self, work: Work, is_ended: threading.Event, outcome: list[tuple[Any, BaseException | None]]) -> None:

        def progress(done: int, total: int) -> None:
            self._steps = done, total
            self._wake()

        result, error = None, None
        try:
            with endable(is_ended.is_set):
                result = work.do(progress)
        except BaseException as raised:  # it is raised again where somebody sees it
            error = raised
        if work.lends or not is_ended.is_set():
            outcome.append((result, error))
            self._wake()
        elif error is None:
            work.unused(result)


PROGRAMS = "zenity", "kdialog", "matedialog", "qarma"  # which of them Linux has
DROP = "drop files or a folder onto the window"
MISSING = f"an open dialog needs the extra 'gui': pip install '.[gui]' in the clone; or {DROP}"
NO_PROGRAM = f"an open dialog needs {PROGRAMS[0]} or {PROGRAMS[1]}, install one of them; or {DROP}"
CHOICE_CHECK = 0.1  # seconds between two looks at whether the user has chosen


class OpenDialog:
    """A dialog that is shown until the user has chosen. Raises RuntimeError, in words for the user, without one."""

    def __init__(self, is_folder: bool):
        if find_spec("imgui_bundle") is None:
            raise RuntimeError(MISSING)
        if sys.platform.startswith("linux") and not any(map(shutil.which, PROGRAMS)):
            raise RuntimeError(NO_PROGRAM)
        self._is_folder = is_folder
        self._dialog: Any = None
        self._starting = Thread(target=self._start)  # which takes a moment, the first time
        self._starting.start()

    def _start(self) -> None:
        from imgui_bundle import portable_file_dialogs as dialogs  # pyright: ignore[reportMissingModuleSource]

        if self._is_folder:
            self._dialog = dialogs.select_folder("Open a folder")
        else:
            self._dialog = dialogs.open_file("Open files", options=dialogs.opt.multiselect)

    @property
    def is_done(self) -> bool:
        return not self._starting.is_alive() and (self._dialog is None or self._dialog.ready(0))

    @property
    def chosen(self) -> tuple[str, ...]:
        """What the user chose; nothing if that was nothing."""
        found = self._dialog.result() if self._dialog else ()
        return tuple(filter(None, [found] if isinstance(found, str) else found))

    def close(self) -> None:
        self._starting.join()
        if not self.is_done:
            self._dialog.kill()


RATE = 30.0  # pictures per second of a film


class Recorder:
    """Feeds a Film in real time, at the film's rate, whatever the window's rate is. Raises what `Film` raises if it
    cannot be written."""

    def __init__(self, path: Path, fps: float = RATE):
        from ..files.writing.film import Film

        self._film, self._fps = Film(path, fps), fps
        self._began: float | None = None  # when the first picture came
        self._written = 0
        self._last: NDArray[np.uint8] | None = None

    def patience(self, now: float) -> float:
        """Seconds until the next picture is due."""
        return 0.0 if self._began is None else max(self._began + self._written / self._fps - now, 0.0)

    def add(self, now: float, take: Callable[[], NDArray[np.uint8]]) -> None:
        """Adds as many pictures as are due, all the same. take() gives (h, w, 4) uint8, always of one size."""
        self._began = now if self._began is None else self._began
        due = int((now - self._began) * self._fps) + 1 - self._written
        if due > 0:
            self._last = last = take()
            for _ in range(due):
                self._film.add(last)
            self._written += due

    def hold(self, now: float) -> None:
        """Adds the last picture as often as pictures are due. Before the first one nothing is."""
        if (last := self._last) is not None:
            self.add(now, lambda: last)

    def close(self) -> None:
        self._film.close()


def save_new(image: NDArray[np.uint8]) -> Path:
    """Write a picture to a new file in the working directory, and return its path. Raises OSError."""
    path = next(p for k in range(1, 1_000_000) if not (p := Path(f"pointshade_{k:04d}.png")).exists())
    save_image(path, image)
    return path


def report(path: Path, line: str, left_out: str) -> str:
    """Print where a picture was saved and the command that makes it ("": none), and return it for the window."""
    if sys.stdout is not None:
        sys.stdout.write(f"{path.absolute()}\n" + (f"{line}\n" if line else ""))
    if line:
        left_out = "the command that makes it is in the clipboard" + (left_out and f"; it leaves out: {left_out}")
    return f"saved {path.absolute()}\n{left_out}".rstrip()
