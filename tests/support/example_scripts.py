"""Runs what lies in examples/ as a user types it, in a folder of the test's own; servers are ended with the test."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .places import ROOT

EXAMPLES = ROOT / "examples"
PICTURES = EXAMPLES / "pictures"


def _environment(folder: Path, **more: str) -> dict[str, str]:
    """A home of its own, in which programs keep what they like, and no word to anyone outside."""
    quiet = {"GRADIO_ANALYTICS_ENABLED": "False", "MARIMO_SKIP_UPDATE_CHECK": "1", "HOME": str(folder)}
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    quiet |= {"PYTHONPATH": os.pathsep.join(paths), "PYTHONUNBUFFERED": "1"}
    programs = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])  # `pointshade` of this Python
    return os.environ | quiet | {"PATH": programs} | more


def run_example(folder: Path, name: str, *arguments: str) -> str:
    """What `python examples/NAME.py ARGUMENTS`, or `sh NAME.sh ...`, prints; its files are in the folder afterwards."""
    script = EXAMPLES / f"{name}.sh"
    command = ["sh", "-e", script] if script.exists() else [sys.executable, EXAMPLES / f"{name}.py"]
    done = subprocess.run(
        [*command, *arguments], cwd=folder, env=_environment(folder), capture_output=True, text=True, timeout=240
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def free_port() -> int:
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        return listening.getsockname()[1]


@contextmanager
def served(folder: Path, *command: str | Path, **environment: str) -> Iterator[str]:
    """The address that a server prints, which runs until the end of the block, with all its children.

    Where the tests are ended before that, it ends by itself five minutes after its start.
    """
    lines: list[str] = []
    options = {"cwd": folder, "env": _environment(folder, **environment), "text": True, "start_new_session": True}
    with subprocess.Popen(
        ["timeout", "300", *command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **options
    ) as server:
        try:
            reading = threading.Thread(target=lambda: lines.extend(iter(server.stdout.readline, "")), daemon=True)
            reading.start()
            yield _address(server, lines)
        finally:
            os.killpg(server.pid, signal.SIGTERM)
            try:
                server.wait(20)
            except subprocess.TimeoutExpired:
                os.killpg(server.pid, signal.SIGKILL)


def _address(server: subprocess.Popen[str], lines: list[str]) -> str:
    end = time.monotonic() + 120
    while time.monotonic() < end and server.poll() is None:
        if found := re.search(r"https?://(?:127\.0\.0\.1|localhost):\d+[^\s\x1b]*", "".join(lines)):
            return found[0].replace("localhost", "127.0.0.1")
        time.sleep(0.1)
    raise AssertionError(f"it does not serve: {''.join(lines)}")
