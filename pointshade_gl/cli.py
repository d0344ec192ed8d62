"""The command line: `pointshade render`, `normals`, `depth`, `view`, `info`, `bench`. Options: cli_options.py."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from .cli_look import LookOptions, NormalOptions
from .cli_mistakes import Commands, UsageError, check_folders, sentence_of
from .cli_options import (
    Axes,
    BenchOptions,
    Bits,
    Device,
    Explain,
    FilmOptions,
    FrameOptions,
    MoreInputs,
    Output,
    Quiet,
    Small,
    ViewOptions,
    Views,
    WindowOptions,
    spread,
)
from .cli_output import announce, explainer, fail, open_renderer, progress, report, spinner, warn_skipped
from .cli_parse import rates_from, size_from, views_from
from .cli_picture import PictureOptions
from .cli_read import check_frame, check_look, check_stream, load, load_others, load_together, load_views
from .notes import few_notes, print_note
from .wording import as_command_line, option

if TYPE_CHECKING:
    from .frame import Frame
    from .renderer import Renderer
    from .scene import Scene
    from .view import View

# a process is asked to end, or its terminal is closed (not on Windows)
_ENDINGS = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]

app = typer.Typer(
    cls=Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    from . import __version__

    if wanted:
        print(f"pointshade_gl {__version__}")
        raise typer.Exit


@app.callback()
def _every_command(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Turn depth and colour pictures into lit objects, on the GPU."""


@app.command()
@spread
def render(
    output: Output,
    frame: FrameOptions,
    look: LookOptions,
    place: ViewOptions,
    picture: PictureOptions,
    film: FilmOptions,
    more: MoreInputs = None,
    views: Views = None,
    explain: Explain = False,
    small: Small = False,
    device: Device = 0,
    quiet: Quiet = False,
) -> None:
    """Light a frame or a scene (.gltf, .glb, 'demo') and write the picture. Without INPUT: the built-in vase.

    Write all frames of a sequence, or a turntable, to an .mp4, a .gif or numbered files such as %04d.png.
    Write the points of a frame, lit (or not: --shading none), in world coordinates to a .ply.
    """
    from .files.film import check_series, is_series
    from .files.pictures import save_image
    from .scene import Scene
    from .scene_shading import shaded

    view, inputs = place.view(look), more or []
    check_folders(inputs)
    if inputs and (
        views is not None or (film.turntable is None and is_series(output)) or output.suffix.lower() == ".ply"
    ):
        raise ValueError(
            f"several INPUTs are drawn as one object, in a picture or a turntable: pass one INPUT to {output}"
        )
    if output.suffix.lower() == ".ply":
        if views is not None:
            raise ValueError(f"{output} holds the points of frames: leave out {option('views')}")
        picture.check_none(output)
        _write_points(output, frame, view, film, device, explainer(explain))
        return
    many = film.turntable is not None or is_series(output)
    check_stream(view.look, many and film.turntable is None)
    if many:
        check_series(output)
    else:
        _check_picture(output, film)
    if inputs:
        source, names = load_together(frame, view.look, inputs)
    elif views is not None:
        source, names = load_views(frame, view.look, views)
    else:
        source, names = load(frame, sequence=many and film.turntable is None, scene=True), []
    tell = explainer(explain, names)
    is_scene = isinstance(source, Scene) and not names
    if is_scene:
        source = shaded(source, check_look(view.look))
    if picture.ground or is_scene:
        view = replace(view, lights=look.lights(shadow=True))
    view = replace(view, finish=picture.finish(output, view, source, many, film.turntable == "camera"))
    if many:
        _render_series(source, view, output, film, device, tell)
        return
    with open_renderer(device) as renderer, spinner("rendering"):
        start = time.perf_counter()
        image = renderer.render(source, **view.of(source))
        spent = time.perf_counter() - start
        save_image(output, image, small)
        tell(renderer)
        if not image.any():
            print_note("nothing is in view, the picture is empty")
        what = f"{image.shape[1]}x{image.shape[0]} pixels from {source.points_known} points"
        report(output, what, renderer, spent)


