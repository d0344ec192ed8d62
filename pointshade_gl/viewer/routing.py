"""Who gets an event: the application first, then the timeline and the panel, then mouse and keys."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from .events import Event
from .keys import press_key

if TYPE_CHECKING:
    from .viewer import Viewer


def route(viewer: Viewer, event: Event) -> None:
    """Does what an event asks for."""
    if event.kind in ("key", "text") and viewer.state.panel and viewer.screen.panel.is_deciding:
        viewer.events.append(event)  # the next turn knows whose it is
        return
    if viewer.on_event(event):
        return
    viewer.opened.history.follow(viewer.moment)
    if event.kind != "move":  # of many moves only the last counts
        viewer.seek()
    on_timeline = viewer.timeline.handle(event, *_timeline_place(viewer))
    is_taken = on_timeline or (viewer.state.panel and viewer.screen.panel.handle(event))
    _act(viewer, event, is_taken)
    over = is_taken or viewer.timeline.is_over(event, *_timeline_place(viewer))
    follows = viewer.state.light_mode and viewer.state.is_lit and not over
    viewer.window.hide_pointer(follows and not viewer.pointing.turns)


def _act(viewer: Viewer, event: Event, is_taken: bool) -> None:
    """is_taken: by timeline or panel."""
    if event.kind == "refresh":
        viewer.redrawing.forget()
    elif event.kind == "key":
        if not is_taken:
            press_key(viewer, event.key, event.ctrl, event.shift)
            viewer.opened.history.act(viewer.moment)
    elif event.kind != "text" and viewer.camera:
        is_away = is_taken or event.kind == "drop"  # with files in the hand the pointer was on its way, too
        viewer.pointing.handle(viewer, replace(event, kind="leave") if is_away else event, viewer.camera)
    if event.kind == "drop":
        viewer.open(event.paths)


def _timeline_place(viewer: Viewer) -> tuple[int | None, float, float, float]:
    """For how many frames the timeline has room, in how large a picture, at which scale."""
    width, height = viewer.window.picture_size
    return viewer.opened.playing.total(viewer.frame), width - viewer.panel_width, height, viewer.window.scale
