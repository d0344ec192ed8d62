"""What keys do. The help in the window shows the same table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from ..scene.appearance import SHADINGS
from ..scene.graph import Scene
from ..scene.normal_methods import METHODS
from ..scene.orbit_state import State
from .messages import LATER, STAYS, when_seen

if TYPE_CHECKING:
    from .viewer import Viewer

ESTIMATORS = ("auto", "star", "adaptive", "star-borrow", "triangles-8", "central", "one-sided", "plane-fit-5")
SMALLEST, LARGEST = 0.25, 8.0  # points, pixels of the frame
assert set(ESTIMATORS) <= set(METHODS)


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
