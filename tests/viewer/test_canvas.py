"""The viewer on rendercanvas' canvases, off screen. In Qt, notebooks and browsers: tests/clients/test_canvases.py."""

import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from rendercanvas.offscreen import RenderCanvas

import pointshade_gl as ps
from pointshade_gl.renderer.requests import load_all_sides
from pointshade_gl.scene.orbit import State
from pointshade_gl.viewer.canvas import event_of

from ..support import frames
from ..support.viewing import BALL

CAMERA = frames.CAMERA
SIZE = CAMERA.width, CAMERA.height
MIDDLE = SIZE[0] / 2, SIZE[1] / 2


def told(kind, x=0.0, y=0.0, **more):
    """An event as rendercanvas has it."""
    return {"event_type": kind, "x": x, "y": y, "modifiers": (), **more}


def point(view, *places):
    for x, y in places:
        view.send(told("pointer_move", x, y))


def press(view, *keys, held=()):
    for key in keys:
        view.send({"event_type": "key_down", "key": key, "modifiers": held})
    view.canvas.draw()


def drag(view, start, end, button=1):
    view.send(told("pointer_down", *start, button=button))
    point(view, *np.linspace(start, end, 5))
    view.send(told("pointer_up", *end, button=button))


@pytest.fixture
def open_canvas():
    opened = []

    def opening(source=BALL, backend="offscreen", **options):
        opened.append(view := ps.canvas(source, backend, **({"window_size": SIZE} | options)))
        view.messages.clear()
        view._buttons._until = 0.0
        return view

    yield opening
    for view in opened:
        view.canvas.close()


def halves(view):
    """Mean brightness of the left and the right half of what the canvas shows."""
    grey = view.canvas.draw()[..., :3].astype(float).mean(-1)
    return np.array([half.mean() for half in np.array_split(grey, 2, axis=1)])


