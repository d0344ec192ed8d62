"""The timeline: which frame of how many, jumps, speed, the loop; the mouse is its own only from a press on it."""

import time

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.viewer.controller import BAR as HEIGHT
from pointshade_gl.viewer.events import Event, Seek
from pointshade_gl.viewer.playback import Player

from ..support import frames
from ..support.view_sets import pose_at, seen_from
from ..support.viewing import Spoilt, drag, move, press, quiet, settle, shown

FILM = [seen_from(pose_at(yaw)) for yaw in range(-10, 10, 2)]  # ten frames
BAR = 240 - HEIGHT / 2


@pytest.fixture
def viewer(open_viewer):
    viewer = open_viewer(FILM, fps=30)
    press(viewer, "SPACE", "HOME")
    return viewer


def number(viewer):
    (found,) = (k for k, frame in enumerate(FILM) if frame is viewer.frame)
    assert viewer.document.playback.players[0].index == found
    return found


def mouse(viewer, kind, x, y, key="left"):
    viewer.handle(Event(kind, "" if kind == "move" else key, x, y))
    viewer.step(wait=False)


class TestKeys:
    def test_home_and_end_jump_and_the_message_has_the_total(self, viewer):
        assert number(viewer) == 0
        press(viewer, "END")
        assert number(viewer) == 9 and viewer.messages.text == "frame 9 (0 to 9)"
        press(viewer, "RIGHT")
        assert number(viewer) == 0 and viewer.messages.text == "frame 0 (0 to 9)"

    def test_comma_and_dot_change_the_speed(self, viewer):
        press(viewer, ",")
        assert viewer.document.playback.players[0].rate == 15 and viewer.messages.text == "15 frames per second"
        press(viewer, ".", ".", ".", ".")
        assert viewer.document.playback.players[0].rate == 240
        press(viewer, ".", ".")
        assert viewer.document.playback.players[0].rate is None and viewer.messages.text == "as fast as they come"
        press(viewer, *"," * 12)
        assert viewer.document.playback.players[0].rate == 0.5

    def test_o_lets_it_stop_at_its_end_and_space_plays_it_again(self, viewer):
        press(viewer, "SHIFT+SPACE", ".", ".", "SPACE")
        end = time.monotonic() + 30
        while not viewer.document.playback.players[0].is_paused and time.monotonic() < end:
            viewer.step()
        assert number(viewer) == 9 and viewer.strip.text.endswith("paused")
        press(viewer, "SPACE")
        while number(viewer) == 9 and time.monotonic() < end:
            viewer.step()
        assert number(viewer) == 0

    def test_it_plays_on_from_where_it_was_put(self, viewer):
        press(viewer, "SPACE")
        viewer.perform(Seek(4))
        assert number(viewer) == 4
        end = time.monotonic() + 30
        while number(viewer) == 4 and time.monotonic() < end:
            viewer.step()
        assert number(viewer) == 5


