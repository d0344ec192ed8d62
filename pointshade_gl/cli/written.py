"""What commands write beside pictures: a file or numbered files of a source, and point clouds."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..checks.arguments import Count
from ..files.access.known_names import CLOUD_NORMALS, POINTS, check_suffix, is_numbered
from ..files.pictures.picture_files import check_writable, save_image
from ..files.writing.maps_and_points import check_points_path, save_points
from ..notes.words import counted, option
from ..renderer.renderer import Renderer
from ..renderer.requests import RenderRequest
from ..renderer.series import jobs_of, write_numbered
from ..scene.appearance import Appearance
from ..scene.cloud import PointCloud
from ..scene.graph import given_by
from ..scene.viewpoint import View
from .inputs import PLAIN, Loaded, check_stream
from .options import FilmOptions
from .output import open_renderer, progress, report, spinner, warn_skipped

NO_FILM = FilmOptions()


def check_cloud_output(output: Path, axes: str | None) -> None:
    """Raises ValueError or OSError unless the normals of a point cloud can be written there."""
    check_suffix(output, CLOUD_NORMALS, "the suffix of a point cloud's normals")
    if output.suffix.lower() in POINTS:
        check_points_path(output, axes)
        return
    if axes is not None:
        raise ValueError(f"{option('axes')} turns the points of a .ply, {output} holds normals alone: leave it out")
    check_writable(output)


def write_cloud(cloud: PointCloud, look: Appearance, output: Path, axes: Any, device: int) -> None:
    """Writes a cloud with normals to a .ply, or the normals, (n, 3), to an .npy. look: its noise is what the normals
    are estimated with. Raises ValueError for other options of normals."""
    noise = look.noise
    if not isinstance(noise, float | None):
        raise ValueError(f"{option('noise')} of a point cloud is one number of world units, got {noise}")
    if others := [name for name in given_by(look, PLAIN) if name != "noise"]:
        raise ValueError(f"{', '.join(map(option, others))} is for frames: of a point cloud leave it out")
    with open_renderer(device, output) as renderer:
        start = time.perf_counter()
        with spinner("estimating normals"):
            made = renderer.with_normals(cloud, noise=noise)
            spent = time.perf_counter() - start
            assert made.normals is not None
            is_known = made.normals.any(1, keepdims=True)
            if output.suffix.lower() in POINTS:
                save_points(output, made, axes)
            else:
                save_image(output, np.where(is_known, made.normals, np.float32(np.nan)))
        what = f"{counted(len(made), 'point')}, {counted(int(is_known.sum()), 'normal')}"
        report(output, what, renderer, spent)


def write_files(
    loaded: Loaded, view: View, output: Path, device: int, draw: Callable[[Renderer, RenderRequest], Any],
    save: Callable[[Path, Any], None], what: Callable[[Any], str], film: FilmOptions = NO_FILM,
) -> None:  # fmt: skip
    """Writes what `draw` makes of what was read to a file, or of each of its frames to a file with the frame's number.

    what  describes what was drawn, for the line that is printed

    Raises ValueError for a name without a number where there are many frames, and with one where there is one.
    """
    many, turntable = is_numbered(output), film.turntable
    check_stream(view.look, many and loaded.plays)
    if turntable is None and many and not loaded.plays:
        raise ValueError(f"{output} is a name for many files, but INPUT is a single frame: leave out the number")
    if turntable is not None and not many:
        raise ValueError(f"many files need a number in the name, such as %04d{output.suffix}, got {output}")
    with open_renderer(device, output) as renderer:
        start = time.perf_counter()
        if many:
            jobs, count = jobs_of(loaded.source, view, turntable, film.frames, warn_skipped, renderer)
            with progress(count) as advance:
                count, first = write_numbered(jobs, partial(draw, renderer), save, output, Count(advance, count))
            spent = time.perf_counter() - start
            text = f"{count} files, the first of {what(first)}"
        else:
            with spinner("rendering"):
                made = draw(renderer, RenderRequest.seen(loaded.frames or loaded.source, view))
                spent = time.perf_counter() - start
                save(output, made)
            text = what(made)
        report(output, text, renderer, spent)