@pytest.mark.gl
class TestOffscreen:
    def test_it_draws_what_the_window_draws(self, open_canvas, renderer):
        view = open_canvas(state=State(lit=False))
        picture = view.canvas.draw()
        assert picture.shape == (CAMERA.height, CAMERA.width, 4) and picture.dtype == np.uint8
        expected = renderer.render(BALL, shading="none")
        inside = expected[..., 3] == 255
        np.testing.assert_array_equal(picture[inside], expected[inside])  # top row first
        assert (picture[..., 3] == 255).all()

    def test_the_light_follows_the_mouse(self, open_canvas):
        view = open_canvas()
        point(view, *np.linspace(MIDDLE, (0.35 * SIZE[0], MIDDLE[1]), 9))
        from_left = halves(view)
        point(view, *np.linspace((0.35 * SIZE[0], MIDDLE[1]), (0.65 * SIZE[0], MIDDLE[1]), 9))
        from_right = halves(view)
        assert from_left[0] > from_left[1] + 4 and from_right[1] > from_right[0] + 4

    def test_a_drag_turns_the_object_and_the_wheel_zooms(self, open_canvas):
        view = open_canvas()
        drag(view, MIDDLE, (MIDDLE[0] + 40, MIDDLE[1]))
        view.canvas.draw()
        assert view.state.yaw != 0
        before = view.state.distance
        view.send(told("wheel", *MIDDLE, dx=0.0, dy=-100.0))
        view.canvas.draw()
        assert view.state.distance < before  # away from the user: nearer

    def test_keys_do_what_they_do_in_the_window(self, open_canvas):
        view = open_canvas()
        press(view, "b")
        assert not view.state.lit
        press(view, "\x1a", held=("Control",))  # as Qt tells Ctrl+Z
        assert view.state.lit
        press(view, "v")
        assert view.state.finish.show == "normals"
        press(view, "V", held=("Shift",))
        assert view.state.finish.show == "light"

    @pytest.mark.parametrize("key", ["p", "o", "f", "q", "Escape"])
    def test_no_key_writes_opens_or_closes_anything(self, open_canvas, monkeypatch, tmp_path, key):
        monkeypatch.chdir(tmp_path)
        view = open_canvas()
        press(view, key)
        assert "up to the application" in view.messages.text
        assert not view.canvas.get_closed() and not view.background.work and not list(tmp_path.iterdir())

    def test_neither_the_bar_nor_the_greeting_offers_what_it_does_not_do(self, open_canvas):
        view = ps.canvas(BALL, "offscreen", window_size=(640, 480))
        view.canvas.draw()
        assert "Drop" not in view.messages.text and "H for help" in view.messages.text
        words = [word for word, *_ in view._overlay.buttons[1]]
        assert words == ["light", "shadow", "view", "help"]
        view.canvas.close()

    def test_what_rests_is_refined_and_then_left_alone(self, open_canvas):
        view = open_canvas()
        view.samples = 4
        point(view, MIDDLE, (MIDDLE[0] + 30, MIDDLE[1]))
        view.canvas.draw()
        assert view.redrawing.samples == 1
        for _ in range(20):
            if (seconds := view.patience(time.perf_counter())) is None:
                break
            time.sleep(seconds)
            view.canvas.draw()
        assert view.redrawing.samples == 4 and view.patience(time.perf_counter()) is None
        drawn = view.drawn
        view.canvas.draw()
        assert view.drawn == drawn

    def test_it_follows_the_canvas_s_size_and_pixels(self, open_canvas):
        view = open_canvas()
        view.canvas.draw()
        view.canvas.set_physical_size(500, 300)
        assert view.canvas.draw().shape == (300, 500, 4)
        view.canvas.set_pixel_ratio(2.0)
        view.canvas.draw()
        view.send(told("pointer_move", 100.0, 50.0))  # logical pixels
        view.canvas.draw()
        assert view.control.mouse.last == (200.0, 100.0)

    def test_a_canvas_of_the_application_is_taken(self, open_canvas):
        own = RenderCanvas(size=(200, 100))
        view = open_canvas(backend=own)
        assert view.canvas is own and own.draw().shape == (100, 200, 4)
        view.run()  # the application runs its loop
        assert not own.get_closed()

    def test_another_state_is_seen(self, open_canvas):
        view = open_canvas()
        before = view.canvas.draw()
        view.state = view.state.with_light_direction((1.0, 0.0, 0.3))
        assert np.abs(view.canvas.draw().astype(int) - before).max() > 50

    def test_it_starts_once_and_reset_brings_that_back(self, open_canvas):
        view, started = open_canvas(), []
        view.on_start = lambda: started.append(1)
        view.state = turned = view.state.turned(20.0, 0.0, view.stage.axis)
        view.canvas.draw()
        drag(view, MIDDLE, (MIDDLE[0] + 40, MIDDLE[1]))
        view.canvas.draw()
        press(view, "r")
        assert started == [1] and view.state.yaw == turned.yaw

    def test_what_takes_long_is_waited_for(self, open_canvas):
        view = open_canvas(ps.load_scene("demo"))
        picture = view.canvas.draw()
        assert not view.background.work and picture.std() > 10  # the scene, not a bar

    def test_two_are_independent(self, open_canvas):
        one, other = open_canvas(), open_canvas()
        press(one, "b")
        other.canvas.draw()
        assert not one.state.lit and other.state.lit
        one.canvas.close()
        assert other.canvas.draw().any()

    def test_events_and_pictures_may_come_from_other_threads(self, open_canvas):
        """JupyterLab's messages reach Python in a thread of their own."""
        view = open_canvas()
        view.canvas.draw()
        with ThreadPoolExecutor(1) as thread:
            thread.submit(point, view, MIDDLE, (0.35 * SIZE[0], MIDDLE[1])).result()
            picture = thread.submit(view.canvas.draw).result()
        assert (view.drawn, view.control.mouse.last) == (2, (0.35 * SIZE[0], MIDDLE[1]))
        assert np.array_equal(view.canvas.draw(), picture)
        with ThreadPoolExecutor(1) as thread:
            thread.submit(view.canvas.close).result()
        assert view.window.renderer.context.is_released

    def test_closing_frees_everything(self, open_canvas):
        view = open_canvas()
        view.canvas.draw()
        view.canvas.close()
        assert view.window.renderer.context.is_released
        view.release()  # once more is nothing

    def test_dropped_it_is_closed_after_its_renderer_without_an_error(self, open_canvas):
        view = open_canvas()
        view.canvas.draw()
        view.window.renderer.release()
        view.send({"event_type": "close"})

    @pytest.mark.parametrize("size", [(320, 240), (640, 480)])
    def test_help_and_panel_open(self, open_canvas, size):
        view = open_canvas(window_size=size)
        plain = view.canvas.draw()
        press(view, "h")
        assert view.state.help and (view.canvas.draw() != plain).any()
        pytest.importorskip("imgui_bundle")
        press(view, "h", "g")
        for _ in range(4):
            picture = view.canvas.draw()
        assert view.state.panel and view.panel_covers > 0
        assert (picture[:, -view.panel_covers :] != plain[:, -view.panel_covers :]).mean() > 0.5


