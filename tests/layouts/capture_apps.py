"""Layouts that apps for phones write, and the ones made of them for radiance fields."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from .room import GL, PHONE, SMALL, Expected, Pinhole, Room, View
from .writing import as_json, depth16, numbers, picture, quaternion, rows, text


def _confidence(path: Path, view: View, high: int) -> None:
    """A picture of confidences, high everywhere but in one corner."""
    levels = np.full(view.depth.shape, high, np.uint8)
    levels[:20, :20] = 0
    picture(path, levels)


def _frame(view: View, name: str, suffix: str = "png", **more: Any) -> dict:
    """A frame of transforms.json: OpenGL axes, camera-to-world."""
    return {"file_path": f"{name}.{suffix}", **more, "transform_matrix": (view.pose @ GL).tolist()}


def _at_half(camera: Pinhole) -> dict:
    """nerfstudio's names of a camera; its pixel centres lie at + 0.5."""
    sizes = {"w": camera.width, "h": camera.height}
    return {"fl_x": camera.fx, "fl_y": camera.fy, "cx": camera.cx + 0.5, "cy": camera.cy + 0.5, **sizes}


def nerfstudio(folder: Path, room: Room) -> Expected:
    """nerfstudio's data conventions: one camera, images/frame_00001.png, depths/, millimetres without saying so."""
    views, frames = room.through(SMALL), []
    for k, view in enumerate(views, 1):
        picture(folder / f"images/frame_{k:05d}.png", view.color)
        depth16(folder / f"depths/frame_{k:05d}.png", view.depth)
        depth = {"depth_file_path": f"depths/frame_{k:05d}.png"}
        frames.append(_frame(view, f"images/frame_{k:05d}", **depth))
    distortion = {"camera_model": "OPENCV", "k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0.0}
    as_json(folder / "transforms.json", {**_at_half(SMALL), **distortion, "frames": frames})
    return Expected(folder, SMALL, views)


def nerfstudio_smaller_images(folder: Path, room: Room) -> Expected:
    """The same with the folders images_2/ and images_4/ that ns-process-data makes beside images/."""
    expected = nerfstudio(folder, room)
    for k, view in enumerate(expected.views, 1):
        picture(folder / f"images_2/frame_{k:05d}.png", view.color[::2, ::2])
        picture(folder / f"images_4/frame_{k:05d}.png", view.color[::4, ::4])
    return expected


def nerfstudio_camera_each(folder: Path, room: Room) -> Expected:
    """nerfstudio with intrinsics in each frame and frames out of order, as ns-process-data record3d and polycam do."""
    views, frames = room.through(SMALL), []
    for k, view in enumerate(views, 1):
        picture(folder / f"images/frame_{k:05d}.jpg", view.color)
        depth16(folder / f"depth/frame_{k:05d}.png", view.depth)
        more = {**_at_half(SMALL), "depth_file_path": f"./depth/frame_{k:05d}.png"}
        frames.append(_frame(view, f"./images/frame_{k:05d}", "jpg", **more))
    as_json(folder / "transforms.json", {"camera_model": "OPENCV", "frames": [frames[2], frames[0], frames[1]]})
    return Expected(folder, SMALL, views)


def nerfstudio_applied_scale(folder: Path, room: Room) -> Expected:
    """nerfstudio's applied_transform (a turn of the world) and applied_scale (poses are in metres times it)."""
    views, frames = room.through(SMALL), []
    turn = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0]])
    for k, view in enumerate(views, 1):
        picture(folder / f"images/frame_{k:05d}.png", view.color)
        depth16(folder / f"depths/frame_{k:05d}.png", view.depth)
        pose = np.vstack([turn, (0, 0, 0, 1)]) @ view.pose
        pose[:3, 3] *= 0.25
        frame = _frame(View(view.color, view.depth, pose), f"images/frame_{k:05d}")
        frames.append({**frame, "depth_file_path": f"depths/frame_{k:05d}.png"})
    applied = {"applied_transform": turn.tolist(), "applied_scale": 0.25}
    as_json(folder / "transforms.json", {**_at_half(SMALL), **applied, "frames": frames})
    return Expected(folder, SMALL, views)


