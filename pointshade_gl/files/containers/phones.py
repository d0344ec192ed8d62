"""Reads what phones write: HEIC and JPEG photographs with depth, and recordings of the app Record3D."""

from __future__ import annotations

import binascii
import re
import tempfile
from contextlib import suppress
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note, once
from ...notes.words import shown
from ...scene.camera import OPENGL, Camera, from_quaternions
from ..access import content
from ..access.content import LONGEST_SIDE, MAX_PIXELS, TEXT_BYTES, FilePath
from ..arrays.compression import Archive, unpack_lzfse
from ..cameras.camera_files import EXIF, camera_from_exif, camera_of_lens
from ..cameras.intrinsics import Intrinsics
from ..pictures.color_profiles import in_srgb
from ..pictures.hdr_files import read_exr
from ..pictures.picture_files import TURNED, decode_image
from .container_contents import Contents, Frames, as_color

BRANDS = (b"heic", b"heix", b"heim", b"heis", b"hevc", b"mif1", b"msf1")
_PACKET = re.compile(rb"<x:xmpmeta(?:(?!<x:xmpmeta).){1,20000}?</x:xmpmeta>", re.DOTALL)
_MATRIX = re.compile(rb"IntrinsicMatrix>(.{1,2000}?)</depthData:IntrinsicMatrix>", re.DOTALL)
_NUMBER = rb"{}(?:>|=\")([-+0-9.eE]+)"
_QUARTERS = {3: 2, 6: 1, 8: 3}  # of a turn clockwise, for each EXIF orientation without mirroring
_CORNER = 0.5  # pixels from the corner of a picture to the centre of its first pixel
_BROKEN = "is a broken or truncated HEIC picture"
_INVERSE_Z = 0  # HEIF's representation_type


def is_heic(head: bytes) -> bool:
    """Whether a file with these first bytes is an HEIF picture of the kind phones write."""
    return head[4:8] == b"ftyp" and head[8:12] in BRANDS


def open_heic(path: FilePath, note: Note, max_pixels: float = MAX_PIXELS) -> Frames:
    """The frame of a photograph. Raises ValueError without the extra `heic`, for a broken file, and without depth."""
    pillow_heif = content.import_extra("pillow_heif", "heic", f"{path} is an HEIC picture")
    data = content.read_bytes(path, max_pixels)
    photo = _open(pillow_heif, data, path)
    pictures = photo.info.get("depth_images") or []
    if not pictures:
        raise ValueError(f"{path} has no depth in it: phones add it in portrait mode")
    for picture in (photo, pictures[0]):
        width, height = picture.size
        content.check_pixels(width, height, str(path), max_pixels)
    return Frames(1, lambda _: _read(path, data, _open(pillow_heif, data, path), note))


def _read(path: FilePath, data: bytes, photo: Any, note: Note) -> Contents:
    from PIL import Image

    exif = Image.Exif()
    with suppress(Exception):  # Pillow raises of everything for broken bytes: then EXIF holds nothing
        exif.load(photo.info.get("exif") or b"")
        exif.get_ifd(EXIF)
    quarters = _QUARTERS.get(exif.get(TURNED, 1), 0)
    with content.naming(path, _BROKEN, (ValueError, RuntimeError, EOFError, OSError)):
        colors = Image.fromarray(np.ascontiguousarray(np.array(photo)[..., :3]))
        color = np.asarray(in_srgb(colors, photo.info, str(path), note))
        raw = np.array(photo.info["depth_images"][0])
    if raw.ndim == 3:
        raw = raw[..., 0]
    if quarters % 2 and (raw.shape[0] > raw.shape[1]) != (color.shape[0] > color.shape[1]):
        raw = np.ascontiguousarray(np.rot90(raw, -quarters))
    packet = next((found for found in _PACKET.findall(data) if b"AuxiliaryImageType" in found), b"")
    depth, kind, scale = _distances(raw, packet, photo.info["depth_images"][0].info["metadata"], str(path), note)
    camera = _from_apple(packet, quarters, color.shape, str(path))
    matrix = photo.info.get("heif", {}).get("camera_intrinsic_matrix")
    if camera is None and matrix:
        fx, fy, cx, cy = (matrix[f"{name}_{axis}"] for name in ("focal_length", "principal_point") for axis in "xy")
        camera = Intrinsics(str(path), (fx, fy, cx - _CORNER, cy - _CORNER), tuple(photo.size))
    if camera is None:
        exif[TURNED] = 1  # the picture is upright already
        camera = camera_of_lens(str(path), exif, (color.shape[1], color.shape[0]))
        if camera is not None:
            note(f"{path}: the camera is taken from the lens in EXIF, fx {camera.numbers[0]:.0f}")
    if camera is not None:
        camera = replace(camera, depth_scale=scale, depth_kind=kind)
    return Contents(depth, color, camera, depth_kind=kind, depth_scale=scale)


