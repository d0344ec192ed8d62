"""Writes point clouds as .ply and .glb files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...checks.arguments import check_choice, check_path, check_type
from ...notes.words import option
from ...scene.cloud import CLOUD_AXES, CloudAxes, PointCloud, turned
from ...scene.graph import Scene, scene_of
from ...scene.node import Node
from ..access.atomic_write import check_place, written_whole
from ..access.content import FilePath
from ..access.written_suffixes import POINTS, check_suffix
from ..arrays.ply import write_ply
from ..clouds.ply_points import VERTEX, comments_of, vertices_of


def check_points_path(path: FilePath, axes: str | None = None) -> Path:
    """The path, for a check before long work. Raises ValueError or OSError if `save_points` cannot write there."""
    path = check_path(path)
    check_suffix(path, POINTS, "the suffix of a point cloud")
    if axes is not None:
        check_choice(option("axes"), axes, tuple(CLOUD_AXES))
        if path.suffix.lower() == ".glb":
            raise ValueError(f"{path} has the axes of glTF, y up: leave out {option('axes')}")
    return check_place(path)


def save_points(path: FilePath, cloud: PointCloud, axes: CloudAxes | None = None) -> None:
    """Write a point cloud as binary little-endian PLY or as GLB, completely or not at all.

    Parameters
    ----------
    path : path
        The file, .ply or .glb. In a .glb up is y, as glTF has it, and the colours are shown without light.
    cloud : PointCloud
        In a .ply its points become vertices with x y z (float; double where the world's origin is far away), nx ny nz
        (float) and red green blue (uchar): the names that MeshLab, CloudCompare, Blender and Open3D know; of what it
        has also radius and confidence. Comments say what the axes are, and the origin, for `load_cloud` and for people.
    axes : {"opencv", "opengl", "blender"}, optional
        Of a .ply. "opencv": x right, y down, z away from the viewer. "opengl": y up, z towards the viewer, as in
        MeshLab. "blender": z up, y away from the viewer. All that lies or points somewhere is turned. The default is
        "opengl" for the points of frames, whose `front` is -z; other clouds stay in their own axes.

    Raises
    ------
    ValueError
        For another suffix, for unknown axes, and for axes of a .glb.
    TypeError
        For anything but a PointCloud.
    OSError
        If the folder does not exist.
    """
    path = check_points_path(path, axes)
    check_type(cloud, PointCloud, "cloud")
    if path.suffix.lower() == ".glb":
        from ..gltf import save_scene

        save_scene(path, _shown_upright(cloud, path.stem))
        return
    if axes is None and cloud.up == "-y" and cloud.front == "-z":
        axes = "opengl"
    cloud = turned(cloud, axes) if axes else cloud
    with written_whole(path) as temporary, temporary.open("xb") as file:
        write_ply(file, {VERTEX: vertices_of(cloud)}, comments_of(cloud))


def _shown_upright(cloud: PointCloud, name: str) -> Scene:
    """A scene whose y is the cloud's up, with the camera that sees the cloud alone; its colours are its own."""
    up, turn = cloud.up_direction, np.eye(4)
    side = np.array([0.0, 1.0, 0.0]) if up[0] else np.array([1.0, 0.0, 0.0])
    turn[:3, :3] = side, up, np.cross(side, up)
    alone = scene_of(cloud)
    return Scene((Node(replace(cloud, shading="none"), name, turn),), alone.camera, turn @ alone.pose)
