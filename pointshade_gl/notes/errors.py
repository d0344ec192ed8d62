"""The package's own exceptions, and the sentences that errors become: those meant for users, and bugs."""

from __future__ import annotations

import dis
import os
import sys
import traceback
from pathlib import Path
from typing import Any

from .version import __version__
from .words import cut, shown

SPAWN = "start processes by spawn, multiprocessing.get_context('spawn')"


class ContextError(RuntimeError):
    """No usable OpenGL context: none on this machine, too old, released, or of another thread or process."""


class ShaderError(RuntimeError):
    """A shader cannot be assembled or compiled; the message names file and line."""


class Cancelled(Exception):
    """Work that its `progress` has ended by returning False: nothing is half-written, and renderers go on."""


def check_process(process: int, what: str) -> None:
    """Raise ContextError where what a process made is used in its fork, which has none of its threads.

    process  what os.getpid() gave as it was made
    """
    if os.getpid() != process:
        raise ContextError(f"this {what} was made before a fork: {SPAWN}, and make a new one in each")


def check_function(value: Any, name: str) -> Any:
    """The value. Raises TypeError unless it can be called."""
    if not callable(value):
        raise TypeError(f"{name} must be a function, got {shown(value)}")
    return value


PACKAGE = str(Path(__file__).parents[1]) + os.sep  # as code objects have it
DEBUG = "POINTSHADE_DEBUG"  # the environment variable that shows tracebacks, of all errors
_RAISE = dis.opmap["RAISE_VARARGS"]


class Bug(ValueError):
    """A bug that made one of many things fail, in a sentence. Whoever goes on after a ValueError goes on after it."""


def is_expected(error: BaseException) -> bool:
    """Return whether an error is about files, options or the machine, and no bug.

    A ValueError or a TypeError is, if a `raise` of this package raised it: what others raise of their own on bad input,
    such as NumPy and Pillow, is translated where files are read. One without a traceback came from another process.
    """
    if isinstance(error, OSError | MemoryError | ContextError):
        return True
    if not isinstance(error, ValueError | TypeError) or isinstance(error, Bug):
        return False
    at = error.__traceback__
    if at is None:
        return True
    while at.tb_next is not None:  # where it was raised
        at = at.tb_next
    code = at.tb_frame.f_code
    return code.co_filename.startswith(PACKAGE) and code.co_code[at.tb_lasti] == _RAISE


def error_text(error: BaseException) -> str:
    """Return the message of an error, in one line; of a bug that it is one. POINTSHADE_DEBUG=1 prints its traceback."""
    if os.environ.get(DEBUG, "0") not in ("", "0") and sys.stderr is not None:
        traceback.print_exception(error)
    stated = " ".join(str(error).split())
    if isinstance(error, Bug):
        return stated
    if is_expected(error):
        return stated or "not enough memory"
    what = f"{type(error).__name__}: {cut(stated)}".removesuffix(": ")
    return (
        f"{what}{_place_of(error)}: this is a bug in pointshade_gl {__version__}, and "
        f"no mistake of yours; please report it with the command and what {DEBUG}=1 shows"
    )


def _place_of(error: BaseException) -> str:
    """The last line of this package that ran, in words."""
    ours = [at for at in traceback.extract_tb(error.__traceback__) if at.filename.startswith(PACKAGE)]
    return f" (in {Path(ours[-1].filename).relative_to(PACKAGE).as_posix()}:{ours[-1].lineno})" if ours else ""
