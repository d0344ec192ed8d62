"""What `normals`, `depth` and `render -o points.ply` write: a file of a frame, or numbered files of a sequence."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..checks.arguments import Count
from ..files.access.known_names import is_numbered
from ..files.writing.maps_and_points import save_depth, save_normals, save_points
from ..notes.notes import once, print_note
from ..renderer.renderer import Renderer
from ..renderer.requests import RenderRequest
from ..renderer.series import jobs_of, write_numbered
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.noise import describe
from ..scene.viewpoint import View
from .inputs import check_stream
from .options import FilmOptions
from .output import open_renderer, progress, report, spinner, warn_skipped

Source = Frame | Scene | Sequence[Frame]


def write_normals(source: Source, view: View, output: Path, axes: Any, bits: Any, explain: bool, device: int) -> None:
    """Writes normals by the method and the options of a view's look, as `save_normals` does."""

    def draw(renderer: Renderer, request: RenderRequest) -> Any:
        normals = renderer.estimate_normals(request)
        if explain and renderer.choice:
            print(describe(renderer.choice))
        return normals

    def what(normals: Any) -> str:
        return f"{np.isfinite(normals).all(-1).sum()} normals by {view.look.normals}"

    _write_files(source, view, output, draw, partial(save_normals, axes=axes, bits=bits), what, device, FilmOptions())


def write_depth(source: Source, view: View, output: Path, device: int) -> None:
    """Writes the depth that a view shows, as `save_depth` does."""

    def draw(renderer: Renderer, request: RenderRequest) -> Any:
        depth = renderer.render_depth(request)
        if not depth.any():
            note("nothing is in view, the depth is empty")
        return depth

    def what(depth: Any) -> str:
        known = depth[depth > 0]
        return f"{depth.shape[1]}x{depth.shape[0]} pixels, {known.size} with depth"

    note = once(print_note)
    if output.suffix.lower() == ".png":
        note(f"{output} holds millimetres, nearly black in picture viewers: 1.5 m is 1500 of 65535")
    _write_files(source, view, output, draw, partial(save_depth, notes=note), what, device, FilmOptions())


def write_points(
    source: Source,
    view: View,
    output: Path,
    axes: Any,
    film: FilmOptions,
    device: int,
    tell: Callable[[Renderer], None],
) -> None:
    """Writes the points of frames in the light of a view, as `save_points` does. tell: called after each."""

    def draw(renderer: Renderer, request: RenderRequest) -> Any:
        cloud = renderer.render_points(request)
        tell(renderer)
        return cloud

    save = partial(save_points, axes=axes)
    _write_files(source, view, output, draw, save, lambda cloud: f"{len(cloud)} points", device, film)


def _write_files(
    source: Any,
    view: View,
    output: Path,
    draw: Callable[[Renderer, RenderRequest], Any],
    save: Callable[[Path, Any], None],
    what: Callable[[Any], str],
    device: int,
    film: FilmOptions,
) -> None:
    """Writes what `draw` makes of a source to a file, or of each of its frames to a file with the frame's number.

    what  says what was drawn, for the line that is printed

    Raises ValueError for a name without a number where there are many frames, and with one where there is one.
    """
    many, turntable = is_numbered(output), film.turntable
    check_stream(view.look, many and turntable is None)
    if turntable is None and many and isinstance(source, Frame | Scene):
        raise ValueError(f"{output} is a name for many files, but INPUT is a single frame: leave out the number")
    if turntable is not None and not many:
        raise ValueError(f"many files need a number in the name, such as %04d{output.suffix}, got {output}")
    with open_renderer(device, output) as renderer:
        start = time.perf_counter()
        if many:
            jobs, count = jobs_of(source, view, turntable, film.frames, warn_skipped, renderer)
            with progress(count) as advance:
                count, first = write_numbered(jobs, partial(draw, renderer), save, output, Count(advance, count))
            spent = time.perf_counter() - start
            text = f"{count} files, the first of {what(first)}"
        else:
            with spinner("rendering"):
                made = draw(renderer, RenderRequest.seen(source, view))
                spent = time.perf_counter() - start
                save(output, made)
            text = what(made)
        report(output, text, renderer, spent)
