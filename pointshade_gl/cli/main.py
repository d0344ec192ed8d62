"""The command line: `pointshade normals`, `depth`, `info`, `bench`, and those of commands/.

Options: options.py.
"""

from __future__ import annotations

import json
import signal
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from ..files.access.numbered_names import first_of, is_numbered
from ..messages.errors import ContextError
from ..messages.formatting import as_command_line, option
from ..messages.notes import few_notes
from ..scene.graph import Scene
from ..scene.view import View
from ..version import __version__
from .commands.batch import batch
from .commands.render import render
from .commands.view import view
from .inputs import check_frame, check_look, load
from .look_options import NormalOptions
from .options import Axes, BenchOptions, Bits, Device, Explain, FrameOptions, Output, Quiet, ViewOptions, spread
from .output import fail, open_renderer
from .usage_errors import Commands, UsageError, sentence_of

# a process is asked to end, or its terminal is closed (not on Windows)
_ENDINGS = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]

app = typer.Typer(
    cls=Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
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


app.command()(render)


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
    from ..files.writing.depth_and_normal_maps import check_normals_path
    from .written_maps import write_normals

    check_normals_path(first_of(output), axes, bits)
    view = View(look=options.look())
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
    from ..files.writing.depth_and_normal_maps import check_depth_path
    from .written_maps import write_depth

    check_depth_path(first_of(output))
    view = place.view(options.look())
    source = load(frame, sequence=is_numbered(output), scene=True)
    if isinstance(source, Scene):
        check_look(view.look)
    write_depth(source, view, output, device)


app.command()(view)


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
        from .commands.info import show_input

        check_frame(frame)
        frame.check_exist()
        show_input(frame, output, as_json, device)
        return
    if output:
        raise ValueError(f"a contact sheet shows a frame: pass INPUT, as in `pointshade info vase -o {output}`")
    with open_renderer(device) as renderer:
        limits = {"pointshade_gl": __version__, **renderer.context.limits()}
        if as_json:
            print(json.dumps({name.replace(" ", "_"): value for name, value in limits.items()}, indent=1))
        else:
            print("\n".join(f"{name:16s}{limits[name]}" for name in limits))


app.command()(batch)


@app.command()
@spread
def bench(options: BenchOptions, device: Device = 0, quiet: Quiet = False) -> None:
    """Measure the speed, accuracy and robustness of every estimator: charts and results.json."""
    from ..bench import command

    quick, output = options.quick, options.output
    if options.against is not None and not options.speed:
        raise ValueError(f"{option('against')} compares speeds: add {option('speed', True)}")
    if options.against is not None:
        said = command.bench_against(options.against, quick, device)
    elif options.speed:
        said = command.bench_speed(output, quick, device)
    elif options.views:
        said = command.bench_views(output, quick, options.seed, device)
    else:
        said = command.bench(output, quick, options.only or [], options.images, options.seed, device)
    print(said)


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
        if not isinstance(error, ContextError):
            raise
        fail(str(error), 1)


def _interrupt(*_: object) -> NoReturn:
    """Ends the work as Ctrl-C does, so that nothing is left half-written; only once, or cleaning up would end, too."""
    for ending in _ENDINGS:
        signal.signal(ending, signal.SIG_IGN)
    raise KeyboardInterrupt
