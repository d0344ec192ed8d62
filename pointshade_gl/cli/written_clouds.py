"""What `normals` and `render -o points.ply` write of a point cloud: its points with normals, or the normals alone."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

from ..files.access.known_names import CLOUD_NORMALS, POINTS, check_suffix
from ..files.pictures.picture_files import check_writable, save_image
from ..files.writing.maps_and_points import check_points_path, save_points
from ..notes.words import counted, option
from ..scene.appearance import Look
from ..scene.cloud import PointCloud
from ..scene.graph import given_by
from .look_options import NormalOptions
from .option_groups import FieldOptions
from .output import open_renderer, report, spinner


def check_cloud_output(output: Path, axes: str | None) -> None:
    """Raises ValueError or OSError unless the normals of a point cloud can be written there."""
    check_suffix(output, CLOUD_NORMALS, "the suffix of a point cloud's normals")
    if output.suffix.lower() in POINTS:
        check_points_path(output, axes)
        return
    if axes is not None:
        raise ValueError(f"{option('axes')} turns the points of a .ply, {output} holds normals alone: leave it out")
    check_writable(output)


def check_unlit(output: Path, *groups: FieldOptions) -> None:
    """Raises ValueError for options of pictures, which do not change the points of a cloud."""
    given = [name for group in groups for name in group.changed if name != "noise"]
    if given:
        fact = f"{output} holds the points of a cloud in their own colours"
        raise ValueError(f"{fact}, without light: leave out {', '.join(map(option, given))}")


def write_cloud(cloud: PointCloud, look: Look, output: Path, axes: Any, device: int) -> None:
    """Writes a cloud with normals to a .ply, or the normals, (n, 3), to an .npy.

    look  its noise is what the normals are estimated with. Raises ValueError for other options of normals.
    """
    noise = look.noise
    if not isinstance(noise, float | None):
        raise ValueError(f"{option('noise')} of a point cloud is one number of world units, got {noise}")
    if others := [name for name in given_by(look, NormalOptions().look()) if name != "noise"]:
        raise ValueError(f"{', '.join(map(option, others))} is for frames: of a point cloud leave it out")
    with open_renderer(device, output) as renderer:
        start = time.perf_counter()
        with spinner("estimating normals"):
            made = renderer.with_normals(cloud, noise=noise)
            spent = time.perf_counter() - start
            _save(output, made, axes)
        report(output, _what(made), renderer, spent)


def _save(output: Path, cloud: PointCloud, axes: Any) -> None:
    if output.suffix.lower() in POINTS:
        save_points(output, cloud, axes)
        return
    assert cloud.normals is not None
    save_image(output, np.where(cloud.normals.any(1, keepdims=True), cloud.normals, np.float32(np.nan)))


def _what(cloud: PointCloud) -> str:
    known = 0 if cloud.normals is None else int(np.count_nonzero(cloud.normals.any(1)))
    return counted(len(cloud), "point") + f", {counted(known, 'normal')}"
