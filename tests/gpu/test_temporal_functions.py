"""Compares the functions of common/temporal.glsl, and the passes around them, with their mirror."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.gpu.core.frame_textures import PointSurface
from pointshade_gl.gpu.core.images import Owner
from pointshade_gl.gpu.surface.noise_measurement import Stream, StreamHistory, TemporalPass
from pointshade_gl.scene.noise import Noise

from ..reference import temporal
from ..reference.camera import pixel_ray
from ..reference.normals_adaptive import widest_stride
from .test_shader_functions import VIEW, VIEW_GLSL

F = np.float32
COUNT, WIDTH, HEIGHT = 400, 64, 48
K = np.array([52.0, -48.0, 31.0, 25.0], F)
ROUNDING = (0.003, -1.0)


@pytest.fixture
def rng():
    return np.random.default_rng(8)


def history(rng):
    """A slanted wall with noise and holes, as it is remembered."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    depth = 1 / (0.5 + 0.002 * u + 0.001 * v) + rng.normal(0, 0.002, u.shape)
    depth[rng.random(depth.shape) < 0.05] = 0
    noise, left = rng.uniform(0.001, 0.003, (2, *depth.shape))
    return np.stack([depth, noise, left, 0 * depth], -1).astype(F)


def pixels(rng):
    return np.stack([rng.integers(0, WIDTH, COUNT), rng.integers(0, HEIGHT, COUNT)], -1).astype(F)


def normals_of(rng, count):
    n = rng.normal(size=(*count, 3))
    n[..., 2] = -np.abs(n[..., 2]) - 0.5
    return (n / np.linalg.norm(n, axis=-1, keepdims=True)).astype(F)


def changes(rng):
    change = np.stack([rng.normal(0, 2, (HEIGHT, WIDTH)), rng.uniform(0.001, 0.003, (HEIGHT, WIDTH))], -1)
    change[rng.random((HEIGHT, WIDTH)) < 0.1] = 0
    return change.astype(F)


def as_map(values):
    return np.concatenate([values, np.zeros((*values.shape[:2], 4 - values.shape[2]), F)], -1)


def test_what_lies_outside_is_zero(gpu, rng):
    picture, pixel = history(rng), pixels(rng)
    answer = gpu("temporal.glsl", "history_at(h_map, ivec2(p), ivec2(9, -7))", h_map=picture, p=pixel)
    assert (answer == temporal.history_at(picture, pixel, (9, -7))).all() and (answer == 0).all(-1).mean() > 0.2


def test_fresh_noise(gpu, rng):
    here = rng.uniform((0.5, 0.001), (4, 0.01), (COUNT, 2)).astype(F)
    answer = gpu("temporal.glsl", "vec4(fresh_noise(h, vec2(0.003, -1)))", h=here)
    np.testing.assert_allclose(answer[:, 0], temporal.fresh_noise(here, ROUNDING), rtol=1e-5)


def test_old_step(gpu, rng):
    picture, pixel, here = history(rng), pixels(rng), rng.uniform(-0.2, 2, COUNT).astype(F)
    answer = gpu("temporal.glsl", "vec4(old_step(h_map, ivec2(p), z), 0, 0)", h_map=picture, p=pixel, z=here[:, None])
    expected = temporal.old_step(picture, pixel, here)
    np.testing.assert_allclose(answer[:, :2], expected, rtol=1e-5, atol=1e-6)
    assert 0.05 < (expected[:, 1] == 0).mean() < 0.3


def test_carry_to_old(gpu, rng):
    pixel, here = pixels(rng), rng.uniform(1, 2, COUNT).astype(F)
    call = f"vec4(carry_to_old(ivec2(p), z, k, {VIEW_GLSL}), 0)"
    answer = gpu("temporal.glsl", call, p=pixel, z=here[:, None], k=K[None])
    np.testing.assert_allclose(answer[:, :3], temporal.carry_to_old(pixel, here, K, VIEW), rtol=1e-4, atol=1e-3)


def test_carried_step_is_exact_on_planes_and_needs_all_four_pixels(gpu, rng):
    picture = history(rng)
    at = pixels(rng) + rng.uniform(-0.5, 0.5, (COUNT, 2))
    true = 1 / (0.5 + 0.002 * at[:, 0] + 0.001 * at[:, 1])
    there = np.concatenate([at, (true * rng.choice([1, 1.1, -1], COUNT, p=(0.8, 0.1, 0.1)))[:, None]], -1).astype(F)
    answer = gpu("temporal.glsl", "vec4(carried_step(h_map, t), 0, 0)", h_map=picture, t=there)
    expected = temporal.carried_step(picture, there)
    np.testing.assert_allclose(answer[:, :2], expected, rtol=1e-4, atol=1e-5)
    assert 0.3 < (expected[:, 1] == 0).mean() < 0.6 and np.abs(expected[:, 0]).max() < 0.005


