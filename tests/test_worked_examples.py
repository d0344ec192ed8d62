"""The examples of docs/contributing.md work as they are written: each is made in a copy and tested."""

import os
import shlex
import shutil
import subprocess
import sys

import pytest

from .support.places import REAL_FRAMES, ROOT
from .support.worked_examples import apply, changed, sections

EXAMPLES = sections()
KEPT = "pointshade_gl", "shaders", "assets", "tests", "docs", "examples", "pyproject.toml"  # and all .md


@pytest.fixture
def copy(tmp_path):
    """A copy of the repository."""
    ignored = shutil.ignore_patterns("__pycache__", "auto_examples", "failures")
    for path in [*map(ROOT.joinpath, KEPT), *ROOT.glob("*.md")]:
        if path.is_dir():
            shutil.copytree(path, tmp_path / path.name, ignore=ignored)
        else:
            shutil.copy(path, tmp_path)
    return tmp_path


def ran(line, folder):
    """What a command prints, as it runs in the copy. Fails where it fails."""
    command, *rest = shlex.split(line)
    module = {"pointshade": "pointshade_gl", "pytest": "pytest"}[command]
    quiet = ["-q", "-p", "no:cacheprovider"] if command == "pytest" else []
    environment = {**os.environ, "PYTHONPATH": str(folder), "POINTSHADE_DATA": str(REAL_FRAMES)}
    done = subprocess.run(
        [sys.executable, "-m", module, *quiet, *rest], capture_output=True, text=True, cwd=folder, env=environment
    )
    assert done.returncode == 0, f"{line}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return done.stdout


def test_the_examples_are_those_of_the_page():
    assert list(EXAMPLES) == ["an estimator of normals", "a pass", "a file format", "a command"]


@pytest.mark.system
@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_is_whole(copy, name):
    lines = apply(EXAMPLES[name], copy)
    assert lines and lines[0].startswith("pytest ")
    written = [line.partition("-o ")[2].split()[0] for line in lines if " -o " in line]
    for line in lines:
        ran(line, copy)
    assert all((copy / name).stat().st_size for name in written)
    lint = [sys.executable, "-m", "ruff"]
    for check in (["check"], ["format", "--check"]):
        done = subprocess.run([*lint, *check, "."], capture_output=True, text=True, cwd=copy)
        assert done.returncode == 0, done.stdout


def test_a_change_is_made_where_its_lines_are():
    assert changed("a\nb\nc\nb\n", " c\n-b\n+d\n", "") == "a\nb\nc\nd\n"
    with pytest.raises(AssertionError, match="there 2 times"):
        changed("a\nb\nc\nb\n", "-b\n+d\n", "")
