"""More layouts of sets for hands, objects and grasping."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .objects import _labels
from .room import SMALL, Expected, Pinhole, Room, without_camera
from .writing import as_json, depth16, numbers, picture, rows, text


def nocs_real(folder: Path, room: Room) -> Expected:
    """NOCS' Real275 (Wang 2019): 0000_color.png, _depth.png (mm), _coord.png, _mask.png, _meta.txt; no camera."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"{k:04d}_color.png", view.color)
        depth16(folder / f"{k:04d}_depth.png", view.depth)
        picture(folder / f"{k:04d}_coord.png", np.full((240, 320, 4), (90, 200, 30, 255), np.uint8))
        _labels(folder / f"{k:04d}_mask.png", view.depth.shape)
        text(folder / f"{k:04d}_meta.txt", "1 5 laptop_air_xin_norm", "2 6 mug_daniel_norm")
    return Expected(folder, SMALL, views, poses=False, **without_camera(SMALL))


def _in_channels(path: Path, depth: np.ndarray, scale: float, low: int, high: int) -> None:
    code = np.rint(depth * scale).astype(np.uint16)
    raw = np.zeros((*depth.shape, 3), np.uint8)
    raw[..., low], raw[..., high] = code & 255, code >> 8
    picture(path, raw)


def ho3d(folder: Path, room: Room) -> Expected:
    """HO-3D (Hampali 2020): rgb/0000.jpg, depth/0000.png of R + 256 G, 0.000125 m each, meta/0000.pkl."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"rgb/{k:04d}.jpg", view.color)
        _in_channels(folder / f"depth/{k:04d}.png", view.depth, 8000, 0, 1)
        path = folder / f"meta/{k:04d}.pkl"
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"\x80\x03}q\x00X\x06\x00\x00\x00camMatq\x01.")
    given = without_camera(SMALL, depth_scale=8000)
    return Expected(folder, SMALL, views, poses=False, **given)


def nocs_camera(folder: Path, room: Room) -> Expected:
    """NOCS' CAMERA: 0000_composed.png beside, 16 bits in two channels of 8 (256 G + B), millimetres."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"{k:04d}_color.png", view.color)
        _in_channels(folder / f"{k:04d}_depth.png", view.depth, 1000, 2, 1)
        picture(folder / f"{k:04d}_coord.png", np.full((240, 320, 3), (90, 200, 30), np.uint8))
        _labels(folder / f"{k:04d}_mask.png", view.depth.shape)
        text(folder / f"{k:04d}_meta.txt", "1 1 02876657 d3b53f56b4a7b3b3c9f016d57db96408")
    return Expected(folder, SMALL, views, poses=False, **without_camera(SMALL))


def dex_ycb(folder: Path, room: Room) -> Expected:
    """DexYCB (Chao 2021): <serial>/color_000000.jpg, aligned_depth_to_color_000000.png, labels_000000.npz, meta.yml."""
    views = room.through(SMALL)
    top = folder / "20200709-subject-01/20200709_141754"
    folder = top / "836212060125"
    for k, view in enumerate(views):
        picture(folder / f"color_{k:06d}.jpg", view.color)
        depth16(folder / f"aligned_depth_to_color_{k:06d}.png", view.depth)
        np.savez(folder / f"labels_{k:06d}.npz", seg=np.zeros((240, 320), np.uint8), pose_m=np.zeros((1, 48)))
    text(top / "meta.yml", "serials:", "- '836212060125'", "num_frames: 3", "extrinsics: '20200702_151821'")
    np.savez(top / "pose.npz", pose_y=np.zeros((3, 4, 7)))
    return Expected(folder, SMALL, views, poses=False, **without_camera(SMALL))


