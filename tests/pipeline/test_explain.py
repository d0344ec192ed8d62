"""What `--explain` says about a picture: estimators, and what several frames of one thing agree on."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.estimation.multi_view import SetReport
from pointshade_gl.pipeline.report import explain_set, findings
from pointshade_gl.scene.noise import Choice

from ..support.view_sets import noisy, pose_at, replaced, seen_from, three_views, write_views

STAR = Choice("star")


@pytest.fixture(scope="module")
def own(renderer):
    """A renderer of the module's own."""
    with ps.Renderer() as made:
        yield made


def report(count, **changes):
    values = {
        "choices": (STAR,) * count,
        "band": 0.0123,
        "gains": np.ones((count, 3)),
        "points": np.full(count, 1000),
        "distrusted": np.zeros(count, int),
        "importances": np.ones(count),
    }
    return SetReport(**(values | changes))


class TestWords:
    def test_without_anything_to_tell_it_is_short(self):
        assert explain_set(report(3)) == [
            "star: as requested (3 frames)",
            "band: depths within 1.2 % of each other are one surface",
            "gains: none, the exposures are equal",
            "distrusted: 0 % of the points: other views see through them, or they fly at an edge",
            "primary views: all 3",
        ]

    def test_each_method_that_ran_has_a_line(self):
        lines = explain_set(report(3, choices=(STAR, Choice("central"), STAR)))
        assert lines[:2] == ["star: as requested (2 frames)", "central: as requested (1 frame)"]

    def test_only_gains_worth_telling_are_told_the_largest_first_and_a_tint_by_channel(self):
        gains = np.array([[1.01] * 3, [0.8] * 3, [1.2, 1.0, 0.9], [1.05] * 3])
        line = explain_set(report(4, gains=gains), names="abcd")[2]
        assert line.endswith("in frames b by 0.80, c by 1.20 (red), 1.00 (green), 0.90 (blue) and d by 1.05")

    def test_the_worst_frames_are_named_and_no_more_than_a_few(self):
        distrusted = np.zeros(40, int)
        distrusted[[7, 3]] = 300, 500
        line = explain_set(report(40, distrusted=distrusted))[3]
        assert line.startswith("distrusted: 2 % of the points") and line.endswith(
            "most in frames 3 (50 %) and 7 (30 %)"
        )
        distrusted[3] = 1000
        assert "frames 3 (100 %) and" in explain_set(report(40, distrusted=distrusted))[3]
        distrusted[:12] = 400
        assert explain_set(report(40, distrusted=distrusted))[3].endswith("4 (40 %) and 7 more")

    def test_primary_views_are_told_from_those_that_fill_gaps(self):
        importances = np.array([0.02, 1, 0.5, 1, 1])
        assert explain_set(report(5, importances=importances))[-1] == (
            "primary views: frames 1, 3 and 4; 2 others may fill gaps"
        )

    def test_names_are_one_for_each_frame(self):
        with pytest.raises(ValueError, match="one for each of the 3 frames, got 2"):
            explain_set(report(3), ["left", "right"])


def found_in(renderer):
    """The report of the only object in the last picture."""
    with renderer._in_use():
        ((_, found),) = findings(renderer._pipeline.gpu_scene.drawn)
    return found


