"""Layouts of simulators and rendered sets whose depth is packed, a ray's length or a format of their own."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np

from .room import SMALL, Expected, Pinhole, Room, View, without_camera
from .writing import as_json, depth16, exr, numbers, pfm, picture, text

WIDE = Pinhole(160, 160, 159.5, 119.5, 320, 240)  # 90 degrees


def _rays(view: View, camera: Pinhole) -> np.ndarray:
    """Distances from the camera's centre."""
    x, y = (np.arange(camera.width) - camera.cx) / camera.fx, (np.arange(camera.height) - camera.cy) / camera.fy
    return (view.depth * np.sqrt(1 + x[None] ** 2 + y[:, None] ** 2)).astype(np.float32)


def carla(folder: Path, room: Room) -> Expected:
    """CARLA's raw depth camera: R + 256 G + 65536 B of 2^24 - 1, times 1000 m (docs, ref_sensors)."""
    views = room.through(SMALL, 3, 8)
    for k, view in enumerate(views):
        picture(folder / f"rgb/{k:08d}.png", np.dstack([view.color, np.full(view.depth.shape, 255, np.uint8)]))
        code = np.rint(np.where(view.depth > 0, view.depth, 1000) / 1000 * (2**24 - 1)).astype(np.uint32)
        raw = np.stack([code & 255, code >> 8 & 255, code >> 16, np.full_like(code, 255)], -1)
        picture(folder / f"depth/{k:08d}.png", raw.astype(np.uint8))
    return Expected(folder, SMALL, views, poses=False, **without_camera(SMALL))


def replicator(folder: Path, room: Room) -> Expected:
    """Omniverse Replicator's BasicWriter (Isaac Sim): rgb_0000.png, distance_to_image_plane_0000.npy, camera_params."""
    camera = Pinhole(24 / 20.955 * 320, 24 / 20.955 * 320, 159.5, 119.5, 320, 240)
    views = room.through(camera)
    for k, view in enumerate(views):
        picture(folder / f"rgb_{k:04d}.png", np.dstack([view.color, np.full(view.depth.shape, 255, np.uint8)]))
        np.save(folder / f"distance_to_image_plane_{k:04d}.npy", np.where(view.depth > 0, view.depth, np.inf))
        np.save(folder / f"distance_to_camera_{k:04d}.npy", np.where(view.depth > 0, _rays(view, camera), np.inf))
        np.save(folder / f"normals_{k:04d}.npy", np.ones((240, 320, 4), np.float32))
        boxes = np.zeros(2, [("semanticId", "<u4"), ("x_min", "<i4"), ("occlusionRatio", "<f4")])
        np.save(folder / f"bounding_box_2d_tight_{k:04d}.npy", boxes)
        picture(folder / f"semantic_segmentation_{k:04d}.png", np.full((240, 320, 4), (25, 255, 140, 255), np.uint8))
        view_matrix = (np.diag([1.0, -1, -1, 1]) @ np.linalg.inv(view.pose)).T  # USD: rows are vectors, y up
        cell = 2 * 24 / 20.955
        projection = [cell, 0, 0, 0, 0, cell * 4 / 3, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0]
        params = {"cameraAperture": [20.955, 15.29], "cameraApertureOffset": [0.0, 0.0], "cameraFocalLength": 24.0}
        params |= {"cameraFisheyeMaxFOV": 0.0, "cameraModel": "pinhole", "cameraProjection": projection}
        params |= {"cameraNearFar": [1.0, 1000000.0], "cameraViewTransform": view_matrix.reshape(-1).tolist()}
        as_json(
            folder / f"camera_params_{k:04d}.json",
            {**params, "metersPerSceneUnit": 1.0, "renderProductResolution": [320, 240]},
        )
    return Expected(folder, camera, views)


