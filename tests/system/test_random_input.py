"""Anything at all, done to a real window: no error, and neither memory nor GL objects grow.

POINTSHADE_RANDOM_MINUTES=10 makes it as long as that instead of a number of events (add `--timeout 0`); `-s` shows how
memory goes.
"""

import gc
import os
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.viewer import Viewer
from pointshade_gl.viewer import background as open_dialog
from pointshade_gl.viewer.keys import BY_NAME

from ..renderer.test_renderer import living_objects
from ..support import frames
from ..support.view_sets import three_views, write_views
from ..viewer.test_history import SCENE

if not sys.platform.startswith("linux"):
    pytest.skip("speaks to an X server", allow_module_level=True)

from ..support.hands import Hands

pytestmark = [pytest.mark.system, pytest.mark.alone]

MINUTES = float(os.environ.get("POINTSHADE_RANDOM_MINUTES", "0"))
SEED, EVENTS = 4, 100  # things that are done in a round
KEYS = ("l", "1", "2", "3", "4", "b", "n", "plus", "minus", "s", "u", "x", "Tab", "r", "p", "g", "space", "Left",
        "Right", "Home", "End", "comma", "period", "o", "m", "h", "q", "Escape", "z", "y", "F5", "Return", "BackSpace",
        "5", "e", "a", "v", "d", "f", "F11", *(f"KP_{k}" for k in range(10) if k != 5), "KP_Decimal")  # fmt: skip
AS_WINDOW = {
    "plus": "+",
    "minus": "-",
    "comma": ",",
    "period": ".",
    "KP_Decimal": "KP.",
}  # what the window calls keys, from X's names
UNDO = ("z", "Control_L"), ("z", "Control_L", "Shift_L"), ("y", "Control_L")
LIKELY = {"move": 0.2, "travel": 0.1, "key": 0.3, "undo": 0.05, "button": 0.1, "wheel": 0.1, "rare": 0.15}
ALLOWED = 40  # MB: the driver and malloc keep some
SPARE = 12  # GL objects that a round may leave more than another, for what happens when may differ
PASSES = {"VertexArray": 200, "Program": 200, "Shader": 400}  # made when they are first needed, one for each variant


class Anything:
    """Does anything that hands can do, by a seed."""

    def __init__(self, hands, files, seed):
        self.hands, self.files, self.rng = hands, files, np.random.default_rng(seed)
        self.viewer = hands.viewer

    def act(self):
        """One thing, the likely ones more often; now and then the window looks."""
        getattr(self, self.rng.choice(list(LIKELY), p=list(LIKELY.values())))()
        if self.rng.random() < 0.3:
            self.hands.look(1)

    def move(self):
        width, height = self.size
        self.hands.point(*self.rng.uniform((-30, -30), (width + 30, height + 30)))

    def travel(self):
        """With or without a button."""
        name = self.rng.choice(["left", "left", "middle", "right", ""])
        self.move()
        if name:
            self.hands.button(name, "press")
        for _ in range(self.rng.integers(1, 8)):
            self.move()
        if name:
            self.hands.button(name, "release")

    def key(self):
        held = [name for name, share in (("Control_L", 0.25), ("Shift_L", 0.2)) if self.rng.random() < share]
        self.hands.key(self.rng.choice(KEYS), *held)

    def undo(self):
        self.hands.key(*UNDO[self.rng.integers(len(UNDO))])

    def button(self):
        for _ in range(self.rng.integers(1, 4)):
            self.hands.button(self.rng.choice(["left", "left", "left", "middle", "right"]))

    def wheel(self):
        for _ in range(self.rng.integers(1, 5)):
            self.hands.button(self.rng.choice(["up", "down"]))

    def rare(self):
        if self.rng.random() < 0.5 and not self.viewer.window.is_full_screen:
            size = (int(n) for n in self.rng.integers((40, 30), (420, 320)))
            self.viewer.window.glfw.set_window_size(self.viewer.window.handle, *size)
        else:
            self.hands.drop(*self.rng.choice(self.files, self.rng.choice([1, 1, 1, 2])))

    @property
    def size(self):
        return self.viewer.window.glfw.get_window_size(self.viewer.window.handle)


