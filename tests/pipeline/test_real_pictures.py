"""Real frames, rendered: unlit and from their own camera they equal the photograph."""

import numpy as np
import pytest

import pointshade_gl as ps

FRAMES = [
    "realsense_box_2",
    "realsense_box_6",
    "tum_fr3_kinect1",
    "stereo_metal_floor",
    "stereo_skatepark_65520",
    "stereo_glass_reflections",
    "icl_livingroom_23views",
    "d435_table_exr_halffloat",
]

pytestmark = pytest.mark.data


@pytest.mark.parametrize("name", FRAMES)
def test_unlit_from_the_own_camera_the_photograph_comes_back(renderer, shared_data, name):
    frame = ps.load_frame(shared_data / name, notes=lambda _: None)
    image = renderer.render(frame, shading="none")
    known = frame.depth > 0
    close = (np.abs(image[..., :3].astype(int) - frame.color[..., :3]).max(-1) <= 2) & (image[..., 3] == 255)
    assert close[known].mean() >= 0.995
    assert not image[~known].any()


def test_colours_larger_than_depth_are_sampled_at_the_depth_pixels(renderer, shared_data):
    """7.5 colour pixels a depth pixel: the two nearest in each direction, weighted by hand."""
    frame = ps.load_frame(shared_data / "iphone_lidar_promptda", notes=lambda _: None)
    image = renderer.render(frame, camera=frame.camera, shading="none")
    for v, u in ((0, 0), (17, 200), (100, 33), (191, 255)):
        x, y = (u + 0.5) * 7.5 - 0.5, (v + 0.5) * 7.5 - 0.5
        x0, y0 = int(x), int(y)
        square = frame.color[y0 : y0 + 2, x0 : x0 + 2].astype(float)
        across = square[:, 0] * (1 - x + x0) + square[:, 1] * (x - x0)
        expected = across[0] * (1 - y + y0) + across[1] * (y - y0)
        assert np.abs(image[v, u, :3] - expected).max() <= 1


def test_by_default_small_depth_is_drawn_at_the_size_of_its_photograph(renderer, shared_data):
    frame = ps.load_frame(shared_data / "iphone_lidar_promptda", notes=lambda _: None)
    image = renderer.render(frame, shading="none")
    assert image.shape == (1440, 1920, 4) and (image[..., 3] == 255).mean() > 0.9999
    assert (image[..., :3] == frame.color).all(-1).mean() > 0.9999


@pytest.mark.parametrize("name", [*FRAMES, "iphone_lidar_promptda"])
def test_lit_and_turned_nothing_breaks(renderer, shared_data, name):
    frame = ps.load_frame(shared_data / name, notes=lambda _: None)
    image = renderer.render(frame, pose=ps.orbit_pose(None, frame.pivot, 10, 5))
    drawn = image[..., 3] > 0
    assert drawn.mean() > 0.4
    assert 20 < image[drawn][:, :3].mean() < 220
