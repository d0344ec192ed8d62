"""Our .exr in other programs: depth to the last bit, normals with alpha."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.passes import Passes

pytestmark = pytest.mark.clients
RNG = np.random.default_rng(5)
DEPTH = RNG.uniform(0.4, 9, (24, 32)).astype(np.float32)
DEPTH[3:6, 4:9] = 0  # missing
NORMALS = RNG.normal(size=(24, 32, 3)).astype(np.float32)
NORMALS /= np.linalg.norm(NORMALS, axis=-1, keepdims=True)
NORMALS[3:6, 4:9] = np.nan
LAYERS = {  # of passes: who they are in Blender's compositor
    "beauty": "Combined RGBA",
    "light_1": "light_1 RGBA",
    "depth": "Depth VALUE",
    "ao": "ao VALUE",
    "position": "position VECTOR",
}
IS_KNOWN = np.isfinite(NORMALS).all(-1)
RGBA = np.concatenate([np.where(IS_KNOWN[..., None], NORMALS * (1, -1, -1), 0), IS_KNOWN[..., None]], -1)  # "opengl"


@pytest.fixture
def depth(tmp_path):
    ps.save_depth(tmp_path / "depth.exr", DEPTH)
    return tmp_path / "depth.exr"


@pytest.fixture
def normals(tmp_path):
    ps.save_normals(tmp_path / "normals.exr", NORMALS)
    return tmp_path / "normals.exr"


def test_blender_sees_depth_in_all_three_colours(blender, depth):
    for name, pixels in blender("read_picture.py", depth).items():
        for color in range(3):
            np.testing.assert_array_equal(pixels[..., color], DEPTH, name)


def test_blender_sees_normals(blender, normals):
    found = blender("read_picture.py", normals)
    np.testing.assert_allclose(found["own"], RGBA, atol=1e-7)
    np.testing.assert_allclose(found["composited"][..., :3], RGBA[..., :3], atol=1e-7)
    np.testing.assert_allclose(found["texture"][..., :3], np.where(IS_KNOWN[..., None], RGBA[..., :3], 0), atol=1e-6)


@pytest.fixture
def passes(tmp_path):
    """Layers of random numbers that half floats hold, and their file."""
    shapes = {"beauty": 4, "light_1": 3, "depth": 0, "ao": 0, "position": 3}
    layers = {name: RNG.random((24, 32, *[count] * bool(count))).astype(np.float16).astype(np.float32)
              for name, count in shapes.items()}  # fmt: skip
    made = Passes(layers, ps.Camera(30, 30, 15.5, 11.5, 32, 24), np.eye(4), ["one"])
    ps.save_passes(tmp_path / "passes.exr", made)
    return tmp_path / "passes.exr", layers


def test_blenders_compositor_sees_each_pass(blender, passes):
    path, layers = passes
    found = blender("read_layers.py", path, 32, 24)
    assert set(found) == {*LAYERS.values(), "Alpha VALUE"}
    np.testing.assert_array_equal(found["Alpha VALUE"][..., 0], layers["beauty"][..., 3])
    for name, layer in layers.items():
        expected = layer[..., :3] if layer.ndim == 3 else np.repeat(layer[..., None], 3, -1)
        np.testing.assert_array_equal(found[LAYERS[name]][..., :3], expected, name)


def test_openimageio_reads_all_passes(client, passes):
    path, layers = passes
    image = client("OpenImageIO").ImageBuf(str(path))
    names, pixels = list(image.spec().channelnames), image.get_pixels()
    assert names[:4] == ["R", "G", "B", "A"] and names[image.spec().z_channel] == "Z"
    for k, channel in enumerate("RGB"):
        np.testing.assert_array_equal(pixels[..., names.index(f"light_1.{channel}")], layers["light_1"][..., k])
    np.testing.assert_array_equal(pixels[..., names.index("ao.X")], layers["ao"])
    np.testing.assert_array_equal(pixels[..., names.index("position.Z")], layers["position"][..., 2])
    np.testing.assert_allclose(image.spec().getattribute("worldToCamera"), np.diag([1, -1, 1, 1]).ravel(), atol=1e-7)


@pytest.mark.parametrize("flag", ["IMREAD_UNCHANGED", "IMREAD_ANYDEPTH"])
def test_opencv_reads_depth_as_grey(client, monkeypatch, depth, flag):
    monkeypatch.setenv("OPENCV_IO_ENABLE_OPENEXR", "1")
    cv2 = client("cv2")
    found = cv2.imread(str(depth), getattr(cv2, flag))
    assert found is not None, [line for line in cv2.getBuildInformation().splitlines() if "EXR" in line]
    np.testing.assert_array_equal(found, DEPTH, strict=True)


def test_opencv_reads_normals(client, monkeypatch, normals):
    monkeypatch.setenv("OPENCV_IO_ENABLE_OPENEXR", "1")
    cv2 = client("cv2")
    found = cv2.imread(str(normals), cv2.IMREAD_UNCHANGED)
    np.testing.assert_allclose(found[..., [2, 1, 0, 3]], RGBA, atol=1e-7)


def test_openimageio_knows_which_channel_is_depth(client, depth, normals):
    image = client("OpenImageIO").ImageBuf(str(depth))
    assert image.spec().channelnames[image.spec().z_channel] == "Z"
    for channel in np.moveaxis(image.get_pixels(), -1, 0):
        np.testing.assert_array_equal(channel, DEPTH)
    image = client("OpenImageIO").ImageBuf(str(normals))
    assert list(image.spec().channelnames) == ["R", "G", "B", "A"] and image.spec().alpha_channel == 3
    np.testing.assert_allclose(image.get_pixels(), RGBA, atol=1e-7)


def test_oiiotool(client, depth):
    client("OpenImageIO")
    tool = shutil.which("oiiotool", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))
    assert tool, "pip installs it beside Python"
    told = subprocess.run([tool, "--stats", depth], check=True, capture_output=True, text=True).stdout
    (line,) = [line for line in told.splitlines() if "Stats Max" in line]
    np.testing.assert_allclose([float(one) for one in line.split()[2:4]], DEPTH.max(), atol=1e-6)


def test_openexr_itself(client, depth):
    with client("OpenEXR").File(str(depth), separate_channels=True) as file:
        found = {name: channel.pixels for name, channel in file.channels().items()}
    assert sorted(found) == ["Y", "Z"]
    for one in found.values():
        np.testing.assert_array_equal(one, DEPTH, strict=True)
