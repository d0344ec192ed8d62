"""`pointshade normals`, `depth`, `albedo` and `align`: what is estimated of frames is written to files."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from ...estimation.pose_search import FoundPose
from ...files.access.known_names import first_of, is_numbered
from ...files.input_kinds import Kind
from ...files.pictures.picture_files import check_writable, save_image
from ...files.writing import maps_and_points as files
from ...notes.notes import once, print_note
from ...notes.words import counted, option
from ...renderer.renderer import Renderer
from ...renderer.requests import RenderRequest
from ...scene.frame import Frame
from ...scene.graph import Scene
from ...scene.noise import describe
from ...scene.viewpoint import View
from .. import inputs, options
from ..help import complete_input
from ..option_groups import NormalOptions, check_folders
from ..output import open_renderer, print_line, report, spinner


@options.spread
def normals(
    output: options.NormalsOutput, frame: options.FrameOptions, surface: NormalOptions, place: options.ViewOptions,
    axes: options.Axes = None, bits: options.Bits = 8, explain: options.Explain = False, *, run: options.RunOptions
) -> None:  # fmt: skip
    """Estimate normals: .npy and .exr get floats, a picture shows them in the usual colours.

    Of a point cloud, write a .ply of its points with normals, turned outwards, or the normals alone to an .npy.
    Write all frames of a sequence to numbered files such as %04d.png. With a view, such as --yaw 20, or of a scene:
    the normals of the picture that render draws.
    """
    from ..written import check_cloud_output, write_cloud, write_files

    is_moved = place != options.ViewOptions()
    if frame.holds_points and not is_moved:
        check_cloud_output(output, axes)
        if bits != 8:
            raise ValueError(f"{option('bits')} is of pictures, and {frame.input} is a point cloud: leave it out")
        write_cloud(inputs.load_points(frame), surface.look(), output, axes, run.device)
        return
    files.check_normals_path(first_of(output), axes, bits)
    view = place.view(surface.look())
    loaded = _load_view(frame, view, place, output)
    is_drawn = is_moved or isinstance(loaded.source, Scene)

    def draw(renderer: Renderer, request: RenderRequest) -> Any:
        normals = renderer.render_normals(request) if is_drawn else renderer.estimate_normals(request)
        if explain and renderer.choice:
            print_line(describe(renderer.choice))
        return normals

    def what(normals: Any) -> str:
        return f"{np.isfinite(normals).all(-1).sum()} normals by {view.look.normals}"

    chosen: dict[str, Any] = {"axes": axes, "bits": bits}
    write_files(loaded, view, output, run.device, draw, partial(files.save_normals, **chosen), what)


def _load_view(frame: options.FrameOptions, view: View, place: options.ViewOptions, output: Path) -> inputs.Loaded:
    """Read what is seen: all frames of the built-in object where the view turns, of a sequence those to be written."""
    named = inputs.Inputs(*inputs.with_all_sides(frame, options.MoreOptions(), inputs.is_turned(place)))
    loaded = named.load(view.look, inputs.PLAIN, sequence=is_numbered(output))
    if named.kind is Kind.CLOUD:
        inputs.check_look(view.look)
    return loaded._replace(frames=())  # whose scene turns round its middle, as in the picture


@options.spread
def depth(
    output: options.DepthOutput, frame: options.FrameOptions, surface: NormalOptions, place: options.ViewOptions, *,
    run: options.RunOptions
) -> None:  # fmt: skip
    """Write the depth of the picture that render draws: metres to .exr, .tif and .npy, millimetres to .png.

    Write all frames of a sequence to numbered files such as %04d.png. Missing depth is 0.
    """
    from ..written import write_files

    files.check_depth_path(first_of(output))
    view = place.view(surface.look())
    loaded = _load_view(frame, view, place, output)
    note = once(print_note)
    if output.suffix.lower() == ".png":
        note(f"{output} holds millimetres, nearly black in picture viewers: 1.5 m is 1500 of 65535")

    def draw(renderer: Renderer, request: RenderRequest) -> Any:
        depth = renderer.render_depth(request)
        if not depth.any():
            note("nothing is in view, the depth is empty")
        return depth

    def what(depth: Any) -> str:
        return f"{depth.shape[1]}x{depth.shape[0]} pixels, {np.count_nonzero(depth > 0)} with depth"

    write_files(loaded, view, output, run.device, draw, partial(files.save_depth, notes=note), what)


@options.spread
def albedo(
    output: options.AlbedoOutput, frame: options.FrameOptions, explain: options.Explain = False, *,
    run: options.RunOptions
) -> None:  # fmt: skip
    """Write the albedo that several photographs of one view share, each taken under its own light.

    INPUT is a folder with a sequence: one camera at one place, things at rest, only the light moves.
    """
    check_writable(output)
    photos = inputs.load_photographs(frame)
    with open_renderer(run.device, output) as renderer:
        start = time.perf_counter()
        image = inputs.albedo_of(renderer, photos, explain)
        spent = time.perf_counter() - start
        save_image(output, image)
        report(output, f"{image.shape[1]}x{image.shape[0]} pixels of {len(photos)} photographs", renderer, spent)


MOST_VIEWS = 4


@options.spread
def align(
    output: options.PosesOutput,
    frame: options.FrameOptions,
    more: Annotated[
        list[str] | None,
        typer.Argument(metavar="MORE", help="One to three more views of the same.", autocompletion=complete_input),
    ] = None,
    *,
    run: options.RunOptions,
) -> None:
    """Find the poses of two to four views of one thing, of which nothing is known, and say how sure they are.

    INPUT and MORE are folders; of a sequence the first frame counts, or that of --frame. They should
    show the same from up to about 60 degrees apart. The first keeps its pose. The exit code is 1 if one is not found.
    """
    files.check_found_path(output)
    names, frames = _views(frame, more or [])
    with open_renderer(run.device, output) as renderer:
        start = time.perf_counter()
        with spinner("finding the poses"):
            found = renderer.search_poses(frames)
        spent = time.perf_counter() - start
        first, *others = found
        print_line(f"{names[0]}: keeps its pose")
        for name, one in zip(names[1:], others, strict=True):
            print_line(f"{name}: {_in_words(first.fit.pose, one, names[0])}")
        poses = {
            name: one.fit.pose if one.fit.placed or one is first else None
            for name, one in zip(names, found, strict=True)
        }
        lost = [name for name, pose in poses.items() if pose is None]
        if len(lost) < len(others):
            files.save_found_poses(output, poses)
            report(output, counted(len(names) - len(lost), "pose"), renderer, spent)
    if lost:
        print_note(f"not found: {', '.join(lost)}" + ("" if len(lost) < len(others) else "; nothing is written"))
        raise typer.Exit(1)


def _views(frame: options.FrameOptions, more: Sequence[str]) -> tuple[list[str], list[Frame]]:
    """Read one frame of each input; return their names as typed, with the number where one was typed twice."""
    inputs.check_inputs_alone(frame)
    if frame.input is None or not 1 <= len(more) < MOST_VIEWS:
        got = len(more) + (frame.input is not None)
        raise ValueError(f"poses are found of 2 to {MOST_VIEWS} INPUTs that show the same, got {got}")
    check_folders(more)
    paths = [frame.input, *more]
    numbers, names = inputs.numbers_and_names(frame, paths)
    if len(set(names)) < len(names):
        raise ValueError(f"the same view was passed twice: pass others, or {option('frame')} with a number for each")
    return names, [
        inputs.load(replace(frame, input=path, frame=str(k))) for path, k in zip(paths, numbers, strict=True)
    ]


def _in_words(first: NDArray[np.float64], found: FoundPose, name: str) -> str:
    """Return how far a view is from the first one, what agrees, and how sure that is."""
    fit, doubt = found
    if not fit.placed:
        return f"not found: {doubt}"
    apart = np.linalg.inv(first) @ fit.pose
    degrees = np.degrees(np.arccos(np.clip((np.trace(apart[:3, :3]) - 1) / 2, -1, 1)))
    return (
        f"{100 * np.linalg.norm(apart[:3, 3]):.1f} cm and {degrees:.1f} degrees from {name}, "
        f"overlap {100 * fit.overlap:.0f} %, agreement {100 * fit.agrees:.0f} %, "
        + (f"doubtful: {doubt}" if doubt else "sure")
    )
