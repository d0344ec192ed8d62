"""CPU seconds of each test, in build/durations.json. Those that take more than 2 and are not marked `system` are named
at the end; one that takes twice as many fails: the same work takes so much longer where others use the machine, too.

CPU of the process that runs the test and of all its descendants, also of those that a fixture of the file started:
a busy machine makes no test slow. Nor does a slow one: seconds are those of a machine that does `_work` in .03.
Fixtures of whole files and runs are not counted.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from _pytest.runner import runtestprotocol

from .places import ROOT

LIMIT = 2.0
FAILS = 2.0  # times the limit
USUAL = 0.03  # seconds of `_work` on a fast desktop
FILE = ROOT / "build" / "durations.json"
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


def slowness() -> float:
    """How many times longer work takes here and now than on a usual machine; at least 1."""
    return max(1.0, min(_work() for _ in range(3)) / USUAL)


def _work() -> float:
    """CPU seconds of some Python and some NumPy."""
    before, total = time.process_time(), 0
    for k in range(400_000):
        total += k * k % 7
    numbers = np.arange(200_000, dtype=np.float32)
    for _ in range(100):
        numbers = np.sqrt(numbers * 1.0001 + 1)
    return time.process_time() - before


class Durations:
    """The plugin: the process that runs a test measures, the one that gathers the reports writes."""

    def __init__(self, file: Path = FILE, limit: float = LIMIT, slowness: Callable[[], float] = slowness):
        self.file, self.limit, self.slowness = file, limit, slowness
        self.seconds: dict[str, float] = {}
        self.slow: list[str] = []
        self.before = self.spent = 0.0

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item, nextitem):
        """Run a test; if it was too slow, again: the first run also compiles shaders."""
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        reports = runtestprotocol(item, log=False, nextitem=nextitem)
        if self._is_too_slow(item, reports):
            item._initrequest()
            reports = runtestprotocol(item, log=False, nextitem=nextitem)
        last = reports[-1]
        last.cpu_seconds = round(self.spent, 3)
        if self._is_too_slow(item, reports):
            last.outcome = "failed"
            last.longrepr = (
                f"{item.nodeid} took {self.spent:.1f} CPU seconds: make it shorter than {self.limit:g}, or mark it "
                "pytest.mark.system. For this run: --cpu-limit SECONDS"
            )
        for report in reports:
            item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True

    def _is_too_slow(self, item, reports):
        passed = all(report.passed for report in reports)
        most = FAILS * self.limit
        if not passed or self.spent <= most or item.get_closest_marker("system"):
            return False
        return self.spent > most * self.slowness()

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self):
        self.before, self.spent = cpu_seconds(), 0.0

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef):
        """What a fixture of a whole file makes is not charged to the test that comes first."""
        before = cpu_seconds() if fixturedef.scope != "function" else None
        made = yield
        if before is not None:
            self.before += cpu_seconds() - before
        return made

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self):
        report = yield
        now = cpu_seconds()
        self.spent += max(0.0, now - self.before)  # less where a process ends without being waited for
        self.before = now
        return report

    def pytest_runtest_logreport(self, report):
        if report.when == "teardown":
            self.seconds[report.nodeid] = report.cpu_seconds
            if report.cpu_seconds > self.limit and "system" not in report.keywords:
                self.slow.append(report.nodeid)

    def pytest_terminal_summary(self, terminalreporter):
        for name in self.slow:
            terminalreporter.write_line(f"{name}: {self.seconds[name]:.1f} CPU seconds, and {self.limit:g} are enough")

    def pytest_sessionfinish(self, session):
        if not hasattr(session.config, "workerinput") and self.seconds:
            with suppress(OSError):  # a checkout that cannot be written
                self.file.parent.mkdir(exist_ok=True)
                self.file.write_text(json.dumps(dict(sorted(self.seconds.items())), indent=0) + "\n")
