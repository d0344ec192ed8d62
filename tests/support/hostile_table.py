"""What strangers may send: for each input how it is loaded, what makes it, and the sentence that it ends in."""

import json
import os
import struct

import numpy as np

from . import hostile_files as made
from .gltf_files import document, write_gltf


def put(name, data):
    """A file of that name instead of the depth picture, loaded as one."""

    def build(folder):
        made.frame(folder)
        (folder / name).write_bytes(data() if callable(data) else data)
        return {"depth": folder / name, "fov": 50}

    return build


def pipe(option):
    """A pipe that nobody writes to, or a device without an end, in place of a file."""

    def build(folder):
        made.frame(folder)
        os.mkfifo(folder / "pipe")
        return folder, {option: folder / "pipe"}

    return build


def device(option):
    return lambda folder: (made.frame(folder), {option: "/dev/zero"})


def camera(**values):
    return lambda folder: made.frame(folder, **values)


def cloud(name, data):
    """A file of that name, loaded as a point cloud."""

    def build(folder):
        (folder / name).write_bytes(data() if callable(data) else data)
        return folder / name

    return build


def long_cloud(name, size, head):
    def build(folder):
        made.sparse(folder / name, size, head)
        return folder / name

    return build


PLY = (
    b"ply\nformat binary_little_endian 1.0\nelement vertex %s\n"
    b"property float x\nproperty float y\nproperty float z\nend_header\n"
)
PCD = b"VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH %s\nHEIGHT 1\nPOINTS %s\nDATA %s\n"
LISTS = PLY.replace(b"float x\n", b"float x\nproperty list uint int a\n") % b"9"
LZF_BOMB = PCD % (b"90000000", b"90000000", b"binary_compressed") + struct.pack("<II", 3000, 1_080_000_000)
LZF_BOMB += b"\0a" + b"\xe0\xff\0" * 999 + b"\0"


def poses(name, text):
    def build(folder):
        made.sequence(folder)
        (folder / name).write_text(text if isinstance(text, str) else json.dumps(text))
        return folder

    return build


def scene(**values):
    return lambda folder: write_gltf(folder, document(**values))


def node(**values):
    return scene(nodes=[{"name": "a"} | values])


def said(**values):
    return lambda folder: made.points(folder, **values)


def outside(name, list_name="depth.txt"):
    return lambda folder: made.listed(folder, name, list_name)


def link(name, target):
    return lambda folder: made.linked(folder, name, target)


def sparse(name, size, head=b"", **options):
    def build(folder):
        made.frame(folder)
        made.sparse(folder / name, size, head)
        return (folder, dict.fromkeys(options, folder / name)) if options else folder / name

    return build


def in_another_folder(folder):
    """A number that is also the name of a file in the working directory, which is not the scene's."""
    (folder / "scene").mkdir()
    made.save(made.DEPTH, folder / "1.5.png")
    (folder / "1.5.png").rename(folder / "1.5")
    return made.write_gltf(folder / "scene", document(nodes=[{"extras": {"pointshade": {"depth": "1.5", "fov": 50}}}]))


def list_in_a_scene(folder):
    path = made.points(folder)
    (folder / "my_frame" / "depth.png").unlink()
    (folder / "my_frame" / "depth.txt").write_text("1.0 ../../secret/depth.png\n")
    return path


def linked_list(folder):
    path = made.linked(folder, "depth.txt", "secret/pose.txt")
    (folder / "my_frame" / "depth.png").unlink()
    return path


def loop(folder):
    (folder / "out.png").symlink_to("back.png")
    (folder / "back.png").symlink_to("out.png")
    return folder / "out.png"


def nested(depth):
    value = 1
    for _ in range(depth):
        value = [value]
    return value


