"""The metric of the picture tests: equal pictures pass; differences that can be seen or measured fail."""

import numpy as np

from .compare import compare_images


def picture() -> np.ndarray:
    v, u = np.mgrid[0:120, 0:160]
    return np.stack([u, v, u + v // 2, np.full_like(u, 255)], -1).clip(0, 250).astype(np.uint8)


def test_equal_pictures_agree():
    assert compare_images(picture(), picture()) == ""


def test_one_step_in_few_pixels_agrees():
    other = picture()
    other[::8, ::8] += 1
    assert compare_images(other, picture()) == ""


def test_three_steps_darker_fails():
    darker = np.maximum(picture().astype(int) - 3, 0).astype(np.uint8)
    assert "differ" in compare_images(darker, picture())


def test_one_step_darker_everywhere_fails():
    darker = np.maximum(picture().astype(int) - 1, 0).astype(np.uint8)
    assert "mean difference" in compare_images(darker, picture())


def test_a_shift_by_one_pixel_fails():
    steps = (picture() // 8 * 8).astype(np.uint8)
    assert "differ" in compare_images(np.roll(steps, 1, axis=1), steps)


def test_another_size_fails():
    assert "shape" in compare_images(picture()[1:], picture())
