"""Whole files of every format, small ones made here and layouts of data sets: to be damaged.

Each item is a job for hostile_child, with the files that it may damage.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import pointshade_gl as ps

from . import cloud_files as clouds
from .gltf_files import document, write_gltf
from .heic_files import heic
from .layouts import MAKERS
from .layouts.room import Room
from .layouts.writing import exr, pfm

Item = dict[str, Any]
RANDOM = np.random.default_rng(3)
COLOR = RANDOM.integers(0, 256, (12, 16, 3), np.uint8)
DEPTH = (1 + 0.01 * np.arange(12)[:, None] + 0.02 * np.arange(16)).astype(np.float32)
CAMERA = {"width": 16, "height": 12, "fx": 20, "fy": 20, "cx": 7.5, "cy": 5.5, "depth_scale": 1000}
EACH_KIND = (
    "icl_nuim_tum", "redwood_sample", "washington_v2", "stray_scanner_video", "record3d", "arkitscenes", "colmap_dense",
    "blended_mvs", "nerfies", "wild_rgbd", "monosdf", "ros_camera_yaml", "opencv_yaml", "three_r_scan", "nyu_raw",
    "spectacular_ai", "co_fusion", "eth3d_mvs", "ycb_video", "ho3d", "linemod", "hypersim", "sintel", "polycam", "bop",
    "nerfstudio", "tum_freiburg1", "realsense_json",
)  # fmt: skip
MATRIX = np.array([[20, 0, 7.5], [0, 20, 5.5], [0, 0, 1.0]])


def item(folder: Path, call: str, *arguments: str, **options: Any) -> Item:
    files = [path.relative_to(folder).as_posix() for path in sorted(folder.rglob("*")) if path.is_file()]
    known = {key: value if isinstance(value, float | int) else str(value) for key, value in options.items()}
    return {"call": call, "folder": str(folder), "arguments": arguments, "options": known, "files": files}


def small_files(folder: Path) -> Iterator[Item]:
    """One folder for each format of depth, colour, camera and scene."""
    for number, (name, data) in enumerate(depth_files(folder)):
        place = folder / f"depth{number}"
        place.mkdir(parents=True)
        (place / name).write_bytes(data)
        yield item(place, "frame", depth=name, fov=50)
    for number, (name, data) in enumerate(color_files()):
        place = our_folder(folder / f"color{number}")
        (place / "color.png").unlink()
        (place / name).write_bytes(data)
        yield item(place, "source", ".") | {"files": [name]}
    yield item(our_folder(folder / "ours"), "source", ".")
    yield scene_with_a_folder(folder / "scene")
    for suffix in (".gltf", ".glb"):
        place = folder / f"saved{suffix}"
        place.mkdir()
        ps.save_scene(place / f"scene{suffix}", scene())
        yield item(place, "scene", f"scene{suffix}")
    place = folder / "containers"
    place.mkdir()
    for name, data in container_files():
        (place / name).write_bytes(data)
        yield item(place, "source", name, fov=50) | {"files": [name]}
    place = folder / "clouds"
    place.mkdir()
    write_clouds(place)
    for path in sorted(place.iterdir()):
        yield item(place, "cloud", path.name) | {"files": [path.name]}


def write_clouds(folder: Path) -> None:
    """Point clouds of every format."""
    points, normals, colors = clouds.bumpy(60)
    columns = {name: points[:, k] for k, name in enumerate("xyz")} | {"rgb": clouds.packed_colors(colors)}
    plain = {name: column for name, column in columns.items() if name != "rgb"}
    for coding in ("ascii", "binary", "binary_compressed"):
        (folder / f"{coding}.pcd").write_bytes(clouds.pcd(columns, coding))
    for form in ("ascii", "binary_little_endian", "binary_big_endian"):
        (folder / f"{form}.ply").write_bytes(clouds.ply_text(plain, ["up z"], form, [(0, 1, 2)] * 9))
    (folder / "gaussians.ply").write_bytes(clouds.ply_text(clouds.gaussians(40)[0], form="binary_little_endian"))
    np.savetxt(folder / "a.xyz", np.concatenate([points, colors], 1), header="x y z r g b")
    np.savetxt(folder / "a.csv", np.tile(points, (3, 1)), delimiter=",")
    np.save(folder / "a.npy", np.tile(points, (2, 1)))
    np.savez_compressed(folder / "a.npz", points=np.tile(points, (2, 1)), normals=np.tile(normals, (2, 1)))
    clouds.kitti(folder / "a.bin", 60)
    for name in ("a.las", "a.laz"):
        clouds.las(folder / name, clouds.on_map(60))
    clouds.e57(folder / "a.e57", [(points, (1, 2, 3), (1, 0, 0, 0), colors)])


def depth_files(folder: Path) -> Iterator[tuple[str, bytes]]:
    yield "a.npy", packed(np.save, DEPTH)
    yield "b.npy", packed(np.save, np.asfortranarray(DEPTH.astype(">f8")))
    yield "a.npz", packed(np.savez_compressed, depth=DEPTH)
    millimetres = np.rint(DEPTH * 1000).astype(np.uint16)
    yield "a.pgm", b"P5\n16 12\n65535\n" + millimetres.astype(">u2").tobytes()
    yield "b.pgm", b"P2\n# by hand\n16 12\n9999\n" + " ".join(map(str, millimetres.ravel())).encode()
    yield "a.dpt", b"PIEH" + np.array([16, 12], "<i4").tobytes() + DEPTH.tobytes()
    for name, array in (
        ("a.png", millimetres),
        ("a.tif", DEPTH),
        ("b.tif", millimetres),
        ("b.png", (80 * DEPTH).astype(np.uint8)),
    ):
        yield name, encoded(array, {"png": "PNG", "tif": "TIFF"}[name[2:]])
    for name, write in (("a.pfm", pfm), ("a.exr", lambda path, array: exr(path, Z=array))):
        write(folder / name, DEPTH)  # beside the folders
        yield name, (folder / name).read_bytes()


def color_files() -> Iterator[tuple[str, bytes]]:
    for name, kind in {"jpg": "JPEG", "webp": "WEBP", "bmp": "BMP", "gif": "GIF", "tif": "TIFF", "ppm": "PPM"}.items():
        yield f"color.{name}", encoded(COLOR, kind)


def container_files() -> Iterator[tuple[str, bytes]]:
    many = {"depth": DEPTH[None], "depth_conf": np.ones((1, 12, 16)), "extrinsic": np.eye(4)[None, :3]}
    yield "vggt.npz", packed(np.savez_compressed, intrinsic=MATRIX[None], images=COLOR[None] / 255, **many)
    yield "moge.npz", packed(np.savez, depth=DEPTH, mask=np.ones((12, 16), bool), intrinsics=MATRIX / 16)
    values = {"low": 0.5, "high": 2.0, "width": 16, "height": 12, "camera": (20, 20, 7.5, 5.5)}
    large = np.repeat(np.repeat(COLOR, 6, 0), 6, 1)
    yield "a.heic", heic(large, large[..., 0], apple=values)


def packed(save: Any, *arrays: np.ndarray, **named: np.ndarray) -> bytes:
    file = BytesIO()
    save(file, *arrays, **named)
    return file.getvalue()


def encoded(array: np.ndarray, kind: str) -> bytes:
    file = BytesIO()
    Image.fromarray(array).save(file, kind)
    return file.getvalue()


def our_folder(folder: Path) -> Path:
    folder.mkdir(parents=True)
    Image.fromarray(COLOR).save(folder / "color.png")
    Image.fromarray(np.rint(DEPTH * 1000).astype(np.uint16)).save(folder / "depth.png")
    (folder / "intrinsics.json").write_text(json.dumps(CAMERA))
    np.savetxt(folder / "pose.txt", np.eye(4))
    return folder


def scene_with_a_folder(folder: Path) -> Item:
    our_folder(folder / "my_frame")
    said = {"frame": "my_frame", "shading": "flat", "size": 2, "material": {"ambient": 0.2}, "pose": np.eye(4).tolist()}
    light = {"lights": [{"type": "spot", "color": [1, 0, 0], "intensity": 3, "spot": {"outerConeAngle": 0.5}}]}
    write_gltf(folder, document(
        nodes=[
            {"name": "leaf", "mesh": 0, "children": [1, 2]},
            {"extras": {"pointshade": said}, "rotation": [0, 0, 0, 1], "scale": [2, 2, 2]},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}, "camera": 0},
        ],
        extensions={"KHR_lights_punctual": light},
        cameras=[{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1, "aspectRatio": 1.5}}],
    ))  # fmt: skip
    return item(folder, "scene", "scene.gltf")


def scene() -> ps.Scene:
    uv, corners = RANDOM.random((5, 2)), RANDOM.normal(size=(5, 3))
    mesh = ps.Mesh(corners, [[0, 1, 2], [2, 3, 4]], normals=corners, uv=uv, texture=COLOR, shading="gouraud")
    frame = ps.Frame(COLOR, DEPTH, ps.Camera(20, 20, 7.5, 5.5, 16, 12))
    nodes = ps.Node(mesh, "mesh", children=(ps.Node(ps.PointObject(frame), "points"),)), ps.Node(ps.Light(), "light")
    return ps.Scene(nodes, camera=frame.camera)


def layouts(folder: Path, data: Path, every: bool) -> Iterator[Item]:
    """Layouts of data sets: all, or of each kind of file one that has it."""
    room = Room(data / "icl_livingroom_23views")
    for maker in MAKERS:
        if every or maker.__name__ in EACH_KIND:
            place = folder / maker.__name__
            place.mkdir(parents=True)
            expected = maker(place, room)
            yield item(place, "source", expected.source.relative_to(place).as_posix(), **expected.options)