class TestEvents:
    def test_what_the_viewer_does_not_know_is_nothing(self):
        assert event_of(told("double_click", button=1), 1.0) is None
        assert event_of(told("pointer_down", button=7), 1.0) is None

    @pytest.mark.parametrize(
        ("name", "key"),
        [("ArrowLeft", "LEFT"), (" ", "SPACE"), ("\r", "ENTER"), ("Escape", "ESCAPE"), ("a", "A"), ("F11", "F11"),
         ("+", "+"), ("", "")],
    )  # fmt: skip
    def test_keys_have_the_names_of_the_window(self, name, key):
        assert event_of({"event_type": "key_down", "key": name, "modifiers": ("Control",)}, 1.0).key == key

    def test_buttons_wheel_and_held_keys(self):
        pressed = event_of(told("pointer_down", 3.0, 4.0, button=2, modifiers=("Shift", "Meta"), time_stamp=7.0), 1.5)
        assert (pressed.kind, pressed.key, pressed.x, pressed.y) == ("press", "right", 4.5, 6.0)
        assert pressed.ctrl and pressed.shift and pressed.time == 7.0
        assert event_of(told("wheel", dx=-100.0, dy=0.0), 1.0).steps == 1.0  # macOS, with Shift
        assert event_of({"event_type": "char", "data": "x", "modifiers": None}, 1.0).key == "x"


class TestErrors:
    def test_a_missing_extra_is_named(self, monkeypatch):
        for name in [name for name in sys.modules if name.split(".")[0] == "rendercanvas"]:
            monkeypatch.delitem(sys.modules, name)
        monkeypatch.setitem(sys.modules, "rendercanvas", None)
        with pytest.raises(ValueError, match=r"a canvas needs rendercanvas: pip install '\.\[canvas\]'"):
            ps.canvas(BALL, "offscreen")

    @pytest.mark.parametrize("backend", ["gtk", "../x", ""])
    def test_an_unknown_backend_is_named(self, backend):
        with pytest.raises(ValueError, match=f"backend '{backend}' cannot be used"):
            ps.canvas(BALL, backend)

    def test_a_backend_without_what_it_needs_is_told(self, monkeypatch):
        class Needs:
            def __init__(self, **_):
                raise ModuleNotFoundError("No module named 'wgpu'")

        monkeypatch.setattr("rendercanvas.offscreen.RenderCanvas", Needs)
        with pytest.raises(
            ValueError, match=r"'offscreen' cannot be used \(No module named 'wgpu'\): name another, such"
        ):
            ps.canvas(BALL, "offscreen")

    def test_what_is_no_canvas_is_told(self):
        with pytest.raises(TypeError, match="backend must be the name of one, or a canvas of rendercanvas"):
            ps.canvas(BALL, 3)

    @pytest.mark.gl
    def test_the_viewer_s_own_errors_come_through(self):
        with pytest.raises(TypeError, match="source must be a Frame"):
            ps.canvas(3, "offscreen")
        with pytest.raises(TypeError, match="unexpected keyword"):
            ps.canvas(BALL, "offscreen", wrong=1)


def test_the_built_in_vase_by_its_name_begins_with_its_front_and_has_its_other_sides(open_canvas):
    view = open_canvas("vase")
    assert isinstance(view.frame, ps.Frame) and view.document.playback.whole is load_all_sides
    assert open_canvas(ps.load_frame("vase")).document.playback.whole is None
