"""Reads arrays from .npy, .npz and text files, all of them or frame by frame; and depth of MPI Sintel and COLMAP."""

from __future__ import annotations

import math
import re
import struct
import threading
from array import array
from collections.abc import Iterable, Sequence
from io import BufferedIOBase, BytesIO
from typing import Any, Protocol, cast

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import option, shown
from ...scene.camera import from_matrices
from ..access import content
from ..access.content import FILE_BYTES, MAX_PIXELS, TEXT_BYTES, FilePath
from .compression import METHODS, Archive

NUMPY = b"\x93NUMPY"
_TO_BLANKS = str.maketrans(dict.fromkeys(",;[]()", " "))
_BLOCK = 2**20  # bytes read at once
_HEADER = 10_000  # bytes of the longest header, as in NumPy
BROKEN = "is a broken NumPy file, or one with Python objects"


def read_npy(
    path: FilePath, max_pixels: float = MAX_PIXELS, share: float | None = None, kinds: str = "biuf"
) -> NDArray[Any]:
    """The array of an .npy file. Raises ValueError for a broken one, for Python objects and for too many values."""
    with content.open_regular(path) as file:
        return _read(file, str(path), max_pixels, share, kinds)


def read_npz(path: FilePath, note: Note, max_pixels: float = MAX_PIXELS, wanted: str | None = None) -> NDArray[Any]:
    """The only array of an .npz file, or its depth; others stay packed. Raises ValueError for what `read_npy` does."""
    import zipfile  # only here

    # zipfile raises of everything for broken bytes
    with content.open_regular(path) as file, content.naming(path, BROKEN), zipfile.ZipFile(file) as archive:
        members = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
        listed = ", ".join([*members][:8]) + (" and more" if len(members) > 8 else "")
        wanted = wanted or "depth"
        if wanted not in members and (len(members) != 1 or wanted != "depth"):
            way_out = f": pass {option('channel', 'NAME')}" if len(members) > 1 else ""
            raise ValueError(f"{path} must hold one array or one named {wanted}, got {listed or 'none'}{way_out}")
        member = members[wanted] if wanted in members else next(iter(members.values()))
        if member.compress_type not in METHODS:
            raise ValueError(f"{path} {BROKEN}: it is packed in another way than NumPy does it")
        with archive.open(member) as stream:
            depth = _read(cast(BufferedIOBase, stream), str(path), max_pixels, None)
    if len(members) > 1:
        note(f"{path} holds {listed}: {wanted} is taken")
    return depth


def read_numbers(path: FilePath, max_pixels: float = MAX_PIXELS) -> NDArray[np.float64]:
    """(n,) all numbers of a text, .json or .npy file, row after row. Raises ValueError for any other content."""
    if content.read_head(path).startswith(NUMPY):
        numbers = read_npy(path, max_pixels, TEXT_BYTES)
        if numbers.dtype.kind not in "iuf":
            raise ValueError(f"{path} must hold numbers only, got {numbers.dtype}")
        return numbers.astype(np.float64).ravel()
    text = content.read_text(path, max_pixels)
    found = parse_numbers(re.sub(r"#[^\r\n]*", "", text).translate(_TO_BLANKS))
    if not found.size:
        raise ValueError(f"{path} must hold numbers only, got {shown(text[:40])}")
    return found


def parse_numbers(text: str) -> NDArray[np.float64]:
    """(n,) the numbers between the blanks of a text; none if it holds anything else."""
    found = array("d")  # 8 bytes a number, where a list takes 80; so words are split a few thousand at a time
    try:
        for part in re.finditer(r"(?s).{1,65536}\S*", text):
            found.extend(map(float, part[0].split()))
    except ValueError:
        return np.empty(0)
    return np.array(found)


