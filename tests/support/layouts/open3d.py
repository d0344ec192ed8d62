"""Layouts of Open3D: its samples, recorders and reconstruction system."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .room import SMALL, Expected, Pinhole, Room
from .writing import as_json, depth16, log_trajectory, picture, text


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


MAKERS = (
    redwood_sample,
    open3d_camera_in_parent,
    open3d_trajectory_json,
    open3d_reconstruction,
    open3d_realsense_recorder,
)
