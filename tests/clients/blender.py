"""The Python that has Blender's module, bpy: an environment of its own, as bpy wants one version of Python."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from .conftest import missing

EXAMPLE = Path(__file__).parents[2] / "examples" / "blender_cycles.py"
PROBE = Path(__file__).with_name("in_blender") / "read_scene.py"


def blender_python():
    """The Python named by POINTSHADE_BPY_PYTHON, or this one; without bpy see `missing`."""
    named = os.environ.get("POINTSHADE_BPY_PYTHON")
    if named:
        return named
    if importlib.util.find_spec("bpy") is None:
        missing("no bpy, and no POINTSHADE_BPY_PYTHON")
    return sys.executable


def run(script, *arguments, folder):
    """Run a script in Blender's Python; it may end in no other way than well."""
    command = [blender_python(), str(script), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]


def ask(jobs, folder):
    """What Blender makes of files, see in_blender/read_scene.py; pictures are arrays."""
    (folder / "jobs.json").write_text(json.dumps(jobs))
    run(PROBE, folder / "jobs.json", folder / "answers.json", folder=folder)
    answers = json.loads((folder / "answers.json").read_text())
    for job, answer in zip(jobs, answers, strict=True):
        if "picture" in job:
            answer["picture"] = np.load(job["picture"])[..., :3]
    return answers


def run_example(path):
    """The picture that the example writes."""
    run(EXAMPLE, path, folder=path.parent)
    with Image.open(path) as image:
        return np.asarray(image)
