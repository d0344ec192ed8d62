"""Layouts of sets of scanned rooms."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .room import SMALL, Expected, Pinhole, Room, without_camera
from .writing import as_json, depth16, numbers, picture, quaternion, rows, text


def _seven_scenes_frames(folder: Path, views: list, missing: int) -> None:
    for k, view in enumerate(views):
        picture(folder / f"frame-{k:06d}.color.png", view.color)
        depth16(folder / f"frame-{k:06d}.depth.png", view.depth, missing=missing)
        text(folder / f"frame-{k:06d}.pose.txt", *(f"{line}\t " for line in rows(view.pose, "%.7e", "\t ")))


def seven_scenes(folder: Path, room: Room) -> Expected:
    """7-Scenes (Shotton 2013): heads/seq-01/frame-000000.*, 65535 is missing; 585 and (320, 240) on its page only."""
    camera = Pinhole(585, 585, 320, 240, 640, 480)
    views = room.through(camera)
    _seven_scenes_frames(folder / "heads/seq-01", views, 65535)
    text(folder / "heads/TrainSplit.txt", "sequence1")
    return Expected(folder / "heads/seq-01", camera, views, **without_camera(camera))


THREEDMATCH = Pinhole(285.171, 285.171, 160.3, 119.8, 320, 240)


def _threedmatch(folder: Path, room: Room) -> list:
    views = room.through(THREEDMATCH)
    _seven_scenes_frames(folder / "seq-01", views, 0)
    text(folder / "camera-intrinsics.txt", *(f" {line}\t" for line in rows(THREEDMATCH.matrix, "%.8e", "\t ")))
    return views


def threedmatch_sequence(folder: Path, room: Room) -> Expected:
    """3DMatch (Zeng 2017), RGB-D reconstruction sets: camera-intrinsics.txt in the scene; seq-01 is typed."""
    return Expected(folder / "seq-01", THREEDMATCH, _threedmatch(folder, room))


def threedmatch_scene(folder: Path, room: Room) -> Expected:
    """The same, the scene with its one sequence is typed."""
    return Expected(folder, THREEDMATCH, _threedmatch(folder, room))


def tsdf_fusion_python(folder: Path, room: Room) -> Expected:
    """tsdf-fusion-python's data/: frame-000000.color.jpg, .depth.png and .pose.txt beside camera-intrinsics.txt."""
    views = room.through(SMALL)
    _seven_scenes_frames(folder, views, 65535)
    for k, view in enumerate(views):
        (folder / f"frame-{k:06d}.color.png").unlink()
        picture(folder / f"frame-{k:06d}.color.jpg", view.color)
    text(folder / "camera-intrinsics.txt", *rows(SMALL.matrix, "%.18e"))
    return Expected(folder, SMALL, views)


def sun3d(folder: Path, room: Room) -> Expected:
    """SUN3D (Xiao 2013): intrinsics.txt, names of frame and time, depth bits rotated by 3, extrinsics 3x4."""
    views = room.through(SMALL)
    lines = []
    for k, view in enumerate(views):
        picture(folder / f"image/{k + 1:07d}-{33000 * k:012d}.jpg", view.color)
        raw = np.rint(view.depth * 1000).astype(np.uint16)
        picture(folder / f"depth/{k + 1:07d}-{33000 * k + 411:012d}.png", raw << 3 | raw >> 13)
        lines += rows(view.pose[:3])
    text(folder / "intrinsics.txt", *rows(SMALL.matrix))
    text(folder / "extrinsics/20130512130736.txt", *lines)
    return Expected(folder, SMALL, views)


def scannet(folder: Path, room: Room) -> Expected:
    """ScanNet's SensReader export: colour 1296x968 and depth 640x480 with a camera each; one pose is lost (-inf)."""
    depth_camera = Pinhole(577.870605, 577.870605, 319.5, 239.5, 640, 480)
    color_camera = Pinhole(1170.187988, 1170.187988, 647.75, 483.75, 1296, 968)
    views, colors = room.through(depth_camera), room.through(color_camera)
    for k, (view, large) in enumerate(zip(views, colors, strict=True)):
        picture(folder / f"color/{k}.jpg", large.color)
        depth16(folder / f"depth/{k}.png", view.depth)
        text(folder / f"pose/{k}.txt", *rows(view.pose, "%.6f"))
    picture(folder / "color/3.jpg", colors[0].color)
    depth16(folder / "depth/3.png", views[0].depth)
    text(folder / "pose/3.txt", *rows(np.full((4, 4), -np.inf)))
    for name, camera in (("depth", depth_camera), ("color", color_camera)):
        matrix = np.eye(4)
        matrix[:3, :3] = camera.matrix
        text(folder / f"intrinsic/intrinsic_{name}.txt", *rows(matrix, "%.6f"))
        text(folder / f"intrinsic/extrinsic_{name}.txt", *rows(np.eye(4), "%.6f"))
    return Expected(folder, depth_camera, views)


def replica(folder: Path, room: Room) -> Expected:
    """Replica as rendered for iMAP and NICE-SLAM: cam_params.json beside room0/, traj.txt, scale 6553.5."""
    camera = Pinhole(300.0, 300.0, 299.5, 169.5, 600, 340)
    views = room.through(camera)
    for k, view in enumerate(views):
        picture(folder / f"room0/results/frame{k:06d}.jpg", view.color)
        depth16(folder / f"room0/results/depth{k:06d}.png", view.depth, 6553.5)
    text(folder / "room0/traj.txt", *(numbers(view.pose.reshape(-1), "%.18e") for view in views))
    values = {"w": 600, "h": 340, "fx": 300.0, "fy": 300.0, "cx": 299.5, "cy": 169.5, "scale": 6553.5}
    as_json(folder / "cam_params.json", {"camera": values})
    return Expected(folder / "room0", camera, views)


def washington_v2(folder: Path, room: Room) -> Expected:
    """RGB-D Scenes v2 (Lai 2014): imgs/scene_01/00000-color.png, pc/01.pose `a b c d x y z` (w first), no camera."""
    camera = Pinhole(570.3, 570.3, 320.0, 240.0, 640, 480)
    views = room.through(camera)
    lines = []
    for k, view in enumerate(views):
        picture(folder / f"imgs/scene_01/{k:05d}-color.png", view.color)
        depth16(folder / f"imgs/scene_01/{k:05d}-depth.png", view.depth, 10000)
        lines.append(numbers([*np.roll(quaternion(view.pose), 1), *view.pose[:3, 3]], "%.6f"))
    text(folder / "pc/01.pose", *lines)
    given = without_camera(camera)
    return Expected(folder / "imgs/scene_01", camera, views, {"depth_scale": 10000}, poses=False, **given)


MAKERS = (
    seven_scenes,
    threedmatch_sequence,
    threedmatch_scene,
    tsdf_fusion_python,
    sun3d,
    scannet,
    replica,
    washington_v2,
)
