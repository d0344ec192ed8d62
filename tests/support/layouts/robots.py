"""One frame beside the camera file of a robot, a sensor or a library."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from .room import SMALL, Expected, Room
from .writing import as_json, depth16, numbers, picture, rows, text

VALUES = numbers(SMALL.matrix.reshape(-1), "%.4f", ", ")
PROJECTION = numbers(np.c_[SMALL.matrix, np.zeros(3)].reshape(-1), "%.4f", ", ")


def _frame(folder: Path, room: Room, scale: float = 1000, color: str = "color.png") -> Expected:
    view = room.through(SMALL, 1)[0]
    picture(folder / color, view.color)
    depth16(folder / "depth.png", view.depth, scale)
    return Expected(folder, SMALL, [view], poses=False)


def ros_camera_yaml(folder: Path, room: Room) -> Expected:
    """ROS camera_calibration_parsers: image_width, camera_matrix with rows, cols and data."""
    text(
        folder / "camera.yaml",
        "image_width: 320",
        "image_height: 240",
        "camera_name: narrow_stereo",
        "camera_matrix:",
        "  rows: 3",
        "  cols: 3",
        f"  data: [{VALUES}]",
        "distortion_model: plumb_bob",
        "distortion_coefficients:",
        "  rows: 1",
        "  cols: 5",
        "  data: [0, 0, 0, 0, 0]",
        "rectification_matrix:",
        "  rows: 3",
        "  cols: 3",
        "  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]",
        "projection_matrix:",
        "  rows: 3",
        "  cols: 4",
        f"  data: [{PROJECTION}]",
    )
    return _frame(folder, room, color="rgb.png")


def _info(prefix: str, name: Callable[[str], str]) -> list[str]:
    return [
        "height: 240",
        "width: 320",
        f'distortion_model: {prefix}"plumb_bob"',
        f"{name('D')}: [0.0, 0.0, 0.0, 0.0, 0.0]",
        f"{name('K')}: [{VALUES}]",
        f"{name('R')}: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]",
        f"{name('P')}: [{PROJECTION}]",
        "binning_x: 0",
        "binning_y: 0",
        "roi:",
        "  x_offset: 0",
        "  y_offset: 0",
        "  height: 0",
        "  width: 0",
        "  do_rectify: False",
        "---",
    ]


def ros1_camera_info(folder: Path, room: Room) -> Expected:
    """`rostopic echo -n 1 camera_info` of ROS 1."""
    head = ["header: ", "  seq: 12", "  stamp: ", "    secs: 1600", "    nsecs: 5", '  frame_id: "camera"']
    text(folder / "camera_info.yaml", *head, *_info("", str))
    return _frame(folder, room)


def ros2_camera_info(folder: Path, room: Room) -> Expected:
    """`ros2 topic echo --once camera_info`: small letters, lists with one value a line."""
    lines = ["header:", "  stamp:", "    sec: 1600", "    nanosec: 5", "  frame_id: camera"]
    for line in _info("", str.lower):
        name, _, values = line.partition(": [")
        lines += [f"{name}:", *(f"- {value}" for value in values[:-1].split(", "))] if values else [line]
    text(folder / "camera_info.yaml", *lines)
    return _frame(folder, room)


def opencv_yaml(folder: Path, room: Room) -> Expected:
    """OpenCV's FileStorage, as its calibration sample writes it; the matrix breaks over lines."""
    first, second = (
        numbers(SMALL.matrix.reshape(-1)[:4], "%.10e", ", "),
        numbers(SMALL.matrix.reshape(-1)[4:], "%.6e", ", "),
    )
    text(
        folder / "calibration.yml",
        "%YAML:1.0",
        "---",
        'calibration_time: "Tue 03 May 2022"',
        "image_width: 320",
        "image_height: 240",
        "camera_matrix: !!opencv-matrix",
        "   rows: 3",
        "   cols: 3",
        "   dt: d",
        f"   data: [ {first},",
        f"       {second} ]",
        "distortion_coefficients: !!opencv-matrix",
        "   rows: 1",
        "   cols: 5",
        "   dt: d",
        "   data: [ 0., 0., 0., 0., 0. ]",
        "avg_reprojection_error: 2.1e-01",
    )
    return _frame(folder, room)


def orbslam_yaml(folder: Path, room: Room) -> Expected:
    """ORB-SLAM2 and 3, Examples/RGB-D: Camera.fx, DepthMapFactor."""
    text(
        folder / "camera.yaml",
        "%YAML:1.0",
        "",
        "# Camera calibration and distortion parameters (OpenCV) ",
        f"Camera.fx: {SMALL.fx}",
        f"Camera.fy: {SMALL.fy}",
        f"Camera.cx: {SMALL.cx}",
        f"Camera.cy: {SMALL.cy}",
        "",
        "Camera.k1: 0.0",
        "Camera.k2: 0.0",
        "Camera.width: 320",
        "Camera.height: 240",
        "Camera.fps: 30.0",
        "Camera.bf: 40.0",
        "ThDepth: 40.0",
        "# Deptmap values factor ",
        "DepthMapFactor: 5000.0",
    )
    return _frame(folder, room, 5000)


