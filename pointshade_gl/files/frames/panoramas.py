"""Panoramas (equirectangular): how they are known, and the six pinhole frames of 90 degrees that each becomes."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import as_one, option
from ...scene.camera import Camera, check_pose
from ...scene.values import median, quantile
from ..access.content import FilePath, open_regular, read_head
from ..arrays.numpy_files import NUMPY, NpyArray
from ..cameras.intrinsics import Intrinsics
from ..cameras.lenses import PANORAMA, colors_at, depth_at
from ..cameras.pose_files import load_pose
from ..containers.container_contents import Contents
from ..depth.depth_coding import decode
from ..depth.depth_kinds import to_metres
from ..pictures.hdr_files import EXR
from ..pictures.picture_files import opened_picture
from .assembly import drop_invalid, hints_of, read_colors_of, read_raw_depth, with_contents
from .frame_parts import FrameParts, ReadOptions, is_path

OF_PANORAMA = "the panorama"  # where poses and cameras of its frames are from
_XMP = b"equirectangular"  # GPano:ProjectionType, in the first bytes of a photograph
_XMP_BYTES = 1 << 17
_EXR_WINDOW = b"dataWindow\0box2i\0"
_POLE = 0.02  # of the median: so little the depth of a pole's row varies
_VARIES = 0.1  # of the median: the depth along the horizon does at least
_MEETS = 2.0  # times as far as neighbouring columns are apart, the first and the last may be
_SAME = 0.25  # of that, what mirror images differ by at most
_BESIDE = 8  # columns on each side that show how far apart neighbours are there
_APART = 0.5  # of how far apart columns are half a turn from each other
# Camera-to-world rotations of the six: ahead, to the right, behind, to the left, up, down.
FACES = np.array([
    [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
    [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],
    [[0, 0, -1], [0, 1, 0], [1, 0, 0]],
    [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
    [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
], float)  # fmt: skip


def as_pinholes(
    parts: Sequence[FrameParts], options: ReadOptions, note: Note
) -> tuple[Sequence[FrameParts], ReadOptions]:
    """Return six frames in the place of each panorama, and the options that still apply; others as they are. The first
    decides for all. Raises ValueError for depth that a panorama cannot have."""
    if not parts:
        return parts, options
    first = parts[0]
    is_known = any(one is not None for one in (options.projection, options.intrinsics, options.fov, first.filed))
    size = None if is_known or first.contents is not None else _size_of(first)
    if first.contents is not None and not is_known:
        try:
            held = first.contents()  # once: what is read here is what the first frame is made of
        except (ValueError, OSError):
            return parts, options  # reported when the frame is asked for
        if held.intrinsics is not None:
            return [_with_read(first, held), *parts[1:]], options
        parts, size = [_with_read(first, held), *parts[1:]], (held.depth.shape[1], held.depth.shape[0])
    why = _why_panorama(parts[0], options, size)
    if not why:
        return parts, options
    if options.depth_kind not in (None, "ray", "inverse"):
        expected = f"pass {option('depth_kind', 'ray', 'inverse')}, or leave it out"
        raise ValueError(f"the depth of a panorama is measured along its rays: {expected}, got {options.depth_kind}")
    name = Path(parts[0].name).name or "the picture"
    what = f"{name} is taken as a panorama (equirectangular, with lengths of rays), as {why}"
    ways_out = f"{as_one()}, {option('projection', 'pinhole')} takes it as it is"
    note(f"{what}: it becomes six frames of 90 degrees; {ways_out}")
    given: Any = load_pose(options.pose) if is_path(options.pose) else options.pose
    found = [one if given is None else one._replace(pose=check_pose(given)) for one in parts]
    whole = _Panoramas(options, note)
    read = ReadOptions(max_pixels=options.max_pixels, scale_frames="keep", projection="pinhole")
    return [_face(whole, one, k) for one in found for k in range(len(FACES))], read


def _with_read(part: FrameParts, held: Contents) -> FrameParts:
    """Return the parts of a frame whose container was read: it need not be read again."""
    kept, read = [held], part.contents
    assert read is not None
    return part._replace(contents=lambda: kept.pop() if kept else read())


def _face(whole: _Panoramas, part: FrameParts, k: int) -> FrameParts:
    pose = np.eye(4) if part.pose is None else part.pose.copy()
    pose[:3, :3] = pose[:3, :3] @ FACES[k]
    number = part.number * len(FACES) + k
    color = part.color if is_path(part.color) else None
    return FrameParts(None, color, None, pose, number=number, contents=partial(whole.face, part, k), path=part.path)


def _why_panorama(part: FrameParts, options: ReadOptions, size: tuple[int, int] | None) -> str:
    """Why a frame's pictures are a panorama; "" if they are none."""
    if options.projection is not None:
        return f"{option('projection', PANORAMA)} says" if options.projection == PANORAMA else ""
    if options.intrinsics is not None or options.fov is not None:
        return ""
    if part.filed is not None:
        is_said = part.filed.lens is not None and part.filed.lens.curve == PANORAMA
        return f"{part.filed.name} says" if is_said else ""
    if is_path(part.color) and is_marked(part.color):
        return f"the XMP of {Path(part.color).name} says"
    if size is None or size[0] != 2 * size[1]:
        return ""
    return "its edges meet and its poles are constant" if _closes(part, options) else ""


