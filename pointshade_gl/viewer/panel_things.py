"""The panel's lists: the views that are merged, the nodes of a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..estimation.multi_view import is_primary
from ..scene.graph import Scene
from .panel_widgets import Widgets
from .views import Views

if TYPE_CHECKING:
    from .viewer import Viewer

ROWS = 6  # of the list of views that are seen without scrolling
GOLD = 1.0, 0.85, 0.4, 1.0  # colour of the primary ones


class ViewsList:
    """A switch for each view, and how much it counts; below, if it is opened, what the views agree on."""

    def __init__(self) -> None:
        self._why: tuple[Any, list[str]] | None = None

    def show(self, ui: Widgets, viewer: Viewer) -> None:
        views = viewer.frame
        if not isinstance(views, Views):
            return
        if ui.section(f"{len(views.shown)} of {len(views.frames)} views as one###views"):
            self._rows(ui, viewer, views)
        if ui.section("why", opened=False):
            ui.imgui.text_wrapped("\n".join(self._explained(viewer, views)))

    def _rows(self, ui: Widgets, viewer: Viewer, views: Views) -> None:
        imgui, weights = ui.imgui, viewer.renderer.weights
        row = imgui.get_frame_height() + 2 * imgui.get_style().cell_padding.y
        size = imgui.ImVec2(0, min(len(views.frames), ROWS) * row)
        if not imgui.begin_table("rows", 2, imgui.TableFlags_.scroll_y, size):
            return  # no row of it would be seen
        imgui.table_setup_column("name", imgui.TableColumnFlags_.width_stretch)
        imgui.table_setup_column("weight", imgui.TableColumnFlags_.width_fixed)
        for k, (frame, name, before) in enumerate(zip(views.frames, views.names, views.on, strict=True)):
            imgui.table_next_column()
            on = imgui.checkbox(f"{views.kind} {name}##{k}".lstrip(), before)[1]
            imgui.table_next_column()
            _show_weight(imgui, weights.get(frame, 0.0) if before else None)
            if on != before:
                viewer.frame = views.switched(k, on)
        imgui.end_table()
        if not all(views.on) and imgui.button("all on"):
            viewer.frame = views.all_on()

    def _explained(self, viewer: Viewer, views: Views) -> list[str]:
        """Asked for once, not for each picture: it is read from the GPU."""
        key = views.shown, viewer.state.look
        if self._why is None or self._why[0] != key:
            self._why = key, viewer.renderer.explain(views.shown_names)
        return self._why[1]


def _show_weight(imgui: Any, weight: float | None) -> None:
    """How much a view counts; None: it is off."""
    if weight is not None and is_primary(weight):
        imgui.text_colored(GOLD, "primary")
    else:
        imgui.text_disabled("off" if weight is None else f"{100 * weight:.0f} %")


def show_nodes(ui: Widgets, viewer: Viewer) -> None:
    """A switch for each node of a scene."""
    scene = viewer.frame
    if not isinstance(scene, Scene) or not ui.section("scene"):
        return
    for path, node in scene.every_node():
        label = f"{node.name or 'node'}##{path}"  # the part after ## is hidden and tells equal names apart
        ui.imgui.indent(10.0 * len(path))
        visible = ui.imgui.checkbox(label, node.visible)[1]
        ui.imgui.unindent(10.0 * len(path))
        if visible != node.visible:
            viewer.frame = scene.with_node(path, visible=visible)
