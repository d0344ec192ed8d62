"""The built-in vase in a window: its front at once, and all of its sides as soon as the view turns away from it or
they may cast shadows."""

import shlex
from functools import partial

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.cli.command_lines import Typed, render_line
from pointshade_gl.renderer.requests import load_all_sides
from pointshade_gl.viewer.state import views_in

from ..support.viewing import drag, press


@pytest.fixture
def viewer(open_viewer):
    """A window as `pointshade view` opens it."""
    opened = open_viewer(ps.load_frame("vase"), command_line=partial(render_line, Typed(("vase",))))
    opened.document.playback.whole = load_all_sides
    return opened


def saved_line(viewer, capsys):
    capsys.readouterr()
    press(viewer, "P")
    return capsys.readouterr().out.splitlines()[1]


def test_a_small_turn_reads_nothing_and_names_the_vase(viewer, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    drag(viewer, (160, 120), (166, 120))
    viewer.step(wait=False)
    assert 0 < abs(viewer.state.yaw) < 5 and views_in(viewer.frame) is None
    assert viewer.document.playback.whole is load_all_sides and not viewer.document.playback.is_merging
    assert saved_line(viewer, capsys).startswith("pointshade render vase --")


def test_drags_about_the_vase_are_free_and_about_its_front_alone_end_with_a_word(viewer, open_viewer):
    drag(viewer, (60, 120), (300, 120))
    assert abs(viewer.state.yaw) > 90 and "drags end here" not in viewer.messages.text
    alone = open_viewer(ps.load_frame("vase"))
    drag(alone, (60, 120), (300, 120))
    assert 45 < abs(alone.state.yaw) < 50 and "drags end here" in alone.messages.text
    yaw = alone.state.yaw
    press(alone, "KP4" if yaw < 0 else "KP6")
    assert abs(yaw) <= abs(alone.state.yaw) < 50
    press(alone, "KP3")  # views that are asked for by name are free
    assert alone.state.yaw == 90


def test_before_the_sides_are_read_the_line_names_the_front(open_viewer, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    viewer = open_viewer(ps.load_frame("vase"), command_line=partial(render_line, Typed(("vase",))))
    drag(viewer, (160, 120), (190, 120))
    assert saved_line(viewer, capsys).startswith("pointshade render vase/front --")


def test_shadows_are_those_of_all_sides(viewer):
    press(viewer, "S")
    viewer.step(wait=False)
    assert viewer.document.playback._completing is not None
    press(viewer, "S")


@pytest.mark.system
def test_turned_away_it_shows_all_sides_which_the_line_names(viewer, typed, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    drag(viewer, (160, 120), (250, 120))
    yaw = viewer.state.yaw
    viewer.step(wait=False)
    alone = viewer.screen.read(viewer.picture, 1)
    while views_in(viewer.frame) is None:
        viewer.step()
    viewer.step(wait=False)
    whole = viewer.screen.read(viewer.picture, 1)
    assert viewer.state.yaw == yaw and len(viewer.frame.frames) == 11
    assert (whole[..., 3] > 0).sum() > 1.1 * (alone[..., 3] > 0).sum()  # its back has come into view
    line = saved_line(viewer, capsys)
    assert line.startswith("pointshade render vase/whole --views 0,1,2,3,4,5,6,7,8,9,10 --")
    name = shlex.split(line)[-1]
    assert typed(line.removeprefix("pointshade ").replace(name, "again.png"))[0] == 0
    with Image.open(name) as saved, Image.open("again.png") as again:
        assert (np.abs(np.asarray(saved).astype(int) - np.asarray(again)).max(-1) > 1).mean() < 1e-3
    press(viewer, "R")
    viewer.step(wait=False)
    assert viewer.state.yaw == 0 and len(viewer.frame.frames) == 11
