"""Mouse, keys and clipboard for the panel."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .events import Event

if TYPE_CHECKING:
    from .window import Window

SETTLE = 3  # pictures after an event, or after another height, until the panel stops changing
MOST = 60  # that it waits for: it takes one key, or one click, a picture
BUTTONS = {"left": 0, "right": 1, "middle": 2}  # as imgui counts them
NAMED = {
    "LEFT": "left_arrow", "RIGHT": "right_arrow", "UP": "up_arrow", "DOWN": "down_arrow", "HOME": "home", "END": "end",
    "BACKSPACE": "backspace", "DELETE": "delete", "ENTER": "enter", "TAB": "tab", "ESCAPE": "escape", "SPACE": "space",
}  # fmt: skip
LETTERS = "ACVXYZ"  # that mean something with Ctrl, where text is typed


class PanelInput:
    """Passes events on to Dear ImGui, whose context is current.

    settling   how many more pictures it needs until it has answered them all
    """

    def __init__(self, imgui: Any, window: Window):
        self._imgui, self._io = imgui, imgui.get_io()
        self._io.config_mac_osx_behaviors = False  # an Event's ctrl is Command already
        self._io.config_input_text_cursor_blink = False  # the window sleeps while nothing changes
        clipboard = imgui.get_platform_io()
        clipboard.platform_set_clipboard_text_fn = lambda _, text: window.copy(text)
        clipboard.platform_get_clipboard_text_fn = lambda _: window.pasted()
        self.settling = SETTLE
        self.is_deciding = (
            False  # it was clicked on, and is not drawn yet with what the click opens, which may take keys
        )
        self._has_popup = False

    @property
    def takes_keys(self) -> bool:
        """A field is written into, or a list or a colour is open."""
        return self._io.want_text_input or self._has_popup

    def handle(self, event: Event, is_over: bool) -> bool:
        """Passes an event on. Returns whether it was meant for the panel.

        is_over  the pointer is over the panel: imgui itself knows only after the next picture
        """
        io = self._io
        if event.kind in ("key", "text"):
            return self._handle_key(event)
        self.settling = max(self.settling, SETTLE)
        if event.kind == "leave":
            io.add_mouse_pos_event(-1e9, -1e9)
        if event.kind in ("move", "press", "release", "wheel"):
            io.add_mouse_pos_event(event.x, event.y)
        if event.kind in ("press", "release"):
            self._press_ctrl(event.ctrl, lambda: io.add_mouse_button_event(BUTTONS[event.key], event.kind == "press"))
        if event.kind == "wheel":
            io.add_mouse_wheel_event(0.0, event.steps)
        if event.kind == "press":
            self.is_deciding = is_over or io.want_capture_mouse
        return (is_over or io.want_capture_mouse) and event.kind in ("move", "press", "wheel")

    def _handle_key(self, event: Event) -> bool:
        if not self.takes_keys:
            return False
        if event.kind == "text":
            self._io.add_input_characters_utf8(event.key)
        elif (key := self._key(event)) is not None:
            self._press_ctrl(event.ctrl, lambda: self._press(key), event.shift)
        self._wait_for(2)
        return True

    def _key(self, event: Event) -> Any:
        if event.key in NAMED:
            return getattr(self._imgui.Key, NAMED[event.key])
        return getattr(self._imgui.Key, event.key.lower()) if event.ctrl and event.key in LETTERS else None

    def _press(self, key: Any) -> None:
        self._io.add_key_event(key, True)
        self._io.add_key_event(key, False)

    def _press_ctrl(self, ctrl: bool, do: Any, shift: bool = False) -> None:
        """Holds modifiers while something else happens."""
        held = [(self._imgui.Key.mod_ctrl, ctrl), (self._imgui.Key.mod_shift, shift)]
        for key, is_held in held:
            self._io.add_key_event(key, is_held)
        do()
        for key, is_held in held:
            if is_held:
                self._io.add_key_event(key, False)
        self._wait_for(2 if ctrl or shift else 0)

    def _wait_for(self, pictures: int) -> None:
        self.settling = min(max(self.settling, SETTLE) + pictures, MOST)

    def drawn(self, has_changed: bool) -> None:
        """To be called after each picture. While something is open, keys move through it, and Esc closes it."""
        imgui = self._imgui
        self._has_popup = imgui.is_popup_open("", imgui.PopupFlags_.any_popup)
        flag = imgui.ConfigFlags_.nav_enable_keyboard
        flags = self._io.config_flags & ~flag
        self._io.config_flags = flags | flag if self._has_popup else flags
        self.settling = max(self.settling, SETTLE) if has_changed else max(self.settling - 1, 0)
        self.is_deciding = self.is_deciding and self.settling > 0
