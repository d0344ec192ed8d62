"""Reads recordings of the app Record3D: .r3d files, and its exports of EXR and JPEG, zipped or as a folder.

Inside lie `metadata` (.json) and, for each frame n, rgbd/n.jpg, rgbd/n.depth and rgbd/n.conf (.r3d, packed by LZFSE),
or rgb/n.jpg and depth/n.exr (export). Depth is float32 in metres, NaN where missing; confidence is ARKit's 0, 1 or 2,
and 0 is left out. K is written column by column, for w x h pixels counted from the picture's corner; poses are
qx qy qz qw tx ty tz, camera-to-world, y up and z backwards.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Collection
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note, once
from ...notes.words import shown
from ...scene.camera import OPENGL, Camera, from_quaternions
from ..access.content import parse_object, read_bytes
from ..access.limits import LONGEST_SIDE, MAX_PIXELS, TEXT_BYTES, check_limit, check_pixels
from ..arrays.lzfse import unpack
from ..arrays.zip_archive import Archive
from ..cameras.intrinsics import Intrinsics
from ..pictures.exr import read_exr
from ..pictures.picture_files import decode_image
from .color_values import as_color
from .contents import Contents, Frames

_METADATA = re.compile(r"(?P<root>(?:.*/)?)metadata(?:\.json)?")
_DEPTH = re.compile(r"(?P<root>(?:.*/)?)(?:rgbd/(?P<packed>\d{1,9})\.depth|depth/(?P<exr>\d{1,9})\.exr)")
_COLORS = ("rgbd/{}.jpg", "rgb/{}.jpg", "rgb/{}.png", "rgbd/{}.png")
_CORNER = 0.5  # pixels from the corner of a picture to the centre of its first pixel


class Unpacked:
    """The files of a recording that lies in a folder."""

    def __init__(self, path: Path, max_pixels: float = MAX_PIXELS):
        self.path, self._max_pixels = path, max_pixels
        places = [path, *(path / name for name in ("rgbd", "rgb", "depth"))]
        files = (file for place in places if place.is_dir() for file in place.iterdir() if file.is_file())
        self.names = {file.relative_to(path).as_posix() for file in files}

    def read(self, name: str) -> bytes:
        return read_bytes(self.path / name, self._max_pixels)


def open_record3d(files: Archive | Unpacked, note: Note, max_pixels: float = MAX_PIXELS) -> Frames | None:
    """The frames of a recording, by their numbers; None if it is none. Raises ValueError for broken metadata."""
    name = _find_metadata(files.names)
    if name is None:
        return None
    title, data, root = f"{files.path}/{name}", files.read(name), name.removesuffix(".json").removesuffix("metadata")
    check_limit(len(data), f"{title} has {len(data)} bytes", max_pixels, TEXT_BYTES)
    metadata = parse_object(data.decode("utf-8", "replace"), Path(title), max_pixels)
    if not {"w", "h"} <= metadata.keys():
        return None  # another program's
    matches = [match for member in files.names if (match := _DEPTH.fullmatch(member)) and match["root"] == root]
    frames = {int(match["packed"] or match["exr"]): match[0] for match in matches}
    reader = _Recording(files, title, root, metadata, frames, sorted(frames), once(note), max_pixels)
    return Frames(len(frames), reader.read)


def _find_metadata(names: Collection[str]) -> str | None:
    """The name of the metadata that have a frame beside them."""
    roots = {match["root"] for name in names if (match := _DEPTH.fullmatch(name))}
    return next((name for name in sorted(names) if (m := _METADATA.fullmatch(name)) and m["root"] in roots), None)


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
            depth, valid = self._exr(member), None
        else:
            depth, valid = self._packed(member, f"{self.root}rgbd/{number}.conf")
        color = None
        found = [name for pattern in _COLORS if (name := self.root + pattern.format(number)) in self.files.names]
        if found:
            name = f"{self.files.path}/{found[0]}"
            color = as_color(decode_image(BytesIO(self.files.read(found[0])), name, self.max_pixels, self.note))
        row = number if self.numbers[-1] < len(self._poses) else k  # frames may have been thinned out
        return Contents(depth, color, self._camera(row, color), self._pose(row), valid)

    def _exr(self, member: str) -> NDArray[Any]:
        with tempfile.TemporaryDirectory() as folder:  # the library reads files only
            path = Path(folder) / Path(member).name
            path.write_bytes(self.files.read(member))
            return read_exr(path, self.max_pixels)

    def _packed(self, member: str, confidence: str) -> tuple[NDArray[Any], NDArray[np.bool_] | None]:
        """Depth, and where it is not of the lowest confidence."""
        width, height = self._side("dw", 192), self._side("dh", 256)
        name = f"{self.files.path}/{member}"
        check_pixels(width, height, name, self.max_pixels)
        depth = np.frombuffer(unpack(self.files.read(member), 4 * width * height, name), "<f4").reshape(height, width)
        if confidence not in self.files.names:
            return depth, None
        data = unpack(self.files.read(confidence), width * height, f"{self.files.path}/{confidence}")
        valid = np.frombuffer(data, np.uint8).reshape(height, width) > 0
        if not valid.all():
            self.note(f"{self.files.path}: {np.mean(~valid):.0%} of the depth is of low confidence and left out")
        return depth, valid

    @property
    def _poses(self) -> list[Any]:
        poses = self.metadata.get("poses")
        return poses if isinstance(poses, list) else []

    def _camera(self, row: int, color: NDArray[Any] | None) -> Intrinsics:
        """Of the colour picture, which may be larger than the metadata say."""
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

    def _pose(self, row: int) -> NDArray[np.float64] | None:
        if row >= len(self._poses):
            return None
        numbers = self._numbers(self._poses[row], 7, "poses")
        return from_quaternions(np.array([numbers[4:]]), np.array([numbers[:4]]))[0] @ OPENGL

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
