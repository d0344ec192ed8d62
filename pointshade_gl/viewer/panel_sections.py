"""The panel's rows for light, surface and points."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..scene.appearance import FLYING, SHADINGS, SPLATS, Look, Material
from ..scene.graph import Scene
from ..scene.noise import SENSORS
from ..scene.normal_methods import METHODS
from .lights import KINDS, as_kind, kind_of
from .panel_widgets import Widgets

if TYPE_CHECKING:
    from .viewer import Viewer

STEPS = ("off", "1%", "2%", "3%", "5%", "10%")
BRIGHTEST = 10.0


def show_light(ui: Widgets, viewer: Viewer) -> None:
    """The lights, and the one that the mouse holds."""
    if not ui.section("light"):
        return
    _choose_light(ui, viewer)
    imgui, state = ui.imgui, viewer.state
    lit = ui.tick("lit (B)", state.lit)
    imgui.begin_disabled(not lit)
    follows = ui.tick("follows the mouse (L)", state.light_mode)
    shadows = ui.tick("shadows (S)", state.shadows, "Off, no light casts any. On, each light has its own switch.")
    _held(ui, viewer, shadows)
    changed, picked = imgui.color_edit3("colour", list(state.light_color), imgui.ColorEditFlags_.no_inputs)
    _fill(imgui, picked)
    color = tuple(picked) if changed else state.light_color  # untouched it stays exactly what it was
    intensity = ui.slide("intensity", state.light_intensity, 0.0, BRIGHTEST, logarithmic=True)
    reach = ui.slide(
        "distance", state.light_reach, 0.1, 20.0, "From the middle of the object. 1: as far as at the start.", True
    )
    imgui.end_disabled()
    viewer.state = replace(
        state, lit=lit, light_mode=follows, shadows=shadows, light_color=color, light_intensity=intensity,
        light_reach=reach,
    )  # fmt: skip


def _fill(imgui: Any, color: list[float]) -> None:
    """The last row's square in its colour: imgui leaves it empty in a window that scrolls."""
    (x, y), side = imgui.get_item_rect_min(), imgui.get_frame_height()
    shade = imgui.get_color_u32(imgui.ImVec4(*color, 1.0))
    corners = imgui.ImVec2(x + 1, y + 1), imgui.ImVec2(x + side - 1, y + side - 1)
    imgui.get_window_draw_list().add_rect_filled(*corners, shade)


def _choose_light(ui: Widgets, viewer: Viewer) -> None:
    """A list of the lights, if there are several."""
    titles = viewer.light_titles
    if len(titles) > 1:
        for number, title in enumerate(titles):
            if ui.imgui.radio_button(f"{title}##{number}", number == viewer.light_number):
                viewer.take_light(number)


def _held(ui: Widgets, viewer: Viewer, shadows: bool) -> None:
    """Kind, shadow and size of the light that the mouse holds."""
    held = viewer.held
    kind = ui.choose("kind", kind_of(held), KINDS, "A point shines to all sides, a spot into a cone, the sun one way.")
    changed = held if kind == kind_of(held) else as_kind(held, kind)
    if changed.is_spot:
        inner, outer = changed.cone
        cone = ui.slide("cone", outer, 1.0, 90.0, "Half the angle of the spot's cone, in degrees.")
        changed = changed if cone == outer else replace(changed, cone=(min(inner, cone), cone))
    name, most = ("angle", 45.0) if kind == "directional" else ("radius", 0.5 * viewer.stage.radius)
    of = "in degrees; the sun has 0.53" if kind == "directional" else "in metres"
    size = ui.slide(name, getattr(changed, name), 0.0, most, f"How large the light is, {of}. Large lights cast soft "
                    "shadows, once nothing moves. 0 casts sharp ones.")  # fmt: skip
    ui.imgui.begin_disabled(not shadows)
    shadow = ui.tick("casts a shadow", changed.shadow)
    ui.imgui.end_disabled()
    changed = replace(changed, **{name: size, "shadow": shadow})
    if changed != held:
        viewer.held = changed


def show_surface(ui: Widgets, viewer: Viewer) -> None:
    """How surfaces answer light. The objects of a scene have materials of their own."""
    if not ui.section("surface"):
        return
    state, is_scene = viewer.state, isinstance(viewer.frame, Scene)
    ui.imgui.begin_disabled(not state.lit)
    look, m = state.look, state.look.material
    shading = ui.choose("shading", look.shading, SHADINGS, "none: the picture's own colours. flat: one colour a point. "
                        "gouraud: light mixed between points. phong: light at each pixel. Keys 1 to 4.")  # fmt: skip
    ui.imgui.begin_disabled(look.shading == "none")
    material = m if is_scene else _material(ui, m)
    ui.imgui.end_disabled()
    ui.imgui.end_disabled()
    viewer.state = state.with_look(shading=shading, material=material)


def _material(ui: Widgets, m: Material) -> Material:
    return Material(
        ui.slide("ambient", m.ambient, 0.0, 1.0),
        ui.slide("diffuse", m.diffuse, 0.0, 1.0),
        ui.slide("specular", m.specular, 0.0, 1.0),
        ui.slide("shininess", m.shininess, 1.0, 200.0, logarithmic=True),
    )


def show_points(ui: Widgets, viewer: Viewer, opened: bool) -> None:
    """How normals are estimated, and what is drawn of each point."""
    if isinstance(viewer.frame, Scene) or not ui.section("points", opened):
        return
    state = viewer.state
    look = state.look
    changes = {
        "normals": ui.choose("normals", str(look.normals), METHODS, "Which estimator finds where surfaces point (N). "
                             "auto measures the noise and picks one."),
        "max_depth_step": _depth_step(ui, look),
        "noise": _noise(ui, look),
        "flying": ui.choose("flying", look.flying, FLYING, "Pixels that hang between two surfaces, because the sensor "
                            "mixed them. snap puts them onto the nearer one; clean depth does not change."),
        "splat": ui.choose("splat", look.splat, SPLATS, "What is drawn of a point: footprint, its pixel's square on "
                           "the surface; round, a disc; mesh, triangles between neighbours."),
        "unlight": ui.tick("no own light (U)", look.unlight, "Estimates the light in the photograph, and divides "
                           "it out of the colours."),
        "remove_highlights": ui.tick("no highlights (X)", look.remove_highlights,
                                     "Takes the highlights in the photograph out of the colours."),
    }  # fmt: skip
    is_mesh = changes["splat"] == "mesh"
    ui.imgui.begin_disabled(is_mesh)
    size = ui.slide("size", state.point_size, 0.25, 8.0, "Of the points, in pixels of the frame (+ and -).", True)
    ui.imgui.end_disabled()
    changes["size"] = None if is_mesh else look.size if size == state.point_size else size
    viewer.state = state.with_look(**changes)


def _noise(ui: Widgets, look: Look) -> Any:
    """Arrays are not shown: a viewer's look has none."""
    before = "measured" if look.noise is None else str(look.noise)
    noise = ui.choose("noise", before, ("measured", *SENSORS), "How noisy the depth is. measured: the picture tells. "
                      "Or as a sensor's data sheet says it.")  # fmt: skip
    return look.noise if noise == before else None if noise == "measured" else noise


def _depth_step(ui: Widgets, look: Look) -> float | str | None:
    before = "off" if look.max_depth_step is None else str(look.max_depth_step)
    step = ui.choose("depth step", before, STEPS, "Where the depth of neighbouring pixels differs by more, a surface "
                     "ends. off: the estimator decides by itself.")  # fmt: skip
    return look.max_depth_step if step == before else None if step == "off" else step
