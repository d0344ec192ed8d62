"""Frames, cameras, poses, lights and looks: whatever is passed, a value that holds together, or one sentence.

Many more examples: `pytest FILE --hypothesis-profile=long`.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pointshade_gl as ps
from pointshade_gl.scene.camera import check_pose
from pointshade_gl.scene.light import at_upper_left, light_rows
from pointshade_gl.scene.settings import OutputSettings
from pointshade_gl.scene.viewpoint import View

from ..support import given_values as values

FRAME = ps.Frame(np.zeros((4, 5, 3), np.uint8), np.ones((4, 5)), ps.Camera(9, 9, 2, 2, 5, 4))
CORNERS, FACES = np.array([(0, 0, 1), (1, 0, 1), (0, 1, 1)], float), np.array([(0, 1, 2)])
MADE = {  # what is made, with the words that name each argument in an error where its own name does not
    ps.Camera: ({"fx": 9, "fy": 9, "cx": 3, "cy": 3, "width": 8, "height": 8}, {}),
    ps.Camera.from_fov: ({"fov_y_degrees": 60, "width": 8, "height": 8}, {"fov_y_degrees": "fov"}),
    ps.orbit_pose: (
        {"pose": np.eye(4), "pivot": (0, 0, 1), "yaw": 3, "pitch": 4, "dolly": 0.1, "upright": (0, 1, 0)}, {}
    ),
    ps.Frame: ({"color": FRAME.color, "depth": FRAME.depth, "camera": FRAME.camera, "pose": np.eye(4)}, {}),
    ps.Light: (
        {
            "position": (1, 2, 3), "direction": (0, 0, 1), "color": (1, 1, 1), "intensity": 1, "attenuation": (1, 0, 0),
            "cone": (0, 45), "shadow": True, "radius": 0.1, "angle": 0,
        },
        {},
    ),
    ps.Material: ({"ambient": 0.1, "diffuse": 1, "specular": 1, "shininess": 9}, {}),
    ps.Appearance: (dict(ps.Appearance().options), {}),
    ps.Mesh: (
        {
            "positions": CORNERS, "faces": FACES, "normals": CORNERS, "uv": CORNERS[:, :2], "color": (1, 1, 1),
            "texture": np.zeros((2, 2, 3), np.uint8), "material": ps.Material(), "shading": "flat",
        },
        {},
    ),
    ps.PointObject: ({"frame": FRAME, "material": ps.Material(), "others": ()}, {}),
    ps.Node: (
        {"content": None, "name": "a", "transform": np.eye(4), "children": (), "visible": True, "shadow": True}, {}
    ),
    ps.Scene: ({"nodes": (), "camera": FRAME.camera, "pose": np.eye(4), "ambient": (0, 0, 0)}, {}),
    ps.PointCloud: (
        {
            "positions": CORNERS, "normals": CORNERS, "colors": np.zeros((3, 3), np.uint8), "sizes": np.ones(3),
            "confidence": np.ones(3), "origin": np.zeros(3), "up": "z", "seen_from": np.zeros(3),
            "material": ps.Material(), "shading": "none", "splat": "ball", "point_size": "2x",
        },
        {},
    ),
    View: (
        {"lights": (), "yaw": 1, "pitch": 2, "dolly": 0, "picture_size": None, "look": ps.Appearance()},
        {"lights": "light"},
    ),
    OutputSettings: ({"samples": 2, "background": "white", "ground": False}, {}),
}  # fmt: skip
ODD = st.one_of(
    st.sampled_from([
        None, True, b"", "", "a\nb", "nan", "white", object(), {}, [], [[]], [[1], [1, 2]], {1: 2}, 1j, 10**400,
        float("nan"), float("inf"), -(10**400), 0, -1, 0.5, 1e308, 5e-324, (0, 0, 0), (1, 2), (np.nan,) * 3, range(3),
        np.array(1), np.array([]), np.array(["a"]), np.array([None]), np.zeros((4, 5)), np.full((4, 4), np.nan),
        np.zeros((0, 3)), np.array([1, 2, 3], ">i2"), np.array(["2020-01-01"], "M8[D]"), np.zeros(2, "f4,i4"),
        np.eye(4) * 1e300, np.zeros((4, 5, 3), complex), np.float32(1), type, ps.Light, FRAME, ps.Camera, lambda: 0,
    ]),
    st.floats(),
    st.integers(-(2**70), 2**70),
    st.text(max_size=5),
    st.lists(st.floats(), max_size=5),
)  # fmt: skip


@given(st.sampled_from(list(MADE)), st.data())
def test_an_odd_argument_is_taken_or_named_in_one_sentence(make, data):
    plain, words = MADE[make]
    name = data.draw(st.sampled_from(list(plain)))
    try:
        make(**plain | {name: data.draw(ODD)})
    except (TypeError, ValueError) as error:
        said = str(error)
        assert words.get(name, name) in said, said
        assert "\n" not in said and len(said) < 300


@given(st.data())
def test_a_frame_holds_the_same_however_its_arrays_are_stored(data):
    shape = data.draw(values.shapes)
    depth, color = data.draw(values.depths(shape)), data.draw(values.colors(shape))
    camera = data.draw(values.cameras(shape))
    plain = ps.Frame(color, depth, camera)
    passed = [values.stored(array, data.draw(st.sampled_from(values.WAYS))) for array in (depth, color)]
    before = [np.array(array) for array in passed]
    frame = ps.Frame(passed[1], passed[0], camera)
    for array, expected in ((frame.depth, plain.depth), (frame.color, plain.color)):
        np.testing.assert_array_equal(array, expected)
        assert type(array) is np.ndarray and array.dtype == expected.dtype and array.dtype.isnative
        assert array.flags.c_contiguous and array.flags.aligned and not array.flags.writeable
    for array, expected in zip(passed, before, strict=True):
        np.testing.assert_array_equal(array, expected)


@given(values.shapes.flatmap(values.depths), st.sampled_from(["e", "f", "d", "g"]))
def test_depth_of_every_precision_is_the_same_where_all_can_write_it(depth, kind):
    with np.errstate(over="ignore"):
        short = depth.astype(np.float16)
    camera = ps.Camera(9, 9, 3, 3, *depth.shape[::-1])
    expected = np.where((short > 0) & (short < np.inf), short, 0).astype(np.float32)
    np.testing.assert_array_equal(ps.Frame(None, short.astype(kind), camera).depth, expected)


@pytest.mark.parametrize("kind", ["?", "b", "B", ">u2", "i4", "u8", "F", "S3", "U3", "O", "M8[s]", "m8[s]", "f4,f4"])
def test_depth_of_other_kinds_is_named(kind):
    with pytest.raises(TypeError, match=r"^depth (is|must be) [^\n]*$"):
        ps.Frame(None, np.ones((3, 4)).astype(kind), ps.Camera(9, 9, 1, 1, 4, 3))


@given(values.shapes.flatmap(values.depths), st.data())
def test_what_a_frame_tells_of_itself_holds_for_its_points(depth, data):
    frame = ps.Frame(None, depth, data.draw(values.cameras(depth.shape)), data.draw(values.poses()))
    v, u = np.nonzero(frame.depth)
    left, top, right, bottom = frame.box
    near, far = frame.depth_range
    known = frame.depth[v, u]
    assert frame.points_known == len(u)
    if not len(u):
        assert frame.box == (0, 0, 0, 0) and len(frame.corners) == 0 and (near, far) == (0, 0)
    else:
        assert (left, top, right, bottom) == (u.min(), v.min(), u.max() + 1, v.max() + 1)
        assert (near, far) == (known.min(), known.max())
        points = points_of(frame)
        reach = 1e-9 * np.abs(frame.corners).max()
        assert (points >= frame.corners.min(0) - reach).all() and (points <= frame.corners.max(0) + reach).all()
        assert frame.scale > 0
    assert np.isfinite(frame.pivot).all() and np.isfinite(frame.main_corners).all()
    assert isinstance(frame.is_sparse, bool) and repr(frame).startswith("Frame(")


def points_of(frame):
    """(n, 3) camera axes."""
    v, u = np.nonzero(frame.depth)
    z, c = frame.depth[v, u].astype(float), frame.camera
    return np.stack([(u - c.cx) / c.fx * z, (v - c.cy) / c.fy * z, z], -1)


@given(values.shapes.flatmap(values.cameras), values.sides, values.sides)
def test_a_resized_camera_sees_the_same(camera, width, height):
    other = camera.resized(width, height)
    for u, v in ((-0.5, -0.5), (camera.width - 0.5, camera.height - 0.5)):
        x, y = (u + 0.5) / camera.width * width - 0.5, (v + 0.5) / camera.height * height - 0.5
        ray, same = (u - camera.cx) / camera.fx, (x - other.cx) / other.fx
        assert same == pytest.approx(ray, rel=1e-9, abs=1e-9 * max(1, abs(camera.cx) / camera.fx))
        ray, same = (v - camera.cy) / camera.fy, (y - other.cy) / other.fy
        assert same == pytest.approx(ray, rel=1e-9, abs=1e-9 * max(1, abs(camera.cy / camera.fy)))
    back = other.resized(camera.width, camera.height)
    np.testing.assert_allclose(back.intrinsics, camera.intrinsics, rtol=1e-9, atol=1e-9)


@given(values.shapes.flatmap(values.cameras), values.sides, values.sides)
def test_a_fitted_camera_keeps_shapes_and_shows_the_whole_view(camera, width, height):
    other = camera.fitted(width, height)
    assert other.fx / other.fy == pytest.approx(camera.fx / camera.fy)
    for u, v in ((-0.5, -0.5), (camera.width - 0.5, camera.height - 0.5)):
        x = (u - camera.cx) / camera.fx * other.fx + other.cx
        y = (v - camera.cy) / camera.fy * other.fy + other.cy
        assert -0.5 - 1e-6 <= x <= width - 0.5 + 1e-6 and -0.5 - 1e-6 <= y <= height - 0.5 + 1e-6


@given(st.floats(1e-6, 179.9), values.sides, values.sides)
def test_a_camera_has_the_field_of_view_that_it_was_made_of(fov, width, height):
    camera = ps.Camera.from_fov(fov, width, height)
    assert 2 * np.degrees(np.arctan(height / 2 / camera.fy)) == pytest.approx(fov, rel=1e-6)


turns = st.floats(-720, 720)


@given(values.poses(), st.tuples(*[st.floats(-5, 5)] * 3), turns, st.floats(-89, 89), st.floats(-9, 0.99))
def test_an_orbit_keeps_its_pivot_in_place(pose, pivot, yaw, pitch, dolly):
    turned = ps.orbit_pose(pose, pivot, yaw, pitch, dolly)
    check_pose(turned)
    before, after = (np.linalg.inv(p) @ (*pivot, 1) for p in (pose, turned))
    np.testing.assert_allclose(after[:3], (1 - dolly) * before[:3], atol=1e-9)


@given(
    values.poses(), st.tuples(*[st.floats(-5, 5)] * 3), turns, st.sampled_from([None, (0, 1, 0), (0, 0, -9), (1, 2, 3)])
)
def test_an_orbit_is_undone_by_its_opposite(pose, pivot, yaw, upright):
    there = ps.orbit_pose(pose, pivot, yaw, upright=upright)
    np.testing.assert_allclose(ps.orbit_pose(there, pivot, -yaw, upright=upright), pose, atol=1e-9)


@given(values.poses(), st.data())
def test_a_pose_that_is_none_is_refused(pose, data):
    bad = pose.copy()
    how = data.draw(st.sampled_from(["scaled", "mirrored", "sheared", "not finite", "last row", "shape"]))
    if how == "scaled":
        bad[:3, :3] *= data.draw(st.sampled_from([0.0, 0.5, 1.02, 1000.0]))
    elif how == "mirrored":
        bad[:3, data.draw(st.integers(0, 2))] *= -1
    elif how == "sheared":
        bad[:3, 0] += 0.1 * bad[:3, 1]
    elif how == "not finite":
        bad[data.draw(st.integers(0, 3)), data.draw(st.integers(0, 3))] = data.draw(st.sampled_from([np.nan, np.inf]))
    elif how == "last row":
        bad[3, data.draw(st.integers(0, 3))] += 1e-3
    else:
        bad = bad[:3]
    with pytest.raises(ValueError, match=r"^pose [^\n]*$"):
        check_pose(bad)


@given(st.lists(values.lights(), max_size=4), values.poses(1e6))
def test_the_rows_of_lights_are_finite(lights, pose):
    rows = light_rows([at_upper_left(light, pose) for light in lights], pose)
    assert rows.shape == (len(lights), 5, 4) and rows.dtype == np.float32 and np.isfinite(rows).all()
    for light, row in zip(lights, rows, strict=True):
        assert row[0, 3] == (light.position is not None)
