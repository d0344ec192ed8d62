"""Assembles one frame from files or arrays: depth in metres, colours, and a camera, which it chooses."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import ABOVE_0, as_given, check_choice, check_float, check_positive, depth_as_given
from ...checks.foreign_arrays import way_to
from ...notes.notes import Doubt, Note, taken
from ...notes.words import option
from ...scene.camera import Camera
from ...scene.frame import Frame
from ..access.content import MAX_PIXELS, FilePath, read_head
from ..access.folders import Folder, places_of
from ..access.known_names import CODINGS, COLOR_SUFFIXES, COMMON_CAMERAS, INSIDE, RAW_SUFFIXES, VIDEO_SUFFIXES
from ..arrays.numpy_files import is_colmap_depth, read_colmap_depth
from ..cameras.camera_files import camera_from_exif, read_intrinsics
from ..cameras.intrinsics import Intrinsics, Size, merged, place_lens, shows_the_same
from ..cameras.lenses import Lens, fisheye, is_straight, straighten
from ..cameras.pose_files import Reading, load_pose, note_alone
from ..containers.container_contents import SURE
from ..depth.depth_coding import decode
from ..depth.depth_files import one_channel, read_depth, read_raw
from ..depth.depth_kinds import KINDS, METRIC, Coding, Decoded, DepthHints, reduced, times_enlarged, to_metres
from ..depth.missing_depth import is_constant
from ..depth.planes import is_ray_length
from ..depth.scale_over_time import ScaledFrame
from ..finding.folder_cameras import Cameras, find_cameras
from ..finding.folder_frames import FrameFiles
from ..pictures.picture_files import has_turn, is_picture, png_size, read_image
from .frame_parts import Assembled, FoundFiles, FrameParts, ReadOptions, is_path
from .registration import compare

ASSUMED = "the assumed camera"
_USUAL_FOV = 60.0  # degrees
_NAMES = 5  # folders of a path by which a data set is known


def choose_camera(parts: FrameParts, options: ReadOptions, note: Note) -> Intrinsics | None:
    """Return the caller's camera, with what the file beside the pictures adds; else the file's, or the photo's lens."""
    source, name = _given_camera(parts, options, note), parts.name
    if source is None or not name or options.depth_scale or options.depth_kind or source.depth_scale:
        return source
    # what neither its file nor the caller states about the depth is that of a data set known by names
    seen = "\n".join("/".join(one.parts[-_NAMES:]) for one in places_of(Path(name))).lower()
    known = next((one for one in CODINGS if re.search(one.known_by, seen)), None)
    if known is None or source.depth_kind:
        return source
    taken = option("depth_kind", known.depth_kind)
    if known.depth_scale is not None:
        taken += f", {option('depth_scale', known.depth_scale)}"
    note(f"{Path(name).name} looks like {known.title}: taken as {taken}")
    return replace(source, depth_scale=known.depth_scale, depth_kind=known.depth_kind)


def _given_camera(parts: FrameParts, options: ReadOptions, note: Note) -> Intrinsics | None:
    if options.intrinsics is not None:
        return merged(read_intrinsics(options.intrinsics, note, options.max_pixels), parts.filed)
    if parts.filed is None and options.fov is None and is_path(parts.color):
        if found := camera_from_exif(parts.color, options.max_pixels):
            focal = f"focal length {found.numbers[0]:.0f} px"
            note(f"no camera is known, the lens of {Path(parts.color).name} is taken (EXIF): {focal}")
        return found
    return parts.filed


def find_filed(place: Folder, files: Sequence[FrameFiles], options: ReadOptions, note: Note) -> Cameras:
    """Return the cameras in a folder; beside a caller's camera intrinsics.json may still state what the depth is."""
    if options.intrinsics is None and options.fov is None:
        return find_cameras(place, files, note, options.max_pixels)
    if not (place.path / "intrinsics.json").is_file():
        return Cameras(None)
    try:
        return Cameras(find_cameras(place, (), lambda _: None, options.max_pixels).shared)
    except ValueError:
        note(f"{place.path / 'intrinsics.json'} is no camera file, and is not used")
        return Cameras(None)


