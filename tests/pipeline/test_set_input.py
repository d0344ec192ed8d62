"""What a set of frames may hold, and what becomes of odd ones: a picture, or one sentence."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.estimation import multi_view as consensus
from pointshade_gl.estimation.multi_view import importances
from pointshade_gl.files.pictures.picture_files import save_image

from ..support import frames
from ..support.view_sets import pose_at, replaced, seen_from, three_views

BETWEEN = pose_at(6, -2)
UNLIT = {"camera": frames.CAMERA, "pose": BETWEEN, "shading": "none"}


def differing(a, b, steps=12):
    """The share of the pixels, drawn in both, that differ by more."""
    both = (a[..., 3] > 0) & (b[..., 3] > 0)
    assert both.mean() > 0.5
    return (np.abs(a.astype(int) - b).max(-1) > steps)[both].mean()


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        (np.zeros((4, 4)), "pose must be camera-to-world"),
        (np.diag([1, 1, 0, 1.0]), "pose must be camera-to-world"),
        (np.diag([2, 2, 2, 1.0]), "pose must be camera-to-world"),
        (np.diag([1, -1, 1, 1.0]), "pose mirrors"),
        (np.full((4, 4), np.nan), "pose must be finite, got 16 NaN"),
        (np.eye(3), r"pose must have shape \(4, 4\), got \(3, 3\)"),
    ],
)
def test_a_pose_that_is_none_is_refused_where_the_frame_is_made(pose, message):
    with pytest.raises(ValueError, match=message):
        replaced(three_views()[0], pose=pose)


@pytest.mark.parametrize(
    "kind", [iter, lambda views: (view for view in views), set, lambda views: dict.fromkeys(views)]
)
def test_a_set_is_a_sequence(renderer, kind):
    """A generator may have no end, a set has no first frame."""
    for call in (renderer.render, ps.PointObject):
        with pytest.raises(TypeError, match="sequence of frames"):
            call(kind(three_views()))


def test_a_sequence_that_is_too_long_is_not_read(renderer):
    class Endless(list):
        def __len__(self):
            return 100_000

        def __getitem__(self, k):
            pytest.fail("read")

    with pytest.raises(ValueError, match="1 to 200 frames, got 100000"):
        renderer.render(Endless())


def test_two_hundred_frames_are_drawn(renderer):
    tiny = ps.Camera(10, 10, 7.5, 5.5, 16, 12)
    rng = np.random.default_rng(3)
    views = [ps.Frame(None, np.ones((12, 16)), tiny, pose_at(yaw)) for yaw in rng.uniform(-20, 20, 200)]
    with pytest.MonkeyPatch.context() as fewer:
        fewer.setattr(consensus, "COMPARED", 1)
        assert renderer.render(views, camera=tiny)[..., 3].mean() > 200


def test_a_tiny_frame_beside_a_large_one_spoils_nothing(renderer):
    large = seen_from(pose_at(0), frames.CAMERA.resized(400, 300))
    small = seen_from(pose_at(5), frames.CAMERA.resized(4, 4))
    alone, both = (renderer.render(views, **UNLIT) for views in (large, [large, small]))
    assert (both[..., 3] >= alone[..., 3]).all() and differing(both, alone, 30) < 0.03
    assert renderer.render([small, large], **UNLIT).any()


class TestEmptyFrames:
    def test_a_frame_that_is_masked_away_adds_nothing_and_takes_no_place(self, renderer):
        """The nearest to the view is empty: the same frames carry the picture as without it."""
        views = [seen_from(pose_at(yaw)) for yaw in (-12, -6, 1, 12)]
        color = np.dstack([views[2].color, np.zeros(views[2].depth.shape, np.uint8)])
        masked = replaced(seen_from(pose_at(6, -2)), color=color)
        assert masked.points_known == 0
        assert (renderer.render([*views, masked], **UNLIT) == renderer.render(views, **UNLIT)).all()
        assert importances([*views, masked], BETWEEN)[4] == 0

    def test_none_has_a_point(self, renderer):
        empty = replaced(three_views()[0], depth=np.full((120, 160), np.nan))
        assert not renderer.render([empty, empty], **UNLIT).any()

    def test_a_first_frame_without_points_stands_where_its_camera_stood(self, renderer):
        views = three_views()
        first = replaced(views[0], depth=np.zeros_like(views[0].depth))
        image = renderer.render([first, *views[1:]], shading="none")
        assert (image == renderer.render(views[1:], camera=first.camera, pose=first.pose, shading="none")).all()


def test_borders_without_depth_change_nothing_inside(renderer):
    """Only the part with points is drawn; two frames, of different parts, in textures that others used before."""
    views = three_views()
    renderer.render(views, **UNLIT)
    cut = []
    for k, view in enumerate(views):
        depth = np.zeros_like(view.depth)
        inside = np.s_[20 + 4 * k : -10, 8 : -40 + 10 * k]
        depth[inside] = view.depth[inside]
        cut.append(replaced(view, depth=depth))
    image = renderer.render(cut, **UNLIT)
    with ps.Renderer() as fresh:
        assert (fresh.render(cut, **UNLIT) == image).all()
    assert differing(image, renderer.render(views, **UNLIT)) < 0.05
    assert (image[..., 3] > 0).mean() < (renderer.render(views, **UNLIT)[..., 3] > 0).mean() - 0.05


def test_pictures_whose_rows_run_upwards_are_the_same(renderer):
    views = three_views()
    c = views[1].camera
    camera = ps.Camera(c.fx, -c.fy, c.cx, c.height - 1 - c.cy, c.width, c.height)
    upside = replaced(views[1], color=views[1].color[::-1], depth=views[1].depth[::-1], camera=camera)
    mixed = renderer.render([views[0], upside, views[2]], **UNLIT)
    assert differing(mixed, renderer.render(views, **UNLIT), 6) < 0.01


def test_frames_without_colours_are_light_grey_and_change_no_exposure(renderer):
    views = three_views()
    grey = [views[0], replaced(views[1], color=None), views[2]]
    plain, mixed = (renderer.render(one, **UNLIT).astype(int) for one in (views, grey))
    both = (plain[..., 3] > 0) & (mixed[..., 3] > 0)
    low, high = np.minimum(plain, 204)[both], np.maximum(plain, 204)[both]
    within = (mixed[both] >= low - 12) & (mixed[both] <= high + 12)
    assert within[:, :3].mean() > 0.99
    assert renderer.render([replaced(view, color=None) for view in views], **UNLIT)[..., :3].max() == 204


def test_frames_that_look_away_from_each_other_are_both_drawn_without_a_word(renderer, capsys):
    here, there = seen_from(pose_at(0)), seen_from(pose_at(0))
    there = replaced(there, pose=ps.orbit_pose(None, (0, 0, 0), 180))
    alone = renderer.render(here, camera=frames.CAMERA, shading="none")
    image = renderer.render([here, there], camera=frames.CAMERA, shading="none")
    assert (image[..., 3] == alone[..., 3]).all() and differing(image, alone) < 0.02
    assert capsys.readouterr().err == ""


def test_a_wrong_pose_is_named_on_the_command_line(typed, tmp_path):
    folder = tmp_path / "walk"
    for name in ("color", "depth", "pose"):
        (folder / name).mkdir(parents=True)
    camera = frames.CAMERA
    (folder / "intrinsics.txt").write_text(f"{camera.fx} 0 {camera.cx}\n0 {camera.fy} {camera.cy}\n0 0 1\n")
    for k, yaw in enumerate((-9, -3, 3, 9)):
        view = seen_from(pose_at(yaw))
        save_image(folder / "color" / f"{k}.png", view.color)
        np.save(folder / "depth" / f"{k}.npy", view.depth)
        pose = view.pose.copy()
        pose[:3, 3] += (0, 0, 0.2) if k == 3 else 0
        np.savetxt(folder / "pose" / f"{k}.txt", pose)
    code, _, err = typed(f"render '{folder}' -o out.png --views all")
    assert code == 0 and err.count("frame 3 of 4 contradicts the others where they see the same") == 1
