"""The package without its repository: sdist, wheel from the sdist, and a picture from the wheel alone."""

import ast
import os
import re
import struct
import subprocess
import sys
import tarfile
import time
import venv
import zipfile
from email.parser import Parser

import numpy as np
import pytest
from packaging.requirements import Requirement

import pointshade_gl as ps

from ..support import cloud_files, frames
from ..support.children import environment_with, started
from ..support.heic_files import heic
from ..support.places import ROOT
from .test_bounds import WHEELS, call, lowest

pytestmark = pytest.mark.system
SPHERE = frames.sphere()


def write_hdf5(folder):
    import h5py

    with h5py.File(folder / "in.h5", "w") as file:
        file["rgb"], file["depth"] = SPHERE.color, SPHERE.depth


def write_record3d(folder):
    from ..files.test_record3d import r3d

    r3d(folder / "in.r3d")


def write_network(folder):
    from ..support.networks import save_mean

    save_mean(folder / "mean.onnx")
    ps.save_image(folder / "in.jpg", SPHERE.color)


def write_las(folder):
    cloud_files.las(folder / "in.laz", cloud_files.on_map())


def write_e57(folder):
    cloud_files.e57(folder / "in.e57", [(cloud_files.bumpy()[0], (0, 0, 0), (1, 0, 0, 0), None)])


def write_heic(folder):
    depth = np.tile(np.linspace(40, 200, SPHERE.color.shape[1]).astype(np.uint8), (SPHERE.color.shape[0], 1))
    (folder / "in.heic").write_bytes(heic(SPHERE.color, depth))


def write_spz(folder):
    import zstandard

    plain = [bytes(9 * 4), bytes([200] * 4), bytes([128] * 12), bytes([100] * 12), bytes(16)]
    packed = [zstandard.ZstdCompressor().compress(one) for one in plain]
    head = struct.pack("<4sII4BI12x", b"NGSP", 4, 4, 0, 12, 0, len(plain), 32)
    table = b"".join(struct.pack("<2Q", len(one), len(two)) for one, two in zip(packed, plain, strict=True))
    (folder / "in.spz").write_bytes(head + table + b"".join(packed))


# of each extra: what writes its input here, where all extras are, and a command that needs it
EXTRAS = {
    "exr": (None, "depth vase -o out.exr"),
    "bench": (None, "bench --quick --only star -o bench"),
    "video": (None, "render -o out.mp4 --turntable light --frames 2 --picture-size 64x48"),
    "gui": (None, "view --panel"),
    "hdf5": (write_hdf5, "info in.h5 --fov 60"),
    "heic": (write_heic, "info in.heic"),
    "record3d": (write_record3d, "info in.r3d"),
    "las": (write_las, "info in.laz"),
    "e57": (write_e57, "info in.e57"),
    "spz": (write_spz, "info in.spz"),
    "onnx": (write_network, "render in.jpg --depth-model mean.onnx -o out.png"),
    "ray": (None, "batch vase -o many --ray local --workers 1"),
}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    out = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", out, ROOT]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    return next(out.glob("*.whl"))


def metadata_of(wheel):
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        return Parser().parsestr(archive.read(name).decode())


def test_every_place_names_the_version(wheel):
    assert metadata_of(wheel)["Version"] == ps.__version__
    assert f"\nversion: {ps.__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.search(
        rf"^## \[{re.escape(ps.__version__)}\] - ", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.M
    )


def test_the_sdist_has_what_a_reader_needs(wheel):
    with tarfile.open(next(wheel.parent.glob("*.tar.gz"))) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    told = "README.md", "CHANGELOG.md", "CONTRIBUTING.md", "CITATION.cff", "SECURITY.md", "LICENSE"
    assert {*told, "tests/conftest.py", "docs/stability.md", "shaders/common/phong.glsl"} <= names
    assert not [name for name in names if name.startswith((".ci", "build/", "docs/build"))]


def test_the_wheel_holds_shaders_and_the_vase_once_and_nothing_else_of_the_tree(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert "pointshade_gl/shaders/common/phong.glsl" in names
    assert "pointshade_gl/assets/vase/depth.tif" in names
    assert "pointshade_gl/assets/vase_whole/transforms.json" in names
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


def test_every_extra_is_tried(wheel):
    empty = {"ply", "gltf"}
    others = {"test", "docs", "realsense", "canvas"}  # a camera is needed; `test` has what canvases need
    assert {*metadata_of(wheel).get_all("Provides-Extra")} <= {*EXTRAS} | empty | others


def environment_of(folder):
    """A fresh environment's Python, and its `pointshade`."""
    venv.create(folder / "venv", with_pip=True)
    programs = folder / "venv" / ("Scripts" if sys.platform == "win32" else "bin")
    return programs / "python", programs / "pointshade"


@pytest.mark.usefixtures("renderer")
def test_without_extras_each_command_works_or_names_the_extra(wheel, tmp_path, display):
    python, pointshade = environment_of(tmp_path)
    call(python, "-m", "pip", "install", *WHEELS, wheel, folder=tmp_path)
    for line in (
        "render -o vase.png", "info", "info vase", "normals vase -o n.npy", "normals vase -o n.png --bits 16",
        "depth vase -o d.tif", "render -o x.html", "render -o x.ply", "render -o x.gif --turntable light --frames 2",
    ):  # fmt: skip
        call(pointshade, *line.split(), folder=tmp_path, PYTHONPATH="")
    check_window([pointshade, "view"], tmp_path)
    for extra, (write, line) in EXTRAS.items():
        if write is not None:
            write(tmp_path)
        done = subprocess.run(
            [pointshade, *line.split()], cwd=tmp_path, env=environment_with(tmp_path) | {"PYTHONPATH": ""},
            capture_output=True, text=True, timeout=120,
        )  # fmt: skip
        assert done.returncode == 2 and f"'.[{extra}]'" in done.stderr, (line, done.stderr)


@pytest.mark.skipif(
    "POINTSHADE_EXTRAS" not in os.environ, reason="11 environments: POINTSHADE_EXTRAS=1 before a release"
)
@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize("extra", EXTRAS)
def test_an_extra_alone_in_its_lowest_version_brings_its_feature(wheel, tmp_path, display, extra):
    """Of an extra that this Python has no wheel for, the lowest version that has one is taken."""
    write, line = EXTRAS[extra]
    python, pointshade = environment_of(tmp_path)
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    wanted = [Requirement(one) for one in ast.literal_eval(re.search(rf"(?m)^{extra} = (\[.*\])$", text)[1])]
    chosen = [lowest(python, one, tmp_path) for one in wanted]
    call(python, "-m", "pip", "install", f"{wheel}[{extra}]", *chosen, folder=tmp_path)
    print(call(python, "-m", "pip", "freeze", folder=tmp_path))  # what a failure is about
    if write is not None:
        write(tmp_path)
    if extra == "gui":
        check_window([pointshade, *line.split()], tmp_path)
    else:
        call(pointshade, *line.split(), folder=tmp_path, PYTHONPATH="")


def check_window(command, folder):
    """The window opens, and stays until it is asked to end."""
    with started(list(map(str, command)), cwd=folder, env=environment_with(folder) | {"PYTHONPATH": ""}) as process:
        time.sleep(5)
        if process.poll() is None:
            process.terminate()
        errors = process.communicate(timeout=60)[1]
        assert process.returncode == 130, errors
