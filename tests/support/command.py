"""The command line as a user types it: within this process, or where that matters in one of its own."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from contextlib import redirect_stderr, redirect_stdout
from typing import Any, NamedTuple

import pytest

from pointshade_gl.cli import main as cli
from pointshade_gl.notes.words import option


class Done(NamedTuple):
    """What a command ended in."""

    returncode: int
    stdout: str
    stderr: str


def run(*arguments: Any) -> Done:
    """Run `pointshade` here: a process of its own would take half a second to start."""
    handlers = {ending: signal.getsignal(ending) for ending in cli._ENDINGS}
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8") for _ in range(2))
    try:
        with pytest.MonkeyPatch.context() as shell, redirect_stdout(out), redirect_stderr(err):
            shell.setattr(sys, "argv", ["pointshade", *map(str, arguments)])
            with pytest.raises(SystemExit) as ended:
                cli.main()
    finally:
        for ending, handler in handlers.items():
            signal.signal(ending, handler)
    assert option("fov") == "fov"  # the library speaks Python again
    return Done(ended.value.code, *map(_text, (out, err)))


def run_process(*arguments: Any, environment: Mapping[str, str] | None = None) -> Done:
    """Run `pointshade` as a process."""
    done = subprocess.run(
        [sys.executable, "-m", "pointshade_gl", *map(str, arguments)],
        capture_output=True, text=True, timeout=120, env=os.environ | (environment or {}),
    )  # fmt: skip
    return Done(done.returncode, done.stdout, done.stderr)


def _text(stream: io.TextIOWrapper) -> str:
    stream.seek(0)
    return stream.read()
