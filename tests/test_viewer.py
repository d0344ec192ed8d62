"""The window, a real one: what input does to what is seen, when it is drawn, what it leaves behind."""

import re
import sys
import threading
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
import pointshade_gl.viewer as viewer_module
from pointshade_gl.viewer import Viewer
from pointshade_gl.viewer_controls import BY_NAME, ESTIMATORS
from pointshade_gl.viewer_events import Event
from pointshade_gl.viewer_state import State
from pointshade_gl.viewer_window import Window

from . import frames
from .test_renderer import living_objects

pytestmark = pytest.mark.usefixtures("display")
BALL = ps.Frame(None, frames.sphere().depth, frames.CAMERA)
README = Path(__file__).resolve().parent.parent / "README.md"


@pytest.fixture
def open_viewer():
    """open_viewer(source, ..., kind=Viewer) opens a window and draws it; at the end GL must not have complained."""
    made = []

    def open_it(source=None, kind=Viewer, **options):
        viewer = kind(source or frames.sphere(), **({"size": (320, 240)} | options))
        made.append(viewer)
        viewer.step(wait=False)
        return viewer

    yield open_it
    for viewer in made:
        with viewer.window:
            error = viewer.screen.gl.error
        viewer.release()
        assert error == "GL_NO_ERROR"


def shown(viewer):
    """What comes to be in the window: (h, w, 3) uint8, top row first."""
    taken = []

    def take():
        gl, (width, height) = viewer.screen.gl, viewer.window.picture_size
        assert gl.error == "GL_NO_ERROR"
        data = gl.screen.read(viewport=(0, 0, width, height), alignment=1)
        assert gl.error in ("GL_NO_ERROR", "GL_INVALID_OPERATION")  # moderngl asks a window for its attachment 0
        taken.append(np.frombuffer(data, np.uint8).reshape(height, width, 3)[::-1])

    with pytest.MonkeyPatch.context() as instead:
        instead.setattr(viewer.window, "swap", take)
        viewer.handle(Event("refresh"))
        viewer.step(wait=False)
    return taken[0]


def move(viewer, *places, steps=10):
    for start, end in pairwise(places):
        for k in range(steps + 1):
            x, y = np.array(start) + (np.array(end) - start) * k / steps
            viewer.handle(Event("move", x=x, y=y))


def drag(viewer, start, end, button="left", **held):
    viewer.handle(Event("press", button, *start, **held))
    move(viewer, start, end)
    viewer.handle(Event("release", button, *end, **held))


def press(viewer, *names):
    for name in names:
        viewer.handle(Event("key", name))


def quiet(viewer):
    """No message over the picture."""
    viewer._message, viewer._until = "", float("inf")
    return viewer


def brightness(picture):
    """Mean of the left, right, upper and lower half of the ball."""
    grey = picture.astype(float).mean(-1)[51:197, 97:243]
    return grey[:, :73].mean(), grey[:, 73:].mean(), grey[:73].mean(), grey[73:].mean()


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
            assert viewer.drawn == drawn and viewer._patience() is None
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


