"""What mouse and keys do. The help in the window shows the same tables."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from ..camera import Camera
from ..estimators import METHODS
from ..look import SHADINGS
from .events import Event
from .state import Pair, Stage, State, rims_from

if TYPE_CHECKING:
    from .viewer import Viewer

ESTIMATORS = ("auto", "star", "adaptive", "star-borrow", "triangles-8", "central", "one-sided", "plane-fit-5")
CATCH_UP = 3.0  # how fast the light approaches the mouse, per rim that the mouse moves
assert set(ESTIMATORS) <= set(METHODS)


class Mouse:
    """Turns moves, buttons and the wheel into changes of the State. The light never jumps when the mouse takes it."""

    def __init__(self) -> None:
        self.drag = ""  # "orbit", "pan", "light", or "" when no button is down
        self._last: Pair | None = None
        self._held_in: Camera | None = None  # camera of the last move; None if that move did not hold the light
        self._slack: Pair = (0.0, 0.0)  # from the mouse to the light that it holds, rims

    def handle(self, event: Event, state: State, stage: Stage, camera: Camera) -> State:
        """The state after the event, in a picture of this camera."""
        if event.kind == "wheel":
            return state.light_reached(event.steps) if event.shift else state.zoomed(event.steps)
        if event.kind == "press" and not self.drag:
            self._begin(event)
        elif event.kind == "release":
            self.drag = ""
        elif event.kind == "leave" and not self.drag:
            self._last = self._held_in = None
        elif event.kind == "move":
            last, self._last = self._last or (event.x, event.y), (event.x, event.y)
            return self._move(last, self._last, state, stage, camera)
        return state

    def _begin(self, event: Event) -> None:
        self._last, self._held_in = (event.x, event.y), None
        if event.key == "middle" or (event.key == "left" and event.ctrl and not event.shift):
            self.drag = "pan"
        elif event.key == "left":
            self.drag = "light" if event.ctrl else "orbit"

    def _move(self, last: Pair, now: Pair, state: State, stage: Stage, camera: Camera) -> State:
        if not (self.drag == "light" or (state.light_mode and not self.drag)):
            self._held_in = None
        dx, dy = now[0] - last[0], now[1] - last[1]
        if self.drag == "orbit":
            return state.orbited(dx, dy, min(camera.width, camera.height))
        if self.drag == "pan":
            return state.panned(dx, dy, camera.fx)
        if now == last or (self.drag != "light" and not state.light_mode):
            return state
        return self._move_light(last, now, state, stage, camera)

    def _move_light(self, last: Pair, now: Pair, state: State, stage: Stage, camera: Camera) -> State:
        """The light follows the mouse. If they are apart when the mouse takes it, the gap shrinks with each move."""
        middle = state.middle(stage, camera)
        before, after = rims_from(middle, *last, camera), rims_from(middle, *now, camera)
        if self._held_in != camera:
            self._slack = state.light_at[0] - before[0], state.light_at[1] - before[1]
        self._held_in = camera
        left = math.exp(-CATCH_UP * math.dist(before, after))
        self._slack = self._slack[0] * left, self._slack[1] * left
        return replace(state, light_at=(after[0] + self._slack[0], after[1] + self._slack[1]))


class Key(NamedTuple):
    """Keys with the same action: their names, how the help shows them, what it says about them, and the action."""

    names: tuple[str, ...]
    label: str
    says: str
    do: Callable[[Viewer, str], Any]


def _change(viewer: Viewer, text: str, state: State) -> None:
    viewer.state = state
    viewer.say(text)


def _toggle_light(viewer: Viewer, _: str) -> None:
    on = not viewer.state.light_mode
    text = "the light follows the mouse" if on else "the light stays where it is"
    _change(viewer, text, replace(viewer.state, light_mode=on))


def _choose_shading(viewer: Viewer, name: str) -> None:
    shading = SHADINGS[int(name) - 1]
    _change(viewer, f"shading: {shading}", replace(viewer.state.with_look(shading=shading), lit=True))


def _cycle_normals(viewer: Viewer, _: str) -> None:
    before = viewer.state.look.normals
    following = ESTIMATORS.index(before) + 1 if before in ESTIMATORS else 0
    normals = ESTIMATORS[following % len(ESTIMATORS)]
    _change(viewer, f"normals: {normals}", viewer.state.with_look(normals=normals))


def _compare(viewer: Viewer, _: str) -> None:
    lit = not viewer.state.lit
    _change(viewer, "lit" if lit else "unlit, as photographed", replace(viewer.state, lit=lit))


def _resize_points(viewer: Viewer, name: str) -> None:
    if viewer.state.look.splat == "mesh":
        viewer.say("a mesh has no point size")
        return
    factor = 1.25 if name in ("+", "=") else 1 / 1.25
    size = round(min(max(viewer.state.point_size * factor, 0.25), 8.0), 2)
    size = 1.0 if abs(size - 1) < 0.1 else size
    _change(viewer, f"point size: {size:g} pixels of the frame", viewer.state.with_look(size=size))


def _toggle_unlight(viewer: Viewer, _: str) -> None:
    on = not viewer.state.look.unlight
    text = "the light in the picture is divided out" if on else "the colours are those of the picture"
    _change(viewer, text, viewer.state.with_look(unlight=on))


def _toggle_highlights(viewer: Viewer, _: str) -> None:
    on = not viewer.state.look.remove_highlights
    text = "the highlights in the picture are taken out" if on else "the highlights in the picture stay"
    _change(viewer, text, viewer.state.with_look(remove_highlights=on))


def _leave(viewer: Viewer, name: str) -> None:
    if name == "ESCAPE" and viewer.state.help:
        viewer.state = replace(viewer.state, help=False)
    else:
        viewer.quit()


def _toggle_help(viewer: Viewer, _: str) -> None:
    viewer.state = replace(viewer.state, help=not viewer.state.help)


def _reset(viewer: Viewer, _: str) -> None:
    viewer.reset()
    viewer.say("view and light are reset")


def _toggle_shadows(viewer: Viewer, _: str) -> None:
    on = not viewer.state.shadows
    none = on and not any(light.shadow for light in (viewer.held, *viewer.lights))
    text = "shadows on, but no light casts any" if none else "shadows on" if on else "shadows off"
    _change(viewer, text, replace(viewer.state, shadows=on))


MOUSE = (
    ("mouse", "move the light (in light mode)"),
    ("Ctrl+Shift+drag", "move the light (always)"),
    ("Shift+wheel", "move the light nearer or farther"),
    ("drag", "orbit"),
    ("Ctrl+drag, middle drag", "pan"),
    ("wheel", "zoom"),
)
KEYS = (
    Key(("L",), "L", "light mode: the light follows the mouse", _toggle_light),
    Key(("1", "2", "3", "4"), "1 2 3 4", "shading: none, flat, gouraud, phong", _choose_shading),
    Key(("B",), "B", "compare with the unlit picture", _compare),
    Key(("N",), "N", "next normal estimator", _cycle_normals),
    Key(("+", "=", "-"), "+ -", "point size", _resize_points),
    Key(("S",), "S", "shadows on or off", _toggle_shadows),
    Key(("U",), "U", "divide the light in the picture out", _toggle_unlight),
    Key(("X",), "X", "take out the highlights in the picture (matte)", _toggle_highlights),
    Key(("TAB",), "Tab", "take the next light", lambda viewer, _: viewer.next_light()),
    Key(("R",), "R", "reset view and light", _reset),
    Key(("P",), "P", "save a picture", lambda viewer, _: viewer.save_picture()),
    Key(("G",), "G", "open or close the panel", lambda viewer, _: viewer.toggle_panel()),
    Key(("SPACE",), "space", "pause or play a sequence", lambda viewer, _: viewer.pause()),
    Key(
        ("LEFT", "RIGHT"),
        "left, right",
        "step through a sequence",
        lambda viewer, name: viewer.step_frames(1 if name == "RIGHT" else -1),
    ),
    Key(("M",), "M", "merge views of a sequence, or play it", lambda viewer, _: viewer.toggle_views()),
    Key(("H",), "H", "this help", _toggle_help),
    Key(("Q", "ESCAPE"), "Q, Esc", "quit", _leave),
)
BY_NAME = {name: key for key in KEYS for name in key.names}


def press_key(viewer: Viewer, name: str) -> None:
    """Runs the key's action, if it has one."""
    if key := BY_NAME.get(name):
        key.do(viewer, name)
