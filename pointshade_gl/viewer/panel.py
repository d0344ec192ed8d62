"""The panel: sliders for light, material and estimator; what is drawn, and how long it takes. Needs the extra `gui`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..consensus import is_primary
from ..estimators import METHODS
from ..gpu.steps import Lap
from ..look import SHADINGS, SPLATS, Material
from ..scene import Scene
from .events import Event
from .views import Views

if TYPE_CHECKING:
    from .viewer import Viewer

MISSING = "the panel needs the extra 'gui': pip install 'pointshade-gl[gui]'"
SETTLE = 3  # pictures after an event, or after another height, until the panel stops changing
BUTTONS = {"left": 0, "right": 1, "middle": 2}  # as imgui counts them
FRAME_STEPS = "surface", "splats", "resolve", "shadows", "surfaces", "light"
SET_STEPS = "surface", "agreement", "trust", "shadows", "surfaces", "light"
ROWS = 6  # of the list of views that are seen without scrolling
GOLD = 1.0, 0.85, 0.4, 1.0  # colour of the primary ones
STEPS = ("off", "1%", "2%", "3%", "5%", "10%")


class Panel:
    """Draws over the picture with Dear ImGui, in the current context. Raises ImportError without the extra.

    settling   how many more pictures it needs until it stops changing
    """

    def __init__(self, scale: float):
        from imgui_bundle import imgui

        self._imgui: Any = imgui
        self._context = imgui.create_context()
        imgui.set_current_context(self._context)  # another window may have its own
        self._io = imgui.get_io()
        self._io.set_ini_filename("")  # otherwise it writes a file into the working directory
        imgui.style_colors_dark()
        style = imgui.get_style()
        style.item_spacing.y = style.frame_padding.y = 2  # so that all of it fits into a window of 480 pixels
        style.scale_all_sizes(scale)
        style.font_scale_main = scale
        style.window_rounding = 6 * scale
        imgui.backends.opengl3_init("#version 330")
        self._width, self._height = 250 * scale, 0.0
        self._why: tuple[Any, list[str]] | None = None
        self.settling = SETTLE

    def handle(self, event: Event) -> bool:
        """Passes an event to the panel. Returns whether it was meant for the panel."""
        self._imgui.set_current_context(self._context)
        self.settling = SETTLE
        if event.kind == "leave":
            self._io.add_mouse_pos_event(-1e9, -1e9)
        if event.kind in ("move", "press", "release", "wheel"):
            self._io.add_mouse_pos_event(event.x, event.y)
        if event.kind in ("press", "release"):
            self._io.add_mouse_button_event(BUTTONS[event.key], event.kind == "press")
        if event.kind == "wheel":
            self._io.add_mouse_wheel_event(0.0, event.steps)
        return self._io.want_capture_mouse and event.kind in ("move", "press", "wheel")

    def draw(self, viewer: Viewer, width: int, height: int, present: Lap | None) -> None:
        """Draws the panel over a picture of that size, and sets viewer.state to what the user chose."""
        imgui = self._imgui
        imgui.set_current_context(self._context)
        self._io.display_size = imgui.ImVec2(width, height)
        imgui.backends.opengl3_new_frame()
        imgui.new_frame()
        margin = imgui.ImVec2(width - 10, 10)
        imgui.set_next_window_pos(margin, imgui.Cond_.always, imgui.ImVec2(1, 0))
        imgui.set_next_window_size_constraints(imgui.ImVec2(self._width, 0), imgui.ImVec2(self._width, height - 20))
        imgui.set_next_window_bg_alpha(0.85)
        flags = imgui.WindowFlags_
        imgui.begin("pointshade", None, flags.no_title_bar | flags.no_move | flags.always_auto_resize)
        imgui.push_item_width(0.55 * self._width)
        if isinstance(viewer.frame, Views):
            self._views(viewer, viewer.frame)
        self._controls(viewer)
        if isinstance(viewer.frame, Scene):
            self._nodes(viewer, viewer.frame)
        self._facts(viewer, present)
        imgui.pop_item_width()
        before, self._height = self._height, imgui.get_window_size().y
        imgui.end()
        imgui.render()
        imgui.backends.opengl3_render_draw_data(imgui.get_draw_data())
        self.settling = SETTLE if before != self._height else max(self.settling - 1, 0)

    def _controls(self, viewer: Viewer) -> None:
        imgui, state = self._imgui, viewer.state
        imgui.separator_text("light")
        follows = imgui.checkbox("follows the mouse (L)", state.light_mode)[1]
        picker = imgui.ColorEditFlags_.no_inputs
        color = tuple(imgui.color_edit3("colour", list(state.light_color), picker)[1])
        intensity = self._slide("intensity", state.light_intensity, 0.0, 3.0)
        reach = self._slide("distance", state.light_reach, 0.1, 20.0, logarithmic=True)
        self._softness(viewer)
        viewer.state = replace(
            state, light_mode=follows, light_color=color, light_intensity=intensity, light_reach=reach
        )  # fmt: skip
        if not isinstance(viewer.frame, Scene):  # the objects of a scene have their own
            self._surface(viewer)

    def _softness(self, viewer: Viewer) -> None:
        """How large the light is: metres, or degrees of a directional one."""
        held, most = viewer.held, 0.5 * viewer.stage.radius
        name, most = ("angle", 45.0) if held.position is None else ("radius", most)
        size = self._slide(name, getattr(held, name), 0.0, most)
        if size != getattr(held, name):
            viewer.held = replace(held, **{name: size})

    def _surface(self, viewer: Viewer) -> None:
        imgui, state = self._imgui, viewer.state
        look, m = state.look, state.look.material
        imgui.separator_text("surface")
        shading = self._choose("shading", look.shading, SHADINGS)
        material = Material(
            self._slide("ambient", m.ambient, 0.0, 1.0),
            self._slide("diffuse", m.diffuse, 0.0, 1.0),
            self._slide("specular", m.specular, 0.0, 1.0),
            self._slide("shininess", m.shininess, 1.0, 200.0, logarithmic=True),
        )
        imgui.separator_text("points")
        normals = self._choose("normals", str(look.normals), METHODS)
        before = "off" if look.max_depth_step is None else str(look.max_depth_step)
        step = self._choose("depth step", before, STEPS)
        splat = self._choose("splat", look.splat, SPLATS)
        unlight = imgui.checkbox("take out its light (U)", look.unlight)[1]
        matte = imgui.checkbox("take out its highlights (X)", look.remove_highlights)[1]
        size = self._slide("size", state.point_size, 0.25, 8.0, logarithmic=True)
        viewer.state = state.with_look(
            shading=shading, material=material, normals=normals, splat=splat,
            size=None if splat == "mesh" else look.size if size == state.point_size else size,
            max_depth_step=look.max_depth_step if step == before else None if step == "off" else step, unlight=unlight,
            remove_highlights=matte,
        )  # fmt: skip

    def _views(self, viewer: Viewer, views: Views) -> None:
        """A switch for each view, and how much it counts; below, if it is opened, what the views agree on."""
        imgui, weights = self._imgui, viewer.renderer.weights
        opened = imgui.TreeNodeFlags_.default_open
        if imgui.collapsing_header(f"{len(views.shown)} of {len(views.frames)} views as one###views", opened):
            row = imgui.get_frame_height() + 2 * imgui.get_style().cell_padding.y
            size = imgui.ImVec2(0, min(len(views.frames), ROWS) * row)
            imgui.begin_table("rows", 2, imgui.TableFlags_.scroll_y, size)
            imgui.table_setup_column("name", imgui.TableColumnFlags_.width_stretch)
            imgui.table_setup_column("weight", imgui.TableColumnFlags_.width_fixed)
            for k, (frame, name, before) in enumerate(zip(views.frames, views.names, views.on, strict=True)):
                imgui.table_next_column()
                on = imgui.checkbox(f"{views.kind} {name}##{k}".lstrip(), before)[1]
                imgui.table_next_column()
                self._weight(weights.get(frame, 0.0) if before else None)
                if on != before:
                    viewer.frame = views.switched(k, on)
            imgui.end_table()
            if not all(views.on) and imgui.button("all on"):
                viewer.frame = views.all_on()
        if imgui.collapsing_header("why"):
            imgui.text_wrapped("\n".join(self._explained(viewer, views)))

    def _weight(self, weight: float | None) -> None:
        """How much a view counts; None: it is off."""
        if weight is not None and is_primary(weight):
            self._imgui.text_colored(GOLD, "primary")
        else:
            self._imgui.text_disabled("off" if weight is None else f"{100 * weight:.0f} %")

    def _explained(self, viewer: Viewer, views: Views) -> list[str]:
        """Asked for once, not for each picture: it is read from the GPU."""
        key = views.shown, viewer.state.look
        if self._why is None or self._why[0] != key:
            self._why = key, viewer.renderer.explain(views.shown_names)
        return self._why[1]

    def _nodes(self, viewer: Viewer, scene: Scene) -> None:
        self._imgui.separator_text("scene")
        for path, node in scene.every_node():
            label = f"{node.name or 'node'}##{path}"  # the part after ## is hidden and tells equal names apart
            self._imgui.indent(10.0 * len(path))
            visible = self._imgui.checkbox(label, node.visible)[1]
            self._imgui.unindent(10.0 * len(path))
            if visible != node.visible:
                viewer.frame = scene.with_node(path, visible=visible)

    def _facts(self, viewer: Viewer, present: Lap | None) -> None:
        imgui, laps = self._imgui, viewer.renderer.steps.laps
        imgui.separator_text("this picture")
        names = SET_STEPS if isinstance(viewer.frame, Views) else FRAME_STEPS
        for name, lap in [*((name, laps.get(name)) for name in names), ("present", present)]:
            imgui.text(f"{name:9s}" + ("" if lap is None else f"{lap.gpu_ms or lap.wall_ms:7.1f} ms"))
        choice = viewer.renderer.choice
        imgui.text(f"{viewer.frame.points_known} points" + (f", {choice.method}" if choice else ""))
        imgui.text_wrapped(viewer.renderer.context.renderer)

    def _slide(self, label: str, value: float, low: float, high: float, logarithmic: bool = False) -> float:
        flags = self._imgui.SliderFlags_
        kind = flags.no_input | (flags.logarithmic if logarithmic else 0)
        changed, new = self._imgui.slider_float(label, value, low, high, "%.2f", kind)
        return new if changed else value  # an untouched slider keeps its value exactly, even beyond its ends

    def _choose(self, label: str, value: str, known: tuple[str, ...]) -> str:
        names = list(known) if value in known else [value, *known]
        return names[self._imgui.combo(label, names.index(value), names)[1]]

    def release(self) -> None:
        self._imgui.set_current_context(self._context)
        self._imgui.backends.opengl3_shutdown()
        self._imgui.destroy_context(self._context)