def airsim(folder: Path, room: Room) -> Expected:
    """AirSim's recording: airsim_rec.txt, images/img_Car_0_0_*.png and img_Car_0_1_*.pfm (DepthPlanar)."""
    views = room.through(WIDE)
    lines = ["VehicleName\tTimeStamp\tPOS_X\tPOS_Y\tPOS_Z\tQ_W\tQ_X\tQ_Y\tQ_Z\tImageFile"]
    for k, view in enumerate(views):
        names = [f"img_Car_0_{kind}_{1693838400000000000 + k}.{end}" for kind, end in ((0, "png"), (1, "pfm"))]
        picture(folder / "images" / names[0], view.color)
        pfm(folder / "images" / names[1], np.where(view.depth > 0, view.depth, 65504))
        place = view.pose[:3, 3] - views[0].pose[:3, 3]
        lines.append(f"Car\t{1693838400000 + k}\t{numbers(place, '%.5f', chr(9))}\t1\t0\t0\t0\t{';'.join(names)}")
    text(folder / "airsim_rec.txt", *lines)
    return Expected(folder, WIDE, views, poses=False, **without_camera(WIDE))


def mid_air(folder: Path, room: Room) -> Expected:
    """Mid-Air (Fonder 2019): color_left/000000.JPEG, depth/000000.PNG with the bits of 16-bit floats; right beside."""
    views = room.through(WIDE, 3, 8)
    for k, view in enumerate(views):
        for side, color in (("left", view.color), ("right", 255 - view.color[:, ::-1])):
            picture(folder / f"color_{side}/{k:06d}.jpg", np.ascontiguousarray(color))
            path = folder / f"color_{side}/{k:06d}.jpg"
            path.rename(path.with_suffix(".JPEG"))
        bits = np.where(view.depth > 0, view.depth, 65504).astype(np.float16).view(np.uint16)
        picture(folder / f"depth/{k:06d}.png", bits)
        path = folder / f"depth/{k:06d}.png"
        path.rename(path.with_suffix(".PNG"))
    return Expected(folder, WIDE, views, poses=False, **without_camera(WIDE))


def scenenet_rgbd(folder: Path, room: Room) -> Expected:
    """SceneNet RGB-D (McCormac 2017): photo/0.jpg, depth/0.png (millimetres along the ray), instance/0.png."""
    camera = Pinhole(277.128, 289.706, 159.5, 119.5, 320, 240)
    views = room.through(camera)
    for k, view in enumerate(views):
        picture(folder / f"photo/{25 * k}.jpg", view.color)
        depth16(folder / f"depth/{25 * k}.png", _rays(view, camera))
        depth16(folder / f"instance/{25 * k}.png", np.full((240, 320), 0.004))
    given = without_camera(camera, depth_kind="ray")
    return Expected(folder, camera, views, poses=False, **{**given, "or_says": r"intrinsics|fov|ray"})


def scenenet_with_camera(folder: Path, room: Room) -> Expected:
    """The same beside a camera file: rays must not pass for z without a word."""
    expected = scenenet_rgbd(folder, room)
    camera = expected.camera
    names = ("fx", "fy", "cx", "cy", "width", "height")
    as_json(folder / "intrinsics.json", {name: getattr(camera, name) for name in names})
    return replace(expected, or_says=r"depth-kind ray|depth_kind='ray'", then={"depth_kind": "ray"})


def sintel(folder: Path, room: Room) -> Expected:
    """MPI Sintel's depth (Butler 2012): .dpt and .cam begin with 202021.25; clean/, depth/, camdata_left/."""
    views = room.through(SMALL)
    tag = struct.pack("<f", 202021.25)
    for k, view in enumerate(views, 1):
        picture(folder / f"clean/alley_1/frame_{k:04d}.png", view.color)
        path = folder / f"depth/alley_1/frame_{k:04d}.dpt"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(tag + struct.pack("<2i", 320, 240) + view.depth.astype("<f4").tobytes())
        path = folder / f"camdata_left/alley_1/frame_{k:04d}.cam"
        path.parent.mkdir(parents=True, exist_ok=True)
        outer = np.linalg.inv(view.pose)[:3]
        path.write_bytes(tag + SMALL.matrix.astype("<f8").tobytes() + outer.astype("<f8").tobytes())
    return Expected(folder, SMALL, views)


