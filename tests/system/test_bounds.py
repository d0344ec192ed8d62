"""The bounds in pyproject.toml are true: with the lowest and the newest releases they allow, the commands work.

pip takes the releases from wherever it is set up to. Where Python is too new for the wheels of a bound, the lowest
release that has one stands for it.
"""

import ast
import os
import re
import subprocess
import sys
import venv

import pytest
from packaging.requirements import Requirement
from packaging.version import Version
from typer.main import get_command

from pointshade_gl.cli.main import command_line

from ..support.places import ROOT

pytestmark = pytest.mark.system
WHEELS = "--only-binary", ":all:"
TIMEOUT = 240  # seconds for each call


def dependencies():
    """Of the package without extras."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    return [Requirement(line) for line in ast.literal_eval(re.search(r"(?ms)^dependencies = (\[.*?\])", text)[1])]


def call(python, *arguments, folder, **variables):
    """What a process of that Python writes."""
    command = [str(python), *map(str, arguments)]
    try:
        done = subprocess.run(
            command, cwd=folder, env=os.environ | variables, capture_output=True, text=True, timeout=TIMEOUT
        )
    except subprocess.TimeoutExpired:
        pytest.fail(f"{' '.join(command)} did not end within {TIMEOUT} s: is there a network for pip?")
    if done.returncode:
        pytest.fail(f"{' '.join(command)} ended in {done.returncode}:\n{(done.stdout + done.stderr)[-2000:]}")
    return done.stdout


def lowest(python, wanted, folder):
    """The first release within the bound that has a wheel for this Python."""
    listed = call(python, "-m", "pip", "index", "versions", wanted.name, *WHEELS, folder=folder)
    found = re.search(r"Available versions: (.*)", listed)[1].split(", ")
    return f"{wanted.name}=={min(wanted.specifier.filter(found), key=Version)}"


@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize("releases", ["lowest", "newest"])
def test_every_command_works_with(releases, tmp_path):
    """Without any extra: `.ply` needs none."""
    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / ("Scripts" if sys.platform == "win32" else "bin") / "python"
    wanted = dependencies()
    chosen = [lowest(python, one, tmp_path) for one in wanted] if releases == "lowest" else [*map(str, wanted)]
    call(python, "-m", "pip", "install", *WHEELS, *chosen, folder=tmp_path)
    print(call(python, "-m", "pip", "freeze", folder=tmp_path))  # what a failure is about
    commands = [[], *([name] for name in get_command(command_line()).commands)]
    for command in [
        *([*command, "--help"] for command in commands),
        ["render", "-o", "a.png"],
        ["render", "-o", "a.ply"],
    ]:
        call(python, "-m", "pointshade_gl", *command, folder=tmp_path, PYTHONPATH=str(ROOT))
    assert (tmp_path / "a.png").stat().st_size > 20_000
    assert (tmp_path / "a.ply").stat().st_size > 1_000_000
