"""Pictures whose colours are no light: what they stand for, and that no light changes them."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.depth.depth_files import ramp
from pointshade_gl.scene.values import BLUE, SHOWS, scale_of_depths

from ..support import frames
from ..support.view_sets import pose_at, replaced

BETWEEN = pose_at(7)
NUMBERS = SHOWS[1:]
CERTAIN = ramp("turbo")[round(255 * BLUE)].astype(int)  # where the colours begin


def red(picture):
    """(h, w) where a picture has the upper end of turbo."""
    r, g, b, a = np.moveaxis(picture.astype(int), -1, 0)
    return (a > 0) & (r > 100) & (g < 60) & (b < 40)


@pytest.mark.parametrize("show", NUMBERS)
def test_light_shading_and_exposure_change_nothing(renderer, show):
    frame = frames.sphere_before_wall()
    one = renderer.render(frame, show=show)
    light = ps.Light(position=(1, -1, 0), shadow=True)
    around = {"environment": "sky", "ambient_occlusion": True, "exposure": 2, "tone": "neutral"}
    assert (renderer.render(frame, light, shading="flat", unlight=True, show=show, **around) == one).all()
    assert (renderer.render(frame, show="light") != one).any()


@pytest.mark.parametrize("show", NUMBERS)
def test_a_refined_picture_is_the_one_that_was_asked_for_at_once(renderer, show):
    frame = frames.sphere_before_wall()
    for samples in (1, 2, 4):
        refined = renderer.render(frame, show=show, samples=samples, pose=BETWEEN)
    with ps.Renderer() as other:
        assert (other.render(frame, show=show, samples=4, pose=BETWEEN) == refined).all()


def test_light_comes_back_after_them_to_the_bit(renderer):
    frame = frames.sphere_before_wall()
    before = renderer.render(frame, samples=4)
    for show in NUMBERS:
        renderer.render(frame, samples=4, show=show)
    assert (renderer.render(frame, samples=4) == before).all()
    assert renderer.color_scale is None


def test_nearly_all_depths_lie_in_the_range_and_its_middle_is_even_in_1_over_z():
    scale = scale_of_depths(np.concatenate([np.linspace(1, 4, 1000), [99.0]]).astype(np.float32))
    assert 1 <= scale.low < 1.1 and 3.9 < scale.high <= 4
    assert 1 / scale.middle == pytest.approx((1 / scale.low + 1 / scale.high) / 2)
    assert scale_of_depths(np.zeros(0, np.float32)).show == "depth"


def test_a_flat_wall_and_nothing_in_view_have_depths_in_colours(renderer):
    wall = ps.Frame(None, np.full((20, 30), 2, np.float32), ps.Camera(30, 30, 15, 10, 30, 20))
    assert (renderer.render(wall, show="depth")[..., 3] == 255).all()
    assert renderer.color_scale == ("depth", 2, 2)
    away = ps.orbit_pose(None, (0, 0, 0), 180)
    assert not renderer.render(wall, show="depth", pose=away).any()


def test_what_no_view_is_trusted_for_is_red_where_it_closes_holes(renderer):
    """A piece of the last view hangs before the ball, which the others see through; from aside it stands alone."""
    ball = frames.sphere()
    middle = ball.depth.shape[0] // 2, ball.depth.shape[1] // 2
    spoilt = ball.depth.copy()
    piece = tuple(slice(at - 6, at + 7) for at in middle)
    spoilt[piece] = 0.7 * ball.depth[middle]
    aside = ps.orbit_pose(None, (0, 0, ball.depth[middle]), 40)
    found = []
    for views in ([ball, ball, ball], [ball, ball, replaced(ball, depth=spoilt)]):
        picture = renderer.render(views, show="certainty", normals="star", pose=aside, camera=frames.CAMERA)
        found.append(np.count_nonzero(red(picture)))
        assert np.abs(np.median(picture[picture[..., 3] > 0][:, :3], 0) - CERTAIN).max() < 35
    assert found[1] > found[0] + 50  # beside what is seen flat at the outline


def test_without_a_normal_nothing_is_certain_and_depth_is_shown(renderer):
    alone = ps.PointCloud(np.array([[0, 0, 2.0], [0.5, 0, 2.0], [0, 0.5, 2.0]]), point_size="40px")
    assert renderer.render(alone, show="depth").any()


def test_scenes_show_all_their_objects(renderer):
    floor = ps.Mesh([(-2, 0.4, 0.5), (2, 0.4, 0.5), (2, 0.4, 4), (-2, 0.4, 4)], [(0, 2, 1), (0, 3, 2)])
    parts = ps.Node(ps.PointObject(frames.sphere(), shading="none")), ps.Node(floor)
    scene = ps.Scene(parts, camera=frames.CAMERA)
    picture = renderer.render(scene, show="normals")
    assert tuple(picture[-5, 80]) == pytest.approx((128, 255, 128, 255), abs=1)  # the floor, upwards
    assert renderer.render(scene, show="certainty")[60, 80, 3] == 255


def test_a_camera_whose_y_points_up_sees_the_same_colours(renderer):
    frame, c = frames.sphere(), frames.CAMERA
    upright = ps.Camera(c.fx, -c.fy, c.cx, c.cy, c.width, c.height)
    one, other = (renderer.render(replaced(frame, camera=camera), show="normals") for camera in (c, upright))
    assert np.abs(one.astype(int) - other).max() <= 1


def test_another_word_is_an_error():
    with pytest.raises(ValueError, match="show"):
        ps.OutputSettings(show="nromals")
