"""Whole pictures against the CPU mirror and the stored ones."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.gpu.resolve import light_rows
from pointshade_gl.reference.render import render as mirror_render
from pointshade_gl.renderer import NEAR

from . import frames

LIGHT = ps.Light(position=(-0.8, -0.9, 0.2))


def vase():
    frame = ps.load_frame("vase")
    small = frame.camera.resized(160, 120)
    return ps.Frame(frame.color, frame.depth[2::4, 2::4], small)


def both(renderer, frame, lights=(LIGHT,), pose=None, camera=None, normals="triangles-8", step="5%", **options):
    """(GPU picture, mirror picture), the mirror lit by the GPU's own normals, which have tests of their own."""
    pose, camera = frame.pose if pose is None else pose, camera or frame.camera
    actual = renderer.render(frame, lights, camera=camera, pose=pose, normals=normals, max_depth_step=step, **options)
    found = np.nan_to_num(renderer.estimate_normals(frame, normals, max_depth_step=step))
    mirror = mirror_render(
        frame,
        found,
        light_rows(lights, pose),
        ps.Material(),
        camera,
        pose,
        NEAR * frame.scale,
        options.get("shading", "phong"),
        options.get("size", 1.0),
        options.get("splat") == "round",
    )
    return actual, mirror


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
def test_scene(renderer, golden, name):
    make, view = SCENES[name]
    frame = make()
    golden(name, *both(renderer, frame, pose=turned(frame, **view)))


def test_vase_from_its_own_camera(renderer, golden):
    golden("vase_front", *both(renderer, vase()))


def test_vase_from_the_side(renderer, golden):
    frame = vase()
    golden("vase_side", *both(renderer, frame, pose=turned(frame, 25, 10)))


@pytest.mark.parametrize("shading", ["none", "flat", "gouraud"])
def test_shading(renderer, golden, shading):
    """A closer look, so that one splat covers several pixels and the models differ."""
    frame = frames.sphere()
    golden(f"shading_{shading}", *both(renderer, frame, pose=turned(frame, 15, 5, 0.4), shading=shading))


def test_round_splats_of_several_sizes(renderer, golden):
    frame = frames.sphere_before_wall()
    sizes = 0.5 + 2 * np.random.default_rng(2).random(frame.depth.shape)
    pose = turned(frame, 15, 5, 0.3)
    golden("round_sizes", *both(renderer, frame, pose=pose, splat="round", size=sizes))


def test_two_lights_and_a_frame_pose(renderer, golden):
    made = frames.sphere_before_wall()
    pose = ps.orbit_pose(None, (0.3, 0, -2), 40, 10)
    frame = ps.Frame(None, made.depth, made.camera, pose)
    lights = (
        ps.Light(
            position=tuple(frame.pivot + np.array([0.5, -1, -1])), color=(1, 0.6, 0.3), attenuation=(0.5, 0.2, 0.3)
        ),
        ps.Light(direction=(-1, 0.2, 0.5), color=(0.2, 0.3, 0.8), intensity=0.8),
    )
    golden("two_lights", *both(renderer, frame, lights=lights, pose=turned(frame)))


def test_colours_of_another_size(renderer, golden):
    """Colours at twice the depth's size, odd on one side: sampled at the depth pixel's place."""
    frame = frames.sphere_before_wall()
    color = frame.color.repeat(2, 0).repeat(2, 1)[:, 1:]
    frame = ps.Frame(color, frame.depth, frame.camera)
    golden("colour_size", *both(renderer, frame, pose=turned(frame, 10, 0, 0.2)))


def test_another_size_and_the_default_light(renderer, golden):
    frame = frames.sphere()
    golden("small_default_light", *both(renderer, frame, lights=(ps.Light(),), camera=frame.camera.fitted(100, 120)))


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
