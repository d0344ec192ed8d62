"""Layouts of recordings of single sensors, as their viewers, SDKs and SLAM programs export them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .room import SMALL, Expected, Pinhole, Room, without_camera
from .writing import as_json, depth16, numbers, picture, quaternion, rows, text, tum_poses

KINECT = Pinhole(525, 525, 319.5, 239.5, 640, 480)


def bundle_fusion(folder: Path, room: Room) -> Expected:
    """BundleFusion (Dai 2017): frame-000000.color.jpg, .depth.png, .pose.txt, and info.txt with m_calibration..."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"frame-{k:06d}.color.jpg", view.color)
        depth16(folder / f"frame-{k:06d}.depth.png", view.depth)
        text(folder / f"frame-{k:06d}.pose.txt", *rows(view.pose))
    text(folder / "info.txt", *_sens_info(SMALL, SMALL))
    return Expected(folder, SMALL, views)


def _sens_info(color: Pinhole, depth: Pinhole) -> list[str]:
    lines = ["m_versionNumber = 4", "m_sensorName = StructureSensor"]
    for name, camera in (("Color", color), ("Depth", depth)):
        lines += [f"m_{name.lower()}Width = {camera.width}", f"m_{name.lower()}Height = {camera.height}"]
    lines += ["m_depthShift = 1000"]
    for name, camera in (("Color", color), ("Depth", depth)):
        matrix = np.eye(4)
        matrix[:3, :3] = camera.matrix
        lines += [f"m_calibration{name}Intrinsic = {numbers(matrix.reshape(-1), '%.6g')} "]
        lines += [f"m_calibration{name}Extrinsic = {numbers(np.eye(4).reshape(-1), '%g')} "]
    return [*lines, "m_frames.size = 3"]


def three_r_scan(folder: Path, room: Room) -> Expected:
    """3RScan (Wald 2019): sequence/frame-000000.color.jpg 960x540, .depth.pgm 224x172, .pose.txt, _info.txt."""
    depth_camera = Pinhole(176.594, 177.9, 114.6, 84.8, 224, 172)
    color_camera = Pinhole(756.832, 756.026, 492.889, 270.419, 960, 540)
    folder = folder / "sequence"
    views = room.through(depth_camera)
    for k, (view, large) in enumerate(zip(views, room.through(color_camera), strict=True)):
        picture(folder / f"frame-{k:06d}.color.jpg", large.color)
        _pgm(folder / f"frame-{k:06d}.depth.pgm", np.rint(view.depth * 1000))
        text(folder / f"frame-{k:06d}.pose.txt", *rows(view.pose))
    text(folder / "_info.txt", *_sens_info(color_camera, depth_camera))
    return Expected(folder, depth_camera, views, color=False)  # of another aspect ratio


def _pgm(path: Path, values: np.ndarray, order: str = ">") -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    head = f"P5\n{values.shape[1]} {values.shape[0]}\n65535\n".encode()
    path.write_bytes(head + values.astype(f"{order}u2").tobytes())


