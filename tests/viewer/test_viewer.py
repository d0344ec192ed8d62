"""The window, a real one: what the mouse does to what is seen, and when it is drawn."""

import threading
import time

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.viewer import Viewer
from pointshade_gl.viewer import overlay as messages
from pointshade_gl.viewer.events import Event
from pointshade_gl.viewer.keys import BY_NAME
from pointshade_gl.viewer.overlay import BUTTONS, button_boxes
from pointshade_gl.viewer.window import Window

from ..support import frames
from ..support.viewing import BALL, brightness, drag, move, press, quiet, shown


class TestLight:
    def test_the_lit_half_moves_towards_the_mouse(self, open_viewer):
        viewer = quiet(open_viewer(BALL))
        move(viewer, (160, 120), (60, 120))
        left, right, _, _ = brightness(shown(viewer))
        assert left > 1.5 * right
        move(viewer, (60, 120), (260, 120))
        left, right, _, _ = brightness(shown(viewer))
        assert right > 1.5 * left
        move(viewer, (260, 120), (160, 120), (160, 20))
        _, _, upper, lower = brightness(shown(viewer))
        assert upper > 1.5 * lower

    def test_in_the_middle_it_lights_all_and_far_outside_it_is_behind(self, open_viewer):
        viewer = quiet(open_viewer(BALL))
        move(viewer, (10, 120), (160, 120))
        front = brightness(shown(viewer))
        assert max(front) < 1.3 * min(front)
        move(viewer, (160, 120), (318, 2))
        assert viewer.state.is_behind
        assert sum(brightness(shown(viewer))) < 0.5 * sum(front)

    def test_the_marker_is_under_the_mouse_a_disc_in_front_a_ring_behind(self, open_viewer):
        viewer = quiet(open_viewer(BALL))
        move(viewer, (200, 200), (100, 60), steps=30)
        assert shown(viewer)[60, 100].min() > 250
        assert shown(viewer)[64, 100].min() > 250 and shown(viewer)[60, 96].min() > 250
        move(viewer, (100, 60), (12, 12), steps=30)
        picture = shown(viewer).astype(int)
        assert picture[12, 12].max() < 90 and picture[12, 6].min() > 120

    def test_ctrl_shift_drag_moves_it_outside_of_light_mode_where_the_plain_mouse_does_not(self, open_viewer):
        viewer = quiet(open_viewer(BALL))
        press(viewer, "L")
        quiet(viewer)
        before = shown(viewer)
        move(viewer, (10, 10), (300, 200))
        assert (shown(viewer) == before).all()
        drag(viewer, (300, 200), (310, 120), ctrl=True, shift=True)
        drag(viewer, (310, 120), (260, 120), ctrl=True, shift=True)
        left, right, _, _ = brightness(shown(viewer))
        assert right > left

    def test_lights_of_the_caller_the_first_is_in_the_hand(self, open_viewer):
        light, other = ps.Light(position=(-3, 0, 1.5), color=(1, 0.2, 0.2)), ps.Light(position=(0, -2, 0))
        viewer = open_viewer(lights=[light, other])
        held = viewer.state.light(viewer.stage, viewer.frame.pose)
        assert held.position == pytest.approx(light.position) and held.color == light.color
        move(viewer, (160, 120), (300, 20))
        assert viewer.lights == (other,)


