"""Frames: what counts as missing, what is refused and by which message."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.orbit import OrbitStage, State
from pointshade_gl.scene.visible import coarser

CAMERA = ps.Camera(100, 100, 3.5, 2.5, 8, 6)
DEPTH = np.full((6, 8), 2.0, np.float32)
COLOR = np.full((6, 8, 3), 90, np.uint8)


@pytest.mark.parametrize("hole", [0.0, -1.0, np.nan, np.inf, -np.inf, 1e300])
def test_everything_that_is_no_distance_becomes_zero(hole):
    depth = np.full((6, 8), 2.0)
    depth[1, 2] = hole
    frame = ps.Frame(COLOR, depth, CAMERA)
    assert frame.depth.dtype == np.float32
    assert frame.depth[1, 2] == 0
    assert frame.points_known == 47


def test_a_frame_keeps_its_own_copies():
    depth, color = DEPTH.copy(), COLOR.copy()
    frame = ps.Frame(color, depth, CAMERA)
    depth[:], color[:] = 9, 9
    assert frame.depth.max() == 2 and frame.color is not None and frame.color.min() == 90
    with pytest.raises(ValueError, match="read-only"):
        frame.depth[0, 0] = 1


@pytest.mark.parametrize(
    ("rows", "columns", "box"),
    [
        (slice(None), slice(None), (0, 0, 8, 6)),
        (slice(2, 5), slice(1, 7), (1, 2, 7, 5)),
        (slice(0, 6), slice(1, 8), (1, 0, 8, 6)),
        (slice(0, 1), slice(0, 8), (0, 0, 8, 1)),
        (slice(3, 4), slice(7, 8), (7, 3, 8, 4)),
        (slice(0, 6, 5), slice(0, 8, 7), (0, 0, 8, 6)),
        (slice(0), slice(0), (0, 0, 0, 0)),
    ],
)
def test_box_and_depth_range_are_those_of_the_known_points(rows, columns, box):
    depth, known = np.zeros((6, 8)), np.arange(48).reshape(6, 8) + 0.25
    depth[rows, columns] = known[rows, columns]
    frame = ps.Frame(COLOR, depth, CAMERA)
    assert frame.box == box
    assert frame.depth_range == ((depth[depth > 0].min(), depth.max()) if depth.any() else (0, 0))


def test_transparent_colour_cuts_the_point_out():
    color = np.full((12, 16, 4), 255, np.uint8)  # twice the depth's size
    color[:2, :2, 3] = 0
    frame = ps.Frame(color, DEPTH, CAMERA)
    assert frame.depth[0, 0] == 0 and frame.points_known == 47


def test_pivot_and_scale_follow_the_points_and_the_pose():
    pose = np.eye(4)
    pose[:3, 3] = (1, 2, 3)
    frame = ps.Frame(None, DEPTH, CAMERA, pose)
    assert frame.scale == pytest.approx(2)
    assert frame.pivot == pytest.approx((1, 2, 5))


def test_what_a_sensor_lost_does_not_move_the_pivot():
    """A box before a wall: most of the wall is lost, in pieces and in the shadow of the box."""
    camera = ps.Camera(131, 131, 79.5, 59.5, 160, 120)
    depth = np.full((120, 160), 3, np.float32)
    depth[10:115, 30:110] = 1.5
    holed = np.where(np.random.default_rng(2).random(depth.shape) < 0.2, 0, depth)
    holed[:, 110:145] = holed[50:70, :30] = 0
    whole, frame = ps.Frame(None, depth, camera), ps.Frame(None, holed, camera)
    assert np.median(holed[holed > 0]) == 1.5 and frame.pivot == pytest.approx(whole.pivot, abs=0.05)


def test_the_pivot_of_what_was_cut_out_is_that_of_its_points():
    depth = np.zeros((120, 160), np.float32)
    depth[60:80, 100:140], depth[60:80, 110:130] = 2, 0  # an object with a hole, to the right
    frame = ps.Frame(None, depth, ps.Camera(100, 100, 79.5, 59.5, 160, 120))
    v, u = np.nonzero(depth)
    assert frame.pivot == pytest.approx(((np.median(u) - 79.5) / 50, (np.median(v) - 59.5) / 50, 2), abs=0.05)


def test_pivot_of_few_points_between_the_probed_ones_is_found():
    camera = ps.Camera(500, 500, 999.5, 999.5, 2000, 2000)
    depth = np.zeros((2000, 2000), np.float32)
    depth[1001, 1003] = 7
    assert ps.Frame(None, depth, camera).scale == pytest.approx(7)


def test_an_empty_frame_has_scale_one():
    assert ps.Frame(None, np.zeros((6, 8), np.float32), CAMERA).scale == 1


@pytest.mark.parametrize(
    ("color", "depth", "error", "complaint"),
    [
        (COLOR, DEPTH[..., None], ValueError, r"depth must have shape \(h, w\), got \(6, 8, 1\)"),
        (COLOR, DEPTH.astype(np.uint16), TypeError, r"depth is uint16: divide it by its depth_scale"),
        (COLOR, DEPTH > 0, TypeError, "floating point metres, got bool"),
        (COLOR, DEPTH[:3], ValueError, r"camera is for 8x6 pixels, depth is 8x3"),
        (COLOR[..., 0], DEPTH, ValueError, r"color must have shape"),
        (COLOR / 255, DEPTH, TypeError, "color must be uint8 sRGB, got float64: multiply by 255"),
        (COLOR.astype(np.uint16), DEPTH, TypeError, "convert it to 8 bits"),
    ],
)
def test_arrays_that_do_not_fit_are_named(color, depth, error, complaint):
    with pytest.raises(error, match=complaint):
        ps.Frame(color, depth, CAMERA)


def test_a_pose_with_nan_is_named():
    with pytest.raises(ValueError, match="pose must be finite"):
        ps.Frame(COLOR, DEPTH, CAMERA, np.full((4, 4), np.nan))


def test_what_is_read_only_is_not_copied_and_all_else_is():
    color, depth, camera = np.zeros((4, 6, 3), np.uint8), np.ones((4, 6), np.float32), ps.Camera(5, 5, 3, 2, 6, 4)
    copied = ps.Frame(color, depth, camera)
    assert not np.shares_memory(copied.color, color) and not np.shares_memory(copied.depth, depth)
    view = depth[:]
    for array in (color, depth, view):
        array.flags.writeable = False
    assert not np.shares_memory(ps.Frame(color, view, camera).depth, depth)  # its owner could still write
    kept = ps.Frame(color, depth, camera)
    assert kept.color is color and kept.depth is depth


@pytest.mark.parametrize(
    "hide",
    [
        lambda array, hidden: np.ma.masked_array(array, hidden),
        lambda array, hidden: np.ma.masked_array(array, hidden, fill_value=5),
        lambda array, hidden: list(np.ma.masked_array(array, hidden)),  # a list of masked rows
        lambda array, hidden: np.ma.masked_array(array, hidden, hard_mask=True)[:],
    ],
)
def test_masked_depth_is_missing(hide, tmp_path):
    hidden = np.indices(DEPTH.shape).sum(0) % 3 == 0
    depth = hide(DEPTH, hidden)
    assert ((ps.Frame(None, depth, CAMERA).depth == 0) == hidden).all()
    assert ((CAMERA.unproject(depth)[..., 2] == 0) == hidden).all()
    assert ((ps.load_frame(depth=depth, intrinsics=CAMERA).depth == 0) == hidden).all()
    ps.save_depth(tmp_path / "a.npy", depth)
    assert ((np.load(tmp_path / "a.npy") == 0) == hidden).all()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("options", [{"depth_scale": 10}, {"depth_kind": "inverse"}])
def test_masked_depth_of_every_kind_is_missing(dtype, options):
    values = np.arange(20, 68).reshape(DEPTH.shape).astype(dtype)
    hidden = np.indices(DEPTH.shape).sum(0) % 3 == 0
    depth = np.ma.masked_array(values, hidden)[None]  # (1, h, w), as rasterio reads it
    frame = ps.load_frame(depth=depth, intrinsics=CAMERA, notes=lambda _: None, **options)
    assert ((frame.depth == 0) == hidden).all()


def test_an_empty_mask_hides_nothing():
    for mask in (np.ma.nomask, np.zeros(DEPTH.shape, bool)):
        frame = ps.Frame(np.ma.array(COLOR), np.ma.masked_array(DEPTH, mask), CAMERA, np.ma.array(np.eye(4)))
        assert frame.points_known == DEPTH.size and type(frame.depth) is type(frame.color) is np.ndarray


def body(far, share, shape=(60, 80)):
    """A rough body from 1 to 3 m, and this share of the picture above it at a far plane."""
    depth = np.random.default_rng(3).uniform(1, 3, shape)
    depth[: round(share * shape[0])] = far
    return depth, ps.Camera(90, 90, 39.5, 29.5, 80, 60)


@pytest.mark.parametrize("far", [1e10, 65504, 1000])
@pytest.mark.parametrize("share", [0.05, 0.3, 0.5, 0.6, 0.8, 0.95])
def test_a_far_plane_is_a_background_and_a_note_tells_it(far, share, capsys):
    depth, camera = body(far, share)
    frame, expected = ps.Frame(None, depth, camera), ps.Frame(None, np.where(depth == far, 0, depth), camera)
    assert (frame.depth == expected.depth).all()
    assert frame.scale == expected.scale and (frame.main_corners == expected.main_corners).all()
    note = capsys.readouterr().err
    assert note.count("note: ") == 1 and f"the depth {far:g} of {share:.0%} of the points" in note


def test_a_far_plane_mixed_with_its_edges_is_a_background_too():
    depth, camera = body(1e10, 0.6)
    depth[36] = np.linspace(3, 1e10, 80)  # resized with the sky
    frame = ps.Frame(None, depth, camera)
    assert not (frame.depth >= 1e10).any() and 1 < frame.scale < 3 and frame.main_corners.max() < 100


@pytest.mark.parametrize("far", [3, 12, 60])
def test_a_wall_behind_is_kept(far, capsys):
    depth, camera = body(far, 0.6)
    frame = ps.Frame(None, depth, camera)
    assert frame.depth.max() == far and not capsys.readouterr().err
    assert (frame.scale < 3) == (far == 60)  # so far away it is not what is looked at


def test_one_stray_pixel_is_no_background():
    depth, camera = body(1e10, 0)
    depth[0, 0] = 1e10
    assert ps.Frame(None, depth, camera).points_known == depth.size


def test_points_before_the_near_plane_are_told_once(capsys):
    depth, camera = body(2, 0.5)
    depth[-3:] = 1e-4
    frame = ps.Frame(None, depth, camera)
    assert frame.scale == frame.scale > 1
    note = capsys.readouterr().err
    assert note.count("note: ") == 1 and "5% of the points lie before the near plane, at 0.002 m" in note


def test_missing_depth_of_a_read_only_array_becomes_0_in_a_copy():
    depth = np.array([[1, np.nan], [-1, np.inf]], np.float32)
    depth.flags.writeable = False
    assert ps.Frame(None, depth, ps.Camera(5, 5, 1, 1, 2, 2)).depth.tolist() == [[1, 0], [0, 0]]
    assert np.isnan(depth[0, 1])


def bottom(frame):
    """The points of the built-in vase's disc, (n, 3) world."""
    v, u = np.nonzero(frame.depth)
    points = frame.camera.unproject(frame.depth[v, u].astype(float), np.stack([u, v], -1))
    points = points @ frame.pose[:3, :3].T + frame.pose[:3, 3]
    return points[(points - (0, 0, 1)) @ frame.upright < -0.255]


