"""The command line: `pointshade render`, `normals`, `view`, `info`, `bench`. Files in, a line about the result out."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .cli_options import (
    FILM,
    VIEW,
    Ambient,
    Baseline,
    Color,
    Depth,
    DepthKind,
    DepthScale,
    Device,
    Diffuse,
    Fov,
    Input,
    Intrinsics,
    Lights,
    MaxDepthStep,
    NoiseOption,
    Normals,
    Output,
    Shading,
    Shininess,
    Specular,
    Splat,
)

if TYPE_CHECKING:
    from .frame import Frame
    from .light import Light
    from .look import Look
    from .renderer import Renderer
    from .scene import Scene
    from .view import View

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


def _tell_version(wanted: bool) -> None:
    from . import __version__

    if wanted:
        print(f"pointshade_gl {__version__}")
        raise typer.Exit


@app.callback()
def _every_command(
    version: Annotated[
        bool, typer.Option("--version", callback=_tell_version, is_eager=True, help="Tell the version and stop.")
    ] = False,
) -> None:
    """Depth and colour pictures become lit objects, on the GPU."""


@app.command()
def render(
    output: Output,
    input: Input = None,
    color: Color = None,
    depth: Depth = None,
    intrinsics: Intrinsics = None,
    fov: Fov = None,
    depth_scale: DepthScale = None,
    depth_kind: DepthKind = None,
    baseline: Baseline = None,
    normals: Normals = "auto",
    max_depth_step: MaxDepthStep = None,
    noise: NoiseOption = None,
    shading: Shading = "phong",
    light: Lights = None,
    ambient: Ambient = 0.1,
    diffuse: Diffuse = 0.9,
    specular: Specular = 0.3,
    shininess: Shininess = 32.0,
    splat: Splat = "footprint",
    yaw: Annotated[float, typer.Option(help="Degrees to the right round the object.", rich_help_panel=VIEW)] = 0.0,
    pitch: Annotated[float, typer.Option(help="Degrees upwards round the object.", rich_help_panel=VIEW)] = 0.0,
    dolly: Annotated[
        float, typer.Option(help="Share of the way towards the object; below 0 moves away.", rich_help_panel=VIEW)
    ] = 0.0,
    pose: Annotated[
        Path | None, typer.Option(help="4x4 camera-to-world, instead of yaw, pitch, dolly.", rich_help_panel=VIEW)
    ] = None,
    size: Annotated[str | None, typer.Option(metavar="WxH", help="Size of the picture.", rich_help_panel=VIEW)] = None,
    turntable: Annotated[
        str | None,
        typer.Option(metavar="light|camera", help="Takes it once round the object.", rich_help_panel=FILM),
    ] = None,
    frames: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=1, help="Pictures of a turntable (75); of a sequence the first N.", rich_help_panel=FILM
        ),
    ] = None,
    fps: Annotated[float, typer.Option(help="Pictures a second.", rich_help_panel=FILM)] = 25.0,
    small: Annotated[bool, typer.Option("--small", help="Take longer over a smaller PNG.")] = False,
    device: Device = 0,
) -> None:
    """Light a frame or a scene (.gltf, .glb, 'demo') and write the picture; without INPUT the built-in vase.

    To .mp4, .gif or a name such as %04d.png go all frames of a sequence, or a turntable.
    """
    from .files.film import check_series, is_series
    from .files.pictures import check_writable, save_image
    from .files.poses import load_pose
    from .look import Look, Material
    from .scene import Scene
    from .view import View

    view = View(
        lights=[_light(text) for text in light or []],
        pose=load_pose(pose) if pose else None,
        yaw=yaw,
        pitch=pitch,
        dolly=dolly,
        size=_size(size) if size else None,
        look=Look(
            Material(ambient, diffuse, specular, shininess),
            normals,
            shading,
            splat=splat,
            max_depth_step=max_depth_step,
            noise=_noise(noise),
        ),
    )
    many = turntable is not None or is_series(output)
    (check_series if many else check_writable)(output)
    source = _load(
        input,
        sequence=many and turntable is None,
        scene=True,
        color=color,
        depth=depth,
        intrinsics=intrinsics,
        fov=fov,
        depth_scale=depth_scale,
        depth_kind=depth_kind,
        baseline=baseline,
    )
    _check_look(source, view.look)
    if isinstance(source, Scene):
        view = replace(view, lights=[replace(one, shadow=True) for one in view.lights])
    if many:
        _render_series(source, view, output, turntable, frames, fps, device)
        return
    with _renderer(device) as renderer, _spinner("rendering"):
        start = time.perf_counter()
        image = renderer.render(source, **view.of(source))
        spent = time.perf_counter() - start
        save_image(output, image, small)
        if not image.any():
            print("note: nothing is in view, the picture is empty", file=sys.stderr)
        what = f"{image.shape[1]}x{image.shape[0]} pixels from {source.points_known} points"
        _report(output, what, renderer, spent)


@app.command("normals")
def write_normals(
    output: Output,
    input: Input = None,
    color: Color = None,
    depth: Depth = None,
    intrinsics: Intrinsics = None,
    fov: Fov = None,
    depth_scale: DepthScale = None,
    depth_kind: DepthKind = None,
    baseline: Baseline = None,
    normals: Normals = "auto",
    max_depth_step: MaxDepthStep = None,
    noise: NoiseOption = None,
    explain: Annotated[bool, typer.Option("--explain", help="Say which estimator ran, and why.")] = False,
    device: Device = 0,
) -> None:
    """Estimate normals: .npy holds (h, w, 3) floats in camera axes, a picture shows them in the usual colours."""
    from .files.pictures import check_writable, normals_to_rgb, save_image
    from .noise import describe

    check_writable(output)
    frame = _load(
        input,
        color=color,
        depth=depth,
        intrinsics=intrinsics,
        fov=fov,
        depth_scale=depth_scale,
        depth_kind=depth_kind,
        baseline=baseline,
    )
    with _renderer(device) as renderer, _spinner("estimating normals"):
        start = time.perf_counter()
        result = renderer.estimate_normals(frame, normals, max_depth_step=max_depth_step, noise=_noise(noise))
        spent = time.perf_counter() - start
        save_image(output, result if output.suffix == ".npy" else normals_to_rgb(result))
        if explain and renderer.choice:
            print(describe(renderer.choice))
        _report(output, f"{frame.points_known} normals by {normals}", renderer, spent)


@app.command()
def view(
    input: Input = None,
    color: Color = None,
    depth: Depth = None,
    intrinsics: Intrinsics = None,
    fov: Fov = None,
    depth_scale: DepthScale = None,
    depth_kind: DepthKind = None,
    baseline: Baseline = None,
    normals: Normals = "auto",
    max_depth_step: MaxDepthStep = None,
    noise: NoiseOption = None,
    shading: Shading = "phong",
    light: Lights = None,
    ambient: Ambient = 0.1,
    diffuse: Diffuse = 0.9,
    specular: Specular = 0.3,
    shininess: Shininess = 32.0,
    splat: Splat = "footprint",
    size: Annotated[str | None, typer.Option(metavar="WxH", help="Size of the window.", rich_help_panel=VIEW)] = None,
    panel: Annotated[bool, typer.Option("--panel", help="Open the panel (needs the extra gui).")] = False,
    fps: Annotated[float, typer.Option(help="Frames of a sequence a second.", rich_help_panel=FILM)] = 30.0,
    record: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Films what is seen: .mp4 or .gif.", rich_help_panel=FILM)
    ] = None,
) -> None:
    """Open a window in which the light follows the mouse; H in it lists keys. A folder of many frames is played."""
    from .look import Look, Material
    from .viewer import Viewer
    from .viewer.panel import MISSING
    from .viewer.state import State

    if panel and find_spec("imgui_bundle") is None:
        raise ValueError(MISSING)
    look = Look(
        Material(ambient, diffuse, specular, shininess),
        normals,
        shading,
        splat=splat,
        max_depth_step=max_depth_step,
        noise=_noise(noise),
    )
    source = _load(
        input,
        sequence=True,
        scene=True,
        color=color,
        depth=depth,
        intrinsics=intrinsics,
        fov=fov,
        depth_scale=depth_scale,
        depth_kind=depth_kind,
        baseline=baseline,
    )
    Viewer(
        source,
        title=f"pointshade: {input or depth or 'vase'}",
        size=_size(size) if size else None,
        state=State(look=look),
        lights=[_light(text) for text in light or []],
        fps=fps,
        record=record,
        panel=panel,
    ).run()


@app.command()
def info(
    device: Device = 0,
) -> None:
    """Tell what draws: GL vendor, renderer, version, limits."""
    from . import __version__

    with _renderer(device) as renderer:
        print(f"{'pointshade_gl':16s}{__version__}")
        for name, value in renderer.context.limits().items():
            print(f"{name:16s}{value}")


@app.command()
def bench(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FOLDER", help="Where to write.")] = Path("bench"),
    quick: Annotated[bool, typer.Option("--quick", help="Smaller pictures, fewer scenes: under a minute.")] = False,
    only: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="A method, condition or stress; repeatable.")
    ] = None,
    images: Annotated[bool, typer.Option("--images", help="Also measure whole lit pictures.")] = False,
    speed: Annotated[bool, typer.Option("--speed", help="Measure speed instead: stages, points, merging.")] = False,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="Of the noise and the holes.")] = 0,
    device: Device = 0,
) -> None:
    """Measure every estimator, speed against accuracy and under stress: charts and results.json."""
    from .bench.command import bench as run_bench
    from .bench.command import bench_speed

    if speed:
        print(bench_speed(output, quick, device))
        return
    print(run_bench(output, quick, only or [], images, seed, device))


def main() -> None:
    """Runs the command line; every expected error becomes one sentence: exit code 2, or 1 without GL or memory."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # as Ctrl-C: a film that is being written ends whole
    try:
        app(prog_name="pointshade")
    except (ValueError, TypeError, OSError) as error:
        _fail(error, 2)
    except MemoryError as error:
        _fail(error, 1)
    except RuntimeError as error:
        from .errors import ContextError

        if not isinstance(error, ContextError):
            raise
        _fail(error, 1)


