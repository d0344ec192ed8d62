"""Eye-dome lighting: objects in their own colours, darker beside what is nearer."""

from dataclasses import replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.camera import Eye
from pointshade_gl.scene.graph import shaded
from pointshade_gl.scene.settings import OutputSettings

from ..reference.color import linear_to_srgb, srgb_to_linear
from ..reference.eye_dome import eye_dome
from ..reference.render import render as mirror_render
from ..support import frames

EDL = {"shading": "edl"}


def board(z, left, right, color, **look):
    """A rectangle that faces the camera."""
    corners = [(x, y, z) for x, y in ((left, -1), (right, -1), (right, 1), (left, 1))]
    return ps.Node(ps.Mesh(corners, [(0, 1, 2), (0, 2, 3)], color=color, **look))


def by_hand(renderer, scene, **view):
    """What a scene looks like by its unlit picture and its depth."""
    plain, depth = renderer.render(shaded(scene, "none"), **view), renderer.render_depth(scene, **view)
    surfaces = np.zeros((*depth.shape, 4), np.float32)
    surfaces[..., 3] = depth
    pixel = np.stack(np.meshgrid(*(np.arange(n) for n in depth.shape[::-1])), -1)
    linear = srgb_to_linear(plain[..., :3].astype(np.float32) / 255)
    dimmed = linear_to_srgb(linear * eye_dome(surfaces, pixel, depth)[..., None])
    return np.concatenate([np.round(dimmed * 255), plain[..., 3:]], -1).astype(np.uint8)


def is_like(image, expected):
    """Whether pictures differ by rounding only: `by_hand` begins with a picture of 8 bits."""
    steps = np.abs(image.astype(int) - expected).max(-1)
    return (steps > 2).mean() <= 0.001 and (steps <= 1).mean() > 0.99


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("kind", ["compute", "points"])
def test_a_frame_looks_as_the_mirror_draws_it(renderer, golden, kind, samples):
    if kind == "compute" and renderer.context.gl.version_code < 430:
        pytest.skip("the compute rasteriser needs OpenGL 4.3")
    frame = frames.sphere_before_wall()
    pose = ps.orbit_pose(frame.pose, frame.pivot, 15, 5)
    with ps.Renderer(rasterizer=kind) as made:
        options = {"normals": "triangles-8", "max_depth_step": "5%"}
        actual = made.render(frame, pose=pose, samples=samples, **EDL, **options)
        normals = np.nan_to_num(made.estimate_normals(frame, "triangles-8", max_depth_step="5%"))
    eye, finish = Eye.at_distance(frame.camera, pose, frame.scale), OutputSettings(samples)
    mirror = mirror_render(frame, normals, [ps.Light()], ps.Appearance(shading="edl"), eye, kind, finish=finish)
    golden("shading_edl", actual, mirror, stored=kind == "points" and samples == 1)


def test_a_wall_that_faces_the_camera_keeps_its_colours_to_the_bit(renderer):
    frame = ps.Frame(frames.step().color, np.full((120, 160), 1.5, np.float32), frames.CAMERA)
    assert (renderer.render(frame, **EDL) == renderer.render(frame, shading="none")).all()


def test_the_farther_wall_is_darker_where_the_nearer_one_begins(renderer):
    frame = frames.step()
    dimmed, plain = (renderer.render(frame, shading=shading) for shading in ("edl", "none"))
    changed = (dimmed != plain).any(-1)
    assert changed[:, 80].all() and not changed[:, :80].any() and not changed[:, 81:].any()
    assert (dimmed[1:-1, 80, :3] < 0.5 * plain[1:-1, 80, :3]).all()


@pytest.mark.parametrize("options", [{"splat": "mesh"}, {"splat": "round", "point_size": 2.0}, {"unlight": True}])
def test_every_kind_of_points_is_darkened_by_its_own_depth(renderer, options):
    frame = frames.sphere_before_wall()
    scene = ps.Scene((ps.Node(ps.PointObject(frame, **EDL, **options)),), frames.CAMERA)
    view = {"pose": ps.orbit_pose(None, frame.pivot, 10, 4)}
    expected = by_hand(renderer, scene, **view)
    assert is_like(renderer.render(scene, **view), expected)
    assert is_like(renderer.render(frame, **EDL, **options, **view), expected)
    assert not is_like(renderer.render(shaded(scene, "none"), **view), expected)


