"""Measures how soon a window shows something and how fast it moves; whether it answers while it works.

Run by hand: python tests/benchmarks/window_answers.py SOURCE [--size WxH] [--moves] [--page]. It needs a display,
and a clone that is installed with its extra `test`; --page measures its page in Chromium instead. First come
seconds until the first picture, and how many pictures a second come while the light moves and while the object turns,
without and with shadows; a number of points in place of SOURCE is a bumpy torus of so many. --moves ends there. For
each key it then prints how long all took, the longest turn of the window's thread without drawing and sleeping, the
longest drawing, and how long Escape took in the middle of the same work.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import pointshade_gl as ps
from pointshade_gl.viewer import Viewer
from pointshade_gl.viewer.events import Event

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.browser import Browser

KEYS = "M", "U", "X", "P"
LONGEST = 120.0  # seconds for one key


class Session:
    """A window whose turns are timed, with a mouse that never rests."""

    def __init__(self, viewer: Viewer):
        self.viewer = viewer
        self.turns: list[float] = []  # seconds, without drawing and sleep
        self.draws: list[float] = []
        self._spent = {"draw": 0.0, "wait": 0.0}
        self._count = 0
        viewer.screen.draw = self._timed("draw", viewer.screen.draw)
        viewer.window.wait = self._timed("wait", viewer.window.wait)

    def _timed(self, name, do):
        def timed(*arguments):
            began = time.perf_counter()
            try:
                return do(*arguments)
            finally:
                self._spent[name] += time.perf_counter() - began

        return timed

    def turn(self):
        self._count += 1
        self.viewer.events.append(Event("move", x=100 + self._count % 200, y=120 + self._count % 150))
        self._spent.update(draw=0.0, wait=0.0)
        began = time.perf_counter()
        self.viewer.step()
        self.turns.append(time.perf_counter() - began - sum(self._spent.values()))
        self.draws.append(self._spent["draw"])

    @property
    def is_busy(self):
        return bool(self.viewer.background.work) or self.viewer.document.playback.is_merging

    def settle(self):
        end = time.perf_counter() + LONGEST
        self.turn()
        while self.is_busy and time.perf_counter() < end:
            self.turn()

    def move(self, seconds, **button):
        """Pictures a second while the mouse moves, perhaps with a button down."""
        viewer = self.viewer
        if button:
            viewer.events.append(Event("press", x=320, y=240, **button))
        end, first, began = time.perf_counter() + seconds, viewer.drawn, time.perf_counter()
        while time.perf_counter() < end:
            self.turn()
        if button:
            viewer.events.append(Event("release", x=320, y=240, **button))
        return (viewer.drawn - first) / (time.perf_counter() - began)

    def press(self, key):
        self.viewer.events.append(Event("key", key))

    def measure(self, key):
        first, began = len(self.turns), time.perf_counter()
        self.press(key)
        self.settle()
        turn, draw = (1e3 * max(times[first:]) for times in (self.turns, self.draws))
        spent = time.perf_counter() - began
        print(f"{key}: {spent:6.2f} s, longest turn {turn:4.0f} ms, longest drawing {draw:4.0f} ms")

    def interrupt(self, key, after):
        self.press(key)
        begin = time.perf_counter() + after
        while time.perf_counter() < begin:
            self.turn()
        if not self.is_busy:
            print(f"{key}: ended by itself within {after} s")
            return
        began = time.perf_counter()
        self.press("ESCAPE")
        while self.is_busy:
            self.turn()
        print(f"{key}: Escape after {after} s took {1e3 * (time.perf_counter() - began):4.0f} ms")


# Counts the turns of a page in which something was drawn.
COUNTER = """
let isDrawn = false;
window.drawn = 0;
const kind = WebGL2RenderingContext.prototype;
for (const name of ["drawArrays", "drawArraysInstanced", "drawElements"]) {
  const draw = kind[name];
  kind[name] = function (...all) { isDrawn = true; return draw.apply(this, all); };
}
const count = () => { if (isDrawn) ++window.drawn; isDrawn = false; requestAnimationFrame(count); };
requestAnimationFrame(count);
"""


def measure_page(source, size):
    """Print how soon a page shows something, and its pictures a second while light and view move."""
    with tempfile.TemporaryDirectory() as folder, Browser.launched(Path(folder)) as browser:
        file = Path(folder) / "page.html"
        ps.save_page(file, source)
        began = time.perf_counter()
        with browser.opened(file, COUNTER, viewport=dict(zip(("width", "height"), size, strict=True))) as opened:
            opened.page.wait_for_function("window.drawn > 0")
            print(f"first picture after {time.perf_counter() - began:.2f} s, {file.stat().st_size / 1e6:.2f} MB")
            mouse, middle = opened.page.mouse, np.array(size) / 2

            def move(seconds):
                end, steps = time.perf_counter() + seconds, 0
                first, began = opened.page.evaluate("window.drawn"), time.perf_counter()
                while time.perf_counter() < end:
                    steps += 1
                    mouse.move(*(middle + 60 * np.array((np.cos(0.2 * steps), np.sin(0.3 * steps)))))
                return (opened.page.evaluate("window.drawn") - first) / (time.perf_counter() - began)

            for shadows in ("without", "with"):
                rates = [move(1), move(4)]
                mouse.down()
                rates += [move(1), move(4)]
                mouse.up()
                print(f"pictures a second {shadows} shadows: light {rates[1]:.1f}, view {rates[3]:.1f}")
                opened.page.keyboard.press("s")


def torus(count):
    """A cloud with colours and without normals."""
    rng = np.random.default_rng(0)
    around, across = rng.uniform(0, 2 * np.pi, (2, count))
    radius = 0.4 + 0.03 * np.sin(9 * around) * np.sin(7 * across)
    ring = 1 + radius * np.cos(across)
    points = np.stack([ring * np.cos(around), radius * np.sin(across), ring * np.sin(around)], -1)
    return ps.PointCloud(points.astype(np.float32), colors=(120 + 100 * np.sin(5 * points)).astype(np.uint8), up="y")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source")
    parser.add_argument("--moves", action="store_true")
    parser.add_argument("--page", action="store_true")
    parser.add_argument("--size", default="640x480")
    asked = parser.parse_args()
    size = tuple(map(int, asked.size.split("x")))
    path = Path(asked.source).absolute()  # the folder will be another
    named = path if path.exists() else asked.source
    source = torus(int(asked.source)) if asked.source.isdigit() else ps.open_source(named)
    if asked.page:
        measure_page(source, size)
        return
    os.chdir(tempfile.mkdtemp())
    began = time.perf_counter()
    session = Session(viewer := Viewer(source, window_size=size))
    while viewer.background.work or not session.draws or not session.draws[-1]:
        session.turn()
    print(f"first picture after {time.perf_counter() - began:.2f} s")
    for shadows in ("without", "with"):
        rates = session.move(1), session.move(3), session.move(1, key="left"), session.move(3, key="left")
        print(f"pictures a second {shadows} shadows: light {rates[1]:.1f}, view {rates[3]:.1f}")
        session.press("S")
    viewer.release()
    if asked.moves:
        return
    for after in (0.2, 0.6, 1.2):
        for key in KEYS:
            viewer = Viewer(source, window_size=size)
            session = Session(viewer)
            session.settle()
            if key != "M" and not isinstance(source, ps.Frame):
                session.press("M")
                session.settle()
            session.interrupt(key, after)
            viewer.release()
    session = Session(viewer := Viewer(source, window_size=size))
    session.settle()
    for key in KEYS:
        session.measure(key)
    viewer.release()


if __name__ == "__main__":
    main()
