"""What mouse and keys do. The help in the window shows the same tables."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from ..camera import Camera
from ..estimators import METHODS
from ..look import SHADINGS
from ..scene import Scene
from .dwell import Dwell
from .events import Event
from .state import Pair, Stage, State, rims_from

if TYPE_CHECKING:
    from .viewer import Viewer

ESTIMATORS = ("auto", "star", "adaptive", "star-borrow", "triangles-8", "central", "one-sided", "plane-fit-5")
CATCH_UP = 3.0  # how fast the light approaches the mouse, per rim that the mouse moves
HAND = 4.0  # pixels at scale 1: who moves less while a button is down, clicks
STAYS = "the light stays here: L lets it follow the mouse again"
LATER = "; seen once lit again (B)"
NOT_SHADED = "; seen once shaded (2, 3 or 4)"
SMALLEST, LARGEST = 0.25, 8.0  # points, pixels of the frame
DOUBLE = 0.4  # seconds between two clicks that are one double click
assert set(ESTIMATORS) <= set(METHODS)


class Mouse:
    """Turns moves, buttons and the wheel into changes of the State. The light never jumps when the mouse takes it.

    drag    "orbit", "pan", "light", or "" when no button is down
    drags   how many there have been
    clicks  1 after an event that ended a click, 2 after one that began a double click, otherwise 0
    """

    def __init__(self) -> None:
        self.drag, self.drags, self.clicks = "", 0, 0
        self._button = ""  # that began the drag
        self._last: Pair | None = None
        self._dwell = Dwell()
        self._pressed: Event | None = None  # while the mouse has not left the place
        self._clicked: Event | None = None  # what began the last click, if that was the last press

    @property
    def turns(self) -> bool:
        """Whether it moves the viewer."""
        return self.drag in ("orbit", "pan") and self._pressed is None

    def handle(self, event: Event, state: State, stage: Stage, camera: Camera, scale: float = 1.0) -> State:
        """The state after the event, in a picture of this camera. scale: pixels are so much smaller than usual."""
        self.clicks = 0
        if event.kind == "wheel":
            return state.light_reached(event.steps) if event.shift else state.zoomed(event.steps)
        if event.kind == "press" and not self.drag:
            self._press(event, scale)
        elif event.kind == "release" and event.key == self._button:
            self._release()
        elif event.kind == "leave" and not self.drag:
            return self._leave(event, state)
        elif event.kind == "move" and not _is_same_place(event, self._pressed, scale):
            self._pressed = None
            last, self._last = self._last or (event.x, event.y), (event.x, event.y)
            return self._move(last, event, state, stage, camera)
        return state

    def _press(self, event: Event, scale: float) -> None:
        before, self._clicked = self._clicked, None
        self._last, self._button = (event.x, event.y), event.key
        if event.key == "middle" or (event.key == "left" and event.ctrl and not event.shift):
            self.drag = "pan"
        elif event.key == "left":
            self.drag = "light" if event.ctrl else "orbit"
        self.drags += 1
        if self.drag != "orbit":
            return
        self._pressed = event
        if before and _is_same_place(event, before, scale) and event.time - before.time < DOUBLE:
            self.clicks = 2
        else:
            self._clicked = event

    def _release(self) -> None:
        self.drag = ""
        if self._pressed and self._clicked:
            self.clicks = 1
        elif not self._pressed:
            self._clicked = None
        self._pressed = None

    def _leave(self, event: Event, state: State) -> State:
        """The light stays where it was held before the mouse began its way out."""
        self._last = None
        return replace(state, light_at=self._dwell.leave(event.time, state.light_at)) if state.light_mode else state

    def _move(self, last: Pair, event: Event, state: State, stage: Stage, camera: Camera) -> State:
        now = event.x, event.y
        dx, dy = now[0] - last[0], now[1] - last[1]
        if self.drag == "orbit":
            return state.orbited(dx, dy, min(camera.width, camera.height))
        if self.drag == "pan":
            return state.panned(dx, dy, camera.fx)
        if now == last or (self.drag != "light" and not state.light_mode):
            return state
        moved = self._move_light(last, now, state, stage, camera)
        if not self.drag:
            rims = rims_from((0, 0), *now, camera)
            self._dwell.move(event.time, rims, state.light_at, moved.light_at)
        return moved

    def _move_light(self, last: Pair, now: Pair, state: State, stage: Stage, camera: Camera) -> State:
        """The light follows the mouse. If they are apart when the mouse takes it, the gap shrinks with each move."""
        middle = state.middle(stage, camera)
        before, after = rims_from(middle, *last, camera), rims_from(middle, *now, camera)
        left = math.exp(-CATCH_UP * math.dist(before, after))
        (x, y), (was_x, was_y) = state.light_at, before
        return replace(state, light_at=(after[0] + left * (x - was_x), after[1] + left * (y - was_y)))


def _is_same_place(event: Event, other: Event | None, scale: float) -> bool:
    return other is not None and math.dist((event.x, event.y), (other.x, other.y)) < HAND * scale


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
    text = "the light follows the mouse" if on else STAYS
    _change(viewer, text + when_seen(viewer.state), replace(viewer.state, light_mode=on))


def _choose_shading(viewer: Viewer, name: str) -> None:
    shading = SHADINGS[int(name) - 1]
    _change(viewer, f"shading: {shading}", replace(viewer.state.with_look(shading=shading), lit=True))


def _cycle_normals(viewer: Viewer, _: str) -> None:
    if _has_own_looks(viewer):
        return
    look = viewer.state.look
    following = ESTIMATORS.index(look.normals) + 1 if look.normals in ESTIMATORS else 0
    normals = ESTIMATORS[following % len(ESTIMATORS)]
    is_flat_mesh = look.splat == "mesh" and look.shading == "flat"
    when = "; flat triangles have normals of their own" if is_flat_mesh else when_seen(viewer.state)
    _change(viewer, f"normals: {normals}{when}", viewer.state.with_look(normals=normals))


def _compare(viewer: Viewer, _: str) -> None:
    state = viewer.state
    if state.look.shading == "none" and not (state.look.unlight or state.look.remove_highlights):
        viewer.say("this is the unlit picture already: 2, 3 or 4 light it")
        return
    _change(viewer, "unlit, as photographed" if state.lit else "lit", replace(state, lit=not state.lit))


def _resize_points(viewer: Viewer, name: str) -> None:
    if _has_own_looks(viewer):
        return
    if viewer.state.look.splat == "mesh":
        viewer.say("a mesh has no point size")
        return
    factor = 1.25 if name in ("+", "=") else 1 / 1.25
    size = round(min(max(viewer.state.point_size * factor, SMALLEST), LARGEST), 2)
    size = 1.0 if abs(size - 1) < 0.1 else size
    end = {SMALLEST: ", the smallest", LARGEST: ", the largest"}.get(size, "")
    _change(viewer, f"point size: {size:g} pixels of the frame{end}", viewer.state.with_look(size=size))


def _toggle_unlight(viewer: Viewer, _: str) -> None:
    on = not viewer.state.look.unlight
    text = "the light in the picture is divided out" if on else "the colours are those of the picture"
    _recolour(viewer, text, unlight=on)


def _toggle_highlights(viewer: Viewer, _: str) -> None:
    on = not viewer.state.look.remove_highlights
    text = "the highlights in the picture are taken out" if on else "the highlights in the picture stay"
    _recolour(viewer, text, remove_highlights=on)


def _recolour(viewer: Viewer, text: str, **changes: bool) -> None:
    """Other colours of a frame's surfaces, which also show without shading."""
    if not _has_own_looks(viewer):
        _change(viewer, text + ("" if viewer.state.lit else LATER), viewer.state.with_look(**changes))


