"""Measures whether a window answers while it merges, estimates and saves, and how soon Escape ends that.

Run by hand: python tests/benchmarks/window_answers.py SEQUENCE [--size WxH]. It needs a display. For each key it prints
how long all took, the longest turn of the window's thread without drawing and sleeping, the longest drawing, and how
long Escape took in the middle of the same work.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from pathlib import Path

import pointshade_gl as ps
from pointshade_gl.viewer import Viewer
from pointshade_gl.viewer.events import Event

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


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source", type=Path)
    parser.add_argument("--size", default="640x480")
    asked = parser.parse_args()
    size = tuple(map(int, asked.size.split("x")))
    source = ps.open_source(asked.source.absolute())
    os.chdir(tempfile.mkdtemp())
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
