"""The package without its repository: sdist, wheel from the sdist, and a picture from the wheel alone."""

import subprocess
import sys
import zipfile

import pytest

from ..support.children import environment_with
from ..support.places import ROOT

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    out = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", out, ROOT]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    return next(out.glob("*.whl"))


def test_the_wheel_holds_shaders_and_the_vase_once_and_nothing_else_of_the_tree(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert "pointshade_gl/shaders/common/phong.glsl" in names
    assert "pointshade_gl/assets/vase/depth.tif" in names
    assert "pointshade_gl/assets/scene/scene.gltf" in names
    assert "pointshade_gl/assets/colormaps.png" in names
    tops = {name.split("/")[0] for name in names}
    assert {top.split("-")[0] for top in tops} == {"pointshade_gl"}
    assert len(names) == len(set(names))


@pytest.mark.usefixtures("renderer")
def test_the_wheel_renders_the_vase_without_its_source(wheel, tmp_path):
    site = tmp_path / "site"
    install = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", site, wheel]
    subprocess.run(install, check=True, timeout=120, capture_output=True)
    code = (
        "import sys, pointshade_gl, pointshade_gl.cli.main, pointshade_gl.gpu.core.programs as p;"
        " print(p.shader_folder());"
        " sys.argv[1:] = ['render', '-o', 'vase.png']; pointshade_gl.cli.main.main()"
    )
    environment = environment_with(site)
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[0] == str(site / "pointshade_gl" / "shaders")
    assert (tmp_path / "vase.png").stat().st_size > 20_000
