"""Splats: the picture's own camera, sizes, rims of the picture, the driver's limit."""

import numpy as np
import pytest

import pointshade_gl as ps

from ..support import frames

CAMERA = ps.Camera(100, 100, 31.5, 23.5, 64, 48)


def one_point(u, v, z=1.0):
    depth = np.zeros((48, 64), np.float32)
    depth[v, u] = z
    return ps.Frame(np.full((48, 64, 3), 200, np.uint8), depth, CAMERA)


def drawn(image):
    return image[..., 3] > 0


@pytest.mark.parametrize("splat", ["footprint", "round"])
@pytest.mark.parametrize("make", [frames.sphere_before_wall, frames.holes, frames.step, frames.single_pixel])
def test_the_own_camera_reproduces_the_picture_exactly(renderer, make, splat):
    frame = make()
    image = renderer.render(frame, shading="none", splat=splat)
    known = frame.depth > 0
    assert (drawn(image) == known).all()
    assert (image[known][:, :3] == frame.color[known][:, :3]).all()


def test_the_first_row_of_the_frame_is_the_first_row_of_the_picture(renderer):
    rows, columns = np.nonzero(drawn(renderer.render(one_point(5, 3))))
    assert (rows.tolist(), columns.tolist()) == ([3], [5])


def test_a_size_is_measured_in_source_pixels_and_carried_into_the_view(renderer):
    image = renderer.render(one_point(31, 23), point_size=3.0, camera=CAMERA.resized(128, 96))
    assert drawn(image).sum() == 36  # 3x3 source pixels at twice the scale, the margin of 0.1 adds no centre


def test_a_size_array_sets_each_point(renderer):
    depth = np.zeros((48, 64), np.float32)
    depth[24, [10, 30, 50]] = 1
    frame = ps.Frame(None, depth, CAMERA)
    sizes = np.ones((48, 64))
    sizes[24, 30], sizes[24, 50] = 5, 0
    visible = drawn(renderer.render(frame, point_size=sizes))
    assert (visible[:, :20].sum(), visible[:, 20:40].sum(), visible[:, 40:].sum()) == (1, 25, 0)


def test_round_splats_are_round(renderer):
    image = drawn(renderer.render(one_point(31, 23), point_size=20.0, splat="round"))
    across, down = image.any(0).sum(), image.any(1).sum()
    assert across == down
    assert image.sum() == pytest.approx(np.pi / 4 * across * down, rel=0.06)


@pytest.mark.parametrize(("u", "v"), [(0, 23), (63, 23), (31, 0), (31, 47), (0, 0)])
def test_a_splat_whose_centre_left_the_picture_still_shows_its_part(renderer, u, v):
    """The camera moves sideways by 6 pixels; splats of 21 pixels still reach 4 pixels into the picture."""
    shift = np.array([(-6 if u == 63 else 6 if u == 0 else 0) / 100, (6 if v == 0 else -6 if v == 47 else 0) / 100])
    pose = np.eye(4)
    pose[:2, 3] = shift
    visible = drawn(renderer.render(one_point(u, v), point_size=21.0, pose=pose))
    columns, rows = visible.any(0).sum(), visible.any(1).sum()
    assert columns == (21 if u == 31 else 5) and rows == (21 if v == 23 else 5)


def test_a_splat_far_outside_draws_nothing(renderer):
    pose = np.eye(4)
    pose[0, 3] = 10
    assert not drawn(renderer.render(one_point(31, 23), point_size=21.0, pose=pose)).any()


def test_a_splat_above_the_drivers_largest_point_is_cut_to_it(renderer):
    limit = int(renderer.context.limits()["largest point"])
    side = limit + 101
    camera = ps.Camera(100, 100, (side - 1) / 2, (side - 1) / 2, side, side)
    depth = np.zeros((side, side), np.float32)
    depth[side // 2, side // 2] = 1
    visible = drawn(renderer.render(ps.Frame(None, depth, camera), point_size=float(side)))
    columns = np.nonzero(visible.any(0))[0]
    assert abs(len(columns) - limit) <= 1
    assert abs(columns.mean() - side // 2) <= 1  # still in the middle


def test_the_nearest_splat_wins_whatever_the_order(renderer):
    for first, second in ((1.0, 1.2), (1.2, 1.0)):
        depth = np.zeros((48, 64), np.float32)
        depth[23, 30], depth[23, 32] = first, second
        color = np.zeros((48, 64, 3), np.uint8)
        color[23, 30], color[23, 32] = (255, 0, 0), (0, 255, 0)
        image = renderer.render(ps.Frame(color, depth, CAMERA), shading="none", point_size=7.0)
        assert tuple(image[23, 31, :3]) == ((255, 0, 0) if first < second else (0, 255, 0))


def test_points_behind_the_viewer_are_not_drawn(renderer):
    pose = np.eye(4)
    pose[2, 3] = 1.5
    assert not drawn(renderer.render(one_point(31, 23), pose=pose, point_size=9.0)).any()


def test_an_empty_frame_is_a_transparent_picture(renderer):
    assert not renderer.render(frames.all_missing()).any()


def test_a_frame_of_one_pixel(renderer):
    frame = ps.Frame(np.full((1, 1, 3), 50, np.uint8), np.ones((1, 1), np.float32), ps.Camera(1, 1, 0, 0, 1, 1))
    assert renderer.render(frame, shading="none").tolist() == [[[50, 50, 50, 255]]]
