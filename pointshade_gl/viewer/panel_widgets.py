"""The panel's widgets: each is a row of a narrow column, with its name inside; rare ones explain themselves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

MARK = "(?)"
LINE = 22.0  # of an explanation, in letters' heights


class Widgets:
    """Draws them by Dear ImGui, and gives what the user made of their values."""

    def __init__(self, imgui: Any):
        self.imgui = imgui

    def slide(
        self, name: str, value: float, low: float, high: float, why: str = "", logarithmic: bool = False
    ) -> float:
        """A number between two others. Ctrl and a click on it let it be typed."""
        imgui = self.imgui
        kind = imgui.SliderFlags_.logarithmic if logarithmic else imgui.SliderFlags_.none
        self._widen(why)
        changed, new = imgui.slider_float(f"##{name}", value, low, high, f"{name} %.2f", kind)
        self._explain(why)
        new = float(f"{new:.6g}")  # as it was typed: imgui's numbers are float32
        return min(max(new, low), high) if changed else value  # untouched it stays, even beyond the slider's ends

    def choose(self, name: str, value: str, known: Sequence[str], why: str = "") -> str:
        """One of several texts."""
        imgui, chosen = self.imgui, value
        self._widen(why)
        if imgui.begin_combo(f"##{name}", f"{name}: {value}"):
            for one in known if value in known else (value, *known):
                if imgui.selectable(one, one == value)[0]:
                    chosen = one
                if one == value:
                    imgui.set_item_default_focus()
            imgui.end_combo()
        self._explain(why)
        return chosen

    def tick(self, name: str, value: bool, why: str = "") -> bool:
        """A switch."""
        new = self.imgui.checkbox(name, value)[1]
        self._explain(why)
        return new

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

    def _widen(self, why: str) -> None:
        """The next widget takes the whole row, but for the mark of its explanation."""
        mark = self.imgui.calc_text_size(MARK).x + self.imgui.get_style().item_spacing.x if why else 1.0
        self.imgui.set_next_item_width(-mark)

    def _explain(self, why: str) -> None:
        """Adds a mark that shows an explanation when the mouse is over it."""
        imgui = self.imgui
        if not why:
            return
        imgui.same_line()
        imgui.text_disabled(MARK)
        if imgui.begin_item_tooltip():
            imgui.push_text_wrap_pos(imgui.get_font_size() * LINE)
            imgui.text_unformatted(why)
            imgui.pop_text_wrap_pos()
            imgui.end_tooltip()
