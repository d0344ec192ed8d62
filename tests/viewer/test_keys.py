"""The keys of the window: each does what the help says."""

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.scene.orbit import State
from pointshade_gl.viewer import background as recording
from pointshade_gl.viewer.keys import ESTIMATORS

from ..support import frames
from ..support.viewing import move, press, quiet, shown


class TestKeys:
    def test_1_to_5_choose_the_shading_and_b_compares(self, open_viewer):
        viewer = open_viewer()
        move(viewer, (160, 120), (20, 20))
        pictures = []
        for name in "12345":
            press(viewer, name)
            pictures.append(shown(quiet(viewer)))
        unlit = pictures[0]
        assert all((a != b).any() for k, a in enumerate(pictures) for b in pictures[:k])
        press(viewer, "B")
        assert (shown(quiet(viewer)) == unlit).all()
        press(viewer, "B")
        assert "darker beside what is nearer" in viewer.messages.text
        assert (shown(quiet(viewer)) == pictures[4]).all()

    def test_n_goes_through_the_estimators_and_says_which(self, open_viewer):
        viewer = open_viewer()
        seen = []
        for _ in ESTIMATORS:
            press(viewer, "N")
            viewer.step(wait=False)
            seen.append(viewer.renderer.choice.method)
            assert viewer.state.look.normals in viewer.messages.text
        assert seen[:-1] == list(ESTIMATORS[1:]) and viewer.state.look.normals == "auto"

    def test_a_mesh_has_no_point_size(self, open_viewer):
        viewer = open_viewer(state=State(look=ps.Appearance(splat="mesh")))
        press(viewer, "+")
        assert viewer.state.look.point_size is None and "no point size" in viewer.messages.text

    def test_plus_and_minus_change_the_point_size_and_find_the_way_back(self, open_viewer):
        viewer = open_viewer()
        press(viewer, "+", "=")
        assert viewer.state.point_size == viewer.state.look.point_size > 1.5
        press(viewer, "-", "-")
        assert viewer.state.point_size == 1

    def test_p_writes_what_is_seen_under_a_new_name_and_prints_it(self, open_viewer, tmp_path, monkeypatch, capsys):
        monkeypatch.chdir(tmp_path)
        viewer = open_viewer()
        press(viewer, "P", "1", "P")
        names = capsys.readouterr().out.splitlines()
        assert names == [str(tmp_path / f"pointshade_000{k}.png") for k in (1, 2)]
        with Image.open(names[1]) as image:
            expected = ps.render(viewer.frame, camera=viewer.frame.camera.fitted(320, 240), shading="none")
            assert (np.asarray(image) == expected).all()

    def test_a_picture_that_cannot_be_written_is_said_and_nothing_ends(self, open_viewer, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        viewer = open_viewer()
        monkeypatch.setattr(recording, "save_image", lambda *_: (_ for _ in ()).throw(OSError("the disk is full")))
        press(viewer, "P")
        assert "the disk is full" in viewer.messages.text

    def test_h_shows_the_help_and_escape_closes_it_before_the_window(self, open_viewer):
        viewer = quiet(open_viewer())
        before = shown(viewer)
        press(viewer, "H")
        assert (shown(viewer) != before).mean() > 0.3
        press(viewer, "ESCAPE")
        assert (shown(viewer) == before).all() and not viewer.window.is_closing
        press(viewer, "ESCAPE")
        assert viewer.window.is_closing

    def test_s_turns_the_shadow_of_an_object_upon_itself_on_and_off(self, open_viewer):
        """The ball shades the wall behind it."""
        viewer = open_viewer(frames.sphere_before_wall())
        move(viewer, (160, 120), (140, 110))
        without = shown(quiet(viewer))
        press(viewer, "S")
        assert (shown(quiet(viewer)) != without).any()
        press(viewer, "S")
        assert (shown(quiet(viewer)) == without).all()

    @pytest.mark.parametrize("name", ["SPACE", "LEFT", "RIGHT"])
    def test_keys_of_a_stream_say_that_there_is_none(self, open_viewer, name):
        viewer = open_viewer()
        press(viewer, name)
        assert "single frame" in viewer.messages.text

    def test_keys_come_from_the_window_by_what_stands_on_them(self, open_viewer):
        viewer = open_viewer()
        glfw, window = viewer.window.glfw, viewer.window
        told = []
        viewer.on_event = lambda event: told.append(event.key) or True
        for key in (glfw.KEY_L, glfw.KEY_1, glfw.KEY_KP_ADD, glfw.KEY_SPACE, glfw.KEY_LEFT, glfw.KEY_ESCAPE):
            window._on_key(window.handle, key, 0, glfw.PRESS, 0)
            window._on_key(window.handle, key, 0, glfw.RELEASE, 0)
        window._on_key(window.handle, glfw.KEY_F5, 0, glfw.PRESS, 0)
        viewer.step(wait=False)
        assert told == ["L", "1", "+", "SPACE", "LEFT", "ESCAPE"]