class TestRenderer:
    def test_nothing_was_drawn(self, renderer):
        with ps.Renderer() as fresh:
            assert fresh.explain() == []

    def test_a_frame_is_explained_by_its_estimator(self, own):
        own.render(three_views()[0])
        (line,) = own.explain()
        assert line.startswith("star: the depth is clean")

    def test_a_set_by_what_its_frames_agree_on(self, own):
        """A block floats in the middle frame, and the last one is darker."""
        views = three_views()
        spoilt = views[1].depth.copy()
        spoilt[40:70, 15:40] = 0.9
        dark = np.round(views[2].color * 0.8).astype(np.uint8)
        own.render([views[0], replaced(views[1], depth=spoilt), replaced(views[2], color=dark)])
        lines = own.explain()
        assert lines[0].startswith("star") and lines[0].endswith("(typical of 3 frames)")
        assert lines[1].startswith("band: depths within 0.4 %")
        gains = lines[2].partition("in frames ")[2]
        assert gains.startswith("2 by 1.")
        found = found_in(own)
        assert 740 <= found.distrusted[1] < 1000 and found.distrusted[1] > 2 * found.distrusted[[0, 2]].max()
        assert "most in frame 1 (" in lines[3] and lines[4] == "primary views: all 3"

    def test_flying_pixels_are_distrusted(self, own):
        clean = three_views()
        rough = [noisy(view, seed) for seed, view in enumerate(clean)]
        shares = []
        for views in (clean, rough):
            own.render(views)
            found = found_in(own)
            shares.append(found.distrusted.sum() / found.points.sum())
        assert shares[0] < 0.01 and shares[1] > 2 * shares[0], shares

    def test_objects_of_a_scene_are_told_by_name(self, own):
        views = three_views()
        pair = ps.Node(ps.PointObject(views[:2]), "pair")
        scene = ps.Scene((pair, ps.Node(ps.PointObject(views[2], normals="central")), ps.Node(None, "empty")))
        own.render(scene)
        lines = own.explain(names=["left", "middle"])
        assert lines[-1] == "object: central: as requested"
        assert len(lines) == 6 and all(line.startswith("pair: ") for line in lines[:-1])

    def test_normals_estimated_since_leave_nothing_to_explain(self, own):
        views = three_views()
        own.render(views)
        own.estimate_normals(replaced(views[0], color=None))
        assert own.explain() == [] and own.weights == {}

    def test_the_weights_of_a_picture_s_views(self, own):
        views = [seen_from(pose_at(yaw)) for yaw in (-12, -6, 0, 6, 12)]
        own.render(views, pose=pose_at(-7))
        assert [own.weights[view] for view in views[:3]] == [1, 1, 1] and own.weights[views[4]] < 0.5
        own.render(views[4])
        assert own.weights == {views[4]: 1}

    def test_it_draws_and_changes_nothing(self, own):
        views = three_views()
        image = own.render(views)
        before = own.steps.counts.copy()
        own.explain()
        assert (own.render(views) == image).all()
        assert {name for name, count in (own.steps.counts - before).items() if count} == {"light"}


class TestCommandLine:
    @pytest.fixture
    def folder(self, tmp_path):
        """Nine views with poses round a sphere before a wall."""
        return write_views(tmp_path / "walk", [seen_from(pose_at(yaw)) for yaw in range(-16, 17, 4)])

    def test_render_explains_frames_by_their_numbers_in_the_sequence(self, typed, folder):
        code, out, err = typed(f"render '{folder}' -o out.png --views 5 --explain --depth-scale 1000 --yaw -8")
        assert code == 0, err
        lines = out.splitlines()
        assert [line.partition(":")[0] for line in lines] == [
            "adaptive", "band", "gains", "distrusted", "primary views", "out.png",
        ]  # fmt: skip
        assert lines[4] == "primary views: frames 0, 2, 4 and 6; 1 other may fill gaps"

    def test_without_it_nothing_more_is_printed(self, typed, folder):
        _, out, _ = typed(f"render '{folder}' -o out.png --views 3 --depth-scale 1000")
        assert len(out.splitlines()) == 1

    def test_of_a_turntable_only_what_changes_is_told_again(self, typed, folder):
        line = f"render '{folder}' -o %d.png --views 5 --explain --depth-scale 1000 --turntable light --frames 3"
        _, out, _ = typed(line)
        assert len(out.splitlines()) == 6

    def test_a_single_frame_and_its_points_are_explained_as_normals_are(self, typed):
        for options in ("-o out.png --picture-size 64x48", "-o out.ply"):
            _, out, _ = typed(f"render vase --explain {options}")
            assert out.startswith("star: the depth is clean") and len(out.splitlines()) == 2
