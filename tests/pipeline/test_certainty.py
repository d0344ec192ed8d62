"""Highlights are as wide and as dim as normals are uncertain; where nobody doubts them, nothing changes."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import plane, sphere, trace
from pointshade_gl.estimation import noise_model as noise_bumps
from pointshade_gl.gpu.surface.noise_measurement import NoisePass
from pointshade_gl.scene.appearance import Appearance, Material
from pointshade_gl.scene.camera import Eye

from ..gpu.test_shader_functions import F
from ..reference import normal_variance as tilt
from ..reference import surface_pass, toksvig
from ..reference.render import render as mirror_render
from ..reference.surface_pass import certainty_by_noise, measure_noise, surface_by_noise
from ..support import frames
from ..support.drivers import need_compute

CAMERA = ps.Camera(262.5, 262.5, 159.5, 119.5, 320, 240)
INTRINSICS = np.array(CAMERA.intrinsics, F)
SHINY = Material(0.1, 0.6, 0.6, 32)


@pytest.fixture(scope="module")
def true_depth():
    """A wall that faces the camera, and a ball."""
    surfaces = [plane((0, 0, -1), (0, 0, 1.5), frames.checks), sphere((0.3, 0.1, 1.2), 0.2, frames.checks)]
    return trace(surfaces, CAMERA).depth


def white(depth, seed=1):
    return depth + np.random.default_rng(seed).normal(0, 0.001, depth.shape)


def stereo(depth, seed=1, width=9):
    """Disparity in steps of 1/16 pixel, with the noise that matching windows of this width leave."""
    noise = np.random.default_rng(seed).normal(0, 1, depth.shape)
    for axis in (0, 1, 0, 1):
        noise = np.mean([np.roll(noise, k - width // 2, axis) for k in range(width)], 0)
    return 40 / (np.round((40 / depth + 0.12 * noise / noise.std()) * 16) / 16)


def frame_of(depth):
    return ps.Frame(None, np.asarray(depth, np.float32), CAMERA)


@pytest.fixture(autouse=True)
def bumpy_wall(monkeypatch):
    """The wall keeps its bumps, as curved surfaces do: where they are left out of planes, nobody doubts these."""
    for module in (noise_bumps, surface_pass):
        monkeypatch.setattr(module, "find_bumps", lambda *_: 0.0)


@pytest.fixture
def undoubting(monkeypatch):
    """A function: from then on nobody doubts normals."""
    return lambda: monkeypatch.setattr(NoisePass, "find_certainty", lambda *_: None)


def test_functions_of_highlights_agree_with_the_mirror(gpu):
    random = np.random.default_rng(1)
    certainty = random.uniform(0.5, 1, (200, 1)).astype(F)
    variance = random.uniform(0, 0.2, (200, 1)).astype(F)
    answer = gpu("toksvig.glsl", "normal_certainty(x), 0, 0, 0", x=variance)
    np.testing.assert_allclose(answer[:, :1], toksvig.normal_certainty(variance), rtol=1e-6)
    answer = gpu("toksvig.glsl", "mean_certainty(x, 3.0), 0, 0, 0", x=certainty)
    np.testing.assert_allclose(answer[:, :1], toksvig.mean_certainty(certainty, 3), rtol=1e-6)
    material = np.array([0.1, 0.9, 0.3, 32], F)
    answer = gpu("toksvig.glsl", "widened(m, c)", m=material[None], c=certainty)
    np.testing.assert_allclose(answer, toksvig.widened(material, certainty), rtol=1e-5)
    map, at, size = random.uniform(0, 1, (5, 7)).astype(F), random.uniform(-2, 60, (200, 2)).astype(F), F([50, 37])
    answer = gpu("toksvig.glsl", "certainty_at(c_map, p, vec2(50.0, 37.0)), 0, 0, 0", c_map=map, p=at)
    nearest = toksvig.certainty_at(map, np.floor(at / 10) * 10 + 5, size)  # the helper's textures are not filtered
    assert answer.shape[0] == len(nearest) and np.isin(answer[:, 0], map).all()


def test_functions_of_tilt_agree_with_the_mirror(gpu, true_depth):
    surface = surface_by_noise(stereo(true_depth).astype(F), INTRINSICS)
    surface[100:140, 40:80] = 0
    pixel = np.random.default_rng(2).integers((-9, -9), (329, 249), (300, 2))
    inputs = {"surface_map": surface, "p": pixel.astype(F), "k": INTRINSICS[None]}
    beside = gpu("normal_variance.glsl", "surface_beside(surface_map, ivec2(p))", **inputs)
    np.testing.assert_allclose(beside, tilt.surface_beside(surface, pixel), atol=1e-6)
    known = gpu("normal_variance.glsl", "vec2(known_pixel(surface_map, ivec2(p))), 0, 0", **inputs)
    assert (known[:, :2] == tilt.known_pixel(surface, pixel)).all()
    answer = gpu("normal_variance.glsl", "tilt_variance(surface_map, ivec2(p), k), 0, 0, 0", **inputs)
    expected = tilt.tilt_variance(surface, pixel, INTRINSICS)
    close = np.isclose(answer[:, 0], expected, atol=1e-5, rtol=1e-3)
    assert (expected > 1e-4).sum() > 100 and (~close).sum() <= 3  # normals just at the limit
    answer = gpu("normal_variance.glsl", "variance_apart(surface_map, ivec2(p), k, 3), 0, 0, 0", **inputs)
    close = np.isclose(answer[:, 0], tilt.variance_apart(surface, pixel, INTRINSICS, 3), atol=1e-5, rtol=1e-3)
    assert (~close).sum() <= 3
    noise = np.random.default_rng(3).uniform(0, 2, (300, 2)).astype(F)
    answer = gpu("normal_variance.glsl", "steepest_variance(n, k), 0, 0, 0", n=noise, **inputs)
    np.testing.assert_allclose(answer[:, 0], tilt.steepest_variance(noise, INTRINSICS), rtol=1e-5)


def test_a_sphere_is_certain_and_bumps_are_not():
    v, u = np.mgrid[0:48, 0:48] - F(24)
    ball = np.stack([u / 120, v / 120, -np.sqrt(1 - (u**2 + v**2) / 120**2)], -1)
    bumps = ball + np.random.default_rng(1).normal(0, 0.1, ball.shape) * (1, 1, 0)
    for n, low, high in ((ball, 0, 1e-4), (bumps, 0.005, 0.02)):
        n = n / np.linalg.norm(n, axis=-1, keepdims=True)
        surface = np.concatenate([n, np.ones((48, 48, 1))], -1).astype(F)
        variance = tilt.tilt_variance(surface, np.array([[24, 24]]), F([120, 120, 24, 24]))[0]
        assert low <= variance <= high


@pytest.mark.parametrize("shininess", [8.0, 32.0, 200.0])
def test_a_widened_highlight_keeps_its_energy(shininess):
    """The integral of cos^s over the half sphere is 2 pi / (s + 1). Far wider ones are dimmed alone: no haze."""
    material, certainty = np.array([0.1, 0.9, 0.3, shininess], F), np.linspace(0.8, 1, 201, dtype=F)[:, None]
    wide = toksvig.widened(material, certainty)
    is_widened = wide[:, 3] > toksvig.LEAST_SHARE * shininess
    np.testing.assert_allclose((wide[:, 2] / (wide[:, 3] + 1))[is_widened], 0.3 / (shininess + 1), rtol=1e-5)
    assert (np.diff(wide[:, 2]) > 0).all() and (np.diff(wide[is_widened, 3]) > 0).all() and (wide[-1] == material).all()
    assert 1 < is_widened.sum() < 201 and (wide[~is_widened, 3] == toksvig.LEAST_SHARE * F(shininess)).all()


@pytest.mark.parametrize("shading", ["phong", "gouraud"])
def test_nothing_changes_without_noise(renderer, true_depth, undoubting, shading):
    frame, options = frame_of(true_depth), {"material": SHINY, "shading": shading}
    doubted = renderer.render(frame, **options)
    undoubting()
    with ps.Renderer() as other:
        assert (other.render(frame, **options) == doubted).all()


@pytest.mark.parametrize("told", [{}, {"noise": "0.4%"}, {"noise": 0.006}], ids=["measured", "in words", "in metres"])
def test_noise_of_any_kind_is_matt_where_it_would_sparkle(renderer, true_depth, undoubting, told):
    """What sparkles differs from pixel to pixel of the picture of the true surface."""
    frame, light = frame_of(stereo(true_depth)), ps.Light(direction=(1, 1, 2))
    true = renderer.render(frame_of(true_depth), light, material=SHINY)
    matt = renderer.render(frame, light, material=SHINY, **told)
    undoubting()
    with ps.Renderer() as made:
        sharp = made.render(frame, light, material=SHINY, **told)
    assert sparkle(matt, true) < 0.75 * sparkle(sharp, true)


def sparkle(picture, true):
    """How much their difference changes over 8 pixels, root of the mean square."""
    difference = np.where((picture[..., 3] > 0) & (true[..., 3] > 0), picture[..., 1].astype(float) - true[..., 1], 0)
    return np.sqrt(np.mean((difference[8:] - difference[:-8]) ** 2))


def test_a_small_ball_in_noise_keeps_its_highlight(renderer):
    """Normals that turn fast, as those of a ball of 20 pixels, are no doubt."""
    surface = tilt_of_a_ball(20)
    variance = tilt.tilt_variance(surface, np.array([[24, 24]]), F([120, 120, 24, 24]))[0]
    assert variance < 0.002
    surface[..., :3] = np.random.default_rng(3).normal(0, 1, (48, 48, 3)).astype(F)  # normals of no surface
    surface[..., :3] /= np.linalg.norm(surface[..., :3], axis=-1, keepdims=True)
    assert tilt.tilt_variance(surface, np.array([[24, 24]]), F([120, 120, 24, 24]))[0] >= 0.05


def tilt_of_a_ball(radius):
    v, u = (np.mgrid[0:48, 0:48] - F(24)) / radius
    inside = u**2 + v**2 < 0.95
    normals = np.stack([u, v, -np.sqrt(np.maximum(1 - u**2 - v**2, 0))], -1) * inside[..., None]
    return np.concatenate([normals, inside[..., None]], -1).astype(F)


DRAWN = {
    "phong": {},
    "phong, points": {"rasterizer": "points"},
    "gouraud": {"shading": "gouraud"},
    "mesh": {"splat": "mesh"},
    "spot": {"light": ps.Light(position=(-0.3, -0.4, 0), direction=(0.2, 0.3, 1))},
}


@pytest.mark.parametrize("name", DRAWN)
def test_pictures_agree_with_the_mirror(renderer, golden, true_depth, undoubting, name):
    """A mesh with a stored one. They are nearer to the picture of the true surface, of which noise makes blotches."""
    options = dict(DRAWN[name])
    rasterizer = options.pop("rasterizer", None)
    if rasterizer is None:
        need_compute(renderer)
    light = options.pop("light", ps.Light(direction=(1, 1, 2)))
    frame, look = frame_of(stereo(true_depth)), Appearance(material=SHINY, **options)
    noise = measure_noise(frame.depth, 262.5)
    surface = surface_by_noise(frame.depth, INTRINSICS)
    certainty = certainty_by_noise(surface, noise, INTRINSICS)
    assert certainty is not None and certainty.min() < 0.995
    moved = ps.Frame(frame.color, surface[..., 3], CAMERA)
    eye = Eye.at_distance(CAMERA, frame.pose, frame.scale)
    named = "points" if rasterizer else "compute"
    is_mesh = look.splat == "mesh"
    mirror = None
    if not is_mesh:
        mirror = mirror_render(moved, surface[..., :3], (light,), look, eye, named, certainty=certainty)
    with ps.Renderer(rasterizer=rasterizer or "auto") as made:
        picture = made.render(frame, light, material=SHINY, ambient_occlusion=False, normals="adaptive", **options)
        true = made.render(frame_of(true_depth), light, SHINY, ambient_occlusion=False, **options)
        golden(f"certainty_{name}", picture, mirror, stored=is_mesh)
    undoubting()
    with ps.Renderer(rasterizer=rasterizer or "auto") as made:
        sharp = made.render(frame, light, material=SHINY, ambient_occlusion=False, normals="adaptive", **options)
    assert error(picture, true) < 0.99 * error(sharp, true)


def error(picture, true):
    """Root of the mean square, where both show something."""
    both = (picture[..., 3] > 0) & (true[..., 3] > 0)
    return np.sqrt(np.mean((picture[both][:, :3].astype(float) - true[both][:, :3]) ** 2))


def test_several_frames_of_one_thing_are_as_uncertain_as_each(renderer, true_depth, undoubting):
    views = [frame_of(stereo(true_depth, seed)) for seed in (1, 2)]
    picture, true = renderer.render(views, material=SHINY), renderer.render(frame_of(true_depth), material=SHINY)
    undoubting()
    with ps.Renderer() as made:
        sharp = made.render(views, material=SHINY)
    assert error(picture, true) < 0.99 * error(sharp, true)


def test_normals_that_are_given_or_chosen_leave_no_doubt(renderer, true_depth, undoubting):
    frame = frame_of(stereo(true_depth))
    own = np.nan_to_num(renderer.estimate_normals(frame))
    renderer.render(frame, material=SHINY)  # with doubts, of which nothing may stay
    options = ({"normals": own}, {"normals": "star"})
    found = [renderer.render(frame, material=SHINY, **option) for option in options]
    undoubting()
    with ps.Renderer() as made:
        assert all((made.render(frame, material=SHINY, **o) == x).all() for o, x in zip(options, found, strict=True))
