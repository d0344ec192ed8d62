"""Assembles one frame from files or arrays: depth in metres, colours, camera and pose."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import check_choice, check_positive, depth_as_given
from ...notes.notes import Note, taken
from ...notes.words import option
from ...scene.camera import Camera
from ...scene.frame import Frame
from ..access.content import read_head
from ..access.file_name_patterns import COLOR_SUFFIXES, RAW_SUFFIXES
from ..arrays.colmap_depth import is_colmap_depth, read_colmap_depth
from ..cameras.intrinsics import Intrinsics, merged
from ..containers.contents import SURE
from ..depth.depth_coding import decode
from ..depth.depth_files import one_channel, read_depth, read_raw
from ..depth.depth_kinds import KINDS, Coding, Decoded, Said, to_metres
from ..depth.enlarged_depth import reduced, times_enlarged
from ..depth.ray_lengths import is_ray_length
from ..pictures.picture_heads import is_picture
from ..poses.pose_convention import Reading
from ..poses.pose_files import load_pose
from .camera_choice import assumed_camera, choose_camera, make_camera
from .color_files import read_colors_of
from .film_scale import Laid
from .frame_parts import Assembled, Found, Parts, ReadOptions, is_path


def assemble(
    parts: Parts,
    options: ReadOptions,
    note: Note,
    reading: Reading | None = None,
    like: Coding | None = None,
    stream: Hashable = None,
    scale_of: Callable[[Decoded, Any, Camera], Laid] | None = None,
) -> Assembled:
    """Read the parts of a frame and put them together. Raises ValueError, TypeError or OSError, in one sentence.

    reading  how poses and camera are to be understood; None is as they are written
    like     how the depth of another frame of the same sequence is coded: this one is, too
    stream   what the frame is one of, its `Frame.source`
    scale_of  gives how the depth of a film's picture is laid, from its values, colours and camera
    """
    reading, parts = reading or Reading(), _unpacked(parts, options.poses is None)
    source = choose_camera(parts, options, note)
    raw = _read_raw(parts.depth, source, note, options.max_pixels)
    colors = read_colors_of(parts, options.max_pixels, *([note] if like is None else []))
    said = _said(source, parts, options, raw)
    decoded = decode(raw, parts.name or "depth", said, note, like)
    stored, is_float = f"{raw.dtype} {raw.shape[1]}x{raw.shape[0]}", raw.dtype.kind == "f"
    del raw
    size = decoded.values.shape[1], decoded.values.shape[0]
    if source is None and options.fov is None:
        has_unit = decoded.coding.scale is not None and not parts.maker
        source = assumed_camera(size, has_unit, parts.missing, note)
    color_size = None if colors is None else (colors.shape[1], colors.shape[0])
    camera = reading.camera(make_camera(source, options.fov, size, color_size, note))
    laid = Laid() if scale_of is None else scale_of(decoded, colors, camera)
    metres, coding = _to_metres(decoded, camera, source, options, note, parts.name, like is None, laid.ends)
    if laid.factor != 1:
        metres *= np.float32(laid.factor)
    del decoded
    if reading.scale != 1:
        metres *= np.float32(reading.scale)
    if parts.valid is not None:
        _drop_invalid(metres, parts.valid, options.max_pixels, note)
    if like is None:
        is_made = coding.scale is None or bool(parts.maker) or (is_float and bool((metres > 0).all()))  # by a network
        enlarged = times_enlarged(metres) if is_made and colors is not None else 1
    else:
        enlarged = like.enlarged
    if enlarged > 1 and colors is not None and (colors.shape[:2] >= np.array(metres.shape)).all():
        metres = _as_made(metres, enlarged, note, parts.name or parts.maker)
        camera, coding = camera.resized(metres.shape[1], metres.shape[0]), replace(coding, enlarged=enlarged)
    pose: Any = load_pose(options.pose) if is_path(options.pose) else options.pose
    if pose is None and parts.pose is not None:
        pose = reading.pose(parts.pose)
    with taken() as notes:
        frame = Frame(colors, metres, camera, pose, source=stream)
    for one in notes:
        note(one)
    if not frame.points_known:
        where = f"{parts.name}: " if parts.name else ""
        raise ValueError(
            f"{where}depth must be known somewhere, got only missing values (0, negative, NaN or infinite)"
        )
    found = Found(parts.name or parts.maker or None, str(parts.color) if is_path(parts.color) else None)
    return Assembled(frame, found, source.name if source else option("fov"), coding, stored)


def _unpacked(parts: Parts, with_pose: bool) -> Parts:
    """Return the parts, with those of a container in the place of what lies beside it; its pose only if asked for."""
    if parts.contents is None:
        return parts
    held = parts.contents()
    filed = parts.filed if held.intrinsics is None else merged(held.intrinsics, parts.filed)
    if filed is not None:
        kind, scale = held.depth_kind or filed.depth_kind, held.depth_scale or filed.depth_scale
        filed = replace(filed, depth_kind=kind, depth_scale=scale)
    color, pose, valid = (
        beside if own is None else own
        for own, beside in (
            (held.color, parts.color),
            (held.pose if with_pose else None, parts.pose),
            (held.valid, parts.valid),
        )
    )
    coded = held.depth_kind, held.depth_scale
    return parts._replace(depth=held.depth, color=color, filed=filed, pose=pose, valid=valid, coded=coded)


def _read_raw(depth: Any, source: Intrinsics | None, note: Note, max_pixels: float) -> NDArray[Any]:
    """The depth as it is stored."""
    if not is_path(depth):
        return one_channel(depth_as_given(depth, np.nan), "depth")
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
    """Return whether a file with a picture's name holds only 4 bytes for each pixel, as ETH3D's depth does."""
    if source is None or source.size is None or path.suffix.lower() not in COLOR_SUFFIXES:
        return False
    width, height = source.size
    return path.is_file() and path.stat().st_size == 4 * width * height and not is_picture(path)


def _said(source: Intrinsics | None, parts: Parts, options: ReadOptions, raw: NDArray[Any]) -> Said:
    """Return what is given about the depth. Raises ValueError for impossible values in the camera's file."""
    kind, scale = (source.depth_kind, source.depth_scale) if source else (None, None)
    kind, scale = kind or parts.coded[0], scale or parts.coded[1]
    if source and kind is not None and options.depth_kind is None:
        check_choice("depth_kind", kind, KINDS, f" in {source.name}")
    if raw.dtype.kind == "f" and parts.contents is None and not parts.name:
        scale = None  # the caller's own array of floats is in metres
    if source and scale is not None:
        check_positive(scale, f"{source.name}: depth_scale")
    return Said(options.depth_kind, options.depth_scale, kind, scale, _baseline(source, options) is not None)


