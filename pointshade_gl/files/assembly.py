"""The parts of one frame, from files or arrays, put together: depth in metres, colours, camera, pose."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..camera import Camera
from ..checks import as_given, check_choice, check_positive
from ..frame import Frame
from ..notes import Note
from ..wording import option
from .agreement import Reading
from .camera_files import read_intrinsics
from .colmap import is_colmap_depth, read_colmap_depth
from .containers.contents import SURE, Contents
from .content import FilePath, read_head
from .depth import one_channel, read_depth, read_raw
from .depth_coding import decode
from .depth_kinds import KINDS, Coding, Said, to_metres
from .intrinsics import Intrinsics, Size, merged, place_camera
from .known import CODINGS, COLOR_SUFFIXES, COMMON_CAMERAS, RAW_SUFFIXES, VIDEO_SUFFIXES
from .limits import MAX_PIXELS
from .picture_heads import is_picture
from .pictures import read_image
from .pose_files import load_pose
from .ray_lengths import is_ray_length

_OTHER_ASPECT = 0.02
_USUAL_FOV = 60.0  # degrees
_NAMES = 5  # folders of a path by which a data set is known


@dataclass(frozen=True)
class ReadOptions:
    """What the caller says about frames; see `load_frame`."""

    intrinsics: FilePath | ArrayLike | Camera | None = None
    fov: float | None = None
    depth_scale: float | None = None
    depth_kind: str | None = None
    baseline: float | None = None
    pose: FilePath | ArrayLike | None = None
    max_pixels: float = MAX_PIXELS

    def __post_init__(self) -> None:
        check_positive(self.max_pixels, option("max_pixels", beside_file=True))
        if self.intrinsics is not None and self.fov is not None:
            raise ValueError(f"pass {option('intrinsics')} or {option('fov')}, not both")
        if self.depth_kind is not None:
            check_choice(option("depth_kind"), self.depth_kind, KINDS)


class Parts(NamedTuple):
    """What belongs to one frame; files are read when it is assembled.

    filed    the camera that lies beside the pictures
    missing  what to add to the error if no camera is known
    number   counted from 0: which picture of a video is the colour
    contents reads what a container gives instead of a depth picture
    path     the file that holds the depth; None for the caller's own array
    """

    depth: FilePath | NDArray[Any] | None
    color: FilePath | NDArray[Any] | None = None
    filed: Intrinsics | None = None
    pose: NDArray[np.float64] | None = None
    valid: FilePath | NDArray[np.bool_] | None = None
    missing: str = ""
    number: int = 0
    contents: Callable[[], Contents] | None = None
    path: Path | None = None

    @property
    def name(self) -> str:
        """The file that the depth is from; "" for the caller's own array."""
        return str(self.path) if self.path else ""


class Found(NamedTuple):
    """Where a frame was found: its files (None for arrays), and the sequence that it belongs to.

    frames  of the sequence; shown  which of them this is; poses  how many have one
    """

    depth: str | None
    color: str | None
    frames: int = 1
    shown: int = 0
    poses: int = 0
    poses_from: str = ""


class Assembled(NamedTuple):
    """A frame, and how its files were understood.

    stored  type and size of the depth as it is stored
    """

    frame: Frame
    found: Found
    camera_from: str
    coding: Coding
    stored: str


def assemble(
    parts: Parts, options: ReadOptions, note: Note, reading: Reading | None = None, like: Coding | None = None
) -> Assembled:
    """Reads the parts of a frame. Raises ValueError, TypeError or OSError, in one sentence.

    reading  how poses and camera are to be understood; None is as they are written
    like     how the depth of another frame of the same sequence is coded: this one is, too
    """
    reading = reading or Reading()
    limit, parts = options.max_pixels, _unpacked(parts)
    source = _with_coding(_choose_camera(parts, options, note), parts.name, options, note)
    raw = _read_raw(parts.depth, source, note, limit)
    picture = _read_picture(parts, limit)
    stored = f"{raw.dtype} {raw.shape[1]}x{raw.shape[0]}"
    baseline = _filed_baseline(source) if options.baseline is None else options.baseline
    said = _said(source, options, raw, bool(parts.name), baseline is not None)
    values, coding = decode(raw, parts.name or "depth", said, note, like)
    if source is None and coding.scale is None and options.fov is None:
        source = _assumed_camera(_size(raw), note)
    camera = reading.camera(_make_camera(source, options.fov, _size(raw), picture, parts.missing, note))
    doffs = (source and source.doffs) or 0.0
    metres = to_metres(values, camera, coding.kind, coding.scale, baseline, note, np.float32, doffs)
    if like is None and said.any_kind is None and coding.kind == "z" and is_ray_length(metres, camera):
        note(
            f"{parts.name or 'depth'} is taken as lengths of rays: planes in it are flat only so; "
            f"pass {option('depth_kind', 'z')} if it is not"
        )
        coding = replace(coding, kind="ray")
        metres = to_metres(values, camera, coding.kind, coding.scale, baseline, note, np.float32, doffs)
    del raw, values
    if reading.scale != 1:
        metres *= np.float32(reading.scale)
    if parts.valid is not None:
        _drop_invalid(metres, parts.valid, limit, note)
    pose: Any = load_pose(options.pose) if is_path(options.pose) else options.pose
    if pose is None and parts.pose is not None:
        pose = reading.pose(parts.pose)
    frame = Frame(picture, metres, camera, pose)
    if not frame.points_known:
        where = f"{parts.name}: " if parts.name else ""
        raise ValueError(
            f"{where}depth must be known somewhere, got only missing values (0, negative, NaN or infinite)"
        )
    found = Found(parts.name or None, str(parts.color) if is_path(parts.color) else None)
    return Assembled(frame, found, source.name if source else option("fov"), coding, stored)


