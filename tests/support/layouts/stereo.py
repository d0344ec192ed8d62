"""Layouts of stereo and driving sets: disparity, depth of a lidar."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .room import SMALL, Expected, Pinhole, Room, View
from .writing import depth16, numbers, pfm, picture, rows, text

STREET = Pinhole(360.7, 360.7, 304.2, 86.4, 621, 187)  # KITTI's at half its size
BEHIND = 8  # times the room's size


def _right(color: np.ndarray) -> np.ndarray:
    """A picture of the right camera: other colours, so that taking it is seen."""
    return np.ascontiguousarray(255 - color[:, ::-1])


def _middlebury(folder: Path, room: Room, disparity: str, offset: float, *more: str) -> Expected:
    view, baseline = room.through(SMALL, 1)[0], 193.001
    f = SMALL.fx
    camera = Pinhole(f, f, SMALL.cx, SMALL.cy, SMALL.width, SMALL.height)
    view = room.through(camera, 1)[0]
    picture(folder / "im0.png", view.color)
    picture(folder / "im1.png", _right(view.color))
    pixels = np.full(view.depth.shape, np.inf, np.float32)
    known = view.depth > 0
    pixels[known] = baseline * f / (view.depth[known] * 1000) - offset
    pfm(folder / f"{disparity}0{'GT' if more else ''}.pfm", pixels)
    if not more:
        pfm(folder / f"{disparity}1.pfm", pixels[:, ::-1])
    matrix = "[{f:.3f} 0 {x:.3f}; 0 {f:.3f} {y:.3f}; 0 0 1]"
    text(
        folder / "calib.txt",
        "cam0=" + matrix.format(f=f, x=camera.cx, y=camera.cy),
        "cam1=" + matrix.format(f=f, x=camera.cx + offset, y=camera.cy),
        f"doffs={offset:.3f}",
        f"baseline={baseline}",
        "width=320",
        "height=240",
        "ndisp=64",
        "isint=0",
        "vmin=5",
        "vmax=60",
        *more,
    )
    return Expected(folder, camera, [view], poses=False)


def middlebury(folder: Path, room: Room) -> Expected:
    """Middlebury 2014 and 2021 (Scharstein 2014): im0, im1, disp0.pfm with inf, calib.txt with doffs, millimetres."""
    return _middlebury(folder, room, "disp", 13.111)


def eth3d_two_view(folder: Path, room: Room) -> Expected:
    """ETH3D two-view stereo: Middlebury's calib.txt, disp0GT.pfm and mask0nocc.png."""
    expected = _middlebury(folder, room, "disp", 0.0, "dyavg=0", "dymax=0")
    picture(folder / "mask0nocc.png", np.full((240, 320), 255, np.uint8))
    return expected


def _projections(name: str, camera: Pinhole) -> list[str]:
    """Lines of a KITTI calibration; `name` has one {} for the number of the camera."""
    lines = []
    for number, shift in enumerate((0.0, -0.537 * camera.fx, 0.06 * camera.fx, -0.473 * camera.fx)):
        matrix = np.c_[camera.matrix, (shift, 0, 0)]
        lines.append(f"{name.format(number)} {numbers(matrix.reshape(-1), '%.12e')}")
    return lines


def kitti_2015(folder: Path, room: Room) -> Expected:
    """KITTI scene flow 2015: image_2, image_3, disp_occ_0 (16 bit, 256 a pixel, 0 missing), calib_cam_to_cam."""
    folder = folder / "training"
    views = room.through(STREET, 2, BEHIND)
    for k, view in enumerate(views):
        for time in (10, 11):
            picture(folder / f"image_2/{k:06d}_{time}.png", view.color if time == 10 else view.color[::-1].copy())
            picture(folder / f"image_3/{k:06d}_{time}.png", _right(view.color))
        disparity = np.where(view.depth > 0, 0.533 * STREET.fx / view.depth.clip(1), 0)
        for kind in ("occ", "noc"):
            depth16(folder / f"disp_{kind}_0/{k:06d}_10.png", disparity, 256)
        lines = ["calib_time: 09-Jan-2012 13:57:47", "corner_dist: 9.950000e-02"]
        lines += [f"S_rect_02: {numbers((621, 187), '%.6e')}", *_projections("P_rect_0{}:", STREET)]
        text(folder / f"calib_cam_to_cam/{k:06d}.txt", *lines)
    return Expected(folder, STREET, views, poses=False)


