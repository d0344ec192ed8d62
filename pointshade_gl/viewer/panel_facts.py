"""The panel's facts: how fast pictures come, how far the present one is, how long its steps took."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..gpu.core.steps import Lap
from .panel_widgets import Widgets
from .views import Views

if TYPE_CHECKING:
    from .viewer import Viewer

FRAME_STEPS = "surface", "splats", "resolve", "shadows", "surfaces", "light"
SET_STEPS = "surface", "agreement", "trust", "shadows", "surfaces", "light"


def show_facts(ui: Widgets, viewer: Viewer, present: Lap | None, opened: bool) -> None:
    """Rate and samples in two lines; below, if it is opened, the times of the steps and what draws."""
    imgui, rate = ui.imgui, viewer.rate.per_second
    imgui.text(f"{rate:.1f} pictures/s" if rate else "at rest")
    in_it, most = viewer.samples_shown
    imgui.text(f"{in_it} of {most} sample{'s' if most > 1 else ''}")
    if not ui.section("this picture", opened):
        return
    laps = viewer.renderer.steps.laps
    names = SET_STEPS if isinstance(viewer.frame, Views) else FRAME_STEPS
    for name, lap in [*((name, laps.get(name)) for name in names), ("present", present)]:
        imgui.text(f"{name:9s}" + ("" if lap is None else f"{lap.gpu_ms or lap.wall_ms:7.1f} ms"))
    choice = viewer.renderer.choice
    imgui.text_wrapped(f"{viewer.frame.points_known} points" + (f", {choice.method}" if choice else ""))
    context = viewer.renderer.context
    imgui.text_wrapped(context.renderer + (", a software renderer: slow" if context.is_software else ""))