def scene_flow(folder: Path, room: Room) -> Expected:
    """FlyingThings3D and its kin (Mayer 2016): frames_cleanpass/left/0006.png, disparity/left/0006.pfm, and right."""
    views = room.through(SMALL, 2)
    for k, view in enumerate(views, 6):
        for side, color in (("left", view.color), ("right", 255 - view.color[:, ::-1])):
            picture(folder / f"frames_cleanpass/{side}/{k:04d}.png", np.ascontiguousarray(color))
            disparity = np.where(view.depth > 0, 0.1 * SMALL.fx / view.depth.clip(0.1), 0)
            pfm(folder / f"disparity/{side}/{k:04d}.pfm", disparity if side == "left" else disparity[:, ::-1])
    return Expected(folder, SMALL, views, poses=False, metric=False, **without_camera(SMALL))


def falling_things(folder: Path, room: Room) -> Expected:
    """Falling Things (Tremblay 2018): 000000.left.jpg, .left.depth.png (10000 a metre), .right.*, _camera_settings."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        for side, color, depth in (
            ("left", view.color, view.depth),
            ("right", 255 - view.color[:, ::-1], view.depth[:, ::-1]),
        ):
            picture(folder / f"{k:06d}.{side}.jpg", np.ascontiguousarray(color))
            depth16(folder / f"{k:06d}.{side}.depth.png", depth, 10000)
            picture(folder / f"{k:06d}.{side}.seg.png", np.full(depth.shape, 12, np.uint8))
            as_json(folder / f"{k:06d}.{side}.json", {"camera_data": {"location_worldframe": [1, 2, 3]}, "objects": []})
    values = {"resX": 320, "resY": 240, "fx": SMALL.fx, "fy": SMALL.fy, "cx": SMALL.cx, "cy": SMALL.cy, "s": 0}
    settings = [{"name": side, "horizontal_fov": 64, "intrinsic_settings": values} for side in ("left", "right")]
    as_json(folder / "_camera_settings.json", {"camera_settings": settings})
    as_json(folder / "_object_settings.json", {"exported_object_classes": ["002_master_chef_can_16k"]})
    return Expected(folder, SMALL, views, poses=False, or_says=r"depth.scale", then={"depth_scale": 10000})


def unity_perception(folder: Path, room: Room) -> Expected:
    """Unity Perception's SOLO: sequence.0/step0.camera.png, step0.camera.Depth.exr, step0.frame_data.json."""
    view = room.through(WIDE, 1)[0]
    folder = folder / "sequence.0"
    picture(folder / "step0.camera.png", view.color)
    exr(folder / "step0.camera.Depth.exr", R=view.depth, G=view.depth, B=view.depth)
    picture(folder / "step0.camera.instance segmentation.png", np.full((240, 320, 4), (255, 0, 0, 255), np.uint8))
    capture = {"id": "camera", "position": [0.0, 1.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0], "dimension": [320, 240]}
    capture |= {"projection": "Perspective", "matrix": [1.0, 0.0, 0.0, 0.0, 4 / 3, 0.0, 0.0, 0.0, -1.0]}
    as_json(folder / "step0.frame_data.json", {"frame": 0, "sequence": 0, "step": 0, "captures": [capture]})
    return Expected(folder, WIDE, [view], poses=False, **without_camera(WIDE))


def structured3d(folder: Path, room: Room) -> Expected:
    """Structured3D (Zheng 2020): rgb_rawlight.png, depth.png, normal.png, semantic.png, albedo.png, camera_pose.txt."""
    view = room.through(SMALL, 1)[0]
    picture(folder / "rgb_rawlight.png", view.color)
    depth16(folder / "depth.png", view.depth)
    for name in ("normal", "semantic", "albedo"):
        picture(folder / f"{name}.png", np.full((240, 320, 3), (128, 128, 255), np.uint8))
    depth16(folder / "instance.png", np.full((240, 320), 0.003))
    text(folder / "camera_pose.txt", "3800.1 2500.2 1400.0 0.7 0.7 0.0 0.0 0.0 1.0 0.698 0.55")
    as_json(folder / "layout.json", {"junctions": []})
    return Expected(folder, SMALL, [view], poses=False, **without_camera(SMALL))