def _read(
    stream: BufferedIOBase, name: str, max_pixels: float, share: float | None, kinds: str = "biuf"
) -> NDArray[Any]:
    with content.naming(name, BROKEN):  # NumPy raises of everything, too
        shape, is_fortran, dtype = read_header(stream, kinds)
    pixels = math.prod(shape[:-1] if len(shape) > 2 and shape[-1] in (3, 4) else shape)
    content.check_limit(pixels, f"{name} has {shown(pixels)} values of shape {shown(shape)}", max_pixels, share)
    with content.naming(name, BROKEN, (ValueError,)):
        array = read_exactly(stream, math.prod(shape) * dtype.itemsize)
    return array.view(dtype).reshape(shape, order="F" if is_fortran else "C")


def read_exactly(stream: BufferedIOBase, size: int) -> NDArray[np.uint8]:
    """The next bytes of a stream. Raises ValueError if it has fewer."""
    array = np.empty(size, np.uint8)
    data, done = array.data, 0
    while done < size:
        got = stream.readinto(data[done : done + _BLOCK])
        if not got:
            raise ValueError(f"it has {done} of {size} bytes")
        done += got
    return array


def read_header(stream: BufferedIOBase, kinds: str = "biuf") -> tuple[tuple[int, ...], bool, np.dtype]:
    """Shape, whether columns come first, and type of an .npy file. Raises ValueError for anything but plain numbers.
    kinds: of types, as NumPy calls them; with V also records of plain numbers."""
    version = npy.read_magic(stream)
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"its version is {version[0]}.{version[1]}, known are 1.0 and 2.0")
    size = stream.read(2 * version[0])
    length = int.from_bytes(size, "little")
    if length > _HEADER:
        raise ValueError(f"its header has {length} bytes")
    header = BytesIO(size + stream.read(length))
    read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, is_fortran, dtype = read(header)
    parts = [dtype[name].base for name in dtype.names] if dtype.names else [dtype]
    if dtype.kind not in kinds or any(one.kind not in "biuf" for one in parts) or min(shape, default=0) < 0:
        raise ValueError(f"it holds {dtype} of shape {shown(shape)}")
    return shape, is_fortran, dtype


# Role: names, the best first. Letters' case and everything but letters and digits do not count.
ROLES: dict[str, tuple[str, ...]] = {
    "depth": (
        "depth", "depths", "depth_map", "depth_maps", "metric_depth", "depth_meters", "depth_m", "depth_image",
        "depth_images", "pred_depth", "depth_pred", "im_depth", "raw_depth", "depth_z", "predicted_depth",
    ),
    "inverse": ("inverse_depth", "inv_depth", "depth_inv", "disparity", "disparities", "disp"),
    "ray": ("distance", "distances", "distance_map", "ray_depth", "depth_along_ray"),
    # (h, w, 3) in the camera's own axes, even beside a pose
    "own_points": ("local_points", "pts3d_cam", "pts3d_in_self_view", "points_cam", "cam_points"),
    # in the camera's axes or, beside a pose, in the world's: whichever a pinhole camera sees
    "points": ("points", "pts3d", "pts3ds", "point_map", "point_maps", "pointmap", "xyz", "world_points"),
    "color": (
        "image", "images", "rgb", "rgbs", "color", "colors", "colour", "colours", "img", "imgs", "processed_images",
        "im_rgb", "rgb_image", "rgb_images", "img_no_norm", "frame", "frames",
    ),
    "intrinsics": (
        "intrinsics", "intrinsic", "k", "ks", "cam_k", "camera_k", "camera_matrix", "intrinsic_matrix",
        "camera_intrinsics", "cam_intrinsics", "pred_intrinsics", "camera_intrinsic",
    ),
    "focal": ("focallength_px", "focal_length_px", "focal_px", "focal_length", "focal", "focals"),
    "center": ("principal_points", "principal_point", "pp", "pps"),
    "world_to_camera": ("extrinsics", "extrinsic", "w2c", "world_to_camera", "world2cam", "cam_w2c", "viewmats"),
    "camera_to_world": (
        "pose", "poses", "c2w", "cam2world", "cams2world", "camera_to_world", "cam_c2w", "camera_pose", "camera_poses",
        "cam_poses", "im_poses",
    ),
    "mask": ("mask", "masks", "valid", "valid_mask", "depth_mask"),
    "sky": ("sky", "sky_mask", "invalid", "invalid_mask"),
    "confidence": (
        "conf", "depth_conf", "confidence", "confidences", "confs", "depth_confidence", "conf_map", "world_points_conf",
    ),
    "normals": ("normal", "normals", "normal_map"),
    "scale": ("depth_scale", "factor_depth", "depth_factor"),
}  # fmt: skip
SURFACES = ("depth", "inverse", "ray", "own_points", "points")  # the first of them that a file has is its depth
MAYBE_INVERSE = ("predicted_depth",)  # inverse for the relative networks of a family, metres for its metric ones
MAYBE_ERROR = ("confidence",)  # UniDepth's and UniK3D's of floats is the error they expect: high where they are unsure
_LISTED = 12