def kitti_depth_selection(folder: Path, room: Room) -> Expected:
    """KITTI depth completion, val_selection_cropped: 256 a metre, intrinsics/*.txt of nine numbers, lidar beside."""
    views = room.through(STREET, 3, BEHIND)
    scattered = np.random.default_rng(1).random(views[0].depth.shape) < 0.05
    sparse = []
    for k, view in enumerate(views):
        stem = f"2011_09_26_drive_0002_sync_{{}}_{5 + 3 * k:010d}_image_02"
        picture(folder / f"image/{stem.format('image')}.png", view.color)
        depth = np.where(scattered | (np.arange(621) % 3 > 0), view.depth, 0)
        depth16(folder / f"groundtruth_depth/{stem.format('groundtruth_depth')}.png", depth, 256)
        lidar = np.where(scattered, view.depth, 0)
        depth16(folder / f"velodyne_raw/{stem.format('velodyne_raw')}.png", lidar, 256)
        text(folder / f"intrinsics/{stem.format('image')}.txt", numbers(STREET.matrix.reshape(-1), "%.6f"))
        sparse.append(View(view.color, depth, view.pose))
    return Expected(folder, STREET, sparse, poses=False, sparse=True)


def kitti_odometry(folder: Path, room: Room) -> Expected:
    """KITTI odometry's sequences/00 with depth (256 a metre) added: calib.txt P0..P3, poses.txt of 3x4 a line."""
    folder = folder / "sequences/00"
    views = room.through(STREET, 3, BEHIND)
    for k, view in enumerate(views):
        picture(folder / f"image_2/{k:06d}.png", view.color)
        picture(folder / f"image_3/{k:06d}.png", _right(view.color))
        depth16(folder / f"depth/{k:06d}.png", view.depth, 256)
    text(folder / "calib.txt", *_projections("P{}:", STREET), f"Tr: {numbers(np.eye(4)[:3].reshape(-1), '%.12e')}")
    text(folder / "times.txt", *(f"{0.1 * k:.6e}" for k in range(3)))
    first = np.linalg.inv(views[0].pose)
    text(folder / "poses.txt", *(numbers((first @ view.pose)[:3].reshape(-1), "%.6e") for view in views))
    return Expected(folder, STREET, views, metres=0.05, or_says="depth.scale|metres", then={"depth_scale": 256})


def virtual_kitti_2(folder: Path, room: Room) -> Expected:
    """Virtual KITTI 2 (Cabon 2020): centimetres, sky 65535, intrinsic.txt and extrinsic.txt, two cameras."""
    folder = folder / "Scene01/clone"
    views = room.through(STREET, 3, BEHIND)
    inner = ["frame cameraID K[0,0] K[1,1] K[0,2] K[1,2]"]
    outer = ["frame cameraID r1,1 r1,2 r1,3 t1 r2,1 r2,2 r2,3 t2 r3,1 r3,2 r3,3 t3 0 0 0 1"]
    for k, view in enumerate(views):
        for camera in (0, 1):
            color = _right(view.color) if camera else view.color
            picture(folder / f"frames/rgb/Camera_{camera}/rgb_{k:05d}.jpg", color)
            depth = view.depth[:, ::-1] if camera else view.depth
            depth16(folder / f"frames/depth/Camera_{camera}/depth_{k:05d}.png", depth, 100, 65535)
            inner.append(f"{k} {camera} {STREET.fx} {STREET.fy} {STREET.cx} {STREET.cy}")
            matrix = np.linalg.inv(view.pose)
            matrix[0, 3] -= 0.532725 * camera
            outer.append(f"{k} {camera} {numbers(matrix.reshape(-1), '%.7f')}")
        labels = np.full((*view.depth.shape, 3), (90, 200, 255), np.uint8)
        picture(folder / f"frames/classSegmentation/Camera_0/classgt_{k:05d}.png", labels)
    text(folder / "intrinsic.txt", *inner)
    text(folder / "extrinsic.txt", *outer)
    return Expected(folder, STREET, views, metres=0.01)


def matrix_in_text(folder: Path, room: Room) -> Expected:
    """K.txt, 3x3, beside left.png, right.png and depth.exr: a stereo network's demo."""
    from .writing import exr

    view = room.through(SMALL, 1)[0]
    picture(folder / "left.png", view.color)
    picture(folder / "right.png", _right(view.color))
    exr(folder / "depth.exr", Z=view.depth)
    text(folder / "K.txt", *rows(SMALL.matrix))
    return Expected(folder, SMALL, [view], poses=False)


MAKERS = (
    middlebury,
    eth3d_two_view,
    kitti_2015,
    kitti_depth_selection,
    kitti_odometry,
    virtual_kitti_2,
    matrix_in_text,
)
