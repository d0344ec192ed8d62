"""Tests that take long fail, by the CPU of all their processes, unless they are marked as those of the system."""

import json
import os
import subprocess
import sys
from types import SimpleNamespace

import pytest

from .durations import Durations, cpu_seconds, descendants, slowness
from .places import ROOT

BUSY = "import time; end = time.process_time() + 0.3\nwhile time.process_time() < end: pass"
LIMIT = 0.1
CONFTEST = f"""
from pathlib import Path
from tests.support.durations import Durations
def pytest_configure(config):
    config.addinivalue_line("markers", "system: may take long")
    config.pluginmanager.register(Durations(Path("build/durations.json"), {LIMIT}, lambda: 1.0))
"""
TESTS = f"""
import subprocess, sys, time, pytest
made = []
@pytest.fixture(scope="module")
def slow(): exec({BUSY!r})
def test_sleeping(): time.sleep(0.4)
def test_busy(): exec({BUSY!r})
def test_child(): subprocess.run([sys.executable, "-c", {BUSY!r}], check=True)
def test_fixture(slow): pass
def test_last(slow): pass
def test_rather_long(): exec({BUSY!r}.replace("0.3", "0.15"))
def test_first_time():
    made.append(1)
    if len(made) == 1: exec({BUSY!r})
def test_wrong():
    exec({BUSY!r})
    assert False
@pytest.mark.system
def test_system(): exec({BUSY!r})
"""


def test_a_child_counts_while_it_lives_and_when_it_has_ended():
    # Linux cuts a child's user and its system time to whole ticks: up to two ticks of the 0.3 s are not seen.
    least = 0.3 - (2.5 / os.sysconf("SC_CLK_TCK") if sys.platform.startswith("linux") else 0.01)
    before = cpu_seconds()
    code = f"{BUSY}\nprint(1, flush=True); time.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as child:
        child.stdout.read(1)
        if sys.platform.startswith("linux"):
            assert child.pid in descendants(os.getpid()) and cpu_seconds() - before > least
        child.kill()
    assert cpu_seconds() - before > least


def test_on_a_slow_machine_a_test_may_take_longer():
    assert 1 <= slowness() < 100
    item = SimpleNamespace(get_closest_marker=lambda _: None)
    for times, is_slow in ((1.0, True), (2.0, False)):
        plugin = Durations(limit=0.1, slowness=lambda times=times: times)
        plugin.spent = 0.3
        assert plugin._is_too_slow(item, []) == is_slow


@pytest.mark.system
def test_what_takes_long_fails_with_its_name_and_time_but_not_what_only_takes_long_at_first(tmp_path):
    (tmp_path / "conftest.py").write_text(CONFTEST)
    (tmp_path / "test_it.py").write_text(TESTS)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", str(tmp_path), "test_it.py"]
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTEST_ADDOPTS": ""}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert "1 failed, 8 passed, 2 errors" in done.stdout
    assert "test_it.py::test_rather_long: 0." in done.stdout and "test_system: " not in done.stdout
    for name in ("test_busy", "test_child"):
        assert f"test_it.py::{name} took 0." in done.stdout
    found = json.loads((tmp_path / "build" / "durations.json").read_text())
    slow = {name for name, seconds in found.items() if seconds > 0.2}
    assert slow == {f"test_it.py::test_{name}" for name in ("busy", "child", "wrong", "system")} and len(found) == 9
