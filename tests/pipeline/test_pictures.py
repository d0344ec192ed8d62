"""Whole pictures, compared with the CPU mirror and with stored ones."""

from functools import cache

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.appearance import Appearance
from pointshade_gl.scene.camera import Eye
from pointshade_gl.scene.visible import MERGE

from ..reference.calm_normals import calm_normals
from ..reference.render import render as mirror_render
from ..reference.surface_pass import certainty_by_noise, measure_noise, surface_by_noise
from ..support import frames
from ..support.drivers import need_compute

LIGHT = ps.Light(position=(-0.8, -0.9, 0.2))


@pytest.fixture(scope="module")
def renderers(renderer):
    """The rasteriser of GL points, and that of compute shaders for each tolerance of merging."""
    need_compute(renderer)
    made = {"points": ps.Renderer(rasterizer="points")}
    made |= {merge: ps.Renderer(rasterizer="compute", merge=merge) for merge in (0, MERGE)}
    yield made
    for one in made.values():
        one.release()


@cache
def vase():
    frame = ps.load_frame("vase")
    small = frame.camera.resized(160, 120)
    return ps.Frame(frame.color, frame.depth[2::4, 2::4], small)


def both(rasterizer, frame, lights=(LIGHT,), pose=None, camera=None, normals="triangles-8", step="5%", **options):
    """The arguments of `golden`. The mirror uses the GPU's normals, which have tests of their own."""
    pose, camera = frame.pose if pose is None else pose, camera or frame.camera
    actual = rasterizer.render(frame, lights, camera=camera, pose=pose, normals=normals, max_depth_step=step, **options)
    found = np.nan_to_num(rasterizer.estimate_normals(frame, normals, max_depth_step=step))
    by_points = "point_size" in options or "splat" in options
    look = Appearance(**options)
    mirror = mirror_render(
        frame,
        found,
        lights,
        look,
        Eye.at_distance(camera, pose, frame.scale),
        "points" if by_points else rasterizer.name,
    )
    return actual, mirror, rasterizer.name == "points"  # the stored pictures are from the points


def turned(frame, yaw=15.0, pitch=5.0, dolly=0.0):
    return ps.orbit_pose(frame.pose, frame.pivot, yaw, pitch, dolly)


SCENES = {
    "tilted_plane": (frames.tilted_plane, {}),
    "sphere": (frames.sphere, {}),
    "step": (frames.step, {"yaw": -12.0}),
    "holes": (frames.holes, {}),
    "single_pixel": (frames.single_pixel, {"dolly": 0.5}),
    "all_missing": (frames.all_missing, {}),
}


@pytest.mark.parametrize("name", SCENES)
def test_scene(rasterizer, golden, name):
    make, view = SCENES[name]
    frame = make()
    golden(name, *both(rasterizer, frame, pose=turned(frame, **view)))


def test_vase_from_its_own_camera(rasterizer, golden):
    golden("vase_front", *both(rasterizer, vase()))


def test_vase_from_the_side(rasterizer, golden):
    frame = vase()
    golden("vase_side", *both(rasterizer, frame, pose=turned(frame, 25, 10)))


@pytest.mark.parametrize("shading", ["none", "flat", "gouraud"])
def test_shading(rasterizer, golden, shading):
    """A closer look, so that one splat covers several pixels and the models differ."""
    frame = frames.sphere()
    golden(f"shading_{shading}", *both(rasterizer, frame, pose=turned(frame, 15, 5, 0.4), shading=shading))


def test_round_splats_of_several_sizes(rasterizer, golden):
    frame = frames.sphere_before_wall()
    sizes = 0.5 + 2 * np.random.default_rng(2).random(frame.depth.shape)
    pose = turned(frame, 15, 5, 0.3)
    golden("round_sizes", *both(rasterizer, frame, pose=pose, splat="round", point_size=sizes))


