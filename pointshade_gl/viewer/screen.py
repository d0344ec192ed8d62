"""Draws the window: the renderer's picture, the light's marker, text, and the panel, rows for everything that has a
number, which needs the extra `gui`; and knows when to draw it again."""

from __future__ import annotations

import itertools
import math
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray
from PIL import ImageFont

from ..gpu.context.software_driver import return_freed_memory
from ..gpu.core.steps import Steps
from ..gpu.shading.present import PresentPass
from ..renderer.renderer import Renderer
from ..scene.orbit import marker_place
from . import overlay
from .controller import BAR, CLICK_REACH, DOUBLE_CLICK, MOUSE
from .events import Effect, Event
from .keys import KEYS
from .overlay import POINTS, SeenButtons
from .panel_sections import PanelFacts, Widgets, show_sections
from .playback import Rate, TimelineBar
from .state import ShownPicture, Snapshot
from .window import Window

MARKER_RADIUS, SMALL_MARKER, ARROWS = 7.0, 4.5, 6  # pixels at scale 1; degrees between the directions of arrows
MAX_MISS = 3  # pixels at scale 1 by which a double click may miss a surface: sensors leave holes
HELP = ("mouse", MOUSE), ("keys", tuple((key.label, key.help) for key in KEYS))
Chosen = tuple[Snapshot, list[Effect]]
Readout = tuple[tuple[str, str, str] | None, tuple[str, ...]]  # what colours stand for, and the values under the mouse


class Overlay(NamedTuple):
    """What lies over the picture."""

    message: str  # "" if there is none
    is_marked: bool  # the lights' markers are shown, if there is light
    strip: TimelineBar | None  # of the timeline, or None
    help: bool
    panel: bool
    covered: int  # pixels at the right that the panel stands on: nothing else is there
    scale: float  # of everything, also of the panel
    pointer: tuple[int, int] | None = None  # pixel whose values are shown; None: of none
    buttons: SeenButtons | None = None  # of the bar, see `Buttons.seen`


