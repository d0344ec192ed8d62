"""Depth between two planes: buffers of OpenGL, reversed depth, and what is neither."""

import json

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps

from ..support.rooms import corner, misread, room, stretched

CAMERA = ps.Camera(262.5, 262.5, 159.5, 119.5, 320, 240)
VIEWS = [(0.2, 0, 0), (-0.6, 0.35, 0.1), (0.5, -0.3, -0.15), (-0.3, 0.2, 0)]  # yaw, pitch, roll


def buffer(z, near=0.1, far=100.0):
    """What OpenGL keeps, 0 to 1."""
    return (far / (far - near)) * (1 - near / z)


def read(depth, color=None, **options):
    """A frame, and the notes."""
    notes = []
    return ps.load_frame(depth=depth, color=color, **({"intrinsics": CAMERA} | options), notes=notes.append), notes


FORMS = {
    "near .1, far 100": lambda z: np.float32(buffer(z)),
    "near .01, far 10": lambda z: np.float32(buffer(z, 0.01, 10)),
    "near .3, far 8": lambda z: np.float32(buffer(z, 0.3, 8)),
    "planes as close as they can be": lambda z: np.float32(buffer(z, 0.98 * z.min(), 1.02 * z.max())),
    "64 bits": buffer,
    "16 bits": lambda z: np.uint16(np.rint(65535 * buffer(z))),
    "24 bits": lambda z: np.uint32(np.rint((2**24 - 1) * buffer(z))),
    "clip coordinates": lambda z: np.float32(2 * buffer(z) - 1),
    "reversed z": lambda z: np.float32(1 - buffer(z)),
    "background": lambda z: np.float32(np.where(np.arange(240)[:, None] < 30, 1, buffer(z))),
    "background, 16 bits": lambda z: np.uint16(np.where(np.arange(240)[:, None] < 30, 65535, 65535 * buffer(z))),
    "noise": lambda z: np.float32(buffer(z * (1 + 0.003 * np.random.default_rng(1).standard_normal(z.shape)))),
}


@pytest.mark.parametrize("view", VIEWS[:3])
@pytest.mark.parametrize("form", FORMS)
def test_a_depth_buffer_is_known_by_its_planes_and_its_sign_by_right_angles(form, view):
    color, z, seen = corner(*view)
    frame, notes = read(FORMS[form](z), color)
    assert misread(frame, z, seen) == []
    (told,) = [note for note in notes if "depth buffer" in note and "near" in note]
    assert "far" in told and "pass near and far" in told and "unit is a guess" in told
    if "background" in form:
        assert (frame.depth[:30] == 0).all() and any("where nothing was drawn" in note for note in notes)


@pytest.mark.parametrize("scale", [0.2, 8.0], ids=["a table", "a street"])
def test_a_buffer_of_any_scene_is_right_up_to_its_unit(scale):
    color, z, seen = corner(0.4, 0.25, 0, scale=scale)
    for near, far in ((0.01, 50.0), (0.1, 1000.0)):
        frame, _ = read(np.float32(buffer(z, near, far)), color)
        assert misread(frame, z, seen) == []


def test_a_camera_that_is_not_known_is_no_reason_to_turn_a_buffer_round():
    color, z, _ = corner(-0.6, 0.35, 0.1)
    frame, notes = read(np.float32(buffer(z)), color, intrinsics=None)
    assert np.corrcoef(frame.depth.ravel(), z.ravel())[0, 1] > 0.98 and any("depth buffer" in note for note in notes)


@pytest.mark.parametrize("form", ["near .1, far 100", "64 bits", "16 bits", "24 bits", "background"])
def test_near_and_far_make_metres_of_a_buffer(form):
    _, z, _ = corner()
    frame, notes = read(FORMS[form](z), near=0.1, far=100)
    known = frame.depth > 0
    np.testing.assert_allclose(frame.depth[known], z[known], rtol=2e-3)
    assert known.mean() > 0.85 and not any("guess" in note for note in notes)


def test_below_0_are_clip_coordinates():
    _, z, _ = corner()
    frame, _ = read(np.float32(2 * buffer(z, 0.9 * z.min(), 9) - 1), near=0.9 * z.min(), far=9)
    np.testing.assert_allclose(frame.depth, z, rtol=1e-5)