def _baseline(source: Intrinsics | None, options: ReadOptions) -> float | None:
    """Metres between the cameras of a disparity. Raises ValueError for an impossible one in a file."""
    if options.baseline is not None or source is None or source.baseline is None:
        return options.baseline
    return check_positive(source.baseline, f"{source.name}: baseline")


def _to_metres(
    depth: Decoded, camera: Camera, source: Intrinsics | None, options: ReadOptions, note: Note, name: str, first: bool,
    ends: tuple[float, float] | None,
) -> tuple[NDArray[np.float32], Coding]:  # fmt: skip
    """Return depth along the axis, and its coding: lengths of rays are those whose planes are flat only as such."""
    (values, coding), baseline, doffs = depth, _baseline(source, options), (source and source.doffs) or 0.0
    metres = to_metres(values, camera, coding.kind, coding.scale, baseline, note, np.float32, doffs, ends)
    is_said = options.depth_kind is not None or (source is not None and source.depth_kind is not None)
    if coding.kind != "z" or is_said or not first or not is_ray_length(metres, camera):
        return metres, coding
    note(
        f"{name or 'depth'} is taken as lengths of rays: planes in it are flat only so; "
        f"pass {option('depth_kind', 'z')} if it is not"
    )
    coding = replace(coding, kind="ray")
    return to_metres(values, camera, coding.kind, coding.scale, baseline, note, np.float32, doffs), coding


def _as_made(metres: NDArray[np.float32], enlarged: int, note: Note, name: str) -> NDArray[np.float32]:
    """Return a network's depth, which was enlarged so many times, at the size at which it was made."""
    found = reduced(metres, enlarged)
    small, large = (f"{one.shape[1]}x{one.shape[0]}" for one in (found, metres))
    note(
        f"{name}{': ' if name else ''}depth of {large} has edges that are {enlarged} pixels wide: it is taken at "
        f"{small}, and the colours say where edges run"
    )
    return found


def _drop_invalid(metres: NDArray[np.float32], valid: Any, max_pixels: float, note: Note) -> None:
    """Set depth to 0 where a mask or a level of confidence is 0, and where a network's confidence is far too low."""
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