def infinitam(folder: Path, room: Room) -> Expected:
    """InfiniTAM's Teddy: Frames/0000.ppm and 0000.pgm, calib.txt of two cameras without names, colour and depth."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"Frames/{k:04d}.ppm", view.color)
        _pgm(folder / f"Frames/{k:04d}.pgm", np.rint(view.depth * 1000))
    lines = []
    for camera in (Pinhole(260.3, 259.9, 155.0, 122.0, 320, 240), SMALL):
        lines += ["320 240", f"{camera.fx} {camera.fy}", f"{camera.cx} {camera.cy}", ""]
    lines += [*rows(np.eye(4)[:3], "%.6f"), "", "affine 0.001 0.0"]
    text(folder / "calib.txt", *lines)
    return Expected(folder, SMALL, views, poses=False, or_says=r"intrinsics|fov", then=without_camera(SMALL)["then"])


def nyu_raw(folder: Path, room: Room) -> Expected:
    """NYU Depth v2, raw: d-<time>-<ticks>.pgm of Kinect disparity, bytes swapped, r-<time>-<ticks>.ppm, a-*.dump."""
    folder = folder / "office_0001"
    camera = Pinhole(582.62, 582.69, 313.04, 238.44, 640, 480)
    views = room.through(camera)
    for k, view in enumerate(views):
        time = 1294886360.208469 + 0.9 * k
        picture(folder / f"r-{time + 0.013:.6f}-{3118787619 + 54012345 * k}.ppm", view.color)
        known = view.depth > 0
        disparity = np.where(known, 1091.5 - 8 * 0.075 * 580 / view.depth.clip(0.3), 2047)
        _pgm(folder / f"d-{time:.6f}-{2996770081 + 54012345 * k}.pgm", np.rint(disparity), "<")
        (folder / f"a-{time + 0.001:.6f}-{2996770081 + 7 * k}.dump").write_bytes(bytes(40))
    text(folder / "INDEX.txt", *(path.name for path in sorted(folder.iterdir())))
    return Expected(folder, camera, views, poses=False, metric=False)


def princeton_tracking(folder: Path, room: Room) -> Expected:
    """Princeton Tracking Benchmark (Song 2013): rgb/r-<time>-<n>.png, depth/d-<time>-<n>.png, bits rotated by 3."""
    views = room.through(KINECT)
    for k, view in enumerate(views, 1):
        picture(folder / f"rgb/r-{33333 * k}-{k}.png", view.color)
        raw = np.rint(view.depth * 1000).astype(np.uint16)
        picture(folder / f"depth/d-{33333 * k + 411}-{k}.png", raw << 3 | raw >> 13)
    text(folder / "init.txt", "300,200,40,60")
    return Expected(folder, KINECT, views, poses=False, **without_camera(KINECT))


def openloris(folder: Path, room: Room) -> Expected:
    """OpenLORIS-Scene (Shi 2020): color/, depth/, aligned_depth/ by time, sensors.yaml of fx, cx, fy, cy."""
    views = room.through(SMALL)
    other = room.through(Pinhole(230.1, 230.1, 158.2, 119.1, 320, 240))
    lists: dict[str, list[str]] = {"color": [], "depth": [], "aligned_depth": []}
    for k, view in enumerate(views):
        time = 1560000036.230539 + 0.9 * k
        picture(folder / f"color/{time:.6f}.png", view.color)
        depth16(folder / f"depth/{time + 0.004:.6f}.png", other[k].depth)
        depth16(folder / f"aligned_depth/{time:.6f}.png", view.depth)
        for name, lines in lists.items():
            at = time + (0.004 if name == "depth" else 0)
            lines.append(f"{at:.6f} {name}/{at:.6f}.png")
    for name, lines in lists.items():
        text(folder / f"{name}.txt", *lines)
    text(
        folder / "groundtruth.txt",
        "# timestamp tx ty tz qx qy qz qw",
        *tum_poses([1560000036.230539 + 0.9 * k for k in range(3)], [view.pose for view in views]),
    )
    lines = ["%YAML:1.0", "---"]
    for name, camera in (("color", SMALL), ("depth", Pinhole(230.1, 230.1, 158.2, 119.1, 320, 240))):
        values = numbers((camera.fx, camera.cx, camera.fy, camera.cy), "%.10e", ", ")
        lines += [f"d400_{name}_optical_frame:", "   sensor_type: camera", f"   sensor_name: d400_{name}_optical_frame"]
        lines += ["   fps: 30", "   width: 320", "   height: 240", "   model: pinhole"]
        lines += ["   intrinsics: !!opencv-matrix", "      rows: 1", "      cols: 4", "      dt: d"]
        lines += [f"      data: [ {values} ]", "   distortion_model: none"]
    text(folder / "sensors.yaml", *lines)
    return Expected(folder, SMALL, views)


def ros_bag_pictures(folder: Path, room: Room) -> Expected:
    """Pictures out of a RealSense's ROS bag: a folder a topic, unaligned depth and infrared beside the aligned one."""
    views = room.through(SMALL)
    other = room.through(Pinhole(230.1, 230.1, 158.2, 119.1, 320, 240))
    for k, view in enumerate(views):
        time = 1694438400123456789 + 900000000 * k
        picture(folder / f"camera_color_image_raw/{time}.png", view.color)
        depth16(folder / f"camera_depth_image_rect_raw/{time}.png", other[k].depth)
        depth16(folder / f"camera_aligned_depth_to_color_image_raw/{time}.png", view.depth)
        picture(folder / f"camera_infra1_image_rect_raw/{time}.png", np.full(view.depth.shape, 90, np.uint8))
    for name, camera in (("color", SMALL), ("depth", Pinhole(230.1, 230.1, 158.2, 119.1, 320, 240))):
        matrix = numbers(camera.matrix.reshape(-1), "%.4f", ", ")
        text(
            folder / f"camera_{name}_camera_info.yaml",
            "height: 240",
            "width: 320",
            "distortion_model: plumb_bob",
            "D: [0.0, 0.0, 0.0, 0.0, 0.0]",
            f"K: [{matrix}]",
        )
    return Expected(folder, SMALL, views, poses=False)