def _distances(
    raw: NDArray[Any], packet: bytes, heif: dict[str, Any] | None, name: str, note: Note
) -> tuple[NDArray[Any], str, float | None]:
    """Metres, or 1/metres, of the codes of a depth picture; with the kind, and the scale if one is known."""
    share = raw.astype(np.float32) / np.iinfo(raw.dtype).max
    low, high = _number(packet, b"FloatMinValue"), _number(packet, b"FloatMaxValue")
    kind = "z" if re.search(rb"AuxiliaryImageType(?:>|=\")depth", packet) else "inverse"
    if re.search(rb"Accuracy(?:>|=\")relative", packet):
        note(f"{name}: the phone measured depth up to a factor, its metres are not certain")
    if low is not None and high is not None and low < high:
        return np.float32(low) + share * np.float32(high - low), kind, 1.0
    near, far = ((heif or {}).get(key) for key in ("z_near", "z_far"))
    if near and far and (heif or {}).get("representation_type") == _INVERSE_Z:
        return np.float32(1 / far) + share * np.float32(1 / near - 1 / far), "inverse", 1.0
    note(f"{name} does not say what its depth means: it is taken as inverse depth without a scale")
    return raw, "inverse", None


def _from_apple(packet: bytes, quarters: int, shape: tuple[int, ...], name: str) -> Intrinsics | None:
    """The matrix that the phone wrote for its sensor, turned as the picture was."""
    matrix = _MATRIX.search(packet)
    width, height = (_number(packet, b"IntrinsicMatrixReference" + side) for side in (b"Width", b"Height"))
    numbers = [float(text) for text in re.findall(rb"<rdf:li>([-+0-9.eE]{1,30})</rdf:li>", matrix[1])] if matrix else []
    if len(numbers) != 9 or not width or not height:
        return None
    fx, fy, cx, cy = numbers[0], numbers[4], numbers[6] - _CORNER, numbers[7] - _CORNER  # column by column
    for _ in range(quarters):
        fx, fy, cx, cy, width, height = fy, fx, height - 1 - cy, cx, height, width
    across, down = shape[1] / width, shape[0] / height
    numbers = fx * across, fy * down, (cx + _CORNER) * across - _CORNER, (cy + _CORNER) * down - _CORNER
    return Intrinsics(name, numbers, (shape[1], shape[0]))


def _number(packet: bytes, key: bytes) -> float | None:
    found = re.search(_NUMBER.replace(b"{}", key), packet)
    try:
        return float(found[1]) if found else None
    except ValueError:
        return None


def _open(pillow_heif: Any, data: bytes, path: FilePath) -> Any:
    with content.naming(path, _BROKEN, (ValueError, RuntimeError, EOFError, SyntaxError, IndexError)):
        file = pillow_heif.open_heif(data)
        return file[file.primary_index]


_SEGMENT, _START, _SCAN = b"\xff\xe1", b"\xff\xd8", 0xDA
_XMP, _MORE_XMP = b"http://ns.adobe.com/xap/1.0/\0", b"http://ns.adobe.com/xmp/extension/\0"
_MORE_HEAD = 32 + 4 + 4  # of each part that follows: whose it is, the length of all, where it begins


