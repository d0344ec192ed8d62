"""Layouts of the TUM benchmark and of the sets in its form, and ours."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .room import SMALL, Expected, Pinhole, Room, without_camera
from .writing import as_json, depth16, numbers, picture, quaternion, text, tum_poses


def ours(folder: Path, room: Room) -> Expected:
    """README of this project: color/, depth/, intrinsics.json, poses_tum.txt."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"color/{k:03d}.jpg", view.color)
        depth16(folder / f"depth/{k:03d}.png", view.depth, 2000)
    camera = {name: getattr(SMALL, name) for name in ("width", "height", "fx", "fy", "cx", "cy")}
    as_json(folder / "intrinsics.json", {**camera, "depth_scale": 2000})
    text(folder / "poses_tum.txt", "# t tx ty tz qx qy qz qw", *tum_poses(range(3), [view.pose for view in views]))
    return Expected(folder, SMALL, views)


def _tum(folder: Path, room: Room, camera: Pinhole, bag: str) -> list:
    """rgb.txt, depth.txt and groundtruth.txt of the TUM benchmark; colour, depth and motion at times of their own."""
    views = room.through(camera)
    times = [1341847980.722988 + 0.9 * k for k in range(3)]
    head = [f"# file: '{bag}'", "# timestamp filename"]
    color, depth = ["# color images", *head], ["# depth maps", *head]
    for time, view in zip(times, views, strict=True):
        picture(folder / f"rgb/{time:.6f}.png", view.color)
        depth16(folder / f"depth/{time + 0.004:.6f}.png", view.depth, 5000)
        color.append(f"{time:.6f} rgb/{time:.6f}.png")
        depth.append(f"{time + 0.004:.6f} depth/{time + 0.004:.6f}.png")
    text(folder / "rgb.txt", *color)
    text(folder / "depth.txt", *depth)
    at = [time + shift for time in times for shift in (-0.2, -0.0012, 0.0088, 0.2)]  # standing still for 0.4 s
    lines = tum_poses(at, [view.pose for view in views for _ in range(4)])
    head = ["# ground truth trajectory", head[0], "# timestamp tx ty tz qx qy qz qw"]
    text(folder / "groundtruth.txt", *head, *lines)
    text(folder / "accelerometer.txt", "# accelerometer data", head[1], "# timestamp ax ay az", f"{times[0]} 0.1 9 0")
    return views


def tum_freiburg3(folder: Path, room: Room) -> Expected:
    """TUM RGB-D benchmark (Sturm 2012), file formats page: no camera file; freiburg3's camera and 5000 per metre."""
    camera = Pinhole(535.4, 539.2, 320.1, 247.6, 640, 480)
    folder = folder / "rgbd_dataset_freiburg3_long_office_household"
    views = _tum(folder, room, camera, "rgbd_dataset_freiburg3_long_office_household.bag")
    return Expected(folder, camera, views, **without_camera(camera))


def tum_freiburg1(folder: Path, room: Room) -> Expected:
    """The same of freiburg1, whose camera is another."""
    camera = Pinhole(517.3, 516.5, 318.6, 255.3, 640, 480)
    folder = folder / "rgbd_dataset_freiburg1_desk"
    views = _tum(folder, room, camera, "rgbd_dataset_freiburg1_desk.bag")
    return Expected(folder, camera, views, **without_camera(camera))


def bonn(folder: Path, room: Room) -> Expected:
    """Bonn RGB-D Dynamic (Palazzolo 2019): the TUM form, 5000 per metre, the camera on its page only."""
    camera = Pinhole(542.822841, 542.576870, 315.593520, 237.756098, 640, 480)
    folder = folder / "rgbd_bonn_balloon"
    views = _tum(folder, room, camera, "balloon.bag")
    return Expected(folder, camera, views, **without_camera(camera))


def tum_associated(folder: Path, room: Room) -> Expected:
    """TUM's associate.py, as ORB-SLAM2's examples use it: only associations.txt says what belongs together."""
    camera = Pinhole(535.4, 539.2, 320.1, 247.6, 640, 480)
    folder = folder / "rgbd_dataset_freiburg3_walking_xyz"
    views = _tum(folder, room, camera, "walking.bag")
    colors, depths = sorted((folder / "rgb").iterdir()), sorted((folder / "depth").iterdir())
    lines = [f"{c.stem} rgb/{c.name} {d.stem} depth/{d.name}" for c, d in zip(colors, depths, strict=True)]
    text(folder / "associations.txt", *lines)
    (folder / "rgb.txt").unlink()
    (folder / "depth.txt").unlink()
    return Expected(folder, camera, views, **without_camera(camera, depth_scale=5000))


def icl_nuim_tum(folder: Path, room: Room) -> Expected:
    """ICL-NUIM (Handa 2014) in its TUM-compatible form: depth first in associations.txt, unpadded names, no camera.

    Its true camera is (481.2, -480, 319.5, 239.5): y points up in poses. Read with +480 the views disagree; that may
    not pass without a note.
    """
    camera = Pinhole(481.2, 480.0, 319.5, 239.5, 640, 480)
    views = room.through(camera, 3)
    up = np.diag([1.0, -1.0, 1.0, 1.0])
    poses = []
    for k, view in zip((8, 9, 10), views, strict=True):  # 10 sorts before 8 as text
        picture(folder / f"rgb/{k}.png", view.color)
        depth16(folder / f"depth/{k}.png", view.depth, 5000)
        pose = up @ view.pose @ up
        poses.append(f"{k} {numbers(pose[:3, 3], '%.6f')} {numbers(quaternion(pose), '%.7f')}")
    text(folder / "associations.txt", *(f"{k} depth/{k}.png {k} rgb/{k}.png" for k in (8, 9, 10)))
    text(folder / "livingRoom0.gt.freiburg", *poses)
    given = without_camera(camera, depth_scale=5000)
    return Expected(folder, camera, views, **given, or_notes="fy|upside|mirror|poses")


def eth3d_slam(folder: Path, room: Room) -> Expected:
    """ETH3D SLAM documentation: the TUM form with calibration.txt `fx fy cx cy`, 739x458, 5000 per metre."""
    camera = Pinhole(726.28741455078, 726.28741455078, 354.6496887207, 186.46566772461, 739, 458)
    views = _tum(folder, room, camera, "cables_1")
    for name in ("rgb.txt", "depth.txt", "groundtruth.txt"):
        lines = (folder / name).read_text().splitlines()
        text(folder / name, *(line for line in lines if not line.startswith("#")))
    (folder / "accelerometer.txt").unlink()
    text(folder / "calibration.txt", numbers((camera.fx, camera.fy, camera.cx, camera.cy), "%.11f"))
    return Expected(folder, camera, views, pixels=0.6)


MAKERS = (
    ours,
    tum_freiburg3,
    tum_freiburg1,
    bonn,
    tum_associated,
    icl_nuim_tum,
    eth3d_slam,
)