def is_marked(path: FilePath) -> bool:
    """Return whether the XMP of a photograph says that it is equirectangular."""
    return _XMP in read_head(path, _XMP_BYTES)


def _size_of(part: FrameParts) -> tuple[int, int] | None:
    """Width and height of a frame's depth by the file's first bytes, or by those of its colours; None if unknown."""
    if not is_path(part.depth):
        shape = np.shape(part.depth)  # type: ignore[arg-type]
        return (shape[1], shape[0]) if len(shape) > 1 else None
    for path in (part.depth, part.color):
        if not is_path(path):
            continue
        head = read_head(path, 4096)
        if head.startswith(NUMPY):
            sides: list[int] = []
            with suppress(ValueError):  # records, or broken: what reads it says so
                sides = [side for side in NpyArray(path).shape if side != 1]
            return (sides[1], sides[0]) if len(sides) > 1 else None
        if (at := head.find(_EXR_WINDOW)) >= 0 and head.startswith(EXR):
            left, top, right, bottom = struct.unpack_from("<4i", head, at + len(_EXR_WINDOW) + 4)
            return right - left + 1, bottom - top + 1
        with suppress(Exception), open_regular(path, is_probed=True) as file, opened_picture(file, head) as image:
            return image.size
    return None


def _closes(part: FrameParts, options: ReadOptions) -> bool:
    """Whether depth and colours go on from the last column to the first, and the depth has poles."""
    try:
        part, depth = _lengths(part, options, lambda _: None)
        known = np.where(depth > 0, depth, np.nan)
        if not _has_poles(known, part.color is None) or (_is_mirrored(known) and not _goes_on(known)):
            return False
        if part.color is None:
            return _meets(known)
        colors = read_colors_of(part, options.max_pixels)
    except (ValueError, OSError):
        return False  # reported when the frame is read
    return _meets(known) and colors is not None and _meets(colors[..., :3].astype(float))