def read_gdepth(path: FilePath, note: Note, max_pixels: float = MAX_PIXELS) -> Contents | None:
    """The frame of a JPEG with Google's GDepth in its XMP; None for any other. Raises ValueError for a broken one."""
    if not content.read_head(path).startswith(_START):
        return None
    data = content.read_bytes(path, max_pixels)
    packet = _xmp_of(data)
    if b"GDepth:" not in packet:
        return None
    near, far = (_number(packet, b"GDepth:" + name) for name in (b"Near", b"Far"))
    picture = re.search(rb"GDepth:Data(?:>|=\")([A-Za-z0-9+/=\s]+)", packet)
    with content.naming(path, "is a JPEG with a broken GDepth", (ValueError,)):
        if picture is None or not near or not far:
            raise ValueError("its XMP has no Data, Near or Far")
        raw = decode_image(BytesIO(binascii.a2b_base64(picture[1])), f"{path}'s depth", max_pixels)
        raw = raw[..., 0] if raw.ndim == 3 else raw
        share = raw / np.float32(np.iinfo(raw.dtype).max)  # raises for floats
    is_linear = re.search(rb"GDepth:Format(?:>|=\")RangeLinear", packet)
    depth = near + share * (far - near) if is_linear else 1 / ((1 - share) / near + share / far)
    if not re.search(rb"GDepth:Units(?:>|=\")m", packet):
        note(f"{path} does not say the unit of its depth: metres are taken")
    kind = "ray" if re.search(rb"GDepth:MeasureType(?:>|=\")OpticRay", packet) else "z"
    camera = camera_from_exif(path, max_pixels)
    if camera is not None:
        note(f"{path}: the camera is taken from the lens in EXIF, fx {camera.numbers[0]:.0f}")
    with BytesIO(data) as file:
        color = as_color(decode_image(file, str(path), max_pixels, note))
    return Contents(depth.astype(np.float32), color, camera, depth_kind=kind, depth_scale=1.0)


def has_gdepth(path: FilePath) -> bool:
    head = content.read_head(path, 2**16)
    return head.startswith(_START) and b"GDepth:" in head


def _xmp_of(data: bytes) -> bytes:
    """The XMP of a JPEG, and what follows it in further segments."""
    first, more, at = b"", {}, 2
    while data[at : at + 1] == b"\xff" and at + 4 <= len(data) and data[at + 1] != _SCAN:
        size = int.from_bytes(data[at + 2 : at + 4], "big")
        body = data[at + 4 : at + 2 + size]
        if data[at : at + 2] == _SEGMENT and body.startswith(_XMP):
            first += body[len(_XMP) :]
        elif data[at : at + 2] == _SEGMENT and body.startswith(_MORE_XMP):
            part = body[len(_MORE_XMP) :]
            more[int.from_bytes(part[36:40], "big")] = part[_MORE_HEAD:]
        at += 2 + max(size, 2)
    return first + b"".join(more[key] for key in sorted(more))


_METADATA = re.compile(r"(?P<root>(?:.*/)?)metadata(?:\.json)?")
_DEPTH = re.compile(r"(?P<root>(?:.*/)?)(?:rgbd/(?P<packed>\d{1,9})\.depth|depth/(?P<exr>\d{1,9})\.exr)")
_COLORS = ("rgbd/{}.jpg", "rgb/{}.jpg", "rgb/{}.png", "rgbd/{}.png")


class Unpacked:
    """The files of a recording that lies in a folder."""

    def __init__(self, path: Path, max_pixels: float = MAX_PIXELS):
        self.path, self._max_pixels = path, max_pixels
        places = [path, *(path / name for name in ("rgbd", "rgb", "depth"))]
        files = (file for place in places if place.is_dir() for file in place.iterdir() if file.is_file())
        self.names = {file.relative_to(path).as_posix() for file in files}

    def read(self, name: str) -> bytes:
        return content.read_bytes(self.path / name, self._max_pixels)


def open_record3d(files: Archive | Unpacked, note: Note, max_pixels: float = MAX_PIXELS) -> Frames | None:
    """The frames of a recording, by their numbers; None if it is none. Raises ValueError for broken metadata."""
    depths = [match for member in files.names if (match := _DEPTH.fullmatch(member))]
    roots = {match["root"] for match in depths}  # beside a frame are its metadata
    name = next((one for one in sorted(files.names) if (m := _METADATA.fullmatch(one)) and m["root"] in roots), None)
    if name is None:
        return None
    title, data, root = f"{files.path}/{name}", files.read(name), name.removesuffix(".json").removesuffix("metadata")
    content.check_limit(len(data), f"{title} has {len(data)} bytes", max_pixels, TEXT_BYTES)
    metadata = content.parse_object(data.decode("utf-8", "replace"), Path(title), max_pixels)
    if not {"w", "h"} <= metadata.keys():
        return None  # another program's
    frames = {int(match["packed"] or match["exr"]): match[0] for match in depths if match["root"] == root}
    reader = _Recording(files, title, root, metadata, frames, sorted(frames), once(note), max_pixels)
    return Frames(len(frames), reader.read)


