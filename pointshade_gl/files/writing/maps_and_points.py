"""Writes depth maps, normal maps, point clouds (.ply, .glb, .gltf), and the poses of frames."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import check_choice, check_count, check_path, check_type, depth_as_given, items_of
from ...checks.foreign_arrays import AnyArray, way_to
from ...notes.notes import Note, print_note
from ...notes.words import option, shown
from ...scene.camera import quaternion_of
from ...scene.cloud import CLOUD_AXES, CloudAxes, PointCloud, turned
from ...scene.frame import Frame
from ...scene.graph import Scene, scene_of
from ...scene.node import Node
from ...scene.passes import Passes
from ..access import known_names as names
from ..access.atomic_write import check_place, written_whole
from ..access.content import IN_JSON, FilePath
from ..arrays.ply_and_pcd import write_ply
from ..cameras.pose_files import WRITTEN
from ..clouds.cloud_arrays import VERTEX, comments_of, vertices_of
from ..pictures.hdr_files import check_exr, write_exr
from ..pictures.picture_files import AXES, AxesName, normals_to_rgb, save_image, turned_normals, write_by_pillow


def check_depth_path(path: FilePath) -> Path:
    """The path, for a check before long work. Raises ValueError or OSError if `save_depth` cannot write there."""
    return _check_map(names.check_suffix(path, names.DEPTH_MAPS, "the suffix of depth"))


def save_depth(path: FilePath, depth: AnyArray, notes: Note = print_note) -> None:
    """Write depth completely or not at all: metres as floats, or millimetres in a .png of 16 bits; missing is 0.

    Parameters
    ----------
    path : path
        .exr gets the channel Z, as Nuke's depth.Z, and the same as Y, grey, for Blender and OpenCV; .tif and .tiff
        float pixels, .npy float32. A .png holds 1 mm to 65.535 m: other values are written as missing, and a note
        counts them.
    depth : (h, w) float
        Metres; 0, negative, NaN, infinite and masked mean missing.
    notes : callable
        Called with that note; the default prints it to stderr.

    Raises
    ------
    ValueError
        For another suffix or shape, for .exr without the extra `exr`, and if nothing fits into a .png.
    TypeError
        For values that are not floating point.
    OSError
        If the folder does not exist.
    """
    path = check_depth_path(path)
    metres = _known_depth(depth)
    if path.suffix.lower() == ".exr":
        with written_whole(path) as temporary:
            write_exr(temporary, {"Z": metres, "Y": metres})  # Z is depth's name, but Blender and OpenCV look for grey
    elif path.suffix.lower() == ".png":
        save_image(path, _millimetres(metres, path, notes))
    elif path.suffix.lower() == ".npy":
        save_image(path, metres)
    else:
        from PIL import Image

        with written_whole(path) as temporary, temporary.open("xb") as file:
            write_by_pillow(file, Image.fromarray(metres), "TIFF")


def _known_depth(depth: AnyArray) -> NDArray[np.float32]:
    array = depth_as_given(depth)
    if array.ndim != 2 or 0 in array.shape:
        raise ValueError(f"depth must have shape (h, w), got {array.shape}{way_to(array.shape, 'depth', depth)}")
    if array.dtype.kind != "f":
        raise TypeError(f"depth must be floating point metres, got {array.dtype}")
    with np.errstate(over="ignore"):
        metres = array.astype(np.float32)
    metres[~((metres > 0) & (metres < np.inf))] = 0
    return metres


def _millimetres(metres: NDArray[np.float32], path: Path, notes: Note) -> NDArray[np.uint16]:
    rounded = np.rint(metres * np.float64(1000))
    fits = (rounded >= 1) & (rounded <= 65535)
    known = np.count_nonzero(metres)
    lost = known - np.count_nonzero(fits)
    if lost and lost == known:
        raise ValueError(f"cannot write {path}: no depth lies within 1 mm to 65.535 m, use .exr, .tif or .npy")
    if lost:
        limits = "outside 1 mm to 65.535 m, which 16 bits hold"
        notes(f"{path}: {lost} of {known} depths are {limits}, and become missing: .exr, .tif and .npy keep them")
    return np.where(fits, rounded, 0).astype(np.uint16)


def check_normals_path(path: FilePath, axes: str | None = None, bits: int = 8) -> Path:
    """The path, for a check before long work. Raises ValueError or OSError if `save_normals` cannot write there."""
    path = check_path(path)
    if axes is not None:
        check_choice(option("axes"), axes, tuple(AXES))
    if bits not in (8, 16):
        raise ValueError(f"{option('bits')} must be 8 or 16, got {bits}")
    if bits == 16 and path.suffix.lower() != ".png":
        raise ValueError(f"cannot write {path}: {option('bits', 16)} needs .png; .exr and .npy hold floats")
    return _check_map(names.check_suffix(path, names.NORMALS))


def save_normals(path: FilePath, normals: AnyArray, axes: AxesName | None = None, bits: Literal[8, 16] = 8) -> None:
    """Write normals completely or not at all: floats to .npy and .exr, colours to pictures.

    Parameters
    ----------
    path : path
        Its suffix chooses the format: .npy, .exr, .png, .jpg, .jpeg, .webp, .tif or .tiff.
    normals : (h, w, 3) float
        Unit vectors, camera axes; NaN where missing. Alpha is 0 there in pictures and in the RGBA channels of .exr.
    axes : {"opencv", "opengl", "directx"}, optional
        "opencv": the camera's own, x right, y down, z forward. "opengl": green up, blue towards the viewer, as in
        Blender and most normal maps. "directx": green down, blue towards the viewer. The default is "opencv" for .npy
        and "opengl" otherwise.
    bits : {8, 16}
        16 only for .png.

    Raises
    ------
    ValueError
        For unknown axes, for another shape, for a suffix that names no format or has not so many bits, and for .exr
        without the extra `exr`.
    TypeError
        For values that are not floating point.
    OSError
        If the folder does not exist.
    """
    path = check_normals_path(path, axes, bits)
    suffix = path.suffix.lower()
    axes = axes or ("opencv" if suffix == ".npy" else "opengl")
    if suffix not in (".npy", ".exr"):
        save_image(path, normals_to_rgb(normals, axes, bits))
        return
    turned, known = turned_normals(normals, axes)
    if suffix == ".npy":
        save_image(path, np.where(known[..., None], turned, np.float32(np.nan)))
        return
    with written_whole(path) as temporary:
        write_exr(temporary, {"RGBA": np.concatenate([turned, known[..., None]], -1)})


def _check_map(path: Path) -> Path:
    if path.suffix.lower() == ".exr":
        check_exr(path)
    return check_place(path)


ROOT = {"beauty": "RGBA", "depth": "Z"}  # what lies at the root of a file
LETTERS = {**ROOT, **dict.fromkeys(("normal", "normal_world", "position"), "XYZ")}  # others: RGB, single numbers X
EXACT = "depth", "position", "object_id"  # 32 bits; the others have 16
MOST_HALF = 65504.0


def check_passes_path(path: FilePath) -> Path:
    """The path, for a check before long work. Raises ValueError or OSError if `save_passes` cannot write there."""
    return _check_map(names.check_suffix(path, names.LAYERED, "the suffix of passes"))


def save_passes(path: FilePath, passes: Passes) -> None:
    """Write the layers of a picture to one multilayer OpenEXR file, completely or not at all.

    The beauty has the channels R, G, B and A, depth the channel Z; all others are named LAYER.CHANNEL, as in Nuke:
    light_1.R, normal.X, and for single numbers ao.X. Depth, positions and object_id are 32-bit floats, all others half
    floats. Missing values are 0. As in `save_normals`, `normal` is x right, y up, z towards the viewer; `normal_world`
    and `position` keep the world's axes.

    The header has `worldToCamera` as OpenEXR defines it (row vectors; x right, y up, z forward), `screenWindowWidth`
    and `screenWindowCenter`, `cameraIntrinsics`, a matrix of 3x3 as in OpenCV, and `objects`, the names that object_id
    counts, as JSON.

    Parameters
    ----------
    path : path
        The file, .exr.
    passes : Passes
        What `render_passes` returns.

    Raises
    ------
    ValueError
        For another suffix, and without the extra `exr`.
    TypeError
        For anything but Passes.
    OSError
        If the folder does not exist.
    """
    path, channels = check_passes_path(path), dict[str, NDArray[np.floating]]()
    camera = check_type(passes, Passes, "passes").camera
    up = -float(np.sign(camera.fy))  # which way y points in the picture
    for layer, values in passes.items():
        known = np.nan_to_num(values)
        if layer == "normal":
            known = known * np.array([1, up, -1], np.float32)
        if layer not in EXACT:
            known = known.clip(-MOST_HALF, MOST_HALF).astype(np.float16)
        planes = known[..., None] if known.ndim == 2 else known
        letters = LETTERS.get(layer, "X" if known.ndim == 2 else "RGBA")
        before = "" if layer in ROOT else f"{layer}."
        channels |= {
            f"{before}{letter}": planes[..., k] for k, letter in zip(range(planes.shape[-1]), letters, strict=False)
        }
    to_camera = np.linalg.inv(passes.pose @ np.diag([1, up, 1, 1]))
    corner = camera.ray_at(-0.5, -0.5), camera.ray_at(camera.width - 0.5, camera.height - 0.5)
    (left, top), (right, bottom) = corner
    header = {
        "worldToCamera": to_camera.T.astype(np.float32),
        "screenWindowWidth": float(right - left),
        "screenWindowCenter": np.array([left + right, up * (top + bottom)], np.float32) / 2,
        "cameraIntrinsics": np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]], np.float32),
        "objects": json.dumps(passes.objects),
    }
    with written_whole(path) as temporary:
        write_exr(temporary, channels, header)


def check_points_path(path: FilePath, axes: str | None = None) -> Path:
    """The path, for a check before long work. Raises ValueError or OSError if `save_points` cannot write there."""
    path = names.check_suffix(path, names.POINTS, "the suffix of a point cloud")
    if axes is not None:
        check_choice(option("axes"), axes, tuple(CLOUD_AXES))
        if path.suffix.lower() in names.SCENE_SUFFIXES:
            raise ValueError(f"{path} has the axes of glTF, y up: leave out {option('axes')}")
    return check_place(path)


def save_points(path: FilePath, cloud: PointCloud, axes: CloudAxes | None = None) -> None:
    """Write a point cloud as binary little-endian PLY or as glTF, completely or not at all.

    Parameters
    ----------
    path : path
        The file, .ply, .glb or .gltf. In glTF up is y, and the colours are shown without light.
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
        For another suffix, for unknown axes, and for axes of glTF.
    TypeError
        For anything but a PointCloud.
    OSError
        If the folder does not exist.
    """
    path = check_points_path(path, axes)
    check_type(cloud, PointCloud, "cloud")
    if path.suffix.lower() in names.SCENE_SUFFIXES:
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


_HEADER = f"{WRITTEN} tx ty tz qx qy qz qw: camera-to-world, axes of OpenCV (x right, y down, z forward), metres\n"


def check_poses_path(path: FilePath) -> Path:
    """The path, for a check before long work. Raises ValueError or OSError if `save_poses` cannot write there."""
    return check_place(names.check_suffix(path, names.POSE_LISTS, "the suffix of poses"))


def save_poses(path: FilePath, frames: Iterable[Frame], numbers: Sequence[int] | None = None) -> None:
    """Write the poses of frames as a text in the form of the TUM benchmark, completely or not at all.

    Each frame has a line `number tx ty tz qx qy qz qw`: the camera's place in metres and its turn as a quaternion,
    camera-to-world, in the axes of OpenCV. `load_frame` and `open_source` read it as `poses`, and the command line as
    --poses.

    Parameters
    ----------
    path : path
        The file, .txt.
    frames : iterable of Frame
        Such as `align_frames` returns.
    numbers : sequence of int, optional
        Of the frames in their folder, counted from 0, if they are only some of it. The default is their order.

    Raises
    ------
    ValueError
        For another suffix, no frames, or another count of numbers than of frames.
    TypeError
        For anything but frames.
    OSError
        If the folder does not exist.
    """
    path, found = check_poses_path(path), items_of(frames)
    if found is None:
        raise TypeError(f"frames must be an iterable of frames, got {shown(frames)}")
    poses = [check_type(frame, Frame, f"frame {k}").pose for k, frame in enumerate(found)]
    stamps = range(len(poses)) if numbers is None else [check_count(one, "each number") for one in numbers]
    if len(set(stamps)) < len(stamps):
        raise ValueError(f"each frame needs a number of its own, got {shown(list(stamps))}")
    if not poses or len(stamps) != len(poses):
        raise ValueError(f"poses need one frame or more, and a number for each, got {len(poses)} and {len(stamps)}")
    save_numbered_poses(path, dict(zip(stamps, poses, strict=True)))


def save_numbered_poses(path: Path, poses: Mapping[int, NDArray[np.float64]]) -> None:
    """Write poses (4, 4) as `save_poses` does, by the numbers of their frames."""
    text = _HEADER
    for number, pose in poses.items():
        values = " ".join(f"{value:.17g}" for value in (*pose[:3, 3], *quaternion_of(pose[:3, :3])))
        text += f"{number} {values}\n"
    _write(path, text)


def check_found_path(path: Path) -> Path:
    """The path, for a check before long work. Raises ValueError or OSError if `save_found_poses` cannot write there."""
    return check_place(names.check_suffix(path, names.FOUND_POSES, "the suffix of poses"))


def save_found_poses(path: Path, poses: Mapping[str, NDArray[np.float64] | None]) -> None:
    """Write poses (4, 4), camera-to-world in OpenCV's axes and metres, completely or not at all; None is left out.
    .json is `{"name": [[...], ...], ...}`, .txt as `save_poses` writes it."""
    known = [(k, name, pose) for k, (name, pose) in enumerate(poses.items()) if pose is not None]
    if path.suffix.lower() == ".json":
        rows = (f" {json.dumps(name, ensure_ascii=False)}: {json.dumps(pose.tolist())}" for _, name, pose in known)
        _write(path, "{\n" + ",\n".join(rows) + "\n}\n")
    else:
        save_numbered_poses(path, {k: pose for k, _, pose in known})


def _write(path: Path, text: str) -> None:
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8", errors=IN_JSON)
