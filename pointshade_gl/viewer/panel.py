"""The panel beside the picture: rows for everything that has a number. Needs the extra `gui`."""

from __future__ import annotations

import itertools
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from PIL import ImageFont

from .controller import CLICK_REACH, DOUBLE_CLICK
from .events import Effect, Event
from .overlay import POINTS
from .panel_sections import PanelFacts, PanelSections, Widgets
from .picture import ShownPicture
from .state import Snapshot
from .window import Window

MISSING = "the panel needs the extra 'gui': pip install 'pointshade-gl[gui]'"
WIDTH, NARROWEST = 240.0, 196.0  # pixels at scale 1, of a panel that is not shrunk
SHARE = 1 / 3  # of the window's width, at most, unless that is too narrow
ROOM = 800.0, 600.0  # a smaller window, in pixels at scale 1, has a shrunk panel
SMALLEST = 0.75  # to this share at most
ROOMY = 1.6  # a window narrower than so many panels begins with a collapsed one
ROOM_FOR_ALL = 1100  # a window that is higher, in pixels at scale 1, has room for all sections
SIZES = {"frame_rounding": 2, "scrollbar_size": 10, "grab_min_size": 8, "indent_spacing": 12}  # pixels at scale 1
SIZE_PAIRS = {
    "window_padding": (6, 6), "frame_padding": (4, 1), "item_spacing": (4, 2), "item_inner_spacing": (4, 4),
    "cell_padding": (2, 1),
}  # fmt: skip
SETTLE = 3  # pictures after an event, or after another height, until the panel stops changing
MOST_SETTLING = 60  # that it waits for: it takes one key, or one click, a picture
BUTTONS = {"left": 0, "right": 1, "middle": 2}  # as imgui counts them
NAMED = {
    "LEFT": "left_arrow", "RIGHT": "right_arrow", "UP": "up_arrow", "DOWN": "down_arrow", "HOME": "home", "END": "end",
    "BACKSPACE": "backspace", "DELETE": "delete", "ENTER": "enter", "TAB": "tab", "ESCAPE": "escape", "SPACE": "space",
}  # fmt: skip
LETTERS = "ACVXYZ"  # that mean something with Ctrl, where text is typed


