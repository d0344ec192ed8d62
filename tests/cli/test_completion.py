"""The shell completes commands, options, their values, and inputs: bash itself is asked."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pointshade_gl.files.access.known_names import FRAMES, SCENES
from pointshade_gl.files.depth.depth_kinds import KINDS
from pointshade_gl.scene.appearance import SHADINGS, SPLATS
from pointshade_gl.scene.noise import METHODS

from ..support.places import ROOT

if shutil.which("bash") is None or sys.platform == "win32":
    pytest.skip("needs bash", allow_module_level=True)

pytestmark = pytest.mark.system

ASK = 'source ./script; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _pointshade_completion pointshade; '
ASK += r'printf "%s\n" "${COMPREPLY[@]}"'


@pytest.fixture
def shell(tmp_path, monkeypatch):
    """shell("render", "va"): what bash offers for the last word."""
    monkeypatch.chdir(tmp_path)
    command = Path("bin", "pointshade")
    command.parent.mkdir()
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m pointshade_gl "$@"\n')
    command.chmod(0o755)
    monkeypatch.setenv("PATH", str(command.parent.resolve()), prepend=os.pathsep)
    monkeypatch.setenv("PYTHONPATH", str(ROOT), prepend=os.pathsep)
    monkeypatch.setenv("_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION", "1")
    script = subprocess.run(["pointshade", "--show-completion", "bash"], capture_output=True, text=True, check=True)
    Path("script").write_text(script.stdout)
    assert "complete -o default -F _pointshade_completion" in script.stdout  # where nothing is offered: files

    def offered(*words):
        line = ["bash", "-c", ASK, "bash", "pointshade", *words]
        return subprocess.run(line, capture_output=True, text=True, check=True, timeout=60).stdout.split()

    return offered


def test_commands_options_and_values_are_offered(shell):
    assert shell("ren") == ["render"]
    assert shell("render", "--depth-s") == ["--depth-scale"]
    for option, known in (("shading", SHADINGS), ("splat", SPLATS), ("normals", METHODS), ("depth-kind", KINDS)):
        assert shell("render", f"--{option}", "") == list(known)
    assert shell("normals", "--normals", "star") == ["star", "star-borrow"]
    assert shell("render", "--light", '"position=0,0,0 shadow"', "--turntable", "c") == ["camera"]


def test_an_input_is_a_builtin_name_or_what_lies_here(shell):
    Path("vacation").mkdir()
    assert shell("render", "va") == ["vase", "vase/whole", "vase/front", "vacation"]
    assert shell("view", "") == [*FRAMES, *SCENES, "bin", "script", "vacation"]
    assert shell("render", "vac") == shell("render", "--color", "") == []  # bash goes on with files
