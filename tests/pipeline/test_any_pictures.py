"""Pictures of whatever is passed: what always holds, whichever frame, camera, light and look.

Some examples with small shadow maps in each run; all of the profile, with those of the size of always, in that of the
system. Many more examples: `pytest FILE --hypothesis-profile=long`.
"""

import inspect
from dataclasses import replace
from functools import partial, wraps

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import pointshade_gl as ps
from pointshade_gl.scene import shadow_cameras
from pointshade_gl.scene.appearance import NOT_LIT
from pointshade_gl.scene.camera import Eye
from pointshade_gl.scene.noise import METHODS

from ..reference.render import render as mirror_render
from ..support import given_values as values
from ..support.compare import compare_images

SHADINGS = st.sampled_from(["none", "flat", "gouraud", "phong", "edl"])
SOFT = ("plane", "wall", "noisy", "steps", "rough")
MATT = ps.Material(ambient=0, diffuse=1, specular=0)
SMALL = 64  # pixels of a shadow view where there are few examples


def holds(test, few=12):
    """A property test(..., data), with few examples or with all."""

    @pytest.mark.parametrize("examples", [few, pytest.param("all", marks=pytest.mark.system)])
    @wraps(test)
    def check(examples, monkeypatch, **arguments):
        asked = settings() if examples == "all" else settings(max_examples=examples)
        if examples != "all":
            monkeypatch.setattr(shadow_cameras, "SHADOW_SIDE", SMALL)
        asked(given(data=st.data())(test))(**arguments)

    wanted = [name for name in inspect.signature(test).parameters if name != "data"]
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
    check.__signature__ = inspect.Signature(
        [inspect.Parameter(name, kind) for name in ("examples", "monkeypatch", *wanted)]
    )
    return check


def moved(frame):
    """Poses near a frame, looking at it from some side."""
    turns = st.tuples(st.floats(-40, 40), st.floats(-40, 40), st.sampled_from([0.0, 0.5, 0.9, -1.0, -20.0]))
    return turns.map(lambda turn: ps.orbit_pose(frame.pose, frame.pivot, *turn))


@st.composite
def looks(draw, shape):
    """Options of render that go with each other."""
    random = np.random.default_rng(draw(values.seeds))
    sizes = [None, None, 1, 2.5, 0.0, 40.0, "fill", random.choice([0, 0.5, 1, 3], shape)]
    normals = [*METHODS, "auto", random.normal(size=(*shape, 3)), np.full((*shape, 3), np.nan)]
    size = sizes[draw(st.integers(0, len(sizes) - 1))]
    splats = (
        ["footprint", "round"]
        if not (size is None or (isinstance(size, str | int) and size in (1, "fill")))
        else ["footprint", "round", "mesh"]
    )
    noises = [None, None, 0.01, 1e-9, "kinect", "1.5mm,shared=2,steps=1mm", np.full(shape, 0.02)]
    return {
        "normals": normals[draw(st.integers(0, len(normals) - 1))],
        "shading": draw(SHADINGS),
        "point_size": size,
        "splat": draw(st.sampled_from(splats)),
        "max_depth_step": draw(st.sampled_from([None, 0.05, "3%", 1e-12, 1e18])),
        "noise": noises[draw(st.integers(0, len(noises) - 1))],
        "upsample": draw(st.sampled_from(["vote", "none"])),
        "normals_at": draw(st.sampled_from(["source", "target"])),
        "flying": draw(st.sampled_from(["keep", "snap"])),
        "missing": draw(st.sampled_from(["keep", "complete", "photo"])),
        "temporal": draw(st.booleans()),
        "unlight": draw(st.booleans()),
        "remove_highlights": draw(st.booleans()),
    }


finishes = st.fixed_dictionaries(
    {
        "samples": st.sampled_from([1, 1, 1, 2, 3]),
        "background": st.sampled_from([None, None, "white", "#102030", (0.5, 0, 2)]),
        "ground": st.sampled_from([False, False, True, (0, -1, 0), (1, 2, 3)]),
    }
)