def assumed_camera(size: Size, is_of_sensor: bool, missing: str, note: Note) -> Intrinsics:
    """Return a camera that is usual for a picture of this size, with a note, and why no file has one. is_of_sensor:
    whether depth has a unit, so that it may be a depth camera's; else it is seen as by a phone."""
    width, height = size
    way_out = f"pass {option('intrinsics')} (fx,fy,cx,cy or a file) or {option('fov')} (vertical degrees)"
    if width == 2 * height:
        way_out += f", or {option('projection', 'equirectangular')} if it is a panorama"
    if is_of_sensor and size in COMMON_CAMERAS:
        title, text = COMMON_CAMERAS[size]
        note(f"no camera is known{missing}: that of {title} is assumed, usual for {width}x{height} ({text}); {way_out}")
        fx, fy, cx, cy = map(float, text.split(","))
        return Intrinsics(ASSUMED, (fx, fy, cx, cy), size)
    focal = max(size) / 2 / math.tan(math.radians(_USUAL_FOV) / 2)
    field = f"a field of view of {_USUAL_FOV:g} degrees across the longer side"
    note(f"no camera is known{missing}: {field} is assumed; {way_out}")
    return Intrinsics(ASSUMED, (focal, focal, (width - 1) / 2, (height - 1) / 2), size)


def make_camera(
    source: Intrinsics | None, options: ReadOptions, depth: Size, color: Size | None, note: Note
) -> tuple[Camera, Lens | None]:
    """The camera, known but for a field of view, of depth under colours of these sizes, and what bends its picture.
    Raises ValueError for none, and for a lens that cannot be taken out."""
    if color and not shows_the_same(color, depth):
        is_turned = shows_the_same((color[1], color[0]), depth)
        what = "turned by 90 degrees against each other" if is_turned else "of another aspect ratio"
        sizes = f"color is {color[0]}x{color[1]} and depth {depth[0]}x{depth[1]}, {what}"
        way_out = f"pass the right colour as {option('color', 'FILE')}"
        note(Doubt(f"{sizes}: they do not look registered; {way_out}"))
    if options.fov is not None and options.projection == "fisheye":
        fov = check_float(options.fov, f"{option('fov')} of a fisheye must lie between 0 and 360 degrees", ABOVE_0, 360)
        focal, (width, height) = depth[1] / math.radians(fov), depth
        return Camera(focal, focal, (width - 1) / 2, (height - 1) / 2, width, height), fisheye(())
    if options.fov is not None:
        return Camera.from_fov(options.fov, *depth), None
    assert source is not None, "one is assumed where none is known"
    camera, lens = place_lens(source, depth, color, note)
    if options.projection == "fisheye":
        if source.name == ASSUMED:
            way_out = f"pass {option('intrinsics', 'FILE')} or {option('fov', 'DEG')}"
            raise ValueError(f"a fisheye needs its camera: {way_out}")
        return camera, fisheye(()) if lens is None else lens.as_fisheye()
    if lens is None or options.projection == "pinhole":
        return camera, None
    lens.check_known(source.name)
    return camera, lens


def read_colors_of(
    parts: FrameParts, max_pixels: float, note: Note = lambda _: None, upright: bool = True
) -> NDArray[Any] | None:
    """The colours of a frame in sRGB, (h, w, 3|4) uint8; None without any. upright: as EXIF turns them."""
    if parts.color is None:
        return None
    if not is_path(parts.color):
        expected = "color must have shape (h, w, 3) or (h, w, 4)"
        array = as_given(parts.color, expected)
        if array.ndim != 3 or 0 in array.shape:
            raise ValueError(f"{expected}, got {array.shape}{way_to(array.shape, 'color', parts.color, (3, 4))}")
        return array
    if _is_film(parts.color):
        from ..finding.folder_films import read_film_color  # only here
        from ..pictures.video import read_video_frame

        is_shared = is_path(parts.depth) and parts.color == parts.depth
        read = read_film_color if is_shared else read_video_frame
        return read(parts.color, parts.number, max_pixels)
    return read_color(parts.color, max_pixels, note, upright)