OUT = "is an address or an absolute path, expected a path relative to"
NAMES = {
    "a list with an absolute path": ("source", outside("{secret}/depth.png"), f"{OUT} the folder"),
    "a list that goes up": ("source", outside("../secret/depth.png"), "leaves the folder"),
    "a list that goes up later": ("source", outside("a/../../secret/depth.png"), "leaves the folder"),
    "a list that goes up on Windows": ("source", outside("..\\secret\\depth.png"), "leaves the folder"),
    "a list with a drive": ("source", outside("C:\\secret\\depth.png"), OUT),
    "a list with an address": ("source", outside("https://example.org/depth.png"), "and nothing is fetched"),
    "a list of colours": ("frame", outside("../secret/depth.png", "rgb.txt"), "rgb.txt: '../secret/depth.png' leaves"),
    "a list in a scene's frame": ("scene", list_in_a_scene, "depth.txt: '../../secret/depth.png' leaves the folder"),
    "a number that is a file elsewhere": ("scene", in_another_folder, "'1.5' does not exist in"),
    "a scene's depth elsewhere": ("scene", said(depth="../secret/depth.png"), "leaves the scene's folder"),
    "a scene's pose elsewhere": ("scene", said(pose="../secret/pose.txt"), "leaves the scene's folder"),
    "a scene's sizes elsewhere": ("scene", said(size="../secret/size.npy"), "leaves the scene's folder"),
    "a scene's camera elsewhere": ("scene", said(intrinsics="/etc/passwd"), f"{OUT} the scene's folder"),
    "a linked picture": ("scene", link("depth.png", "secret/depth.png"), "'depth.png' leaves the scene's folder"),
    "a linked camera": ("scene", link("intrinsics.json", "secret/intrinsics.json"), "'intrinsics.json' leaves"),
    "a linked list": ("scene", linked_list, "'depth.txt' leaves the scene's folder"),
    "a linked folder": ("scene", link("rgb/0.png", "secret/depth.png"), "leaves the scene's folder"),
    "links in a row": ("scene", made.links_in_a_row, "leaves the scene's folder"),
    "a buffer elsewhere": ("scene", scene(buffers=[{"byteLength": 42, "uri": "..%2fsecret/scene.bin"}]), "leaves the"),
}  # fmt: skip
AMOUNTS = {
    "a png": ("frame", put("a.png", made.png(16384, 16384)), "has 16384x16384 pixels, the limit is 134217728: pass ma"),
    "a long png": ("frame", put("a.png", made.png(1, 2**31 - 1)), "the limit for a side is 65536"),
    "a png without its pixels": ("frame", put("a.png", made.png(12000, 11000)), "broken or truncated"),
    "a bmp": ("frame", put("a.bmp", lambda: made.patched("BMP", 18, b"\0\xf0\0\0\0\xf0\0\0")), "61440x61440 pixels"),
    "a gif": ("frame", put("a.gif", lambda: made.patched("GIF", 6, b"\xff\xff\xff\xff")), "65535x65535 pixels"),
    "a jpeg": ("frame", put("a.jpg", made.jpeg), "60000x60000 pixels"),
    "a webp": ("frame", put("a.webp", lambda: made.patched("WEBP", 26, b"\xff\x3f\xff\x3f")), "16383x16383 pixels"),
    "a tiff": ("frame", put("a.tif", lambda: made.tiff(256, 50000, 50000)), "50000x50000 pixels"),
    "a pfm": ("frame", put("a.pfm", b"Pf\n50000 50000\n-1.0\n"), "50000x50000 pixels"),
    "a pgm": ("frame", put("a.pgm", b"P5 50000 50000 65535\n"), "50000x50000 pixels"),
    "a pgm of text": ("frame", put("a.pgm", b"P2 8000 8000 255\n" + b"1 " * 9), "truncated: expected 64000000 pixels"),
    "an exr": ("frame", put("a.exr", made.exr), "40000x40000 pixels"),
    "an npy": ("frame", put("a.npy", made.npy((40000, 40000))), "1600000000 values of shape (40000, 40000), the lim"),
    "an npy beyond all numbers": ("frame", put("a.npy", made.npy(f"({'9' * 99},)")), "the limit is 134217728"),
    "an npy without its values": ("frame", put("a.npy", made.npy((2, 2))), "it has 0 of 32 bytes"),
    "an npz": ("frame", put("a.npz", lambda: made.npz(a=made.npy((40000, 40000)))), "shape (40000, 40000)"),
    "an npz that unpacks to 200 MB": (
        "frame", put("a.npz", lambda: made.npz(a=made.npy((200_000_000,), "|u1", bytes(200_000_000)))), "200000000 v"),
    "an npz with a long header": (
        "frame", put("a.npz", lambda: made.npz(a=b"\x93NUMPY\x02\0" + b"\0\0\0\x10" + bytes(2**24))), "435456 bytes"),
    "a scene's array": ("scene", said(size="big.npy"), "'big.npy' does not exist"),
    "a pipe for depth": ("frame", pipe("depth"), "is a pipe or a device, expected a file"),
    "a pipe for colour": ("frame", pipe("color"), "is a pipe or a device"),
    "a pipe for a camera": ("frame", pipe("intrinsics"), "is a pipe or a device"),
    "a pipe for a pose": ("frame", pipe("pose"), "is a pipe or a device"),
    "a device for depth": ("frame", device("depth"), "is a pipe or a device"),
    "a device for a camera": ("frame", device("intrinsics"), "is a pipe or a device"),
    "a device for a pose": ("frame", device("pose"), "is a pipe or a device"),
    "a device for a scene": ("scene", lambda _: "/dev/zero", "is a pipe or a device"),
    "a camera of 3 GB": ("frame", sparse("a.json", 3 * 2**30, b"{", intrinsics=True), "3221225472 bytes, the limit"),
    "a pose of 3 GB": ("frame", sparse("a.txt", 3 * 2**30, b"1 ", pose=True), "has 3221225472 bytes, the limit"),
    "a picture of 3 GB": ("frame", sparse("a.png", 3 * 2**30, b"\x89PNG", depth=True), "the limit is 2147483648"),
    "a picture of 2 GB": ("frame", sparse("a.png", 2**31, made.png(9, 9)[:60], depth=True), "broken or truncated"),
    "a scene of 3 GB": ("scene", sparse("a.gltf", 3 * 2**30, b"{"), "has 3221225472 bytes, the limit is 134217728"),
    "a glb of 3 GB": ("scene", made.long_glb, "has 3221225472 bytes, the limit is 536870912"),
    "as many numbers as fit": ("source", poses("groundtruth.txt", "1 " * (2**22 - 1)), "holds no poses: expected t x"),
    "a long list": ("source", poses("depth.txt", "1 a.png\n" * 200_000), "depth.txt has 200000 lines"),
    "as many lines as fit": ("source", poses("depth.txt", "1 a.png\n" * 100_000), "a.png does not exist"),
    "deep JSON": ("frame", camera(fx="x", more=nested(900)), "holds no camera"),
    "many values": ("scene", scene(extras=[[]] * 4_200_000), "is JSON of"),
    "many nodes": ("scene", scene(nodes=[{}] * 140_000), "has 140000 nodes, the limit is 131072"),
    "many corners": ("scene", lambda folder: made.many_primitives(folder, 20_000, 9_999), "corners and indices, the"),
    "many frames": ("scene", lambda folder: made.many_frames(folder, 300), "has 257 frames, the limit is 256"),
    "a ply that counts too much": ("cloud", cloud("a.ply", PLY % b"99999999999"), "before the last of 99999999999"),
    "a ply of long lists": ("cloud", cloud("a.ply", LISTS + b"\xff" * 99), "it ends before the last of 9 rows"),
    "a pcd that counts too much": ("cloud", cloud("a.pcd", PCD % (b"9" * 9, b"9" * 9, b"binary")), "999999999 points,"),
    "a pcd that unpacks to 1 GB": ("cloud", cloud("a.pcd", LZF_BOMB), "packed bytes cannot give 1080000000"),
    "a pcd of many numbers a point": (
        "cloud", cloud("a.pcd", PCD.replace(b"T 1 1", b"T 1 999999") % (b"9", b"9", b"ascii")), "999999 numbers a po"),
    "an xyz of 3 GB": ("cloud", long_cloud("a.xyz", 3 * 2**30, b"1 2 3\n"), "3221225472 bytes, the limit is 134217728"),
    "an xyz of one long line": ("cloud", cloud("a.xyz", lambda: b"1 2 3\n" + b"1 " * 2**21), "point 1 is '1 1 1"),
    "an npz of 1 GB of points": (
        "cloud", cloud("a.npz", lambda: made.npz(points=made.npy((2**26, 3), "<f4", bytes(2**27)))), "to 805306368 b"),
    "an npy of more points than it has": ("cloud", cloud("a.npy", made.npy((10**7, 3), "<f4")), "0 of 120000000 bytes"),
    "a las that counts too much": ("cloud", made.las_counting, "broken or truncated LAS file"),
    "zeros for a cloud": ("cloud", cloud("a.ply", lambda: b"ply\n" + bytes(2**20)), "is a broken PLY file"),
    "a pipe for a cloud": ("cloud", lambda folder: (os.mkfifo(folder / "a.ply"), folder / "a.ply")[1], "is a pipe or"),
    "a cycle of nodes": ("scene", lambda folder: made.chain(folder, 16_000, cycle=True), "a scene has no cycles"),
    "a wide camera": (
        "scene",
        scene(nodes=[{"camera": 0}], cameras=[{"type": "perspective", "perspective": {"yfov": 1, "aspectRatio": 1e9}}]),
        "the limit for a side",
    ),
}  # fmt: skip
NUMBERS = {
    "a huge focal length": ("frame", camera(fx=made.HUGE), "camera fx must be a finite number of pixels"),
    "a tiny focal length": ("frame", camera(fx=1e-320), "camera fx must be above 0 pixels"),
    "a huge width": ("frame", camera(width=made.HUGE), "must be whole numbers of pixels"),
    "a huge scale": ("frame", camera(depth_scale=made.HUGE), "depth_scale must be a finite number above 0, got inf"),
    "a huge matrix": ("frame", camera(fx=None, intrinsic_matrix=[made.HUGE] * 9), "holds no camera"),
    "a kind that is a list": ("frame", camera(depth_kind=["z"]), "depth_kind must be a text, got ['z']"),
    "frames that are none": ("source", poses("transforms.json", {"frames": None}), "frames must be a list, got None"),
    "frames that are numbers": ("source", poses("transforms.json", {"frames": [1]}), "must have a transform_matrix"),
    "a huge transform": (
        "source", poses("transforms.json", {"frames": [{"transform_matrix": [made.HUGE] * 16}]}), "transform_matrix"),
    "transforms that are a list": ("source", poses("transforms.json", []), "must hold a JSON object, got []"),
    "a huge pose": ("source", poses("trajectory.log", "1e300 " * 57), "pose must be finite"),
    "an array of one number": ("frame", put("a.npy", made.npy((), body=bytes(8))), "must have shape (h, w), got ()"),
    "an array of objects": ("frame", put("a.npy", made.npy((2, 2), "|O")), "or one with Python objects"),
    "an array of texts": ("frame", put("a.npy", made.npy((2, 2), "<U3")), "it holds <U3"),
    "an array of complex numbers": ("frame", put("a.npy", made.npy((2, 2), "<c16", bytes(64))), "it holds complex128"),
    "an array of less than nothing": ("frame", put("a.npy", made.npy((-2, 2))), "shape (-2, 2)"),
    "a huge translation": ("scene", node(translation=[made.HUGE, 0, 0]), "translation must be 3 numbers"),
    "a huge angle": ("scene", said(fov=made.HUGE), "fov must be a number"),
    "a huge size": ("scene", said(size=made.HUGE), "size must be a number"),
    "huge sizes": ("scene", said(size=[[made.HUGE]]), "size must be numbers"),
    "a huge count": (
        "scene", scene(accessors=[{"componentType": 5126, "count": made.HUGE, "type": "VEC3"}]), "must be a whole"),
    "a name that is a number": ("scene", node(name=7), "is not valid glTF 2.0: nodes[0].name must be a text, got 7"),
    "extensions that are a list": ("scene", node(extensions=[1]), "nodes[0].extensions must be an object"),
    "extras of great depth": ("scene", said(intrinsics=nested(900)), "node 'a': "),
    "a long text for a name": ("scene", said(frame="x" * 99_999), "a file must be named by a text, got 'xxx"),
    "a link that leads back to itself": ("save", loop, "is a link that leads back to itself"),
    "a slow film": ("film", lambda folder: (folder / "a.gif", {"fps": 1e-5}), "from 0.01 to 1000, got 1e-05"),
}  # fmt: skip
FINE = {  # these are no attacks, and load as quickly
    "a deep scene": ("scene", lambda folder: made.chain(folder, 16_000)),
    "a ply of a million faces": ("cloud", cloud("a.ply", lambda: PLY % b"2" + bytes(24))),
    "a text of many remarks": ("cloud", cloud("a.xyz", lambda: b"# a remark\n" * 5_000 + b"1 2 3\n")),
    "a deep comb": ("scene", lambda folder: made.chain(folder, 6_000, comb=True)),
    "an npz whose other array is large": (
        "frame",
        lambda folder: put(
            "a.npz",
            made.npz(depth=made.npy((6, 8), "<f4", np.ones(48, "<f4").tobytes()), bomb=made.npy((2**28,), "|u1")),
        )(folder),
    ),
    "a list that stays": ("source", lambda folder: stays(folder)),
}
ALLOWED = {  # what the option lets through
    "a list": ("source", outside("../secret/depth.png")),
    "an absolute path": ("source", outside("{secret}/depth.png")),
    "a link": ("scene", link("depth.png", "secret/depth.png")),
    "a scene": ("scene", said(depth="../secret/depth.png")),
}


def stays(folder):
    """The user's own links may lead anywhere, and a/.. is nothing, also where a is a link."""
    place = made.secret(folder)
    (folder / "elsewhere").symlink_to(place)
    (folder / "0.png").symlink_to(place / "depth.png")
    (folder / "intrinsics.json").symlink_to(place / "intrinsics.json")
    (folder / "depth.txt").write_text("1.0 elsewhere/depth.png\n2.0 0.png\n3.0 elsewhere/../0.png\n")
    return folder
