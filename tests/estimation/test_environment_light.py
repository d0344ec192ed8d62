"""What surfaces reflect of an environment, against closed formulas."""

import numpy as np
import pytest

from pointshade_gl.estimation.environment_light import above_horizon, lobe_map, radiance_bands

RNG = np.random.default_rng(5)
NORMALS = RNG.normal(size=(40, 3))
NORMALS /= np.linalg.norm(NORMALS, axis=1)[:, None]
SIZES = [(1, 2), (3, 7), (16, 32), (64, 128)]


def directions(height, width):
    """(h, w, 3) of the middles of pixels."""
    elevation = np.pi * (0.5 - (np.arange(height) + 0.5) / height)[:, None]
    azimuth = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    parts = np.cos(elevation) * np.cos(azimuth), np.sin(elevation) + 0 * azimuth, np.cos(elevation) * np.sin(azimuth)
    return np.stack(parts, -1)


def solid_angles(height, width):
    """(h, 1)."""
    edges = np.sin(np.pi * (0.5 - np.arange(height + 1) / height))
    return (edges[:-1] - edges[1:])[:, None] * 2 * np.pi / width


def summed(bands, d, first=1.0, second=1.0):
    """(n, 3): the sum that the docstring of radiance_bands states."""
    x, y, z = d.T
    basis = [0 * x + 1, x, y, z, x * y, y * z, x * z, 3 * z * z - 1, x * x - y * y]
    factors = [1, *[first] * 3, *[second] * 5]
    return np.stack([factor * one for factor, one in zip(factors, basis, strict=True)], 1) @ bands


def reflected(bands, normals):
    """(n, 3) irradiance / pi."""
    return summed(bands, normals, 2 / 3, 1 / 4)


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_one_from_everywhere_lights_white_white(size):
    white = np.ones((*size, 3))
    np.testing.assert_allclose(reflected(radiance_bands(white), NORMALS), 1, atol=1e-12)
    for exponent in (0, 1, 30, 1e3, 1e6):
        np.testing.assert_allclose(lobe_map(white, exponent), 1, atol=1e-5)


def test_light_that_rises_with_height():
    """Of 1 + y an upward surface reflects 1 + 2/3; a lobe round y sees y (s + 1) / (s + 2)."""
    rising = np.repeat(1 + directions(256, 512)[..., 1:2], 3, -1)
    bands = radiance_bands(rising)
    np.testing.assert_allclose(reflected(bands, NORMALS), np.repeat(1 + NORMALS[:, 1:2] * 2 / 3, 3, 1), atol=2e-4)
    for exponent in (0, 1, 8, 60):
        wanted = 1 + directions(32, 64)[..., 1] * (exponent + 1) / (exponent + 2)
        np.testing.assert_allclose(lobe_map(rising, exponent)[..., 1], wanted, atol=2e-3)


def test_any_light_of_order_2_comes_back():
    wanted = RNG.normal(size=(9, 3))
    picture = summed(wanted, directions(200, 400).reshape(-1, 3)).reshape(200, 400, 3)
    np.testing.assert_allclose(radiance_bands(picture), wanted, atol=1e-3)


@pytest.mark.parametrize("pixel", [(10, 5), (31, 64), (32, 0), (63, 127), (0, 77)])
def test_a_single_bright_pixel(pixel):
    picture = np.zeros((64, 128, 3))
    picture[pixel] = 3, 2, 1
    ray, solid_angle = directions(64, 128)[pixel], solid_angles(64, 128)[pixel[0], 0]
    cosine = NORMALS @ ray  # of one ray, the bands of order 2 are 1/4 + c/2 + 5/32 (3 c^2 - 1) of it
    wanted = (1 / 4 + cosine / 2 + 5 / 32 * (3 * cosine**2 - 1)) * solid_angle / np.pi
    np.testing.assert_allclose(reflected(radiance_bands(picture), NORMALS), wanted[:, None] * [3, 2, 1], atol=1e-5)
    along = np.maximum(directions(32, 64) @ ray, 0)
    wanted = 7 / (2 * np.pi) * along**6 * solid_angle
    found = lobe_map(picture, 6)
    np.testing.assert_allclose(found, wanted[..., None] * [3, 2, 1], atol=0.01 * found.max())
    assert np.unravel_index(lobe_map(picture, 400)[..., 0].argmax(), (64, 128))[0] == pixel[0]


@pytest.mark.parametrize("exponent", [4, 16, 32, 128, 500])
def test_a_lobe_is_the_mean_over_its_own_directions(exponent):
    picture = RNG.random((16, 32, 3)) ** 4 * 5
    found = lobe_map(picture, exponent)
    fine = np.repeat(np.repeat(picture, 16, 0), 16, 1)
    rays, weights = directions(256, 512), solid_angles(256, 512)
    for row, column in RNG.integers(0, found.shape[:2], size=(12, 2)):
        lobe = np.maximum(rays @ directions(*found.shape[:2])[row, column], 0) ** exponent * weights
        wanted = (fine * lobe[..., None]).sum((0, 1)) / lobe.sum()
        np.testing.assert_allclose(found[row, column], wanted, atol=0.03)


def test_a_turned_picture_turns_its_light():
    """By columns: 16 of 64 is a quarter, x goes to z."""
    picture = RNG.random((32, 64, 3))
    turned = np.roll(picture, 16, 1)
    back = NORMALS[:, [2, 1, 0]] * [1, 1, -1]  # of (x, y, z) the quarter back
    first, second = reflected(radiance_bands(turned), NORMALS), reflected(radiance_bands(picture), back)
    np.testing.assert_allclose(first, second, atol=1e-9)
    for exponent in (5, 300):
        whole = lobe_map(picture, exponent)
        np.testing.assert_allclose(
            lobe_map(turned, exponent), np.roll(whole, whole.shape[1] // 4, 1), rtol=1e-4, atol=1e-5
        )


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_a_floor_hides_what_lies_below(size):
    """Of a white upper half an upward surface reflects 1, one on edge 1/2, a downward one 0."""
    for up in [np.array((0, 1.0, 0)), *NORMALS[:8]]:
        bands = radiance_bands(np.ones((*size, 3)), up)
        np.testing.assert_allclose(bands[0], 0.5, atol=1e-9)
        np.testing.assert_allclose(reflected(bands, NORMALS)[:, 0], (1 + NORMALS @ up) / 2, atol=1e-3)
    hidden = above_horizon(np.ones((64, 128, 3)), (0, 5, 0))
    assert (hidden[:32] == 1).all() and (hidden[32:] == 0).all()


def test_a_map_has_more_columns_where_highlights_are_small():
    picture = np.ones((8, 16, 3))
    assert lobe_map(picture, 100).shape == (32, 64, 3) and lobe_map(picture, 101).shape == (64, 128, 3)
    assert lobe_map(picture, 5, 32).shape == (16, 32, 3)


def test_a_lobe_too_narrow_for_its_map_leaves_no_gaps():
    """A small bright patch keeps its light: the mean over the map is that of the picture."""
    picture = np.zeros((256, 512, 3))
    picture[100:102, 200:203] = 1000
    weights = solid_angles(64, 128)
    mean = (lobe_map(picture, 1e5) * weights[..., None]).sum((0, 1)) / (4 * np.pi)
    np.testing.assert_allclose(mean, (picture * solid_angles(256, 512)[..., None]).sum((0, 1)) / (4 * np.pi), rtol=0.03)
