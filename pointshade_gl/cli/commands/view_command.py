"""`pointshade view`: the window, opened as it was typed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from ...files.access.content import check_not_read
from ...files.access.known_names import FRAMES
from ...notes.notes import print_note
from ...notes.words import option
from ...scene.appearance import Look
from ...scene.frame import Frame
from ...scene.graph import Scene
from ...scene.settings import Finish
from ...scene.viewpoint import View
from ..command_lines import words_of
from ..inputs import (
    are_clouds,
    as_scene,
    check_align,
    check_different,
    check_stream,
    load,
    load_clouds,
    load_several,
    load_together,
)
from ..option_groups import LookGroup, check_folders, rates_from, size_from, views_from
from ..options import FrameOptions, MoreInputs, NoOutput, Overwrite, PlaceOptions, Quiet, Views, WindowOptions, spread
from ..output import announce
from ..written import EnvironmentOptions

if TYPE_CHECKING:
    from ..command_lines import Typed


@spread
def view(
    frame: FrameOptions,
    look: LookGroup,
    around: EnvironmentOptions,
    place: PlaceOptions,
    window: WindowOptions,
    output: NoOutput = None,
    more: MoreInputs = None,
    views: Views = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Open a window where the light follows the mouse; H lists the keys. It shows frames, scenes and point clouds.

    A folder with a sequence is played; with --views, or when M is pressed, frames of it are merged into one object.
    A line of `pointshade render` that the key P printed opens the same view, with view in the place of render.
    """
    from ...scene.orbit import State
    from ...viewer import Viewer
    from ...viewer.panel import MISSING
    from ..command_lines import render_line

    if window.panel and find_spec("imgui_bundle") is None:
        raise ValueError(MISSING)
    seen = window.values_of(Finish)
    is_put = any(light.position or light.direction for light in look.lights()[:1])  # it stays where it was put
    state = State(light_mode=not is_put, look=look.look(), finish=Finish(**around.chosen(), **seen))
    size, inputs = size_from(window.window_size, "window_size"), more or []
    count = None if views is None else views_from(views) or "all"
    check_folders(inputs)
    source, others = _read(frame, state.look, inputs, views)
    if window.record is not None:
        check_not_read(window.record)
    if output is not None:
        print_note(f"a window writes no file: -o {output} is left out, the key P saves a picture")
    asked = any(light.shadow for light in look.lights())
    lights = look.lights(shadow=isinstance(source, Scene) or not asked)  # all cast them when the key S is pressed
    rates = rates_from(window.fps, 1 + len(others))
    viewer = Viewer(
        source,
        title=f"pointshade: {' and '.join([str(frame.input or frame.depth or 'vase'), *inputs])}",
        window_size=size,
        state=state,
        lights=lights,
        others=others,
        fps=rates,
        place=View(**place.place()),
        views=count,
        record=window.record,
        panel=window.panel,
        command_line=partial(render_line, _typed(frame, inputs)),
    )
    viewer.samples = seen.get("samples", viewer.samples)
    viewer.document.exposure = seen.get("exposure", viewer.document.exposure)
    announce(viewer.renderer)
    if not isinstance(source, Scene):
        viewer.state = replace(viewer.state, shadows=asked)  # until the key S switches them on
    viewer.run()


def _read(frame: FrameOptions, look: Look, inputs: Sequence[str], views: str | None) -> tuple[Any, list[Any]]:
    """What INPUT names, and MORE."""
    if inputs and views:
        raise ValueError(f"several INPUTs are merged as they play: leave out {option('views')}")
    plain = LookGroup().look()
    look = replace(look, shading=plain.shading)  # that of scenes is the window's
    if are_clouds(frame, inputs) and views is None:
        return load_clouds(frame, look, plain, inputs), []
    if inputs:
        source, *others = load_together(frame, look, inputs).frames if frame.frame else _several(frame, inputs)
        return source, others
    source = as_scene(load(frame, sequence=True, scene=not views), look, plain)
    check_stream(look, not isinstance(source, Frame))
    check_align(look.align, not isinstance(source, Frame))
    return source, []


def _several(frame: FrameOptions, inputs: Sequence[str]) -> list[Any]:
    check_different([str(frame.input), *inputs], [0] * (1 + len(inputs)))
    return load_several(frame, inputs)


def _typed(frame: FrameOptions, inputs: Sequence[str]) -> Typed:
    """What was typed about the input, for the command line that the window writes."""
    from ..command_lines import Typed

    words = words_of(frame if frame.input or frame.depth or frame.color else replace(frame, input=FRAMES[0]))
    named = 0 if words[0].startswith("--") else 1
    return Typed((*words[:named], *inputs), tuple(words[named:]))
