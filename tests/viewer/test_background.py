"""What takes long runs beside the window: it is seen, the window answers, and Escape ends it."""

import threading
import time

import pytest

import pointshade_gl as ps
from pointshade_gl.checks.arguments import Count, checkpoint
from pointshade_gl.notes.errors import Cancelled
from pointshade_gl.viewer import document as documents
from pointshade_gl.viewer.background import Background, Work
from pointshade_gl.viewer.events import Event, Remember, ShowFrame

from ..support import frames
from ..support.places import ROOT
from ..support.viewing import move, press, shown

PLANE = ps.Frame(frames.sphere().color, frames.sphere().depth, frames.CAMERA)


class Slow:
    """Something that goes on until the gate is opened, or it is ended."""

    def __init__(self, real):
        self.real, self.gate, self.runs = real, threading.Event(), 0

    def __call__(self, *arguments, progress=None, **options):
        if threading.current_thread() is not threading.main_thread():
            self.runs += 1
            for k in range(10_000):
                if self.gate.wait(0.005):
                    break
                Count(progress, 4).step(min(k, 1))
                checkpoint()
        return self.real(*arguments, progress=progress, **options)


def work(do, done=None, failed=None, **options):
    told = []
    taken = Work("counting", do, done or (lambda result: told.append(result)), failed or told.append, **options)
    return taken, told


def until(condition, step):
    end = time.monotonic() + 60
    while not condition():
        step()
        assert time.monotonic() < end


class TestBackground:
    def test_what_ends_at_once_is_done_when_it_has_started(self):
        one, told = work(lambda _: 7)
        background = Background(lambda: None, grace=60)
        background.start(one)
        assert told == [7] and background.work is None and background.title == ""

    def test_how_far_it_is_and_that_it_ended_wakes_the_window(self):
        gate, woken = threading.Event(), []

        def do(progress):
            progress(1, 4)
            gate.wait(60)
            return "end"

        one, told = work(do)
        background = Background(lambda: woken.append(1), grace=0)
        background.start(one)
        until(lambda: background.share == 0.25, background.poll)
        assert "counting" in background.title and "Esc" in background.title and woken
        gate.set()
        until(lambda: told, background.poll)
        assert told == ["end"]

    def test_what_it_raised_is_seen_in_the_thread_of_the_window(self):
        seen = []
        one, _ = work(lambda _: 1 / 0, failed=lambda error: seen.append((error, threading.current_thread())))
        Background(lambda: None, grace=60).start(one)
        ((error, thread),) = seen
        assert isinstance(error, ZeroDivisionError) and thread is threading.current_thread()

    def test_ended_work_with_the_renderer_goes_on_to_where_it_can_be_left(self):
        slow = Slow(lambda progress: None)
        one, told = work(lambda progress: slow(progress=progress))
        background = Background(lambda: None, grace=0)
        background.start(one)
        background.end()
        until(lambda: told, background.poll)
        assert isinstance(told[0], Cancelled) and not background.lends

    def test_other_work_is_left_alone_at_once_and_its_result_is_given_back(self):
        gate, unused = threading.Event(), []
        one, told = work(lambda _: gate.wait(60) and "late", lends=False, unused=unused.append)
        background = Background(lambda: None, grace=0)
        background.start(one)
        background.end()
        assert isinstance(told[0], Cancelled) and background.work is None
        gate.set()
        until(lambda: unused, lambda: time.sleep(0.01))
        assert unused == ["late"] and len(told) == 1


@pytest.fixture
def slowed(open_viewer, monkeypatch):
    """slowed(name of the renderer's method): a viewer whose background takes long, and what lets it go on."""

    def slow_down(name, source=PLANE):
        viewer = open_viewer(source)
        slow = Slow(getattr(viewer.screen.renderer, name))
        monkeypatch.setattr(viewer.screen.renderer, name, slow)
        viewer.background.grace = 0
        return viewer, slow

    return slow_down