class Screen:
    """Owns all OpenGL objects of a window. The renderer has a context of its own, so that a thread can have it for a
    while: `lend`. Meanwhile the window shows the last picture."""

    def __init__(self, window: Window):
        self.window = window
        self.gl, self.renderer = window.make_contexts()
        with window:
            self._present = PresentPass(self.gl)
            self._steps = Steps(self.gl, self.renderer.context.is_software)
        self._drawings: dict[str, tuple[Any, moderngl.Texture]] = {}
        self._drawn: moderngl.Texture | None = None  # by the renderer
        self._readout: Readout = None, ()
        self._last: tuple[ShownPicture, int] | None = None  # what that shows, of how many samples
        self._kept: moderngl.Texture | None = None  # a copy of that, while the renderer is lent
        self._panel: Panel | None = None

    @property
    def panel(self) -> Panel:
        """The panel, made on first use, and again for a screen of another scale. Raises ImportError without `gui`."""
        if self._panel is None or self._panel.scale != self.window.scale:
            with self.window:
                if self._panel is not None:
                    self._panel.release()
                self._panel = Panel(self.window)
        return self._panel

    def draw(
        self, picture: ShownPicture, over: Overlay, facts: PanelFacts, coarse: int = 1, shadows: int = 1
    ) -> Chosen:  # fmt: skip
        """Redraw the whole window, and return what the user chose in the panel. While the renderer is lent, the picture
        is the last one, with marker, text and panel as they are now. coarse, shadows: as of Redrawing."""
        self._steps.timed = over.panel
        if self._kept is None:
            samples, most = facts.samples
            self.renderer.steps.timed = over.panel
            with self.renderer.context.in_use():
                rests = coarse == shadows == 1 and (samples > 1 or most == 1)
                request = picture.coarser(coarse).request(samples, rests)
                if shadows > 1:
                    request = replace(request, coarse=shadows)
                self._drawn = self.renderer.draw(request)
                self.renderer.steps.finish()  # before the window's context reads it
            values: tuple[str, ...] = ()
            if over.pointer is not None:
                found = self.renderer.read_surface(*over.pointer, picture.camera, picture.pose)
                values = overlay.values_of(picture, *over.pointer, found)
            self._last, self._readout = (picture, samples), (overlay.legend(self.renderer.color_scale), values)
        with self.window:
            self._steps.always("present", self._show, self._kept or self._drawn, picture, over)
            chosen = picture.now, []
            if over.panel:
                self.window.framebuffer.viewport = (0, 0, picture.camera.width, picture.camera.height)
                chosen = self.panel.draw(picture, facts._replace(laps=self.renderer.steps.laps | self._steps.laps))
            if over.help:  # beside the panel, and over what is left of it while it is collapsed
                wide, high = max(picture.camera.width - over.covered, 1), picture.camera.height
                table = self._drawing("help", overlay.draw_table, HELP, over.scale, wide, high)
                self._present.lay_over(
                    self.window.framebuffer, table, (wide - table.width) // 2, (high - table.height) // 2
                )
            self.window.swap()
        return chosen

    def announce(self, picture: ShownPicture, over: Overlay) -> None:
        """Show what lies over a picture before there is one: the first may take long."""
        with self.window:
            self._show(self._drawing("nothing", np.zeros, (1, 1, 4), np.uint8), picture, over._replace(is_marked=False))
            self.window.swap()

    def lend(self) -> Renderer:
        """Return the renderer for another thread, whose `renderer.context.move_here()` takes it. See `take_back`."""
        pixels = np.zeros((1, 1, 4), np.uint8) if self._last is None else self.read(*self._last)
        with self.window:
            self._kept = self._present.upload(pixels)
        return self.renderer

    def take_back(self) -> None:
        """Have the renderer again: the other thread has left it."""
        self.renderer.context.move_here()
        if self._kept is not None:
            with self.window:
                self._kept.release()
        self._kept = None
        if self.renderer.context.is_software:
            return_freed_memory()  # malloc keeps some for each thread

    def read(self, picture: ShownPicture, samples: int) -> NDArray[np.uint8]:
        """Return the picture without marker and text: (h, w, 4) uint8."""
        return self.renderer.render(picture.request(samples))

    def find_surface(self, picture: ShownPicture, x: float, y: float) -> tuple[float, float, float] | None:
        """Return the point that the window shows at a pixel, or next to it: view axes; None if there is none."""
        camera = picture.camera
        found = self.renderer.find_surface(x, y, camera, picture.pose, round(MAX_MISS * self.window.scale))
        if found is None:
            return None
        u, v, z = found
        return (u - camera.cx) / camera.fx * z, (v - camera.cy) / abs(camera.fy) * z, z

    def release(self) -> None:
        with self.window:
            if self._panel is not None:
                self._panel.release()
            for _, texture in self._drawings.values():
                texture.release()
            self._present.release()
        self.window.release_contexts()

    def _mark(self, picture: ShownPicture) -> None:
        """A marker for each light, small ones for those that the mouse does not hold."""
        now, camera = picture.now, picture.camera
        middle = now.state.middle(now.stage, camera)
        states = [now.state, *(now.state.with_light(light, now.stage, picture.shown.pose) for light in now.lights)]
        lit = [pair for pair in enumerate(states) if pair[1].light_intensity and pair[1].is_lit]
        for k, state in reversed(lit):
            x, y = place = marker_place(state, now.stage, camera)
            radius = (SMALL_MARKER if k else MARKER_RADIUS) * self.window.scale
            around = math.degrees(math.atan2(middle[1] - y, middle[0] - x)) / ARROWS
            degrees = ARROWS * round(around) if math.dist(place, middle) > radius else None
            drawing = self._drawing(
                f"marker {k}", overlay.draw_marker, radius, state.light_color, degrees, state.is_behind
            )
            x, y = min(max(x, radius), camera.width - radius), min(max(y, radius), camera.height - radius)
            half = drawing.width / 2
            self._present.lay_over(
                self.window.framebuffer, drawing, round(x + 0.5 - half), round(camera.height - y - 0.5 - half)
            )

    def _show(self, drawn: Any, picture: ShownPicture, over: Overlay) -> None:
        self._present.draw(self.window.framebuffer, drawn, (picture.camera.width, picture.camera.height))
        if over.is_marked and (self._kept is None or self._last):  # not where nothing was drawn yet
            self._mark(picture)
        scale, wide = over.scale, max(picture.camera.width - over.covered, 1)
        above, margin, drawings = 0, round(10 * scale), []
        if over.strip:
            drawings.append(
                (0, self._drawing("strip", overlay.draw_strip, *over.strip, scale, wide, round(BAR * scale)))
            )
        if any(self._readout):
            drawings.append((0, self._drawing("readout", overlay.draw_readout, *self._readout, scale, wide)))
        if over.message:
            line = self._drawing("message", overlay.draw_message, over.message, scale, max(wide - 2 * margin, 1))
            drawings.append((margin, line))
        if over.buttons:
            bar, gap = self._drawing("buttons", overlay.draw_buttons, *over.buttons, scale), round(10 * scale)
            self._present.lay_over(self.window.framebuffer, bar, gap, picture.camera.height - gap - bar.height)
        for aside, drawing in drawings:  # from the lower edge up
            self._present.lay_over(self.window.framebuffer, drawing, aside, aside + above)
            above += drawing.height

    def _drawing(self, name: str, draw: Callable[..., NDArray[np.uint8]], *arguments: Any) -> moderngl.Texture:
        """A texture of draw(*arguments), drawn again only when the arguments change."""
        if name in self._drawings:
            before, texture = self._drawings[name]
            if before == arguments:
                return texture
            self._drawings.pop(name)[1].release()
        texture = self._present.upload(draw(*arguments))
        self._drawings[name] = arguments, texture
        return texture


