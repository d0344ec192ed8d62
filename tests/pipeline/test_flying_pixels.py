"""Flying pixels: mixed samples of a sensor go back onto a surface, and thin things, outlines and slants stay."""

import numpy as np
import pytest

import pointshade_gl as ps

from ..gpu.test_surface import assert_agree
from ..reference import flying_pixels as flying
from ..reference.inverse_depth import pixel_grid
from ..reference.surface_pass import surface_by_noise
from ..reference.texels import depth_at
from ..support import frames
from ..support.drivers import need_compute

F = np.float32
FOCAL = 525.0
CAMERA = ps.Camera(FOCAL, FOCAL, 159.5, 119.5, 320, 240)
WIRES = (1.4, np.s_[20:180, 60:61]), (1.45, np.s_[20:180, 70:72]), (1.35, np.s_[20:180, 80:83])  # depth, place


def scene():
    """(h, w) depth of a floor, a wall, a ball, a box and wires of 1 to 3 pixels; and where the wires are."""
    v, u = np.mgrid[:240, :320]
    x, y = (u - CAMERA.cx) / FOCAL, (v - CAMERA.cy) / FOCAL
    z = np.minimum(2.6 / (1 + 0.3 * x), 0.3 / np.maximum(y, 1e-6))
    a, b = x * x + y * y + 1, 0.1 * x + 1.6
    root = b * b - a * (0.01 + 2.56 - 0.2**2)
    z = np.where(root > 0, (b - np.sqrt(np.maximum(root, 0))) / a, z)
    z[60:150, 220:290] = (1.2 / (1 + 0.5 * x))[60:150, 220:290]
    thin = np.zeros(z.shape, bool)
    for depth, place in WIRES:
        z[place], thin[place] = depth, True
    for k in range(60):
        z[30 + k, 100 + k : 102 + k], thin[30 + k, 100 + k : 102 + k] = 1.1, True
    return z, thin


def mixed(z, side):
    """Every sample with a share `side` of its neighbours, along rows and columns, as by beams wider than pixels."""
    for axis in (0, 1):
        padded = np.pad(z, [(1, 1) if k == axis else (0, 0) for k in (0, 1)], mode="edge")
        before, after = (np.take(padded, np.arange(z.shape[axis]) + shift, axis) for shift in (0, 2))
        z = (1 - 2 * side) * z + side * (before + after)
    return z


def deviation(z):
    """Of a Kinect's depth, metres (Nguyen, Izadi, Lovell 2012)."""
    return 0.0012 + 0.0019 * (z - 0.4) ** 2


def noisy(z, seed):
    return (z + np.random.default_rng(seed).normal(size=z.shape) * deviation(z)).astype(F)


def steps_of(depth):
    depth = depth.astype(F)
    noise = (deviation(depth) / depth).astype(F)
    return flying.flying_step(depth, pixel_grid(depth), depth, noise, FOCAL)


