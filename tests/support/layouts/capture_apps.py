"""Layouts that apps for phones write."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path

import numpy as np
from PIL import Image

from .room import GL, PHONE, Expected, Pinhole, Room, View
from .writing import as_json, depth16, numbers, picture, quaternion, rows, text


def _confidence(path: Path, view: View, high: int) -> None:
    """A picture of confidences, high everywhere but in one corner, where the depth is not to be used."""
    levels = np.full(view.depth.shape, high, np.uint8)
    levels[:20, :20] = 0
    picture(path, levels)
    view.depth[:20, :20] = 0


def polycam(folder: Path, room: Room) -> Expected:
    """Polycam's raw export, as nerfstudio's polycam_utils reads it: keyframes/cameras/*.json, t_00.. by rows, GL."""
    color_camera = PHONE.sized(1024, 768)
    views, large = room.through(PHONE), room.through(color_camera)
    for k, (view, other) in enumerate(zip(views, large, strict=True)):
        name = f"{1442008525605 + 250138 * k}"
        picture(folder / f"keyframes/images/{name}.jpg", other.color)
        picture(folder / f"keyframes/corrected_images/{name}.jpg", other.color)
        depth16(folder / f"keyframes/depth/{name}.png", view.depth)
        _confidence(folder / f"keyframes/confidence/{name}.png", view, 255)
        pose = view.pose @ GL
        entries = {f"t_{i}{j}": float(pose[i, j]) for i in range(3) for j in range(4)}
        shape = {n: getattr(color_camera, n) for n in ("fx", "fy", "cx", "cy", "width", "height")}
        times = {"timestamp": int(name), "blur_score": 123.4, "manual_keyframe": False}
        for kind in ("cameras", "corrected_cameras"):
            as_json(folder / f"keyframes/{kind}/{name}.json", {**shape, **entries, **times, "neighbors": []})
    as_json(folder / "mesh_info.json", {"alignmentTransform": np.eye(4).reshape(-1).tolist()})
    return Expected(folder, PHONE, views, pixels=0.6)


STRAY_HEAD = "timestamp, frame, x, y, z, qx, qy, qz, qw"


def _stray(folder: Path, room: Room) -> tuple[list[View], list[View]]:
    """Everything of Stray Scanner but its colours."""
    camera = PHONE.sized(1920, 1440)
    views, large = room.through(PHONE, 2), room.through(camera, 2)
    lines = [STRAY_HEAD]
    for k, view in enumerate(views):
        depth16(folder / f"depth/{k:06d}.png", view.depth)
        _confidence(folder / f"confidence/{k:06d}.png", view, 2)
        place, turn = numbers(view.pose[:3, 3], "%.6f", ", "), numbers(quaternion(view.pose), "%.7f", ", ")
        lines.append(f"{1220.5 + k / 60:.6f}, {k:06d}, {place}, {turn}")
    text(folder / "odometry.csv", *lines)
    text(folder / "imu.csv", "timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z", "1220.5, 0, 9.8, 0, 0, 0, 0")
    text(folder / "camera_matrix.csv", *rows(camera.matrix, "%.6f", ", "))
    return views, large


def stray_scanner(folder: Path, room: Room) -> Expected:
    """Stray Scanner, colours taken out of rgb.mp4 into rgb/. StrayVisualizer: OpenCV axes, camera-to-world."""
    views, large = _stray(folder, room)
    for k, view in enumerate(large):
        picture(folder / f"rgb/{k:06d}.jpg", view.color)
    return Expected(folder, PHONE, views, pixels=0.6)


def stray_scanner_video(folder: Path, room: Room) -> Expected:
    """Stray Scanner as it comes from the phone: the colours are in rgb.mp4."""
    from imageio_ffmpeg import write_frames

    views, large = _stray(folder, room)
    video = write_frames(str(folder / "rgb.mp4"), (1920, 1440), quality=8)
    video.send(None)
    for view in large:
        video.send(np.ascontiguousarray(view.color))
    video.close()
    return Expected(folder, PHONE, views, pixels=0.6)


def record3d(folder: Path, room: Room) -> Expected:
    """Record3D's .r3d, as its own wiki and nerfstudio's record3d_utils read it: a zip, K by columns, lzfse depth."""
    import liblzfse

    color_camera = Pinhole(533.4, 533.4, 239.1, 318.2, 480, 640)  # held upright
    depth_camera = color_camera.sized(192, 256)
    views, large = room.through(depth_camera), room.through(color_camera)
    poses = [[*quaternion(view.pose @ GL), *view.pose[:3, 3]] for view in views]
    shape = {"w": 480, "h": 640, "dw": 192, "dh": 256, "fps": 60, "cameraType": 1}
    matrix = color_camera.matrix.T.reshape(-1).tolist()
    each = [[color_camera.fx, color_camera.fy, color_camera.cx, color_camera.cy]] * 3
    metadata = {**shape, "K": matrix, "poses": poses, "perFrameIntrinsicCoeffs": each, "initPose": poses[0]}
    with zipfile.ZipFile(folder / "2024-05-01--10-00-00.r3d", "w") as archive:
        archive.writestr("metadata", json.dumps(metadata))
        archive.writestr("icon", b"")
        for k, (view, other) in enumerate(zip(views, large, strict=True)):
            jpeg = io.BytesIO()
            Image.fromarray(other.color).save(jpeg, "JPEG", quality=95)
            archive.writestr(f"rgbd/{k}.jpg", jpeg.getvalue())
            depth = np.where(view.depth > 0, view.depth, np.nan).astype("<f4")
            archive.writestr(f"rgbd/{k}.depth", liblzfse.compress(depth.tobytes()))
            archive.writestr(f"rgbd/{k}.conf", liblzfse.compress(np.full(depth.shape, 2, np.uint8).tobytes()))
    return Expected(folder / "2024-05-01--10-00-00.r3d", depth_camera, views, pixels=0.6)


def scanner_app(folder: Path, room: Room) -> Expected:
    """3D Scanner App, "all data": frame_00000.jpg and .json (cameraPoseARFrame by rows, GL axes), depth_, conf_."""
    color_camera = PHONE.sized(1920, 1440)
    views, large = room.through(PHONE, 2), room.through(color_camera, 2)
    for k, (view, other) in enumerate(zip(views, large, strict=True)):
        picture(folder / f"frame_{k:05d}.jpg", other.color)
        depth16(folder / f"depth_{k:05d}.png", view.depth)
        _confidence(folder / f"conf_{k:05d}.png", view, 2)
        pose = (view.pose @ GL).reshape(-1).tolist()
        more = {"frame_index": k, "time": 0.5 * k, "averageAngularVelocity": 0.1, "motionQuality": 0.9}
        matrix = color_camera.matrix.reshape(-1).tolist()
        as_json(folder / f"frame_{k:05d}.json", {"cameraPoseARFrame": pose, "intrinsics": matrix, **more})
    as_json(folder / "info.json", {"title": "scan", "frames": 3, "device": "iPhone13,3"})
    picture(folder / "thumb_00000.jpg", large[0].color[::8, ::8])
    return Expected(folder, PHONE, views, pixels=0.6)


def arkitscenes(folder: Path, room: Room) -> Expected:
    """ARKitScenes' DATA.md and tenFpsDataLoader: lowres_wide.traj is world-to-camera, axis and angle; .pincam each."""
    from scipy.spatial.transform import Rotation

    views, lines = room.through(PHONE), []
    folder = folder / "47333462_frames"
    for k, view in enumerate(views):
        stem = f"47333462_{3.4231 + 0.1 * k:.3f}"
        picture(folder / f"lowres_wide/{stem}.png", view.color)
        depth16(folder / f"lowres_depth/{stem}.png", view.depth)
        _confidence(folder / f"confidence/{stem}.png", view, 2)
        values = (PHONE.fx, PHONE.fy, PHONE.cx, PHONE.cy)
        text(folder / f"lowres_wide_intrinsics/{stem}.pincam", f"256 192 {numbers(values, '%.4f')}")
        inverse = np.linalg.inv(view.pose)
        axis = Rotation.from_matrix(inverse[:3, :3]).as_rotvec()
        lines.append(f"{3.42312 + 0.1 * k:.9f} {numbers(axis, '%.9f')} {numbers(inverse[:3, 3], '%.9f')}")
    text(folder / "lowres_wide.traj", *lines)
    return Expected(folder, PHONE, views)


MAKERS = (
    polycam,
    stray_scanner,
    stray_scanner_video,
    record3d,
    scanner_app,
    arkitscenes,
)
