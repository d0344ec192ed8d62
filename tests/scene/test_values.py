"""Values stay as they were checked: nobody writes into their arrays, also after copying and pickling."""

import copy
import pickle
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest

import pointshade_gl as ps

CAMERA = ps.Camera(100, 100, 3.5, 2.5, 8, 6)
NORMALS = np.tile((0.0, 0, -1), (6, 8, 1))
NORMALS[0, 0] = np.nan  # missing


def look(**changes):
    arrays = {"normals": NORMALS, "point_size": np.full((6, 8), 2.0), "noise": np.full((6, 8), 0.01)}
    return ps.Appearance(**arrays | changes)


def every_value():
    frame = ps.Frame(np.full((6, 8, 3), 90, np.uint8), np.full((6, 8), 2.0), CAMERA)
    corners, faces, texture = np.eye(3), np.array([(0, 1, 2)]), np.zeros((2, 2, 3), np.uint8)
    mesh = ps.Mesh(corners, faces, corners, corners[:, :2], texture=texture)
    points = ps.PointObject(frame, look=look())
    lamp = ps.Light(position=np.array((1, 2, 3)))
    node = ps.Node((points, mesh, lamp), "a", np.eye(4), [ps.Node(mesh)])
    arrays = {"sizes": np.ones(3), "confidence": np.ones(3), "origin": (1, 2, 3), "seen_from": corners}
    cloud = ps.PointCloud(corners, corners, np.zeros((3, 3), np.uint8), **arrays, up="z", point_size="2x")
    view = ps.View([lamp], np.eye(4), look=look())
    return [
        CAMERA, lamp, ps.Material(), ps.OutputSettings(samples=4), ps.Appearance(), look(), ps.View(), view, frame,
        mesh, cloud, points, node, ps.Scene((node,), CAMERA, np.eye(4)),
    ]  # fmt: skip


def arrays_in(value, name=""):
    if isinstance(value, np.ndarray):
        yield name, value
    elif isinstance(value, tuple):
        for k, part in enumerate(value):
            yield from arrays_in(part, f"{name}[{k}]")
    elif is_dataclass(value):
        for field in fields(value):
            yield from arrays_in(getattr(value, field.name), f"{name}.{field.name}")


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda v: pickle.loads(pickle.dumps(v)), replace])
@pytest.mark.parametrize("value", every_value(), ids=lambda value: type(value).__name__)
def test_a_copy_holds_the_same_and_is_as_read_only(value, again):
    made = again(value)
    assert type(made) is type(value) and repr(made) == repr(value)
    before, after = dict(arrays_in(value)), dict(arrays_in(made))
    assert before.keys() == after.keys()
    for name, array in after.items():
        np.testing.assert_array_equal(array, before[name])
        assert array.dtype == before[name].dtype and not array.flags.writeable, name


@pytest.mark.parametrize("make", [lambda k=k: every_value()[k] for k in range(8)])
def test_options_are_equal_if_all_their_numbers_are(make):
    one, other = make(), make()
    assert one == other and hash(one) == hash(other)
    assert one == pickle.loads(pickle.dumps(one)) and {one: 1}[other] == 1
    assert one != "another" and one != ps.Appearance(splat="round")


@pytest.mark.parametrize("name", ["normals", "point_size", "noise"])
def test_looks_differ_by_one_number_of_an_array(name):
    changed = np.array(getattr(look(), name))
    changed[3, 3] *= 1.5
    assert look(**{name: changed}) != look() and ps.View(look=look(**{name: changed})) != ps.View(look=look())
    assert look(**{name: ps.Appearance().noise if name == "noise" else "auto" if name == "normals" else 1}) != look()


def test_views_differ_by_their_pose():
    assert ps.View(pose=np.eye(4)) == ps.View(pose=np.eye(4))
    assert ps.View(pose=ps.orbit_pose(None, (0, 0, 1), 5)) != ps.View(pose=np.eye(4)) != ps.View()


def test_options_keep_what_they_were_given():
    sizes, lights = np.full((6, 8), 2.0), [ps.Light()]
    look, view = ps.Appearance(point_size=sizes), ps.View(lights)
    sizes[:], lights[:] = 5, []
    assert np.max(np.asarray(look.point_size)) == 2
    assert view.lights == (ps.Light(),)


def test_what_is_derived_from_a_frame_is_read_only_and_not_pickled():
    scene = every_value()[-1]
    frame, mesh = scene.nodes[0].content[0].frame, scene.nodes[0].content[1]
    bare = len(pickle.dumps(frame))
    derived = frame.pivot, frame.corners, frame.main_corners, mesh.corners, scene.pivot
    assert not any(array.flags.writeable for array in derived)
    assert frame.points_known and len(pickle.dumps(frame)) == bare


def test_a_copied_frame_is_the_frame_and_another_frame_is_another():
    frame, twin = every_value()[8], every_value()[8]
    assert copy.deepcopy(frame) is frame and {frame: 1, twin: 2}[frame] == 1
