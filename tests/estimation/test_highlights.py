"""Highlights in a picture: found by geometry and taken out; what only looks like one stays."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.scenes import standard_camera
from pointshade_gl.bench.stress import add_kinect_noise
from pointshade_gl.bench.tracing import encode, plane, shade, sphere, trace
from pointshade_gl.estimation.highlight_fit import describe_highlights, fit_highlights
from pointshade_gl.estimation.light_fit import FoundLight

from ..reference import highlights

F = np.float32
CAMERA = standard_camera(320, 240)
AWAY = np.array((0.5, 0.5, 0.7))
LIGHT = ps.Light(direction=(0.5, 0.5, 0.7))
GLOSSY = ps.Material(ambient=0.2, diffuse=0.8, specular=0.35, shininess=24)
TO_LIGHT = -AWAY / np.linalg.norm(AWAY)


def coloured(points):
    x, y, z = np.moveaxis(points, -1, 0)
    return 0.38 + 0.25 * np.stack([np.sin(9 * x + 4 * y + 1), np.sin(7 * y - 5 * z), np.cos(8 * x - 6 * z)], -1)


def grey(points):
    return np.repeat(coloured(points).mean(-1, keepdims=True), 3, -1)


def mixed(points):
    """A part of it is white paint."""
    cell = np.floor(points / 0.09 + 0.3).astype(int) @ (3, 5, 7) % 5
    return np.where((cell == 0)[..., None], 0.6, coloured(points))


@lru_cache
def scene(albedo):
    """A frame with Kinect noise of a ball before a wall, its picture with highlights and without, float."""
    hits = trace([sphere((0.05, 0.02, 1.5), 0.42, albedo), plane((0.15, -0.1, -1), (0, 0, 2.4), albedo)], CAMERA)
    depth = add_kinect_noise(hits.depth, 1.0, np.random.default_rng(3))
    shown, matte = (
        encode(shade(hits, LIGHT, material, (0, 0, 0))) for material in (GLOSSY, replace(GLOSSY, specular=0))
    )
    return ps.Frame(np.round(shown).astype(np.uint8), depth, CAMERA), shown, matte


def picture(renderer, frame, **options):
    return renderer.render(frame, shading="none", **options)[..., :3].astype(float)


def samples(specular=0.35, spot=0.0):
    """What the fit is given of a textured ball: colours, surfaces, rays; (120, 160) each.

    spot  strength of white paint, as soft as a highlight, where there can be none
    """
    camera = standard_camera(160, 120)
    hits = trace([sphere((0.0, 0.0, 1.5), 0.5, coloured)], camera)
    light = shade(hits, LIGHT, replace(GLOSSY, specular=specular), (0, 0, 0))
    off = (hits.normals - np.array((0.5, 0.3, -0.8124))) @ np.ones(3)
    light += spot * np.exp(-((off / 0.1) ** 2))[..., None] * (hits.depth > 0)[..., None]
    known = (hits.depth > 0) & (light.max(-1) < 0.93)
    surfaces = np.concatenate([np.where(known[..., None], hits.normals, 0), (hits.depth * known)[..., None]], -1)
    v, u = np.mgrid[:120, :160]
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], -1)
    return (light * known[..., None]).astype(F), known, surfaces.astype(F), rays.astype(F)


def fitted(direction=TO_LIGHT, tells=True, **options):
    light, known, surfaces, rays = samples(**options)
    found = FoundLight(tuple(np.asarray(direction).tolist()), 0.25, 1.0)
    found = found if tells else FoundLight(why="it is dark")
    return fit_highlights(np.concatenate([light, known[..., None]], -1).astype(F), surfaces, rays, found)


def turned(degrees):
    """The direction of the light, off by so much."""
    side = np.cross(TO_LIGHT, (0, 1, 0))
    side /= np.linalg.norm(side)
    return np.cos(np.radians(degrees)) * TO_LIGHT + np.sin(np.radians(degrees)) * side


@pytest.mark.parametrize("degrees", [0, 12])
def test_the_fit_finds_light_exponent_and_strength(degrees):
    found = fitted(turned(degrees))
    assert found.tells, found.why
    direction = np.array(found.light[:3]) - found.light[3] * np.array((0, 0, 1.0))
    assert direction @ TO_LIGHT / np.linalg.norm(direction) > np.cos(np.radians(3))
    assert 20 < found.exponent < 29 and 0.3 < found.strengths[..., 0].max() < 0.4
    assert "shininess" in describe_highlights(found)


def test_a_picture_without_highlights_has_none():
    found = fitted(specular=0.0)
    assert not found.tells and "no highlights found" in found.why


@pytest.mark.parametrize("tells", [True, False])
def test_white_paint_where_no_highlight_can_be_stays(tells):
    found = fitted(specular=0.0, spot=0.3, tells=tells)
    assert not found.tells


def test_without_a_light_all_sides_are_searched():
    assert "shininess" in describe_highlights(fitted(tells=False))
    assert "colours stay" in describe_highlights(fitted(tells=False, specular=0.0))


def test_nothing_to_see():
    empty = np.zeros((4, 5, 4), F)
    assert not fit_highlights(empty, empty, np.ones((4, 5, 3), F), FoundLight(strength=1.0)).tells


@pytest.mark.parametrize("albedo", [coloured, grey, mixed])
def test_highlights_are_taken_out(renderer, albedo):
    frame, shown, matte = scene(albedo)
    assert frame.color is not None
    inside = np.abs(shown - matte).max(-1) > 8
    taken = picture(renderer, frame, remove_highlights=True)
    before, after = (np.abs(image - matte).mean(-1) for image in (frame.color, taken))
    assert before[inside].mean() > 12 and after[inside].mean() < 6, (before[inside].mean(), after[inside].mean())
    assert after[~inside].mean() < before[~inside].mean() + 0.05


def test_no_bit_changes_without_highlights(renderer):
    frame, _, matte = scene(grey)
    frame = ps.Frame(np.round(matte).astype(np.uint8), frame.depth, CAMERA)
    assert (picture(renderer, frame, remove_highlights=True) == frame.color).all()
    assert any("remove-highlights" in line and "colours stay" in line for line in renderer.explain())


def test_the_picture_agrees_with_the_mirror(renderer):
    frame = scene(coloured)[0]
    assert frame.color is not None
    taken = picture(renderer, frame, remove_highlights=True)
    with renderer._in_use():
        (textures,) = renderer._pipeline.gpu_scene.frames._kept
        found, surface = textures.highlights, textures.surface.read()
    mirror = highlights.matte_of(
        frame.color.astype(F) / 255, surface, found.strengths,
        np.array(CAMERA.intrinsics, F), np.array(found.light, F), found.exponent,
    )  # fmt: skip
    off = np.abs(np.round(255 * mirror) - taken).max(-1)
    assert (off > 1).mean() < 1e-3 and (taken != frame.color).any(-1).mean() > 0.02


def test_functions_agree_with_the_mirror(gpu):
    rng = np.random.default_rng(4)
    normal = rng.normal(size=(400, 3)) * 0.5 + (0, 0, -1)
    normal = (normal / np.linalg.norm(normal, axis=-1, keepdims=True)).astype(F)
    point, light = rng.uniform((-0.5, -0.5, 1), (0.5, 0.5, 2), (400, 3)).astype(F), np.array((-0.4, -0.4, -0.5, 0.3), F)
    answer = gpu("highlights.glsl", "highlight_of(n, p, l, 20.0)", n=normal, p=point, l=light[None])[:, 0]
    np.testing.assert_allclose(answer, highlights.highlight_of(normal, point, light, 20.0), atol=1e-4)
    linear, much = rng.random((400, 3)).astype(F), rng.random((400, 1)).astype(F)
    answer = gpu("highlights.glsl", "without_highlight(c, h), 0", c=linear, h=much)[:, :3]
    np.testing.assert_allclose(answer, highlights.without_highlight(linear, much[:, 0]), atol=1e-6)
    surface = np.concatenate([normal, rng.uniform(1, 1.03, (400, 1)).astype(F)], -1).reshape(20, 20, 4)
    at, size = rng.uniform(-0.4, 39.4, (400, 2)).astype(F), np.array((40, 40), F)
    strengths = np.stack([rng.random((20, 20)), rng.uniform(1, 1.06, (20, 20)), *np.zeros((2, 20, 20))], -1).astype(F)
    answer = gpu("highlights.glsl", "strength_at(s_map, a, vec2(40), 1.0)", s_map=strengths, a=at)[:, 0]
    np.testing.assert_allclose(answer, highlights.strength_at(strengths, at, size, np.ones(400, F)), atol=1e-5)
    own = np.tile(np.array((0, 0, -1), F), (400, 1))
    answer = gpu("highlights.glsl", "smooth_normal(s_map, a, vec3(0, 0, -1)), 0", s_map=surface, a=at / 2)[:, :3]
    expected = highlights.smooth_normal(surface, at / 2, own)
    assert (np.abs(answer - expected).max(-1) > 1e-5).mean() < 0.01
    maps = {"s_map": surface, "k_map": strengths, "a": at / 2}
    call = "highlight_at(s_map, k_map, a, vec4(30, 30, 9.5, 9.5), vec4(-0.4, -0.4, -0.5, 0.3), 20.0)"
    expected = highlights.highlight_at(surface, strengths, at / 2, np.array((30, 30, 9.5, 9.5), F), light, 20.0)
    assert (np.abs(gpu("highlights.glsl", call, **maps)[:, 0] - expected) > 1e-4).mean() < 0.02
    assert (expected > 0.01).any()


def test_typed(typed):
    code, _, said = typed("render vase -o a.png --remove-highlights")
    assert code == 0 and "remove-highlights" in said


def test_a_wrong_value_is_named(renderer):
    with pytest.raises(TypeError, match="remove_highlights must be True or False, got 'no'"):
        renderer.render(scene(grey)[0], remove_highlights="no")