def find_roles(names: Iterable[str]) -> dict[str, str]:
    """The best name for each role. Of names in groups, such as frame/depth, the last part counts."""
    found: dict[str, str] = {}
    for name in names:
        found.setdefault(plain(name.rpartition("/")[2]), name)
    keys = {role: next((key for key in map(plain, known) if key in found), None) for role, known in ROLES.items()}
    return {role: found[key] for role, key in keys.items() if key is not None}


def is_named(name: str, names: Sequence[str]) -> bool:
    return plain(name.rpartition("/")[2]) in map(plain, names)


def list_arrays(shapes: dict[str, tuple[int, ...]]) -> str:
    """Names and shapes for an error or a note."""
    listed = [f"{shown(name)[1:-1]} {shape}" for name, shape in list(shapes.items())[:_LISTED]]
    return ", ".join(listed) + (f" and {len(shapes) - _LISTED} more" if len(shapes) > _LISTED else "")


def plain(name: str) -> str:
    """A name in lower case, letters and digits only."""
    return "".join(filter(str.isalnum, name.lower()))


class Stored(Protocol):
    shape: tuple[int, ...]
    dtype: np.dtype

    def part(self, index: tuple[int, ...]) -> NDArray[Any]:
        """array[index], from any thread. Raises ValueError if the file is damaged, or the part too large."""
        ...


class NpyArray:
    """The array of an .npy file. Raises ValueError for a broken one, and for one with Python objects."""

    def __init__(self, path: FilePath, kinds: str = "biuf"):  # kinds: of its type, see `read_header`
        with content.open_regular(path) as file, content.naming(path, BROKEN):
            self.shape, is_fortran, self.dtype = read_header(file, kinds)
            start, order = file.tell(), "F" if is_fortran else "C"
            size = math.prod(self.shape)
            file.seek(0, 2)
            if file.tell() - start < size * self.dtype.itemsize:
                raise ValueError(f"it has {file.tell() - start} of {size * self.dtype.itemsize} bytes")
            self._array = np.memmap(path, self.dtype, "r", start, self.shape, order) if size else np.empty(self.shape)

    def part(self, index: tuple[int, ...]) -> NDArray[Any]:
        return np.array(self._array[index])


class NpzArray:
    """One array of an .npz archive, in which successive frames are unpacked once. Raises ValueError if it is broken."""

    def __init__(self, archive: Archive, member: str, kinds: str = "biuf"):
        self._archive, self._name, self._lock = archive, f"{archive.path}/{member}", threading.Lock()
        with content.naming(self._name, BROKEN):
            self._stream = archive.open(member)
            self.shape, self._is_fortran, self.dtype = read_header(self._stream, kinds)
            self._start = self._stream.tell()

    def part(self, index: tuple[int, ...]) -> NDArray[Any]:
        lead = 0 if self._is_fortran else len(index)
        shape = self.shape[lead:]
        size = math.prod(shape) * self.dtype.itemsize
        content.check_limit(
            size, f"{self._name} has {size} bytes of shape {shape}", self._archive.max_pixels, FILE_BYTES
        )
        place = int(np.ravel_multi_index(index, self.shape[:lead])) if lead else 0
        with self._lock, content.naming(self._name, BROKEN):
            self._stream.seek(self._start + place * size)
            array = read_exactly(self._stream, size).view(self.dtype)
        return array.reshape(shape, order="F")[index] if self._is_fortran else array.reshape(shape)


