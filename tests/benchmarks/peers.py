"""What the benchmarks beside other programs share: processes that are measured, Pythons that are found, results."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[2]
OURS = "pointshade_gl"


class Run(NamedTuple):
    """Of a process: seconds by the wall clock and of all cores, gigabytes, and what it said of itself in JSON."""

    wall: float
    cpu: float
    memory: float
    said: dict[str, Any]


class Peak:
    """The most memory that a process takes, GB, watched on Linux: wait4 would count what its parent held, too."""

    def __init__(self, process: int) -> None:
        self._file, self._gigabytes, self._ended = Path(f"/proc/{process}/status"), 0.0, threading.Event()
        self._thread = threading.Thread(target=self._watch)
        self._thread.start()

    def stop(self) -> float:
        self._ended.set()
        self._thread.join()
        return self._gigabytes

    def _watch(self) -> None:
        while not self._ended.wait(0.05):
            try:
                lines = self._file.read_text().splitlines()
            except OSError:
                return
            found = (int(line.split()[1]) for line in lines if line.startswith("VmHWM:"))
            self._gigabytes = max(self._gigabytes, next(found, 0) / 2**20)


def measure(command: Sequence[str], **environment: str) -> Run | str:
    """Run a process from its start to its end, or say why it failed."""
    with tempfile.TemporaryFile() as words, tempfile.TemporaryFile() as output:
        settings = os.environ | {"PYTHONPATH": str(ROOT)} | environment
        begin = time.perf_counter()
        child = subprocess.Popen(command, stdout=output, stderr=words, env=settings)
        peak = Peak(child.pid)
        _, status, used = os.wait4(child.pid, 0)
        wall = time.perf_counter() - begin
        child.returncode = status
        memory = peak.stop() or used.ru_maxrss / 2**20
        for file in (words, output):
            file.seek(0)
        if status:
            said = words.read().decode(errors="replace").strip().splitlines()
            return f"failed: {said[-1] if said else f'status {status}'}"
        facts = [line for line in output.read().decode(errors="replace").splitlines() if line.startswith("{")]
    return Run(wall, used.ru_utime + used.ru_stime, memory, json.loads(facts[-1]) if facts else {})


def middle(runs: Sequence[Run | str]) -> Run | str:
    """The medians of some runs, or why one of them failed."""
    good = [one for one in runs if isinstance(one, Run)]
    if len(good) < len(runs):
        return next(one for one in runs if isinstance(one, str))
    said = {
        key: median(one.said[key] for one in good) if isinstance(value, float) else value
        for key, value in good[0].said.items()
    }
    return Run(*(median(values) for values in zip(*(one[:3] for one in good), strict=True)), said)


def python_with(module: str, pythons: Sequence[str]) -> str | None:
    """The first of some interpreters that has a module."""
    asked = f"import importlib.util, sys; sys.exit(importlib.util.find_spec({module!r}) is None)"
    return next((one for one in pythons if not subprocess.run([one, "-c", asked]).returncode), None)


def write_results(path: Path | None, **results: Any) -> None:
    """Write results as JSON with the day, the command and the cores; nothing without a path."""
    if path is not None:
        facts = {"date": date.today().isoformat(), "command": sys.argv, "cores": os.cpu_count()}
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(facts | results, indent=1) + "\n")
