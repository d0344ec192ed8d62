"""The panel over the picture, with and without its extra."""

import sys
from dataclasses import replace

import pointshade_gl as ps
from pointshade_gl.viewer.events import Event
from pointshade_gl.viewer.state import State

from .viewing import press, quiet, shown


class TestPanel:
    def test_g_opens_it_and_the_mouse_over_it_is_its_own(self, open_viewer):
        viewer = open_viewer(size=(640, 480))
        before = shown(quiet(viewer))
        press(viewer, "G")
        for _ in range(8):
            viewer.step(wait=False)
        assert (shown(viewer) != before)[:, 400:].mean() > 0.3
        for place in ((540, 100), (541, 101), (545, 120)):
            viewer.handle(Event("move", x=place[0], y=place[1]))
            viewer.step(wait=False)
        light = viewer.state.light_at
        viewer.handle(Event("move", x=560, y=200))
        assert viewer.state.light_at == light
        press(viewer, "G")
        assert (shown(viewer)[:, 400:] != before[:, 400:]).mean() < 0.3

    def test_a_click_on_its_box_changes_the_state(self, open_viewer):
        viewer = open_viewer(size=(640, 480), panel=True)
        box = (398, 44)
        for event in ("move", "press", "release"):
            for _ in range(4):
                viewer.step(wait=False)
            viewer.handle(Event(event, "" if event == "move" else "left", *box))
        for _ in range(4):
            viewer.step(wait=False)
        assert not viewer.state.light_mode

    def test_it_comes_to_rest(self, open_viewer):
        viewer = quiet(open_viewer(panel=True))
        for _ in range(10):
            viewer.step(wait=False)
        assert quiet(viewer)._patience() in (0, None)
        viewer.step(wait=False)
        assert viewer._patience() is None
        assert set(viewer.renderer.steps.laps) >= {"surface", "splats", "resolve"}

    def test_it_keeps_what_its_sliders_cannot_show(self, open_viewer):
        look = ps.Look(ps.Material(0.1, 7, 0.3, 900), size=0.01, max_depth_step=0.07)
        state = State(look=look, light_intensity=9)
        viewer = open_viewer(state=replace(state, panel=True))
        for _ in range(4):
            viewer.step(wait=False)
        assert viewer.state == replace(state, panel=True)

    def test_without_its_extra_the_viewer_works_and_says_how_to_get_it(self, open_viewer, monkeypatch):
        monkeypatch.setitem(sys.modules, "imgui_bundle", None)
        viewer = open_viewer()
        press(viewer, "G")
        assert "pip install 'pointshade-gl[gui]'" in viewer._messages.text and not viewer.state.panel
