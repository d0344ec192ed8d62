"""Several frames of one thing as one surface: each part once, nothing lost, and the mean where they agree."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.page.page_surfaces import OVERLAP, Member, merged

BAND = 0.01
CAMERA = ps.Camera(60, 60, 31.5, 23.5, 64, 48)


def wall(shift=0.0, depth=2.0, color=0.5, good=1.0, missing=slice(0, 0)):
    """A frame of a wall, its camera moved to the right."""
    surface = np.zeros((48, 64, 4), np.float32)
    surface[:] = 0, 0, -1, depth
    surface[:, missing, 3] = 0
    pose = np.eye(4)
    pose[0, 3] = shift
    colors = np.full((48, 64, 3), color, np.float32)
    frame = ps.Frame(None, surface[..., 3], CAMERA, pose)
    return Member(surface, colors, np.full((48, 64), good, np.float32), CAMERA, pose), frame


def result(*walls):
    members, frames = zip(*walls, strict=True)
    return merged(members, frames, BAND)


def places(members):
    """Of all points on the wall, in pixels of the first frame."""
    columns = [np.nonzero(one.known)[1] + one.pose[0, 3] * 30 for one in members]
    return np.concatenate(columns)


@pytest.mark.parametrize("goods", [(1.0, 1.0), (0.01, 1.0), (1.0, 0.01)])
def test_each_part_comes_from_one_frame_but_for_the_overlap_and_none_is_lost(goods):
    found = result(wall(good=goods[0]), wall(shift=1.0, good=goods[1]))  # by 30 pixels
    seen, counts = np.unique(places(found), return_counts=True)
    assert np.array_equal(seen, np.arange(64 + 30))
    assert counts.sum() == 48 * (94 + OVERLAP)
    whole = found[int(goods[1] > goods[0])]
    assert whole.known.all()  # of the better one


def test_where_frames_agree_it_is_their_mean():
    first, second = result(wall(depth=2.0, color=0.2), wall(depth=2.004, color=0.4))
    assert first.known.all() and not second.known.any()
    assert np.ptp(first.surface[..., 3]) < 1e-5 and 2.0 < first.surface[0, 0, 3] < 2.004
    assert 0.2 < first.colors[0, 0, 0] < 0.4


def test_other_surfaces_stay_as_they_are():
    near, far = result(wall(depth=1.5, missing=slice(20, 40)), wall(depth=2.0, color=0.4))
    assert np.count_nonzero(near.known) == 48 * 44 and far.known.all()
    assert (far.surface[..., 3] == 2).all() and np.allclose(far.colors, 0.4)


def test_three_frames_of_the_same_never_leave_a_hole():
    """Points that were left out are no reason to leave out others."""
    rng = np.random.default_rng(0)
    walls = [wall() for _ in range(3)]
    walls = [(m._replace(good=rng.random((48, 64)).astype(np.float32)), frame) for m, frame in walls]
    assert np.logical_or.reduce([one.known for one in result(*walls)]).all()
