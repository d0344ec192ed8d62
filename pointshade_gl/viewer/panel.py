"""The panel beside the picture: rows for everything that has a number. Needs the extra `gui`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..gpu.core.steps import Lap
from .events import Event
from .panel_facts import show_facts
from .panel_input import PanelInput
from .panel_sections import show_light, show_points, show_surface
from .panel_things import ViewsList, show_nodes
from .panel_widgets import Widgets

if TYPE_CHECKING:
    from .viewer import Viewer
    from .window import Window

MISSING = "the panel needs the extra 'gui': pip install 'pointshade-gl[gui]'"
WIDTH, NARROWEST = 210.0, 150.0  # pixels at scale 1
SHARE = 1 / 3  # of the window's width, at most, unless that is too narrow
TALL = 900  # a window that is higher, in pixels at scale 1, has room for all sections


class Panel:
    """Draws beside the picture with Dear ImGui, in the current context. Raises ImportError without the extra.

    scale   of its text
    """

    def __init__(self, window: Window):
        from imgui_bundle import imgui

        self.scale = window.scale
        self._imgui: Any = imgui
        self._context = imgui.create_context()
        imgui.set_current_context(self._context)  # another window may have its own
        self._io = imgui.get_io()
        self._io.set_ini_filename("")  # otherwise it writes a file into the working directory
        imgui.style_colors_dark()
        style = imgui.get_style()
        style.item_spacing.y = style.frame_padding.y = 2  # so that most of it fits into a window of 480 pixels
        style.window_padding = imgui.ImVec2(6, 6)
        style.item_spacing.x = 4
        style.scale_all_sizes(self.scale)
        style.font_scale_main = self.scale
        style.window_border_size = 0
        style.hover_flags_for_tooltip_mouse = 0  # at once: no pictures come to wait for
        style.set_color_(imgui.Col_.slider_grab, imgui.ImVec4(0.26, 0.59, 0.98, 0.5))  # numbers are read through it
        imgui.backends.opengl3_init("#version 330")
        self._input = PanelInput(imgui, window)
        self._widgets, self._views = Widgets(imgui), ViewsList()
        self._left, self._height, self._is_open = 0.0, 0.0, True

    @property
    def settling(self) -> int:
        """How many more pictures it needs until it stops changing."""
        return self._input.settling

    @property
    def is_deciding(self) -> bool:
        """Keys must wait: it was clicked on, and what the click opens may take them."""
        return self._input.is_deciding

    def width(self, width: int) -> int:
        """Pixels that it takes from a window of that width; 0 while it is collapsed, or if nothing would be left."""
        taken = round(self._width(width))
        return taken if self._is_open and taken < width else 0

    def _width(self, width: int) -> float:
        return min(WIDTH * self.scale, max(SHARE * width, NARROWEST * self.scale), width)

    def handle(self, event: Event) -> bool:
        """Passes an event to the panel. Returns whether it was meant for the panel."""
        self._imgui.set_current_context(self._context)
        return self._input.handle(event, event.x >= self._left and event.y < self._height)

    def draw(self, viewer: Viewer, width: int, height: int, present: Lap | None) -> None:
        """Draws the panel over a window of that size, and sets viewer.state to what the user chose."""
        imgui = self._imgui
        imgui.set_current_context(self._context)
        self._io.display_size = imgui.ImVec2(width, height)
        imgui.backends.opengl3_new_frame()
        imgui.new_frame()
        wide = self._width(width)
        self._left = width - wide
        imgui.set_next_window_pos(imgui.ImVec2(width, 0), imgui.Cond_.always, imgui.ImVec2(1, 0))
        imgui.set_next_window_size_constraints(imgui.ImVec2(wide, 0), imgui.ImVec2(wide, height))
        imgui.set_next_window_bg_alpha(0.8)
        flags = imgui.WindowFlags_
        fixed = flags.no_move | flags.no_resize | flags.always_auto_resize
        was_open, self._is_open = self._is_open, imgui.begin("pointshade", None, fixed)[0]
        if self._is_open:
            self._show(viewer, height > TALL * self.scale, present)
        before, self._height = self._height, imgui.get_window_size().y
        imgui.end()
        imgui.render()
        imgui.backends.opengl3_render_draw_data(imgui.get_draw_data())
        self._input.drawn((before, was_open) != (self._height, self._is_open))

    def _show(self, viewer: Viewer, has_room: bool, present: Lap | None) -> None:
        ui = self._widgets
        show_facts(ui, viewer, present, has_room)
        self._views.show(ui, viewer)
        show_light(ui, viewer)
        show_surface(ui, viewer)
        show_points(ui, viewer, has_room)
        show_nodes(ui, viewer)
        ui.note("Ctrl and a click on a number: type it")

    def release(self) -> None:
        self._imgui.set_current_context(self._context)
        self._imgui.backends.opengl3_shutdown()
        self._imgui.destroy_context(self._context)