class TestView:
    @pytest.mark.parametrize(("button", "held"), [("left", {}), ("left", {"ctrl": True}), ("middle", {})])
    def test_drags_orbit_and_pan_and_r_takes_it_back(self, open_viewer, button, held):
        viewer = quiet(open_viewer())
        before = shown(viewer)
        drag(viewer, (160, 120), (190, 110), button, **held)
        assert viewer.state.pan != (0, 0) or viewer.state.yaw != 0
        assert (shown(viewer) != before).any()
        press(viewer, "R")
        assert (shown(quiet(viewer)) == before).all()

    def test_the_wheel_zooms(self, open_viewer):
        viewer = quiet(open_viewer())
        press(viewer, "1")
        area = np.count_nonzero(shown(quiet(viewer))[..., 0] > 60)
        viewer.handle(Event("wheel", steps=2))
        assert np.count_nonzero(shown(viewer)[..., 0] > 60) > 1.2 * area

    @pytest.mark.parametrize("size", [(640, 200), (200, 500), (321, 243), (1, 1)])
    def test_a_resized_window_is_sharp_and_undistorted(self, open_viewer, size):
        """Unlit, the window shows just what `render` gives for a camera of that size."""
        viewer = open_viewer()
        press(viewer, "1")
        viewer.window.glfw.set_window_size(viewer.window.handle, *size)
        for _ in range(200):
            viewer.step(wait=True)
            if viewer.window.picture_size == size:
                break
        quiet(viewer)
        picture = shown(viewer)
        expected = ps.render(viewer.frame, camera=viewer.frame.camera.fitted(*size), shading="none")
        seen = expected[..., 3] == 255
        assert picture.shape[:2] == size[::-1]
        assert (picture[seen] == expected[seen][:, :3]).all()
        assert picture[~seen].max(initial=0) < 60

    @pytest.mark.parametrize("size", [(1, 1), (7, 5), (40, 3), (2, 200)])
    def test_the_help_fits_into_a_window_of_a_few_pixels(self, open_viewer, monkeypatch, size):
        viewer = quiet(open_viewer())
        monkeypatch.setattr(Window, "picture_size", property(lambda _: size))
        press(viewer, "H")
        viewer.step(wait=False)
        table = viewer.screen._drawings["help"][1]
        assert table.width <= size[0] and table.height <= size[1]

    def test_minimised_it_draws_nothing_sleeps_and_comes_back(self, open_viewer, monkeypatch):
        viewer = quiet(open_viewer())
        shown(viewer)
        drawn = viewer.drawn
        with monkeypatch.context() as minimised:
            minimised.setattr(Window, "picture_size", property(lambda _: (0, 0)))
            viewer.handle(Event("refresh"))
            move(viewer, (10, 10), (200, 200))
            press(viewer, *set(BY_NAME) - {"Q", "ESCAPE"})
            viewer.step(wait=False)
            quiet(viewer)
            assert viewer.drawn == drawn and viewer.patience(time.perf_counter()) is None
        viewer.step(wait=False)
        assert viewer.drawn == drawn + 1

    def test_on_a_dense_screen_the_mouse_is_told_in_pixels_of_the_picture_and_text_is_larger(
        self, open_viewer, monkeypatch
    ):
        viewer = quiet(open_viewer())
        glfw, told = viewer.window.glfw, []
        monkeypatch.setattr(viewer, "on_event", lambda event: told.append((event.x, event.y)))
        monkeypatch.setattr(glfw, "get_window_size", lambda _: (160, 120))
        viewer.window._on_move(viewer.window.handle, 80, 30)
        viewer.step(wait=False)
        assert told == [(160, 60)]
        monkeypatch.undo()

        def text_size():
            viewer.say("text")
            viewer.step(wait=False)
            return viewer.screen._drawings["message"][1].size

        plain = text_size()
        monkeypatch.setattr(Window, "scale", property(lambda _: 2.0))
        assert text_size() == pytest.approx((2 * plain[0], 2 * plain[1]), abs=2)

    def test_no_window_with_gl_is_one_sentence_that_names_render(self, open_viewer, monkeypatch):
        viewer = open_viewer()
        monkeypatch.setattr(viewer.window.glfw, "create_window", lambda *_: None)
        with pytest.raises(ps.ContextError, match=r"no window with OpenGL 3\.3 .*`pointshade render`"):
            Viewer(frames.sphere())

    def test_a_driver_with_the_oldest_gl_alone_opens_one_too_and_is_asked_for_newer_before(
        self, open_viewer, monkeypatch
    ):
        glfw, hints, asked = open_viewer().window.glfw, {}, []
        hint, create = glfw.window_hint, glfw.create_window

        def note(what, value):
            hints[what] = value
            hint(what, value)

        def give(*arguments):
            asked.append((hints[glfw.CONTEXT_VERSION_MAJOR], hints[glfw.CONTEXT_VERSION_MINOR]))
            return create(*arguments) if asked[-1] == (3, 3) else None

        monkeypatch.setattr(glfw, "window_hint", note)
        monkeypatch.setattr(glfw, "create_window", give)
        Window("", (64, 48), print).release()
        assert asked == [(4, 5), (4, 3), (4, 5), (4, 3), (3, 3)]


