"""The command line `pointshade`: its commands are in commands/, errors become one sentence each."""

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence
from importlib import import_module
from io import TextIOWrapper
from typing import Annotated, NoReturn

import typer

from ..files.access.content import noting_reads
from ..notes.errors import ContextError, error_text, is_expected
from ..notes.notes import few_notes
from ..notes.version import __version__
from ..notes.words import as_command_line
from .option_groups import CliCommand, CliCommands, UsageError, sentence_of
from .output import drop_unread, fail

# a process is asked to end, or its terminal is closed (not on Windows)
_ENDINGS = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]

SOFTWARE = 70  # exit code of a bug: EX_SOFTWARE, which Windows has not
CLOSED = 141  # whoever read the output has gone: as shells report a program that ended by SIGPIPE

COMMANDS = {  # as the help lists them, and the files in commands/ that hold them
    "render": "render_command",
    "normals": "estimate_commands",
    "depth": "estimate_commands",
    "albedo": "estimate_commands",
    "align": "estimate_commands",
    "view": "view_command",
    "info": "info_command",
    "batch": "batch_command",
    "bench": "info_command",
}


def command_line(names: Sequence[str] = tuple(COMMANDS)) -> typer.Typer:
    """Return the command line with these commands. Each is imported here: the others would take as long again."""
    app = typer.Typer(
        cls=CliCommands,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(_every_command)
    for name in names:
        app.command(cls=CliCommand)(getattr(import_module(f"{__package__}.commands.{COMMANDS[name]}"), name))
    return app


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"pointshade_gl {__version__}")
        raise typer.Exit


def _every_command(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Turn depth and colour pictures into lit objects, on the GPU."""


def main() -> None:
    """Runs the command line. Every error becomes one sentence: exit code 2, 1 without GL or memory, 70 for a bug.
    POINTSHADE_DEBUG=1 shows the traceback before it, of expected errors, too."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # names of files may hold what an encoding lacks
            stream.reconfigure(errors="backslashreplace")
    for ending in _ENDINGS:
        if signal.getsignal(ending) != signal.SIG_IGN:  # as nohup wants it
            signal.signal(ending, _interrupt)
    try:
        with as_command_line(), few_notes(), noting_reads():
            ended = command_line(_asked(sys.argv[1:]))(prog_name="pointshade", standalone_mode=False)
            print(end="", flush=True)  # while a closed or full output is still an error
        drop_unread("stderr")
        raise SystemExit(ended or 0)
    except SystemExit as end:
        if isinstance(end.__context__, BrokenPipeError):  # typer has ended it
            raise SystemExit(CLOSED) from None
        raise
    except BrokenPipeError:
        sys.stdout = None  # or Python would try again
        raise SystemExit(CLOSED) from None
    except UsageError as error:
        fail(sentence_of(error, command_line), error.exit_code)
    except Exception as error:
        is_machine = isinstance(error, MemoryError | ContextError)
        fail(error_text(error), SOFTWARE if not is_expected(error) else 1 if is_machine else 2)


def _asked(typed: Sequence[str]) -> Sequence[str]:
    """Return the command that was typed; all of them for the help, the shell's completion and words that are none."""
    return typed[:1] if typed and typed[0] in COMMANDS else tuple(COMMANDS)


def _interrupt(*_: object) -> NoReturn:
    """Ends the work as Ctrl-C does, so that nothing is left half-written; only once, or cleaning up would end, too."""
    for ending in _ENDINGS:  # to ignore a signal that has come already, Python would print a traceback
        signal.signal(ending, lambda *_: None)
    raise KeyboardInterrupt
