"""The README's Python examples run as they stand, and its table of environment variables is complete.

The viewer's example is in viewer/test_application.py.
"""

import ast
import dis
import re
import shutil
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.access.builtin import asset

from .support import frames
from .support.places import README, ROOT
from .support.small_ray import small_ray

EXAMPLES = [text for text in re.findall(r"```python\n(.*?)```", README.read_text(), re.DOTALL) if "Viewer" not in text]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The working directory of a user, with the frame and the sequences that the examples name."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(asset("vase"), "my_frame")
    for kind in ("color", "depth"):
        Path("my_sequence", kind).mkdir(parents=True)
    for k in range(2):
        ps.save_image(f"my_sequence/color/{k}.png", frames.sphere().color)
        np.save(f"my_sequence/depth/{k}.npy", frames.sphere().depth)
    c = frames.CAMERA
    numbers = f'"fx": {c.fx}, "fy": {c.fy}, "cx": {c.cx}, "cy": {c.cy}, "width": {c.width}, "height": {c.height}'
    Path("my_sequence/intrinsics.json").write_text(f"{{{numbers}}}")
    for name in ("left", "right"):
        shutil.copytree("my_sequence", name)
    ball = np.random.default_rng(0).normal(size=(500, 3))
    ps.save_points("scan.ply", ps.PointCloud(ball / np.linalg.norm(ball, axis=1, keepdims=True)))
    return tmp_path


@pytest.mark.parametrize(
    "number",
    [pytest.param(k, marks=[pytest.mark.system] * ("import ray" in text)) for k, text in enumerate(EXAMPLES)],
)
def test_an_example_of_the_readme_runs_and_writes_its_files(renderer, folder, number):
    if ".mp4" in EXAMPLES[number]:
        pytest.importorskip("imageio_ffmpeg")
    with small_ray() if "import ray" in EXAMPLES[number] else nullcontext():
        exec(EXAMPLES[number], {"__name__": "__main__"})
    written = re.findall(r'(?:save_\w+|Film)\("(.*?)"', EXAMPLES[number])
    assert written and all((folder / name).stat().st_size for name in written)


def test_the_environment_variables_that_the_package_reads_are_in_the_table():
    read = set()
    for path in (ROOT / "pointshade_gl").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        texts = [one.value for one in ast.walk(ast.parse(text)) if isinstance(one, ast.Constant)]
        texts = [one for one in texts if isinstance(one, str) and re.fullmatch(r"[A-Z][A-Z0-9]*(_[A-Z0-9]+)+", one)]
        read |= {
            one
            for one in texts
            if re.search(r"\benviron\b", text) and not one.startswith("GL_") and one not in dis.opmap
        }
    rows = README.read_text().split("| environment variable |")[1].split("\n\n")[0].splitlines()[2:]
    assert read == {name for row in rows for name in re.findall(r"`(\w+)`", row.split("|")[1])}