def rtabmap(folder: Path, room: Room) -> Expected:
    """RTAB-Map's export: rgb/, depth/ and calib/*.yaml by time, poses.txt with numbers of nodes, of ROS's body axes."""
    body = np.array([[0.0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]])
    views, lines = room.through(SMALL), ["#timestamp x y z qx qy qz qw id"]
    for k, view in enumerate(views):
        time = f"{1305031453.374112 + 0.9 * k:.6f}"
        picture(folder / f"rgb/{time}.jpg", view.color)
        depth16(folder / f"depth/{time}.png", view.depth)
        pose = view.pose @ body
        lines.append(f"{time} {numbers([*pose[:3, 3], *quaternion(pose)])} {k + 1}")
        matrix = numbers(SMALL.matrix.reshape(-1), "%.10e", ", ")
        text(
            folder / f"calib/{time}.yaml",
            "%YAML:1.0",
            "---",
            f'camera_name: "{time}"',
            "image_width: 320",
            "image_height: 240",
            "camera_matrix:",
            "   rows: 3",
            "   cols: 3",
            f"   data: [ {matrix} ]",
            "local_transform:",
            "   rows: 3",
            "   cols: 4",
            "   data: [ 0., 0., 1., 0., -1., 0., 0., 0., 0., -1., 0., 0. ]",
        )
    text(folder / "poses.txt", *lines)
    return Expected(folder, SMALL, views)


def spectacular_ai(folder: Path, room: Room) -> Expected:
    """Spectacular AI's recording format: data.mp4, frames2/00000000.png (millimetres), calibration.json, data.jsonl."""
    from imageio_ffmpeg import write_frames

    views = room.through(SMALL)
    writer = write_frames(str(folder / "data.mkv"), (320, 240), quality=10)
    writer.send(None)
    for k, view in enumerate(views):
        writer.send(np.ascontiguousarray(view.color))
        depth16(folder / f"frames2/{k:08d}.png", view.depth)
    writer.close()
    camera = {"focalLengthX": SMALL.fx, "focalLengthY": SMALL.fy, "principalPointX": SMALL.cx, "model": "pinhole"}
    camera |= {"principalPointY": SMALL.cy, "imageWidth": 320, "imageHeight": 240, "imuToCamera": np.eye(4).tolist()}
    as_json(folder / "calibration.json", {"cameras": [camera, camera]})
    (folder / "data.jsonl").write_text('{"sensor":{"type":"gyroscope","values":[0,0,0]},"time":1.0}\n' * 3)
    text(folder / "vio_config.yaml", 'parameterSets: ["wrapper-base"]')
    return Expected(folder, SMALL, views, poses=False)


def azure_kinect(folder: Path, room: Room) -> Expected:
    """Streams of an Azure Kinect as they come: color/ 1280x720, depth/ 640x576 of another lens: not registered."""
    color_camera = Pinhole(605.3, 605.1, 637.9, 366.6, 1280, 720)
    depth_camera = Pinhole(504.1, 504.2, 321.3, 330.8, 640, 576)
    views = room.through(depth_camera, 2)
    for k, (view, large) in enumerate(zip(views, room.through(color_camera, 2), strict=True)):
        picture(folder / f"color/{k:06d}.jpg", large.color)
        depth16(folder / f"depth/{k:06d}.png", view.depth)
    return Expected(folder, depth_camera, views, poses=False, color=False, **without_camera(depth_camera))


def zed_export(folder: Path, room: Room) -> Expected:
    """ZED's SVO export, left and 16-bit depth as pictures: left000000.png, right000000.png, depth000000.png."""
    views = room.through(SMALL)
    for k, view in enumerate(views):
        picture(folder / f"left{k:06d}.png", view.color)
        picture(folder / f"right{k:06d}.png", np.ascontiguousarray(255 - view.color))
        depth16(folder / f"depth{k:06d}.png", view.depth)
    return Expected(folder, SMALL, views, poses=False, **without_camera(SMALL))


