"""Point clouds in the window: they are scenes with keys of their own, and P tells the command that draws them again."""

import shlex
from functools import partial

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.cli.command_lines import Typed, render_line
from pointshade_gl.scene.orbit import State
from pointshade_gl.viewer.events import Open, TurnAround
from pointshade_gl.viewer.state import clouds_of

from ..support.cloud_ball import ball, write_ball
from ..support.trained_splats import ball_over_floor
from ..support.viewing import drag, press, quiet, shown


@pytest.fixture
def viewer(open_viewer):
    return open_viewer(ball(1000), window_size=(240, 180))


def text(viewer):
    return viewer.messages.text


def test_a_cloud_is_seen_and_turns_about_its_up_axis(viewer):
    before = shown(quiet(viewer)).astype(int)
    assert np.abs(before - before[0, 0]).max(-1).mean() > 20
    up = viewer.frame.upright
    assert np.abs(np.asarray(up)).argmax() == 2 and isinstance(viewer.frame, ps.Scene)
    above = viewer.picture.pose[2, 3]
    drag(viewer, (60, 90), (140, 90))
    assert (shown(quiet(viewer)) != before).any()
    assert viewer.picture.pose[2, 3] == pytest.approx(above, abs=1e-6)


def test_plus_and_minus_change_the_size_of_its_points_by_a_quarter(viewer):
    before = shown(quiet(viewer))
    press(viewer, "+")
    assert clouds_of(viewer.frame)[0].point_size == "2.5x"
    assert text(viewer).startswith("point size: 2.5 times the spacing")
    assert (shown(quiet(viewer)) != before).any()
    press(viewer, "-")
    assert clouds_of(viewer.frame)[0].radius_rule == (2.0, "x")
    for _ in range(30):
        press(viewer, "-")
    assert clouds_of(viewer.frame)[0].radius_rule == (0.1, "x") and text(viewer).endswith(", the smallest")


@pytest.mark.parametrize(("given", "larger"), [("4px", "5px"), (0.04, 0.05), (None, "2.5x")])
def test_sizes_keep_their_unit(open_viewer, given, larger):
    viewer = open_viewer(ball(300).styled(point_size=given), window_size=(120, 90))
    press(viewer, "+")
    assert clouds_of(viewer.frame)[0].point_size == larger


def test_keys_choose_the_shading_and_phong_comes_back(viewer):
    pictures = {}
    for key in "1245":
        press(viewer, key)
        pictures[key] = shown(quiet(viewer))
    assert (pictures["1"] != pictures["4"]).any() and (pictures["5"] != pictures["1"]).any()
    assert (pictures["2"] == pictures["4"]).all()  # clouds have no flat shading
    press(viewer, "4")
    assert (shown(quiet(viewer)) == pictures["4"]).all()


@pytest.mark.parametrize("key", ["N", "U", "X"])
def test_keys_about_frames_say_that_they_are(viewer, key):
    press(viewer, key)
    assert text(viewer) == "the objects of a scene have a look of their own"


def test_a_double_click_makes_a_point_of_the_cloud_the_middle_of_turns(viewer):
    assert viewer.screen.find_surface(viewer.picture, 120, 90)[2] == pytest.approx(viewer.stage.pivot[2] - 1, abs=0.05)
    viewer.perform(TurnAround(120, 60))
    assert text(viewer) == "drags turn around this point" and viewer.state.pivot != State().pivot
    viewer.perform(TurnAround(1, 1))
    assert text(viewer) == "drags turn around the object's middle" and viewer.state.pivot == State().pivot


def test_clouds_that_are_dropped_are_opened_as_one_scene(viewer, tmp_path):
    first, second = write_ball(tmp_path / "a.ply", count=300), write_ball(tmp_path / "b.ply", count=200, at=(3, 0, 0))
    viewer.perform(Open((str(first),)))
    assert [len(cloud) for cloud in clouds_of(viewer.frame)] == [300]
    viewer.perform(Open((str(first), str(second))))
    assert [(node.name, len(node.content)) for _, node in viewer.frame.every_node()] == [("a", 300), ("b", 200)]


def test_a_cloud_and_a_scene_that_are_dropped_are_one_scene(viewer, tmp_path):
    cloud = write_ball(tmp_path / "a.ply", count=300)
    ps.save_scene(tmp_path / "b.glb", ps.Scene((ps.Node(ps.Mesh(np.eye(3), [(0, 1, 2)]), "part"),)))
    viewer.perform(Open((str(cloud), str(tmp_path / "b.glb"))))
    assert [node.name for _, node in viewer.frame.every_node()] == ["a", "b", "part"]


