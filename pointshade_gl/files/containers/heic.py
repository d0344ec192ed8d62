"""Reads HEIC photographs with depth, as iPhones write them in portrait mode.

The depth is a second picture of 8 bits inside. What its values mean stands in Apple's XMP beside it (1/m or m, from the
smallest to the largest number, and the camera's matrix), else in HEIF's own depth information.
"""

from __future__ import annotations

import re
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ..access.content import FilePath, import_extra, naming, read_bytes
from ..access.limits import MAX_PIXELS, check_pixels
from ..cameras.exif import EXIF, camera_of_lens
from ..cameras.intrinsics import Intrinsics
from ..pictures.color_profiles import in_srgb
from ..pictures.picture_files import TURNED
from .contents import Contents, Frames

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
    pillow_heif = import_extra("pillow_heif", "heic", f"{path} is an HEIC picture")
    data = read_bytes(path, max_pixels)
    photo = _open(pillow_heif, data, path)
    pictures = photo.info.get("depth_images") or []
    if not pictures:
        raise ValueError(f"{path} has no depth in it: phones add it in portrait mode")
    for picture in (photo, pictures[0]):
        width, height = picture.size
        check_pixels(width, height, str(path), max_pixels)
    return Frames(1, lambda _: _read(path, data, _open(pillow_heif, data, path), note))


def _read(path: FilePath, data: bytes, photo: Any, note: Note) -> Contents:
    from PIL import Image

    exif = Image.Exif()
    with suppress(Exception):  # Pillow raises of everything for broken bytes: then EXIF says nothing
        exif.load(photo.info.get("exif") or b"")
        exif.get_ifd(EXIF)
    quarters = _QUARTERS.get(exif.get(TURNED, 1), 0)
    with naming(path, _BROKEN, (ValueError, RuntimeError, EOFError, OSError)):
        photo_colors = Image.fromarray(np.ascontiguousarray(np.array(photo)[..., :3]))
        color, raw = (
            np.asarray(in_srgb(photo_colors, photo.info, str(path), note)),
            np.array(photo.info["depth_images"][0]),
        )
    if raw.ndim == 3:
        raw = raw[..., 0]
    if quarters % 2 and (raw.shape[0] > raw.shape[1]) != (color.shape[0] > color.shape[1]):
        raw = np.ascontiguousarray(np.rot90(raw, -quarters))
    packet = next((found for found in _PACKET.findall(data) if b"AuxiliaryImageType" in found), b"")
    depth, kind, scale = _distances(raw, packet, photo.info["depth_images"][0].info["metadata"], str(path), note)
    camera = _from_apple(packet, quarters, color.shape, str(path)) or _from_heif(photo, str(path))
    if camera is None:
        exif[TURNED] = 1  # the picture is upright already
        camera = camera_of_lens(str(path), exif, (color.shape[1], color.shape[0]))
        if camera is not None:
            note(f"{path}: the camera is taken from the lens in EXIF, fx {camera.numbers[0]:.0f}")
    if camera is not None:
        camera = Intrinsics(camera.name, camera.numbers, camera.size, scale, kind)
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


def _from_heif(photo: Any, name: str) -> Intrinsics | None:
    matrix = photo.info.get("heif", {}).get("camera_intrinsic_matrix")
    if not matrix:
        return None
    fx, fy, cx, cy = (matrix[f"{name}_{axis}"] for name in ("focal_length", "principal_point") for axis in "xy")
    return Intrinsics(name, (fx, fy, cx - _CORNER, cy - _CORNER), tuple(photo.size))


def _number(packet: bytes, key: bytes) -> float | None:
    found = re.search(_NUMBER.replace(b"{}", key), packet)
    try:
        return float(found[1]) if found else None
    except ValueError:
        return None


def _open(pillow_heif: Any, data: bytes, path: FilePath) -> Any:
    with naming(path, _BROKEN, (ValueError, RuntimeError, EOFError, SyntaxError, IndexError)):
        file = pillow_heif.open_heif(data)
        return file[file.primary_index]