def oak_calibration(folder: Path, room: Room) -> Expected:
    """DepthAI's calib.json beside rgb and depth aligned to it: cameraData, a list of sockets with intrinsicMatrix."""
    view = room.through(SMALL, 1)[0]
    picture(folder / "rgb_0.png", view.color)
    depth16(folder / "depth_0.png", view.depth)
    sockets = []
    for number, camera in ((1, Pinhole(200, 200, 160, 100, 320, 200)), (0, SMALL)):
        data = {"cameraType": 0, "intrinsicMatrix": camera.matrix.tolist(), "width": camera.width}
        sockets.append([number, {**data, "height": camera.height, "distortionCoeff": [0.0] * 14, "specHfovDeg": 68.7}])
    as_json(folder / "calib.json", {"boardName": "DM9095", "cameraData": sockets, "version": 6})
    return Expected(folder, SMALL, [view], poses=False)


def scannetpp_iphone(folder: Path, room: Room) -> Expected:
    """ScanNet++'s iPhone: rgb/frame_000000.jpg, depth/ 256x192, pose_intrinsic_imu.json by frame, lists of 10."""
    from .room import PHONE

    folder = folder / "iphone"
    color_camera = PHONE.sized(1920, 1440)
    views, frames = room.through(PHONE, 2), {}
    for k, (view, large) in enumerate(zip(views, room.through(color_camera, 2), strict=True)):
        picture(folder / f"rgb/frame_{10 * k:06d}.jpg", large.color)
        depth16(folder / f"depth/frame_{10 * k:06d}.png", view.depth)
        frames[f"frame_{10 * k:06d}"] = {
            "timestamp": 0.16 * k,
            "pose": view.pose.tolist(),
            "intrinsic": color_camera.matrix.tolist(),
            "aligned_pose": view.pose.tolist(),
        }
    as_json(folder / "pose_intrinsic_imu.json", frames)
    as_json(folder / "exif.json", {"frame_000000": {"FocalLength": 5.7}})
    return Expected(folder, PHONE, views, pixels=0.6)


def redwood_indoor(folder: Path, room: Room) -> Expected:
    """Redwood indoor (Choi 2015): livingroom1-color/, livingroom1-depth-clean/, livingroom1-traj.txt; no camera."""
    views, lines = room.through(KINECT), []
    for k, view in enumerate(views):
        picture(folder / f"livingroom1-color/{k:05d}.jpg", view.color)
        depth16(folder / f"livingroom1-depth-clean/{k:05d}.png", view.depth)
        lines += [f"{k} {k} {k + 1}", *rows(view.pose)]
    text(folder / "livingroom1-traj.txt", *lines)
    return Expected(folder, KINECT, views, **without_camera(KINECT))


def redwood_scan_zip(folder: Path, room: Room) -> Expected:
    """A large dataset of object scans (Choi 2016): 00001.zip of rgb/ and depth/ whose numbers and times differ."""
    import zipfile

    views = room.through(KINECT)
    for k, view in enumerate(views):
        picture(folder / f"rgb/{2 * k + 1:07d}-{66738 * k + 18:012d}.jpg", view.color)
        depth16(folder / f"depth/{2 * k + 1:07d}-{66738 * k:012d}.png", view.depth)
    with zipfile.ZipFile(folder / "00001.zip", "w") as archive:
        for name in ("rgb", "depth"):
            for path in sorted((folder / name).iterdir()):
                archive.write(path, f"{name}/{path.name}")
    return Expected(folder / "00001.zip", KINECT, views, poses=False, **without_camera(KINECT))


def co_fusion(folder: Path, room: Room) -> Expected:
    """Co-Fusion (Runz 2017): color/Color0001.png, depth/Depth0001.exr, mask_id, calibration.txt fx fy cx cy w h."""
    views = room.through(SMALL)
    from .writing import exr

    for k, view in enumerate(views, 1):
        picture(folder / f"color/Color{k:04d}.png", view.color)
        exr(folder / f"depth/Depth{k:04d}.exr", R=view.depth, G=view.depth, B=view.depth)
        picture(folder / f"mask_id/Mask{k:04d}.png", np.full((240, 320), 1, np.uint8))
    text(folder / "calibration.txt", f"{SMALL.fx} {SMALL.fy} {SMALL.cx} {SMALL.cy} 320 240")
    return Expected(folder, SMALL, views, poses=False)


