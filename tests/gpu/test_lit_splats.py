"""Splats lit where they are made: the picture of the resolve pass, in one pass, where that is enough."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.camera import Eye

from ..reference.render import render as mirror_render
from ..support import frames
from ..support.compare import compare_images

LIGHTS = [
    ps.Light(position=(-0.8, -0.9, 0.2), attenuation=(0.5, 0.2, 0.3)),
    ps.Light(direction=(-1, 0.2, 0.5), color=(0.2, 0.3, 0.8)),
]


@pytest.fixture
def points(renderer):
    with ps.Renderer(rasterizer="points") as made:
        yield made


def ran(renderer, frame, *arguments, **options):
    """The steps that run for one more picture, and the picture."""
    before = renderer.steps.counts.copy()
    image = renderer.render(frame, *arguments, shading="flat", **options)
    return {name for name, count in (renderer.steps.counts - before).items() if count}, image.astype(int)


def posed():
    """With a pose, and colours of another size."""
    made = frames.sphere_before_wall()
    color = np.asarray(made.color).repeat(2, 0).repeat(2, 1)[:, 1:]
    return ps.Frame(color, made.depth, made.camera, ps.orbit_pose(None, (0.3, 0, -2), 40, 10))


@pytest.mark.parametrize("make", [posed, frames.holes, frames.step, frames.single_pixel, frames.all_missing])
@pytest.mark.parametrize("look", [{}, {"splat": "round"}, {"point_size": 2.5}], ids=str)
def test_it_is_the_picture_of_the_resolve_pass(points, make, look):
    frame = make()
    options = {"yaw": 15, "pitch": 5, "dolly": 0.3, "upsample": "none", "material": ps.Material(specular=0.8)} | look
    steps, lit = ran(points, frame, LIGHTS, **options)
    assert steps >= {"lit splats"} and not steps & {"splats", "light", "resolve"}
    steps, resolved = ran(points, frame, LIGHTS, **options)
    assert steps == {"splats", "light", "resolve"}
    assert np.abs(lit - resolved).max() <= 1
    assert (lit[..., 3] == resolved[..., 3]).all()


def test_it_is_the_mirrors_picture(points):
    frame = frames.sphere_before_wall()
    sizes = 0.5 + 2 * np.random.default_rng(2).random(frame.depth.shape)
    look = ps.Appearance(shading="flat", point_size=sizes, splat="round", normals="triangles-8")
    pose = ps.orbit_pose(None, frame.pivot, 15, 5, 0.3)
    image = points.render(frame, LIGHTS, pose=pose, **look.options)
    assert points.steps.counts["lit splats"] == 1
    normals = np.nan_to_num(points.estimate_normals(frame, "triangles-8"))
    eye = Eye.at_distance(frame.camera, pose, frame.scale)
    assert not compare_images(image, mirror_render(frame, normals, LIGHTS, look, eye))


def test_a_new_view_is_one_pass_and_other_lights_on_it_keep_its_splats(points):
    frame = frames.sphere()
    ran(points, frame)
    assert ran(points, frame, yaw=5)[0] == {"lit splats"}
    assert ran(points, frame, LIGHTS, yaw=5)[0] == {"splats", "light", "resolve"}
    assert ran(points, frame, yaw=5)[0] == {"light", "resolve"}
    assert ran(points, frame, yaw=5, point_size=2)[0] == {"lit splats"}
    assert ran(points, frames.sphere(), yaw=5)[0] == {"upload", "surface", "lit splats"}


def test_after_another_picture_nothing_old_is_shown(points):
    frame = frames.sphere()
    first = ran(points, frame)[1]
    for _ in range(2):
        points.render(frame, yaw=30)
        assert np.abs(ran(points, frame)[1] - first).max() <= 1
        points.render(frame, shading="none")
        assert np.abs(ran(points, frame)[1] - first).max() <= 1


def test_where_it_would_not_be_the_same_it_is_not_used(points, renderer):
    frame = frames.sphere()
    shadow = ps.Light(position=(-1, -1, 0), shadow=True)
    board = ps.Mesh(np.array([(1, 1, 3), (2, 1, 3), (1, 2, 3.0)]), np.array([(0, 1, 2)]))
    scene = ps.Scene((ps.Node(ps.PointObject(frame, shading="flat")), ps.Node(board)), camera=frame.camera)
    points.render(scene)
    for options in ({"light": shadow}, {"samples": 2}, {"background": "white"}, {"splat": "mesh"}):
        points.render(frame, shading="flat", **options)
    for shading in ("none", "gouraud", "phong"):
        points.render(frame, shading=shading)
    assert not points.steps.counts["lit splats"]
    if renderer.context.gl.version_code >= 430:
        before = renderer.steps.counts["lit splats"]
        renderer.render(frame, shading="flat")
        assert renderer.steps.counts["lit splats"] == before
