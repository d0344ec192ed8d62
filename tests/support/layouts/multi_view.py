"""Layouts of sets and programs for many views of a scene: MVSNet's, COLMAP's, radiance fields with depth."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from .room import GL, SMALL, Expected, Pinhole, Room, View, without_camera
from .writing import as_json, depth16, numbers, pfm, picture, quaternion, rows, text


def _mvsnet_camera(path: Path, view: View, unit: float, *last: float) -> None:
    """MVSNet's cam.txt: extrinsic (world-to-camera), intrinsic, depth_min and depth_interval; unit: units a metre."""
    pose = np.linalg.inv(view.pose)
    pose[:3, 3] *= unit
    lines = ["extrinsic", *rows(pose, "%.6f"), "", "intrinsic", *rows(SMALL.matrix, "%.6f"), ""]
    text(path, *lines, numbers(last, "%.4f"))


def blended_mvs(folder: Path, room: Room) -> Expected:
    """BlendedMVS (Yao 2020): blended_images/, _masked beside, cams/00000000_cam.txt, rendered_depth_maps/*.pfm."""
    views = room.through(SMALL)
    folder = folder / "5a3ca9cb270f0e3f14d0eddb"
    for k, view in enumerate(views):
        picture(folder / f"blended_images/{k:08d}.jpg", view.color)
        picture(folder / f"blended_images/{k:08d}_masked.jpg", np.zeros_like(view.color))
        pfm(folder / f"rendered_depth_maps/{k:08d}.pfm", view.depth)
        _mvsnet_camera(folder / f"cams/{k:08d}_cam.txt", view, 1, 0.4, 0.01, 128, 6.0)
    text(folder / "cams/pair.txt", "3", "0", "2 1 20.1 2 11.4", "1", "2 0 20.1 2 9.4", "2", "2 0 10.1 1 9.4")
    return Expected(folder, SMALL, views)


def mvsnet_output(folder: Path, room: Room) -> Expected:
    """What CasMVSNet writes for DTU: images/, cams/, depth_est/*.pfm and confidence/*.pfm, all in millimetres."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"images/{k:08d}.jpg", view.color)
        pfm(folder / f"depth_est/{k:08d}.pfm", view.depth * 1000)
        pfm(folder / f"confidence/{k:08d}.pfm", np.full(view.depth.shape, 0.9, np.float32))
        _mvsnet_camera(folder / f"cams/{k:08d}_cam.txt", view, 1000, 425.0, 2.5)
    return Expected(folder, SMALL, views, metres=0.01)


def _colmap_binary(folder: Path, views: list[View]) -> None:
    """cameras.bin with one PINHOLE, images.bin with one point each."""
    folder.mkdir(parents=True)
    camera = (SMALL.fx, SMALL.fy, SMALL.cx + 0.5, SMALL.cy + 0.5)
    (folder / "cameras.bin").write_bytes(struct.pack("<QiiQQ4d", 1, 1, 1, 320, 240, *camera))
    data = struct.pack("<Q", len(views))
    for k, view in reversed(list(enumerate(views))):
        inverse = np.linalg.inv(view.pose)
        x, y, z, w = quaternion(inverse)
        data += struct.pack("<i7di", k + 1, w, x, y, z, *inverse[:3, 3], 1) + f"IMG_{k:04d}.jpg\0".encode()
        data += struct.pack("<Q2dq", 1, 10.5, 20.5, -1)
    (folder / "images.bin").write_bytes(data)
    (folder / "points3D.bin").write_bytes(struct.pack("<Q", 0))


def colmap_binary(folder: Path, room: Room) -> Expected:
    """COLMAP's own binary model, sparse/0/*.bin (src/colmap/scene/reconstruction_io), beside images/ and depth/."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"images/IMG_{k:04d}.jpg", view.color)
        depth16(folder / f"depth/IMG_{k:04d}.png", view.depth)
    _colmap_binary(folder / "sparse/0", views)
    return Expected(folder, SMALL, views)


