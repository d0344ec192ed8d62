"""What keys do. The help in the window shows the same table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from ..scene.appearance import SHADINGS
from ..scene.environment import NAMES, Environment
from ..scene.noise import METHODS
from ..scene.orbit import BESIDE, END_TEXT, OWN_LIGHT, State, softly_turned
from ..scene.settings import OCCLUSION
from .events import ChangeRate, Command, Effect, PlayCommand, Seek, ShowFrame, ShowMessage, StepFrames, TakeLight
from .state import Shown, Snapshot, clouds_of, resized, scene_in

ESTIMATORS = ("auto", "star", "adaptive", "star-borrow", "triangles-8", "central", "one-sided", "plane-fit-5")
TURN = 15.0  # degrees of the environment, and of the view
SIDES = {  # names, yaw, pitch: the front is what the frame's own camera looks at
    "KP1": ("the front", 0.0, 0.0), "CTRL+KP1": ("the back", 180.0, 0.0),
    "KP3": ("the right", 90.0, 0.0), "CTRL+KP3": ("the left", -90.0, 0.0),
    "KP7": ("above", 0.0, 90.0), "CTRL+KP7": ("below", 0.0, -90.0),
}  # fmt: skip
TURNS = {"KP4": (-1, 0), "KP6": (1, 0), "KP2": (0, -1), "KP8": (0, 1)}  # to the right, up
MIN_POINT_SIZE, MAX_POINT_SIZE = 0.25, 8.0  # points, pixels of the frame
STAYS = "the light stays here: L lets it follow the mouse again"
LATER = "; seen once lit again (B)"
NOT_SHADED = "; seen once shaded (2, 3 or 4)"
SEEN = (  # whether it is lit, what it shows, and the message then
    (False, "light", "the photograph, without light"),
    (True, "light", "lit"),
    (True, "normals", "normals: red to the right, green up, blue to the viewer"),
    (True, "depth", "depth: blue is near, red is far"),
    (True, "certainty", "certainty of normals: blue is certain, red may be off by 30° or more"),
)
OWN_LOOKS = "the objects of a scene have a look of their own"
assert set(ESTIMATORS) <= set(METHODS)
Answer = tuple[State, str | Effect]  # another state; a message ("": none), or what else is to be done
Do = Callable[[State, Snapshot, str], Answer]


def when_seen(state: State) -> str:
    """When a change of the light is seen, to end a message; "" if it is now."""
    if state.is_lit:
        return ""
    return NOT_SHADED if _shows_light(state) else LATER


class Key(NamedTuple):
    names: tuple[str, ...]  # of the keys
    label: str  # how the help shows them
    help: str  # what the help has beside them
    do: Do | Effect  # what is to be done, or a function of state, moment and name that gives the answer
    of_frame: bool = False  # they change the look of frames, which a scene's objects have of their own


def press_key(
    now: Snapshot, shown: Shown | None, name: str, ctrl: bool = False, shift: bool = False
) -> tuple[State, tuple[Effect, ...]]:
    """Return the state after a key, and what else is to be done; with Ctrl and Shift perhaps another key's."""
    chord = "CTRL+" * ctrl + "SHIFT+" * shift + name
    name = chord if chord in BY_NAME else name
    key, state, scene = BY_NAME.get(name), now.state, scene_in(shown)
    if key is None:
        return state, ()
    if scene and key.do is _resize_points and clouds_of(scene):
        larger, text = resized(scene, _factor(name))
        return state, (ShowFrame(larger), ShowMessage(text))
    if scene and key.of_frame:
        return state, (ShowMessage(OWN_LOOKS),)
    state, answer = (state, key.do) if isinstance(key.do, Effect) else key.do(state, now, name)
    effect = ShowMessage(answer) if isinstance(answer, str) else answer
    return state, () if answer == "" else (effect,)


def _one(**effects: Effect) -> Do:
    return lambda state, _, name: (state, effects[name])


def _shows_light(state: State) -> bool:
    return state.lit and state.finish.is_light


def _lit(state: State) -> State:
    return replace(state.with_finish(show="light"), lit=True)


def _next(known: Sequence[Any], before: Any) -> Any:
    """The one after another, and after the last the first; the first where that is none of them."""
    return known[(known.index(before) + 1) % len(known)] if before in known else known[0]


def _toggle_light(state: State, *_: Any) -> Answer:
    on = not state.light_mode
    return replace(state, light_mode=on), ("the light follows the mouse" if on else STAYS) + when_seen(state)


def _choose_shading(state: State, _: Snapshot, name: str) -> Answer:
    shading = SHADINGS[int(name) - 1]
    return _lit(state.with_look(shading=shading)), f"shading: {shading}"