def _has_poles(depth: NDArray[Any], is_needed: bool) -> bool:
    """Whether the first and the last row have one value each, as the horizon has not; NaN is unknown. is_needed: it
    must be known: photographs of the whole sphere often lack both."""
    horizon, (top, bottom) = depth[len(depth) // 3 : -(len(depth) // 3)], (row[row > 0] for row in depth[[0, -1]])
    if not np.isfinite(horizon).any() or (is_needed and not (top.size and bottom.size)):
        return False
    middle = median(horizon[np.isfinite(horizon)])
    is_one = all(not row.size or np.std(row) < _POLE * middle for row in (top, bottom))
    return bool(is_one and np.nanstd(horizon) > _VARIES * middle)


@np.errstate(all="ignore")
def _meets(values: NDArray[Any]) -> bool:
    """Whether the last column is as near to the first as neighbouring columns are to each other."""

    def apart(step: int) -> NDArray[Any]:
        away = abs(values - np.roll(values, step, axis=1)).reshape(len(values), values.shape[1], -1)
        known = np.isfinite(away)
        return np.where(known, away, 0).sum(axis=(0, 2)) / known.sum(axis=(0, 2))

    near, far = apart(1), apart(values.shape[1] // 2)
    others, far = near[1:][np.isfinite(near[1:])], far[np.isfinite(far)]
    if not (others.size and far.size):
        return False
    usual = max(median(others), *others[:_BESIDE], *others[-_BESIDE:])
    return bool(near[0] <= _MEETS * usual and near[0] <= _APART * median(far))


def _is_mirrored(depth: NDArray[Any]) -> bool:
    """Whether the left half is the right one's mirror image: then both edges are alike in any picture."""
    alike, apart = (abs(depth - other) for other in (depth[:, ::-1], np.roll(depth, depth.shape[1] // 2, axis=1)))
    alike, apart = alike[np.isfinite(alike)], apart[np.isfinite(apart)]
    return bool(alike.size and apart.size and alike.mean() < _SAME * apart.mean())


@np.errstate(all="ignore")
def _goes_on(depth: NDArray[Any]) -> bool:
    """Whether surfaces are as straight across the edge as elsewhere: in a corridor both edges are alike, but turn."""
    bends = abs(np.roll(depth, 1, axis=1) - 2 * depth + np.roll(depth, -1, axis=1))
    found = [quantile(known, 0.75) for known in (one[np.isfinite(one)] for one in bends.T) if known.size]
    edge = bends[:, 0][np.isfinite(bends[:, 0])]
    return bool(edge.size) and quantile(edge, 0.75) <= 3 * median(found)


def _lengths(part: FrameParts, options: ReadOptions, note: Note) -> tuple[FrameParts, NDArray[np.float32]]:
    """The parts of a panorama, unpacked, and (h, w) lengths of its rays in metres, 0 where missing."""
    part = with_contents(part, options, note)
    if part.contents is not None:
        held = part.contents()
        part = part._replace(depth=held.depth, valid=held.valid, coded=(held.depth_kind, held.depth_scale))
        part = part if held.color is None else part._replace(color=held.color)
    raw, name = read_raw_depth(part, part.filed, options, note), part.name or "depth"
    if raw.ndim != 2:
        raise ValueError(f"{name} holds points, expected the lengths of a panorama's rays")
    hints = hints_of(part.filed, part, options, raw, lambda: None)
    if hints.any_kind is None and raw.dtype.itemsize > 1:  # planes are no planes in it, and tell nothing
        hints = replace(hints, filed_kind="ray")
    values, coding = decode(raw, name, hints, note)
    if coding.kind not in ("z", "ray", "inverse"):
        raise ValueError(f"{name} holds depth of kind {coding.kind}, expected ray or inverse of a panorama")
    kind = "inverse" if coding.kind == "inverse" else "z"  # as it stands: along the rays
    height, width = values.shape
    camera = Camera(width, width, width / 2, height / 2, width, height)  # which says nothing to these kinds
    metres = to_metres(values, camera, kind, coding.scale, None, note, np.float32)
    if part.valid is not None:
        drop_invalid(metres, part.valid, options.max_pixels, note)
    return part, metres


class _Panoramas:
    """Reads panoramas, and keeps the last one: its six frames are asked for one after another."""

    def __init__(self, options: ReadOptions, note: Note):
        self._options, self._note = options, note
        self._kept: tuple[FrameParts, NDArray[np.float32], NDArray[Any] | None] | None = None

    def face(self, part: FrameParts, k: int) -> Contents:
        """Return one of the six. Raises ValueError unless the panorama is twice as wide as high."""
        kept = self._kept
        if kept is None or kept[0] is not part:
            found, depth = _lengths(part, self._options, self._note)
            kept = self._kept = part, depth, read_colors_of(found, self._options.max_pixels, self._note)
        _, depth, color = kept
        for picture, what in ((depth, "depth"), (color, "color")):
            if picture is not None and picture.shape[1] != 2 * picture.shape[0]:
                size = f"{picture.shape[1]}x{picture.shape[0]}"
                raise ValueError(f"a panorama must be twice as wide as high, its {what} is {size}")
        size = _side(depth)
        around = _closed(depth)
        z = depth_at(around, *_places(depth, size, k)) / np.linalg.norm(_rays(size), axis=-1)
        seen = None if color is None else colors_at(_closed(color), *_places(color, _side(color), k))
        camera = Intrinsics(OF_PANORAMA, (size / 2, size / 2, (size - 1) / 2, (size - 1) / 2), (size, size), 1.0, "z")
        return Contents(z.astype(np.float32), seen, camera, depth_kind="z", depth_scale=1.0)


def _side(picture: NDArray[Any]) -> int:
    """The pixels of a frame's side with which its middle is as fine as the panorama."""
    return max(1, round(picture.shape[1] / math.pi))


def _rays(size: int) -> NDArray[np.float64]:
    return Camera(size / 2, size / 2, (size - 1) / 2, (size - 1) / 2, size, size).rays()


def _closed(picture: NDArray[Any]) -> NDArray[Any]:
    """The picture with one column more at both sides and two rows more: what lies beyond edges and poles."""
    half = picture.shape[1] // 2
    tall = np.concatenate([np.roll(picture[:1], half, 1), picture, np.roll(picture[-1:], half, 1)])
    return np.concatenate([tall[:, -2:], tall, tall[:, :2]], axis=1)


def _places(picture: NDArray[Any], size: int, k: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The column and the row of each pixel of a frame in the closed panorama, whose middle looks ahead."""
    height, width = picture.shape[:2]
    x, y, z = np.moveaxis(_rays(size) @ FACES[k].T, -1, 0)
    columns = (np.arctan2(x, z) / (2 * np.pi) + 0.5) * width + 1.5
    return columns, (np.arctan2(y, np.hypot(x, z)) / np.pi + 0.5) * height + 0.5
