"""Depth that is smaller than the colours is drawn at their size: what it looks like, what it costs, what it leaves."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.picture_scores import co_visible, near_edge
from pointshade_gl.bench.scenes import near_depth_edge
from pointshade_gl.bench.tracing import decode, encode, plane, shade, trace
from pointshade_gl.level_of_detail import finer_camera
from pointshade_gl.look import Look
from pointshade_gl.reference.surface_pass import surface_by_noise
from pointshade_gl.reference.upsample import guide_colors, snapped, upsampled

from . import frames
from .compare import compare_images
from .small_depth import COLOR, DEPTH, LARGE, RATIO, SMALL, clean, lidar

F = np.float32
LIGHT = ps.Light(position=(-1.0, -1.0, -0.5))
K = np.array(SMALL.intrinsics, F)
SIDE = ps.orbit_pose(None, (0, 0, 1.6), 15)

clean, lidar = cache(clean), cache(lidar)


def surface_drawn(renderer, frame, **look):
    """The surface (h, w, 4), unit normal and depth, that is drawn at the colours' size."""
    with renderer._in_use():
        store = renderer._pipeline.frames
        (textures,) = store.upload([frame])
        drawn = store.find_points(textures, frame, Look(**look), frame.picture_camera)
        width, height = drawn.surface.size
        return np.frombuffer(drawn.surface.texture.read(), F).reshape(height, width, 4)


def psnr(image, truth, judged):
    error = image[judged][:, :3].astype(float) - truth[judged]
    return 10 * np.log10(255**2 / (error**2).mean())


def scores(renderer, known, **options):
    """% of wrong depths near edges, PSNR from the frame's own camera, PSNR from the side of what the frame saw."""
    frame, hits, surfaces = known
    depth = surface_drawn(renderer, frame, **options)[..., 3]
    edge = near_depth_edge(hits.depth, hits.normals, LARGE, round(1.5 * RATIO))
    wrong = abs(depth - hits.depth) > 0.02 * hits.depth if depth.shape == hits.depth.shape else np.ones(edge.shape, bool)
    own = replace(hits, albedo=decode(frame.color.astype(float)))
    image = renderer.render(frame, LIGHT, camera=LARGE, **options)
    front = psnr(image, encode(shade(own, LIGHT, ps.Material(), np.zeros(3))), hits.surface >= 0)
    seen = trace(surfaces, LARGE, SIDE)
    image = renderer.render(frame, LIGHT, camera=LARGE, pose=SIDE, **options)
    truth = encode(shade(seen, LIGHT, ps.Material(), SIDE[:3, 3]))
    return 100 * wrong[edge].mean(), front, psnr(image, truth, co_visible(seen, hits, LARGE, np.eye(4)))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_outlines_of_clean_depth_are_those_of_the_colours(renderer, seed):
    wrong, front, side = scores(renderer, clean(seed))
    print(wrong, front, side)
    assert wrong <= 1 and front >= 36 and side >= 27.5


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_outlines_of_low_contrast_are_mostly_found(renderer, seed):
    wrong, front, side = scores(renderer, clean(seed, 0.2))
    print(wrong, front, side)
    assert wrong <= 6 and side >= 27.5


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_depth_by_wide_beams_gets_outlines(renderer, seed):
    wrong, front, side = scores(renderer, lidar(seed))
    print(wrong, front, side, scores(renderer, lidar(seed), upsample="none"))
    assert wrong <= 20 and front >= 25 and side >= 18.5