@pytest.fixture
def files(tmp_path):
    """Folders, a scene, pictures, and what is none of these."""
    from PIL import Image

    views = write_views(tmp_path / "views", three_views()[:2])
    ps.save_scene(tmp_path / "scene.gltf", SCENE)
    alone = tmp_path / "alone"
    alone.mkdir()
    frame = frames.noisy()
    Image.fromarray((frame.depth * 1000).astype(np.uint16)).save(alone / "depth.png")
    Image.fromarray(frame.color[..., :3]).save(alone / "color.png")
    c = frames.CAMERA
    (alone / "intrinsics.json").write_text(
        f'{{"fx": {c.fx}, "fy": {c.fy}, "cx": {c.cx}, "cy": {c.cy}, "width": 160, "height": 120}}'
    )
    (tmp_path / "notes.txt").write_text("nothing to see")
    return [*map(str, (views, tmp_path / "scene.gltf", alone, alone / "depth.png", tmp_path / "notes.txt", "gone"))]


def test_every_key_of_the_window_is_among_them():
    pressed = {AS_WINDOW.get(name, name.upper().replace("_", "")) for name in KEYS}
    assert {name for name in BY_NAME if "+" not in name[:-1]} - {"="} <= pressed


def memory():
    """MB that this process has in memory."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def settle(one, start, folder):
    """The same thing in the same state, whatever was done before."""
    viewer, glfw = one.viewer, one.viewer.window.glfw
    viewer.background.finish()
    for name in ("left", "middle", "right"):
        one.button(name, "release")
    one.look()
    if viewer.window.is_full_screen:
        viewer.window.toggle_full_screen()
    glfw.set_window_size(viewer.window.handle, 320, 240)
    one.until(lambda: viewer.window.picture_size == (320, 240))
    viewer.background.finish()
    one.drop(folder)
    viewer.background.finish()
    viewer.state = start
    one.point(-50, -50)
    one.look(8)


def state_of_things(one):
    """MB in memory, and how many GL objects the renderer has, with those that it shares with the window."""
    viewer = one.viewer
    viewer.background.finish()
    with viewer.window:
        assert viewer.screen.gl.error == "GL_NO_ERROR"
    context = viewer.screen.renderer.context
    with context.in_use():
        assert context.gl.error == "GL_NO_ERROR"
        return memory(), living_objects(context.gl, viewer.window.glfw.get_proc_address)


def test_anything_at_all_leaves_no_error_and_nothing_grows(display, files, tmp_path, monkeypatch, capsys):
    """The short run does the same twice: the second time needs nothing new. The long one goes on with other seeds."""
    if not display:
        pytest.skip("moves the pointer: not on anybody's own screen, needs Xvfb")
    (tmp_path / "out").mkdir()
    monkeypatch.chdir(tmp_path / "out")
    monkeypatch.setattr(open_dialog, "PROGRAMS", ())  # nobody would answer a dialog
    viewer = Viewer(ps.load_frame(files[2]), window_size=(320, 240), fps=50)
    viewer.samples = 3
    one, start, found = Hands(viewer), viewer.state, []
    began = time.monotonic()
    try:
        while len(found) < 2 or time.monotonic() - began < 60 * MINUTES:
            anything = Anything(one, files, SEED + (len(found) if MINUTES else 0))
            for _ in range(EVENTS):
                anything.act()
                viewer.window.glfw.set_window_should_close(viewer.window.handle, False)
            settle(one, start, files[2])
            found.append(state_of_things(one))
            for picture in Path.cwd().iterdir():
                picture.unlink()
            if MINUTES:
                spent, (used, objects) = time.monotonic() - began, found[-1]
                with capsys.disabled():
                    print(f"{spent:6.0f} s, {viewer.drawn} pictures, {used:.0f} MB, {objects}")
    finally:
        one.close()
        viewer.release()
    half = len(found) // 2 - 1
    (before, objects), (after, now) = found[half], found[-1]
    assert after < before + ALLOWED
    assert all(now[kind] <= PASSES.get(kind, objects[kind] + SPARE) for kind in objects), (objects, now)