def instant_ngp(folder: Path, room: Room) -> Expected:
    """instant-ngp: depth_path, integer_depth_scale (metres a raw unit), enable_depth_loading."""
    views, frames = room.through(SMALL), []
    for k, view in enumerate(views):
        picture(folder / f"images/{k:04d}.jpg", view.color)
        depth16(folder / f"depth/{k:04d}.png", view.depth, 4000)
        frames.append(_frame(view, f"images/{k:04d}", "jpg", depth_path=f"depth/{k:04d}.png"))
    more = {"aabb_scale": 4, "enable_depth_loading": True, "integer_depth_scale": 1 / 4000}
    as_json(folder / "transforms.json", {**_at_half(SMALL), **more, "frames": frames})
    return Expected(folder, SMALL, views, pixels=0.6)


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
    """Stray Scanner as it comes from the phone: the colours are in rgb.mp4 (here empty), so only depth is asked for."""
    views, _ = _stray(folder, room)
    (folder / "rgb.mp4").write_bytes(b"\0\0\0\x18ftypmp42\0\0\0\0mp42isom")
    return Expected(folder, PHONE, views, color=False, pixels=0.6)


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


def _colmap(folder: Path, views: list[View]) -> None:
    """COLMAP's text model: world-to-camera, w first; pixel centres at + 0.5; images out of order."""
    values = (SMALL.fx, SMALL.fy, SMALL.cx + 0.5, SMALL.cy + 0.5)
    head = ["# Camera list with one line of data per camera:", "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]"]
    text(folder / "cameras.txt", *head, "# Number of cameras: 1", f"1 PINHOLE 320 240 {numbers(values)}")
    lines = ["# Image list with two lines of data per image:"]
    lines += ["#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME", "#   POINTS2D[] as (X, Y, POINT3D_ID)"]
    for number, k in enumerate((2, 0, 1), 1):
        inverse = np.linalg.inv(views[k].pose)
        turn = np.roll(quaternion(inverse), 1)
        lines += [f"{number} {numbers(turn)} {numbers(inverse[:3, 3])} 1 IMG_{k:04d}.jpg", "12.5 30.25 -1 7.5 8 -1"]
    text(folder / "images.txt", *lines)
    text(folder / "points3D.txt", "# 3D point list with one line of data per point:")


def colmap_text(folder: Path, room: Room) -> Expected:
    """COLMAP's documentation, output format: sparse/0/*.txt, images/, with depth/ of a sensor beside."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"images/IMG_{k:04d}.jpg", view.color)
        depth16(folder / f"depth/IMG_{k:04d}.png", view.depth)
    _colmap(folder / "sparse/0", views)
    return Expected(folder, SMALL, views)


def colmap_dense(folder: Path, room: Room) -> Expected:
    """COLMAP's dense workspace: stereo/depth_maps/*.geometric.bin; may be refused by the name of its files."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"images/IMG_{k:04d}.jpg", view.color)
        for kind in ("geometric", "photometric"):
            path = folder / f"stereo/depth_maps/IMG_{k:04d}.jpg.{kind}.bin"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(b"320&240&1&" + view.depth.astype("<f4").tobytes())
    _colmap(folder / "sparse", views)
    return Expected(folder, SMALL, views, or_says=r"depth_maps|\.bin|no depth")


MAKERS = (
    nerfstudio,
    nerfstudio_smaller_images,
    nerfstudio_camera_each,
    nerfstudio_applied_scale,
    instant_ngp,
    polycam,
    stray_scanner,
    stray_scanner_video,
    record3d,
    scanner_app,
    arkitscenes,
    colmap_text,
    colmap_dense,
)
