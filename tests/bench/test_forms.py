"""The benchmark of forms: its truth, its scores, and what it says of splats and meshes."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.command import research
from pointshade_gl.bench.scenes import standard_camera

research("images", "lit_pictures")  # makes its neighbours known
import lit_forms as forms  # noqa: E402
from lit_forms import LARGEST, MIDDLE, Truth, outline, outline_distance, source_frames, trace_seen  # noqa: E402

SOURCE = standard_camera(64, 48)


def truth_at(yaw):
    pose = ps.orbit_pose(None, MIDDLE, yaw)
    return pose, trace_seen(SOURCE, pose, forms.LIGHT, ps.Material())


@pytest.fixture(scope="module")
def own():
    return truth_at(0)[1]


def test_from_its_own_camera_the_source_saw_everything(own):
    assert own.known.shape == (LARGEST * 48, LARGEST * 64) and own.known.min() == 1
    alone = source_frames(SOURCE)[1].depth > 0
    reduced = own.reduced(LARGEST)
    assert (alone[reduced.objects == 1]).all() and not (alone[reduced.objects == 0]).any()
    np.testing.assert_allclose(reduced.light.mean(), own.light.mean())


def test_from_the_side_one_looks_through_what_the_source_did_not_see():
    pose, seen = truth_at(50)
    assert 0.1 < seen.known.mean() < 0.9
    assert (seen.known[seen.objects > 0] > 0).all()
    frame = source_frames(SOURCE)[1]
    image = ps.render(frame, pose=pose, camera=SOURCE, normals="star")
    true = seen.reduced(LARGEST).objects
    assert (image[true == 1][:, 3] > 0).mean() > 0.95 and (image[true == 0][:, 3] > 0).mean() < 0.05


def test_the_scores_see_holes_spill_and_a_darker_picture():
    known, objects = np.ones((20, 30)), np.zeros((20, 30))
    objects[5:15, 5:15] = 1
    truth = Truth(known, np.ones((20, 30, 3)), objects)
    image, alone = np.full((20, 30, 4), 255, np.uint8), np.zeros((20, 30, 4), np.uint8)
    alone[5:15, 5:15, 3] = 255
    assert forms.score_form(image, alone, truth) == {
        "psnr": pytest.approx(168, abs=1),
        "holes": 0,
        "spill": 0,
        "outline": 0,
    }
    image[:, :3, 3], alone[5:15, 15:17, 3] = 0, 255
    worse = forms.score_form(image - np.uint8((3, 3, 3, 0)), alone, truth)
    assert worse["psnr"] == pytest.approx(10 * np.log10(255**2 / 9), abs=0.01)
    assert worse["holes"] == pytest.approx(0.1) and worse["spill"] == pytest.approx(1 / 6)
    assert 0.3 < worse["outline"] < 2


def test_an_outline_is_the_border_of_a_mask():
    mask = np.zeros((9, 9), bool)
    mask[3:6, 3:6] = True
    assert len(outline(mask)) == 8 and outline_distance(mask, mask) == 0
    assert outline_distance(mask, np.roll(mask, 1, 1)) == pytest.approx(4 / 8, abs=0.2)
    assert outline_distance(mask, np.zeros_like(mask)) == pytest.approx(np.hypot(9, 9))


def test_splats_and_meshes_end_alike(renderer):
    """Both reach to the outer edges of the last pixels, and to the outline between them."""
    pose, seen = truth_at(30)
    truth = seen.reduced(LARGEST)
    scene, objects = source_frames(SOURCE)
    for splat in ("footprint", "mesh"):
        options = {"camera": SOURCE, "pose": pose, "normals": "star", "splat": splat}
        pictures = (renderer.render(frame, forms.LIGHT, **options) for frame in (scene, objects))
        score = forms.score_form(*pictures, truth)
        print(splat, score)
        assert score["psnr"] > 25
        assert score["holes"] < 0.0015 and score["spill"] < 0.003 and score["outline"] < 0.15


def test_both_ways_to_light_splats_are_timed_and_give_the_same_picture(renderer):
    view = forms.view_of(SOURCE, 1, *truth_at(15))
    with ps.Renderer(rasterizer="points") as points:
        rows = forms.measure_lit(points, source_frames(SOURCE)[0], view)
    made, resolved, phong = rows
    assert [row["way"] for row in rows] == [forms.MADE, forms.RESOLVED, forms.PHONG]
    assert all(row["ms"] > 0 for row in rows)
    assert made["psnr"] == pytest.approx(resolved["psnr"], abs=0.1) and phong["psnr"] > made["psnr"]
