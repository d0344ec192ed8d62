"""The Python that has Blender's module, bpy: an environment of its own, as bpy wants one version of Python."""

import json
import subprocess
from pathlib import Path

import numpy as np
from PIL import Image

from .conftest import blender_python

EXAMPLE = Path(__file__).parents[2] / "examples" / "blender_cycles.py"
PROBE = Path(__file__).with_name("in_blender") / "read_scene.py"


def run(script, *arguments, folder):
    """Run a script in Blender's Python; it may end in no other way than well."""
    command = [blender_python(), str(script), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder, timeout=280)
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