class Panel:
    """Draws beside the picture with Dear ImGui, in the current context. Raises ImportError without the extra.

    scale        of the window's text; in small windows the panel's own is smaller
    presses      how often a button was pressed on it; two clicks that are one double click count as one
    settling     how many more pictures it needs until it has answered all events and stops changing
    is_deciding  keys must wait: it was clicked on, and what the click opens, which may take them, is not drawn yet
    """

    def __init__(self, window: Window):
        from imgui_bundle import imgui

        self.scale = window.scale
        self._imgui: Any = imgui
        self._context = imgui.create_context()
        imgui.set_current_context(self._context)  # another window may have its own
        self._io = imgui.get_io()
        self._io.set_ini_filename("")  # otherwise it writes a file into the working directory
        self._io.mouse_double_click_time = 0.0  # its clock is not that of the events
        _set_style(imgui)
        self._size = 0.0
        imgui.backends.opengl3_init("#version 330")
        self._io.config_mac_osx_behaviors = False  # an Event's ctrl is Command already
        self._io.config_input_text_cursor_blink = False  # the window sleeps while nothing changes
        clipboard = imgui.get_platform_io()
        clipboard.platform_set_clipboard_text_fn = lambda _, text: window.copy(text)
        clipboard.platform_get_clipboard_text_fn = lambda _: window.pasted()
        self._widgets = Widgets(imgui)
        self._sections = PanelSections(self._widgets)
        self._left, self._height, self._is_open = 0.0, 0.0, True
        self.presses, self._last_press = 0, Event("leave", time=float("-inf"))
        self.settling, self.is_deciding, self._has_popup = SETTLE, False, False

    def width(self, width: int, height: int) -> int:
        """Pixels that it takes from a window of that size; 0 while it is collapsed, or if nothing would be left."""
        taken = round(self._fit(width, height)[1])
        return taken if self._is_open and taken < width else 0

    def _fit(self, width: int, height: int) -> tuple[float, float]:
        """The scale of its own text, and its width, in a window of that size."""
        share = min(width / ROOM[0], height / ROOM[1]) / self.scale
        size = self.scale * min(max(share, SMALLEST), 1.0)
        return size, min(WIDTH * size, max(SHARE * width, NARROWEST * size), width)

    @property
    def takes_keys(self) -> bool:
        """A field is written into, or a list or a colour is open."""
        return self._io.want_text_input or self._has_popup

    def handle(self, event: Event) -> bool:
        """Passes an event to the panel. Returns whether it was meant for the panel."""
        self._imgui.set_current_context(self._context)
        if event.kind in ("key", "text"):
            return self._handle_key(event)
        io = self._io
        is_over = event.x >= self._left and event.y < self._height  # imgui itself knows only after the next picture
        self.settling = max(self.settling, SETTLE)
        if event.kind == "leave":
            io.add_mouse_pos_event(-1e9, -1e9)
        if event.kind in ("move", "press", "release", "wheel"):
            io.add_mouse_pos_event(event.x, event.y)
        if event.kind in ("press", "release"):
            is_double = event.kind == "press" and self._is_double(event)
            held = event.ctrl or is_double, False, is_double
            self._press_with(held, lambda: io.add_mouse_button_event(BUTTONS[event.key], event.kind == "press"))
        if event.kind == "wheel":
            io.add_mouse_wheel_event(0.0, event.steps)
        is_meant = is_over or io.want_capture_mouse
        if event.kind == "press":
            self.is_deciding = is_meant
        return is_meant and event.kind in ("move", "press", "wheel")

    def draw(self, picture: ShownPicture, facts: PanelFacts) -> tuple[Snapshot, list[Effect]]:
        """Draw the panel over a picture, and return what the user chose: view and lights, and what is to be done."""
        imgui, width, height = self._imgui, picture.camera.width, picture.camera.height
        imgui.set_current_context(self._context)
        self._io.display_size = imgui.ImVec2(width, height)
        imgui.backends.opengl3_new_frame()
        size, wide = self._fit(width, height)
        self._resize(size)
        imgui.new_frame()
        imgui.begin_disabled()  # or what a list or a colour opens is invisible: imgui 1.93 takes its opacity from here
        imgui.end_disabled()
        self._left = width - wide
        imgui.set_next_window_pos(imgui.ImVec2(width, 0), imgui.Cond_.always, imgui.ImVec2(1, 0))
        imgui.set_next_window_size_constraints(imgui.ImVec2(wide, 0), imgui.ImVec2(wide, height))
        imgui.set_next_window_bg_alpha(0.8)
        imgui.set_next_window_collapsed(width < ROOMY * wide, imgui.Cond_.once)
        flags = imgui.WindowFlags_
        fixed = flags.no_move | flags.no_resize | flags.always_auto_resize
        was_open, self._is_open = self._is_open, imgui.begin("pointshade", None, fixed)[0]
        chosen = picture.now, []
        if self._is_open:
            chosen = self._sections.show(picture, facts, height > ROOM_FOR_ALL * self.scale)
        before, self._height = self._height, imgui.get_window_size().y
        imgui.end()
        imgui.render()
        imgui.backends.opengl3_render_draw_data(imgui.get_draw_data())
        self._settle((before, was_open) != (self._height, self._is_open))
        return chosen

    def _resize(self, size: float) -> None:
        """Text and everything else in this scale."""
        if size == self._size:
            return
        self._size, self._widgets.em = size, POINTS * size
        style = self._imgui.get_style()
        style.font_scale_main = size
        for name, pixels in SIZES.items():
            setattr(style, name, pixels * size)
        for name, (x, y) in SIZE_PAIRS.items():
            setattr(style, name, self._imgui.ImVec2(x * size, y * size))

    def release(self) -> None:
        self._imgui.set_current_context(self._context)
        self._imgui.backends.opengl3_shutdown()
        self._imgui.destroy_context(self._context)

    def _handle_key(self, event: Event) -> bool:
        if not self.takes_keys:
            return False
        keys, io = self._imgui.Key, self._io
        if event.kind == "text":
            io.add_input_characters_utf8(event.key)
        elif event.key in NAMED or (event.ctrl and event.key in LETTERS):
            key = getattr(keys, NAMED.get(event.key, event.key.lower()))

            def press() -> None:
                io.add_key_event(key, True)
                io.add_key_event(key, False)

            self._press_with((event.ctrl, event.shift, False), press)
        self._wait_for(2)
        return True

    def _is_double(self, event: Event) -> bool:
        """Whether a press is the second one of a double click: it counts as Ctrl and Alt and a click."""
        before, self._last_press = self._last_press, event
        near = max(abs(event.x - before.x), abs(event.y - before.y)) < CLICK_REACH * self.scale
        is_double = event.key == before.key == "left" and near and 0 <= event.time - before.time < DOUBLE_CLICK
        if is_double:
            self._last_press = replace(event, time=float("-inf"))  # a third one begins anew
        else:
            self.presses += 1
        return is_double

    def _press_with(self, modifiers: tuple[bool, bool, bool], do: Any) -> None:
        """Holds Ctrl, Shift and Alt while something else happens."""
        keys = self._imgui.Key
        three = keys.mod_ctrl, keys.mod_shift, keys.mod_alt
        for key, is_held in zip(three, modifiers, strict=True):
            self._io.add_key_event(key, bool(is_held))
        do()
        for key in itertools.compress(three, modifiers):
            self._io.add_key_event(key, False)
        self._wait_for(2 if any(modifiers) else 0)

    def _wait_for(self, pictures: int) -> None:
        self.settling = min(max(self.settling, SETTLE) + pictures, MOST_SETTLING)

    def _settle(self, has_changed: bool) -> None:
        """After each picture. While something is open, keys move through it, and Esc closes it."""
        imgui, before = self._imgui, self._has_popup
        self._has_popup = imgui.is_popup_open("", imgui.PopupFlags_.any_popup)
        has_changed = has_changed or self._has_popup != before
        flag = imgui.ConfigFlags_.nav_enable_keyboard
        flags = self._io.config_flags & ~flag
        self._io.config_flags = flags | flag if self._has_popup else flags
        self.settling = max(self.settling, SETTLE) if has_changed else max(self.settling - 1, 0)
        self.is_deciding = self.is_deciding and self.settling > 0


def _set_style(imgui: Any) -> None:
    imgui.style_colors_dark()
    style = imgui.get_style()
    style.window_border_size = 0
    at_once = imgui.HoveredFlags_.allow_when_disabled  # no pictures come to wait for
    style.hover_flags_for_tooltip_mouse = at_once
    style.set_color_(imgui.Col_.slider_grab, imgui.ImVec4(0.26, 0.59, 0.98, 0.5))  # numbers are read through it
    font: Any = ImageFont.load_default(POINTS)  # that of the messages
    with tempfile.TemporaryDirectory() as folder:  # imgui reads it at once
        path = Path(folder, "font.ttf")
        path.write_bytes(font.font_bytes)
        imgui.get_io().fonts.add_font_from_file_ttf(str(path), float(sum(font.getmetrics())))
