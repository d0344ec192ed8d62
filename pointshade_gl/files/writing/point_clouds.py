"""Writes point clouds as .ply files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...messages.validation import check_path, check_type
from ...scene.point_cloud import PointCloud
from ..access.atomic_write import check_place, written_whole
from ..access.content import FilePath
from ..access.written_suffixes import POINTS, check_suffix
from ..arrays.ply import write_ply

FAR = 1000.0  # sizes of a cloud from the world's origin: beyond, float32 would move its points visibly


def check_points_path(path: FilePath) -> Path:
    """The path, for a check before long work. Raises ValueError or OSError if `save_points` cannot write there."""
    path = check_path(path)
    check_suffix(path, POINTS, "the suffix of a point cloud")
    return check_place(path)


def save_points(path: FilePath, cloud: PointCloud) -> None:
    """Write a point cloud as binary little-endian PLY, completely or not at all.

    Parameters
    ----------
    path : path
        The file, .ply.
    cloud : PointCloud
        Its points become vertices with x y z (float; double where the world's origin is far away), nx ny nz (float) and
        red green blue (uchar): the names that MeshLab, CloudCompare, Blender and Open3D know.

    Raises
    ------
    ValueError
        For another suffix.
    TypeError
        For anything but a PointCloud.
    OSError
        If the folder does not exist.
    """
    path = check_points_path(path)
    check_type(cloud, PointCloud, "cloud")
    with written_whole(path) as temporary, temporary.open("xb") as file:
        write_ply(file, {"vertex": _vertices(cloud)})


def _vertices(cloud: PointCloud) -> np.ndarray:
    """(n,) structured, a field for each property."""
    at = cloud.positions + cloud.origin
    is_far = bool(at.size) and np.abs(at).max() > FAR * np.ptp(at, 0).max()
    kinds = {"positions": "<f8" if is_far else "<f4", "normals": "<f4", "colors": "u1"}
    names = {"positions": "x y z", "normals": "nx ny nz", "colors": "red green blue"}
    columns = [(name, kinds[key], key, k) for key in names for k, name in enumerate(names[key].split())]
    vertices = np.empty(len(cloud), [(name, kind) for name, kind, _, _ in columns])
    for name, _, key, k in columns:
        vertices[name] = getattr(cloud, key)[:, k]
    return vertices
