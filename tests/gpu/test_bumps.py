"""Bumps that sensors leave on planes: wide planes lose them; what stands on planes or is curved keeps its shape."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.measure import round_disparity
from pointshade_gl.bench.scenes import make_scene
from pointshade_gl.bench.tracing import plane, sphere, trace

from ..estimation.test_noise import enlarged
from ..reference.surface_pass import surface_by_noise
from ..support import frames
from .test_surface import assert_agree

CAMERA = ps.Camera(480, 480, 319.5, 239.5, 640, 480)
WALL = plane((0.25, -0.35, -1), (0, 0, 1.3), frames.checks)
u, v = (k.astype(np.float64) for k in np.meshgrid(np.arange(640), np.arange(480)))


def lumps(size, seed=3):
    """Noise (h, w) of standard deviation 1 in lumps: white noise after three means of `size` pixels along each axis."""
    noise = np.random.default_rng(seed).normal(0, 1, u.shape)
    for axis in (0, 1):
        line = np.fft.rfft(noise, axis=axis)
        step = np.fft.rfft(np.ones(size) / size, u.shape[axis])
        noise = np.fft.irfft(line * (step**3 if axis else step[:, None] ** 3), u.shape[axis], axis=axis)
    return noise / noise.std()


def wave(across, period):
    return np.sqrt(2) * np.sin(2 * np.pi * across / period)


PATTERNS = {  # standard deviation 1
    "dents": lambda: 0.9 * wave(u, 19) * wave(v, 17) + 0.45 * lumps(5),
    "bands": lambda: 0.85 * np.where(u % 37 < 18, 1.0, -1.0) + 0.5 * lumps(5),
    "ripples": lambda: 0.9 * wave(2 * u + v, 57) + 0.45 * lumps(5),
    "lumps": lambda: lumps(9),
}


def sensed(depth, pattern, bumps=0.003):
    """What a sensor makes of a depth: bumps of 1 / depth, rounded to millimetres, moved to a finer camera's pixels."""
    w = 1 / np.where(depth > 0, depth, 1) + bumps * PATTERNS[pattern]()
    return ps.Frame(None, enlarged(np.where(depth > 0, np.round(1000 / w) / 1000, 0), 1.2).astype(np.float32), CAMERA)


def error(normals, truth):
    """Degrees, 90 for a normal that is missing."""
    return np.degrees(np.arccos(np.clip(np.nan_to_num((normals * truth).sum(-1)), -1, 1)))


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


def with_and_without(renderer, frame):
    """The normals of a frame, and those by the same noise in words but without bumps: as before."""
    normals = renderer.estimate_normals(frame)
    words = replace(renderer.choice.noise.words, bumps=0.0)
    return normals, renderer.estimate_normals(frame, noise=str(words))


@pytest.fixture(scope="module")
def wall():
    hits = trace([WALL], CAMERA)
    return hits.depth, hits.normals


@pytest.mark.parametrize("pattern", PATTERNS)
def test_patterns_of_sensors_are_no_shape_of_a_wall(renderer, wall, pattern):
    normals, before = with_and_without(renderer, sensed(wall[0], pattern))
    assert rms(error(normals, wall[1])) < 0.25 * rms(error(before, wall[1]))
    assert rms(error(normals, wall[1])) < 1.0


@pytest.mark.parametrize("pattern", ["dents", "bands", "lumps"])
def test_disparity_sensors_lose_their_patterns_too(renderer, wall, pattern):
    """Steps of 1/8 pixel of disparity, as PrimeSense cameras have them."""
    step = 0.0029
    w = 1 / wall[0] + 0.7 * step * PATTERNS[pattern]()
    frame = ps.Frame(None, (1 / (np.round(w / step) * step)).astype(np.float32), CAMERA)
    normals, before = with_and_without(renderer, frame)
    assert rms(error(normals, wall[1])) < 0.5 * rms(error(before, wall[1]))


def ornament(depth):
    """Waves some 30 pixels long on the left half of a wall, three times as high as the bumps."""
    waves = 0.015 * (np.sin(2 * np.pi * (u + 0.4 * v) / 31) + np.sin(2 * np.pi * (v - 0.3 * u) / 27))
    return np.where(u < 300, depth - waves, depth)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_an_ornament_beside_a_wall_stays(renderer, wall, pattern):
    depth = ornament(wall[0])
    truth = ps.estimate_normals(ps.Frame(None, depth.astype(np.float32), CAMERA), "star")
    normals, before = with_and_without(renderer, sensed(depth, pattern))
    carved, plain = np.s_[10:-10, 10:285], np.s_[10:-10, 330:-10]
    assert rms(error(normals, truth)[plain]) < 0.4 * rms(error(before, truth)[plain])
    assert rms(error(normals, truth)[carved]) < 1.03 * rms(error(before, truth)[carved])


