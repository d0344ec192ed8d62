"""No message claims what cannot be seen: it says when it will be."""

import pytest

import pointshade_gl as ps
from pointshade_gl.scene.orbit import State
from pointshade_gl.viewer.events import Event
from pointshade_gl.viewer.overlay import CLOSES, Messages

from ..support import frames
from ..support.viewing import press, quiet, shown

LATER, NOT_SHADED = "seen once lit again (B)", "seen once shaded (2, 3 or 4)"
LAMPS = [ps.Light(position=(-1, -1, 0), shadow=True), ps.Light(position=(1, -1, 0))]


@pytest.mark.parametrize(("unlit", "hint"), [("B", LATER), ("1", NOT_SHADED)])
def test_a_change_of_the_light_is_seen_once_it_is_lit(open_viewer, unlit, hint):
    viewer = open_viewer(frames.sphere_before_wall(), lights=LAMPS)
    for key in ("N", "S", "L", "TAB"):
        press(viewer, unlit)
        before = shown(quiet(viewer))
        press(viewer, key)
        assert viewer.messages.text.endswith(f"; {hint}")
        assert (shown(quiet(viewer)) == before).all()
        press(viewer, "4")
        press(viewer, key)
        assert "; seen" not in viewer.messages.text


@pytest.mark.parametrize("key", ["U", "X"])
def test_colours_are_seen_without_shading_but_not_in_the_photograph(open_viewer, key):
    viewer = open_viewer()
    press(viewer, "1", key)
    assert "; seen" not in viewer.messages.text
    press(viewer, "B", key)
    assert viewer.messages.text.endswith(LATER)


def test_without_shading_there_is_nothing_to_compare(open_viewer):
    viewer = open_viewer(state=State(look=ps.Appearance(shading="none")))
    press(viewer, "B")
    assert viewer.state.lit and "unlit picture already" in viewer.messages.text


@pytest.mark.parametrize("key", ["N", "U", "X", "+", "-"])
def test_a_scene_has_looks_of_its_own(open_viewer, key):
    viewer = open_viewer(ps.Scene((ps.Node(ps.PointObject(frames.sphere()), "ball"),)))
    look = viewer.state.look
    press(viewer, key)
    assert viewer.state.look == look and "look of their own" in viewer.messages.text


def test_shadows_that_no_light_casts_are_not_claimed(open_viewer):
    viewer = open_viewer(lights=[ps.Light(position=(-1, -1, 0))])
    press(viewer, "S")
    assert viewer.messages.text == "shadows on, but no light casts any"
    press(viewer, "S")
    assert viewer.messages.text == "shadows off, but no light casts any"


def test_the_ends_of_the_point_sizes_are_said(open_viewer):
    viewer = open_viewer()
    press(viewer, *"+" * 20)
    assert viewer.messages.text == "point size: 8 pixels of the frame, the largest"
    press(viewer, *"-" * 40)
    assert viewer.messages.text == "point size: 0.25 pixels of the frame, the smallest"


def test_a_flat_mesh_does_not_show_its_estimator(open_viewer):
    viewer = open_viewer(state=State(look=ps.Appearance(splat="mesh", shading="flat")))
    before = shown(quiet(viewer))
    press(viewer, "N")
    assert "normals of their own" in viewer.messages.text
    assert (shown(quiet(viewer)) == before).all()


def test_tab_names_the_light(open_viewer):
    nodes = [ps.Node(ps.PointObject(frames.sphere()), "ball"), ps.Node(LAMPS[0], "lamp"), ps.Node(LAMPS[1])]
    nodes.append(ps.Node(ps.Light(direction=(0, 1, 1)), "sun"))
    viewer = open_viewer(ps.Scene(tuple(nodes)))
    said = []
    for _ in range(3):
        press(viewer, "TAB")
        said.append(viewer.messages.text)
    assert said == [
        "the mouse holds light 2 (point), light 2 of 3",
        "the mouse holds sun (directional), light 3 of 3",
        "the mouse holds lamp (point), light 1 of 3",
    ]


class TestKept:
    WHY = "not opened: notes.txt is no picture"

    @pytest.fixture
    def viewer(self, open_viewer, tmp_path, capsys):
        viewer = open_viewer()
        (tmp_path / "notes.txt").write_text("a few words")
        viewer.open([str(tmp_path / "notes.txt")])
        self.printed = capsys.readouterr().err
        return viewer

    def test_why_a_file_was_not_opened_stays_until_it_is_read_and_is_printed(self, viewer):
        why = viewer.messages.kept
        assert why.startswith("not opened: ") and "notes.txt" in why
        assert f"warning: {why}" in self.printed
        viewer.messages.update(1e12)
        for x in range(100, 140, 10):
            viewer.handle(Event("move", x=x, y=100))
        viewer.handle(Event("wheel", x=100, y=100, steps=1))
        viewer.step(wait=False)
        assert viewer.messages.text.startswith(f"{why}\n{CLOSES}")

    def test_esc_closes_it_and_not_the_window(self, viewer):
        press(viewer, "ESCAPE")
        assert not viewer.messages.text and not viewer.window.is_closing
        press(viewer, "ESCAPE")
        assert viewer.window.is_closing

    def test_a_key_or_a_click_closes_it_and_does_what_it_does(self, viewer):
        press(viewer, "S")
        assert viewer.state.shadows and not viewer.messages.kept and viewer.messages.text == "shadows on"
        viewer.messages.keep("not saved: no space")
        viewer.handle(Event("press", "left", 100, 100))
        assert not viewer.messages.kept

    def test_what_is_said_afterwards_is_below_it(self):
        messages = Messages()
        messages.keep(self.WHY)
        messages.say("skipped: frame 3")
        assert messages.text == f"{self.WHY}\n{CLOSES}\nskipped: frame 3"
        messages.update(float("inf"))
        assert messages.text == f"{self.WHY}\n{CLOSES}" and messages.patience(0) is None
