"""Layouts of sets for the pose of objects and for grasping."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .room import SMALL, Expected, Pinhole, Room, without_camera
from .writing import as_json, depth16, exr, picture


def _labels(path: Path, shape: tuple[int, ...]) -> None:
    """A picture of class numbers."""
    labels = np.zeros(shape, np.uint8)
    labels[40:90, 60:120] = 5
    picture(path, labels)


def ycb_video(folder: Path, room: Room) -> Expected:
    """YCB-Video (Xiang 2018): 000001-color.png, -depth.png, -label.png, -meta.mat (factor_depth, world-to-camera)."""
    from scipy.io import savemat

    folder = folder / "0001"
    views = room.through(SMALL)
    for k, view in enumerate(views, 1):
        stem = folder / f"{k:06d}"
        picture(Path(f"{stem}-color.png"), view.color)
        depth16(Path(f"{stem}-depth.png"), view.depth, 10000)
        _labels(Path(f"{stem}-label.png"), view.depth.shape)
        Path(f"{stem}-box.txt").write_text("002_master_chef_can 60 40 120 90\n")
        meta = {"cls_indexes": np.array([[1], [5]], np.uint8), "factor_depth": np.array([[10000]], np.uint16)}
        meta |= {"intrinsic_matrix": SMALL.matrix, "vertmap": np.zeros((4, 4, 3), np.float32)}
        savemat(f"{stem}-meta.mat", {**meta, "rotation_translation_matrix": np.linalg.inv(view.pose)[:3]})
    return Expected(folder, SMALL, views)


def graspnet(folder: Path, room: Room) -> Expected:
    """GraspNet-1Billion (Fang 2020): rgb/, depth/, label/, meta/*.mat, camK.npy, camera_poses.npy (from the first)."""
    from scipy.io import savemat

    folder = folder / "scene_0000/realsense"
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"rgb/{k:04d}.png", view.color)
        depth16(folder / f"depth/{k:04d}.png", view.depth)
        _labels(folder / f"label/{k:04d}.png", view.depth.shape)
        (folder / "meta").mkdir(exist_ok=True)
        factor = np.array([[1000]], np.uint16)
        savemat(folder / f"meta/{k:04d}.mat", {"intrinsic_matrix": SMALL.matrix, "factor_depth": factor})
    np.save(folder / "camK.npy", SMALL.matrix)
    np.save(folder / "camera_poses.npy", np.array([np.linalg.inv(views[0].pose) @ view.pose for view in views]))
    np.save(folder / "cam0_wrt_table.npy", views[0].pose)
    return Expected(folder, SMALL, views)


def _bop(folder: Path, room: Room, unit: float) -> Expected:
    """unit: millimetres a raw unit."""
    sensor = Pinhole(572.4114, 573.57043, 325.2611, 242.04899, 640, 480)  # of camera.json: for simulation only
    shape = {name: getattr(sensor, name) for name in ("fx", "fy", "cx", "cy", "width", "height")}
    as_json(folder / "camera.json", {**shape, "depth_scale": 1.0})
    scene = folder / "test/000002"
    views, cameras = room.through(SMALL), {}
    for k, view in enumerate(views):
        picture(scene / f"rgb/{k:06d}.png", view.color)
        depth16(scene / f"depth/{k:06d}.png", view.depth, 1000 / unit)
        for kind in ("mask", "mask_visib"):
            _labels(scene / f"{kind}/{k:06d}_000000.png", view.depth.shape)
        inverse = np.linalg.inv(view.pose)
        turn, place = inverse[:3, :3].reshape(-1).tolist(), (1000 * inverse[:3, 3]).tolist()
        values = {"cam_K": SMALL.matrix.reshape(-1).tolist(), "cam_R_w2c": turn, "cam_t_w2c": place}
        cameras[str(k)] = {**values, "depth_scale": unit}
    as_json(scene / "scene_camera.json", cameras)
    pose = {"cam_R_m2c": np.eye(3).reshape(-1).tolist(), "cam_t_m2c": [0.0, 0.0, 800.0], "obj_id": 5}
    as_json(scene / "scene_gt.json", {str(k): [pose] for k in range(3)})
    return Expected(scene, SMALL, views)


def bop(folder: Path, room: Room) -> Expected:
    """BOP format (Hodan 2018): scene_camera.json has K each, depth_scale in millimetres a unit (0.1), poses in mm."""
    return _bop(folder, room, 0.1)


def bop_millimetres(folder: Path, room: Room) -> Expected:
    """The same with depth_scale 1.0, as LM-O has it."""
    return _bop(folder, room, 1.0)


def cleargrasp(folder: Path, room: Room) -> Expected:
    """ClearGrasp (Sajjan 2020), synthetic: rgb-imgs/000000000-rgb.jpg, depth-imgs-rectified/*.exr, normals beside."""
    camera = Pinhole(262.5, 262.5, 159.5, 119.5, 320, 240)
    views = room.through(camera)
    for k, view in enumerate(views):
        picture(folder / f"rgb-imgs/{k:09d}-rgb.jpg", view.color)
        exr(folder / f"depth-imgs-rectified/{k:09d}-depth-rectified.exr", R=view.depth, G=view.depth, B=view.depth)
        ones = np.ones_like(view.depth)
        exr(folder / f"camera-normals/{k:09d}-cameraNormals.exr", R=0 * ones, G=0 * ones, B=ones)
        _labels(folder / f"segmentation-masks/{k:09d}-segmentation-mask.png", view.depth.shape)
        as_json(folder / f"json-files/{k:09d}-masks.json", {"camera": {"field_of_view": {"x_axis_rads": 1.2}}})
    return Expected(folder, camera, views, poses=False, **without_camera(camera))


MAKERS = (ycb_video, graspnet, bop, bop_millimetres, cleargrasp)
