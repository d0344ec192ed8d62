"""A notebook shows rendered arrays as pictures; otherwise they are ordinary arrays."""

import io
import pickle

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.notebook import Picture

from . import frames

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