def from_surfaces(depth, truth):
    """Share of the depth by which a pixel misses the nearest true depth in 3x3 pixels."""
    near = [depth_at(truth, None, (k % 3 - 1, k // 3 - 1)) for k in range(9)]
    return np.min([np.abs(depth - z) for z in near], axis=0) / truth


# Share of its neighbours that a sample has, and of the flying pixels that are found.
@pytest.mark.parametrize(("side", "share"), [(0.1, 0.98), (0.2, 0.98)])
@pytest.mark.parametrize("seed", [0, 1])
def test_mixed_samples_are_put_back_onto_surfaces(side, share, seed):
    """Except those of thin things: only farther things are beside them, so they stay where the sensor saw them."""
    truth, thin = scene()
    blurred = mixed(truth, side)
    depth = noisy(blurred, seed)
    flies = from_surfaces(blurred, truth) > 0.02 + 3 * deviation(truth) / truth
    step = steps_of(depth)
    moved = step != 0
    assert (flies & ~thin).sum() > 1500 and moved[flies & ~thin].mean() > share
    assert (from_surfaces(depth / (1 + step), truth)[moved] < 0.04).mean() > 0.95
    assert not moved[np.abs(blurred - truth) < 0.003 * truth].any()


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_thin_things_and_outlines_stay(seed):
    truth, thin = scene()
    step = steps_of(noisy(truth, seed))
    assert not step[thin].any()
    assert (step != 0).mean() < 1e-4


@pytest.mark.parametrize("lines", [1, 2, 3])
@pytest.mark.parametrize("degrees", [60, 80, 86, 89])
def test_a_slanted_plane_has_none(degrees, lines):
    """Even where a sensor repeats lines, as it does when depth is enlarged by less than 2."""
    v = np.floor(np.arange(240) * lines / 4 + 0.5) / lines * 4 if lines > 1 else np.arange(240)
    w = 0.5 + (v[:, None] - 120) / FOCAL * np.tan(np.radians(degrees)) * 0.5 + 0 * np.arange(320)
    depth = np.where(w > 0.1, 1 / np.maximum(w, 0.1), 0).astype(F)
    here = np.where(depth > 0, depth, F(1))
    assert not flying.flying_step(depth, pixel_grid(depth), here, np.full_like(here, 1e-7), FOCAL).any()


def test_flying_step_agrees_with_the_mirror(gpu):
    depth = noisy(mixed(scene()[0], 0.15), 4)
    depth[np.random.default_rng(5).random(depth.shape) < 0.03] = 0
    expected = flying.flying_step(depth, pixel_grid(depth), depth + (depth == 0), np.full_like(depth, 0.002), FOCAL)
    v, u = np.nonzero(depth > 0)
    some = np.flatnonzero(expected[v, u])[:1000]
    some = np.concatenate([some, np.random.default_rng(6).integers(0, len(v), 1000)])
    at, here = np.stack([u, v], -1)[some].astype(F), depth[v, u][some, None]
    answer = gpu(
        "flying_pixels.glsl", "flying_step(depth_map, ivec2(at), here, 0.002, 525.0)", at=at, here=here, depth_map=depth
    )
    assert np.count_nonzero(answer[:, 0]) > 900
    np.testing.assert_allclose(answer[:, 0], expected[v, u][some], rtol=1e-5)


@pytest.mark.parametrize("told", [None, 0.003])
def test_auto_agrees_with_the_mirror(renderer, told):
    frame = ps.Frame(None, noisy(mixed(scene()[0], 0.15), 7), CAMERA)
    normals = renderer.estimate_normals(frame, noise=told, flying="snap")
    noise = None if told is None else np.full((1, 1), told, F)
    mirror = surface_by_noise(frame.depth, np.array(CAMERA.intrinsics, F), noise, "snap")
    assert_agree(normals, np.where(mirror[..., :3].any(-1, keepdims=True), mirror[..., :3], np.nan))
    depth = renderer.render_depth(frame, noise=told, flying="snap")
    assert (np.abs(depth - mirror[..., 3]) < 1e-3 * depth).mean() > 0.999
    assert (np.abs(depth - renderer.render_depth(frame, noise=told)) > 0.05).sum() > 500


@pytest.mark.parametrize("make", [frames.sphere_before_wall, frames.step, frames.holes, frames.single_pixel])
def test_clean_depth_does_not_change(renderer, make):
    pose = ps.orbit_pose(None, (0, 0, 1.5), 25)
    kept, snapped = (renderer.render(make(), pose=pose, flying=how) for how in ("keep", "snap"))
    assert (kept == snapped).all()


@pytest.fixture(params=["compute", "points"])
def rasterizer(request, renderer):
    if request.param == "compute":
        need_compute(renderer)
    with ps.Renderer(rasterizer=request.param) as made:
        yield made


def test_nothing_hangs_between_two_walls(rasterizer):
    """Turned, the mixed samples of a step fill the gap. The frame's own camera sees its own colours either way."""
    made = frames.step()
    depth = mixed(made.depth.astype(float), 0.25)
    frame = ps.Frame(made.color, depth + np.random.default_rng(3).normal(0, 0.002, depth.shape), made.camera)
    pose = ps.orbit_pose(None, (0, 0, 1.5), 30)
    hanging = {}
    for how in ("keep", "snap"):
        own = rasterizer.render(frame, shading="none", flying=how)
        assert (own[..., :3] == frame.color).all() and (own[..., 3] == 255).all()
        seen = rasterizer.render_depth(frame, pose=pose, flying=how)
        v, u = np.nonzero(seen)
        x = (u - frame.camera.cx) / frame.camera.fx * seen[v, u]
        z = (pose @ np.stack([x, 0 * x, seen[v, u], 1 + 0 * x]))[2]
        hanging[how] = ((z > 1.3) & (z < 1.9)).sum()
    assert hanging["keep"] > 500 and hanging["snap"] == 0, hanging


def test_a_wrong_word_is_named(renderer):
    with pytest.raises(ValueError, match=r"unknown flying 'snapp' \(did you mean snap\?\): known are keep, snap"):
        renderer.render(frames.sphere(), flying="snapp")


def test_typed(typed):
    code, said, _ = typed("normals vase -o n.npy --flying snap")
    assert code == 0 and "normals by auto" in said
    assert "--flying" in typed("render vase -o a.png --flying drop")[2]