class TestBar:
    def test_it_shows_frame_total_speed_and_loop(self, viewer):
        press(viewer, "END")
        assert viewer.strip == ("frame 9 (0 to 9), 30 frames/s, paused", 1.0)
        press(viewer, "SPACE")
        assert viewer.strip.text == "frame 9 (0 to 9), 30 frames/s, loops"
        press(viewer, "SHIFT+SPACE")
        assert viewer.strip.text.endswith("plays once")

    def test_a_click_jumps_and_a_drag_goes_through_it(self, viewer):
        before = viewer.state
        mouse(viewer, "move", 160, BAR)
        after_move = viewer.state
        mouse(viewer, "press", 160, BAR)
        assert number(viewer) == 5
        mouse(viewer, "move", 250, 100)
        assert number(viewer) == 7
        mouse(viewer, "move", 5000, 100)
        assert number(viewer) == 9
        mouse(viewer, "release", 5000, 100)
        mouse(viewer, "move", 100, 100)
        mouse(viewer, "move", 110, 100)
        assert number(viewer) == 9
        assert after_move.light_at != before.light_at or before.light_mode  # passing over it moves the light
        assert viewer.state.light_at != after_move.light_at and viewer.state.yaw == 0

    def test_passing_over_it_moves_the_light_and_a_drag_that_ends_there_still_turns(self, viewer):
        before = viewer.state.light_at
        move(viewer, (160, 120), (160, 239))
        assert viewer.state.light_at != before
        viewer.handle(Event("press", "left", 160, 100))
        move(viewer, (160, 100), (200, 235))
        viewer.handle(Event("release", "left", 200, 235))
        assert viewer.state.yaw != 0 and number(viewer) == 0

    def test_while_it_is_dragged_it_does_not_play(self, viewer):
        press(viewer, "SPACE", ".", ".", ".")
        mouse(viewer, "press", 16 * 2.5 + 1, BAR)
        for _ in range(5):
            viewer.step(wait=False)
            assert number(viewer) == 1
        mouse(viewer, "release", 16 * 2.5 + 1, BAR)
        end = time.monotonic() + 30
        while number(viewer) == 1 and time.monotonic() < end:
            viewer.step()
        assert number(viewer) == 2

    def test_it_is_filled_as_far_as_it_has_played(self, viewer):
        press(viewer, "END", "LEFT", "LEFT", "LEFT", "LEFT", "LEFT")  # frame 4: half
        bar = shown(quiet(viewer))[-3].astype(int)
        bright = bar[:, 0] > 200
        assert bright[:158].all() and not bright[164:].any()

    def test_it_leaves_room_for_the_panel(self, open_viewer):
        pytest.importorskip("imgui_bundle")
        viewer = open_viewer(FILM, fps=30, window_size=(640, 480), panel=True)
        press(viewer, "SPACE")
        settle(viewer)
        mouse(viewer, "press", 640 - viewer.panel_width - 2, 475)
        mouse(viewer, "release", 640 - viewer.panel_width - 2, 475)
        assert number(viewer) == 9

    def test_unreadable_frames_are_passed_over(self, open_viewer):
        viewer = open_viewer(Spoilt(), fps=30)
        press(viewer, "SPACE")
        viewer.perform(Seek(1))
        assert viewer.document.playback.players[0].index == 2

    def test_it_is_not_in_saved_pictures(self, viewer, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        viewer.state = viewer.state.with_look(shading="none")
        from PIL import Image

        with Image.open(viewer.save_picture()) as saved:
            expected = ps.render(viewer.frame, camera=viewer.camera, pose=viewer.pose, shading="none")
            assert (np.asarray(saved) == expected).all()


class TestNothingToShow:
    def test_a_live_stream_tells_its_rate_and_no_total(self, open_viewer):
        viewer = open_viewer((frames.sphere() for _ in range(200)), fps=100)
        for _ in range(6):
            viewer.step()
        assert viewer.strip.text.startswith("live, ") and viewer.strip.text.endswith("frames/s")
        assert viewer.strip.share is None
        for name, word in (("HOME", "no numbers"), (",", "its own rate"), ("SHIFT+SPACE", "no numbers")):
            press(viewer, name)
            assert word in viewer.messages.text
        drag(viewer, (160, BAR), (200, BAR))
        assert viewer.state.yaw != 0

    @pytest.mark.parametrize("name", ["HOME", "END", ",", ".", "SHIFT+SPACE"])
    def test_a_single_frame_has_none_and_says_so(self, open_viewer, name):
        viewer = open_viewer()
        press(viewer, name)
        assert viewer.strip is None and "single frame" in viewer.messages.text


def test_a_sequence_that_does_not_loop_ends_and_begins_again():
    playback = Player(FILM[:3], fps=1000)
    try:
        playback.toggle_loop()
        seen = [playback.first()]
        end = time.monotonic() + 30
        while not playback.is_paused and time.monotonic() < end:
            if frame := playback.advance(time.monotonic()):
                seen.append(frame)
        assert seen == FILM[:3] and playback.index == 2
        playback.toggle()
        assert playback._queue.get(timeout=10)[0] == 0
    finally:
        playback.close()
