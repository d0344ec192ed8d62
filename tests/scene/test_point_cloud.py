"""Point clouds as values, and in scenes: what they take, what they refuse in one sentence, where they lie."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.graph import scene_of

from ..support import frames

CLOUD = ps.PointCloud(np.random.default_rng(1).normal(size=(50, 3)))
FRAME = frames.single_pixel()


@pytest.mark.parametrize(
    ("call", "error", "says"),
    [
        (lambda: ps.PointCloud(np.zeros((4, 2))), ValueError, r"positions must have shape \(n, 3\), got \(4, 2\)"),
        (lambda: ps.PointCloud(5), ValueError, r"positions must have shape \(n, 3\), got \(\)"),
        (lambda: ps.PointCloud(None), TypeError, r"positions must be numbers of shape \(n, 3\)"),
        (lambda: ps.PointCloud([(0, np.nan, 0)]), ValueError, "positions must be finite and below .* leave out points"),
        (lambda: ps.PointCloud([(0, 1e30, 0)]), ValueError, "positions must be finite and below"),
        (lambda: ps.PointCloud(np.zeros((4, 3)), np.zeros((3, 3))), ValueError, r"normals must have shape \(4, 3\)"),
        (lambda: ps.PointCloud([(0, 0, 0)], colors=[(0.5, 0, 0)]), TypeError, "colors must be uint8 sRGB, got float64"),
        (lambda: ps.PointCloud([(0, 0, 0)], sizes=[-1]), ValueError, "sizes must not be negative, got -1"),
        (lambda: ps.PointCloud([(0, 0, 0)], sizes=[1, 2]), ValueError, r"sizes must have shape \(1,\), got \(2,\)"),
        (lambda: ps.PointCloud([(0, 0, 0)], origin=(1, 2)), ValueError, r"origin must have shape \(3,\), got \(2,\)"),
        (lambda: ps.PointCloud([(0, 0, 0)], up="w"), ValueError, "unknown up 'w'"),
        (lambda: ps.PointCloud([(0, 0, 0)], shading="flat"), ValueError, "unknown shading 'flat': known are none, ph"),
        (lambda: ps.PointCloud([(0, 0, 0)], splat="round"), ValueError, "unknown splat 'round': known are disc, ball"),
        (lambda: ps.PointCloud([(0, 0, 0)], material=0.5), TypeError, "cloud material must be a Material, got 0.5"),
        (lambda: CLOUD.styled(point_size="3 miles"), ValueError, r"a number of world units, '3px' or '2x' .* got '3 m"),
        (lambda: CLOUD.styled(point_size="-3px"), ValueError, "point_size must be the radius of a point cloud's"),
        (lambda: CLOUD.styled(point_size=-1), ValueError, "point_size must be a number from 0"),
        (lambda: CLOUD.styled(point_size=[1, 2]), TypeError, "point_size must be a number from 0"),
        (lambda: CLOUD.styled(up="z"), TypeError, "a cloud is styled by material, shading, splat, point_size, got up"),
        (lambda: ps.PointObject(CLOUD), TypeError, "a point cloud is no frame: .* put it into a Node of a Scene"),
        (lambda: ps.PointObject([FRAME, CLOUD]), TypeError, "a point cloud is no frame"),
        (lambda: ps.render([CLOUD, CLOUD]), TypeError, "a point cloud is no frame"),
        (lambda: ps.render(CLOUD, normals="star"), ValueError, "normals is for frames, and this is a point cloud"),
        (lambda: ps.render(CLOUD, noise=0.1, flying="snap"), ValueError, "noise, flying are for frames, .* leave them"),
        (lambda: ps.render_depth(CLOUD, upsample="none"), ValueError, "upsample is for frames"),
        (lambda: ps.render(CLOUD, splat="mesh"), ValueError, "unknown splat 'mesh': known are disc, ball"),
        (lambda: ps.render(CLOUD, point_size="fill"), ValueError, "point_size must be the radius of a point cloud's"),
        (lambda: ps.render(CLOUD, shdng=1), TypeError, "unexpected keyword argument 'shdng'"),
        (lambda: ps.render(FRAME, splat="ball"), ValueError, "splat='ball' is of point clouds: a frame takes foot"),
        (lambda: ps.render(FRAME, point_size="3px"), ValueError, "point_size='3px' is of point clouds: a frame takes"),
        (lambda: ps.render(ps.Scene((ps.Node(CLOUD),)), splat="ball"), ValueError, "have a look of their own"),
        (lambda: ps.render_points(CLOUD), TypeError, "frame must be a Frame, got a PointCloud"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_in_one_sentence(renderer, call, error, says):
    with pytest.raises(error, match=says) as caught:
        call()
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 250


def test_float32_stays_and_all_else_is_float64():
    assert ps.PointCloud(np.zeros((2, 3), np.float32)).positions.dtype == np.float32
    for other in (np.zeros((2, 3), int), [(0, 0, 0)], np.zeros((2, 3))):
        assert ps.PointCloud(other).positions.dtype == np.float64
    whole = ps.PointCloud([(4.8e6 + 0.001, 0, 0)])
    assert whole.positions[0, 0] == 4.8e6 + 0.001


def test_what_was_passed_may_change_afterwards():
    places = np.zeros((2, 3))
    made = ps.PointCloud(places)
    places[:] = 7
    assert not made.positions.any() and not made.positions.flags.writeable


def test_a_cloud_that_looks_otherwise_shares_its_points():
    made = ps.PointCloud(
        np.ones((3, 3)), np.ones((3, 3)), sizes=np.ones(3), origin=(1, 2, 3), up="z", seen_from=(0, 0, 1)
    )
    other = made.styled(splat="ball", point_size="3px")
    assert (other.splat, other.point_size, other.shading, other.up) == ("ball", "3px", "phong", "z")
    for name in ("positions", "normals", "sizes", "origin", "seen_from"):
        assert getattr(other, name) is getattr(made, name)
    assert (made.splat, made.point_size) == ("disc", None)
    assert made.is_like(made.styled()) and not made.is_like(other) and not made.is_like(ps.PointCloud(np.ones((3, 3))))
    assert other.styled(splat="disc", point_size=None).is_like(made)


@pytest.mark.parametrize(
    ("size", "rule"),
    [
        (0.2, (0.2, "")),
        ("0.2", (0.2, "")),
        ("2m", (2, "")),
        (" 3PX", (3, "px")),
        ("1.5x", (1.5, "x")),
        (None, (2, "x")),
    ],
)
def test_sizes_and_their_units(size, rule):
    assert CLOUD.styled(point_size=size).radius_rule == rule


def test_bounds_leave_out_strays_and_contain_points_with_their_size():
    places = np.random.default_rng(2).uniform(-1, 1, (5000, 3))
    places[0] = 900
    made = ps.PointCloud(places, origin=(10, 0, 0))
    assert made.corners.max(0) == pytest.approx((910, 900, 900), rel=0.01)
    assert made.main_corners.min(0) == pytest.approx((9, -1, -1), abs=0.1)
    assert made.main_corners.max(0) == pytest.approx((11, 1, 1), abs=0.1)
    assert made.styled(point_size=0.5).main_corners.max(0) == pytest.approx((11.5, 1.5, 1.5), abs=0.05)
    sized = ps.PointCloud(places[1:], sizes=np.full(4999, 0.25))
    assert sized.corners.min(0) == pytest.approx((-1.25,) * 3, abs=0.01)
    assert ps.PointCloud(np.zeros((0, 3))).main_corners.shape == (0, 3)
    assert sized.styled(point_size="4px").corners.min(0) == pytest.approx((-1,) * 3, abs=0.01)


def test_a_scene_names_its_clouds_and_stands_as_they_do():
    node = ps.Node(ps.PointCloud(CLOUD.positions, up="z"), "scan")
    scene = ps.Scene((node, ps.Node(CLOUD)))
    assert repr(scene) == "Scene(2 nodes: 100 points in 2 clouds)" and scene.points_known == 100
    assert scene.upright.tolist() == [0, 0, 1]
    turned = ps.orbit_pose(None, (0, 0, 0), 0, 30)
    moved = ps.Scene((ps.Node(node.content, transform=turned),))
    assert moved.upright == pytest.approx(turned[:3, 2])
    assert repr(node) == "Node('scan', PointCloud(50 points))"


@pytest.mark.parametrize("up", ["x", "y", "z", "-x", "-y", "-z"])
def test_a_cloud_alone_is_seen_upright_and_whole(up):
    rng = np.random.default_rng(5)
    made = ps.PointCloud(rng.uniform(-1, 1, (2000, 3)) * (3, 1, 2), up=up, origin=(5, 5, 5))
    scene = scene_of(made)
    assert scene.pose[:3, 1] @ made.up_direction < -0.85
    places = made.positions + made.origin
    x, y = scene.camera.project(places, scene.pose).T
    inside = (x > 0) & (x < 639) & (y > 0) & (y < 479)
    assert inside.mean() > 0.995
    assert max(np.ptp(x) / 640, np.ptp(y) / 480) > 0.7, "it fills the picture"