@partial(holds, few=6)
def test_any_frame_is_drawn_under_any_light_with_any_look(renderer, data):
    frame = data.draw(values.frames())
    if frame.color is not None and data.draw(st.booleans()):
        frame = ps.Frame(np.repeat(np.repeat(frame.color, 2, 0), 2, 1), frame.depth, frame.camera)
    look, finish = data.draw(looks(frame.depth.shape)), data.draw(finishes)
    lights, material = data.draw(st.lists(values.lights(), max_size=3)), data.draw(values.materials)
    camera = data.draw(st.one_of(st.none(), values.cameras(frame.depth.shape), values.shapes.flatmap(values.cameras)))
    pose = data.draw(st.one_of(st.none(), moved(frame), values.poses(1e6)))
    before = frame.depth.copy(), None if frame.color is None else frame.color.copy()
    arguments = (frame, lights, material, camera, pose), look | finish
    image = renderer.render(*arguments[0], **arguments[1])
    camera = camera or frame.picture_camera
    assert image.shape == (camera.height, camera.width, 4) and image.dtype == np.uint8
    if not frame.points_known and finish["background"] is None and not finish["ground"]:
        assert not image.any()
    if finish["background"] is None:
        assert not image[image[..., 3] == 0].any()
    else:
        assert (image[..., 3] == 255).all()
    if not look["temporal"]:
        np.testing.assert_array_equal(renderer.render(*arguments[0], **arguments[1]), image)
    np.testing.assert_array_equal(frame.depth, before[0])
    assert before[1] is None or (frame.color == before[1]).all()


@holds
def test_a_frame_seen_unlit_by_its_own_camera_is_its_picture(renderer, data):
    frame = data.draw(
        values.frames(patterns=("plane", "wall", "rough", "noisy", "steps", "far"), camera=values.plain_cameras)
    )
    assume(frame.color is not None)
    splat, size = data.draw(st.sampled_from(["footprint", "round"])), data.draw(st.sampled_from([None, 1]))
    image = renderer.render(frame, shading="none", splat=splat, point_size=size)
    known = frame.depth > 0
    np.testing.assert_array_equal(image[..., 3] > 0, known)
    np.testing.assert_array_equal(image[known][:, :3], frame.color[known][:, :3])


@holds
def test_normals_are_unit_face_the_camera_and_are_missing_where_the_depth_is(renderer, data):
    patterns = data.draw(st.sampled_from([SOFT, tuple(values.PATTERNS)]))
    frame = data.draw(values.frames(patterns=patterns, color=False))
    method = data.draw(st.sampled_from(METHODS))
    normals = renderer.estimate_normals(frame, method)
    known = frame.depth > 0
    assert normals.shape == (*known.shape, 3) and normals.dtype == np.float32
    assert np.isnan(normals[~known]).all()
    told = normals[np.isfinite(normals).all(-1)]
    np.testing.assert_allclose(np.linalg.norm(told, axis=-1), 1, atol=1e-4)
    v, u = np.nonzero(np.isfinite(normals).all(-1))
    c = frame.camera
    rays = np.stack([(u - c.cx) / c.fx, (v - c.cy) / c.fy, np.ones(len(u))], -1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    assert ((told * rays).sum(-1) <= 1e-4).all()
    assert patterns != SOFT or np.isfinite(normals[known]).all()


@holds
def test_depth_seen_by_its_own_camera_is_the_depth(renderer, data):
    frame = data.draw(values.frames(patterns=("plane", "wall", "steps", "far"), camera=values.plain_cameras))
    depth = renderer.render_depth(frame, frame.camera, normals="star")
    np.testing.assert_array_equal(depth > 0, frame.depth > 0)
    np.testing.assert_allclose(depth, frame.depth, rtol=1e-5)


@holds
def test_points_are_those_of_the_frame(renderer, data):
    frame = data.draw(values.frames(patterns=SOFT, camera=values.plain_cameras))
    cloud = renderer.render_points(frame, normals="star")
    v, u = np.nonzero(frame.depth)
    z, c = frame.depth[v, u].astype(float), frame.camera
    expected = np.stack([(u - c.cx) / c.fx * z, (v - c.cy) / c.fy * z, z], -1)
    np.testing.assert_allclose(cloud.positions, expected, rtol=1e-5, atol=1e-6)
    assert len(cloud.normals) == len(cloud.colors) == len(u)


@holds
def test_more_light_makes_nothing_darker(renderer, data):
    """Nor does a light inside of a surface, or one that is too bright for numbers."""
    frame = data.draw(values.frames(patterns=SOFT, camera=values.plain_cameras))
    some, more = data.draw(st.lists(values.lights(), max_size=2)), data.draw(values.lights())
    if data.draw(st.booleans()) and frame.points_known:
        v, u = (one[0] for one in np.nonzero(frame.depth))
        z, c = float(frame.depth[v, u]), frame.camera
        more = ps.Light(((u - c.cx) / c.fx * z, (v - c.cy) / c.fy * z, z), attenuation=(0, 0, 1))
    look = {
        "material": data.draw(values.materials),
        "shading": data.draw(SHADINGS),
        "normals": "star",
        "pose": data.draw(st.one_of(st.none(), moved(frame))),
    }
    dark = renderer.render(frame, some, **look)
    lit = renderer.render(frame, [*some, more], **look)
    assert (lit.astype(int) >= dark.astype(int) - 1).all()


@holds
def test_lights_add_up(renderer, data):
    """In linear light, to what 8 bits can tell; their order changes nothing."""
    frame = data.draw(values.frames(patterns=SOFT, camera=values.plain_cameras))
    lights = data.draw(st.lists(values.lights(soft=False), min_size=2, max_size=3))
    lights = [replace(light, color=(1, 0.5, 0.25), intensity=0.3, attenuation=(1, 0, 0)) for light in lights]
    look = {
        "material": MATT,
        "shading": data.draw(SHADINGS.filter(lambda name: name not in NOT_LIT)),
        "normals": "star",
    }
    together = renderer.render(frame, lights, **look)
    backwards = renderer.render(frame, lights[::-1], **look)
    assert (np.abs(together.astype(int) - backwards) <= 1).all()
    low, high = zip(*(linear_range(renderer.render(frame, light, **look)) for light in lights), strict=True)
    at_least, at_most = linear_range(together)
    assert (at_most >= np.minimum(sum(low), 1) - 1e-4).all() and (at_least <= sum(high) + 1e-4).all()


def linear_range(image):
    """The linear light that may have become these 8 bits, (h, w, 3) twice."""
    encoded = [np.clip((image[..., :3] + step) / 255, 0, 1) for step in (-0.75, 0.75)]
    return [np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4) for c in encoded]


