"""The panel's widgets: each is a row of a narrow column, its name at the left, which explains and resets it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

LINE = 22.0  # of an explanation, in letters' heights
NAMES = 6.4  # width of the names' column, in sizes of the messages' font


class Widgets:
    """Draws them by Dear ImGui, and gives what the user made of their values.

    em  size of the font as the messages count it, pixels
    """

    def __init__(self, imgui: Any):
        self.imgui, self.em = imgui, 1.0
        self._held = "", 0.0  # the number that was pressed last, and what it was before

    def slide(
        self,
        name: str,
        value: float,
        default: float,
        low: float,
        high: float,
        why: str = "",
        logarithmic: bool = False,
    ) -> float:
        """A number between two others. A double click, or Ctrl and a click, lets it be typed."""
        imgui = self.imgui
        if self._is_reset(name, why):
            return default
        value = self._before_first_click(name, value)
        kind = imgui.SliderFlags_.logarithmic if logarithmic else imgui.SliderFlags_.none
        changed, new = imgui.slider_float(f"##{name}", value, low, high, "%.2f", kind)
        return self._taken(name, value, changed, min(max(_plain(new), low), high))

    def drag(self, name: str, value: float, step: float, farthest: float, why: str = "") -> float:
        """A number without a default, that changes by a step for each pixel; typed as that of a slider."""
        imgui = self.imgui
        self._name(name, why)
        value = self._before_first_click(name, value)
        changed, new = imgui.drag_float(f"##{name}", value, step, -farthest, farthest, "%.3f")
        return self._taken(name, value, changed, min(max(_plain(new), -farthest), farthest))

    def choose(self, name: str, value: str, default: str, known: Sequence[str], why: str = "") -> str:
        """One of several texts."""
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

    def color(
        self, name: str, value: tuple[float, float, float], default: tuple[float, float, float]
    ) -> tuple[float, float, float]:
        """A square in a colour; a click on it opens more of them. Untouched it stays exactly what it was."""
        imgui = self.imgui
        if self._is_reset(name):
            return default
        changed, picked = imgui.color_edit3(f"##{name}", list(value), imgui.ColorEditFlags_.no_inputs)
        return tuple(picked) if changed else value

    def tick(self, name: str, value: bool, why: str = "") -> bool:
        """A switch."""
        new = self.imgui.checkbox(name, value)[1]
        self.explain(why)
        return new

    def row(self, name: str, text: str) -> None:
        """A name, and beside it a text that only tells."""
        self._name(name)
        self.imgui.text_unformatted(text)

    def section(self, name: str, opened: bool = True) -> bool:
        """A heading that opens and closes what follows: whether it is open."""
        flags = self.imgui.TreeNodeFlags_
        return self.imgui.collapsing_header(name, flags.default_open if opened else flags.none)

    def note(self, text: str) -> None:
        """A grey sentence."""
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

    def _is_reset(self, name: str, why: str = "") -> bool:
        """Shows a name; whether a double click on it asks for the default."""
        imgui = self.imgui
        is_asked = self._name(name, why)
        return is_asked and imgui.get_io().key_alt and imgui.is_mouse_clicked(0)

    def _name(self, name: str, why: str = "") -> bool:
        """Shows a name, and begins the widget that takes the rest of its row. Returns whether the mouse is over it."""
        imgui = self.imgui
        left = imgui.get_cursor_pos_x()
        imgui.align_text_to_frame_padding()
        imgui.text_unformatted(name)
        is_over = imgui.is_item_hovered()
        self.explain(why)
        imgui.same_line(left + NAMES * self.em)
        imgui.set_next_item_width(-1.0)
        return is_over

    def _before_first_click(self, name: str, value: float) -> float:
        """The first click of two has moved a slider: the second takes that back."""
        is_second = self.imgui.get_io().key_alt and self._held[0] == name
        return self._held[1] if is_second else value

    def _taken(self, name: str, value: float, changed: bool, new: float) -> float:
        """Untouched it stays, even beyond the ends."""
        if self.imgui.is_item_activated():
            self._held = name, value
        return new if changed else value

    def explain(self, why: str) -> None:
        """An explanation, shown while the mouse is over the last item."""
        imgui = self.imgui
        if why and imgui.begin_item_tooltip():
            imgui.push_text_wrap_pos(imgui.get_font_size() * LINE)
            imgui.text_unformatted(why)
            imgui.pop_text_wrap_pos()
            imgui.end_tooltip()


def _plain(number: float) -> float:
    """As it was typed: imgui's numbers are float32."""
    return float(f"{number:.6g}")