@app.command()
@spread
def normals(
    output: Output,
    frame: FrameOptions,
    options: NormalOptions,
    axes: Axes = None,
    bits: Bits = 8,
    explain: Explain = False,
    device: Device = 0,
    quiet: Quiet = False,
) -> None:
    """Estimate normals: .npy and .exr get floats, a picture shows them in the usual colours.

    Write all frames of a sequence to numbered files such as %04d.png.
    """
    from .cli_write import write_normals
    from .files.maps import check_normals_path
    from .files.numbering import first_of, is_numbered

    check_normals_path(first_of(output), axes, bits)
    view = ViewOptions().view(LookOptions(**vars(options)))
    write_normals(load(frame, sequence=is_numbered(output)), view, output, axes, bits, explain, device)


@app.command()
@spread
def depth(
    output: Output,
    frame: FrameOptions,
    options: NormalOptions,
    place: ViewOptions,
    device: Device = 0,
    quiet: Quiet = False,
) -> None:
    """Write the depth of the picture that render draws: metres to .exr, .tif and .npy, millimetres to .png.

    Write all frames of a sequence to numbered files such as %04d.png. Missing depth is 0.
    """
    from .cli_write import write_depth
    from .files.maps import check_depth_path
    from .files.numbering import first_of, is_numbered
    from .scene import Scene

    check_depth_path(first_of(output))
    view = place.view(LookOptions(**vars(options)))
    source = load(frame, sequence=is_numbered(output), scene=True)
    if isinstance(source, Scene):
        check_look(view.look)
    write_depth(source, view, output, device)


@app.command()
@spread
def view(
    frame: FrameOptions,
    look: LookOptions,
    window: WindowOptions,
    more: MoreInputs = None,
    views: Views = None,
    quiet: Quiet = False,
) -> None:
    """Open a window where the light follows the mouse; H lists the keys.

    A folder with a sequence is played; with --views, or when M is pressed, frames of it are merged into one object.
    """
    from .cli_words import words_of
    from .files.builtin import FRAMES
    from .frame import Frame
    from .scene import Scene
    from .viewer import Viewer
    from .viewer.command import Typed
    from .viewer.panel import MISSING
    from .viewer.state import State

    if window.panel and find_spec("imgui_bundle") is None:
        raise ValueError(MISSING)
    state, size = State(look=look.look()), size_from(window.size)
    lights = look.lights(shadow=True)
    count, inputs = None if views is None else views_from(views) or "all", more or []
    check_folders(inputs)
    rates = rates_from(window.fps, 1 + len(inputs))
    if inputs and views:
        raise ValueError(f"several INPUTs are merged as they play: leave out {option('views')}")
    source = load(frame, sequence=True, scene=not (views or inputs))
    others = load_others(frame, source, inputs)
    if isinstance(source, Scene):
        check_look(state.look)
    check_stream(state.look, bool(others) or not isinstance(source, Frame))
    words = words_of(frame if frame.input or frame.depth or frame.color else replace(frame, input=FRAMES[0]))
    named = 0 if words[0].startswith("--") else 1
    viewer = Viewer(
        source,
        title=f"pointshade: {' and '.join([str(frame.input or frame.depth or 'vase'), *inputs])}",
        size=size,
        state=state,
        lights=lights,
        others=others,
        fps=rates,
        views=count,
        record=window.record,
        panel=window.panel,
        typed=Typed((*words[:named], *inputs), tuple(words[named:])),
    )
    announce(viewer.renderer)
    if not isinstance(source, Scene):
        asked = any(light.shadow for light in look.lights())
        viewer.state = replace(viewer.state, shadows=asked)  # until the key S switches them on
    viewer.run()


@app.command()
@spread
def info(
    frame: FrameOptions,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Also write a contact sheet: colour, depth, normals, lit.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")] = False,
    device: Device = 0,
    quiet: Quiet = False,
) -> None:
    """Print what is in a file or folder, and how it would be read; without INPUT, what draws: GL vendor, limits."""
    if frame.input or frame.depth or frame.color:
        from .cli_info import show_input

        check_frame(frame)
        frame.check_exist()
        show_input(frame, output, as_json, device)
        return
    if output:
        raise ValueError(f"a contact sheet shows a frame: pass INPUT, as in `pointshade info vase -o {output}`")
    from . import __version__

    with open_renderer(device) as renderer:
        limits = {"pointshade_gl": __version__, **renderer.context.limits()}
        if as_json:
            print(json.dumps({name.replace(" ", "_"): value for name, value in limits.items()}, indent=1))
        else:
            print("\n".join(f"{name:16s}{limits[name]}" for name in limits))


