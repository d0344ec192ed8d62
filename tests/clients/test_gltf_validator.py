"""Khronos' validator finds nothing wrong with any scene that we write."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import pointshade_gl as ps

from ..files.gltf.test_save import everything
from ..support.frames import sphere_before_wall, step
from .conftest import missing

pytestmark = pytest.mark.clients

CHANCE = np.random.default_rng(5)
HINTS = {  # what is no fault: pictures of any size, and an extension that the validator does not know with its images
    "IMAGE_NPOT_DIMENSIONS", "UNSUPPORTED_EXTENSION", "UNUSED_OBJECT",
}  # fmt: skip


@pytest.fixture(scope="module")
def validate():
    """validate(*paths): for each file a list of what is wrong with it."""
    node = shutil.which("node")
    found = node and subprocess.run([node, "-e", "require('gltf-validator')"], capture_output=True).returncode == 0
    if not found:
        missing("no node, or no gltf-validator of npm in NODE_PATH")

    def run(*paths):
        script = Path(__file__).with_name("validate_gltf.js")
        done = subprocess.run([node, script, *paths], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return run


def cloud():
    points, colors = CHANCE.normal(size=(50, 3)), CHANCE.integers(0, 256, (50, 3), dtype=np.uint8)
    far = ps.PointCloud(points + 1e6, colors=colors, confidence=CHANCE.random(50), up="z")
    near = ps.PointCloud(points, colors=colors, normals=np.tile((0, 0, 1.0), (50, 1)), point_size=0.1, shading="none")
    return ps.Scene((ps.Node(far, "far"), ps.Node((near, near), "near")))


def several():
    vase = ps.load_frame("vase")
    views = [vase, vase.at(np.diag([-1.0, 1, -1, 1]))]
    look = {"normals": "star", "material": ps.Material(specular=0)}
    return ps.Scene((ps.Node(ps.PointObject(views, **look), "vase"),), vase.camera, environment="studio")


def given_arrays():
    frame = step()
    normals = np.zeros((120, 160, 3), np.float32) - (0, 0, 1)
    points = ps.PointObject(frame, normals=normals, point_size=np.ones((120, 160)))
    return ps.Scene((ps.Node(points, "Über points/1"), ps.Node(ps.PointObject(sphere_before_wall()))))


SCENES = {
    "everything": everything,
    "demo": lambda: ps.load_scene("demo"),
    "several": several,
    "given arrays": given_arrays,
    "cloud": cloud,
    "empty": ps.Scene,
}


@pytest.mark.parametrize("light_units", ["photometric", "unitless"])
@pytest.mark.parametrize("fallback", ["mesh", "points", None])
@pytest.mark.parametrize("name", SCENES)
def test_the_validator_finds_nothing_wrong(validate, tmp_path, name, fallback, light_units):
    paths = [tmp_path / f"my {name}{suffix}" for suffix in (".gltf", ".glb")]
    for path in paths:
        ps.save_scene(path, SCENES[name](), fallback=fallback, light_units=light_units)
    for path, issues in zip(paths, validate(*paths), strict=True):
        assert [issue for issue in issues if issue["code"] not in HINTS] == [], path.name
        assert all(issue["severity"] >= 2 for issue in issues)  # neither errors nor warnings


def test_a_cloud_written_alone_is_valid(validate, tmp_path):
    ps.save_points(tmp_path / "cloud.glb", ps.PointCloud(CHANCE.normal(size=(20, 3)), up="z"))
    assert validate(tmp_path / "cloud.glb") == [[]]


def test_the_validator_is_asked(validate, tmp_path):
    (tmp_path / "wrong.gltf").write_text('{"asset": {"version": "2.0"}, "nodes": [{"mesh": 3}]}')
    (issues,) = validate(tmp_path / "wrong.gltf")
    assert [issue["code"] for issue in issues if issue["severity"] == 0] == ["UNRESOLVED_REFERENCE"]
