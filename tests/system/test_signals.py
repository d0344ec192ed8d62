"""Signals whose handlers raise come at any moment, for a minute: nothing crashes, and pictures stay the same."""

import subprocess
import sys

import pytest

pytestmark = [pytest.mark.system, pytest.mark.gl, pytest.mark.skipif(sys.platform == "win32", reason="needs SIGUSR1")]

SECONDS = 60
CODE = """
import os, random, signal, sys, threading, time
import pointshade_gl as ps

class SoftLimit(Exception):
    pass

def stop(*_):
    raise SoftLimit

def send():
    dice = random.Random(int(sys.argv[1]))
    while not ended.wait(dice.uniform(0.0005, max(0.15, 3 * took))):
        os.kill(os.getpid(), signal.SIGUSR1)

frame = ps.load_frame("vase")
with ps.Renderer() as renderer:
    expected = renderer.render(frame).tobytes()
began = time.monotonic()
with ps.Renderer() as renderer:
    renderer.render(frame)
took = time.monotonic() - began  # then some pictures end before a signal comes, however busy the machine is
ended, stopped, drawn = threading.Event(), 0, 0
until = time.monotonic() + float(sys.argv[2])
signal.signal(signal.SIGUSR1, stop)
sender = threading.Thread(target=send, daemon=True)
try:
    sender.start()
    while time.monotonic() < until:
        try:
            with ps.Renderer() as renderer:
                while time.monotonic() < until:
                    picture = renderer.render(frame).tobytes()
                    assert picture == expected, "another picture"  # array_equal is False where a handler raises in it
                    drawn += 1
        except SoftLimit:
            stopped += 1
finally:
    signal.signal(signal.SIGUSR1, signal.SIG_IGN)
    ended.set()
    sender.join()
with ps.Renderer() as renderer:
    assert renderer.render(frame).tobytes() == expected, "another picture afterwards"
print(stopped, drawn)
"""


def test_a_minute_of_signals_at_random_moments_harms_nothing():
    done = subprocess.run(
        [sys.executable, "-W", "ignore::ResourceWarning", "-c", CODE, "7", str(SECONDS)],
        capture_output=True, text=True, timeout=10 * SECONDS,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    stopped, drawn = map(int, done.stdout.split())
    assert stopped > 50 and drawn > 10, (stopped, drawn)
