"""Layouts whose files look like something else: poses of objects, lenses in millimetres, pictures that are none."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .objects import _labels
from .room import SMALL, Expected, Pinhole, Room, without_camera
from .writing import as_json, depth16, exr, picture, rows, text


def ycb_in_eoat(folder: Path, room: Room) -> Expected:
    """YCBInEOAT (Wen 2020): rgb/, depth/, cam_K.txt, and annotated_poses/*.txt, which are of the object."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        name = f"{1581120424100262102 + 33366912 * k}"
        picture(folder / f"rgb/{name}.png", view.color)
        depth16(folder / f"depth/{name}.png", view.depth)
        _labels(folder / f"gt_mask/{name}.png", view.depth.shape)
        pose = np.eye(4)
        pose[:3, 3] = 0.05 + 0.1 * k, -0.02, 0.8
        text(folder / f"annotated_poses/{name}.txt", *rows(pose))
    text(folder / "cam_K.txt", *rows(SMALL.matrix, "%.18e"))
    return Expected(folder, SMALL, views, poses=False)


def realsense_repr(folder: Path, room: Room) -> Expected:
    """str() of pyrealsense2's intrinsics, as scripts save it: `[ 320x240  p[x y]  f[fx fy]  Brown Conrady [0 0] ]`."""
    view = room.through(SMALL, 1)[0]
    picture(folder / "color.png", view.color)
    depth16(folder / "depth.png", view.depth)
    values = f"p[{SMALL.cx} {SMALL.cy}]  f[{SMALL.fx} {SMALL.fy}]"
    text(folder / "intrinsics.txt", f"[ 320x240  {values}  Inverse Brown Conrady [0 0 0 0 0] ]")
    return Expected(folder, SMALL, [view], poses=False)


def kubric(folder: Path, room: Room) -> Expected:
    """Kubric (Greff 2022): rgba_00000.png, depth_00000.tiff, metadata.json with a lens in millimetres."""
    camera = Pinhole(280, 280, 127.5, 127.5, 256, 256)
    views = room.through(camera)
    from PIL import Image

    for k, view in enumerate(views):
        picture(folder / f"rgba_{k:05d}.png", np.dstack([view.color, np.full(view.depth.shape, 255, np.uint8)]))
        Image.fromarray(view.depth).save(folder / f"depth_{k:05d}.tiff")
        _labels(folder / f"segmentation_{k:05d}.png", view.depth.shape)
        picture(folder / f"object_coordinates_{k:05d}.png", np.full((256, 256, 3), (20, 90, 200), np.uint8))
    k_matrix = [[1.09375, 0.0, -0.5], [0.0, -1.09375, -0.5], [0.0, 0.0, -1.0]]
    lens = {"focal_length": 35.0, "sensor_width": 32.0, "field_of_view": 0.857, "K": k_matrix}
    lens |= {"positions": [[7.4, -3.2, 2.5]] * 3, "quaternions": [[0.8, 0.4, 0.2, 0.3]] * 3}
    as_json(folder / "metadata.json", {"camera": lens, "metadata": {"resolution": [256, 256], "num_frames": 3}})
    return Expected(folder, camera, views, poses=False)


def void(folder: Path, room: Room) -> Expected:
    """VOID (Wong 2020): image/, ground_truth/ and sparse_depth/ (256 a metre), validity_map/, absolute_pose/, K.txt."""
    views = room.through(SMALL)
    scattered = np.random.default_rng(2).random(views[0].depth.shape) < 0.005
    for k, view in enumerate(views):
        name = f"{1552625426.1 + 0.7 * k:.4f}"
        picture(folder / f"image/{name}.png", view.color)
        depth16(folder / f"ground_truth/{name}.png", view.depth, 256)
        depth16(folder / f"sparse_depth/{name}.png", np.where(scattered, view.depth, 0), 256)
        picture(folder / f"validity_map/{name}.png", (scattered * 255).astype(np.uint8))
        text(folder / f"absolute_pose/{name}.txt", *rows(view.pose[:3]))
    text(folder / "K.txt", *rows(SMALL.matrix, "%.18e"))
    given = {"or_says": "depth.scale", "then": {"depth_scale": 256}}
    return Expected(folder, SMALL, views, metres=0.005, **given)


def active_vision(folder: Path, room: Room) -> Expected:
    """Active Vision (Ammirato 2017): jpg_rgb/000110000010101.jpg, high_res_depth/000110000010103.png, cameras.txt."""
    views = room.through(SMALL)
    for k, view in enumerate(views, 1):
        picture(folder / f"jpg_rgb/0001100000{k}0101.jpg", view.color)
        depth16(folder / f"high_res_depth/0001100000{k}0103.png", view.depth)
    camera = f"1 OPENCV 320 240 {SMALL.fx} {SMALL.fy} {SMALL.cx + 0.5} {SMALL.cy + 0.5} 0.03 0.01 0.001 -0.001"
    text(folder / "cameras.txt", "# Camera list with one line of data per camera:", camera)
    return Expected(folder, SMALL, views, poses=False)


def clear_grasp_real(folder: Path, room: Room) -> Expected:
    """ClearGrasp's real pictures: -transparent-rgb-img.jpg, -opaque-rgb-img.jpg, two depths in EXR, -mask.png."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        stem = str(folder / f"{k:09d}")
        picture(Path(f"{stem}-transparent-rgb-img.jpg"), view.color)
        picture(Path(f"{stem}-opaque-rgb-img.jpg"), view.color)
        for kind in ("transparent", "opaque"):
            exr(Path(f"{stem}-{kind}-depth-img.exr"), R=view.depth, G=view.depth, B=view.depth)
        ones = np.ones_like(view.depth)
        exr(Path(f"{stem}-normals.exr"), R=0 * ones, G=0 * ones, B=ones)
        _labels(Path(f"{stem}-mask.png"), view.depth.shape)
    return Expected(folder, SMALL, views, poses=False, **without_camera(SMALL))


def eth3d_mvs(folder: Path, room: Room) -> Expected:
    """ETH3D's high-resolution sets: ground_truth_depth/ holds bare floats in files called .JPG, inf is missing."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        name = f"DSC_{259 + k:04d}"
        picture(folder / f"images/dslr_images/{name}.jpg", view.color)
        (folder / f"images/dslr_images/{name}.jpg").rename(folder / f"images/dslr_images/{name}.JPG")
        path = folder / f"ground_truth_depth/dslr_images/{name}.JPG"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(np.where(view.depth > 0, view.depth, np.inf).astype("<f4").tobytes())
    camera = f"0 PINHOLE 320 240 {SMALL.fx} {SMALL.fy} {SMALL.cx + 0.5} {SMALL.cy + 0.5}"
    text(folder / "dslr_calibration_undistorted/cameras.txt", camera)
    return Expected(folder, SMALL, views, poses=False)


def habitat_scene(folder: Path, room: Room) -> Expected:
    """Habitat's exports for mapping (VLMaps): rgb/0.png, depth/0.npy, semantic/0.npy, pose/0.txt; no camera."""
    from .writing import numbers, quaternion

    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"rgb/{k}.png", view.color)
        for name, array in (("depth", view.depth), ("semantic", np.full(view.depth.shape, 3, np.int32))):
            (folder / name).mkdir(exist_ok=True)
            np.save(folder / f"{name}/{k}.npy", array)
        text(folder / f"pose/{k}.txt", numbers([*view.pose[:3, 3], *quaternion(view.pose)], "%.6f", "\t"))
    return Expected(folder, SMALL, views, **without_camera(SMALL))


MAKERS = (
    ycb_in_eoat,
    realsense_repr,
    kubric,
    void,
    active_vision,
    clear_grasp_real,
    eth3d_mvs,
    habitat_scene,
)