@pytest.mark.parametrize(
    "names", [("near", "far"), ("znear", "z_far"), ("nearVal", "farVal"), ("near_plane", "far_plane")]
)
def test_near_and_far_may_stand_in_the_cameras_file(tmp_path, names):
    _, z, _ = corner()
    camera = {"fx": 262.5, "fy": 262.5, "cx": 159.5, "cy": 119.5, "width": 320, "height": 240}
    (tmp_path / "camera.json").write_text(json.dumps(camera | dict(zip(names, (0.2, 15.0), strict=True))))
    np.save(tmp_path / "depth.npy", np.float32(buffer(z, 0.2, 15)))
    notes = []
    frame = ps.load_frame(tmp_path, notes=notes.append)
    np.testing.assert_allclose(frame.depth, z, rtol=1e-4)
    assert any("near 0.2 m, far 15 m (as given)" in note for note in notes)
    np.save(tmp_path / "depth.npy", np.float32(z))  # of metres they say nothing
    np.testing.assert_array_equal(ps.load_frame(tmp_path, notes=[].append).depth, np.float32(z))


def test_reversed_z_has_near_and_far_exchanged_and_far_may_be_infinite():
    _, z, _ = corner()
    frame, _ = read(np.float32(0.1 / z), near=np.inf, far=0.1)
    np.testing.assert_allclose(frame.depth, z, rtol=1e-5)
    frame, _ = read(1 - 0.1 / z, near=0.1, far=np.inf, depth_kind="buffer")
    np.testing.assert_allclose(frame.depth, z, rtol=1e-5)


def test_one_plane_alone_gives_the_unit():
    _, z, _ = corner()
    for given in ({"near": 0.1}, {"far": 100}):
        frame, notes = read(np.float32(buffer(z)), **given)
        np.testing.assert_allclose(frame.depth, z, rtol=0.02)
        assert any("read as a depth buffer" in note for note in notes)


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("form", ["float", "16 bits", "8 bits", "noise"])
def test_linear_depth_in_which_white_is_near_is_known_by_its_planes(form, view):
    color, z, seen = corner(*view)
    seen_z = z * (1 + 0.003 * np.random.default_rng(1).standard_normal(z.shape)) if form == "noise" else z
    grey = (seen_z.max() - seen_z) / np.ptp(seen_z)
    raw = stretched(grey, 255 if form == "8 bits" else 65535) if "bits" in form else np.float32(grey)
    frame, notes = read(raw, color)
    assert misread(frame, z, seen) == []
    assert any("white is near" in note and "pass near and far" in note for note in notes)


@pytest.mark.parametrize("view", VIEWS[:3])
@pytest.mark.parametrize("form", ["1 - z/10", "65535 - mm"])
def test_reversed_depth_need_not_fill_its_range(form, view):
    color, z, seen = corner(*view)
    frame, notes = read(np.float32(1 - z / 10) if form == "1 - z/10" else np.uint16(65535 - 1000 * z), color)
    assert misread(frame, z, seen) == [] and any("white is near" in note for note in notes)


def test_reversed_depth_is_metric_with_its_planes():
    _, z, _ = corner()
    frame, _ = read(np.uint16(np.rint((6 - z) / 5 * 65535)), depth_kind="reversed", near=1, far=6)
    np.testing.assert_allclose(frame.depth, z, atol=1e-4)


def test_a_picture_without_planes_that_is_said_to_be_reversed_is_laid_between_1_and_10_metres():
    raw = np.random.default_rng(0).random((240, 320), np.float32)
    frame, notes = read(raw, depth_kind="reversed")
    assert frame.depth.min() >= 1 and frame.depth.max() <= 10 and any("nothing shows" in note for note in notes)


@pytest.mark.parametrize("missing", [0.0, np.nan, -np.inf])
def test_negative_z_is_turned_and_said(missing):
    _, z, _ = corner()
    raw = np.float32(-z)
    raw[:20] = missing
    frame, notes = read(raw)
    np.testing.assert_array_equal(frame.depth[20:], np.float32(z[20:]))
    assert not frame.depth[:20].any() and any("its sign is turned" in note for note in notes)