@holds
def test_color_and_intensity_are_one_factor(renderer, data):
    frame = data.draw(values.frames(patterns=SOFT, camera=values.plain_cameras))
    light = replace(data.draw(values.lights()), color=(1, 0.5, 0.25), intensity=0.5)
    other = replace(light, color=(0.5, 0.25, 0.125), intensity=1)
    look = {"shading": data.draw(SHADINGS), "normals": "star"}
    np.testing.assert_array_equal(renderer.render(frame, light, **look), renderer.render(frame, other, **look))


@holds
def test_a_picture_is_the_same_in_every_unit(renderer, data):
    """Frame, lights and poses in other units: by a power of two, so that no digit changes."""
    frame = data.draw(values.frames(patterns=SOFT, camera=values.plain_cameras))
    light = replace(data.draw(values.lights()), attenuation=(1, 0, 0))
    pose, scale = data.draw(moved(frame)), data.draw(st.sampled_from([2.0**-10, 0.5, 4.0, 2.0**10]))
    larger = ps.Frame(frame.color, frame.depth * np.float32(scale), frame.camera)
    far = replace(light, radius=light.radius * scale)
    far = far if light.position is None else replace(far, position=tuple(scale * x for x in light.position))
    away = pose.copy()
    away[:3, 3] *= scale
    look = {
        "shading": data.draw(SHADINGS),
        "normals": data.draw(st.sampled_from(["star", "triangles-4", "plane-fit-3"])),
    }
    image, other = renderer.render(frame, light, pose=pose, **look), renderer.render(larger, far, pose=away, **look)
    assert not compare_images(other, image)


@holds
def test_frame_camera_and_lights_move_together(renderer, data):
    frame = data.draw(values.frames(patterns=SOFT, camera=values.plain_cameras))
    light, pose, motion = data.draw(values.lights()), data.draw(moved(frame)), data.draw(values.poses(3))
    assume(light.position is None or np.abs(light.position).max() < 10)
    turned = {}
    if light.position is not None:
        turned["position"] = tuple(motion[:3, :3] @ light.position + motion[:3, 3])
    if light.direction is not None:
        turned["direction"] = tuple(motion[:3, :3] @ light.direction)
    carried = ps.Frame(frame.color, frame.depth, frame.camera, motion)
    look = {"shading": data.draw(SHADINGS), "normals": "star"}
    light = replace(light, shadow=False, intensity=1.0, color=(1, 1, 1))
    image = renderer.render(frame, light, pose=pose, **look)
    other = renderer.render(carried, replace(light, **turned), pose=motion @ pose, **look)
    assert not compare_images(other, image)