def test_carried_normal(gpu, rng):
    normals = as_map(normals_of(rng, (HEIGHT, WIDTH)))
    there = np.concatenate([pixels(rng) + rng.uniform(-0.5, 0.5, (COUNT, 2)), np.ones((COUNT, 1))], -1).astype(F)
    answer = gpu("temporal.glsl", "vec4(carried_normal(n_map, t), 0)", n_map=normals, t=there)
    np.testing.assert_allclose(answer[:, :3], temporal.carried_normal(normals, there), atol=1e-5)


def test_change_of(gpu, rng):
    step, noise = rng.uniform(0.001, 0.02, (COUNT, 2)).astype(F), rng.uniform(0.001, 0.01, COUNT).astype(F)
    answer = gpu("temporal.glsl", "vec4(change_of(s, n), 0, 0)", s=step, n=noise[:, None])
    np.testing.assert_allclose(answer[:, :2], temporal.change_of(step, noise), rtol=1e-5)


@pytest.mark.parametrize("stride", [1, 5])
def test_change_power(gpu, rng, stride):
    picture, pixel = changes(rng), pixels(rng)
    answer = gpu("temporal.glsl", f"vec4(change_power(c_map, ivec2(p), {stride}))", c_map=as_map(picture), p=pixel)
    np.testing.assert_allclose(answer[:, 0], temporal.change_power(picture, pixel, stride), rtol=1e-4, atol=1e-5)


def test_power_is_one_for_noise_alone_and_much_for_what_moves_or_turns(rng):
    pixel = np.stack(np.meshgrid(np.arange(20, 44), np.arange(20, 28)), -1)
    change = np.stack([rng.normal(0, 1, (HEIGHT, WIDTH)), np.full((HEIGHT, WIDTH), 0.001)], -1).astype(F)
    assert 0.8 < temporal.change_power(change, pixel, 2).mean() < 1.2
    assert (temporal.change_power(change + np.array([1, 0], F), pixel, 2) > 1).mean() > 0.95
    turned = change + np.stack([0.2 * (np.arange(WIDTH) - 32) * np.ones((HEIGHT, 1)), np.zeros((HEIGHT, WIDTH))], -1)
    assert temporal.change_power(turned.astype(F), np.array([[32, 24]]), 4) > 4


def test_fresh_share_and_mixed_depth(gpu, rng):
    noise, power, here = (rng.uniform(a, b, COUNT).astype(F) for a, b in ((0.001, 0.01), (0, 9), (1, 2)))
    change = np.stack([rng.normal(0, 2.5, COUNT), rng.uniform(0.0002, 0.01, COUNT)], -1).astype(F)
    change[::7] = 0
    inputs = {"n": noise[:, None], "c": change}
    answer = gpu("temporal.glsl", "vec4(fresh_share(n, c, q), 0, 0)", q=power[:, None], **inputs)
    expected = temporal.fresh_share(noise, change, power)
    np.testing.assert_allclose(answer[:, :2], expected, rtol=1e-5)
    assert (expected[::7, 0] == 1).all() and (expected[:, 0] >= 1 / 16).all() and (expected[:, 1] <= noise).all()
    share = expected[:, 0]
    answer = gpu("temporal.glsl", "vec4(mixed_depth(z, n, c, s))", z=here[:, None], s=share[:, None], **inputs)
    np.testing.assert_allclose(answer[:, 0], temporal.mixed_depth(here, noise, change, share), rtol=1e-5)


def test_mixed_normal_faces_the_camera(gpu, rng):
    fresh, old = normals_of(rng, (COUNT,)), normals_of(rng, (COUNT,)) * [[1, 1, -1]]
    share, ray = rng.uniform(0.1, 1, COUNT).astype(F), np.array([[0.1, -0.2, 1]], F)
    inputs = {"f": fresh, "o": old, "s": share[:, None], "r": ray}
    answer = gpu("temporal.glsl", "vec4(mixed_normal(f, o, s, r), 0)", **inputs)[:, :3]
    expected = temporal.mixed_normal(fresh, old.astype(F), share, ray)
    np.testing.assert_allclose(answer, expected, atol=1e-5)
    facing = (fresh * ray).sum(-1) < 0
    assert ((expected * ray).sum(-1)[facing] < 0).all() and (expected[facing] != fresh[facing]).any(-1).mean() > 0.3


