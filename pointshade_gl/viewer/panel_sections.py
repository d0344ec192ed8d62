"""The panel's sections and widgets: facts, views, light, surface, points, nodes, and what the user made of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..estimation.multi_view import is_primary
from ..gpu.context.software_driver import is_software
from ..gpu.core.steps import Timing
from ..scene.appearance import CLOUD_SPLATS, FRAME_SPLATS, NOT_LIT, Appearance
from ..scene.cloud import CloudStyle
from ..scene.environment import NAMES
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.light import Light, Vector
from ..scene.noise import SENSORS, Choice
from ..scene.option_fields import option_of
from ..scene.orbit import State
from ..scene.settings import OCCLUSION
from .controller import KINDS, as_kind, kind_of, placed, titles
from .events import Command, Effect, RemoveLight, ShowFrame, TakeLight
from .state import UNITS, ShownPicture, Snapshot, Views, clouds_of, restyled, scene_in, size_of, views_in, with_unit

LINE = 22.0  # of an explanation, in letters' heights
NAMES_WIDTH = 6.4  # width of the names' column, in sizes of the messages' font


class Widgets:
    """Draws them by Dear ImGui, and gives what the user made of their values."""

    def __init__(self, imgui: Any):
        self.imgui, self.em = imgui, 1.0  # size of the font as the messages count it, pixels
        self.explained: tuple[Any, list[str]] = None, []  # what merged views agree on, after what that depends on
        self._held = "", 0.0  # the number that was pressed last, and what it was before

    def slide(
        self, name: str, value: float, default: float, low: float, high: float, why: str = "", logarithmic: bool = False
    ) -> float:
        """A number between two others. A double click, or Ctrl and a click, lets it be typed."""
        if self._is_reset(name, why):
            return default
        flags, draw = self.imgui.SliderFlags_, self.imgui.slider_float
        kind = flags.logarithmic if logarithmic else flags.none
        return self._number(name, value, low, high, lambda v: draw(f"##{name}", v, low, high, "%.2f", kind))

    def drag(self, name: str, value: float, step: float, farthest: float, why: str = "") -> float:
        """A number without a default, that changes by a step for each pixel; typed as that of a slider."""
        self._name(name, why)
        low, high, draw = -farthest, farthest, self.imgui.drag_float
        return self._number(name, value, low, high, lambda v: draw(f"##{name}", v, step, low, high, "%.3f"))

    def choose(self, name: str, value: str, default: str, known: Sequence[str], why: str = "") -> str:
        imgui, chosen = self.imgui, value
        if self._is_reset(name, why):
            return default
        if imgui.begin_combo(f"##{name}", value):
            for one in known if value in known else (value, *known):
                if imgui.selectable(one, one == value)[0]:
                    chosen = one
                if one == value:
                    imgui.set_item_default_focus()
            imgui.end_combo()
        return chosen

    def color(self, name: str, value: Vector, default: Vector) -> Vector:
        """A square in a colour; a click on it opens more of them. Untouched it stays exactly what it was."""
        imgui = self.imgui
        if self._is_reset(name):
            return default
        changed, picked = imgui.color_edit3(f"##{name}", list(value), imgui.ColorEditFlags_.no_inputs)
        return tuple(picked) if changed else value

    def tick(self, name: str, value: bool, why: str = "") -> bool:
        new = self.imgui.checkbox(name, value)[1]
        self.explain(why)
        return new

    def option(
        self, options: Any, field: str, name: str = "", words: Any = (), other: str = "", key: str = "", why: str = "",
        **slider: Any,
    ) -> Any:  # fmt: skip
        """A field of options, which has the default, the values to choose from and the explanation.

        name    that the row shows; "": the field's
        words   in place of the field's own values: a mapping to what each stands for, or themselves
        other   word for a value that is none of them; "": the value
        key     that changes it, too
        why     in place of the field's explanation, where that names options of the command line
        slider  low, high and logarithmic, of one that is not from 0 to 1
        """
        one: Any = next(found for found in fields(options) if found.name == field)
        about, value, name, default = option_of(one), getattr(options, field), name or field, one.default
        words, why = words or about.cli.known, (why or about.help) + (f" Key: {key}." if key else "")
        if words:
            meant = words if isinstance(words, Mapping) else {word: word for word in words}
            before = _word(value, meant, other)
            chosen = self.choose(name, before, _word(default, meant, other), tuple(meant), why)
            return value if chosen == before else meant[chosen]
        if isinstance(value, bool):
            return self.tick(name, value, why)
        return self.slide(name, value, default, **{"low": 0.0, "high": 1.0, **slider}, why=why)

    def row(self, name: str, text: str) -> None:
        self._name(name)
        self.imgui.text_unformatted(text)

    def section(self, name: str, opened: bool = True) -> bool:
        """A heading that opens and closes what follows: whether it is open."""
        flags = self.imgui.TreeNodeFlags_
        return self.imgui.collapsing_header(name, flags.default_open if opened else flags.none)

    def note(self, text: str) -> None:
        imgui = self.imgui
        imgui.push_style_color(imgui.Col_.text, imgui.get_style_color_vec4(imgui.Col_.text_disabled))
        imgui.text_wrapped(text)
        imgui.pop_style_color()

    def fitted(self, text: str, beside: float = 0.0) -> str:
        """As much of the beginning as fits into the row behind a box. beside: pixels that something else takes."""
        imgui = self.imgui
        space = imgui.get_content_region_avail().x - beside
        space -= imgui.get_frame_height() + imgui.get_style().item_inner_spacing.x
        if imgui.calc_text_size(text).x <= space:
            return text
        kept = next((n for n in range(len(text) - 1, 1, -1) if imgui.calc_text_size(f"{text[:n]}…").x <= space), 1)
        return f"{text[:kept]}…"

    def explain(self, why: str) -> None:
        """An explanation, shown while the mouse is over the last item."""
        imgui = self.imgui
        if why and imgui.begin_item_tooltip():
            imgui.push_text_wrap_pos(imgui.get_font_size() * LINE)
            imgui.text_unformatted(why)
            imgui.pop_text_wrap_pos()
            imgui.end_tooltip()

    def _is_reset(self, name: str, why: str = "") -> bool:
        """Shows a name; whether a double click on it asks for the default."""
        imgui = self.imgui
        return self._name(name, why) and imgui.get_io().key_alt and imgui.is_mouse_clicked(0)

    def _name(self, name: str, why: str = "") -> bool:
        """Shows a name, and begins the widget that takes the rest of its row. Returns whether the mouse is over it."""
        imgui = self.imgui
        left = imgui.get_cursor_pos_x()
        imgui.align_text_to_frame_padding()
        imgui.text_unformatted(name)
        is_over = imgui.is_item_hovered()
        self.explain(why)
        imgui.same_line(left + NAMES_WIDTH * self.em)
        imgui.set_next_item_width(-1.0)
        return is_over

    def _number(self, name: str, value: float, low: float, high: float, draw: Callable[[float], Any]) -> float:
        """What the user made of a number. Untouched it stays, even beyond the ends."""
        if self.imgui.get_io().key_alt and self._held[0] == name:  # the first click of two moved it: that is taken back
            value = self._held[1]
        changed, new = draw(value)
        if self.imgui.is_item_activated():
            self._held = name, value
        return min(max(float(f"{new:.6g}"), low), high) if changed else value  # as typed: imgui's numbers are float32


def _word(value: Any, words: Mapping[str, Any], other: str) -> str:
    """What stands for a value."""
    known = getattr(value, "name", value)  # of an environment
    same = (word for word, one in words.items() if one is known or (isinstance(one, str) and one == known))
    return next(same, other or (f"{known:g}" if isinstance(known, float) else str(known)))


NOTE = (
    "Double click on a name: the usual value. On a number, or Ctrl and a click: type it. Point at a name: what it is."
)
FRAME_STEPS = "surface", "splats", "resolve", "shadows", "surfaces", "light"
SET_STEPS = "surface", "agreement", "trust", "shadows", "surfaces", "light"
ROWS = 6  # of the list of views that are seen without scrolling
GOLD = 1.0, 0.85, 0.4, 1.0  # colour of the primary ones
BRIGHTEST = 10.0
MAX_PLACE = 1e4  # metres
DEEPEST = 6  # levels of a scene that are seen
USUAL, WIDE = State(), 45.0  # what a double click on a name brings back
STEPS = {"off": None} | {share: share for share in ("1%", "2%", "3%", "5%", "10%")}
NOISE = "Noise of the depth: as it is measured, or as a sensor has it."
POINTS: dict[str, dict[str, Any]] = {  # the options of frames' points, and what their rows have beside the fields' own
    "normals": {"key": "N"},
    "max_depth_step": {"name": "depth step", "words": STEPS},
    "noise": {"words": {"measured": None} | {sensor: sensor for sensor in SENSORS}, "why": NOISE},
    "flying": {},
    "splat": {"words": FRAME_SPLATS},
    "unlight": {"name": "no own light (U)"},
    "remove_highlights": {"name": "no highlights (X)"},
    "align": {"name": "align views"},
}


class PanelFacts(NamedTuple):
    """What the panel shows, and does not change."""

    driver: str  # its name for what draws
    choice: Choice | None  # what estimated the last normals; None: nothing yet
    weights: Mapping[Frame, float]  # how much each frame of the last picture counts
    # what the views that have these names agree on, in lines; None: this is not the time to ask
    explain: Callable[[Sequence[str]], list[str]] | None
    rate: float | None  # pictures per second; None at rest
    samples: tuple[int, int]  # how many the window shows, and how many it will show if nothing moves
    laps: Mapping[str, Timing] = {}  # of the steps of the last picture


def show_facts(ui: Widgets, picture: ShownPicture, facts: PanelFacts, opened: bool) -> None:
    """Show rate and samples in two lines; below, if it is opened, the times of the steps and what draws."""
    imgui = ui.imgui
    imgui.text(f"{facts.rate:.1f} pictures/s" if facts.rate else "at rest")
    in_it, most = facts.samples
    imgui.text(f"{in_it} of {most} sample{'s' if most > 1 else ''}")
    if not ui.section("this picture", opened):
        return
    for name in (*(SET_STEPS if views_in(picture.shown) else FRAME_STEPS), "present"):
        lap = facts.laps.get(name)
        ui.row(name, "" if lap is None else f"{lap.gpu_ms or lap.wall_ms:.1f} ms")
    imgui.text_wrapped(f"{picture.shown.points_known} points" + (f", {facts.choice.method}" if facts.choice else ""))
    imgui.text_wrapped(facts.driver + (", a software renderer: slow" if is_software(facts.driver) else ""))


def show_sections(
    ui: Widgets, picture: ShownPicture, facts: PanelFacts, has_room: bool
) -> tuple[Snapshot, list[Effect]]:
    """Show what there is of a picture, and return what the user made of it. has_room: all sections are open."""
    now, scene, views = picture.now, scene_in(picture.shown), views_in(picture.shown)
    show_facts(ui, picture, facts, has_room)
    effects = show_views(ui, now.state.look, views, facts) if views else []
    now, taken = show_light(ui, now, picture.shown.pose)
    effects += taken
    state = show_surface(ui, show_environment(ui, now.state, has_room), scene is not None)
    if scene is None:
        state = show_points(ui, state, has_room)
    else:
        effects += [*show_clouds(ui, scene, has_room), *show_nodes(ui, scene)]
    ui.note(NOTE)
    return now._replace(state=state), effects


def show_views(ui: Widgets, look: Appearance, views: Views, facts: PanelFacts) -> list[Effect]:
    """List the views, what they agree on below, and return which ones the user switched."""
    effects: list[Effect] = []
    if ui.section(f"{len(views.shown)} of {len(views.frames)} views as one###views"):
        effects = _list_views(ui, views, facts.weights)
    if ui.section("why", opened=False):
        key = views.shown, look
        if facts.explain and ui.explained[0] != key:  # once: it is read from the GPU
            ui.explained = key, facts.explain(views.shown_names)
        ui.imgui.text_wrapped("\n".join(ui.explained[1]))
    return effects


def _list_views(ui: Widgets, views: Views, weights: Mapping[Frame, float]) -> list[Effect]:
    imgui = ui.imgui
    row = imgui.get_frame_height() + 2 * imgui.get_style().cell_padding.y
    size = imgui.ImVec2(0, min(len(views.frames), ROWS) * row)
    if not imgui.begin_table("rows", 2, imgui.TableFlags_.scroll_y, size):
        return []  # no row of it would be seen
    imgui.table_setup_column("name", imgui.TableColumnFlags_.width_stretch)
    imgui.table_setup_column("weight", imgui.TableColumnFlags_.width_fixed)
    effects: list[Effect] = []
    for k, (frame, name, before) in enumerate(zip(views.frames, views.names, views.on, strict=True)):
        imgui.table_next_column()
        title = ui.fitted(f"{views.kind} {name}".lstrip())
        on = imgui.checkbox(f"{title}##{k}", before)[1]
        imgui.table_next_column()
        _show_weight(imgui, weights.get(frame, 0.0) if before else None)
        if on != before:
            effects.append(ShowFrame(views.switched(k, on)))
    imgui.end_table()
    if not all(views.on) and imgui.button("all on"):
        effects.append(ShowFrame(views.all_on()))
    return effects


def _show_weight(imgui: Any, weight: float | None) -> None:
    """How much a view counts; None: it is off."""
    if weight is not None and is_primary(weight):
        imgui.text_colored(GOLD, "primary")
    else:
        imgui.text_disabled("off" if weight is None else f"{100 * weight:.0f} %")


def show_light(ui: Widgets, now: Snapshot, pose: NDArray[np.float64]) -> tuple[Snapshot, list[Effect]]:
    """Show the lights, and the one that the mouse holds. pose: of the own camera."""
    if not ui.section("light"):
        return now, []
    imgui, state = ui.imgui, now.state
    effects = _list(ui, now)
    changes: dict[str, Any] = {"lit": ui.tick("lit (B)", state.lit)}
    imgui.begin_disabled(not changes["lit"])
    changes["light_mode"] = ui.tick("follows the mouse (L)", state.light_mode)
    why = "Off, no light casts any. On, each light has its own switch."
    changes["shadows"] = ui.tick("shadows (S)", state.shadows, why)
    held = _held(ui, now.held, now.stage.radius, changes["shadows"])
    changes["light_color"] = ui.color("colour", state.light_color, USUAL.light_color)
    changes["light_intensity"] = ui.slide("intensity", state.light_intensity, 1.0, 0.0, BRIGHTEST, logarithmic=True)
    why = "From the middle of the object. 1: as far as at the start."
    changes["light_reach"] = ui.slide("distance", state.light_reach, 1.0, 0.1, 20.0, why, True)
    place = _place(ui, now, pose)
    changes["finish"] = replace(state.finish, tone=ui.option(state.finish, "tone"))
    imgui.end_disabled()
    now = now._replace(state=replace(state, **changes), held=held)
    return placed(now, place, pose) if place else now, effects


def _list(ui: Widgets, now: Snapshot) -> list[Effect]:
    """Several lights have a row each: a click on it lets the mouse hold the light, its x takes it away."""
    imgui, effects = ui.imgui, []
    side = imgui.get_frame_height()
    for k, title in enumerate(titles(now) if now.lights else ()):
        label = ui.fitted(title, side + imgui.get_style().item_spacing.x)
        if imgui.radio_button(f"{label}##{k}", k == now.number):
            effects.append(TakeLight(k))
        imgui.same_line(imgui.get_cursor_pos_x() + imgui.get_content_region_avail().x - side)
        if imgui.button(f"x##{k}", imgui.ImVec2(side, 0)):
            effects.append(RemoveLight(k))
        ui.explain(f"Takes {title} away.")
    if imgui.button("add a light"):
        effects.append(Command.ADD_LIGHT)
    ui.explain("A point light, elsewhere around the object. The mouse holds it; the one before stays where it is.")
    return effects


def _place(ui: Widgets, now: Snapshot, pose: NDArray[np.float64]) -> Vector | None:
    """Where the light that the mouse holds is, or which way it shines; None: nothing was changed."""
    light = now.state.light(now.stage, pose, now.held)
    if light.position is not None:
        before, word, step, most = light.position, "at", 0.01 * now.stage.radius, MAX_PLACE
        why = "Where the light is in the world, in metres; it stays there."
    else:
        assert light.direction is not None, "a light has a place or a direction"
        before, word, step, most = light.direction, "towards", 0.01, 1.0
        why = "Which way the light shines in the world; it stays there."
    x, y, z = (ui.drag(f"{word} {axis}", number, step, most, why) for axis, number in zip("xyz", before, strict=True))
    return None if (x, y, z) == before else (x, y, z)


def _held(ui: Widgets, held: Light, reach: float, shadows: bool) -> Light:
    """Kind, shadow and size of the light that the mouse holds."""
    why = "A point shines to all sides, a spot into a cone, the sun one way, an area as a rectangle does that glows."
    kind = ui.choose("kind", kind_of(held), KINDS[0], KINDS, why)
    changed = held if kind == kind_of(held) else as_kind(held, kind, 0.5 * reach)
    if changed.is_spot:
        inner, outer = changed.cone
        cone = ui.slide("cone", outer, WIDE, 1.0, 90.0, "Half the angle of the spot's cone, in degrees.")
        changed = changed if cone == outer else replace(changed, cone=(min(inner, cone), cone))
    ui.imgui.begin_disabled(not shadows)
    shadow = ui.tick("casts a shadow", changed.shadow)
    ui.imgui.end_disabled()
    changed = replace(changed, **_extent(ui, changed, reach), shadow=shadow)
    return held if changed == held else changed


def _extent(ui: Widgets, light: Light, reach: float) -> dict[str, Any]:
    why = "How large the light is, {}. Large lights cast soft shadows, which become exact once nothing moves.{}"
    if light.size is not None:
        sides = zip(("width", "height"), light.size, strict=True)
        why = why.format("in metres", "")
        return {"size": tuple(ui.slide(n, side, 0.5 * reach, 0.01 * reach, 2 * reach, why, True) for n, side in sides)}
    name, most, unit = "angle", 45.0, "in degrees; the sun has 0.53"
    if light.position:
        name, most, unit = "radius", 0.5 * reach, "in metres"
    return {name: ui.slide(name, getattr(light, name), 0.0, 0.0, most, why.format(unit, " 0 casts sharp ones."))}


def show_environment(ui: Widgets, state: State, opened: bool) -> State:
    """Show which environment there is, how bright it is and how it stands, and whether what is near hides it."""
    if not ui.section("light from all around", opened):
        return state
    imgui, finish = ui.imgui, state.finish
    imgui.begin_disabled(not state.is_lit)
    words = {"none": None} | {name: name for name in NAMES}
    why = "Light from all around, in place of ambient light."
    changes = {"environment": ui.option(finish, "environment", words=words, other="own", key="E", why=why)}
    imgui.begin_disabled(changes["environment"] is None)
    field = "environment_intensity"
    changes[field] = ui.option(finish, field, "brightness", high=BRIGHTEST, logarithmic=True)
    field, key = "environment_rotation", "Shift and left or right; or drag with the right button"
    if isinstance(finish.environment_rotation, float):
        changes[field] = ui.option(finish, field, "turned", high=360.0, key=key)
    imgui.end_disabled()
    changes["ambient_occlusion"] = ui.option(finish, "ambient_occlusion", "occlusion", OCCLUSION, key="A")
    imgui.end_disabled()
    return state.with_finish(**changes)


def show_surface(ui: Widgets, state: State, is_scene: bool) -> State:
    """Show how surfaces answer light. The objects of a scene have materials of their own."""
    if not ui.section("surface"):
        return state
    look, changes = state.look, {}
    ui.imgui.begin_disabled(not state.lit)
    shading = ui.option(look, "shading", key="1 to 5")
    ui.imgui.begin_disabled(look.shading in NOT_LIT)
    if not is_scene:
        changes = {name: ui.option(look.material, name) for name in ("ambient", "diffuse", "specular")}
        changes["shininess"] = ui.option(look.material, "shininess", low=1.0, high=200.0, logarithmic=True)
    ui.imgui.end_disabled()
    ui.imgui.end_disabled()
    return state.with_look(shading=shading, material=replace(look.material, **changes))


def show_points(ui: Widgets, state: State, opened: bool) -> State:
    """Show how normals are estimated, and what is drawn of each point of frames."""
    if not ui.section("points", opened):
        return state
    changes = {field: ui.option(state.look, field, **own) for field, own in POINTS.items()}
    is_mesh = changes["splat"] == "mesh"
    ui.imgui.begin_disabled(is_mesh)
    why = "Of the points, in pixels of the frame (+ and -)."
    size = ui.slide("size", state.point_size, USUAL.point_size, 0.25, 8.0, why, True)
    ui.imgui.end_disabled()
    changes["point_size"] = None if is_mesh else state.look.point_size if size == state.point_size else size
    return state.with_look(**changes)


def show_clouds(ui: Widgets, scene: Scene, opened: bool) -> list[Effect]:
    """Show what is drawn of each point of a scene's clouds, as the first of them has it."""
    clouds = clouds_of(scene)
    if not clouds or not ui.section("points of clouds", opened):
        return []
    first, (number, unit) = clouds[0], size_of(clouds[0])
    why = "What is drawn of a point: a disc, blended with those beside it into a surface; or a ball."
    splat: Any = ui.choose("splat", first.splat, CLOUD_SPLATS[0], CLOUD_SPLATS, why)
    usual, rule = first.styled(point_size=None).radius_rule
    low, high = (0.25, 8.0) if unit == "x" else (0.5, 32.0) if unit else (0.1 * number, 10 * number)
    why = f"Radius, {UNITS[unit]} (+ and -)."
    size = ui.slide("size", number, usual if rule == unit else number, low, high, why, True)
    if splat == first.splat and size == number:
        return []
    style = CloudStyle(point_size=with_unit(size, unit)) if splat == first.splat else CloudStyle(splat=splat)
    return [ShowFrame(restyled(scene, lambda _: style))]


def show_nodes(ui: Widgets, scene: Scene) -> list[Effect]:
    effects: list[Effect] = []
    for path, node in scene.every_node() if ui.section("scene") else ():
        depth = 0.7 * ui.em * min(len(path), DEEPEST)
        ui.imgui.indent(depth)
        label = f"{ui.fitted(node.name or 'node')}##{path}"  # what is after ## is hidden; equal names differ by it
        visible = ui.imgui.checkbox(label, node.visible)[1]
        ui.imgui.unindent(depth)
        if visible != node.visible:
            effects.append(ShowFrame(scene.with_node(path, visible=visible)))
    return effects
