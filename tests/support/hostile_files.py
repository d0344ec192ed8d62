"""Small files that ask for too much, name what is not theirs, or hold what nobody expects.

Each function fills a folder and returns what is to be loaded, relative to it. Beside the folder lies another, secret,
with files that would be fine to read.
"""

from __future__ import annotations

import json
import os
import struct
import zipfile
import zlib
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image

from .gltf_files import data_uri, document, glb, write_gltf

DEPTH = (1000 + np.arange(48).reshape(6, 8)).astype(np.uint16)
CAMERA = {"width": 8, "height": 6, "fx": 9, "fy": 9, "cx": 3.5, "cy": 2.5, "depth_scale": 1000}
HUGE = 10**400


def save(array, path):
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(array).save(path)


def frame(folder, **camera):
    """A folder with a frame, and its camera with some entries changed."""
    save(DEPTH, folder / "depth.png")
    (folder / "intrinsics.json").write_text(json.dumps(CAMERA | camera))
    return folder


def sequence(folder):
    for k in range(3):
        save(DEPTH, folder / "depth" / f"{k}.png")
    (folder / "intrinsics.json").write_text(json.dumps(CAMERA))
    return folder


def secret(folder):
    """Beside the folder: a frame, a pose and an array."""
    place = folder.parent / "secret"
    frame(place)
    (place / "pose.txt").write_text("1 0 0 0  0 1 0 0  0 0 1 0  0 0 0 1")
    np.save(place / "size.npy", np.ones((6, 8), np.float32))
    (place / "scene.bin").write_bytes(bytes(42))
    return place


def listed(folder, name, list_name="depth.txt"):
    """A list of pictures that names one of them."""
    secret(folder)
    (folder / "intrinsics.json").write_text(json.dumps(CAMERA))
    if list_name != "depth.txt":
        save(DEPTH, folder / "1.depth.png")
    (folder / list_name).write_text(f"# time name\n1.0 {name.format(secret=folder.parent / 'secret')}\n")
    return folder


def points(folder, **said):
    """A scene with one point object in a folder of its own, and what its node says."""
    frame(folder / "my_frame")
    secret(folder)
    return write_gltf(folder, document(nodes=[{"name": "a", "extras": {"pointshade": {"frame": "my_frame"} | said}}]))


def linked(folder, name, target):
    """A scene whose frame has a link in it."""
    scene = points(folder)
    path = folder / "my_frame" / name
    path.unlink(missing_ok=True)
    path.parent.mkdir(exist_ok=True)
    path.symlink_to(Path(os.path.relpath(folder.parent / target, path.parent)))
    return scene


def links_in_a_row(folder):
    """The frame's pictures lie behind a link to a folder inside, in which they are links to others outside."""
    scene = points(folder)
    (folder / "my_frame" / "depth.png").unlink()
    (folder / "shelf").mkdir()
    (folder / "my_frame" / "depth").symlink_to("../shelf")
    (folder / "shelf" / "0.png").symlink_to(folder.parent / "secret" / "depth.png")
    return scene


def png(width, height, depth=16, kind=0, body=b""):
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">2I5B", width, height, depth, kind, 0, 0, 0)
    parts = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(body)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + parts


def patched(kind, at, values):
    """A picture of 8x6 pixels in a format of Pillow's, with other bytes somewhere."""
    file = BytesIO()
    Image.fromarray(np.zeros((6, 8, 3), np.uint8)).save(file, kind)
    data = bytearray(file.getvalue())
    data[at : at + len(values)] = values
    return bytes(data)


def jpeg():
    data = patched("JPEG", 0, b"")
    at = data.index(b"\xff\xc0") + 5
    return patched("JPEG", at, struct.pack(">2H", 60000, 60000))


def tiff(tag, *values):
    """A TIFF with another value in some of its tags."""
    data = bytearray(patched("TIFF", 0, b""))
    (at,) = struct.unpack_from("<I", data, 4)
    for k in range(struct.unpack_from("<H", data, at)[0]):
        place = at + 2 + 12 * k
        number = struct.unpack_from("<H", data, place)[0]
        if number in range(tag, tag + len(values)):
            struct.pack_into("<HHII", data, place, number, 4, 1, values[number - tag])
    return bytes(data)


def exr():
    import OpenEXR

    with TemporaryDirectory() as folder:
        path = Path(folder) / "picture.exr"
        with OpenEXR.File({"type": OpenEXR.scanlineimage}, {"Z": np.ones((6, 8), np.float32)}) as file:
            file.write(str(path))
        data = path.read_bytes()
    at = data.index(b"dataWindow\0box2i\0") + 21
    return data[:at] + struct.pack("<4i", 0, 0, 39999, 39999) + data[at + 16 :]


def npy(shape, kind="<f8", body=b""):
    """The header of an array, with hardly any array after it."""
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text) + 1) + text + b"\n" + body


def npz(**arrays):
    """Packed arrays; bytes are packed as they are."""
    file = BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, array in arrays.items():
            archive.writestr(f"{name}.npy", array)
    return file.getvalue()


def las_counting(folder):
    """A LAS file whose header counts 100 million points, and has none."""
    head = bytearray(375)
    head[:4], head[24:26] = b"LASF", b"\1\4"
    struct.pack_into("<HIIBH", head, 94, 375, 375, 0, 0, 20)
    struct.pack_into("<6d", head, 131, *[0.001] * 3, *[0.0] * 3)
    struct.pack_into("<Q", head, 247, 100_000_000)
    (folder / "a.las").write_bytes(head)
    return folder / "a.las"


def sparse(path, size, head=b""):
    """A file of many zeros that take no space."""
    with path.open("wb") as file:
        file.write(head)
        file.truncate(size)


def chain(folder, count, comb=False, cycle=False):
    """A scene as deep as it has nodes; a comb has a leaf on every level."""
    nodes = [{"children": [k + 1]} for k in range(count - 1)] + [{"children": [0] if cycle else []}]
    if comb:
        for node in nodes[:-1]:
            node["children"].append(len(nodes))
            nodes.append({"mesh": 0})
    return write_gltf(folder, document(nodes=nodes))


def many_primitives(folder, count, corners):
    """Many meshes of the same corners, which every one of them copies."""
    data = np.zeros((corners, 3), np.float32).tobytes()
    uri = data_uri(data)
    return write_gltf(folder, document(
        meshes=[{"primitives": [{"attributes": {"POSITION": 0}}] * count}],
        accessors=[{"bufferView": 0, "componentType": 5126, "count": corners, "type": "VEC3"}],
        bufferViews=[{"buffer": 0, "byteLength": len(data)}],
        buffers=[{"byteLength": len(data), "uri": uri}],
    ))  # fmt: skip


def many_frames(folder, count):
    frame(folder / "my_frame")
    nodes = [{"extras": {"pointshade": {"frame": "my_frame", "baseline": k + 1}}} for k in range(count)]
    return write_gltf(folder, document(nodes=nodes, scenes=[{"nodes": [*range(count)]}]))


def long_glb(folder):
    """A GLB whose length is that of a file that is mostly not there."""
    whole = glb(document(buffers=[{"byteLength": 42}]), bytes(42))
    path = folder / "scene.glb"
    sparse(path, 3 * 2**30, whole[:8] + struct.pack("<I", 3 * 2**30) + whole[12:])
    return path