def remember(picture, before, view):
    """The passes on the CPU: (depth, noise, noise left, share) after a picture (h, w, 2)."""
    pixel = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), -1)
    noise = temporal.fresh_noise(picture, ROUNDING)
    here = picture[..., 0]
    if before is None:
        change = np.zeros_like(picture)
    else:
        step = temporal.old_step(before, pixel, here)
        if view is not None:
            there = temporal.carry_to_old(pixel, np.where(here > 0, here, F(1)), K, view)
            step = np.where((here > 0)[..., None], temporal.carried_step(before, there), F(0))
        change = temporal.change_of(step, noise)
    stride = np.maximum(widest_stride((here, picture[..., 1]), K), 5)
    share = temporal.fresh_share(noise, change, temporal.change_power(change, pixel, stride))
    depth = temporal.mixed_depth(here, noise, change, share[..., 0])
    return np.stack([depth, picture[..., 1], share[..., 1], share[..., 0]], -1)


def test_the_passes_agree_with_the_mirror_and_leave_what_they_remember(renderer, rng):
    camera = ps.Camera(*map(float, K), WIDTH, HEIGHT)
    side = np.eye(4)
    # A quarter of a pixel: the wall stays where it was, within its noise. In both directions: else a point would be
    # carried onto a row, and the last bit, which GPUs round otherwise, would decide which rows must be known.
    side[:2, 3] = 0.01, 0.007
    poses = [np.eye(4), np.eye(4), side, side]
    noise = Noise(0.002, 0.001, ROUNDING[0], "z", 0.0, 0.0, 1.0, None, (0.0, ROUNDING[1]))
    gl, expected = renderer.context.gl, None
    with renderer._in_use():
        made = Owner(gl)
        passes, one = made._keep(TemporalPass(gl, renderer.steps)), made._keep(StreamHistory(gl))
        surface = made._keep(PointSurface(gl, (WIDTH, HEIGHT)))
        try:
            for k, pose in enumerate(poses):
                picture = history(rng)[..., :2].copy()
                normals = as_map(normals_of(rng, (HEIGHT, WIDTH)))
                normals[..., 3] = picture[..., 0]
                texture = made._keep(gl.texture((WIDTH, HEIGHT), 2, picture.tobytes(), dtype="f4"))
                texture.filter = gl.NEAREST, gl.NEAREST
                surface.texture.write(normals)
                stream = Stream(passes, one, ps.Frame(None, picture[..., 0], camera, pose))
                answer = passes.filter_depth(texture, noise, stream, camera)
                found = np.frombuffer(one.fit((WIDTH, HEIGHT)).depth.read(), F).reshape(HEIGHT, WIDTH, 4)
                calm = np.frombuffer(answer.read(), F).reshape(HEIGHT, WIDTH, 2)
                np.testing.assert_array_equal(calm, found[..., :2])
                passes.filter_normals(surface, stream, camera)
                mixed = surface.read()[..., :3]
                moved = k > 0 and not np.array_equal(pose, poses[k - 1])
                view = (np.linalg.inv(poses[k - 1]) @ pose).astype(F) if moved else None
                expected = remember(picture, expected, view)
                known = picture[..., 0] > 0
                off = np.abs(found - expected)[known].max(-1)
                assert (off > 1e-4).mean() < 0.01, f"frame {k}"
                assert (found[known, 3] < 0.9).mean() == 0 if k == 0 else (found[known, 3] < 0.9).mean() > 0.5
                fresh = (mixed == normals[..., :3]).all(-1)[known]
                assert fresh.mean() > 0.99 if k == 0 else fresh.mean() < 0.4
        finally:
            made.release()


def test_rays_and_pixels_share_their_centres():
    """carry_to_old of a camera that stands still is the pixel itself."""
    pixel = np.array([[3, 40]])
    there = temporal.carry_to_old(pixel, np.array([1.5], F), K, np.eye(4, dtype=F))
    np.testing.assert_allclose(there, [[3, 40, 1.5]], atol=1e-4)
    assert pixel_ray(K[2:], K)[2] == 1
