"""The Python that has Blender's module, bpy: an environment of its own, as bpy wants one version of Python."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

PROBE = Path(__file__).with_name("in_blender") / "read_scene.py"


def blender_python():
    """The Python named by POINTSHADE_BPY_PYTHON, or this one; the test is skipped without bpy."""
    named = os.environ.get("POINTSHADE_BPY_PYTHON")
    if named:
        return named
    if importlib.util.find_spec("bpy") is None and os.environ.get("POINTSHADE_REQUIRE_CLIENTS") != "1":
        pytest.skip("needs bpy: name its Python in POINTSHADE_BPY_PYTHON")
    return sys.executable


def ask(jobs, folder):
    """What Blender makes of files, see in_blender/read_scene.py; pictures are arrays."""
    (folder / "jobs.json").write_text(json.dumps(jobs))
    command = [blender_python(), str(PROBE), str(folder / "jobs.json"), str(folder / "answers.json")]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    answers = json.loads((folder / "answers.json").read_text())
    for job, answer in zip(jobs, answers, strict=True):
        if "picture" in job:
            answer["picture"] = np.load(job["picture"])[..., :3]
    return answers