def npz_arrays(archive: Archive, kinds: str = "biuf") -> dict[str, Stored]:
    """The arrays of numbers of an .npz archive by name. Raises ValueError for other content under a name of ROLES.
    kinds: of their types, see `read_header`."""
    arrays: dict[str, Stored] = {}
    for member in archive.names:
        name = member.removesuffix(".npy")
        try:
            arrays[name] = NpzArray(archive, member, kinds)
        except ValueError:
            if find_roles([name]):
                raise
    return arrays


class HeldArray:
    def __init__(self, array: NDArray[Any]):
        self.shape, self.dtype, self._array = array.shape, array.dtype, array

    def part(self, index: tuple[int, ...]) -> NDArray[Any]:
        return self._array[index]


SINTEL = struct.pack("<f", 202021.25)
_CAMERA = 9 + 12  # numbers: K, and world-to-camera 3x4


def read_dpt(path: FilePath, max_pixels: float = MAX_PIXELS) -> NDArray[Any]:
    """(h, w) float32 metres (Sintel) or uint16 millimetres (LINEMOD). Raises ValueError for any other content."""
    data = content.read_bytes(path, max_pixels)
    is_sintel = data.startswith(SINTEL)
    start, dtype = (12, "<f4") if is_sintel else (8, "<u2")
    if len(data) < start:
        raise ValueError(f"{path} is a .dpt of {len(data)} bytes, expected a size and values")
    first, second = struct.unpack_from("<2i", data, start - 8)
    width, height = (first, second) if is_sintel else (second, first)
    content.check_pixels(width, height, str(path), max_pixels)
    expected = start + width * height * np.dtype(dtype).itemsize
    if min(width, height) < 1 or len(data) != expected:
        raise ValueError(f"{path} is a .dpt of {width}x{height} pixels and {len(data)} bytes, expected {expected}")
    values = np.frombuffer(data, dtype, offset=start)
    return values.astype(values.dtype.newbyteorder("=")).reshape(height, width)


def read_cam(path: FilePath, max_pixels: float = MAX_PIXELS) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(9,) K row after row and (4, 4) world-to-camera. Raises ValueError for a file of another size."""
    data = content.read_bytes(path, max_pixels)
    if len(data) != 4 + 8 * _CAMERA:
        raise ValueError(f"{path} has {len(data)} bytes, expected {4 + 8 * _CAMERA} of a .cam")
    numbers = np.frombuffer(data, "<f8", offset=4).astype(np.float64)
    return numbers[:9], from_matrices(numbers[None, 9:])[0]


_COLMAP_HEADER = re.compile(rb"(\d{1,9})&(\d{1,9})&(\d{1,9})&")
_LONGEST = 64  # bytes


def is_colmap_depth(head: bytes) -> bool:
    """Whether a file with these first bytes is one of COLMAP's arrays."""
    return _COLMAP_HEADER.match(head) is not None


def read_colmap_depth(path: FilePath, max_pixels: float = MAX_PIXELS) -> NDArray[Any]:
    """(h, w) float32, 0 where missing, in the reconstruction's units. Raises OSError or ValueError for another file."""
    header = _COLMAP_HEADER.match(content.read_head(path, _LONGEST))
    if header is None:
        raise ValueError(f"{path} is not a depth of COLMAP: expected width&height&1& before its values")
    width, height, channels = map(int, header.groups())
    if channels != 1 or not width or not height:
        raise ValueError(f"{path} is an array of {width}x{height} pixels and {channels} channels, expected one channel")
    content.check_pixels(width, height, str(path), max_pixels)
    with content.open_regular(path) as file, content.naming(path, "is truncated", (ValueError,)):
        file.seek(header.end())
        values = read_exactly(file, 4 * width * height)
    return values.view("<f4").astype(np.float32).reshape(height, width)
