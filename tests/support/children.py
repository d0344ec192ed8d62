"""Processes that tests start: signals reach them, and none outlives its test."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

_ENDINGS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


@contextmanager
def default_signals() -> Iterator[None]:
    """Start processes inside with the default handlers of signals, even if this process ignores them.

    `nohup` and `&` in a script ignore signals for all processes below. A handler of our own, unlike that, ends at exec.
    """
    ignored = [ending for ending in _ENDINGS if signal.getsignal(ending) == signal.SIG_IGN]
    for ending in ignored:
        signal.signal(ending, lambda *_: None)
    try:
        yield
    finally:
        for ending in ignored:
            signal.signal(ending, signal.SIG_IGN)


def environment_with(folder: Path) -> dict[str, str]:
    """The environment for a process that finds the packages of a folder before those that this one finds."""
    paths = [str(folder), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}


@contextmanager
def started(command: list[Any], **options: Any) -> Iterator[subprocess.Popen[str]]:
    """Start a process with pipes for its words. At the end it and what it has started are killed if they still run."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    process = subprocess.Popen([*map(str, command)], **(pipes | options))
    try:
        yield process
    finally:
        end(process)


def end(process: subprocess.Popen[str]) -> None:
    """Kill a process that still runs, with its group if it leads one."""
    if process.poll() is None:
        if hasattr(os, "killpg") and os.getpgid(process.pid) == process.pid:
            os.killpg(process.pid, signal.SIGKILL)
        process.kill()
        process.wait()
    for pipe in (process.stdout, process.stderr):
        if pipe is not None:
            pipe.close()