def test_things_on_a_floor_keep_their_shape(renderer):
    """A ball of the size of a head is as good as before."""
    floor = plane((0, -1, -0.35), (0, 0.35, 1.2), frames.checks)
    ball = sphere((-0.15, 0.1, 1.1), 0.11, frames.checks)
    hits = trace([WALL, floor, ball], CAMERA)
    on_ball = np.linalg.norm(points(hits.depth) - (-0.15, 0.1, 1.1), axis=-1) < 0.112
    normals, before = with_and_without(renderer, sensed(hits.depth, "lumps", 0.002))
    assert on_ball.sum() > 3000
    assert rms(error(normals, hits.normals)[on_ball]) < 1.05 * rms(error(before, hits.normals)[on_ball])
    assert rms(error(normals, hits.normals)) < 0.6 * rms(error(before, hits.normals))


def points(depth):
    return np.stack([(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, np.ones_like(u)], -1) * depth[..., None]


def test_a_cable_on_a_wall_stays(renderer, wall):
    """8 pixels wide and 3 cm before the wall: its points stay where they are."""
    cable = abs(v - 200 - 30 * np.sin(u / 60)) < 4
    depth = np.where(cable, wall[0] - 0.03, wall[0])
    drawn = renderer.render_depth(sensed(depth, "lumps", 0.002))
    inside = abs(v - 200 - 30 * np.sin(u / 60)) < 2.5
    assert (abs(drawn - depth)[inside] < 0.015).mean() > 0.99


ROUNDINGS = {
    "exact": lambda z: z,
    "millimetres": lambda z: np.round(z, 3),
    "disparity": lambda z: 1 / (np.round(1 / z / 0.0029) * 0.0029),
    "noise": lambda z: z + np.random.default_rng(1).normal(0, 0.002, z.shape),
    "noise in millimetres": lambda z: np.round(z + np.random.default_rng(1).normal(0, 0.002, z.shape), 3),
}


@pytest.mark.parametrize("spoil", ROUNDINGS)
def test_where_neighbours_share_nothing_there_are_no_bumps(renderer, wall, spoil):
    renderer.estimate_normals(ps.Frame(None, ROUNDINGS[spoil](wall[0]).astype(np.float32), CAMERA))
    assert renderer.choice.noise.bumps == 0


def test_rough_ground_all_over_the_picture_is_no_noise(renderer, wall):
    """Rocks of 25 mm, without a plane among them."""
    depth = wall[0] + 0.025 * abs(lumps(9)) + 0.25 * (((u - 320) / 480) ** 2 + ((v - 240) / 480) ** 2)
    renderer.estimate_normals(ps.Frame(None, np.round(depth, 3).astype(np.float32), CAMERA))
    assert not renderer.choice.noise or renderer.choice.noise.bumps == 0


@cache
def stairs():
    return make_scene("stairs", CAMERA).depth.astype(float)


@pytest.mark.parametrize("step", [1 / 8, 1 / 4, 1 / 2])
def test_rounded_stairs_are_no_bumps(renderer, step):
    """Their treads and risers leave a plane by more than a step of disparity, but near pixels share no error."""
    frame = ps.Frame(None, round_disparity(stairs(), step, np.random.default_rng(0)), CAMERA)
    renderer.estimate_normals(frame)
    assert renderer.choice.noise.bumps == 0


@pytest.mark.parametrize("pattern", ["lumps", pytest.param("bands", marks=pytest.mark.system)])
def test_the_planes_agree_with_the_mirror(renderer, wall, pattern):
    depth = ornament(wall[0])
    depth[200:260, 350:420] -= 0.1
    depth[300:330, 500:520] = 0
    frame = sensed(depth, pattern)
    normals, drawn = renderer.estimate_normals(frame), renderer.render_depth(frame)
    assert renderer.choice.noise.bumps > 0
    mirror = surface_by_noise(frame.depth, np.array(CAMERA.intrinsics, np.float32))
    assert_agree(normals, np.where(mirror[..., 3:] > 0, mirror[..., :3], np.nan))
    known = (frame.depth > 0) & (drawn > 0)
    assert (np.abs(drawn - mirror[..., 3]) < 1e-4 * mirror[..., 3])[known].mean() > 0.999


def test_what_was_printed_draws_the_same_planes(renderer, wall):
    frame = sensed(wall[0], "lumps")
    measured = rms(error(renderer.estimate_normals(frame), wall[1]))
    told = rms(error(renderer.estimate_normals(frame, noise=str(renderer.choice.noise.words)), wall[1]))
    assert told < 1.2 * measured


REAL = {  # a plain part of a wall or floor: rows and columns, largest deviation of its normals (before: 8.5, 3.6, 6.2)
    "stereo_metal_floor": (np.s_[40:120, 320:600], 1.0),
    "realsense_box_6": (np.s_[300:460, 60:580], 1.2),
    "stereo_glass_reflections": (np.s_[120:400, 40:280], 2.5),
}


@pytest.mark.parametrize("name", REAL)
def test_walls_of_real_sensors_are_smooth(renderer, shared_data, name):
    part, most = REAL[name]
    normals = renderer.estimate_normals(ps.load_frame(shared_data / name))[part].reshape(-1, 3)
    normals = normals[np.isfinite(normals).all(-1)]
    mean = normals.mean(0) / np.linalg.norm(normals.mean(0))
    assert rms(error(normals, mean)) < most
