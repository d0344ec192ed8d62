"""Normals of point clouds as users read them."""

import numpy as np
import pytest

import pointshade_gl as ps

from ..support.clouds import cloud
from ..support.streets import EYES, street


def test_normals_of_a_cloud_point_outwards(renderer):
    made = cloud("torus", 8000, 60)
    normals = renderer.estimate_normals(ps.PointCloud(made.positions))
    assert normals.shape == (8000, 3) and normals.dtype == np.float32
    cosine = (normals * made.normals).sum(-1)
    assert cosine.min() > 0.9 and cosine.mean() > 0.999


def test_a_cloud_far_from_zero_has_the_same_normals(renderer):
    made = cloud("box", 5000, 61)
    far = made.positions + np.array([4.8e6, 0, 0])
    found = renderer.estimate_normals(ps.PointCloud(far))
    assert np.nanmean((found * made.normals).sum(-1)) > 0.99


def test_points_on_no_surface_are_nan_and_unknown(renderer):
    made = cloud("sphere", 5000, 62)
    alone = np.concatenate([made.positions, [[9, 9, 9]]])
    assert np.isnan(renderer.estimate_normals(ps.PointCloud(alone))[-1]).all()
    known = renderer.with_normals(ps.PointCloud(alone))
    assert not known.normals[-1].any() and known.confidence[-1] == 0
    assert known.confidence[:-1].min() > 0.5 and known.normals[:-1].any(1).all()
    assert renderer.estimate_normals(ps.PointCloud(np.zeros((0, 3)))).shape == (0, 3)


def test_a_cloud_keeps_its_own_normals_and_all_else(renderer):
    made = cloud("sphere", 3000, 63)
    given = -made.normals.astype(np.float32)
    given[::2] = 0
    colors = np.full((3000, 3), 7, np.uint8)
    known = renderer.with_normals(ps.PointCloud(made.positions, given, colors, origin=(1, 2, 3), up="z"))
    np.testing.assert_allclose(known.normals[1::2], given[1::2], atol=1e-6)
    assert ((known.normals * made.normals).sum(-1)[::2] > 0.99).all()
    assert (known.colors == 7).all() and known.up == "z" and known.origin.tolist() == [1, 2, 3]


def test_normals_point_to_the_scanner(renderer):
    made = cloud("sphere", 3000, 64)
    normals = renderer.estimate_normals(ps.PointCloud(made.positions, seen_from=(0, 0, 0)))
    assert ((normals * made.normals).sum(-1) < -0.99).all()


def away_from(normals, positions, eye):
    """Return the share of the known normals that point away from a scanner."""
    known = np.isfinite(normals).all(1)
    return ((normals * (eye - positions)).sum(1)[known] < 0).mean()


@pytest.mark.parametrize("beams", [16, 32, pytest.param(64, marks=pytest.mark.system)])
def test_a_scanner_at_zero_is_found_with_a_note(renderer, beams):
    scan, notes = street(beams) - EYES[0], []
    normals = renderer.estimate_normals(ps.PointCloud(scan, up="z"), notes=notes.append)
    assert away_from(normals, scan, np.zeros(3)) < 0.01
    assert len(notes) == 1 and "as a scanner at 0, 0, 0 sees them" in notes[0] and "seen_from names another" in notes[0]


@pytest.mark.system
@pytest.mark.parametrize("beams", [16, 32, 64])
def test_of_two_scanners_each_point_takes_its_own(renderer, tmp_path, beams):
    scans = [street(beams, 1, eye) for eye in EYES]
    both, eyes = np.concatenate(scans), np.repeat(EYES, [len(scan) for scan in scans], 0)
    np.save(tmp_path / "a.npy", both)
    found = ps.load_cloud(tmp_path / "a.npy", up="z", seen_from=EYES, notes=lambda _: None)
    assert away_from(renderer.estimate_normals(found), both, eyes) < 0.01
    assert away_from(renderer.estimate_normals(ps.PointCloud(both, seen_from=eyes)), both, eyes) == 0


def test_a_sheet_is_said_to_have_no_outside(renderer):
    made, notes = cloud("stairs", 8000, 65), []
    normals = renderer.estimate_normals(ps.PointCloud(made.positions, up="z"), notes=notes.append)
    assert len(notes) == 1 and "no outside" in notes[0] and "up is z" in notes[0]
    assert ((normals * made.normals).sum(-1) > 0).mean() > 0.95
    renderer.estimate_normals(ps.PointCloud(cloud("box", 3000, 66).positions), notes=notes.append)
    assert len(notes) == 1


def test_the_noise_may_be_given(renderer):
    made = cloud("sphere", 5000, 67)
    close = renderer.estimate_normals(ps.PointCloud(made.positions), noise=0)
    wide = renderer.estimate_normals(ps.PointCloud(made.positions), noise=0.05)
    assert np.abs((close * wide).sum(-1)).min() < 0.9999


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"method": "star"}, "method is for frames"),
        ({"max_depth_step": 0.1}, "max_depth_step is for frames"),
        ({"noise": -1}, "noise must be a number from 0"),
    ],
)
def test_options_of_frames_are_refused(renderer, options, complaint):
    with pytest.raises(ValueError, match=complaint):
        renderer.estimate_normals(ps.PointCloud(np.zeros((4, 3))), **options)


def test_only_clouds_get_normals(renderer):
    with pytest.raises(TypeError, match="cloud"):
        renderer.with_normals(np.zeros((4, 3)))
