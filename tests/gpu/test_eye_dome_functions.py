"""Compares the functions of shaders/common/eye_dome.glsl with their mirror, and with what they promise."""

import numpy as np
import pytest

from ..reference import eye_dome

F = np.float32


def surfaces(depth):
    """(h, w, 4) of a depth picture."""
    return np.stack([np.zeros_like(depth)] * 3 + [depth], -1).astype(F)


def shades(gpu, depth, first=0, rows=100):
    """By the GPU and by the mirror at every pixel of some rows (n, w)."""
    map = surfaces(depth)
    pixel = np.stack(np.meshgrid(*(np.arange(n) for n in depth.shape[::-1])), -1)[first : first + rows]
    z = depth[first : first + rows].astype(F)
    own = {"surface_map": map, "p": pixel.reshape(-1, 2), "z": z.reshape(-1, 1)}
    found = gpu("eye_dome.glsl", "eye_dome(surface_map, ivec2(p), z), vec3(0)", **own)[:, 0]
    return found.reshape(z.shape), eye_dome.eye_dome(map, pixel, z)


def test_the_reach_follows_the_height_and_is_a_pixel_at_least(gpu):
    heights = np.array([[1], [120], [480], [960], [2160]], F)
    found = gpu("eye_dome.glsl", "eye_dome_reach(h), vec3(0)", h=heights)[:, 0]
    np.testing.assert_allclose(found, [1, 1, 1.4, 2.8, 6.3], rtol=1e-6)
    np.testing.assert_allclose(found, eye_dome.eye_dome_reach(heights[:, 0]), rtol=1e-6)


def test_a_neighbour_counts_as_far_as_it_is_nearer(gpu):
    z, other = np.array([[2], [2], [2], [2], [2], [1e-20]], F), np.array([[0], [1.95], [-1.95], [2], [3], [1e-30]], F)
    found = gpu("eye_dome.glsl", "eye_dome_step(z, o), vec3(0)", z=z, o=other)[:, 0]
    np.testing.assert_allclose(found, [1, 2 / 1.95, 2 / 1.95, 1, 1, 1.06], rtol=1e-6)
    np.testing.assert_allclose(found, eye_dome.eye_dome_step(z, other)[:, 0], rtol=1e-6)


@pytest.mark.parametrize("height", [5, 60, 700])
def test_any_depths_are_shaded_as_by_the_mirror(gpu, height):
    rng = np.random.default_rng(5)
    depth = rng.uniform(0.9, 1.1, (height, 30)) * (rng.random((height, 30)) > 0.2)
    for first in (0, max(height - 100, 0)):
        known = depth[first : first + 100] > 0
        found, mirror = (shade[known] for shade in shades(gpu, depth, first))
        np.testing.assert_allclose(found, mirror, atol=1e-5, rtol=1e-5)
        assert 0 < mirror.min() < 0.7 and mirror.max() <= 1


def test_a_facing_plane_keeps_all_its_light(gpu):
    """Also at its own border, where nothing is, and at that of the picture."""
    depth = np.full((20, 20), 1.7)
    depth[:, 12:] = 0
    found, mirror = shades(gpu, depth)
    assert (found[:, :12] == 1).all() and (mirror[:, :12] == 1).all()


@pytest.mark.parametrize("unit", [1.0, 1000.0])
@pytest.mark.parametrize(("step", "counts"), [(1.04, 1.04), (1.06, 1.06), (3.0, 1.06)])
def test_the_farther_side_of_a_step_is_darker_and_the_nearer_is_not(gpu, unit, step, counts):
    """Within reach only; three of eight neighbours are nearer. Units of depth do not matter."""
    depth = np.full((20, 20), 1.0 * unit)
    depth[:, 10:] *= step
    found, _ = shades(gpu, depth)
    lit = found[5:-5]
    assert (lit[:, :10] == 1).all() and (lit[:, 11:] == 1).all()
    np.testing.assert_allclose(lit[:, 10], np.exp(-8 * 3 * np.log2(counts)), rtol=1e-4)


def test_a_slanted_plane_keeps_most_of_its_light(gpu):
    """Of 60 degrees, as a camera of 640x480 pixels sees it."""
    inverse = 0.5 * (1 + np.tan(np.radians(60)) * (np.arange(40) - 20) / 525)
    found, _ = shades(gpu, np.broadcast_to(1 / inverse, (40, 40)).copy())
    assert (found[5:-5, 5:-5] > 0.84).all() and (found[5:-5, 5:-5] < 0.99).all()


def test_larger_pictures_have_wider_edges(gpu):
    """Twice as high, twice as wide: the share of the picture that is dark stays."""
    dark = []
    for height in (960, 1920):
        depth = np.full((height, 24), 1.0)
        depth[:, 12:] = 2.0
        found, _ = shades(gpu, depth, height // 2, 1)
        dark.append((found < 0.9).sum())
    assert dark == [3, 6]