class TestKeys:
    def test_1_to_4_choose_the_shading_and_b_compares(self, open_viewer):
        viewer = open_viewer()
        move(viewer, (160, 120), (20, 20))
        pictures = []
        for name in "1234":
            press(viewer, name)
            pictures.append(shown(quiet(viewer)))
        unlit = pictures[0]
        assert all((a != b).any() for k, a in enumerate(pictures) for b in pictures[:k])
        press(viewer, "B")
        assert (shown(quiet(viewer)) == unlit).all()
        press(viewer, "B")
        assert (shown(quiet(viewer)) == pictures[3]).all()

    def test_n_goes_through_the_estimators_and_says_which(self, open_viewer):
        viewer = open_viewer()
        seen = []
        for _ in ESTIMATORS:
            press(viewer, "N")
            viewer.step(wait=False)
            seen.append(viewer.renderer.choice.method)
            assert viewer.state.normals in viewer._message
        assert seen[:-1] == list(ESTIMATORS[1:]) and viewer.state.normals == "auto"

    def test_plus_and_minus_change_the_point_size_and_find_the_way_back(self, open_viewer):
        viewer = open_viewer()
        press(viewer, "+", "=")
        assert viewer.state.size > 1.5
        press(viewer, "-", "-")
        assert viewer.state.size == 1

    def test_p_writes_what_is_seen_under_a_new_name_and_prints_it(self, open_viewer, tmp_path, monkeypatch, capsys):
        monkeypatch.chdir(tmp_path)
        viewer = open_viewer()
        press(viewer, "P", "1", "P")
        names = capsys.readouterr().out.split()
        assert names == ["pointshade_0001.png", "pointshade_0002.png"]
        with Image.open(names[1]) as image:
            expected = ps.render(viewer.frame, camera=viewer.frame.camera.fitted(320, 240), shading="none")
            assert (np.asarray(image) == expected).all()

    def test_a_picture_that_cannot_be_written_is_said_and_nothing_ends(self, open_viewer, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        viewer = open_viewer()
        monkeypatch.setattr(viewer_module, "save_image", lambda *_: (_ for _ in ()).throw(OSError("the disk is full")))
        press(viewer, "P")
        assert "the disk is full" in viewer._message

    def test_h_shows_the_help_and_escape_closes_it_before_the_window(self, open_viewer):
        viewer = quiet(open_viewer())
        before = shown(viewer)
        press(viewer, "H")
        assert (shown(viewer) != before).mean() > 0.3
        press(viewer, "ESCAPE")
        assert (shown(viewer) == before).all() and not viewer.window.is_closing
        press(viewer, "ESCAPE")
        assert viewer.window.is_closing

    def test_s_says_that_there_are_no_shadows_yet(self, open_viewer):
        viewer = open_viewer()
        before = shown(quiet(viewer))
        press(viewer, "S")
        assert "not yet" in viewer._message
        assert (shown(viewer) != before).any()

    @pytest.mark.parametrize("name", ["SPACE", "LEFT", "RIGHT"])
    def test_keys_of_a_stream_say_that_there_is_none(self, open_viewer, name):
        viewer = open_viewer()
        press(viewer, name)
        assert "single frame" in viewer._message

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
        assert viewer._patience() is None
        drawn = viewer.drawn
        waker = threading.Timer(0.05, viewer.window.wake)
        waker.start()
        viewer.step()
        waker.join()
        assert viewer.drawn == drawn

    def test_a_message_wakes_it_once_to_go_away(self, open_viewer, monkeypatch):
        monkeypatch.setattr(viewer_module, "MESSAGE_SECONDS", 0.02)
        viewer = open_viewer()
        viewer.say("short")
        assert viewer._patience() == 0
        viewer.step()
        while viewer._message:
            assert viewer._patience() is not None
            viewer.step()
        assert viewer._patience() is None

    def test_moving_the_light_runs_nothing_but_the_light(self, open_viewer):
        viewer = open_viewer()
        before = viewer.renderer.steps.counts.copy()
        move(viewer, (10, 10), (50, 50))
        viewer.step(wait=False)
        assert viewer.renderer.steps.counts - before == {"resolve": 1}


class Spoilt(Sequence):
    """Three frames, the middle one unreadable."""

    frames = (frames.sphere(), None, frames.tilted_plane())

    def __len__(self):
        return 3

    def __getitem__(self, index):
        if self.frames[index] is None:
            raise ValueError(f"frame {index} is broken")
        return self.frames[index]


class TestStreams:
    def test_a_sequence_plays_over_and_over_past_what_cannot_be_read(self, open_viewer, capsys):
        viewer = open_viewer(Spoilt(), fps=200)
        seen = []
        while len(seen) < 5:
            viewer.step()
            if not seen or viewer.frame is not seen[-1]:
                seen.append(viewer.frame)
        first, _, last = Spoilt.frames
        assert seen == [first, last, first, last, first]
        assert capsys.readouterr().err == "warning: skipped: frame 1 is broken\n"
        assert "frame 1 is broken" in viewer._message

    def test_space_pauses_and_the_arrows_step(self, open_viewer):
        first, _, last = Spoilt.frames
        viewer = open_viewer(Spoilt(), fps=500)
        press(viewer, "SPACE")
        while viewer.frame is not last:
            press(viewer, "RIGHT")
        press(viewer, "LEFT")
        assert viewer.frame is first
        viewer.step(wait=False)
        assert viewer._playback.patience(0) is None
        press(viewer, "SPACE")
        while viewer.frame is first:
            viewer.step()
        assert viewer.frame is last

    def test_any_iterable_is_a_stream_and_its_end_leaves_the_last_frame(self, open_viewer):
        viewer = open_viewer(iter([frames.sphere(), frames.step()]))
        last = None
        while viewer._playback._thread.is_alive() or not viewer._playback._queue.empty():
            viewer.step(wait=False)
            last = viewer.frame
        assert last.depth[0, 0] == pytest.approx(1.2)

    def test_what_a_stream_raises_otherwise_ends_the_viewer(self, open_viewer):
        def camera():
            yield frames.sphere()
            raise RuntimeError("unplugged")

        with pytest.raises(RuntimeError, match="unplugged"):
            Viewer(camera(), size=(64, 48)).run()

    def test_a_source_without_frames_is_said(self, display):
        with pytest.raises(ValueError, match="no frame"):
            Viewer(iter([]))

    def test_a_film_of_what_is_seen_is_written(self, tmp_path):
        viewer = Viewer(frames.sphere(), size=(64, 48), record=tmp_path / "film.gif", fps=100)
        while viewer._recorder._written < 5:
            viewer.step()
        viewer.window.glfw.set_window_size(viewer.window.handle, 100, 90)
        while viewer._recorder._written < 10:
            viewer.step()
        viewer.release()
        with Image.open(tmp_path / "film.gif") as film:
            assert film.size == (64, 48)


class TestApplication:
    def test_the_readme_s_example_moves_the_light_by_itself(self, display, monkeypatch):
        example = re.search(r"```python\n(import math.*?)```", README.read_text(), re.DOTALL)[1]
        turns = []

        def few_turns(viewer):
            for _ in range(8):
                viewer.step()
                turns.append((viewer.state.towards, viewer.drawn))
            viewer.release()

        monkeypatch.setattr(Viewer, "run", few_turns)
        exec(example, {})
        assert len({tuple(towards) for towards, _ in turns}) == 8
        assert turns[-1][1] == 8

    def test_events_reach_it_first_and_true_keeps_them_from_us(self, open_viewer):
        class Deaf(Viewer):
            def on_event(self, event):
                return event.key == "Q"

        viewer = open_viewer(kind=Deaf)
        press(viewer, "Q", "H")
        assert viewer.state.help and not viewer.window.is_closing

    def test_run_starts_it_draws_and_frees_everything(self, display):
        class Brief(Viewer):
            told = ()

            def on_start(self):
                self.told += ("start",)

            def on_frame(self, seconds):
                self.told += ("frame",)
                if self.drawn:
                    self.quit()

        viewer = Brief(frames.sphere(), size=(64, 48))
        viewer.run()
        assert viewer.told[:2] == ("start", "frame") and viewer.drawn
        assert viewer.window.handle is None


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
        state = State(material=ps.Material(0.1, 7, 0.3, 900), size=0.01, max_depth_step="0.07", light_intensity=9)
        viewer = open_viewer(state=replace(state, panel=True))
        for _ in range(4):
            viewer.step(wait=False)
        assert viewer.state == replace(state, panel=True)

    def test_without_its_extra_the_viewer_works_and_says_how_to_get_it(self, open_viewer, monkeypatch):
        monkeypatch.setitem(sys.modules, "imgui_bundle", None)
        viewer = open_viewer()
        press(viewer, "G")
        assert "pip install 'pointshade-gl[gui]'" in viewer._message and not viewer.state.panel


def random_input(rng):
    """One event, of any kind, anywhere."""
    kind = rng.choice(["key", "move", "move", "move", "press", "release", "wheel", "leave", "refresh"])
    names = sorted(set(BY_NAME) - {"Q", "ESCAPE", "P"})
    key = {"key": rng.choice(names), "press": rng.choice(["left", "middle", "right"])}.get(kind, "left")
    held = {"ctrl": bool(rng.random() < 0.3), "shift": bool(rng.random() < 0.3)}
    return Event(kind, str(key), *rng.uniform(-50, 400, 2), steps=float(rng.choice([-1, 1, 0.3])), **held)


def test_300_pictures_with_random_input_leave_no_error_and_no_object(display):
    rng = np.random.default_rng(4)
    bare = Viewer(frames.sphere(), size=(200, 150))
    real_release, counts = bare.screen.gl.release, {}
    viewer = Viewer(Spoilt(), size=(200, 150), fps=100)
    find = viewer.window.glfw.get_proc_address
    with bare.window:
        bare.screen.renderer.release()
        bare.screen._present.release()
        empty = living_objects(bare.screen.gl, find)
    real_release()

    context, release = viewer.screen.gl, viewer.screen.gl.release

    def count_and_release():
        with viewer.window:
            counts.update(living_objects(context, find), error=context.error)
        release()

    context.release = count_and_release
    for k in range(300):
        for _ in range(rng.integers(1, 6)):
            viewer.handle(random_input(rng))
        if k % 40 == 20:
            viewer.window.glfw.set_window_size(viewer.window.handle, *(int(n) for n in rng.integers(20, 400, 2)))
        viewer.handle(Event("refresh"))
        viewer.step(wait=False)
    assert viewer.drawn == 300
    viewer.release()
    assert counts.pop("error") == "GL_NO_ERROR"
    assert counts == empty
