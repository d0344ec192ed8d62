"""Layouts of RGB-D SLAM and reconstruction sets."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .room import SMALL, Expected, Pinhole, Room, without_camera
from .writing import as_json, depth16, log_trajectory, numbers, picture, quaternion, rows, text


def ours(folder: Path, room: Room) -> Expected:
    """README of this project: color/, depth/, intrinsics.json, poses_tum.txt."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"color/{k:03d}.jpg", view.color)
        depth16(folder / f"depth/{k:03d}.png", view.depth, 2000)
    camera = {name: getattr(SMALL, name) for name in ("width", "height", "fx", "fy", "cx", "cy")}
    as_json(folder / "intrinsics.json", {**camera, "depth_scale": 2000})
    text(folder / "poses_tum.txt", "# t tx ty tz qx qy qz qw", *_tum_poses(range(3), views))
    return Expected(folder, SMALL, views)


def _open3d_camera(path: Path, camera: Pinhole, **more: object) -> None:
    """Open3D's PinholeCameraIntrinsic: the matrix by columns."""
    matrix = camera.matrix.T.reshape(-1).tolist()
    as_json(path, {**more, "width": camera.width, "height": camera.height, "intrinsic_matrix": matrix})


def redwood_sample(folder: Path, room: Room) -> Expected:
    """Open3D's SampleRedwoodRGBDImages: color/, depth/, camera_primesense.json, trajectory.log, odometry.log."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"color/{k:05d}.jpg", view.color)
        depth16(folder / f"depth/{k:05d}.png", view.depth)
    _open3d_camera(folder / "camera_primesense.json", SMALL)
    log_trajectory(folder / "trajectory.log", [view.pose for view in views])
    log_trajectory(folder / "odometry.log", [view.pose for view in views])
    text(folder / "rgbd.match", *(f"depth/{k:05d}.png color/{k:05d}.jpg" for k in range(3)))
    return Expected(folder, SMALL, views)


def open3d_camera_in_parent(folder: Path, room: Room) -> Expected:
    """Open3D's test_data: RGBD/ with its pictures and odometry.log, camera_primesense.json beside RGBD/."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"RGBD/color/{k:05d}.jpg", view.color)
        depth16(folder / f"RGBD/depth/{k:05d}.png", view.depth)
    _open3d_camera(folder / "camera_primesense.json", SMALL)
    log_trajectory(folder / "RGBD/odometry.log", [view.pose for view in views])
    return Expected(folder / "RGBD", SMALL, views)


def open3d_trajectory_json(folder: Path, room: Room) -> Expected:
    """Open3D's PinholeCameraTrajectory as JSON: world-to-camera by columns; it holds the camera too."""
    views = room.through(SMALL)
    intrinsic = {"width": 320, "height": 240, "intrinsic_matrix": SMALL.matrix.T.reshape(-1).tolist()}
    parameters = []
    for k, view in enumerate(views):
        picture(folder / f"color/{k:06d}.jpg", view.color)
        depth16(folder / f"depth/{k:06d}.png", view.depth)
        extrinsic = np.linalg.inv(view.pose).T.reshape(-1).tolist()
        versions = {"version_major": 1, "version_minor": 0}
        kind = {"class_name": "PinholeCameraParameters"}
        parameters.append({**kind, "extrinsic": extrinsic, "intrinsic": intrinsic, **versions})
    content = {"class_name": "PinholeCameraTrajectory", "parameters": parameters}
    as_json(folder / "camera_trajectory.json", {**content, "version_major": 1, "version_minor": 0})
    return Expected(folder, SMALL, views)


def open3d_reconstruction(folder: Path, room: Room) -> Expected:
    """Open3D's reconstruction system, run on its Azure Kinect recording: intrinsic.json, scene/trajectory.log."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"color/{k:05d}.jpg", view.color)
        depth16(folder / f"depth/{k:05d}.png", view.depth)
    recorder = {"color_mode": "MJPG_720P", "depth_mode": "NFOV_UNBINNED", "serial_number_": "000123"}
    _open3d_camera(folder / "intrinsic.json", SMALL, **recorder, stream_length_usec=99000)
    log_trajectory(folder / "scene/trajectory.log", [view.pose for view in views])
    as_json(folder / "fragments/fragment_000.json", {"class_name": "PoseGraph", "nodes": [], "edges": []})
    as_json(folder / "fragments/fragment_optimized_000.json", {"class_name": "PoseGraph", "nodes": [], "edges": []})
    return Expected(folder, SMALL, views)


def open3d_realsense_recorder(folder: Path, room: Room) -> Expected:
    """Open3D's realsense_recorder.py: camera_intrinsic.json, color/000000.jpg, depth/000000.png; here image/."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"image/{k:06d}.jpg", view.color)
        depth16(folder / f"depth/{k:06d}.png", view.depth)
    _open3d_camera(folder / "camera_intrinsic.json", SMALL)
    return Expected(folder, SMALL, views, poses=False)


def _tum_poses(times: object, views: list) -> list[str]:
    """Lines `t tx ty tz qx qy qz qw`."""
    return [
        f"{time:.4f} {numbers(view.pose[:3, 3], '%.6f')} {numbers(quaternion(view.pose), '%.7f')}"
        for time, view in zip(times, views, strict=True)
    ]


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
    lines = _tum_poses(at, [view for view in views for _ in range(4)])
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
    ours,
    redwood_sample,
    open3d_camera_in_parent,
    open3d_trajectory_json,
    open3d_reconstruction,
    open3d_realsense_recorder,
    tum_freiburg3,
    tum_freiburg1,
    bonn,
    tum_associated,
    icl_nuim_tum,
    eth3d_slam,
    seven_scenes,
    threedmatch_sequence,
    threedmatch_scene,
    tsdf_fusion_python,
    sun3d,
    scannet,
    replica,
    washington_v2,
)
