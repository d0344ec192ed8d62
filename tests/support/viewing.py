"""What a test does with a window, and what it sees in it."""

from collections.abc import Sequence
from itertools import count, pairwise

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.viewer.controller import Mouse
from pointshade_gl.viewer.events import Event

from . import frames

BALL = ps.Frame(None, frames.sphere().depth, frames.CAMERA)


class Hand:
    """A mouse that goes on from event to event, without a window."""

    def __init__(self):
        self.mouse = Mouse()

    def handle(self, *arguments):
        self.mouse, state = self.mouse.handle(*arguments)
        return state


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
    return taken[-1]  # before the first picture the window says that it prepares one


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


ROWS = "checkbox", "slider_float", "drag_float", "begin_combo", "color_edit3", "collapsing_header", "radio_button"
ROWS = *ROWS, "button", "text_unformatted"
LATER = count(1e9, 10)  # seconds


def rows(viewer):
    """Where the panel's rows are, by their labels: (x, y) at the left end of each; of names as "name:"."""
    imgui, found = viewer.screen.panel._imgui, {}

    def recorded(draw):
        def drawn(label, *others):
            result = draw(label, *others)
            (x, y), (width, height) = imgui.get_item_rect_min(), imgui.get_item_rect_size()
            title = f"{label}:" if draw.__name__ == "text_unformatted" else label.split("##")[0] or label.split("##")[1]
            found[title] = x + min(width / 2, 8), y + height / 2
            return result

        return drawn

    settle(viewer)
    with pytest.MonkeyPatch.context() as instead:
        for name in ROWS:
            instead.setattr(imgui, name, recorded(getattr(imgui, name)))
        viewer.handle(Event("refresh"))
        viewer.step(wait=False)
    return found


def is_settling(viewer):
    """Whether the panel has not yet answered all that it was told."""
    return viewer.state.panel and viewer.screen.panel.settling > 0


def settle(viewer):
    """Until the panel has answered all that it was told."""
    for _ in range(4):
        viewer.step(wait=False)
    while is_settling(viewer) or viewer.events:
        viewer.step(wait=False)


def row_place(viewer, label):
    """Where a row of the panel is, scrolled to where it is seen."""
    low, (width, high) = 30, viewer.window.picture_size
    while not low < (place := rows(viewer)[label])[1] < high - 20:
        viewer.handle(Event("move", x=width - 20, y=high - 30))
        viewer.handle(Event("wheel", x=width - 20, y=high - 30, steps=1 if place[1] <= low else -1))
        settle(viewer)
    return place


def click_row(viewer, label, clicks=1, **held):
    """Clicks on a row of the panel, long after others."""
    x, y = row_place(viewer, label)
    time = next(LATER)
    viewer.handle(Event("move", x=x, y=y))
    settle(viewer)
    for kind in ("press", "release") * clicks:
        viewer.handle(Event(kind, "left", x, y, time=time, **held))
        settle(viewer)


def quiet(viewer):
    """No message over the picture, and no bar."""
    viewer.messages.clear()
    viewer._buttons._until = 0.0
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
