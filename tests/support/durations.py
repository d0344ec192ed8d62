"""CPU seconds of each test, in build/durations.json; a test that takes more than 2 and is not marked `system` fails.

CPU of the process that runs the test and of all its descendants, also of those that a fixture of the file started:
a busy machine makes no test slow.
"""

from __future__ import annotations

import json
import os
from contextlib import suppress
from pathlib import Path

import pytest

from .places import ROOT

LIMIT = 2.0
FILE = ROOT / "build" / "durations.json"
_START, _SECONDS = pytest.StashKey[float](), pytest.StashKey[float]()
_open, _listdir = open, os.listdir  # tests replace them


def _read(path: str) -> str:
    with _open(path) as file:
        return file.read()


def descendants(process: int) -> list[int]:
    """The process ids of all living descendants; none where the system has no /proc."""
    found: list[int] = []
    with suppress(OSError):
        for thread in _listdir(f"/proc/{process}/task"):
            with suppress(OSError):  # it has ended
                found += map(int, _read(f"/proc/{process}/task/{thread}/children").split())
    return found + [one for child in found for one in descendants(child)]


def cpu_seconds() -> float:
    """CPU of this process, its living descendants, and those that were waited for."""
    ticks = 0
    for process in descendants(os.getpid()):
        with suppress(OSError):
            ticks += sum(map(int, _read(f"/proc/{process}/stat").rpartition(")")[2].split()[11:15]))
    return sum(os.times()[:4]) + (ticks / os.sysconf("SC_CLK_TCK") if ticks else 0)


class Durations:
    """The plugin: the process that runs a test measures, the one that gathers the reports writes."""

    def __init__(self, file: Path = FILE, limit: float = LIMIT):
        self.file, self.limit = file, limit
        self.seconds: dict[str, float] = {}

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item):
        item.stash[_START], item.stash[_SECONDS] = cpu_seconds(), 0.0
        return (yield)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item, call):
        report = yield
        now = cpu_seconds()
        item.stash[_SECONDS] += max(0.0, now - item.stash[_START])  # less where a process ends without being waited for
        item.stash[_START] = now
        if call.when == "teardown":
            seconds = report.cpu_seconds = round(item.stash[_SECONDS], 3)
            if seconds > self.limit and report.passed and not item.get_closest_marker("system"):
                report.outcome = "failed"
                report.longrepr = (
                    f"{item.nodeid} took {seconds:.1f} CPU seconds: make it shorter than {self.limit:g}, or mark it "
                    "pytest.mark.system"
                )
        return report

    def pytest_runtest_logreport(self, report):
        if report.when == "teardown":
            self.seconds[report.nodeid] = report.cpu_seconds

    def pytest_sessionfinish(self, session):
        if not hasattr(session.config, "workerinput") and self.seconds:
            with suppress(OSError):  # a checkout that cannot be written
                self.file.parent.mkdir(exist_ok=True)
                self.file.write_text(json.dumps(dict(sorted(self.seconds.items())), indent=0) + "\n")