def read_color(path: FilePath, max_pixels: float = MAX_PIXELS) -> NDArray[np.uint8]:
    """(h, w, 3|4) uint8 of any picture: palettes are looked up, grey is repeated, 16 bits become 8."""
    return to_color(read_image(path, max_pixels), str(path))


def to_color(image: NDArray[Any], name: str) -> NDArray[np.uint8]:
    """(h, w, 3|4) uint8 of a picture's values. Raises ValueError, with the name, for floating point."""
    if image.dtype.kind == "f":
        raise ValueError(f"{name} is a floating point picture, expected colours of 8 or 16 bits")
    if image.dtype != np.uint8:
        image = ((np.clip(image, 0, 65535).astype(np.uint32) * 255 + 32767) // 65535).astype(np.uint8)
    return np.repeat(image[..., None], 3, axis=2) if image.ndim == 2 else image


def is_path(value: Any) -> TypeGuard[FilePath]:
    return isinstance(value, str | PathLike)


def _read_picture(parts: Parts, max_pixels: float) -> NDArray[Any] | None:
    if not is_path(parts.color):
        return _check_color(parts.color)
    if Path(parts.color).suffix.lower() in VIDEO_SUFFIXES:
        from .video import read_video_frame  # only here

        return read_video_frame(parts.color, parts.number, max_pixels)
    return read_color(parts.color, max_pixels)


def _unpacked(parts: Parts) -> Parts:
    """The parts, with those of a container in the place of what lies beside it."""
    if parts.contents is None:
        return parts
    held = parts.contents()
    filed = parts.filed if held.intrinsics is None else merged(held.intrinsics, parts.filed)
    if filed is not None:
        kind, scale = held.depth_kind or filed.depth_kind, held.depth_scale or filed.depth_scale
        filed = replace(filed, depth_kind=kind, depth_scale=scale)
    color, pose, valid = (
        beside if own is None else own
        for own, beside in ((held.color, parts.color), (held.pose, parts.pose), (held.valid, parts.valid))
    )
    return parts._replace(depth=held.depth, color=color, filed=filed, pose=pose, valid=valid)


def _read_raw(depth: Any, source: Intrinsics | None, note: Note, max_pixels: float) -> NDArray[Any]:
    """The depth as it is stored."""
    if not is_path(depth):
        return one_channel(as_given(depth, "depth must have shape (h, w)"), "depth")
    if Path(depth).suffix.lower() not in RAW_SUFFIXES and not _is_bare(Path(depth), source):
        return read_depth(depth, note, max_pixels)
    if is_colmap_depth(read_head(depth)):
        return read_colmap_depth(depth, max_pixels)
    if source is None or source.size is None:
        raise ValueError(
            f"{depth} holds numbers without a header: pass {option('intrinsics', 'FILE')} with the width and height, "
            "or the depth as .npy"
        )
    return read_raw(depth, *source.size, max_pixels)


def _is_bare(path: Path, source: Intrinsics | None) -> bool:
    """Whether it is called a picture, but holds 4 bytes for each pixel and nothing else, as ETH3D's depth does."""
    if source is None or source.size is None or path.suffix.lower() not in COLOR_SUFFIXES:
        return False
    width, height = source.size
    return path.is_file() and path.stat().st_size == 4 * width * height and not is_picture(path)


def _check_color(color: Any) -> NDArray[Any] | None:
    if color is None:
        return None
    expected = "color must have shape (h, w, 3) or (h, w, 4)"
    array = as_given(color, expected)
    if array.ndim != 3 or 0 in array.shape:
        raise ValueError(f"{expected}, got {array.shape}")
    return array


def _size(array: NDArray[Any]) -> Size:
    return array.shape[1], array.shape[0]


def _choose_camera(parts: Parts, options: ReadOptions, note: Note) -> Intrinsics | None:
    """The caller's camera; what it does not say about the depth comes from the file beside the pictures.

    If neither is there, a photograph may say what lens took it.
    """
    if options.intrinsics is not None:
        return merged(read_intrinsics(options.intrinsics, note, options.max_pixels), parts.filed)
    if parts.filed is None and options.fov is None and is_path(parts.color):
        from .exif import camera_from_exif  # only here

        found = camera_from_exif(parts.color, options.max_pixels)
        if found:
            focal = f"focal length {found.numbers[0]:.0f} px"
            note(f"no camera is known, the lens of {Path(parts.color).name} is taken (EXIF): {focal}")
        return found
    return parts.filed


def _with_coding(source: Intrinsics | None, name: str, options: ReadOptions, note: Note) -> Intrinsics | None:
    """The camera; what neither its file nor the caller says about the depth is that of a data set known by names."""
    if source is None or not name or options.depth_scale or options.depth_kind or source.depth_scale:
        return source
    seen = "/".join(Path(name).parts[-_NAMES:]).lower()
    known = next((one for one in CODINGS if one.known_by.search(seen)), None)
    if known is None or source.depth_kind:
        return source
    taken = option("depth_kind", known.depth_kind)
    if known.depth_scale is not None:
        taken += f", {option('depth_scale', known.depth_scale)}"
    note(f"{Path(name).name} looks like {known.title}: taken as {taken}")
    return replace(source, depth_scale=known.depth_scale, depth_kind=known.depth_kind)


def _assumed_camera(size: Size, note: Note) -> Intrinsics:
    """For depth of no unit, whose shape is a guess anyway: the usual lens of a phone."""
    focal = max(size) / 2 / math.tan(math.radians(_USUAL_FOV) / 2)
    note(
        f"no camera is known, a field of view of {_USUAL_FOV:g} degrees across the longer side is assumed: "
        f"pass {option('fov')} (vertical degrees)"
    )
    return Intrinsics("the assumed camera", (focal, focal, (size[0] - 1) / 2, (size[1] - 1) / 2), size)


def _make_camera(
    source: Intrinsics | None, fov: float | None, depth: Size, picture: NDArray[Any] | None, missing: str, note: Note
) -> Camera:
    color = None if picture is None else _size(picture)
    if color and abs(color[0] / color[1] * depth[1] / depth[0] - 1) > _OTHER_ASPECT:
        note(
            f"color is {color[0]}x{color[1]} and depth {depth[0]}x{depth[1]}, of another aspect ratio: "
            f"they do not look registered; pass the right colour as {option('color', 'FILE')}"
        )
    if fov is not None:
        return Camera.from_fov(fov, *depth)
    if source is None:
        title, numbers = COMMON_CAMERAS.get(depth, ("", ""))
        often = f"; for this size often {option('intrinsics', numbers)} ({title})" if title else ""
        raise ValueError(
            f"the camera is unknown: pass {option('intrinsics')} (fx,fy,cx,cy or a file) "
            f"or {option('fov')} (vertical degrees), such as 50{often}{missing}"
        )
    return place_camera(source, depth, color, note)


def _said(
    source: Intrinsics | None, options: ReadOptions, raw: NDArray[Any], from_file: bool, has_baseline: bool
) -> Said:
    """What caller and camera say about the depth. Raises ValueError for what the camera's file cannot say."""
    kind, scale = (source.depth_kind, source.depth_scale) if source else (None, None)
    if source and kind is not None and options.depth_kind is None:
        check_choice("depth_kind", kind, KINDS, f" in {source.name}")
    if raw.dtype.kind == "f" and not from_file:
        scale = None  # the caller's own array of floats is in metres
    if source and scale is not None:
        check_positive(scale, f"{source.name}: depth_scale")
    return Said(options.depth_kind, options.depth_scale, kind, scale, has_baseline)


def _filed_baseline(source: Intrinsics | None) -> float | None:
    """The baseline of the intrinsics file. Raises ValueError for an impossible one."""
    if source is None or source.baseline is None:
        return None
    return check_positive(source.baseline, f"{source.name}: baseline")


def _drop_invalid(metres: NDArray[np.float32], valid: Any, max_pixels: float, note: Note) -> None:
    """Sets depth to 0 where a mask or levels of confidence are 0, and where a network's confidence is far too low."""
    mask: NDArray[Any] = read_depth(valid, note, max_pixels) if is_path(valid) else np.asarray(valid)
    mask = np.asarray(mask.max(axis=2)) if mask.ndim == 3 else mask  # a mask in colour
    name = str(valid) if is_path(valid) else "the mask"
    if mask.shape != metres.shape:
        size = f"{mask.shape[1]}x{mask.shape[0]}, the depth {metres.shape[1]}x{metres.shape[0]}"
        note(f"{name} is {size}: it is not used")
        return
    good = mask >= SURE * np.nanmedian(mask) if mask.dtype.kind == "f" else mask != 0
    dropped = (metres > 0) & ~good
    if dropped.any():
        share = np.count_nonzero(dropped) / np.count_nonzero(metres)
        note(f"{name} says that {share:.0%} of the depth is not valid: it is dropped")
        metres[dropped] = 0