@dataclass(frozen=True)
class _Recording:
    files: Archive | Unpacked
    title: str
    root: str
    metadata: dict[str, Any]
    frames: dict[int, str]
    numbers: list[int]
    note: Note
    max_pixels: float

    def read(self, k: int) -> Contents:
        number = self.numbers[k]
        member = self.frames[number]
        if member.endswith(".exr"):
            with tempfile.TemporaryDirectory() as folder:  # the library reads files only
                path = Path(folder) / Path(member).name
                path.write_bytes(self.files.read(member))
                depth, valid = read_exr(path, self.max_pixels), None
        else:
            depth, valid = self._packed(member, f"{self.root}rgbd/{number}.conf")
        color = None
        found = [name for pattern in _COLORS if (name := self.root + pattern.format(number)) in self.files.names]
        if found:
            name = f"{self.files.path}/{found[0]}"
            color = as_color(decode_image(BytesIO(self.files.read(found[0])), name, self.max_pixels, self.note))
        poses = self.metadata.get("poses")
        poses = poses if isinstance(poses, list) else []
        row = number if self.numbers[-1] < len(poses) else k  # frames may have been thinned out
        pose = None
        if row < len(poses):
            values = self._numbers(poses[row], 7, "poses")
            pose = from_quaternions(np.array([values[4:]]), np.array([values[:4]]))[0] @ OPENGL
        return Contents(depth, color, self._camera(row, color), pose, valid)

    def _packed(self, member: str, confidence: str) -> tuple[NDArray[Any], NDArray[np.bool_] | None]:
        """Depth, and where it is not of the lowest confidence."""
        width, height = self._side("dw", 192), self._side("dh", 256)
        name = f"{self.files.path}/{member}"
        content.check_pixels(width, height, name, self.max_pixels)
        data = unpack_lzfse(self.files.read(member), 4 * width * height, name)
        depth = np.frombuffer(data, "<f4").reshape(height, width)
        if confidence not in self.files.names:
            return depth, None
        data = unpack_lzfse(self.files.read(confidence), width * height, f"{self.files.path}/{confidence}")
        valid = np.frombuffer(data, np.uint8).reshape(height, width) > 0
        if not valid.all():
            self.note(f"{self.files.path}: {np.mean(~valid):.0%} of the depth is of low confidence and left out")
        return depth, valid

    def _camera(self, row: int, color: NDArray[Any] | None) -> Intrinsics:
        """Of the colour picture, which may be larger than in the metadata."""
        each, k = self.metadata.get("perFrameIntrinsicCoeffs"), self.metadata.get("K")
        if isinstance(each, list) and row < len(each):
            fx, fy, cx, cy = self._numbers(each[row], 4, "perFrameIntrinsicCoeffs")
        else:
            columns = self._numbers(k, 9, "K")
            fx, fy, cx, cy = columns[0], columns[4], columns[6], columns[7]
        size = self._side("w", 0), self._side("h", 0)
        try:
            camera = Camera(fx, fy, cx - _CORNER, cy - _CORNER, *size)
        except ValueError as error:
            raise ValueError(f"{self.title}: {error}") from None
        if color is not None:
            camera = camera.resized(color.shape[1], color.shape[0])
        return Intrinsics(self.title, camera.intrinsics, (camera.width, camera.height), 1.0, "z")

    def _numbers(self, value: Any, count: int, key: str) -> list[float]:
        try:
            numbers = [float(number) for number in value]
        except (TypeError, ValueError, OverflowError):
            numbers = []
        if len(numbers) != count:
            raise ValueError(f"{self.title}: {key} must be {count} numbers, got {shown(value)}")
        return numbers

    def _side(self, key: str, default: int) -> int:
        value = self.metadata.get(key, default)
        if not isinstance(value, int) or not 1 <= value <= LONGEST_SIDE:
            raise ValueError(f"{self.title}: {key} must be a whole number of pixels above 0, got {shown(value)}")
        return value
