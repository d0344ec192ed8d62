"""Compares the functions of shaders/common/frame_reduction.glsl with their mirror, and with what they promise."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.gpu.points.view_consensus import reduced_camera
from pointshade_gl.scene.appearance import Appearance

from ..reference import frame_reduction
from .test_resolve_functions import HEIGHT, WIDTH, K, two_planes

F = np.float32
PIXELS = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), -1).reshape(-1, 2)


@pytest.mark.parametrize("holes", [0.0, 0.1, 1.0])
def test_points_beside_steps_and_seen_flat_are_left_out(gpu, holes):
    surface_map = two_planes(holes)
    own = {"surface_map": surface_map, "p": PIXELS.astype(F), "k": np.tile(K, (len(PIXELS), 1)).astype(F)}
    found = gpu("frame_reduction.glsl", "surface_away_from_steps(surface_map, ivec2(p), k)", **own)
    mirror = frame_reduction.surface_away_from_steps(surface_map, PIXELS, K)
    np.testing.assert_allclose(found, mirror, atol=1e-6)
    kept = mirror[:, 3] > 0
    assert (kept.mean() == 0) if holes == 1 else (0.02 < kept.mean() < 1)


@pytest.mark.parametrize("cell", [1, 2, 3, 4, 7])
def test_the_brightness_of_a_cell_is_its_mean(gpu, cell):
    color = np.random.default_rng(3).random((HEIGHT, WIDTH, 4)).astype(F)
    pixel = PIXELS.astype(F)
    size = np.tile(np.array([[WIDTH, HEIGHT]], F), (len(pixel), 1))
    own = {"color_map": color, "p": pixel, "s": size}
    found = gpu("frame_reduction.glsl", f"cell_brightness(color_map, p, s, {cell}), vec3(0)", **own)[:, 0]
    np.testing.assert_allclose(found, frame_reduction.cell_brightness(color, pixel, size, cell), atol=2e-3)


def reduced_copy(frame):
    with ps.Renderer() as renderer, renderer._in_use():
        return renderer._pipeline.gpu_scene.read_reduced(frame, Appearance())


def test_brightness_that_is_only_noise_is_left_out():
    camera, rng = ps.Camera(200, 200, 79.5, 59.5, 160, 120), np.random.default_rng(3)
    for contrast, is_left in ((0, False), (2, False), (40, True)):
        wave = contrast * np.sin(np.arange(160) / 4)[None, :, None]
        color = np.clip(120 + wave + rng.normal(0, 3, (120, 160, 3)), 0, 255).astype(np.uint8)
        reduced = reduced_copy(ps.Frame(color, np.full((120, 160), 2.0), camera))
        assert (reduced.brightness is not None) == is_left


def test_a_reduced_copy_shows_the_same_points():
    camera = ps.Camera(500, 500, 321.5, 242.5, 643, 485)
    x, y = camera.ray_at(*np.meshgrid(np.arange(643.0), np.arange(485.0)))
    depth = 2 / (1 + 0.2 * x - 0.1 * y)
    color = np.tile(np.linspace(30, 220, 643).astype(np.uint8)[None, :, None], (485, 1, 3))
    color[300:] = np.random.default_rng(2).integers(0, 255, (185, 643, 1))
    reduced = reduced_copy(ps.Frame(color, depth, camera))
    small, cell = reduced_camera(camera)
    assert cell == 2 and (small.width, small.height) == (321, 242) == (reduced.camera.width, reduced.camera.height)
    points = reduced.points[reduced.points[:, 2] > 0]
    assert len(points) > 0.9 * 321 * 242
    np.testing.assert_allclose(points @ (0.2, -0.1, 1), 2, atol=1e-5)
    u, v = camera.pixel_at(*points.T)
    np.testing.assert_allclose(u % 2, 1, atol=1e-3)
    np.testing.assert_allclose(v % 2, 1, atol=1e-3)
    middle = reduced.brightness[:148, 160]
    linear = (color[0, 320:323].mean() / 255 + 0.055) / 1.055
    np.testing.assert_allclose(middle, linear**1.2, atol=0.005)
