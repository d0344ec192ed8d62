"""Samples of a large still share what they have in common: pictures are those of all samples, and cost less."""

from dataclasses import replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import as_frame, sphere_and_wall, trace
from pointshade_gl.pipeline import accumulation as shared_samples

NEVER = 1 << 60
LIGHT = ps.Light(position=(-0.8, -0.9, 0.2))
COLORED = ps.Light(position=(0.9, -0.2, 0.4), color=(1, 0.3, 0.1))


def textured(frame, seed=3):
    """The frame with colours that change from pixel to pixel, as photographs do, and with an outline."""
    rng = np.random.default_rng(seed)
    v, u = np.mgrid[: frame.depth.shape[0], : frame.depth.shape[1]]
    tiles = 60 * ((u // 9 + v // 7) % 2)[..., None]
    color = 60 + tiles + rng.integers(0, 60, (*frame.depth.shape, 3))
    return replace(frame, color=color.astype(np.uint8))


def rods(width=240, height=180):
    """A wall behind rods of one pixel, and some pixels alone."""
    depth = np.full((height, width), 2.0, np.float32)
    depth[20:160, 40], depth[70, 60:220], depth[100:150:10, 100:200:9] = 1.5, 1.4, 1.2
    color = np.full((height, width, 3), 90, np.uint8)
    color[depth < 2] = (230, 200, 40)
    return ps.Frame(color, depth, ps.Camera(220, 220, 119.5, 89.5, width, height))


def ball():
    camera = ps.Camera(165, 165, 89.5, 67, 180, 135)
    return textured(as_frame(trace(sphere_and_wall(), camera), camera))


def larger(camera, times):
    numbers = [times * x for x in (camera.fx, camera.fy, camera.cx + 0.5, camera.cy + 0.5)]
    fx, fy, cx, cy = numbers
    return ps.Camera(fx, fy, cx - 0.5, cy - 0.5, round(times * camera.width), round(times * camera.height))


def both(monkeypatch, frame, **options):
    """The picture of all samples, that of shared ones, and whether any were shared."""
    pictures, counts = [], []
    for worth in (NEVER, 1):
        monkeypatch.setattr(shared_samples, "WORTH", worth)
        with ps.Renderer(rasterizer=options.get("rasterizer", "auto")) as renderer:
            told = {name: value for name, value in options.items() if name != "rasterizer"}
            pictures.append(renderer.render(frame, samples=16, **({"light": LIGHT} | told)).astype(float))
            target = renderer._pipeline._target
            counts.append(renderer.steps.counts["shared"])
            if counts[-1]:
                with renderer.context.in_use():
                    is_open = np.frombuffer(target.samples.open.read(), np.float32)
    assert counts == [0, 1], counts
    return *pictures, is_open.mean()


def decibels(one, other):
    return 10 * np.log10(255**2 / max(((one - other) ** 2).mean(), 1e-9))


CASES = {
    "outlines and texture": (ball, {}),
    "twice as large": (ball, {"size": 2}),
    "thin things": (rods, {"size": 2}),
    "several lights": (ball, {"light": [LIGHT, COLORED]}),
    "narrow highlights": (ball, {"material": ps.Material(0.1, 0.7, 0.8, 300), "size": 2}),
    "a mesh": (ball, {"splat": "mesh", "size": 2}),
    "light from all around": (ball, {"ambient_occlusion": True, "size": 2}),
    "GL points": (ball, {"rasterizer": "points", "size": 2}),
}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.system) if name in ("twice as large", "several lights") else name
        for name in CASES
    ],
)
def test_shared_samples_give_the_picture_of_all_samples(monkeypatch, name):
    make, options = CASES[name]
    frame, options = make(), dict(options)
    camera = larger(frame.camera, options.pop("size", 1))
    whole, shared, is_open = both(monkeypatch, frame, camera=camera, **options)
    assert decibels(whole, shared) >= 60
    assert np.abs(whole - shared).max() <= 8
    assert is_open < 0.6


def test_a_smooth_wall_leaves_almost_nothing_to_the_samples(monkeypatch):
    depth = np.full((180, 240), 2.0, np.float32)
    frame = textured(ps.Frame(np.zeros((180, 240, 3), np.uint8), depth, ps.Camera(220, 220, 119.5, 89.5, 240, 180)))
    whole, shared, is_open = both(monkeypatch, frame)
    assert decibels(whole, shared) >= 60
    assert is_open < 0.05


@pytest.mark.parametrize(
    "options",
    [
        {"pose": ps.orbit_pose(None, (0, 0, 1.5), 10)},
        {"light": ps.Light(position=(-0.8, -0.9, 0.2), radius=0.1, shadow=True)},
        {"shading": "flat"},
    ],
    ids=["from elsewhere", "soft shadows", "flat"],
)
def test_what_samples_do_not_have_in_common_is_drawn_by_all_of_them(monkeypatch, options):
    monkeypatch.setattr(shared_samples, "WORTH", 1)
    with ps.Renderer() as renderer:
        renderer.render(ball(), samples=16, **({"light": LIGHT} | options))
        assert renderer.steps.counts["shared"] == 0


def test_a_smaller_picture_is_drawn_by_all_samples(monkeypatch):
    """Its pixels may have things between them that their middles do not see."""
    monkeypatch.setattr(shared_samples, "WORTH", 1)
    frame = rods()
    with ps.Renderer() as renderer:
        renderer.render(frame, samples=16, light=LIGHT, camera=larger(frame.camera, 0.5))
        assert renderer.steps.counts["shared"] == 0


def test_rough_surfaces_are_tried_in_a_band_only(monkeypatch):
    rng = np.random.default_rng(1)
    depth = (2 + 0.03 * rng.normal(size=(180, 240))).astype(np.float32)
    frame = ps.Frame(np.full((180, 240, 3), 120, np.uint8), depth, ps.Camera(220, 220, 119.5, 89.5, 240, 180))
    whole, shared, _ = both(monkeypatch, frame, normals="star")
    assert (whole == shared).all()


def test_more_samples_are_added_to_shared_ones(monkeypatch):
    monkeypatch.setattr(shared_samples, "WORTH", 1)
    frame = ball()
    with ps.Renderer() as renderer:
        renderer.render(frame, samples=16, light=LIGHT)
        more = renderer.render(frame, samples=32, light=LIGHT).astype(float)
    monkeypatch.setattr(shared_samples, "WORTH", NEVER)
    assert decibels(more, ps.render(frame, samples=32, light=LIGHT).astype(float)) >= 60