class TestRest:
    def test_it_draws_only_when_something_has_changed(self, open_viewer):
        viewer = quiet(open_viewer())
        viewer.step(wait=False)
        drawn = viewer.drawn
        for _ in range(5):
            viewer.step(wait=False)
        viewer.handle(Event("move", x=5, y=5))
        viewer.handle(Event("move", x=5, y=5))
        viewer.step(wait=False)
        assert viewer.drawn == drawn
        move(viewer, (5, 5), (50, 50))
        viewer.step(wait=False)
        assert viewer.drawn == drawn + 1

    def test_without_a_message_or_a_stream_it_sleeps_until_it_is_woken(self, open_viewer):
        viewer = quiet(open_viewer())
        viewer.step(wait=False)
        assert viewer.patience(time.perf_counter()) is None
        drawn = viewer.drawn
        waker = threading.Timer(0.05, viewer.window.wake)
        waker.start()
        viewer.step()
        waker.join()
        assert viewer.drawn == drawn

    def test_a_message_wakes_it_once_to_go_away(self, open_viewer, monkeypatch):
        monkeypatch.setattr(messages, "SECONDS", 0.02)
        viewer = open_viewer()
        viewer.say("short")
        assert viewer.patience(time.perf_counter()) == 0
        viewer.step()
        while viewer.messages.text:
            assert viewer.patience(time.perf_counter()) is not None
            viewer.step()
        assert viewer.patience(time.perf_counter()) is None

    def test_moving_the_light_runs_nothing_but_the_light(self, open_viewer):
        viewer = open_viewer()
        for places, steps in (([(10, 10), (50, 50)], {"resolve", "light"}), ([(50, 50), (90, 90)], {"light"})):
            before = viewer.renderer.steps.counts.copy()
            move(viewer, *places)
            viewer.step(wait=False)
            assert viewer.renderer.steps.counts - before == dict.fromkeys(steps, 1)


def test_a_window_that_the_screen_has_no_room_for_is_smaller_with_a_note(open_viewer):
    notes = []
    viewer = open_viewer(window_size=(40000, 30000), notes=notes.append)
    width, height = viewer.window.picture_size
    assert any("larger than the screen" in note and f"{width}x{height}" in note for note in notes)


class TestBar:
    def test_its_buttons_do_what_their_keys_do_and_turn_nothing(self, open_viewer):
        viewer = open_viewer(window_size=(640, 480))
        viewer.step(wait=False)
        before = viewer.state
        for (start, end), (word, _) in zip(button_boxes(viewer.window.scale), BUTTONS, strict=True):
            if word == "save":
                continue
            for kind in ("press", "release"):
                viewer.handle(Event(kind, "left", (start + end) / 2, 24))
            viewer.step(wait=False)
        after = viewer.state
        assert not after.light_mode and after.shadows and not after.finish.is_light and after.help
        assert (after.yaw, after.pitch, after.pan) == (before.yaw, before.pitch, before.pan)

    def test_it_fades_and_comes_back_with_the_mouse(self, open_viewer):
        viewer = open_viewer(window_size=(640, 480))
        viewer.step(wait=False)
        assert viewer._overlay.buttons[0] == 1
        viewer.messages.clear()
        shown_bar = shown(viewer)[10:38, 10:300].astype(int)
        viewer._buttons._until = time.perf_counter() + 0.3
        assert 0 < viewer._overlay.buttons[0] < 1 and viewer.patience(time.perf_counter()) <= 0.2
        viewer._buttons._until = 0.0
        gone = shown(viewer)[10:38, 10:300]
        assert viewer._overlay.buttons is None and (np.abs(gone - shown_bar) > 8).any(-1).mean() > 0.3
        assert viewer.patience(time.perf_counter()) is None
        move(viewer, (300, 200), (100, 30))
        assert viewer._overlay.buttons[2] == "S"

    def test_a_window_that_is_too_narrow_has_none(self, open_viewer):
        viewer = open_viewer(window_size=(320, 240))
        viewer.step(wait=False)
        assert viewer._overlay.buttons is None
