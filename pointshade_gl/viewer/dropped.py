"""What is dropped onto the window becomes what it shows, as if `pointshade view` had been given it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..files.access.file_name_patterns import COLOR_SUFFIXES, DEPTH_SUFFIXES, ONLY_DEPTH, VIDEO_SUFFIXES
from ..files.access.folder_listing import Item
from ..files.frames.frame_files import load_frame
from ..files.pictures.picture_heads import is_deep_grey
from ..files.sources import is_scene, load_any, open_source
from ..scene.orbit_state import State
from .command import Typed
from .opened import Opened
from .viewable_sources import check_posed

if TYPE_CHECKING:
    from .viewer import Viewer

PICTURES = {*COLOR_SUFFIXES, *DEPTH_SUFFIXES} - set(VIDEO_SUFFIXES)


def show_dropped(viewer: Viewer, paths: Sequence[str]) -> None:
    """Shows what files or folders hold. If that fails, says why and shows the same as before."""
    title = " and ".join(paths)
    viewer.say(f"opening {title}")
    viewer.redrawing.draw(viewer)
    before = viewer.opened, viewer.frame, viewer.moment
    try:
        opened = _opened(viewer, paths)
        viewer.show(opened, opened.first, opened.start)
        viewer.redrawing.draw(viewer)
    except (ValueError, TypeError, OSError, MemoryError) as error:
        unused = viewer.opened
        viewer.show(*before)
        viewer.say(f"not opened: {error}")
    else:
        unused = before[0]
        opened.playing.wake_by(viewer.window.wake)
        viewer.window.name(f"pointshade: {title}")
        viewer.messages.clear()
    if unused is not viewer.opened:
        unused.playing.close()


def _opened(viewer: Viewer, paths: Sequence[str]) -> Opened:
    source, others, typed = read_dropped(paths)
    return Opened(viewer.opened.playing.instead(source, others), typed, viewer.state.reset_view(State()))


def read_dropped(paths: Sequence[str]) -> tuple[Any, list[Any], Typed]:
    """The frame, the sequence or the scene, more sources of frames of the same thing, and how to type them.

    paths  a folder, a depth file or a scene; or the files of one frame: depth, colour, camera; or several folders

    Raises ValueError, TypeError or OSError for anything else.
    """
    if not paths:
        raise ValueError("the name of what was dropped cannot be read")
    if len(paths) == 1:
        return (load_any if is_scene(paths[0]) else open_source)(paths[0]), [], Typed(tuple(paths))
    if all(Path(path).is_dir() for path in paths):
        first, *others = map(open_source, paths)
        check_posed((first, *others))
        return first, others, Typed(tuple(paths))
    files = _files_of([Path(path) for path in paths])
    folder = files["depth"].parent
    words = [word for name, path in files.items() for word in (f"--{name}", str(path))]
    return load_frame(folder, **files), [], Typed((str(folder),), tuple(words))


def _files_of(paths: list[Path]) -> dict[str, Any]:
    """The files of a frame, by the names of options: one depth, one colour picture at most, one camera at most."""
    items = [Item(path, path.name.lower()) for path in paths]
    pictures = [item for item in items if item.suffix in PICTURES and item.path.is_file()]
    depths = [item for item in pictures if item.role == "depth"] or [item for item in pictures if _is_depth(item)]
    colors = [item for item in pictures if item not in depths]
    cameras = [item for item in items if item not in pictures]
    if len(depths) != 1 or len(colors) > 1 or len(cameras) > 1:
        names = ", ".join(path.name for path in paths[:4]) + (", ..." if len(paths) > 4 else "")
        raise ValueError(f"{names}: drop the depth and the colour picture of one frame, a folder, or a scene")
    found = {"depth": depths, "color": colors, "intrinsics": cameras}
    return {name: some[0].path for name, some in found.items() if some}


def _is_depth(item: Item) -> bool:
    return item.suffix in ONLY_DEPTH or is_deep_grey(item.path)
