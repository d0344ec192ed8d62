"""Compares the functions of shaders/common/film_planes.glsl with their mirror, and with what was coded."""

import numpy as np

from pointshade_gl.page.films import color_planes
from pointshade_gl.page.parts import code_normals

from ..reference import film_planes

F = np.float32


def test_places_on_the_octahedron_are_normals_again(gpu):
    normals = np.random.default_rng(0).normal(size=(500, 3))
    normals = np.concatenate([normals / np.linalg.norm(normals, axis=1, keepdims=True), np.eye(3), -np.eye(3)])
    places = (code_normals(normals, 8) / 255).astype(F)
    found = gpu("film_planes.glsl", "unfolded_normal(p), 0.0", p=places)[:, :3]
    np.testing.assert_allclose(found, film_planes.unfolded_normal(places), atol=1e-6)
    assert np.degrees(np.linalg.norm(found - normals, axis=1)).max() < 1


def test_luma_and_chromas_are_colors_again(gpu):
    colors = np.random.default_rng(0).integers(0, 256, (20, 25, 3), np.uint8)
    planes = color_planes(colors, np.ones((20, 25), bool)).reshape(3, -1).T.astype(F) / F(255)
    found = gpu("film_planes.glsl", "color_of_luma(v.x, v.yz), 0.0", v=planes)[:, :3]
    np.testing.assert_allclose(found, film_planes.color_of_luma(planes[:, :1], planes[:, 1:]), atol=1e-6)
    assert np.abs(found * 255 - colors.reshape(-1, 3)).max() < 2