def gaussian_splatting(folder: Path, room: Room) -> Expected:
    """3D Gaussian splatting's depth regularisation: depths/*.png of Depth Anything, 16-bit inverse, sparse/0/*.bin."""
    views = room.through(SMALL)
    scales = {}
    for k, view in enumerate(views):
        picture(folder / f"images/IMG_{k:04d}.jpg", view.color)
        inverse = np.where(view.depth > 0, 1 / view.depth.clip(0.1), 0)
        picture(folder / f"depths/IMG_{k:04d}.png", np.rint(inverse / inverse.max() * 65535).astype(np.uint16))
        scales[f"IMG_{k:04d}"] = {"scale": 0.8, "offset": 0.01}
    _colmap_binary(folder / "sparse/0", views)
    as_json(folder / "sparse/0/depth_params.json", scales)
    return Expected(folder, SMALL, views, poses=False, metric=False)


def nerf_capture(folder: Path, room: Room) -> Expected:
    """NeRFCapture, as SplaTAM reads it: transforms.json with depth_path and integer_depth_scale, metres a value."""
    views, frames = room.through(SMALL), []
    unit = 10 / 65535
    camera = {"fl_x": SMALL.fx, "fl_y": SMALL.fy, "cx": SMALL.cx + 0.5, "cy": SMALL.cy + 0.5, "w": 320, "h": 240}
    for k, view in enumerate(views):
        picture(folder / f"rgb/{k}.png", view.color)
        depth16(folder / f"depth/{k}.png", view.depth, 1 / unit)
        names = {"file_path": f"rgb/{k}.png", "depth_path": f"depth/{k}.png", "timestamp": 0.1 * k}
        frames.append({**names, "transform_matrix": (view.pose @ GL).tolist(), **camera})
    top = {"integer_depth_scale": unit, "frames": frames}
    as_json(folder / "transforms.json", {**camera, **top})
    return Expected(folder, SMALL, views)


def nerf_synthetic(folder: Path, room: Room) -> Expected:
    """NeRF's Blender scenes: test/r_0.png, r_0_depth_0001.png (8 bits in RGBA, near is bright), no size, no suffix."""
    camera = Pinhole(280, 280, 159.5, 119.5, 320, 240)
    views, frames = room.through(camera), []
    for k, view in enumerate(views):
        picture(folder / f"test/r_{k}.png", np.dstack([view.color, np.full(view.depth.shape, 255, np.uint8)]))
        grey = np.rint(255 * np.where(view.depth > 0, (8 - view.depth) / 8, 0)).astype(np.uint8)
        picture(folder / f"test/r_{k}_depth_0001.png", np.dstack([grey, grey, grey, np.full_like(grey, 255)]))
        normal = np.full((*view.depth.shape, 4), (128, 128, 255, 255), np.uint8)
        picture(folder / f"test/r_{k}_normal_0001.png", normal)
        matrix = (view.pose @ GL).tolist()
        frames.append({"file_path": f"./test/r_{k}", "rotation": 0.03, "transform_matrix": matrix})
    angle = 2 * np.arctan(160 / 280)
    as_json(folder / "transforms_test.json", {"camera_angle_x": angle, "frames": frames})
    return Expected(folder, camera, views, poses=False, metric=False)


def nerfies(folder: Path, room: Room) -> Expected:
    """Nerfies' and DyCheck's iPhone sets: camera/*.json (focal_length, principal_point, orientation), depth .npy."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"rgb/1x/0_{k:05d}.png", view.color)
        path = folder / f"depth/1x/0_{k:05d}.npy"
        path.parent.mkdir(parents=True, exist_ok=True)
        np.save(path, view.depth[..., None])
        camera = {"focal_length": SMALL.fx, "image_size": [320, 240], "orientation": view.pose[:3, :3].T.tolist()}
        camera |= {"pixel_aspect_ratio": SMALL.fy / SMALL.fx, "position": view.pose[:3, 3].tolist()}
        camera |= {"principal_point": [SMALL.cx + 0.5, SMALL.cy + 0.5], "radial_distortion": [0.0, 0.0, 0.0]}
        as_json(folder / f"camera/0_{k:05d}.json", {**camera, "skew": 0.0, "tangential_distortion": [0.0, 0.0]})
    as_json(folder / "scene.json", {"center": [0, 0, 0], "scale": 1.0, "near": 0.1, "far": 5.0})
    return Expected(folder, SMALL, views, pixels=1.3)


def neural_rgbd(folder: Path, room: Room) -> Expected:
    """Neural RGB-D surface reconstruction (Azinovic 2022): images/img0.png, depth/depth0.png, focal.txt, poses.txt."""
    camera = Pinhole(277.5, 277.5, 159.5, 119.5, 320, 240)
    views = room.through(camera)
    for k, view in enumerate(views):
        picture(folder / f"images/img{k}.png", view.color)
        depth16(folder / f"depth/depth{k}.png", view.depth)
        depth16(folder / f"depth_filtered/depth{k}.png", view.depth)
    text(folder / "focal.txt", "277.5")
    for name in ("poses", "trainval_poses"):
        text(folder / f"{name}.txt", *(line for view in views for line in rows(view.pose @ GL)))
    return Expected(folder, camera, views, pixels=0.6)


def wild_rgbd(folder: Path, room: Room) -> Expected:
    """WildRGB-D (Xia 2024): metadata (K by columns, w, h), cam_poses.txt (number, 4x4), rgb/, depth/, masks/."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"rgb/{k:05d}.png", view.color)
        depth16(folder / f"depth/{k:05d}.png", view.depth)
        picture(folder / f"masks/{k:05d}.png", np.full(view.depth.shape, 255, np.uint8))
    as_json(folder / "metadata", {"w": 320, "h": 240, "K": SMALL.matrix.T.reshape(-1).tolist(), "fps": 30})
    text(folder / "cam_poses.txt", *(f"{k} {numbers(view.pose.reshape(-1))}" for k, view in enumerate(views)))
    return Expected(folder, SMALL, views)


