"""What the command line shows while it works and when it is done: stdout has the result, stderr everything else."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import NoReturn

from ..checks.arguments import Progress
from ..files.access.content import check_not_read
from ..files.access.known_names import existing_files, is_numbered
from ..notes.notes import print_note, print_warning
from ..notes.words import printable
from ..renderer.renderer import Renderer

SOFTWARE = "{} is a software renderer: pictures are right, but slow"


def warn_skipped(text: str) -> None:
    print_warning(f"skipped {text}")


def complain(text: str) -> None:
    """Prints a line to stderr, if there is one: printed to None, it would come to stdout."""
    if sys.stderr is not None:
        print(printable(text), file=sys.stderr)


def print_line(text: str) -> None:
    print(printable(text))


def report(output: Path, what: str, renderer: Renderer, spent: float) -> None:
    """The line about a written file: what is in it, what drew it, in how many seconds."""
    print_line(f"{output}: {what}, {renderer.context.renderer}, {spent * 1e3:.0f} ms")


def new_beside(read: str, suffix: str) -> Path:
    """The path of a new file in the working directory, called like what is read, with a number where that is taken."""
    source = Path(read)
    name = source.resolve().name if source.is_dir() else source.stem
    name = "out" if is_numbered(Path(name)) or not name else name
    names = (name if k == 1 else f"{name}_{k}" for k in count(1))
    return next(path for one in names if not (path := Path(f"{one}{suffix}")).exists())


def explainer(wanted: bool, names: Sequence[str] = ()) -> Callable[[Renderer], None]:
    """A function for after each picture: if wanted, it prints what drew it and why, but no line of the last one again.
    names: of the frames that are drawn as one object."""
    before: list[str] = []

    def after_each(renderer: Renderer) -> None:
        lines = renderer.explain(names) if wanted else []
        for line in lines:
            if line not in before:
                print_line(line)
        before[:] = lines

    return after_each


def fail(error: str, code: int) -> NoReturn:
    """Ends the process with the error, if it is not empty, in one line, and if somebody can read it."""
    if error:
        with suppress(OSError):
            complain(f"pointshade: {' '.join(error.split())}")
    drop_unread("stdout", "stderr")
    raise SystemExit(code) from None


def drop_unread(*streams: str) -> None:
    """Lets go of streams that are closed or full: at its end Python would try again, and change the exit code."""
    for name in streams:
        try:
            getattr(sys, name).flush()
        except (AttributeError, OSError):
            setattr(sys, name, None)


@contextmanager
def open_renderer(device: int, *outputs: Path | None) -> Iterator[Renderer]:
    """A renderer, with a note if it runs on the CPU. Raises ValueError if an output is a file that was read."""
    check_not_read(*(file for output in outputs if output for file in existing_files(output)))
    with Renderer(device=device) as renderer:
        announce(renderer)
        yield renderer


def announce(renderer: Renderer) -> None:
    """A note if it runs on the CPU."""
    if renderer.context.is_software:
        print_note(SOFTWARE.format(renderer.context.renderer))


def _is_terminal() -> bool:
    return sys.stderr is not None and sys.stderr.isatty()


@contextmanager
def spinner(text: str) -> Iterator[None]:
    """Shows on a terminal that work goes on."""
    if not _is_terminal():
        yield
        return
    from rich.console import Console

    with Console(stderr=True).status(text):
        yield


@contextmanager
def progress(steps: int, with_rate: bool = False, after: Callable[[], object] = lambda: None) -> Iterator[Progress]:
    """A function to call with how many of all steps are done. It moves a bar on a terminal, and elsewhere nothing.
    with_rate: also show how many are done, how many a second, and the time left. after: called after each step."""
    if not _is_terminal():
        yield lambda *_: after()
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = Progress.get_default_columns()
    if with_rate:
        rate = TextColumn("{task.fields[rate]}")
        columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), rate, TimeRemainingColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True, speed_estimate_period=60) as bar:
        task = bar.add_task("rendering", total=steps, rate="")

        def advance(done: int, _: int) -> None:
            bar.update(task, completed=done)
            speed = bar.tasks[0].speed
            bar.update(task, rate=f"{speed:.3g}/s" if speed else "")
            after()

        yield advance