class TestUp:
    """Where up is known, yaw turns about it: a camera that looks down does not lean when it goes round."""

    def test_it_goes_with_the_camera_and_nothing_else_changes(self):
        frame = ps.Frame(COLOR, DEPTH, CAMERA, ps.orbit_pose(None, (0, 0, 2), 30, 10))
        standing = frame.with_up((0, -3, 0))
        assert frame.up is None and frame.upright is None and standing.depth is frame.depth
        np.testing.assert_allclose(standing.upright, (0, -1, 0), atol=1e-12)
        moved = standing.at(ps.orbit_pose(None, (0, 0, 2), 70, 10))
        np.testing.assert_allclose(moved.pose[:3, :3].T @ moved.upright, frame.pose[:3, :3].T @ (0, -1, 0), atol=1e-12)
        assert standing.with_up(None).up is None
        assert replace(frame, up=(0, -2, 0)).up == (0, -1, 0)

    @pytest.mark.parametrize("up", [(0, 0, 0), (0, 1), (0, np.nan, 1), "up"])
    def test_what_is_no_direction_is_refused(self, up):
        with pytest.raises((ValueError, TypeError), match="frame up must"):
            ps.Frame(COLOR, DEPTH, CAMERA).with_up(up)

    @pytest.mark.parametrize("pose", [None, ps.orbit_pose(None, (0.2, 0, 1), 50, -15)])
    @pytest.mark.parametrize("fy", [100, -100])
    def test_command_and_window_turn_about_it(self, pose, fy):
        frame = ps.Frame(COLOR, DEPTH, ps.Camera(100, fy, 3.5, 2.5, 8, 6), pose)
        up = frame.pose[:3, :3] @ (0, -np.sign(fy), -0.3)  # it looks down
        frame, stage = frame.with_up(up), OrbitStage.of(frame.with_up(up))
        turned = ps.View(yaw=40).seen(frame)[1]
        for seen in (turned, frame.pose @ State(yaw=40).pose(stage)):
            assert seen[:3, 0] @ up == pytest.approx(0, abs=1e-12)  # level
            np.testing.assert_allclose(seen, turned, atol=1e-9)

    def test_an_object_of_frames_has_that_of_the_first_and_so_has_its_scene(self):
        turn = ps.orbit_pose(None, (0, 0, 0), yaw=90)
        frame = ps.Frame(COLOR, DEPTH, CAMERA).with_up((0.6, -0.8, 0))
        scene = ps.Scene((ps.Node(ps.PointObject([frame, frame.at(turn)]), transform=turn),))
        np.testing.assert_allclose(scene.upright, turn[:3, :3] @ (0.6, -0.8, 0), atol=1e-12)

    def test_what_it_is_known_to_turn_about_goes_with_it_into_copies_and_scenes(self):
        pose, middle = ps.orbit_pose(None, (0, 0, 2), 30, 10), (0.1, -0.2, 1.5)
        frame = ps.Frame(COLOR, DEPTH, CAMERA, pose).with_up((0, -1, 0), middle)
        scene = ps.Scene((ps.Node(ps.PointObject([frame, frame.at(np.eye(4))])),), CAMERA, pose)
        for one in (frame, coarser(frame, 2), scene):
            np.testing.assert_allclose(one.pivot, middle, atol=1e-12)
        inside = np.linalg.inv(pose) @ (*middle, 1)
        np.testing.assert_allclose(frame.at(np.eye(4)).pivot, inside[:3], atol=1e-12)
        assert frame.with_up((0, -1, 0)).about is None
        assert pickle.loads(pickle.dumps(frame)).about == replace(frame, source=None).about == frame.about is not None
        with pytest.raises(ValueError, match="frame about must"):
            frame.with_up(None, (0, 1))

    def test_the_built_in_vase_turns_about_its_own_axis_whatever_is_seen_of_it(self):
        frames = list(ps.open_source("vase/whole"))
        scene = ps.Scene((ps.Node(ps.PointObject(frames)),), frames[0].camera)
        for one in (ps.load_frame("vase"), *frames, scene):
            np.testing.assert_allclose(one.pivot, (0, 0, 1), atol=1e-6)
        disc = np.concatenate([bottom(one) for one in frames])
        off = disc - (0, 0, 1)
        around = off - np.outer(off @ frames[0].upright, frames[0].upright)
        np.testing.assert_allclose((around.min(0) + around.max(0)) / 2, 0, atol=1e-3)

    def test_the_built_in_vase_stands_and_is_seen_as_before_from_the_front(self, renderer):
        frame = ps.load_frame("vase")
        for one in (frame, *ps.open_source("vase/whole")):
            np.testing.assert_allclose(one.upright, (0, -0.97437, -0.22495), atol=1e-5)  # it is seen from above
        np.testing.assert_array_equal(renderer.render(frame), renderer.render(frame.with_up(None)))
        assert ps.View(yaw=90).seen(frame)[1][:3, 0] @ frame.upright == pytest.approx(0, abs=1e-9)
