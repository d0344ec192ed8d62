"""What a test does with a window, and what it sees in it."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.viewer.events import Event

from . import frames

BALL = ps.Frame(None, frames.sphere().depth, frames.CAMERA)


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
    viewer._messages.clear()
    return viewer


def brightness(picture):
    """Mean of the left, right, upper and lower half of the ball."""
    grey = picture.astype(float).mean(-1)[51:197, 97:243]
    return grey[:, :73].mean(), grey[:, 73:].mean(), grey[:73].mean(), grey[73:].mean()


class Spoilt(Sequence):
    """Three frames, the middle one unreadable."""

    frames = (frames.sphere(), None, frames.tilted_plane())

    def __len__(self):
        return 3

    def __getitem__(self, index):
        if self.frames[index] is None:
            raise ValueError(f"frame {index} is broken")
        return self.frames[index]
