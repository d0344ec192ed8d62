"""A notebook shows rendered arrays, frames and scenes as pictures; arrays are ordinary arrays otherwise."""

import io
import json
import pickle

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.renderer.requests import Picture
from pointshade_gl.scene import frame as preview

from ..support import frames

NUMBERS = np.random.default_rng(3).integers(0, 256, (6, 8, 4), np.uint8)


def picture():
    return NUMBERS.copy().view(Picture)


def shown(image):
    """What the notebook would show, as an array."""
    with Image.open(io.BytesIO(image._repr_png_())) as opened:
        assert opened.format == "PNG"
        return np.asarray(opened)


def test_what_is_rendered_shows_itself(renderer):
    image = renderer.render(frames.sphere())
    np.testing.assert_array_equal(shown(image), image)
    assert isinstance(image, np.ndarray) and image.dtype == np.uint8 and image.shape == (120, 160, 4)
    assert image.flags.writeable and image.flags.c_contiguous


@pytest.mark.parametrize(
    "part",
    [np.s_[:], np.s_[2:5, 1:7], np.s_[::2, ::3], np.s_[::-1], np.s_[..., :3], np.s_[:1, :1]],
    ids=["all", "cut", "thinned", "upside down", "rgb", "one pixel"],
)
def test_parts_that_are_pictures_show_themselves(part):
    np.testing.assert_array_equal(shown(picture()[part]), NUMBERS[part])


def test_arithmetic_that_stays_a_picture_shows_itself():
    np.testing.assert_array_equal(shown(255 - picture()), 255 - NUMBERS)
    np.testing.assert_array_equal(shown(np.repeat(picture(), 2, axis=0)), np.repeat(NUMBERS, 2, axis=0))


@pytest.mark.parametrize(
    "derive",
    [
        lambda image: image / 255,
        lambda image: image.astype(np.float32),
        lambda image: image.astype(np.uint16),
        lambda image: image > 3,
        lambda image: image[..., 0],
        lambda image: image[..., :2],
        lambda image: image[0],
        lambda image: image[:0],
        lambda image: image.mean(axis=2, keepdims=True),
        lambda image: image[None],
        lambda image: image.ravel(),
    ],
)
def test_what_is_no_picture_any_more_shows_its_numbers(derive):
    image = derive(picture())
    assert isinstance(image, Picture) and image._repr_png_() is None


@pytest.mark.parametrize("name", ["mean", "sum", "std", "min", "max", "median"])
def test_a_single_number_of_it_is_plain(name):
    number = getattr(np, name)(picture())
    assert isinstance(number, np.generic) and type(number) is type(getattr(np, name)(NUMBERS))
    assert number == getattr(np, name)(NUMBERS) and round(float(number), 1) == round(number, 1)
    assert json.dumps({"it": (picture() / 255).mean(), "in red": picture()[..., 0].mean()}).count(".") == 2


def test_it_is_an_array_in_everything_else(tmp_path):
    image = picture()
    assert type(np.asarray(image)) is np.ndarray and np.shares_memory(np.asarray(image), image)
    assert image.sum() == NUMBERS.sum() and np.array_equal(image, NUMBERS) and image.tolist() == NUMBERS.tolist()
    image[0, 0] = 7
    assert image[0, 0].tolist() == [7] * 4
    again = pickle.loads(pickle.dumps(image))
    np.testing.assert_array_equal(shown(again), image)
    ps.save_image(tmp_path / "out.png", image)
    np.save(tmp_path / "out.npy", image)
    with Image.open(tmp_path / "out.png") as opened:
        np.testing.assert_array_equal(np.asarray(opened), image)
    assert type(np.load(tmp_path / "out.npy")) is np.ndarray
    assert Image.fromarray(image).getpixel((0, 0)) == (7, 7, 7, 7)


def wide_frame():
    depth = np.full((40, 1600), 2.0, np.float32)
    depth[:, :800] = 0
    return ps.Frame(None, depth, ps.Camera(900, 900, 799.5, 19.5, 1600, 40))


def test_a_frame_shows_itself_lit_in_its_own_size(renderer):
    np.testing.assert_array_equal(shown(frames.sphere()), renderer.render(frames.sphere()))


def test_what_is_large_is_shown_small(renderer):
    image = shown(wide_frame())
    assert image.shape == (16, 640, 4)
    assert not image[:, :310].any() and image[2:-2, 330:-2, 3].all()


def test_a_scene_shows_itself_with_its_own_camera_or_one_that_sees_everything(renderer):
    scene = ps.Scene((ps.Node(ps.PointObject(frames.sphere())),))
    np.testing.assert_array_equal(shown(scene), renderer.render(scene))
    camera = ps.Camera(100, 100, 49.5, 24.5, 100, 50)
    assert shown(ps.Scene(scene.nodes, camera)).shape == (50, 100, 4)


def test_without_gl_a_frame_is_a_text(monkeypatch):
    def draw(_):
        raise ps.ContextError("no OpenGL")

    monkeypatch.setattr(preview, "_draw", draw)
    assert frames.sphere()._repr_png_() is None


TRIANGLE = ps.Mesh([(0, 0, 1), (1, 0, 1), (0, 1, 1)], [(0, 1, 2)])
WIDE = "Frame(1600x40, 32 000 points, 2 to 2 m, no color)"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (wide_frame(), WIDE),
        (
            ps.Frame(np.zeros((2, 4, 3), np.uint8), [[0.0, 1.25]], ps.Camera(1, 1, 0, 0, 2, 1)),
            "Frame(2x1, 1 point, 1.25 to 1.25 m, color 4x2)",
        ),
        (ps.Frame(None, [[0.0]], ps.Camera(1, 1, 0, 0, 1, 1)), "Frame(1x1, 0 points, no color)"),
        (TRIANGLE, "Mesh(3 positions, 1 triangle)"),
        (ps.PointObject(wide_frame()), f"PointObject({WIDE})"),
        (ps.Node(TRIANGLE, "wall", children=[ps.Node()]), "Node('wall', Mesh(3 positions, 1 triangle), 1 child)"),
        (ps.Scene(), "Scene(0 nodes)"),
        (
            ps.Scene([ps.Node([ps.PointObject(wide_frame()), TRIANGLE, TRIANGLE]), ps.Node(ps.Light())]),
            "Scene(2 nodes: 32 000 points in 1 frame, 2 triangles in 2 meshes, 1 light)",
        ),
    ],
)
def test_values_describe_themselves_in_one_short_line(value, text):
    assert repr(value) == str(value) == text