def nice_slam_yaml(folder: Path, room: Room) -> Expected:
    """NICE-SLAM's and SplaTAM's configs: a cam: block with H, W, fx and png_depth_scale."""
    values = [f"  {name}: {getattr(SMALL, name)}" for name in ("fx", "fy", "cx", "cy")]
    text(folder / "config.yaml", "cam:", "  H: 240", "  W: 320", *values, "  png_depth_scale: 5000.0", "  crop_edge: 0")
    return _frame(folder, room, 5000)


def _realsense(unit: float) -> dict:
    model = {"model": "distortion.inverse_brown_conrady", "coeffs": [0.0] * 5}
    values = {"width": 320, "height": 240, "ppx": SMALL.cx, "ppy": SMALL.cy, "fx": SMALL.fx, "fy": SMALL.fy}
    return {"intrinsics": {**values, **model}, "depth_scale": unit}


def realsense_json(folder: Path, room: Room) -> Expected:
    """pyrealsense2's intrinsics as scripts dump them: ppx, ppy; depth_scale is metres a unit."""
    as_json(folder / "intrinsics.json", _realsense(0.001))
    return _frame(folder, room)


def realsense_d405_json(folder: Path, room: Room) -> Expected:
    """The same of a D405: a tenth of a millimetre a unit."""
    as_json(folder / "camera.json", _realsense(0.0001))
    return _frame(folder, room, 10000)


def realsense_viewer(folder: Path, room: Room) -> Expected:
    """librealsense's rs-save-to-disk and the viewer's snapshot: the depth is a coloured picture: refused."""
    view = room.through(SMALL, 1)[0]
    picture(folder / "rs-save-to-disk-output-Color.png", view.color)
    level = (view.depth / view.depth.max() * 255).astype(np.uint8)
    colored = np.stack([255 - level, np.abs(128 - level.astype(int)).astype(np.uint8), level], -1)
    picture(folder / "rs-save-to-disk-output-Depth.png", np.where(level[..., None] > 0, colored, 0).astype(np.uint8))
    head = ["RGB Camera Stream Type,Color", "Intrinsic:,", f"Fx,{SMALL.fx}", f"Fy,{SMALL.fy}"]
    text(folder / "rs-save-to-disk-output-Color-metadata.csv", *head, f"PPx,{SMALL.cx}", f"PPy,{SMALL.cy}")
    return Expected(folder, SMALL, [view], poses=False, metric=False, or_says="colou?r-mapped|colou?red")


def k_json(folder: Path, room: Room) -> Expected:
    """{"K": [[..], [..], [..]]}, as many scripts write it."""
    as_json(folder / "camera.json", {"K": SMALL.matrix.tolist(), "width": 320, "height": 240})
    return _frame(folder, room)


def k_npy(folder: Path, room: Room) -> Expected:
    """K.npy, 3x3."""
    np.save(folder / "K.npy", SMALL.matrix)
    return _frame(folder, room)


def intrinsics_npy(folder: Path, room: Room) -> Expected:
    """intrinsics.npy beside depth.npy in metres; the matrix must not be taken for a depth picture."""
    expected = _frame(folder, room)
    (folder / "depth.png").unlink()
    np.save(folder / "depth.npy", expected.views[0].depth)
    np.save(folder / "intrinsics.npy", SMALL.matrix.astype(np.float32))
    return expected


def cam_k_txt(folder: Path, room: Room) -> Expected:
    """FoundationPose's demo_data: cam_K.txt, rgb/, depth/, masks/; depth in millimetres."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        name = f"{1581120424100262102 + 33366912 * k}.png"
        picture(folder / "rgb" / name, view.color)
        depth16(folder / "depth" / name, view.depth)
    picture(folder / "masks" / "1581120424100262102.png", np.full((240, 320), 255, np.uint8))
    text(folder / "cam_K.txt", *rows(SMALL.matrix, "%.18e"))
    return Expected(folder, SMALL, views, poses=False)


MAKERS = (
    ros_camera_yaml,
    ros1_camera_info,
    ros2_camera_info,
    opencv_yaml,
    orbslam_yaml,
    nice_slam_yaml,
    realsense_json,
    realsense_d405_json,
    realsense_viewer,
    k_json,
    k_npy,
    intrinsics_npy,
    cam_k_txt,
)