MISSING = "the panel needs the extra 'gui': pip install '.[gui]' in the clone"
WIDTH, NARROWEST = 240.0, 196.0  # pixels at scale 1, of a panel that is not shrunk
MAX_WIDTH_SHARE = 1 / 3  # of the window's width, at most, unless that is too narrow
FULL_SIZE_ROOM = 800.0, 600.0  # a smaller window, in pixels at scale 1, has a shrunk panel
MIN_SCALE = 0.75  # of a panel that is shrunk
MIN_PANELS_WIDE = 1.6  # a window narrower than so many panels begins with a collapsed one
MIN_HEIGHT_FOR_ALL = 1100  # a window that is higher, in pixels at scale 1, has room for all sections
SIZES = {"frame_rounding": 2, "scrollbar_size": 10, "grab_min_size": 8, "indent_spacing": 12}  # pixels at scale 1
SIZE_PAIRS = {
    "window_padding": (6, 6), "frame_padding": (4, 1), "item_spacing": (4, 2), "item_inner_spacing": (4, 4),
    "cell_padding": (2, 1),
}  # fmt: skip
SETTLING_PICTURES = 3  # pictures after an event, or after another height, until the panel stops changing
MAX_SETTLING_PICTURES = 60  # that it waits for: it takes one key, or one click, a picture
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
        self._left, self._height, self._is_open = 0.0, 0.0, True
        self.presses, self._last_press = 0, Event("leave", time=float("-inf"))
        self.settling, self.is_deciding, self._has_popup = SETTLING_PICTURES, False, False

    def width(self, width: int, height: int) -> int:
        """Pixels that it takes from a window of that size; 0 while it is collapsed, or if nothing would be left."""
        taken = round(self._fit(width, height)[1])
        return taken if self._is_open and taken < width else 0

    def _fit(self, width: int, height: int) -> tuple[float, float]:
        """The scale of its own text, and its width, in a window of that size."""
        share = min(width / FULL_SIZE_ROOM[0], height / FULL_SIZE_ROOM[1]) / self.scale
        size = self.scale * min(max(share, MIN_SCALE), 1.0)
        return size, min(WIDTH * size, max(MAX_WIDTH_SHARE * width, NARROWEST * size), width)

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
        self.settling = max(self.settling, SETTLING_PICTURES)
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

    def draw(self, picture: ShownPicture, facts: PanelFacts) -> Chosen:
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
        imgui.set_next_window_collapsed(width < MIN_PANELS_WIDE * wide, imgui.Cond_.once)
        flags = imgui.WindowFlags_
        fixed = flags.no_move | flags.no_resize | flags.always_auto_resize
        was_open, self._is_open = self._is_open, imgui.begin("pointshade", None, fixed)[0]
        chosen = picture.now, []
        if self._is_open:
            chosen = show_sections(self._widgets, picture, facts, height > MIN_HEIGHT_FOR_ALL * self.scale)
        before, self._height = self._height, imgui.get_window_size().y
        imgui.end()
        imgui.render()
        imgui.backends.opengl3_render_draw_data(imgui.get_draw_data())
        self._settle((before, was_open) != (self._height, self._is_open))
        return chosen

    def _resize(self, size: float) -> None:
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
        self.settling = min(max(self.settling, SETTLING_PICTURES) + pictures, MAX_SETTLING_PICTURES)

    def _settle(self, has_changed: bool) -> None:
        """After each picture. While something is open, keys move through it, and Esc closes it."""
        imgui, before = self._imgui, self._has_popup
        self._has_popup = imgui.is_popup_open("", imgui.PopupFlags_.any_popup)
        has_changed = has_changed or self._has_popup != before
        flag = imgui.ConfigFlags_.nav_enable_keyboard
        flags = self._io.config_flags & ~flag
        self._io.config_flags = flags | flag if self._has_popup else flags
        self.settling = max(self.settling, SETTLING_PICTURES) if has_changed else max(self.settling - 1, 0)
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