def _next_seen(state: State, _: Snapshot, name: str) -> Answer:
    """Photograph, light, normals, depth, certainty, and round again; with Shift the other way."""
    shown = [(lit, show) for lit, show, _ in SEEN].index((state.lit or not state.finish.is_light, state.finish.show))
    lit, show, text = SEEN[(shown + (-1 if name.startswith("SHIFT") else 1)) % len(SEEN)]
    state = replace(state.with_finish(show=show), lit=lit)
    return state, text + (when_seen(state) if _shows_light(state) else "")


def _toggle_readout(state: State, *_: Any) -> Answer:
    on = not state.reads
    text = "the values under the mouse are told below" if on else "no values under the mouse"
    return replace(state, readout=None if on != state.finish.is_light else on), text


def _cycle_normals(state: State, *_: Any) -> Answer:
    look = state.look
    normals = _next(ESTIMATORS, look.normals)
    is_flat_mesh = look.splat == "mesh" and look.shading == "flat"
    when = "; flat triangles have normals of their own" if is_flat_mesh else when_seen(state)
    return state.with_look(normals=normals), f"normals: {normals}{when if state.finish.is_light else ''}"


def _compare(state: State, *_: Any) -> Answer:
    if not state.finish.is_light:
        return _lit(state), "lit" + when_seen(_lit(state))
    if state.look.shading == "none" and not (state.look.unlight or state.look.remove_highlights):
        return state, "this is the unlit picture already: 2, 3 or 4 light it"
    again = "darker beside what is nearer" if state.look.shading == "edl" else "lit"
    return replace(state, lit=not state.lit), "unlit, as photographed" if state.lit else again


def _factor(name: str) -> float:
    return 1.25 if name in ("+", "=") else 1 / 1.25


def _resize_points(state: State, _: Snapshot, name: str) -> Answer:
    if state.look.splat == "mesh":
        return state, "a mesh has no point size"
    size = round(min(max(state.point_size * _factor(name), MIN_POINT_SIZE), MAX_POINT_SIZE), 2)
    size = 1.0 if abs(size - 1) < 0.1 else size
    end = {MIN_POINT_SIZE: ", the smallest", MAX_POINT_SIZE: ", the largest"}.get(size, "")
    return state.with_look(point_size=size), f"point size: {size:g} pixels of the frame{end}"


def _toggle_colors(field: str, on: str, off: str) -> Do:
    """Other colours of a frame's surfaces, which also show without shading."""

    def do(state: State, *_: Any) -> Answer:
        is_on = not getattr(state.look, field)
        return state.with_look(**{field: is_on}), (on if is_on else off) + ("" if _shows_light(state) else LATER)

    return do


def _toggle_shadows(state: State, now: Snapshot, _: str) -> Answer:
    casts = any(light.shadow for light in (now.held, *now.lights))
    text = f"shadows {'off' if state.shadows else 'on'}"
    return replace(state, shadows=not state.shadows), text + (when_seen(state) if casts else ", but no light casts any")


def _next_environment(state: State, now: Snapshot, _: str) -> Answer:
    found = _next([None, *map(Environment.of, NAMES)], state.finish.environment)
    text = "no light from all around" if found is None else f"light from all around: {found.name}"
    usual = BESIDE if state.finish.environment else State.light_intensity
    if now.held == OWN_LIGHT and state.light_intensity == usual:  # nobody has chosen how strong it is
        state = replace(state, light_intensity=BESIDE if found else State.light_intensity)
        text += ", with the mouse's light low" if found else ""
    return state.with_finish(environment=found), text + when_seen(state)


def _turn_environment(state: State, _: Snapshot, name: str) -> Answer:
    text = "" if state.finish.environment is not None else "there is no environment to turn: E gives one"
    return state.environment_turned(-TURN if name.endswith("LEFT") else TURN), text


def _next_occlusion(state: State, *_: Any) -> Answer:
    wanted = _next([*OCCLUSION.values()], state.finish.ambient_occlusion)
    (word,) = (word for word, one in OCCLUSION.items() if one is wanted)
    text = f"whether what is near hides light from all around: {word}"
    return state.with_finish(ambient_occlusion=wanted), text + when_seen(state)


def _next_light(state: State, now: Snapshot, _: str) -> Answer:
    number = (now.number + 1) % (1 + len(now.lights))
    return state, TakeLight(number) if now.lights else "there is only one light: the panel (G) adds one"


def _toggle_help(state: State, *_: Any) -> Answer:
    return replace(state, help=not state.help), ""


def _leave(state: State, *_: Any) -> Answer:
    return _toggle_help(state) if state.help else (state, Command.LEAVE)


def _look_from(state: State, now: Snapshot, name: str) -> Answer:
    text, yaw, pitch = SIDES[name]
    return state.turned(yaw, pitch, now.stage.axis, roll=0.0), f"from {text}"


def _turn_by(state: State, now: Snapshot, name: str) -> Answer:
    right, up = TURNS[name]
    if now.stage.one_sided:
        yaw, pitch = softly_turned(state.yaw, right * TURN), softly_turned(state.pitch, up * TURN)
        turned = state.turned(yaw, pitch, now.stage.axis)
        return turned, END_TEXT if turned.is_near_end(now.stage) else ""
    pitch = min(max(state.pitch + up * TURN, -90.0), 90.0)
    return state.turned(state.yaw + right * TURN, pitch, now.stage.axis), ""


