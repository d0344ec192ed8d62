"""The script that does in one command what is owed on a GPU: nothing it names is gone, and no part ends the others."""

import argparse
import importlib.util
import json
import sys

import pytest

from ..support.places import ROOT


@pytest.fixture
def script(monkeypatch):
    path = ROOT / "tests/benchmarks/on_a_gpu.py"
    spec = importlib.util.spec_from_file_location("on_a_gpu", path)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "on_a_gpu", module)
    spec.loader.exec_module(module)
    return module


def test_what_its_parts_name_is_there(script):
    probes = (ROOT / script.PROBES).read_text()
    for part in script.PARTS:
        for name in part.tests:
            assert (ROOT / f"tests/{name}.py").is_file()
        if part.script:
            assert (ROOT / part.script[0]).is_file()
        assert part.tests or part.script or f"def probe_{part.name}(" in probes
    assert sum(part.seconds for part in script.PARTS) <= 600
    assert script.readme_line().endswith(".venv/bin/pip install -q -e '.[test]'")


def test_a_part_that_breaks_or_hangs_is_told_and_the_next_goes_on(script, tmp_path):
    def part(name, code, **options):
        (tmp_path / name).write_text(code)
        return script.Part(name, "a title", 1, script=(str(tmp_path / name),), **options)

    parts = [part("breaks", "import sys; sys.exit('a reason')"), part("hangs", "import time; time.sleep(100)")]
    parts += [part("works", "print('fine')"), part("lacks", "", needs="xdist", decides=False)]
    asked = argparse.Namespace(report=tmp_path / "report", minutes=10, python=sys.executable, wheels=None)
    script.USEFUL = {"xdist": "pytest-xdist"}
    script.missing = lambda python, modules, environment: [name for name in modules if name == "xdist"]
    assert script.work(asked, parts) == 1
    results = json.loads((tmp_path / "report/report.json").read_text())
    verdicts = {row["name"]: row["verdict"] for row in results["parts"]}
    assert verdicts == {"breaks": "failed", "hangs": "out of time", "works": "passed"} | {
        "lacks": "left out: needs pytest-xdist"
    }
    text = (tmp_path / "report/report.md").read_text()
    assert "a reason" in text and "fine" in text and "not all right" in text
    assert script.work(asked, parts[2:]) == 0


def test_of_tests_it_counts_and_names_those_that_failed(script):
    output = """tests/a.py::test_one PASSED    [ 33%]
tests/a.py::test_two[x-FAILED] FAILED [ 66%]
[gw0] [100%] SKIPPED tests/a.py::test_three
FAILED tests/a.py::test_two[x-FAILED] - AssertionError: 3 % of the pixels
SKIPPED [1] tests/a.py:3: the compute rasteriser needs OpenGL 4.3
"""
    part = script.Part("tests", "a title", 1, ("a",))
    found = script.judge(part, script.Run(1, output, 1.0))
    assert found["verdict"] == "failed" and found["tests"] == {"passed": 1, "failed": 1, "skipped": 1}
    assert found["failures"] == ["tests/a.py::test_two[x-FAILED] - AssertionError: 3 % of the pixels"]
    assert found["skips"] == ["[1] tests/a.py:3: the compute rasteriser needs OpenGL 4.3"]
    assert script.judge(part, script.Run(0, "", 1.0))["verdict"] == "nothing ran"


def test_wheels_need_no_network_and_what_vtk_asks_for_beside_is_left_out(script, tmp_path, monkeypatch):
    for name in ("vtk-9.7.2-cp311.whl", "imageio_ffmpeg-0.6.0-py3.whl"):
        (tmp_path / name).touch()
    commands, answers = [], iter([["numpy"], ["numpy"], []])  # what both Pythons lack, and nothing in the end
    monkeypatch.setattr(script, "missing", lambda *_: next(answers))
    monkeypatch.setattr(script, "run", lambda command, *_: commands.append(command) or script.Run(0, "", 0.0))
    python, environment = script.find_python(argparse.Namespace(python=None, wheels=tmp_path), tmp_path)
    assert python == sys.executable and all("--no-index" in one for one in commands)
    vtk, ours = commands
    assert "--no-deps" in vtk and vtk[-1].endswith("vtk-9.7.2-cp311.whl")
    assert ours[-1] == "imageio-ffmpeg" and "pytest-xdist" not in ours and "numpy" in ours
    assert ours[ours.index("--target") + 1] in environment["PYTHONPATH"]


@pytest.mark.system
def test_a_broken_plugin_of_another_package_stops_no_test(script, tmp_path):
    about = tmp_path / "broken-1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Name: broken\nVersion: 1\n")
    (about / "entry_points.txt").write_text("[pytest11]\nbroken = nowhere_at_all\n")
    part = script.Part("tests", "a title", 1, ("support/test_compare",))
    command = script.command_of(part, sys.executable, tmp_path, has_workers=True)
    done = script.run(command, 60, script.environment_of([str(tmp_path)]), tmp_path / "log.txt")
    assert script.judge(part, done)["verdict"] == "passed", done.output