REST = 0.2  # seconds that nothing moves before the picture is refined: moving must not wait for it
MOST_ADDED = 3  # samples a turn at most: between two turns the window answers
ADDING_SECONDS = 0.1  # seconds that they may take, if that is not less than one
QUICK, MOVING_SECONDS, SLOW, MOST_COARSE = 0.03, 0.08, 0.1, 3  # a picture that moves becomes finer, is right, coarser


class Redrawing:
    """Remembers what a window shows: a picture, and what lies over it (marker, text, panel), as values to compare.

    samples  that the picture has: one while things move, more and more while nothing does
    coarse   pixels of the window for one of the picture, both ways: above 1 while what moves is slow
    shadows  the same of shadow maps, which cost more and show less: the first that becomes coarser
    rate     of the pictures that differ
    drawn    how often the window was drawn
    """

    def __init__(self) -> None:
        self.samples, self.coarse, self.shadows, self.rate, self.drawn = 1, 1, 1, Rate(), 0
        self._shown: Any = None
        self._picture: Any = None
        self._since = self._began = self._ended = 0.0
        self._added, self._more = 1, MOST_ADDED  # samples of this turn, and of the next one
        self._wanted = self._before = 1, 1  # how coarse the next picture is that moves, and how the last was

    def forget(self) -> None:
        """Draw anew in any case: the window lost its content."""
        self._shown = None

    def patience(self, picture: Any, over: Any, now: float, most: int) -> float | None:
        """Return the seconds until the window must be drawn; None: not before something changes."""
        return self._rest(picture, now, most) if (picture, over) == self._shown else 0.0

    def begin(self, picture: Any, now: float, most: int, may_be_coarse: bool = True) -> int:
        """Return how many samples the next picture has. It is drawn anew if it has changed."""
        before, self._began, self._before = self.samples, now, (self.coarse, self.shadows)
        if picture != self._picture:
            self.rate.tick(now)
            self._picture, self._since, self.samples, before = picture, now, 1, 0
            moves = may_be_coarse and most > 1 and now - self._ended < REST
            self.coarse, self.shadows = self._wanted if moves else (1, 1)
        elif max(self._before) > 1 and (self._rest(picture, now, most) == 0 or not may_be_coarse):
            self.coarse, self.shadows, before = 1, 1, 0
        elif self._rest(picture, now, most) == 0:
            self.samples = min(self.samples + self._more, most)
        self._added = self.samples - before
        return self.samples

    def end(self, picture: Any, over: Any, now: float) -> None:
        """Remember that this was drawn, until now; None is the picture before, drawn again."""
        self._shown, self._ended = (picture, over), now
        self.drawn += 1
        if picture is None or not self._added:
            return
        seconds = max(now - self._began, 1e-6)
        self._more = max(1, min(MOST_ADDED, int(ADDING_SECONDS * self._added / seconds)))
        is_like_before = (self.coarse, self.shadows) == self._before  # others prepare more
        if self.samples == 1 and is_like_before and not QUICK < seconds < SLOW:
            coarse = min(max(round(self.coarse * (seconds / MOVING_SECONDS) ** 0.5), 1), MOST_COARSE)
            self._wanted = coarse, MOST_COARSE if seconds >= SLOW or self.coarse > 1 else 1

    def _rest(self, picture: Any, now: float, most: int) -> float | None:
        """Seconds until a finer picture is due; None: it is not."""
        if picture != self._picture or self.samples >= most:
            return None
        return max(self._since + REST - now, 0.0)
