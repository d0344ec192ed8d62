"""The window in an application: its methods to override, its end, what it frees."""

import re

import numpy as np
import pytest

from pointshade_gl.viewer import Viewer
from pointshade_gl.viewer.events import Event
from pointshade_gl.viewer.keys import BY_NAME

from ..renderer.test_renderer import living_objects
from ..support import frames
from ..support.places import ROOT
from ..support.viewing import Spoilt, press


class TestApplication:
    def test_the_example_of_the_page_moves_the_light_by_itself(self, display, monkeypatch):
        example = re.search(
            r"```python\n(import math.*?)```", (ROOT / "docs/window.md").read_text(encoding="utf-8"), re.DOTALL
        )[1]
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

        viewer = Brief(frames.sphere(), window_size=(64, 48))
        viewer.run()
        assert viewer.told[:2] == ("start", "frame") and viewer.drawn
        assert viewer.window.handle is None


def random_input(rng, names):
    """One event, of any kind, anywhere; keys of these names."""
    kind = rng.choice(["key", "move", "move", "move", "press", "release", "wheel", "leave", "refresh"])
    key = {"key": rng.choice(names), "press": rng.choice(["left", "middle", "right"])}.get(kind, "left")
    held = {"ctrl": bool(rng.random() < 0.3), "shift": bool(rng.random() < 0.3)}
    return Event(kind, str(key), *rng.uniform(-50, 400, 2), steps=float(rng.choice([-1, 1, 0.3])), **held)


@pytest.mark.system
@pytest.mark.parametrize(("pictures", "without"), [(120, "M"), (60, "S")])  # shadows of large merged points are slow
def test_pictures_with_random_input_leave_no_error_and_no_object(display, pictures, without):
    rng, names = np.random.default_rng(4), sorted(set(BY_NAME) - {"Q", "ESCAPE", "P", without})
    bare = Viewer(frames.sphere(), window_size=(200, 150))
    real_release, counts = bare.screen.gl.release, {}
    viewer = Viewer(Spoilt(), window_size=(200, 150), fps=100)
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
    for k in range(pictures):
        for _ in range(rng.integers(1, 6)):
            viewer.handle(random_input(rng, names))
        if k % 40 == 20:
            viewer.window.glfw.set_window_size(viewer.window.handle, *(int(n) for n in rng.integers(20, 400, 2)))
        viewer.handle(Event("refresh"))
        viewer.step(wait=False)
    assert viewer.drawn == pictures
    viewer.release()
    assert counts.pop("error") == "GL_NO_ERROR"
    assert counts == empty
