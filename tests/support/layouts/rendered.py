"""Layouts of rendered sets and of scanned ones that keep arrays."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .room import SMALL, Expected, Pinhole, Room, without_camera
from .writing import exr, numbers, picture, quaternion, rows, text

TO_NED = np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])  # x forward, y right, z down


def _ned_poses(path: Path, views: list) -> None:
    """tx ty tz qx qy qz qw a line, camera and world in NED."""
    poses = [TO_NED @ view.pose @ TO_NED.T for view in views]
    text(path, *(numbers([*pose[:3, 3], *quaternion(pose)], "%.18e") for pose in poses))


def tartanair(folder: Path, room: Room) -> Expected:
    """TartanAir's data_type.md (Wang 2020): depth_left/000000_left_depth.npy, NED poses, 320 on its page only."""
    camera = Pinhole(320, 320, 320, 240, 640, 480)
    folder = folder / "P001"
    views = room.through(camera)
    for k, view in enumerate(views):
        picture(folder / f"image_left/{k:06d}_left.png", view.color)
        picture(folder / f"image_right/{k:06d}_right.png", np.ascontiguousarray(255 - view.color))
        for side, depth in (("left", view.depth), ("right", view.depth[:, ::-1])):
            path = folder / f"depth_{side}/{k:06d}_{side}_depth.npy"
            path.parent.mkdir(parents=True, exist_ok=True)
            np.save(path, depth)
        (folder / "seg_left").mkdir(exist_ok=True)
        np.save(folder / f"seg_left/{k:06d}_left_seg.npy", np.full(view.depth.shape, 7, np.uint8))
    _ned_poses(folder / "pose_left.txt", views)
    _ned_poses(folder / "pose_right.txt", views[::-1])
    return Expected(folder, camera, views, **without_camera(camera))


def tartanair_v2(folder: Path, room: Room) -> Expected:
    """TartanAir V2: depth is float32 in the four bytes of a PNG's pixel (as cv2 orders them); may be refused."""
    camera = Pinhole(160, 160, 159.75, 159.75, 320, 320)  # of 640x640 at half the size
    folder = folder / "P000"
    views = room.through(camera)
    for k, view in enumerate(views):
        picture(folder / f"image_lcam_front/{k:06d}_lcam_front.png", view.color)
        raw = np.ascontiguousarray(view.depth, "<f4").view(np.uint8).reshape(320, 320, 4)
        picture(folder / f"depth_lcam_front/{k:06d}_lcam_front_depth.png", raw[..., (2, 1, 0, 3)].copy())
    _ned_poses(folder / "pose_lcam_front.txt", views)
    return Expected(folder, camera, views, or_says="depth")


def hypersim(folder: Path, room: Room) -> Expected:
    """Hypersim (Roberts 2021): frame.0000.depth_meters.hdf5 is the length of the ray, not z; previews as .jpg."""
    import h5py

    camera = Pinhole(443.405, 443.405, 255.5, 191.5, 512, 384)
    images = folder / "ai_001_001/images"
    views = room.through(camera, 2)
    x, y = (np.arange(512) - camera.cx) / camera.fx, (np.arange(384) - camera.cy) / camera.fy
    longer = np.sqrt(1 + x[None] ** 2 + y[:, None] ** 2)
    for k, view in enumerate(views):
        ray = np.where(view.depth > 0, view.depth * longer, np.nan).astype(np.float16)
        for kind, name, array in (("geometry", "depth_meters", ray), ("final", "color", view.color.astype(np.float16))):
            path = images / f"scene_cam_00_{kind}_hdf5/frame.{k:04d}.{name}.hdf5"
            path.parent.mkdir(parents=True, exist_ok=True)
            with h5py.File(path, "w") as file:
                file["dataset"] = array
        picture(images / f"scene_cam_00_final_preview/frame.{k:04d}.color.jpg", view.color)
        picture(images / f"scene_cam_00_geometry_preview/frame.{k:04d}.depth_meters.png", view.color[..., ::-1].copy())
    return Expected(folder / "ai_001_001", camera, views, poses=False, or_says=r"hdf5|no depth|intrinsics|fov")


def diode(folder: Path, room: Room) -> Expected:
    """DIODE's devkit (Vasiljevic 2019): name.png, name_depth.npy (h, w, 1), name_depth_mask.npy; 886.81, 927.06."""
    camera = Pinhole(886.81, 927.06, 512, 384, 1024, 768)
    folder = folder / "scene_00019/scan_00183"
    views = room.through(camera, 2)
    for k, view in enumerate(views):
        stem = folder / f"00019_00183_indoors_{10 * k:03d}_010"
        picture(Path(f"{stem}.png"), view.color)
        np.save(f"{stem}_depth.npy", view.depth[..., None])
        np.save(f"{stem}_depth_mask.npy", (view.depth > 0).astype(np.float32))
    return Expected(folder, camera, views, poses=False, **without_camera(camera))


def sun_rgbd(folder: Path, room: Room) -> Expected:
    """SUN RGB-D (Song 2015): image/, depth/ and depth_bfx/ with bits rotated by 3, intrinsics.txt, extrinsics."""
    view = room.through(SMALL, 1)[0]
    raw = np.rint(view.depth * 1000).astype(np.uint16)
    picture(folder / "image/0000103.jpg", view.color)
    for name in ("depth", "depth_bfx"):
        picture(folder / f"{name}/0000103.png", raw << 3 | raw >> 13)
    text(folder / "intrinsics.txt", *rows(SMALL.matrix, "%.6f"))
    text(folder / "extrinsics/20150118235401.txt", *rows(np.c_[view.pose[:3, :3], np.zeros(3)], "%.6f"))
    text(folder / "scene.txt", "office")
    text(folder / "annotation2Dfinal/index.json", "{}")
    return Expected(folder, SMALL, [view], poses=False)


def blender(folder: Path, room: Room) -> Expected:
    """Blender's File Output node: Image0001.png and Depth0001.exr (channel V), 1e10 where the sky is."""
    camera = Pinhole(262.5, 262.5, 159.5, 119.5, 320, 240)
    views = room.through(camera, 2)
    for k, view in enumerate(views, 1):
        picture(folder / f"Image{k:04d}.png", view.color)
        exr(folder / f"Depth{k:04d}.exr", V=np.where(view.depth > 0, view.depth, 1e10))
    return Expected(folder, camera, views, poses=False, **without_camera(camera))


def nyu_labeled(folder: Path, room: Room) -> Expected:
    """NYU Depth v2's nyu_depth_v2_labeled.mat (Silberman 2012): HDF5, images (n, 3, w, h), depths (n, w, h), metres."""
    import h5py

    camera = Pinhole(518.857901, 519.469611, 325.582449, 253.736166, 640, 480)
    views = room.through(camera, 2)
    with h5py.File(folder / "nyu_depth_v2_labeled.mat", "w", userblock_size=512) as file:
        file["images"] = np.array([view.color.transpose(2, 1, 0) for view in views])
        file["depths"] = np.array([view.depth.T for view in views])
        file["rawDepths"] = np.array([view.depth.T for view in views])
        file["labels"] = np.zeros((2, 640, 480), np.uint16)
    with (folder / "nyu_depth_v2_labeled.mat").open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(512))
    source = folder / "nyu_depth_v2_labeled.mat"
    return Expected(source, camera, views, poses=False, pixels=1.2, **without_camera(camera))


MAKERS = (tartanair, tartanair_v2, hypersim, diode, sun_rgbd, blender, nyu_labeled)