def co3d(folder: Path, room: Room) -> Expected:
    """CO3D (Reizenstein 2021): depths/*.jpg.geometric.png holds the bits of 16-bit floats; masks beside."""
    views = room.through(SMALL)
    for k, view in enumerate(views, 1):
        name = f"frame{k:06d}"
        picture(folder / f"images/{name}.jpg", view.color)
        bits = view.depth.astype(np.float16).view(np.uint16)
        picture(folder / f"depths/{name}.jpg.geometric.png", bits)
        for kind in ("depth_masks", "masks"):
            picture(folder / f"{kind}/{name}.png", np.full(view.depth.shape, 255, np.uint8))
    return Expected(folder, SMALL, views, poses=False, **without_camera(SMALL))


def scannet_25k(folder: Path, room: Room) -> Expected:
    """ScanNet's frames_25k: color/000000.jpg, depth/, pose/, label/, instance/, intrinsics_color.txt and _depth."""
    views = room.through(SMALL)
    color_camera = SMALL.sized(648, 486)
    for k, (view, large) in enumerate(zip(views, room.through(color_camera), strict=True)):
        picture(folder / f"color/{100 * k:06d}.jpg", large.color)
        depth16(folder / f"depth/{100 * k:06d}.png", view.depth)
        text(folder / f"pose/{100 * k:06d}.txt", *rows(view.pose, "%.6f"))
        for kind in ("label", "instance"):
            depth16(folder / f"{kind}/{100 * k:06d}.png", np.full(view.depth.shape, 0.003))
    for name, camera in (("color", color_camera), ("depth", SMALL)):
        matrix = np.eye(4)
        matrix[:3, :3] = camera.matrix
        text(folder / f"intrinsics_{name}.txt", *rows(matrix, "%.6f"))
    return Expected(folder, SMALL, views)


def monosdf(folder: Path, room: Room) -> Expected:
    """MonoSDF's scans: 000000_rgb.png, 000000_depth.npy (Omnidata's, 0 to 1), 000000_normal.npy, cameras.npz."""
    views = room.through(SMALL)
    arrays = {}
    for k, view in enumerate(views):
        picture(folder / f"{k:06d}_rgb.png", view.color)
        near, far = view.depth[view.depth > 0].min(), view.depth.max()
        np.save(folder / f"{k:06d}_depth.npy", ((view.depth.clip(near) - near) / (far - near)).astype(np.float32))
        np.save(folder / f"{k:06d}_normal.npy", np.full((3, 240, 320), 0.5, np.float32))
        matrix = np.eye(4)
        matrix[:3, :3] = SMALL.matrix
        arrays |= {f"scale_mat_{k}": np.eye(4), f"world_mat_{k}": matrix @ np.linalg.inv(view.pose)}
    np.savez(folder / "cameras.npz", **arrays)
    return Expected(folder, SMALL, views, poses=False, metric=False, **without_camera(SMALL))


MAKERS = (
    blended_mvs,
    mvsnet_output,
    colmap_binary,
    gaussian_splatting,
    nerf_capture,
    nerf_synthetic,
    nerfies,
    neural_rgbd,
    wild_rgbd,
    co3d,
    scannet_25k,
    monosdf,
)