def test_all_frames_of_a_sequence_are_read_like_the_first(tmp_path):
    np.savetxt(tmp_path / "intrinsics.txt", [[262.5, 0, 159.5], [0, 262.5, 119.5], [0, 0, 1]])
    for k in range(3):
        color, z, _ = corner(0.2 + 0.1 * k, 0.1)
        np.save(tmp_path / f"depth_{k}.npy", np.float32(buffer(z)))
        Image.fromarray(color).save(tmp_path / f"color_{k}.png")
    for k, frame in enumerate(ps.open_source(tmp_path, notes=[].append)):
        z = corner(0.2 + 0.1 * k, 0.1)[1]
        assert np.ptp(frame.depth / z) < 0.02 * np.median(frame.depth / z)


ORDINARY = {
    "metres": lambda z: np.float32(z),
    "metres of a table": lambda z: np.float32(z / 10),
    "metres below 1": lambda z: np.float32(0.99 * z / z.max()),
    "millimetres": lambda z: np.uint16(1000 * z),
    "TUM's": lambda z: np.uint16(5000 * z),
    "far away, 16 bits": lambda z: np.uint16(256 * (z * 20 + 100)),
    "clipped at 1 m": lambda z: np.float32(np.minimum(z / 2, 1)),
    "infinite sky": lambda z: np.where(np.arange(len(z))[:, None] < 30, np.inf, z).astype(np.float32),
    "a few below 0": lambda z: np.float32(np.where(np.random.default_rng(0).random(z.shape) < 0.1, -1, z)),
}


@pytest.mark.parametrize("form", ORDINARY)
@pytest.mark.parametrize("scene", ["corner", "room"])
def test_ordinary_depth_is_no_buffer_and_not_reversed(form, scene):
    z = corner()[1] if scene == "corner" else room(240, 320)
    _, notes = read(ORDINARY[form](z))
    assert not [note for note in notes if "depth buffer" in note or "white is near" in note or "sign" in note]


RELATIVE = {
    "1/z": lambda z: np.float32(1 / z),
    "of a network": lambda z: np.float32(8 / z + 3),
    "0 to 1": lambda z: np.float32((1 / z - (1 / z).min()) / np.ptp(1 / z)),
    "16 bits": lambda z: stretched(1 / z, 65535),
    "8 bits": lambda z: stretched(1 / z),
    "below 0": lambda z: np.float32(3 / z - 2),
}


@pytest.mark.parametrize("form", RELATIVE)
@pytest.mark.parametrize("view", VIEWS)
def test_inverse_depth_keeps_its_direction(form, view):
    color, z, _ = corner(*view)
    frame, _ = read(RELATIVE[form](z), color)
    known = frame.depth > 0
    assert np.corrcoef(1 / frame.depth[known], 1 / z[known])[0, 1] > 0.98


@pytest.mark.parametrize("value", [0.8, 1.0, 3.0])
def test_a_constant_depth_raises_a_suspicion(value):
    _, notes = read(np.full((240, 320), value, np.float32))
    assert any("is it the right file and the right channel" in note for note in notes)
    assert not any("right channel" in note for note in read(np.float32(corner()[1]))[1])


@pytest.mark.parametrize("has_background", [True, False])
def test_values_just_below_1_without_planes_raise_a_suspicion(has_background):
    v, u = np.mgrid[-1:1:240j, -1.3:1.3:320j]
    z = 3 - np.sqrt((1 - u * u - v * v).clip(0))
    ball = np.where((u * u + v * v < 0.5) | (not has_background), buffer(z), 1)
    _, notes = read(np.float32(ball))
    assert any("just below 1" in note and "depth_kind='buffer'" in note for note in notes)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"near": -1}, "near must be a finite number above 0"),
        ({"near": 1, "far": 1}, "near and far must differ"),
        ({"near": 1, "far": 9, "depth_kind": "ray"}, "near is of depth between two planes, not depth_kind='ray'"),
        ({"depth_kind": "buffer", "depth": np.float32([[2e5, 3], [4, 5]])}, "expected values from 0 to 1"),
    ],
)
def test_impossible_planes_are_refused(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        ps.load_frame(**({"depth": np.float32(corner()[1]), "fov": 60} | options), notes=[].append)
