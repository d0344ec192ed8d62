"""Compares the functions of shaders/common/pixel_mean.glsl with their mirrors, and these with what they stand for."""

import numpy as np
import pytest

from pointshade_gl.scene.sample_pattern import pixel_offset

from ..reference import pixel_mean
from ..reference import splat_corners as corners
from .test_resolve_functions import nearest_pixel, positions, two_planes
from .test_shader_functions import TARGET, VIEW, F, K

WIDE = F([[0.4, 0.1], [-0.2, 0.3]])


def close(answer, mirror, atol=2e-6):
    mirror = np.asarray(mirror, F).reshape(len(answer), -1)
    np.testing.assert_allclose(answer[:, : mirror.shape[1]], mirror, atol=atol, rtol=1e-5)


@pytest.fixture(scope="module")
def random():
    return np.random.default_rng(5)


@pytest.mark.parametrize("k", [0, 1, 2, 15, 16, 4095])
def test_samples_lie_where_the_pipeline_puts_them(gpu, k):
    answer = gpu("pixel_mean.glsl", f"sample_offset({k}), z, 0", z=np.zeros((1, 1), F))
    np.testing.assert_allclose(answer[0, :2], pixel_offset(k), atol=3e-4)
    np.testing.assert_allclose(pixel_mean.sample_offset(k), pixel_offset(k), atol=3e-4)


def test_source_step_and_shows_all(gpu, random):
    pixel = random.uniform(0, 400, (200, 2)).astype(F)
    view = VIEW.copy()
    view[:3, 3] = 0
    text = ", ".join(f"{x:.9g}" for x in view.T.ravel())
    call = f"source_step(p, t, mat4({text}), k)"
    steps = pixel_mean.source_step(pixel, TARGET, view, K)
    answer = gpu("pixel_mean.glsl", f"{call}[0], {call}[1]", p=pixel, t=TARGET[None], k=K[None])
    close(answer, steps.reshape(-1, 4), atol=2e-3)
    for size in (0.5, 1.0, 1.1):
        wide = np.tile(np.eye(2, dtype=F) * F(size), (3, 1, 1))
        said = gpu("pixel_mean.glsl", "shows_all(mat2(w.x, w.y, w.z, w.w)) ? 1 : 0", w=wide.reshape(-1, 4))
        assert (said[:, 0] > 0.5).tolist() == pixel_mean.shows_all(wide).tolist() == [size <= 1] * 3


def test_the_mean_colour_of_samples_and_of_nine_texels(gpu, random):
    picture = random.uniform(0, 1, (12, 9, 4)).astype(F)
    at, size = random.uniform(-0.4, (8.4, 11.4), (300, 2)).astype(F), F([[9, 12]])
    wide = np.broadcast_to(WIDE, (len(at), 2, 2))
    call = "mean_color(color_map, at, mat2(0.4, 0.1, -0.2, 0.3), size, 16), 0"
    close(
        gpu("pixel_mean.glsl", call, color_map=picture, at=at, size=size),
        pixel_mean.mean_color(picture, at, wide, size[0], 16),
    )
    upright = np.broadcast_to(F([0.9, 1]), at.shape)
    nine = pixel_mean.mean_of_nine(picture, at, upright, 16)
    close(gpu("pixel_mean.glsl", "mean_of_nine(color_map, at, vec2(0.9, 1.0), 16), 0", color_map=picture, at=at), nine)
    diagonal = np.broadcast_to(np.diag(F([0.9, 1])), (len(at), 2, 2))
    np.testing.assert_allclose(nine, pixel_mean.mean_color(picture, at, diagonal, size[0], 16), atol=2e-6)


def test_errors_of_means_and_what_is_steady(gpu, random):
    row = random.uniform(0, 1, (5, 300, 3)).astype(F)
    inputs = dict(zip("abcde", row, strict=True))
    a, b, c, d, _ = row
    close(gpu("pixel_mean.glsl", "opposed(a - b, c - d), 0", **inputs), pixel_mean.opposed(a - b, c - d))
    close(gpu("pixel_mean.glsl", "mean_error(b, c, d), 0", **inputs), pixel_mean.mean_error(b, c, d))
    close(gpu("pixel_mean.glsl", "mean_error_of_five(a, b, c, d, e), 0", **inputs), pixel_mean.mean_error_of_five(*row))
    close(gpu("pixel_mean.glsl", "slope_error(b, d), 0", **inputs), pixel_mean.slope_error(b, d))
    error = b * F(0.005)
    said = gpu("pixel_mean.glsl", "is_steady(a, b * 0.005) ? 1 : 0", **inputs)[:, 0] > 0.5
    assert (said == pixel_mean.is_steady(a, error)).mean() > 0.99
    assert 0.1 < said.mean() < 0.9


@pytest.mark.parametrize("place", np.linspace(-0.5, 0.5, 11))
def test_no_edge_is_missed_wherever_it_crosses_the_pixel(place):
    """A step between two values: the mean over the pixel is off its middle by no more than is said."""
    x = np.arange(-2, 3)
    row = F(x > place)
    true = abs((0.5 - place) - row[2])
    assert pixel_mean.mean_error_of_five(*row) >= true - 1e-6


def test_a_fold_counts_for_less_than_an_edge():
    fold = F(np.maximum(np.arange(-2, 3), 0))
    assert pixel_mean.mean_error_of_five(*fold) == pytest.approx(1 / 8)  # which it is, in the middle of the pixel
    assert pixel_mean.mean_error(*fold[1:4]) == pytest.approx(1 / 2)


def test_are_on_surface_where_no_edge_is_near(gpu):
    surface_map = two_planes(holes=0.05)
    at = positions(surface_map, margin=0.5)
    pixel = nearest_pixel(at)
    own = surface_map[pixel[:, 1], pixel[:, 0]]
    around, w, slope = corners.corners_at(surface_map, at), F(1) / own[:, 3], np.zeros((len(at), 2), F)
    call = "are_on_surface(corners_at(surface_map, at), p, w, s) ? 1 : 0"
    inputs = {"surface_map": surface_map, "at": at, "p": pixel.astype(F), "w": w[:, None], "s": slope}
    said = gpu("splat_corners.glsl", call, **inputs)[:, 0] > 0.5
    mirror = corners.are_on_surface(around, pixel.astype(F), w, slope)
    assert (said == mirror).all() and 0.05 < mirror.mean() < 0.95