def _fail(error: Exception, code: int) -> None:
    print(f"pointshade: {' '.join(str(error).split())}", file=sys.stderr)
    raise SystemExit(code) from None


def _load(source: str | None, sequence: bool = False, scene: bool = False, **options: Any) -> Any:
    """The frame of the command line, all of a sequence, or a scene; without a word about it the built-in vase."""
    from .files.frames import load_frame

    if scene and source is not None and (source == "demo" or source.lower().endswith((".gltf", ".glb"))):
        if any(value is not None for value in options.values()):
            raise ValueError(f"{source} is a scene: its frames have their own files and intrinsics, pass no others")
        from .gltf import load_scene

        return load_scene(source)
    if source is None and options["color"] is None and options["depth"] is None:
        source = "vase"
    if not sequence:
        return load_frame(source, **options)
    from .sources import open_source

    return open_source(source, **options)


def _check_look(source: Any, look: Look) -> None:
    """Raises ValueError for options about the look of objects: those of a scene have their own."""
    from .look import Look
    from .scene import Scene

    given, plain = ({**one.options, **vars(one.material)} for one in (look, Look()))
    changed = [name for name in given if name != "material" and given[name] != plain[name]]
    if isinstance(source, Scene) and changed:
        options = ", ".join(f"--{name.replace('_', '-')}" for name in changed)
        raise ValueError(f"the objects of a scene have a look of their own: leave out {options}")


