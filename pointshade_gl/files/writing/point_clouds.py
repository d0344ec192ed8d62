"""Writes point clouds as .ply files."""

from __future__ import annotations

from pathlib import Path

from ...messages.validation import check_path, check_type
from ...scene.point_cloud import PointCloud
from ..access.atomic_write import check_place, written_whole
from ..access.content import FilePath
from ..access.written_suffixes import POINTS, check_suffix
from ..arrays.ply import write_ply
from ..clouds.ply_points import VERTEX, comments_of, vertices_of


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
        red green blue (uchar): the names that MeshLab, CloudCompare, Blender and Open3D know; of what it has also
        radius and confidence. Comments say which axis points up, and the origin: `load_cloud` gives the same cloud.

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
        write_ply(file, {VERTEX: vertices_of(cloud)}, comments_of(cloud))