def _read_colors(
    parts: FrameParts, depth: Size, options: ReadOptions, note: Note, like: Coding | None
) -> tuple[NDArray[Any] | None, bool]:
    """The colours, and whether they are as stored: a picture that EXIF turns on its side may lie on the depth so."""
    if like is not None:
        return read_colors_of(parts, options.max_pixels, upright=not like.as_stored), like.as_stored
    colors = read_colors_of(parts, options.max_pixels, note)
    if colors is None or not is_path(parts.color):
        return colors, False
    height, width = colors.shape[:2]
    is_turned = shows_the_same((height, width), depth) and not shows_the_same((width, height), depth)
    if is_turned and has_turn(parts.color):
        note(Doubt(f"{parts.color} {_AS_STORED}"))
        return read_colors_of(parts, options.max_pixels, upright=False), True
    return colors, False


_AS_STORED = "is turned by its EXIF, and the depth is not: its pixels are taken as they are stored"


def _compared(
    colors: NDArray[Any], as_stored: bool, depth: NDArray[np.float32], parts: FrameParts, max_pixels: float, note: Note
) -> tuple[NDArray[Any], bool, bool]:
    """The colours as they lie on the depth, whether that is as stored, and whether edges tell. Notes doubts."""
    found = compare(colors, depth)
    if not as_stored and (found.turn or not found.is_clear) and is_path(parts.color) and has_turn(parts.color):
        stored = read_colors_of(parts, max_pixels, upright=False)
        assert stored is not None
        other = compare(stored, depth)
        if other.is_clear and not other.doubt:
            note(Doubt(f"{parts.color} {_AS_STORED}"))
            return stored, True, True
        if not found.is_clear:
            note(f"{parts.color} is turned by its EXIF; there are too few edges to see whether the depth is, too")
    if found.doubt:
        note(Doubt(found.doubt))
    return colors, as_stored, found.is_clear


def read_color(
    path: FilePath, max_pixels: float = MAX_PIXELS, to_srgb: Note | None = None, upright: bool = True
) -> NDArray[np.uint8]:
    """(h, w, 3|4) uint8 of any picture: palettes are looked up, grey is repeated, 16 bits become 8."""
    return to_color(read_image(path, max_pixels, to_srgb, upright), str(path))