@holds
def test_a_mirrored_frame_gives_a_mirrored_picture(renderer, data):
    frame = data.draw(values.frames(patterns=SOFT, camera=values.plain_cameras))
    light = replace(data.draw(values.lights(soft=False, shadows=False)), color=(1, 1, 1), intensity=1)
    assume(light.position or light.direction)
    c = frame.camera
    color = None if frame.color is None else frame.color[:, ::-1]
    other = ps.Frame(color, frame.depth[:, ::-1], replace(c, cx=c.width - 1 - c.cx))
    places = {
        name: (-x, y, z)
        for name in ("position", "direction")
        if getattr(light, name)
        for x, y, z in [getattr(light, name)]
    }
    look = {
        "shading": data.draw(SHADINGS),
        "normals": data.draw(st.sampled_from(["star", "triangles-8", "plane-fit-5", "central"])),
        "ambient_occlusion": False,  # whose planes lie otherwise
    }
    image, mirrored = renderer.render(frame, light, **look), renderer.render(other, replace(light, **places), **look)
    assert not compare_images(mirrored[:, ::-1], image)


@holds
def test_a_negative_fy_is_the_same_view_with_its_rows_upwards(renderer, data):
    frame = data.draw(values.frames(patterns=SOFT, camera=values.plain_cameras))
    light, c = replace(data.draw(values.lights(soft=False, shadows=False)), color=(1, 1, 1), intensity=1), frame.camera
    color = None if frame.color is None else frame.color[::-1]
    other = ps.Frame(color, frame.depth[::-1], replace(c, fy=-c.fy, cy=c.height - 1 - c.cy))
    look = {
        "shading": data.draw(SHADINGS),
        "normals": data.draw(st.sampled_from(["star", "triangles-8", "plane-fit-5"])),
        "ambient_occlusion": False,
    }
    image, turned = renderer.render(frame, light, **look), renderer.render(other, light, **look)
    assert not compare_images(turned[::-1], image)


@pytest.mark.parametrize("rasterizer", ["compute", "points"])
@given(data=st.data())
def test_small_frames_agree_with_the_mirror(renderers, rasterizer, data):
    renderer = renderers[rasterizer]
    shape = data.draw(st.tuples(*[st.integers(1, 24)] * 2))
    frame = data.draw(values.frames(shape, patterns=SOFT, camera=values.plain_cameras))
    light = replace(data.draw(values.lights(soft=False, shadows=False)), color=(1, 0.9, 0.8), intensity=1)
    assume(light.position is None or light.direction is None)
    look = ps.Appearance(shading=data.draw(SHADINGS), normals="star")
    pose = data.draw(st.one_of(st.just(np.eye(4)), moved(frame)))
    seen = {"camera": frame.camera, "pose": pose, "ambient_occlusion": False}  # which a far lamp would bring
    actual = renderer.render(frame, light, **seen, **look.options)
    normals = np.nan_to_num(renderer.estimate_normals(frame, "star"))
    mirror = mirror_render(frame, normals, [light], look, Eye.at_distance(frame.camera, pose, frame.scale), rasterizer)
    differ = np.abs(actual.astype(int) - mirror).max(-1) > 2
    if differ.sum() == 1:  # there the rasterisers may see one of two splats that are nearly equally deep
        seen = {"camera": frame.camera, "pose": pose, "normals": "star"}
        one, other = (any_of_them.render_depth(frame, **seen)[differ] for any_of_them in renderers.values())
        assert 1e-6 < abs(one / other - 1) < 1e-3
        actual[differ] = mirror[differ]
    assert not compare_images(actual, mirror)


@pytest.fixture(scope="module")
def renderers(renderer):
    if renderer.context.gl.version_code < 430:
        pytest.skip("the compute rasteriser needs OpenGL 4.3")
    with ps.Renderer(rasterizer="points") as points, ps.Renderer(rasterizer="compute") as compute:
        yield {"points": points, "compute": compute}