def hope_video(folder: Path, room: Room) -> Expected:
    """HOPE-Video (Lin 2021): 0000_rgb.jpg, 0000_depth.png (mm), 0000.json with intrinsics and extrinsics."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"{k:04d}_rgb.jpg", view.color)
        depth16(folder / f"{k:04d}_depth.png", view.depth)
        camera = {"intrinsics": SMALL.matrix.tolist(), "extrinsics": np.linalg.inv(view.pose).tolist()}
        objects = [{"class": "Milk", "pose": np.eye(4).tolist()}]
        as_json(folder / f"{k:04d}.json", {"camera": {**camera, "width": 320, "height": 240}, "objects": objects})
    return Expected(folder, SMALL, views)


def housecat6d(folder: Path, room: Room) -> Expected:
    """HouseCat6D (Jung 2024): rgb/, depth/, depth_gt/, instance/, camera_pose/*.txt, intrinsics.txt."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"rgb/{k:06d}.png", view.color)
        for name in ("depth", "depth_gt"):
            depth16(folder / f"{name}/{k:06d}.png", view.depth)
        _labels(folder / f"instance/{k:06d}.png", view.depth.shape)
        text(folder / f"camera_pose/{k:06d}.txt", *rows(view.pose))
        (folder / "labels").mkdir(exist_ok=True)
        (folder / f"labels/{k:06d}_label.pkl").write_bytes(b"\x80\x03}q\x00.")
    text(folder / "intrinsics.txt", *rows(SMALL.matrix))
    return Expected(folder, SMALL, views)


def hammer(folder: Path, room: Room) -> Expected:
    """HAMMER (Jung 2023): polarization/ with rgb/, depth_d435/, depth_tof/, gt/, pose/, intrinsics.txt."""
    folder = folder / "scene2_traj1_1/polarization"
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"rgb/{k:06d}.png", view.color)
        for name in ("depth_d435", "depth_l515", "depth_tof", "gt"):
            depth16(folder / f"{name}/{k:06d}.png", view.depth)
        _labels(folder / f"instance/{k:06d}.png", view.depth.shape)
        text(folder / f"pose/{k:06d}.txt", *rows(view.pose))
    text(folder / "intrinsics.txt", *rows(SMALL.matrix))
    return Expected(folder, SMALL, views)


def clear_pose(folder: Path, room: Room) -> Expected:
    """ClearPose (Chen 2022): 000000-color.png, -depth.png, -depth_true.png, -label.png, -normal_true.png."""
    from scipy.io import savemat

    views = room.through(SMALL)
    frames = {}
    for k, view in enumerate(views):
        picture(folder / f"{k:06d}-color.png", view.color)
        depth16(folder / f"{k:06d}-depth.png", view.depth)
        depth16(folder / f"{k:06d}-depth_true.png", view.depth)
        _labels(folder / f"{k:06d}-label.png", view.depth.shape)
        picture(folder / f"{k:06d}-normal_true.png", np.full((240, 320, 3), (128, 128, 255), np.uint8))
        factor = np.array([[1000]], np.uint16)
        frames[f"f{k:06d}"] = {"cls_indexes": np.array([[1]]), "factor_depth": factor, "intrinsic_matrix": SMALL.matrix}
    savemat(folder / "metadata.mat", frames)
    return Expected(folder, SMALL, views, poses=False, **without_camera(SMALL))


def linemod(folder: Path, room: Room) -> Expected:
    """LINEMOD (Hinterstoisser 2012): data/color0.jpg, depth0.dpt (rows, columns, 16-bit mm), rot0.rot, tra0.tra."""
    folder = folder / "data"
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"color{k}.jpg", view.color)
        head = np.array([240, 320], "<i4").tobytes()
        (folder / f"depth{k}.dpt").write_bytes(head + np.rint(view.depth * 1000).astype("<u2").tobytes())
        text(folder / f"rot{k}.rot", "3 3", *rows(np.eye(3)))
        text(folder / f"tra{k}.tra", "1 3", "1.0", "2.0", "90.0")
    return Expected(folder, SMALL, views, poses=False, **without_camera(SMALL))


def sixd_info(folder: Path, room: Room) -> Expected:
    """SIXD 2017 and T-LESS v2: rgb/0000.png, depth/0000.png, info.yml of cam_K and depth_scale (mm a value), gt.yml."""
    views, lines = room.through(SMALL), []
    for k, view in enumerate(views):
        picture(folder / f"rgb/{k:04d}.png", view.color)
        depth16(folder / f"depth/{k:04d}.png", view.depth, 10000)
        inverse = np.linalg.inv(view.pose)
        lines += [f"{k}:", f"  cam_K: [{numbers(SMALL.matrix.reshape(-1), '%.8f', ', ')}]"]
        lines += [f"  cam_R_w2c: [{numbers(inverse[:3, :3].reshape(-1), '%.8f', ', ')}]"]
        lines += [f"  cam_t_w2c: [{numbers(1000 * inverse[:3, 3], '%.8f', ', ')}]"]
        lines += ["  depth_scale: 0.1", "  elev: 45", "  mode: 0"]
    text(folder / "info.yml", *lines)
    text(folder / "gt.yml", "0:", "- cam_R_m2c: [1, 0, 0, 0, 1, 0, 0, 0, 1]", "  cam_t_m2c: [0, 0, 600]", "  obj_id: 1")
    return Expected(folder, SMALL, views)


def washington_objects(folder: Path, room: Room) -> Expected:
    """Washington RGB-D Objects (Lai 2011): apple_1_1_1_crop.png, _depthcrop.png, _maskcrop.png, _loc.txt."""
    folder = folder / "apple/apple_1"
    camera = Pinhole(525, 525, 47.5, 35.5, 96, 72)
    views = room.through(camera)
    for k, view in enumerate(views, 1):
        stem = folder / f"apple_1_1_{k}"
        picture(Path(f"{stem}_crop.png"), view.color)
        depth16(Path(f"{stem}_depthcrop.png"), view.depth)
        picture(Path(f"{stem}_maskcrop.png"), np.full(view.depth.shape, 255, np.uint8))
        Path(f"{stem}_loc.txt").write_text("272,204\n")
    return Expected(folder, camera, views, poses=False, **without_camera(camera))


MAKERS = (
    nocs_real,
    ho3d,
    nocs_camera,
    dex_ycb,
    hope_video,
    housecat6d,
    hammer,
    clear_pose,
    linemod,
    sixd_info,
    washington_objects,
)