class TestEstimate:
    def test_it_is_seen_and_the_window_answers_while_it_runs(self, slowed):
        viewer, slow = slowed("draw")
        press(viewer, "U")
        viewer.step(wait=False)
        assert "dividing the light out" in viewer._overlay.strip.text
        drawn, light = viewer.drawn, viewer.state.light_at
        move(viewer, (50, 50), (90, 60))
        viewer.handle(Event("refresh"))
        viewer.step(wait=False)
        assert viewer.drawn == drawn + 1 and viewer.state.light_at != light and viewer.background.lends
        slow.gate.set()
        until(lambda: not viewer.background.work, lambda: viewer.step(wait=False))
        assert viewer.state.look.unlight and slow.runs == 1

    def test_meanwhile_the_last_picture_is_seen(self, slowed):
        viewer, slow = slowed("draw")
        viewer.messages.clear()
        before = shown(viewer)
        press(viewer, "U")
        viewer.messages.clear()
        viewer.step(wait=False)
        after = shown(viewer)
        assert (before[:180] == after[:180]).all() and (before[215:] != after[215:]).any()  # the bar is below
        slow.gate.set()

    def test_why_nothing_was_found_is_said_in_the_window(self, open_viewer):
        viewer = open_viewer(PLANE)
        press(viewer, "U")
        viewer.step(wait=False)
        assert viewer.messages.text.startswith("unlight: the picture does not tell its light")

    def test_escape_ends_it_and_brings_back_what_was(self, slowed):
        viewer, _ = slowed("draw")
        before = viewer.state
        press(viewer, "U")
        viewer.step(wait=False)
        press(viewer, "ESCAPE")
        until(lambda: not viewer.background.work, lambda: viewer.step(wait=False))
        assert viewer.state.look == before.look and not viewer.window.is_closing
        press(viewer, "CTRL+Z")
        assert viewer.state.look == before.look

    def test_escape_brings_back_the_switches_too_and_that_is_no_step(self, slowed):
        nodes = [ps.Node(ps.PointObject(frames.sphere()), name) for name in ("one", "other")]
        viewer, _ = slowed("draw", ps.Scene(tuple(nodes), camera=frames.CAMERA))
        viewer.perform(ShowFrame(viewer.frame.with_node((1,), visible=False)))
        viewer.perform(Remember())
        viewer.step(wait=False)
        press(viewer, "ESCAPE")
        until(lambda: not viewer.background.work, lambda: viewer.step(wait=False))
        assert [node.visible for _, node in viewer.frame.every_node()] == [True, True]
        viewer.handle(Event("key", "Z", ctrl=True))
        assert viewer.messages.text == "nothing to undo"

    def test_after_escape_it_can_be_asked_for_again(self, slowed):
        viewer, slow = slowed("draw")
        press(viewer, "U")
        viewer.step(wait=False)
        press(viewer, "ESCAPE")
        until(lambda: not viewer.background.work, lambda: viewer.step(wait=False))
        slow.gate.set()
        press(viewer, "U")
        until(lambda: slow.runs == 2 and not viewer.background.work, lambda: viewer.step(wait=False))
        assert viewer.state.look.unlight

    def test_a_window_that_is_closed_ends_it(self, slowed):
        viewer, slow = slowed("draw")
        press(viewer, "U")
        viewer.step(wait=False)
        with viewer.window:
            assert viewer.screen.gl.error == "GL_NO_ERROR"
        viewer.background.close()
        assert slow.runs == 1 and not viewer.background.lends

    def test_an_application_that_asks_for_the_renderer_waits(self, slowed):
        viewer, slow = slowed("draw")
        press(viewer, "U")
        viewer.step(wait=False)
        threading.Timer(0.05, slow.gate.set).start()
        assert viewer.renderer is viewer.screen.renderer and viewer.background.work is None


class TestSaving:
    def test_escape_ends_it_and_leaves_no_file(self, slowed, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        viewer, _ = slowed("render")
        press(viewer, "P")
        viewer.step(wait=False)
        assert "saving" in viewer._overlay.strip.text
        press(viewer, "P")
        assert "not yet" in viewer.messages.text
        press(viewer, "ESCAPE")
        until(lambda: not viewer.background.work, lambda: viewer.step(wait=False))
        assert viewer.messages.text == "not saved" and not list(tmp_path.iterdir())

    def test_it_is_saved_while_the_window_goes_on(self, slowed, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        viewer, slow = slowed("render")
        press(viewer, "P")
        viewer.step(wait=False)
        slow.gate.set()
        until(lambda: not viewer.background.work, lambda: viewer.step(wait=False))
        assert viewer.messages.text.startswith("saved") and len(list(tmp_path.iterdir())) == 1

    def test_a_window_that_is_closed_saves_it_first(self, display, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        viewer = ps.viewer.Viewer(PLANE, window_size=(64, 48))
        slow = Slow(viewer.screen.renderer.render)
        monkeypatch.setattr(viewer.screen.renderer, "render", slow)
        viewer.background.grace = 0
        press(viewer, "P", "Q")
        threading.Timer(0.1, slow.gate.set).start()
        viewer.run()
        assert len(list(tmp_path.iterdir())) == 1


class TestOpening:
    def test_escape_leaves_what_was_open_and_closes_what_comes_too_late(self, open_viewer, monkeypatch):
        viewer, gate, read = open_viewer(PLANE), threading.Event(), documents.read_dropped
        closed, close = [], documents.Playback.close

        def slowly(paths):
            gate.wait(60)
            return read(paths)

        monkeypatch.setattr(documents.Playback, "close", lambda playing: (closed.append(playing), close(playing)))

        monkeypatch.setattr(documents, "read_dropped", slowly)
        viewer.background.grace = 0
        path = str(ROOT / "assets" / "vase")
        viewer.handle(Event("drop", paths=(path,)))
        viewer.step(wait=False)
        assert "opening" in viewer._overlay.strip.text
        press(viewer, "ESCAPE")
        assert viewer.messages.text == "not opened" and viewer.frame is PLANE
        gate.set()
        until(lambda: closed, lambda: time.sleep(0.01))
        assert closed != [viewer.document.playback]

    def test_meanwhile_the_window_draws_what_is_asked_for(self, open_viewer, monkeypatch):
        viewer, gate, read = open_viewer(PLANE), threading.Event(), documents.read_dropped
        monkeypatch.setattr(documents, "read_dropped", lambda paths: (gate.wait(60), read(paths))[1])
        viewer.background.grace = 0
        viewer.handle(Event("drop", paths=(str(ROOT / "assets" / "vase"),)))
        press(viewer, "U")
        drawn = viewer.drawn
        viewer.step(wait=False)
        assert viewer.drawn == drawn + 1 and viewer.state.look.unlight and "opening" in viewer.background.title
        gate.set()
        until(lambda: viewer.frame is not PLANE, lambda: viewer.step(wait=False))


class TestFilm:
    def test_it_goes_on_with_the_last_picture(self, open_viewer, tmp_path):
        pytest.importorskip("imageio_ffmpeg")
        viewer = open_viewer(PLANE, record=tmp_path / "film.mp4")
        slow = Slow(viewer.screen.renderer.draw)
        viewer.screen.renderer.draw = slow
        viewer.background.grace = 0
        press(viewer, "U")
        viewer.step(wait=False)
        before = viewer.recorder._written
        until(lambda: viewer.recorder._written > before, lambda: viewer.step(wait=False))
        assert viewer.background.lends
        slow.gate.set()
        until(lambda: not viewer.background.work, lambda: viewer.step(wait=False))