def to_color(image: NDArray[Any], name: str) -> NDArray[np.uint8]:
    """(h, w, 3|4) uint8 of a picture's values. Raises ValueError, with the name, for floating point."""
    if image.dtype.kind == "f":
        raise ValueError(f"{name} is a floating point picture, expected colours of 8 or 16 bits")
    if image.dtype != np.uint8:
        image = ((np.clip(image, 0, 65535).astype(np.uint32) * 255 + 32767) // 65535).astype(np.uint8)
    return np.repeat(image[..., None], 3, axis=2) if image.ndim == 2 else image


def assemble(
    parts: FrameParts,
    options: ReadOptions,
    note: Note,
    reading: Reading | None = None,  # how poses and camera are to be understood; None is as they are written
    like: Coding | None = None,  # how the depth of another frame of the same sequence is coded: this one is, too
    stream: Hashable = None,  # what the frame is one of, its `Frame.source`
    scale_of: Callable[[Decoded, Any, Camera], ScaledFrame] | None = None,  # how the depth of a film's picture is laid
) -> Assembled:
    """Read the parts of a frame and put them together. Raises ValueError, TypeError or OSError, in one sentence."""
    is_found = like is None and parts.path is not None and (parts.color is None or is_path(parts.color))
    reading, beside = reading or Reading(), parts.color if parts.depth is None else None
    parts = _unpacked(with_contents(parts, options, note), options.poses is None)
    if parts.contents is not None and parts.color is None and like is None:
        note(f"{parts.name} holds no colours, and none lie beside it: the surface is light grey")
    source = choose_camera(parts, options, note)
    raw = read_raw_depth(parts, source, options, note)
    if raw.ndim == 3 and raw.dtype.kind == "f":
        from ..containers.array_frames import points_of  # only here

        held = points_of(raw, parts.name or "depth", note, options.max_pixels)
        parts = _unpacked(parts._replace(contents=lambda: held), with_pose=False)
        source, raw = choose_camera(parts, options, lambda _: None), held.depth
    colors, as_stored = _read_colors(parts, (raw.shape[1], raw.shape[0]), options, note, like)
    color_size = None if colors is None else (colors.shape[1], colors.shape[0])
    seen_by = partial(_camera_of, source, options, raw.shape[1::-1], color_size, reading)
    decoded = decode(raw, parts.name or "depth", hints_of(source, parts, options, raw, seen_by), note, like)
    stored, is_float = f"{raw.dtype} {raw.shape[1]}x{raw.shape[0]}", raw.dtype.kind == "f"
    del raw
    size = decoded.values.shape[1], decoded.values.shape[0]
    if source is None and options.fov is None:
        has_unit = decoded.coding.scale is not None and not parts.maker
        source = assumed_camera(size, has_unit, parts.missing, note)
    camera, lens = make_camera(source, options, size, color_size, note)
    camera = reading.camera(camera)
    hints, is_kept = decoded.coding.hints, options.scale_frames == "keep"
    top = hints.levels - 1 if hints and hints.levels and is_kept else 0  # of all pictures of a film
    laid = ScaledFrame(0, top) if scale_of is None else scale_of(decoded, colors, camera)
    shown = None if lens is None else _as_shown(lens, decoded, camera, source, options, note, like, laid.ends)
    if shown is None:
        metres, coding = _to_metres(decoded, camera, source, options, note, parts.name, like is None, laid.ends)
        coding = coding if lens is None else replace(coding, is_straight=True)
    else:
        metres, coding = shown, decoded.coding
    del decoded
    for factor in (laid.factor, reading.scale):
        if factor != 1:
            metres *= np.float32(factor)
    if parts.valid is not None:
        drop_invalid(metres, parts.valid, options.max_pixels, note)
    is_compared = False
    if is_found and colors is not None:
        colors, as_stored, is_compared = _compared(colors, as_stored, metres, parts, options.max_pixels, note)
    coding = replace(coding, as_stored=as_stored) if as_stored else coding
    if lens is not None and shown is not None:
        metres, colors, camera = straighten(lens, metres, colors, camera, _title(source), note)
        metres, coding = _along_axis(metres, coding, camera, source, options, note, parts.name, like is None)
    if like is None:
        is_made = coding.scale is None or bool(parts.maker) or (is_float and bool((metres > 0).all()))  # by a network
        enlarged = times_enlarged(metres) if is_made and colors is not None else 1
    else:
        enlarged = like.enlarged
    if enlarged > 1 and colors is not None and (colors.shape[:2] >= np.array(metres.shape)).all():
        metres = _as_made(metres, enlarged, note, parts.name or parts.maker)
        camera, coding = camera.resized(metres.shape[1], metres.shape[0]), replace(coding, enlarged=enlarged)
    pose: Any = options.pose
    if is_path(options.pose):
        pose = load_pose(options.pose)
        if like is None:
            note_alone(options.pose, note)
    if pose is None and parts.pose is not None:
        pose = reading.pose(parts.pose)
    with taken() as notes:
        frame = Frame(colors, metres, camera, pose, source=stream)
    for one in notes:
        note(one)
    if not frame.points_known:
        where, missing = f"{parts.name}: " if parts.name else "", "missing values (0, negative, NaN or infinite)"
        raise ValueError(f"{where}depth must be known somewhere, got only {missing}")
    if like is None and is_constant(frame.depth):
        name, away = parts.name or "the depth", frame.depth.max()
        way_out = f"Pass another as {option('channel', 'NAME')}"
        note(f"all of {name} is {away:.4g} m away: is it the right file and the right channel? {way_out}")
    color_from = next((str(one) for one in (parts.color, beside) if is_path(one)), None)
    found = FoundFiles(parts.name or parts.maker or None, color_from)
    return Assembled(frame, found, _title(source), coding, stored, is_compared)


def with_contents(parts: FrameParts, options: ReadOptions, note: Note) -> FrameParts:
    """Return the parts, with what the depth picture says beyond its values, if it is of a kind that does."""
    if parts.contents is not None and options.channel is not None:
        raise ValueError(f"{parts.name} names its arrays: leave out {option('channel', options.channel)}")
    if parts.contents is not None or not is_path(parts.depth):
        return parts
    path = Path(parts.depth)
    if path.suffix.lower() not in INSIDE:
        return parts
    from ..containers.opening import open_inside  # only here

    held = open_inside(path, note, options.max_pixels, options.channel, parts.color is not None)
    return parts if held is None else parts._replace(contents=lambda: held)


def _unpacked(parts: FrameParts, with_pose: bool) -> FrameParts:
    """Return the parts, with those of a container in the place of what lies beside it; its pose only if asked for."""
    if parts.contents is None:
        return parts
    held = parts.contents()
    filed = parts.filed if held.intrinsics is None else merged(held.intrinsics, parts.filed)
    if filed is not None:
        kind, scale = held.depth_kind or filed.depth_kind, held.depth_scale or filed.depth_scale
        filed = replace(filed, depth_kind=kind, depth_scale=scale)
    own = {"color": held.color, "pose": held.pose if with_pose else None, "valid": held.valid}
    given = {name: value for name, value in own.items() if value is not None}
    return parts._replace(depth=held.depth, filed=filed, coded=(held.depth_kind, held.depth_scale), **given)


def _is_film(path: object) -> bool:
    return is_path(path) and Path(path).suffix.lower() in VIDEO_SUFFIXES


def read_raw_depth(parts: FrameParts, source: Intrinsics | None, options: ReadOptions, note: Note) -> NDArray[Any]:
    """The depth as it is stored."""
    depth: Any = parts.depth
    max_pixels, channel = options.max_pixels, options.channel if parts.contents is None else None  # there it is chosen
    if _is_film(depth):
        from ..finding.folder_films import read_film_depth  # only here

        return read_film_depth(depth, parts.number, max_pixels)
    if not is_path(depth):
        return one_channel(depth_as_given(depth, np.nan), "depth", channel)
    path, size = Path(depth), source and source.size
    suffix, is_bare = path.suffix.lower(), False
    if size and suffix in COLOR_SUFFIXES and path.is_file():  # ETH3D's holds only 4 bytes for each pixel
        is_bare = path.stat().st_size == 4 * size[0] * size[1] and not is_picture(path)
    if suffix not in RAW_SUFFIXES and not is_bare:
        return read_depth(depth, note, max_pixels, channel)
    if is_colmap_depth(read_head(depth)):
        return read_colmap_depth(depth, max_pixels)
    size = size or _size_beside(path)
    if size is None:
        way_out = f"pass {option('intrinsics', 'FILE')} with the width and height, or the depth as .npy"
        raise ValueError(f"{depth} holds numbers without a header: {way_out}")
    return read_raw(depth, *size, max_pixels)


def _size_beside(path: Path) -> Size | None:
    """The size of the picture of the same name, or what the name says, if it fits the bytes of a bare file."""
    picture, named = path.with_suffix(".png"), re.search(r"(?<!\d)(\d{2,5})x(\d{2,5})(?!\d)", path.name)
    sizes = [png_size(picture) if picture.is_file() else None, named and (int(named[1]), int(named[2]))]
    count = path.stat().st_size
    return next((one for one in sizes if one and count in (2 * one[0] * one[1], 4 * one[0] * one[1])), None)


def _camera_of(
    source: Intrinsics | None, options: ReadOptions, depth: Size, color: Size | None, reading: Reading
) -> Camera | None:
    """The camera of depth, before it is known what that means; None if none is known, or it is no pinhole."""
    if source is None and options.fov is None:
        return None
    camera, lens = make_camera(source, options, depth, color, lambda _: None)
    return reading.camera(camera) if lens is None else None


def hints_of(
    source: Intrinsics | None, parts: FrameParts, options: ReadOptions, raw: NDArray[Any],
    camera: Callable[[], Camera | None],
) -> DepthHints:  # fmt: skip
    """Return what is given about the depth. Raises ValueError for impossible values in the camera's file."""
    kind, scale = (source.depth_kind, source.depth_scale) if source else (None, None)
    kind, scale = kind or parts.coded[0], scale or parts.coded[1]
    if source and kind is not None and options.depth_kind is None:
        check_choice("depth_kind", kind, KINDS, f" in {source.name}")
    if raw.dtype.kind == "f" and parts.contents is None and not parts.name:
        scale = None  # the caller's own array of floats is in metres
    if source and scale is not None:
        check_positive(scale, f"{source.name}: depth_scale")
    levels = 0
    if _is_film(parts.depth):
        from ..finding.folder_films import film_coding  # only here

        if film := film_coding(parts.name, True, options.max_pixels):
            kind, scale, levels = kind or film.kind, scale or film.scale, film.levels
    has_baseline = _baseline(source, options) is not None
    near, far = (options.near or (source and source.near), options.far or (source and source.far))
    given = options.depth_kind
    if given is None and kind is None and (options.near or options.far):
        given = "buffer"
    return DepthHints(given, options.depth_scale, kind, scale, has_baseline, levels, near, far, camera)


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
    more = doffs, ends, coding.planes
    metres = to_metres(values, camera, coding.kind, coding.scale, baseline, note, np.float32, *more)
    if coding.kind != "z" or _is_told(source, options) or not first or not is_ray_length(metres, camera):
        return metres, coding
    way_out = f"pass {option('depth_kind', 'z')} if it is not"
    note(f"{name or 'depth'} is taken as lengths of rays: planes in it are flat only so; {way_out}")
    coding = replace(coding, kind="ray")
    return to_metres(values, camera, coding.kind, coding.scale, baseline, note, np.float32, doffs), coding


def _as_shown(
    lens: Lens, depth: Decoded, camera: Camera, source: Intrinsics | None, options: ReadOptions, note: Note,
    like: Coding | None, ends: tuple[float, float] | None,
) -> NDArray[np.float32] | None:  # fmt: skip
    """Return metres as a lens shows them, along its axis or its rays; None if the lens is out already."""
    (values, coding), baseline, doffs = depth, _baseline(source, options), (source and source.doffs) or 0.0
    if like is not None and like.is_straight:
        return None
    kind = "z" if coding.kind in METRIC else coding.kind  # along rays as well, as long as they are those of the lens
    metres = to_metres(values, camera, kind, coding.scale, baseline, note, np.float32, doffs, ends, coding.planes)
    kinds = ("ray",) if coding.kind == "ray" else ("z",)
    kinds = ("z", "ray") if coding.kind == "z" and not _is_told(source, options) else kinds
    is_told = like is not None or options.projection is not None or coding.kind == "plane"
    if not is_told and is_straight(metres, lens, camera, kinds):
        what = f"{_title(source)} has a lens ({lens.title}), but planes in the depth are flat only without it"
        note(f"{what}: it is taken as straight already; pass {option('projection', 'lens')} if it is not")
        return None
    return metres


def _along_axis(
    metres: NDArray[np.float32], coding: Coding, camera: Camera, source: Intrinsics | None, options: ReadOptions,
    note: Note, name: str, first: bool,
) -> tuple[NDArray[np.float32], Coding]:  # fmt: skip
    """Return depth along the axis, and its coding, of what was along the axis or the rays of a lens."""
    if coding.kind not in METRIC:
        return metres, coding
    along, is_open = Decoded(metres, Coding(coding.kind, 1.0, "")), first and coding.kind == "z"
    metres, found = _to_metres(along, camera, source, options, note, name, is_open, None)
    return metres, replace(coding, kind=found.kind)


def _is_told(source: Intrinsics | None, options: ReadOptions) -> bool:
    """Whether the caller or the camera's file says what the depth is."""
    return options.depth_kind is not None or (source is not None and source.depth_kind is not None)


def _title(source: Intrinsics | None) -> str:
    return option("fov") if source is None else source.name


def _as_made(metres: NDArray[np.float32], enlarged: int, note: Note, name: str) -> NDArray[np.float32]:
    """Return a network's depth, which was enlarged so many times, at the size at which it was made."""
    found = reduced(metres, enlarged)
    small, large = (f"{one.shape[1]}x{one.shape[0]}" for one in (found, metres))
    what = f"{name}{': ' if name else ''}depth of {large} has edges that are {enlarged} pixels wide"
    note(f"{what}: it is taken at {small}, and the colours say where edges run")
    return found


def drop_invalid(metres: NDArray[np.float32], valid: Any, max_pixels: float, note: Note) -> None:
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
