"""What the command line reads: the frame, the sequence or the scene that the options name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from .cli_options import FrameOptions
from .wording import option

if TYPE_CHECKING:
    from .look import Look
    from .scene import Scene


def load(frame: FrameOptions, sequence: bool = False, scene: bool = False) -> Any:
    """The frame, the whole sequence or the scene that the options name; the built-in vase if they name nothing."""
    from .files.builtin import FRAMES
    from .files.frames import load_frame
    from .sources import is_scene, load_any, open_source

    source, options = frame.input, frame.load_options
    if not scene:
        check_frame(frame)
    frame.check_exist()
    if source is None and frame.color is None and frame.depth is None:
        source = FRAMES[0]
    if is_scene(source):
        return load_any(source, **options)
    return (open_source if sequence else load_frame)(source, **options)


def load_views(frame: FrameOptions, look: Look, views: str) -> tuple[Scene, list[str]]:
    """Frames of a sequence as one object, and their numbers; who looks is the first one's camera."""
    from .cli_parse import views_from
    from .scene import Node, PointObject, Scene
    from .sources import views_of

    count = views_from(views)
    check_frame(frame)
    found = views_of(load(frame, sequence=True), count)
    first, *others = found.values()
    node = Node(PointObject(first, look=look, others=others))
    return Scene((node,), first.picture_camera, first.pose), list(map(str, found))


def load_others(frame: FrameOptions, first: Any, inputs: Sequence[str]) -> list[Any]:
    """More sources of frames of what the first shows, read with its options. Raises ValueError without poses."""
    from .viewer.sources import check_posed

    if inputs and (frame.depth or frame.color):
        raise ValueError(f"pass {option('depth')} or {option('color')} with one INPUT")
    found = [load(replace(frame, input=path), sequence=True) for path in inputs]
    check_posed((first, *found) if inputs else ())
    return found


def check_frame(frame: FrameOptions) -> None:
    """Raises ValueError for a scene."""
    from .sources import is_scene

    if is_scene(frame.input):
        raise ValueError(f"{frame.input} is a scene, expected a frame: pass it to `pointshade render` or `view`")


def check_stream(look: Look, is_stream: bool) -> None:
    """Raises ValueError for a filter over time where only one frame is drawn."""
    if look.temporal and not is_stream:
        raise ValueError(
            f"{option('temporal', True)} filters the frames of a sequence over time, and here is a single one: "
            "leave it out, or pass a sequence, and write its frames to a film or to numbered files, such as %04d.png"
        )


def check_look(look: Look) -> None:
    """Raises ValueError for options about the look of objects: those of a scene have their own."""
    from .look import Look

    given, plain = ({**one.options, **vars(one.material)} for one in (look, Look()))
    changed = [name for name in given if name != "material" and given[name] != plain[name]]
    if changed:
        options = ", ".join(map(option, changed))
        raise ValueError(f"the objects of a scene have a look of their own: leave out {options}")
