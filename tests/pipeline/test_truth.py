"""Pictures and normals, compared with ray-traced truth: a sphere in front of a wall, 480x360, one point light."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import as_frame, decode, encode, sphere_and_wall, trace

from ..benchmarks.traced_light import co_visible, score_picture, shade
from ..support.drivers import need_compute

CAMERA = ps.Camera(394, 394, 239.5, 179.5, 480, 360)
LIGHT = ps.Light(position=(-1.0, -1.0, -0.5))
ESTIMATED = {"normals": "triangles-8", "max_depth_step": 0.05}


@pytest.fixture(scope="module", params=["compute", "points"])
def rasterizer(request, renderer):
    if request.param == "compute":
        need_compute(renderer)
    with ps.Renderer(rasterizer=request.param) as made:
        yield made


@pytest.fixture(scope="module")
def source():
    return trace(sphere_and_wall(), CAMERA)


@cache
def seen_from(yaw):
    """A pose, and what is there to be seen."""
    pose = ps.orbit_pose(None, (0, 0, 1.8), yaw)
    return pose, trace(sphere_and_wall(), CAMERA, pose)


def score(renderer, source, yaw, splat="footprint", depth=None, **options):
    """depth (h, w): of the frame, instead of the true one."""
    depth = source.depth if depth is None else depth
    frame = ps.Frame(as_frame(source, CAMERA).color, depth, CAMERA)
    numbered = ps.Frame(np.repeat(source.surface[..., None] + 1, 3, -1).astype(np.uint8), depth, CAMERA)
    pose, seen = seen_from(yaw)
    if yaw == 0:  # here every pixel is one of the frame's, whose colours have 8 bits
        seen = replace(seen, albedo=decode(frame.color.astype(float)))
    truth = encode(shade(seen, LIGHT, ps.Material(), pose[:3, 3]))
    options = ESTIMATED | options
    image = renderer.render(frame, LIGHT, pose=pose, splat=splat, **options)
    numbers = renderer.render(numbered, pose=pose, splat=splat, **options | {"shading": "none"})[..., 0]
    return score_picture(image, numbers.astype(int) - 1, truth, seen, co_visible(seen, source, CAMERA, np.eye(4)))


@pytest.mark.parametrize("shading", ["flat", "gouraud", "phong"])
def test_from_the_own_camera(rasterizer, source, shading):
    result = score(rasterizer, source, 0, shading=shading)
    assert result.psnr >= 60
    assert result.holes == 0 and result.spill == 0


@pytest.mark.parametrize("splat", ["footprint", "round"])
@pytest.mark.parametrize("shading", ["flat", "gouraud", "phong"])
def test_turned_by_15_degrees(rasterizer, source, shading, splat):
    result = score(rasterizer, source, 15, splat, shading=shading)
    assert result.psnr >= 47
    assert result.holes <= 0.0002 and result.spill <= 0.001


def test_noise_tears_no_holes_into_a_turned_view(rasterizer, source):
    """Points are drawn at denoised depth; raw depth is beyond these bounds, though surfaces go on behind its steps."""
    noise = np.random.default_rng(5).normal(0, 1, source.depth.shape) * (0.0012 + 0.0019 * (source.depth - 0.4) ** 2)
    depth = np.where(source.depth > 0, source.depth + noise, 0)
    results = {}
    for name, normals in (("auto", "auto"), ("as taken", "triangles-8")):
        results[name] = score(rasterizer, source, 15, depth=depth, normals=normals)
        print(name, results[name])
    assert results["auto"].psnr >= 40 and results["auto"].holes <= 0.001 and results["auto"].spill <= 0.003
    assert results["as taken"].psnr < 35 and results["as taken"].holes > max(0.002, 10 * results["auto"].holes)


def test_the_metric_sees_a_darker_picture_holes_and_spill(renderer, source):
    image = np.full((360, 480, 4), 255, np.uint8)
    number, truth = source.surface.copy(), np.full((360, 480, 3), 255.0)
    everywhere = np.ones((360, 480), bool)
    assert score_picture(image, number, truth, source, everywhere).psnr > 100
    assert score_picture(image, number, truth - 3, source, everywhere).psnr < 40
    image[100:110, :, 3] = 0
    assert score_picture(image, number, truth, source, everywhere).holes == pytest.approx(10 / 360)
    number[:] = 1
    assert score_picture(image, number, truth, source, everywhere).spill > 0.1
