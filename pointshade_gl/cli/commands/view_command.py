"""`pointshade view`: the window, opened as it was typed."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from typing import Any

from ...files.access.content import check_not_read
from ...files.input_kinds import Kind
from ...notes.notes import print_note
from ...notes.words import option
from ...renderer.requests import load_all_sides
from ...scene.appearance import Appearance
from ...scene.settings import OutputSettings
from ...scene.viewpoint import View
from .. import inputs, options
from ..command_lines import Typed, render_line
from ..inputs import Inputs
from ..option_groups import AppearanceGroup, check_folders, rates_from, size_from, views_from
from ..output import announce, spinner


@options.spread
def view(
    frame: options.FrameOptions, look: AppearanceGroup, environment: options.EnvironmentOptions,
    place: options.PlaceOptions, window: options.WindowOptions, others: options.MoreOptions,
    output: options.NoOutput = None, overwrite: options.Overwrite = False, quiet: options.Quiet = False
) -> None:  # fmt: skip
    """Open a window where the light follows the mouse; H lists the keys. It shows frames, scenes and point clouds.

    A folder with a sequence is played; with --views, or when M is pressed, frames of it are merged into one object.
    A line of `pointshade render` that the key P printed opens the same view, with view in the place of render.
    """
    from ...scene.orbit import State
    from ...viewer import Viewer
    from ...viewer.screen import MISSING

    if window.panel and find_spec("imgui_bundle") is None:
        raise ValueError(MISSING)
    seen = window.values_of(OutputSettings)
    is_put = any(light.position or light.direction for light in look.lights()[:1])  # it stays where it was put
    state = State(light_mode=not is_put, look=look.look(), finish=OutputSettings(**environment.chosen(), **seen))
    is_alone = inputs.is_front(frame, others)
    frame, others = inputs.with_all_sides(frame, others, turns=False)
    size, more = size_from(window.window_size, "window_size"), others.more or []
    count = None if others.views is None else views_from(others.views) or "all"
    check_folders(more)
    with spinner(f"reading {frame.title}"):  # there is no window yet
        is_scene, sources = _read(Inputs(frame, options.MoreOptions(more)), state.look, others.views is not None)
    if window.record is not None:
        check_not_read(window.record)
    if output is not None:
        print_note(f"a window writes no file: -o {output} is left out, the key P saves a picture")
    casts = any(light.shadow for light in look.lights())
    lights = look.lights(shadow=is_scene or not casts)  # all cast shadows when the key S is pressed
    viewer = Viewer(
        sources[0],
        title=f"pointshade: {' and '.join([frame.title, *more])}",
        window_size=size,
        state=state,
        lights=lights,
        others=sources[1:],
        fps=rates_from(window.fps, len(sources)),
        place=View(**place.place()),
        views=count,
        record=window.record,
        panel=window.panel,
        command_line=partial(render_line, Typed.of(frame, more)),
    )
    if is_alone:
        viewer.document.playback.whole = load_all_sides
    viewer.samples = seen.get("samples", viewer.samples)
    viewer.document.metered = seen.get("exposure", "sensor"), seen.get("fill")
    announce(viewer.renderer)
    if not is_scene:
        viewer.state = replace(viewer.state, shadows=casts)  # until the key S switches them on
    viewer.run()


def _read(named: Inputs, look: Appearance, merges: bool) -> tuple[bool, list[Any]]:
    """Whether a scene is shown, and what INPUT names, and MORE. merges: frames of a sequence, by the window."""
    frame, more = named.frame, named.others.more
    if more and merges:
        raise ValueError(f"several INPUTs are merged as they play: leave out {option('views')}")
    if merges:
        inputs.check_frame(frame)
    plain = AppearanceGroup().look()
    look = replace(look, shading=plain.shading)  # that of scenes is the window's
    is_scene = named.kind is not Kind.FRAMES
    if more and not is_scene and not frame.frame:
        paths = [frame.title, *more]
        inputs.check_different(paths, [0] * len(paths))
        return False, inputs.load_several(frame, paths)
    loaded = named.load(look, plain, sequence=True)
    if not (is_scene or more):
        inputs.check_stream(look, loaded.plays)
        inputs.check_align(look.align, loaded.plays)
    return is_scene, [*loaded.frames] or [loaded.source]
