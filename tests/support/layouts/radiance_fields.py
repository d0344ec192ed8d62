"""Layouts made for radiance fields: nerfstudio, instant-ngp, COLMAP."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .room import GL, SMALL, Expected, Pinhole, Room, View
from .writing import as_json, depth16, numbers, picture, quaternion, text


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
    colmap_text,
    colmap_dense,
)