def _has_own_looks(viewer: Viewer) -> bool:
    """Whether a key does nothing, because the objects of a scene have a look of their own. Says so."""
    if isinstance(viewer.frame, Scene):
        viewer.say("the objects of a scene have a look of their own")
        return True
    return False


def when_seen(state: State) -> str:
    """When a change of the light is seen, to end a message; "" if it is now."""
    return "" if state.is_lit else NOT_SHADED if state.lit else LATER


def _leave(viewer: Viewer, name: str) -> None:
    if name == "ESCAPE" and viewer.state.help:
        viewer.state = replace(viewer.state, help=False)
    else:
        viewer.quit()


def _toggle_help(viewer: Viewer, _: str) -> None:
    viewer.state = replace(viewer.state, help=not viewer.state.help)


def _reset(viewer: Viewer, _: str) -> None:
    viewer.reset()
    viewer.say("view and lights are as at the start")


def _toggle_shadows(viewer: Viewer, _: str) -> None:
    on = not viewer.state.shadows
    casts = any(light.shadow for light in (viewer.held, *viewer.lights))
    text = f"shadows {'on' if on else 'off'}" + (when_seen(viewer.state) if casts else ", but no light casts any")
    _change(viewer, text, replace(viewer.state, shadows=on))


MOUSE = (
    ("mouse", "move the light (in light mode)"),
    ("click", "keep the light where it is (L: it follows again)"),
    ("Ctrl+Shift+drag", "move the light (always)"),
    ("Shift+wheel", "move the light nearer or farther"),
    ("drag", "orbit"),
    ("Ctrl+drag, middle drag", "pan"),
    ("wheel", "zoom"),
    ("double click", "turn around this point, or the object's middle"),
    ("click, drag on the bar", "jump through a sequence"),
    ("drop files", "open a folder, a depth file, a scene, or depth and colour"),
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
    Key(("R",), "R", "reset view and lights", _reset),
    Key(("CTRL+Z",), "Ctrl+Z", "undo a change of view or lights", lambda viewer, _: viewer.undo()),
    Key(("CTRL+SHIFT+Z", "CTRL+Y"), "Ctrl+Shift+Z, Ctrl+Y", "redo it", lambda viewer, _: viewer.redo()),
    Key(("P",), "P", "save a picture; tell the command that makes it", lambda viewer, _: viewer.save_picture()),
    Key(("G",), "G", "open or close the panel", lambda viewer, _: viewer.toggle_panel()),
    Key(("SPACE",), "space", "pause or play a sequence", lambda viewer, _: viewer.pause()),
    Key(
        ("LEFT", "RIGHT"),
        "left, right",
        "step through a sequence",
        lambda viewer, name: viewer.step_frames(1 if name == "RIGHT" else -1),
    ),
    Key(("HOME", "END"), "Home, End", "its first, its last frame", lambda viewer, name: viewer.jump(-(name == "END"))),
    Key((",", "."), ", .", "play slower, faster", lambda viewer, name: viewer.change_rate(2.0 if name == "." else 0.5)),
    Key(("O",), "O", "begin again at the end of a sequence, or stop", lambda viewer, _: viewer.toggle_loop()),
    Key(("M",), "M", "merge views of a sequence, or play it", lambda viewer, _: viewer.toggle_views()),
    Key(("H",), "H", "this help", _toggle_help),
    Key(("Q", "ESCAPE"), "Q, Esc", "quit", _leave),
)
BY_NAME = {name: key for key in KEYS for name in key.names}


def press_key(viewer: Viewer, name: str, ctrl: bool = False, shift: bool = False) -> None:
    """Runs the key's action, if it has one; with Ctrl and Shift perhaps another one."""
    chord = "CTRL+" * ctrl + "SHIFT+" * shift + name
    name = chord if chord in BY_NAME else name
    if key := BY_NAME.get(name):
        key.do(viewer, name)