def _look_from_behind(state: State, now: Snapshot, _: str) -> Answer:
    return state.turned(state.yaw + 180, -state.pitch, now.stage.axis), "from the other side"


def _look_as_taken(state: State, now: Snapshot, _: str) -> Answer:
    """Where the frame's own camera was; the light stays with the viewer or with the object, as after a drag."""
    state = state.turned(0.0, 0.0, now.stage.axis, roll=0.0)
    return replace(state, distance=1.0, pan=(0.0, 0.0), pivot=(0.0, 0.0, 0.0)), "where the camera was"


_UNLIGHT = _toggle_colors("unlight", "the light in the picture is divided out", "the colours are those of the picture")
_HIGHLIGHTS = _toggle_colors(
    "remove_highlights", "highlights are taken out, where three or more views are merged", "highlights stay"
)
KEYS = (
    Key(("L",), "L", "the light follows the mouse, or stays", _toggle_light),
    Key(("1", "2", "3", "4", "5"), "1 to 5", "shading: none, flat, gouraud, phong, edl", _choose_shading),
    Key(("V", "SHIFT+V"), "V, Shift+V", "photograph, lit, normals, depth, certainty", _next_seen),
    Key(("D",), "D", "x, y, z, depth, normal under the mouse", _toggle_readout),
    Key(("B",), "B", "compare with the unlit picture", _compare),
    Key(("N",), "N", "next normal estimator", _cycle_normals, of_frame=True),
    Key(("+", "=", "-"), "+ -", "point size", _resize_points, of_frame=True),
    Key(("S",), "S", "shadows on or off", _toggle_shadows),
    Key(("U",), "U", "divide the light in the picture out", _UNLIGHT, of_frame=True),
    Key(("X",), "X", "take the highlights out of merged views", _HIGHLIGHTS, of_frame=True),
    Key(("E",), "E", "light from all around: none, sky, studio", _next_environment),
    Key(("SHIFT+LEFT", "SHIFT+RIGHT"), "Shift+left, right", "turn the environment", _turn_environment),
    Key(("A",), "A", "ambient occlusion: auto, yes, no", _next_occlusion),
    Key(("TAB",), "Tab", "take the next light", _next_light),
    Key(("R",), "R", "reset view, lights and look", Command.RESET),
    Key(("CTRL+Z",), "Ctrl+Z", "undo view, lights or look", Command.UNDO),
    Key(("CTRL+SHIFT+Z", "CTRL+Y"), "Ctrl+Shift+Z, Y", "redo it", Command.REDO),
    Key(("P",), "P", "save a picture, and its command", Command.SAVE_PICTURE),
    Key(tuple(SIDES), "keypad 1, 3, 7", "from front, right, top; Ctrl: opposite", _look_from),
    Key(tuple(TURNS), "keypad 2, 4, 6, 8", "turn the view by 15°", _turn_by),
    Key(("KP9",), "keypad 9", "from the other side", _look_from_behind),
    Key(("KP0",), "keypad 0", "from where the camera was", _look_as_taken),
    Key(("KP.",), "keypad .", "show all of the object", Command.FRAME_OBJECT),
    Key(("O", "CTRL+O"), "O, Ctrl+O", "open files", Command.OPEN_FILES),
    Key(("SHIFT+O",), "Shift+O", "open a folder", Command.OPEN_FOLDER),
    Key(("F", "F11"), "F, F11", "full screen", Command.TOGGLE_FULL_SCREEN),
    Key(("G",), "G", "open or close the panel", Command.TOGGLE_PANEL),
    Key(("SPACE",), "space", "pause or play a sequence", PlayCommand.TOGGLE_PAUSE),
    Key(("LEFT", "RIGHT"), "left, right", "step through a sequence", _one(LEFT=StepFrames(-1), RIGHT=StepFrames(1))),
    Key(("HOME", "END"), "Home, End", "its first, its last frame", _one(HOME=Seek(0), END=Seek(-1))),
    Key((",", "."), ", .", "play slower, faster", _one(**{",": ChangeRate(0.5), ".": ChangeRate(2.0)})),
    Key(("SHIFT+SPACE",), "Shift+space", "repeat a sequence, or stop at its end", PlayCommand.TOGGLE_LOOP),
    Key(("M",), "M", "merge views of a sequence, or play it", PlayCommand.TOGGLE_MERGE),
    Key(("H",), "H", "this help", _toggle_help),
    Key(("Q",), "Q", "quit", Command.CLOSE),
    Key(("ESCAPE",), "Esc", "close this, leave the full screen, or quit", _leave),
)
BY_NAME = {name: key for key in KEYS for name in key.names}