def test_noisy_depth_is_drawn_calmed(rasterizer, golden):
    frame = frames.noisy()
    pose = turned(frame)
    actual = rasterizer.render(frame, LIGHT, pose=pose)
    intrinsics = np.array(frame.camera.intrinsics, np.float32)
    surface, noise = surface_by_noise(frame.depth, intrinsics), measure_noise(frame.depth, float(intrinsics[0]))
    certainty = certainty_by_noise(surface, noise, intrinsics)
    color = np.asarray(frame.color, np.float32)[..., :3] / 255
    assert not noise.bumps
    normals, certainty = calm_normals(surface, color, certainty, noise.relative, False, intrinsics)
    assert 0.001 < np.abs(surface[..., 3] - frame.depth).mean() < 0.004
    filtered = ps.Frame(frame.color, surface[..., 3], frame.camera)
    eye = Eye.at_distance(frame.camera, pose, frame.scale)
    mirror = mirror_render(
        filtered,
        surface[..., :3],
        (LIGHT,),
        Appearance(),
        eye,
        rasterizer.name,
        certainty=certainty,
        light_normals=normals,
    )
    golden("noisy", actual, mirror, rasterizer.name == "points")


def test_two_lights_and_a_frame_pose(rasterizer, golden):
    made = frames.sphere_before_wall()
    pose = ps.orbit_pose(None, (0.3, 0, -2), 40, 10)
    frame = ps.Frame(None, made.depth, made.camera, pose)
    lights = (
        ps.Light(
            position=tuple(frame.pivot + np.array([0.5, -1, -1])), color=(1, 0.6, 0.3), attenuation=(0.5, 0.2, 0.3)
        ),
        ps.Light(direction=(-1, 0.2, 0.5), color=(0.2, 0.3, 0.8), intensity=0.8),
    )
    golden("two_lights", *both(rasterizer, frame, lights=lights, pose=turned(frame)))


def test_colours_of_another_size(rasterizer, golden):
    """Colours at twice the depth's size, odd on one side: sampled at the depth pixel's place."""
    frame = frames.sphere_before_wall()
    color = frame.color.repeat(2, 0).repeat(2, 1)[:, 1:]
    frame = ps.Frame(color, frame.depth, frame.camera)
    golden("colour_size", *both(rasterizer, frame, pose=turned(frame, 10, 0, 0.2)))


def test_another_size_and_the_default_light(rasterizer, golden):
    frame = frames.sphere()
    golden("small_default_light", *both(rasterizer, frame, lights=(ps.Light(),), camera=frame.camera.fitted(100, 120)))


@pytest.mark.parametrize("shading", ["none", "flat", "gouraud", "phong"])
@pytest.mark.parametrize(("merge", "rims"), [(0, 0), (MERGE, 0.0003)])
def test_both_rasterizers_cover_the_same_and_differ_only_where_splats_overlap(renderers, shading, merge, rims):
    """Neighbours overlap by a tenth of a source pixel: which one is seen there may differ, mixed values hardly."""
    points, compute = renderers["points"], renderers[merge]
    for frame in (vase(), frames.sphere(), frames.sphere_before_wall(), frames.step()):
        own, other = (r.render(frame, LIGHT, shading=shading).astype(int) for r in (points, compute))
        assert np.abs(own - other).max() <= 1
        pose = turned(frame)
        own, other = (r.render(frame, LIGHT, pose=pose, shading=shading).astype(int) for r in (points, compute))
        assert (own[..., 3] != other[..., 3]).mean() <= rims
        assert np.abs(own - other).mean() <= (0.2 if shading in ("gouraud", "phong") else 1)


def test_the_lit_side_faces_the_light(renderer):
    frame = frames.sphere()
    for axis, sign in ((0, -1), (0, 1), (1, -1), (1, 1)):
        position = np.array([0.0, 0, 1.0])
        position[axis] += 3 * sign
        lit = renderer.render(frame, ps.Light(position=tuple(position)))[..., 0].astype(float)
        here = lit[59:62, 75:90].mean() if axis else lit[50:70, 82:86].mean()
        assert here > 0
        plane = lit[:, 83] if axis else lit[60]
        first, second = np.array_split(plane[plane > 0], 2)
        assert (first.mean() > second.mean()) == (sign < 0)