def cityscapes(folder: Path, room: Room) -> Expected:
    """Cityscapes: leftImg8bit, disparity 16-bit (p - 1) / 256, camera/*_camera.json with u0, v0 and the baseline."""
    camera = Pinhole(283.2, 283.2, 160.4, 118.3, 320, 240)
    views = room.through(camera, 2, 8)
    for k, view in enumerate(views):
        stem = f"aachen_{k:06d}_000019"
        picture(folder / f"leftImg8bit/{stem}_leftImg8bit.png", view.color)
        disparity = np.where(view.depth > 0, 0.209313 * camera.fx / view.depth.clip(1) * 256 + 1, 0)
        picture(folder / f"disparity/{stem}_disparity.png", np.rint(disparity).astype(np.uint16))
        inner = {"fx": camera.fx, "fy": camera.fy, "u0": camera.cx, "v0": camera.cy}
        outer = {"baseline": 0.209313, "pitch": 0.03, "roll": 0.0, "x": 1.7, "y": 0.1, "yaw": -0.02, "z": 1.18}
        as_json(folder / f"camera/{stem}_camera.json", {"extrinsic": outer, "intrinsic": inner})
    return Expected(folder, camera, views, poses=False, metric=False)


def middlebury_2003(folder: Path, room: Room) -> Expected:
    """Middlebury 2003's cones and teddy: im2.png, im6.png, disp2.png, disp6.png in 8 bits, 4 a pixel; no camera."""
    view = room.through(SMALL, 1)[0]
    for number in (2, 6):
        picture(folder / f"im{number}.png", view.color if number == 2 else np.ascontiguousarray(255 - view.color))
        disparity = np.where(view.depth > 0, 4 * 0.16 * SMALL.fx / view.depth.clip(0.1), 0).clip(0, 255)
        disparity = disparity if number == 2 else disparity[:, ::-1]
        picture(folder / f"disp{number}.png", np.rint(disparity).astype(np.uint8))
    return Expected(folder, SMALL, [view], poses=False, metric=False, **without_camera(SMALL))


def middlebury_2006(folder: Path, room: Room) -> Expected:
    """Middlebury 2005 and 2006: view1.png, view5.png, disp1.png, disp5.png in 8 bits, dmin.txt; no camera."""
    view = room.through(SMALL, 1)[0]
    for number in (1, 5):
        picture(folder / f"view{number}.png", view.color if number == 1 else np.ascontiguousarray(255 - view.color))
        disparity = np.where(view.depth > 0, 4 * 0.16 * SMALL.fx / view.depth.clip(0.1), 0).clip(0, 255)
        disparity = disparity if number == 1 else disparity[:, ::-1]
        picture(folder / f"disp{number}.png", np.rint(disparity).astype(np.uint8))
    text(folder / "dmin.txt", "270")
    return Expected(folder, SMALL, [view], poses=False, metric=False, **without_camera(SMALL))


def foundation_stereo(folder: Path, room: Room) -> Expected:
    """FoundationStereo's demo: left.png, right.png, depth_meter.npy, vis.png, K.txt of 9 numbers and the baseline."""
    view = room.through(SMALL, 1)[0]
    picture(folder / "left.png", view.color)
    picture(folder / "right.png", np.ascontiguousarray(255 - view.color))
    np.save(folder / "depth_meter.npy", view.depth)
    picture(folder / "vis.png", np.full((240, 640, 3), (70, 20, 200), np.uint8))
    text(folder / "K.txt", numbers(SMALL.matrix.reshape(-1), "%.4f"), "0.0635")
    return Expected(folder, SMALL, [view], poses=False)


MAKERS = (
    bundle_fusion,
    three_r_scan,
    infinitam,
    nyu_raw,
    princeton_tracking,
    openloris,
    ros_bag_pictures,
    rtabmap,
    spectacular_ai,
    azure_kinect,
    zed_export,
    oak_calibration,
    scannetpp_iphone,
    redwood_indoor,
    redwood_scan_zip,
    co_fusion,
    cityscapes,
    middlebury_2003,
    middlebury_2006,
    foundation_stereo,
)
