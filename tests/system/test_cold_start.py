"""What the first picture imports: only what it needs, as each module costs about half a millisecond."""

import subprocess
import sys

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.values import median, quantile

pytestmark = pytest.mark.system

PROGRAM = """
import sys
import numpy as np
import pointshade_gl as ps
depth = np.linspace(1, 2, 1200, dtype=np.float32).reshape(30, 40)
frame = ps.Frame(None, depth, ps.Camera(50, 50, 20, 15, 40, 30))
with ps.Renderer() as renderer:
    ps.save_image(sys.argv[1], renderer.render(frame))
print(*sys.modules)
"""
NOT_NEEDED = (
    "numpy.ma",
    "PIL",
    "typer",
    "difflib",
    "ray",
    "pointshade_gl.batch",
    "pointshade_gl.files.gltf",
    "pointshade_gl.files.access.folders",
    "pointshade_gl.estimation.alignment",
    "pointshade_gl.estimation.light_fit",
    "pointshade_gl.gpu.surface.refinement",
    "pointshade_gl.renderer.functions",
)


def test_a_first_picture_imports_no_readers_of_files(renderer, tmp_path):
    program = [sys.executable, "-c", PROGRAM, str(tmp_path / "a.png")]
    imported = subprocess.run(program, capture_output=True, text=True, check=True).stdout.split()
    assert "pointshade_gl.renderer.renderer" in imported
    assert [name for name in NOT_NEEDED if name in imported] == []


def test_public_names_are_there_before_they_are_used():
    program = "import pointshade_gl as ps; print(*(n for n in ps.__all__ if n not in dir(ps) or not hasattr(ps, n)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
    assert ps.gltf.__doc__
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = ps.nothing


@pytest.mark.parametrize("count", [1, 2, 3, 10, 101])
def test_median_is_that_of_numpy(count):
    values = np.random.default_rng(count).normal(size=count)
    assert median(values) == np.median(values)


@pytest.mark.parametrize("share", [0, 0.01, 0.5, 0.95, 1])
@pytest.mark.parametrize("count", [1, 2, 3, 101])
def test_quantile_is_that_of_numpy(count, share):
    values = np.random.default_rng(count).normal(size=count).astype(np.float32)
    assert quantile(values, share) == pytest.approx(np.quantile(values.astype(np.float64), share), rel=1e-14)