def test_a_broken_cloud_that_is_dropped_is_one_sentence_and_the_window_stays(viewer, tmp_path):
    path = write_ball(tmp_path / "a.ply")
    path.write_bytes(path.read_bytes()[:700])
    before = viewer.frame
    viewer.perform(Open((str(path),)))
    assert text(viewer).startswith("not opened: ") and "is a broken PLY file" in text(viewer)
    assert viewer.frame is before


def test_the_panel_changes_splat_and_size(viewer, monkeypatch):
    pytest.importorskip("imgui_bundle")
    from pointshade_gl.viewer.panel_sections import Widgets

    press(viewer, "G")
    for _ in range(4):
        viewer.step(wait=False)
    monkeypatch.setattr(Widgets, "section", lambda *_, **__: True)
    real = Widgets.choose
    monkeypatch.setattr(
        Widgets, "choose", lambda self, name, *more: "ball" if name == "splat" else real(self, name, *more)
    )
    viewer.step(wait=False)
    viewer.redrawing.forget()
    viewer.step(wait=False)
    assert clouds_of(viewer.frame)[0].splat == "ball"
    monkeypatch.setattr(Widgets, "choose", real)
    slide = Widgets.slide
    monkeypatch.setattr(
        Widgets, "slide", lambda self, name, *more, **by: 0.75 if name == "size" else slide(self, name, *more, **by)
    )
    viewer.redrawing.forget()
    viewer.step(wait=False)
    assert clouds_of(viewer.frame)[0].point_size == "0.75x"


@pytest.fixture
def again(typed, capsys, tmp_path):
    """again(viewer) presses P, runs the line that it prints, and compares the pictures: the words of the line.

    but  share of the pixels that may differ: where balls of few pixels turn from the light, the twelfth digit of its
         place decides about their own shadow
    """

    def run(viewer, but=0.001):
        capsys.readouterr()
        press(viewer, "P")
        saved, line = capsys.readouterr().out.splitlines()
        words = shlex.split(line)
        code, _, errors = typed(shlex.join([*words[1:-1], "again.png"]))
        assert code == 0, errors
        with Image.open(saved) as one, Image.open(tmp_path / "again.png") as other:
            pictures = [np.asarray(picture).astype(int) for picture in (one, other)]
        assert pictures[0][..., 3].any() and pictures[0].shape == pictures[1].shape
        assert (np.abs(pictures[0] - pictures[1]).max(-1) > 1).mean() <= but
        return words[2:-2]

    return run


def test_p_tells_the_line_that_draws_it_again(open_viewer, again, tmp_path):
    path = str(write_ball(tmp_path / "ball.ply", count=1000))
    line = partial(render_line, Typed((path,), ("--up", "z")))
    viewer = open_viewer(ps.load_cloud(path, up="z"), window_size=(240, 180), command_line=line)
    drag(viewer, (60, 90), (140, 70))
    words = again(viewer)
    assert words[:3] == [path, "--up", "z"] and {"--yaw", "--pitch"} <= set(words)
    press(viewer, "+", "5")
    drag(viewer, (60, 90), (140, 70))
    words = again(viewer)
    assert words[words.index("--point-size") + 1] == "2.5x" and words[words.index("--shading") + 1] == "edl"
    assert "--splat" not in words


def test_view_opens_clouds_as_they_are_typed(open_viewer, again, monkeypatch, typed, tmp_path):
    import pointshade_gl.viewer as package

    first, second = write_ball(tmp_path / "a.ply", count=300), write_ball(tmp_path / "b.ply", count=200, at=(3, 0, 0))
    opened = []

    def open_it(source, **given):
        opened.append(open_viewer(source, **given | {"window_size": (240, 180)}))
        monkeypatch.setattr(opened[-1], "run", lambda: None)
        return opened[-1]

    monkeypatch.setattr(package, "Viewer", open_it)
    code, _, errors = typed(f"view '{first}' '{second}' --splat ball --point-size 0.05 --shading edl --ambient .4")
    assert code == 0, errors
    clouds = clouds_of(opened[0].frame)
    assert [len(cloud) for cloud in clouds] == [300, 200] and clouds[1].material.ambient == 0.4
    words = again(opened[0])
    assert words[:2] == [str(first), str(second)]
    assert {"ball", "0.05", "edl", "0.4"} <= set(words)
    press(opened[0], "4")
    assert "--shading" not in again(opened[0], but=0.02)


def test_trained_splats_are_blended_anew_when_they_turn(open_viewer):
    viewer = open_viewer(ball_over_floor(300), window_size=(120, 90))
    before = shown(quiet(viewer)).astype(int)
    assert np.abs(before - before[0, 0]).max(-1).mean() > 20
    drag(viewer, (30, 45), (70, 45))
    assert (shown(quiet(viewer)) != before).any()