def _render_series(
    source: Frame | Scene | Sequence[Frame],
    view: View,
    output: Path,
    turntable: str | None,
    frames: int | None,
    fps: float,
    device: int,
) -> None:
    from .series import shots_of, write_series

    def skipped(sentence: str) -> None:
        print(f"warning: skipped {sentence}", file=sys.stderr)

    shots, count = shots_of(source, view, turntable, frames, skipped)
    with _renderer(device) as renderer:
        start = time.perf_counter()
        with _progress(count) as advance:
            count, (width, height) = write_series(renderer, shots, output, fps, advance)
        spent = time.perf_counter() - start
        _report(output, f"{count} pictures of {width}x{height} pixels", renderer, spent)


@contextmanager
def _renderer(device: int) -> Iterator[Renderer]:
    from .renderer import Renderer

    with Renderer(device=device) as renderer:
        if renderer.context.is_software:
            name = renderer.context.renderer
            print(f"note: {name} is a software renderer: pictures are right, but slow", file=sys.stderr)
        yield renderer


@contextmanager
def _spinner(text: str) -> Iterator[None]:
    """Shows on a terminal that work goes on; elsewhere silent."""
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console

    with Console(stderr=True).status(text):
        yield


@contextmanager
def _progress(steps: int) -> Iterator[Callable[[], None]]:
    """A function to call after each step: it moves a bar on a terminal, elsewhere nothing."""
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()) as progress:
        task = progress.add_task("rendering", total=steps)
        yield lambda: progress.advance(task)


def _report(output: Path, what: str, renderer: Renderer, spent: float) -> None:
    print(f"{output}: {what}, {renderer.context.renderer}, {spent * 1e3:.0f} ms")


def _numbers(text: str, count: int, separator: str, what: str) -> list[float]:
    try:
        numbers = [float(part) for part in text.lower().split(separator)]
    except ValueError:
        numbers = []
    if len(numbers) != count:
        raise ValueError(f"{what}, got {text!r}")
    return numbers


def _noise(text: str | None) -> float | str | None:
    """Metres if it reads as a number, else the name of a sensor."""
    try:
        return None if text is None else float(text)
    except ValueError:
        return text


def _light(text: str) -> Light:
    from .light import Light

    x, y, z = _numbers(text, 3, ",", "--light takes three numbers X,Y,Z in metres")
    return Light(position=(x, y, z))


def _size(text: str) -> tuple[int, int]:
    width, height = _numbers(text, 2, "x", "--size takes WIDTHxHEIGHT in pixels, such as 640x480")
    if width < 1 or height < 1 or width % 1 or height % 1:
        raise ValueError(f"--size takes WIDTHxHEIGHT in whole pixels above 0, got {text!r}")
    return int(width), int(height)