def test_several_frames_of_one_object(renderer):
    frame = frames.sphere_before_wall()
    other = ps.Frame(frame.color, frame.depth, frame.camera, ps.orbit_pose(None, frame.pivot, yaw=1))
    scene = ps.Scene((ps.Node(ps.PointObject([frame, other], **EDL)),), frames.CAMERA)
    assert is_like(renderer.render(scene), by_hand(renderer, scene))
    assert not is_like(renderer.render(scene), renderer.render(shaded(scene, "none")))


def test_an_object_with_it_and_one_with_light_stand_beside_each_other(renderer):
    """Only the former is darkened, also by the latter; light and materials of the latter are its own."""
    lit = ps.PointObject(frames.sphere(), material=ps.Material(diffuse=0.5, specular=0.9))
    far = board(3.0, -2, 2, (0.8, 0.6, 0.2), **EDL)
    scene = ps.Scene((ps.Node(lit), far, ps.Node(ps.Light(position=(-1, -1, 0)))), frames.CAMERA)
    plain = ps.Scene(
        (ps.Node(lit), replace(far, content=replace(far.content, shading="none")), *scene.nodes[2:]), frames.CAMERA
    )
    image, other, depth = renderer.render(scene), renderer.render(plain), renderer.render_depth(scene)
    is_far = depth > 2.99
    assert is_far.any() and (~is_far).any() and (image[~is_far] == other[~is_far]).all()
    expected = by_hand(renderer, scene)
    assert (np.abs(image[is_far].astype(int) - expected[is_far]) <= 1).all()
    assert (image[is_far] != other[is_far]).any(-1).sum() > 20


def test_copies_of_a_mesh_and_lights_with_shadows(renderer):
    """The shadow map is not seen on what has no light; copies are drawn at once."""
    front, back = board(1.5, -0.3, 0.3, (0.2, 0.7, 0.3), **EDL), board(2.5, -2, 2, (1, 1, 1), **EDL)
    moved = replace(front, transform=ps.orbit_pose(None, (0, 0, 1.5), yaw=20))
    sun = ps.Node(ps.Light(direction=(0.5, 0.5, 1), shadow=True))
    scene = ps.Scene((front, moved, back, sun), frames.CAMERA)
    assert is_like(renderer.render(scene), by_hand(renderer, scene))


@pytest.mark.parametrize("splat", ["disc", "ball"])
def test_a_cloud(renderer, splat):
    """Two sheets of points, one before the other; its colours are white."""
    rng = np.random.default_rng(4)
    sheets = [np.c_[rng.uniform(-side, side, (4000, 2)), np.full(4000, z)] for side, z in ((0.4, 1.5), (1.5, 2.2))]
    cloud = ps.PointCloud(np.concatenate(sheets).astype(np.float32), splat=splat, **EDL)
    scene = ps.Scene((ps.Node(cloud),), frames.CAMERA)
    image, expected = renderer.render(scene), by_hand(renderer, scene)
    assert is_like(image, expected) and (image[..., 3] > 0).mean() > 0.5
    assert not is_like(renderer.render(shaded(scene, "none")), expected)


def test_a_scene_in_it_and_again_in_light_leaves_no_trace(renderer):
    """The mark of one picture is not there in the next, which draws its surfaces on another way."""
    frame, light = frames.sphere_before_wall(), ps.Light(position=(-1, -1, 0))
    with ps.Renderer() as fresh:
        expected = [fresh.render(frame, one) for one in (light, ps.Light(position=(1, 0, 0)))]
    renderer.render(frame, **EDL)
    assert (renderer.render(frame, light) == expected[0]).all()
    assert (renderer.render(frame, ps.Light(position=(1, 0, 0))) == expected[1]).all()


def test_points_of_a_cloud_keep_their_own_colours(renderer):
    frame = frames.sphere()
    clouds = [renderer.render_points(frame, shading=shading) for shading in ("edl", "none")]
    assert (clouds[0].colors == clouds[1].colors).all()


def test_it_needs_no_exposure(renderer):
    """Colours are the photograph's: there is no light to be brighter."""
    frame = frames.noisy()
    given = renderer.render(frame, exposure="auto", **EDL)
    assert renderer.exposure == 0 and (given == renderer.render(frame, **EDL)).all()