def stanford_2d3ds(folder: Path, room: Room) -> Expected:
    """2D-3D-S (Armeni 2017): data/rgb, depth (512 a metre, 65535 missing), pose/*.json (K, world-to-camera)."""
    folder = folder / "data"
    views = room.through(SMALL)
    for k, view in enumerate(views):
        name = f"camera_0063ba2f47fa48a28d5a_office_3_frame_{10 + k}_domain"
        picture(folder / f"rgb/{name}_rgb.png", view.color)
        depth16(folder / f"depth/{name}_depth.png", view.depth, 512, 65535)
        for kind in ("normal", "semantic", "semantic_pretty"):
            picture(folder / f"{kind}/{name}_{kind}.png", np.full((240, 320, 3), (128, 128, 255), np.uint8))
        outer = np.linalg.inv(view.pose)[:3].tolist()
        pose = {"camera_k_matrix": SMALL.matrix.tolist(), "field_of_view_rads": 1.09, "camera_rt_matrix": outer}
        pose |= {"camera_location": view.pose[:3, 3].tolist(), "room": "office_3", "frame_num": 10 + k}
        as_json(folder / f"pose/{name}_pose.json", pose)
    return Expected(folder, SMALL, views, metres=0.005)


def taskonomy(folder: Path, room: Room) -> Expected:
    """Taskonomy (Zamir 2018): rgb/point_0_view_1_domain_rgb.png, depth_zbuffer and depth_euclidean, 512 a metre."""
    views = room.through(SMALL, 2)
    for k, view in enumerate(views):
        name = f"point_{k}_view_1_domain"
        picture(folder / f"rgb/{name}_rgb.png", view.color)
        depth16(folder / f"depth_zbuffer/{name}_depth_zbuffer.png", view.depth, 512, 65535)
        depth16(folder / f"depth_euclidean/{name}_depth_euclidean.png", _rays(view, SMALL), 512, 65535)
    return Expected(folder, SMALL, views, poses=False, **without_camera(SMALL))


def matterport_raw(folder: Path, room: Room) -> Expected:
    """Matterport3D's data_organization: matterport_color_images/*_i0_0.jpg, _d0_0.png (4000 a metre), _pose_0_0."""
    views = room.through(SMALL)
    values = (320, 240, SMALL.fx, SMALL.fy, SMALL.cx, SMALL.cy, 0.05, -0.17, 0.0006, 0.0002, 0.08)
    for k, view in enumerate(views):
        stem, turn = "0e92a69a50414253a23043758f111cec", f"0_{k}"
        picture(folder / f"matterport_color_images/{stem}_i{turn}.jpg", view.color)
        depth16(folder / f"matterport_depth_images/{stem}_d{turn}.png", view.depth, 4000)
        pose = view.pose  # camera-to-world
        text(
            folder / f"matterport_camera_poses/{stem}_pose_{turn}.txt",
            *(" ".join(f"{value:.8f}" for value in row) for row in pose),
        )
        text(folder / f"matterport_camera_intrinsics/{stem}_intrinsics_0.txt", numbers(values, "%.6g"))
    return Expected(folder, SMALL, views, pixels=0.6)


def matterport_undistorted(folder: Path, room: Room) -> Expected:
    """The same, undistorted: undistorted_camera_parameters/*.conf holds cameras and poses of OpenGL's axes."""
    views = room.through(SMALL)
    matrix = numbers(SMALL.matrix.reshape(-1), "%.6f")
    lines = ["dataset matterport", "n_images 3", "depth_directory undistorted_depth_images"]
    lines += ["color_directory undistorted_color_images", "", f"intrinsics_matrix {matrix}"]
    for k, view in enumerate(views):
        depth, color = (f"0e92a69a50414253a23043758f111cec_{kind}" for kind in (f"d0_{k}.png", f"i0_{k}.jpg"))
        picture(folder / "undistorted_color_images" / color, view.color)
        depth16(folder / "undistorted_depth_images" / depth, view.depth, 4000)
        pose = view.pose @ np.diag([1.0, -1, -1, 1])
        lines.append(f"scan {depth} {color} {numbers(pose.reshape(-1), '%.8f')}")
    text(folder / "undistorted_camera_parameters/17DRP5sb8fy.conf", *lines)
    return Expected(folder, SMALL, views)


MAKERS = (
    carla,
    replicator,
    airsim,
    mid_air,
    scenenet_rgbd,
    scenenet_with_camera,
    sintel,
    scene_flow,
    falling_things,
    unity_perception,
    structured3d,
    stanford_2d3ds,
    taskonomy,
    matterport_raw,
    matterport_undistorted,
)