@app.command()
@spread
def bench(options: BenchOptions, device: Device = 0, quiet: Quiet = False) -> None:
    """Measure the speed, accuracy and robustness of every estimator: charts and results.json."""
    from .bench.command import bench as run_bench
    from .bench.command import bench_against, bench_speed, bench_views

    if options.against is not None and not options.speed:
        raise ValueError(f"{option('against')} compares speeds: add {option('speed', True)}")
    if options.against is not None:
        print(bench_against(options.against, options.quick, device))
        return
    if options.speed:
        print(bench_speed(options.output, options.quick, device))
        return
    if options.views:
        print(bench_views(options.output, options.quick, options.seed, device))
        return
    print(run_bench(options.output, options.quick, options.only or [], options.images, options.seed, device))


def main() -> None:
    """Runs the command line. Every expected error becomes one sentence: exit code 2, or 1 without GL or memory."""
    for ending in _ENDINGS:
        if signal.getsignal(ending) != signal.SIG_IGN:  # as nohup wants it
            signal.signal(ending, _interrupt)
    try:
        with as_command_line(), few_notes():
            ended = app(prog_name="pointshade", standalone_mode=False)
        raise SystemExit(ended or 0)
    except UsageError as error:
        fail(sentence_of(error), error.exit_code)
    except (ValueError, TypeError, OSError) as error:
        fail(str(error), 2)
    except MemoryError as error:
        fail(str(error) or "not enough memory", 1)
    except RuntimeError as error:
        from .errors import ContextError

        if not isinstance(error, ContextError):
            raise
        fail(str(error), 1)


def _interrupt(*_: object) -> NoReturn:
    """Ends the work as Ctrl-C does, so that nothing is left half-written; only once, or cleaning up would end, too."""
    for ending in _ENDINGS:
        signal.signal(ending, signal.SIG_IGN)
    raise KeyboardInterrupt


def _check_picture(output: Path, film: FilmOptions) -> None:
    """Raises ValueError or OSError unless a single picture can be written there."""
    from .files.pictures import check_writable

    try:
        check_writable(output)
    except ValueError as error:
        raise ValueError(f"{error}; films are .mp4 or .gif, points .ply") from None
    if film.frames is not None:
        raise ValueError(
            f"{option('frames')} is for many pictures and {output} is one: write an .mp4, a .gif or %04d{output.suffix}"
        )


def _write_points(
    output: Path,
    frame: FrameOptions,
    view: View,
    film: FilmOptions,
    device: int,
    tell: Callable[[Renderer], None],
) -> None:
    """`render -o points.ply`: the points of a frame, or of each frame of a sequence, in world coordinates."""
    from .cli_write import write_points
    from .files.numbering import first_of, is_numbered
    from .files.points import check_points_path
    from .scene import Scene

    check_points_path(first_of(output))
    if view.size is not None:
        raise ValueError(f"{output} holds points, {option('size')} is of a picture: leave it out")
    source = load(frame, sequence=is_numbered(output) and film.turntable is None, scene=True)
    if isinstance(source, Scene):
        raise ValueError(f"{output} holds the points of frames, {frame.input} is a scene: write a picture of it")
    write_points(source, view, output, film.turntable, film.frames, device, tell)


def _render_series(
    source: Frame | Scene | Sequence[Frame],
    view: View,
    output: Path,
    film: FilmOptions,
    device: int,
    tell: Callable[[Renderer], None],
) -> None:
    from .series import jobs_of, write_series

    jobs, count = jobs_of(source, view, film.turntable, film.frames, warn_skipped)
    with open_renderer(device) as renderer:
        start = time.perf_counter()
        with progress(count) as advance:

            def done() -> None:
                advance()
                tell(renderer)

            count, (width, height) = write_series(renderer, jobs, output, film.fps, done)
        spent = time.perf_counter() - start
        report(output, f"{count} pictures of {width}x{height} pixels", renderer, spent)
