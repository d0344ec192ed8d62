"""Loads frames, and examines what files and folders hold."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...checks.arguments import check_path, is_masked
from ...checks.foreign_arrays import AnyArray
from ...notes.notes import Doubt, Note, print_note
from ...notes.words import all_of_them, option
from ...scene.camera import Camera
from ...scene.frame import Frame
from ..access.content import MAX_PIXELS, FilePath
from ..access.folders import Folder
from ..access.known_names import builtin_folder
from ..cameras.lenses import Projection
from ..depth.depth_files import one_channel
from ..depth.depth_kinds import RANGED, DepthKind
from ..depth.scale_over_time import ScaleName
from ..finding.folder_frames import FrameFiles, check_folder, find_color
from ..networks.model_options import Model, PixelsName, is_model
from .assembly import find_filed
from .frame_parts import Assembled, FrameParts, ReadOptions, is_path
from .panoramas import OF_PANORAMA, as_pinholes
from .sequences import FrameSequence, first_readable, open_folder, open_frames, open_given_film, open_photographs


def load_frame(
    folder: FilePath | Folder | None = None,
    *,
    color: FilePath | AnyArray | None = None,
    depth: Model | FilePath | AnyArray | None = None,
    intrinsics: FilePath | AnyArray | Camera | None = None,
    fov: float | None = None,
    depth_scale: float | None = None,
    depth_kind: DepthKind | None = None,
    baseline: float | None = None,
    near: float | None = None,
    far: float | None = None,
    channel: str | None = None,
    pose: FilePath | AnyArray | None = None,
    poses: FilePath | None = None,
    allow_outside: bool = False,
    max_pixels: float = MAX_PIXELS,
    depth_model: Model | None = None,
    model_size: str | int | tuple[int, int] | None = None,
    model_pixels: PixelsName | None = None,
    cache: bool = False,
    scale_frames: ScaleName | None = None,
    projection: Projection | None = None,
    notes: Note | None = None,
) -> Frame:
    """Read a frame from a folder, from a depth file, from single files and arrays, or from a photograph and a network.

    Parameters
    ----------
    folder : path, optional
        The folder of a frame, in any layout that files/access/known_names.py lists, or of a sequence, of which
        the first frame is read; a depth file, with colour and camera possibly beside it; "vase", a built-in frame; or,
        with a network, a photograph, a video or a folder of photographs.
    color : path or (h, w, 3|4) uint8, optional
        A picture, in place of the folder's; there may be none.
    depth : path, (h, w) array or network, optional
        A picture, .npy, .npz, EXR or array, in place of the folder's. What a masked array hides is missing. An .onnx
        file or a function is a network, as depth_model. With colours, depth without a unit, or of floats that are known
        everywhere, is taken at a smaller size if its edges are wider than a pixel, see files/depth/depth_kinds.py.
    intrinsics : path, str, (4,) float or Camera, optional
        A file (see files/cameras/camera_files.py), "fx,fy,cx,cy", four numbers or a camera. The default is a file
        beside the pictures or the lens in EXIF, else, with a note, a camera that is usual for the size: a sensor's or
        one that sees 60 degrees.
    fov : float, optional
        Vertical field of view in degrees, in place of intrinsics.
    depth_scale : float, optional
        Raw values per metre (1000: millimetres, TUM: 5000). The default is that of the camera's file, else what the
        values show, else 1000 for integers and 1 for floating point.
    depth_kind : {"z", "ray", "plane", "inverse", "disparity", "kinect", "buffer", "reversed"}, optional
        What the values mean. The default is that of the camera's file, else what the values show, else "z".
    baseline : float, optional
        Metres between the two cameras of a disparity.
    near : float, optional
        Metres of a depth buffer's near plane, where it is 0, of reversed depth where it is 1, or of the largest value
        of inverse depth without a scale. The default is that of the camera's file, else a guess.
    far : float, optional
        Likewise of the other end; it may be infinite. A buffer of reversed z has near and far exchanged.
    channel : str, optional
        Which channel of the depth's file is depth: of an EXR picture its name or that of its layer, of other pictures
        "red", "green", "blue" or "alpha", of an array (h, w, n) its number from 0, of an .npz the name of the array.
    pose : path or (4, 4) float, optional
        Camera-to-world, x right, y down, z forward, or its file (see files/cameras/pose_files.py). OpenGL's has y up:
        `pose @ numpy.diag([1, -1, -1, 1])`.
    poses : path, optional
        A file with the poses of the folder's frames, in place of what lies in the folder: any that
        files/cameras/pose_files.py reads, by name, time stamp, number or order. A pose by the folder's own name is that
        of all its frames, as of a camera that stands still.
    allow_outside : bool
        Let depth.txt and rgb.txt name files outside the folder.
    max_pixels : float
        Limit for one picture; the default allows 12 288 x 8 192. Other limits follow from it, see
        files/access/content.py.
    depth_model : path or callable, optional
        A network that makes depth of the photograph: an .onnx file (extra "onnx"), or a function that takes
        (h, w, 3) uint8 and returns depth, (h, w) or a mapping with depth (or inverse_depth, points) and perhaps mask
        and intrinsics. The camera is that of EXIF, else of the network, else sees 60 degrees.
    model_size : str, int or (width, height), optional
        Pixels of an .onnx file's input, such as "686x518", or its shorter side alone. The default is what the file, the
        configuration beside it or its family says, see files/networks/model_options.py.
    model_pixels : {"imagenet", "symmetric", "unit", "bytes"}, optional
        What its pixels are: normalised by mean and deviation of ImageNet, from -1 to 1, from 0 to 1, from 0 to 255.
    cache : bool
        Keep the depth of an .onnx file in a folder .pointshade beside the photograph, named by the bytes of both.
    scale_frames : {"auto", "keep"}
        Whether one scale is found for the frames of a film whose depth has none, or breathes, from what does not change
        between them (see files/depth/scale_over_time.py), which is the default, or each is kept by itself.
    projection : {"pinhole", "lens", "fisheye", "equirectangular"}
        How the pictures show the world. The default is what the camera's file says, unless planes are flat only
        without its lens; and what a panorama itself shows. "pinhole" takes pictures as they are; "lens" as the file
        says; "fisheye" takes the file's numbers as Kannala and Brandt's, or fov as the angle of an equidistant lens;
        "equirectangular" is a panorama, twice as wide as high, with lengths of rays.
    notes : callable, optional
        Called with one sentence for every guess; the default prints it to stderr.

    Raises
    ------
    ValueError, TypeError, OSError
        In one sentence, for files that cannot be read right.
    """
    if is_model(depth) and depth_model is None:
        depth, depth_model = None, depth
    network = depth_model, model_size, model_pixels, cache
    known = intrinsics, fov, depth_scale, depth_kind, baseline, pose, max_pixels
    options = ReadOptions(*known, *network, scale_frames, poses, near, far, channel, projection)
    return read_frame(folder, depth, color, options, allow_outside, notes or print_note).frame


def read_frame(
    source: FilePath | Folder | None, depth: Any, color: Any, options: ReadOptions, allow_outside: bool, note: Note
) -> Assembled:
    """As `load_frame`, with how the files were understood."""
    if options.poses is not None and (source is None or depth is not None or color is not None):
        raise ValueError(f"{option('poses')} is about the frames of a folder: pass a folder alone, or leave it out")
    if options.depth_model is not None and (color is not None or depth is not None):
        if depth is not None:
            raise ValueError(f"pass {option('depth')} or {option('depth_model')}, not both")
        if source is not None:
            raise ValueError(f"pass the photograph as {option('color')} or as the input, not both")
        beside = Folder(check_path(color).parent if is_path(color) else Path(), allow_outside)
        return open_photographs(beside, color, options, note).assembled(0)
    if source is None or depth is not None or color is not None:
        opened = open_given(source, depth, color, options, allow_outside, note)
        return _first_of(opened, opened.folder, note) if opened.is_film else opened.assembled(0)
    path = source.path if isinstance(source, Folder) else builtin_folder(source)
    opened = open_folder(source, options, note) if isinstance(source, Folder) else None
    sequence = opened or open_frames(path, allow_outside, options, note)
    return _first_of(sequence, path, note)


def _first_of(sequence: FrameSequence, path: FilePath, note: Note) -> Assembled:
    """The first frame that can be read; a note tells of the others."""
    index, read = first_readable(sequence)
    if len(sequence) > 1:
        one = sequence.parts[index]
        taken = f"picture {one.number}" if sequence.is_film else Path(one.name).name
        note(f"{path} is a sequence of {len(sequence)} frames: {taken} is taken{all_of_them()}")
    return read


def _parts(depth: Any, color: Any) -> FrameParts:
    """Of files or arrays that the caller gives."""
    depth, color = (check_path(value) if is_path(value) else value for value in (depth, color))
    is_hidden = getattr(depth, "mask", None) if is_masked(depth) else None  # integers have no number for "missing"
    valid = None if is_hidden is None else one_channel((~is_hidden).astype(np.uint8), "the depth's mask")
    return FrameParts(depth, color, valid=valid, path=Path(depth) if is_path(depth) else None)


def open_given(
    source: FilePath | Folder | None, depth: Any, color: Any, options: ReadOptions, allow_outside: bool, note: Note
) -> FrameSequence:
    """A frame whose depth or colour the caller gives, alone or of a folder; the frames of a film or of a panorama."""
    if options.poses is not None:
        raise ValueError(f"{option('poses')} is about the frames of a folder: pass a folder alone, or leave it out")
    if color is None or is_path(color):
        film = open_given_film(source if depth is None else depth, color, options, note)
        if film is not None:
            return film
    if source is None and depth is None:
        raise ValueError(f"a frame needs depth: pass a folder with depth.*, or {option('depth', 'FILE')}")
    if source is None:
        place, parts = Folder(Path()), _parts(depth, color)
    else:
        path = source.path if isinstance(source, Folder) else builtin_folder(source)
        place = source if isinstance(source, Folder) else Folder(path, allow_outside)
        place, parts = _from_parts(place, depth, color, options, note)
    frames, options = as_pinholes([parts], options, note)
    return FrameSequence(place, frames, options, note, OF_PANORAMA if len(frames) > 1 else "")


def _from_parts(place: Folder, depth: Any, color: Any, options: ReadOptions, note: Note) -> tuple[Folder, FrameParts]:
    """A frame of a folder, or of a depth file, with its depth, its colour or both given by the caller."""
    if place.path.is_file():
        if depth is not None:
            raise ValueError(f"{place.path} is a file and would be the depth: leave out {option('depth')}, or the file")
        depth, place = place.path, Folder(place.path.parent, place.allow_outside, levels=0)
    check_folder(place.path)
    if depth is None:
        depth = open_folder(place, options, note).parts[0].path
    files = [FrameFiles(place.own(Path(depth)))] if is_path(depth) else []
    if color is None and files:
        color = find_color(place, files[0].depth, note)
    for path in (depth, color):
        if is_path(path):
            place.check(Path(path))
    cameras = find_filed(place, files, options, note)
    return place, _parts(depth, color)._replace(filed=cameras.of(0), missing=cameras.missing)


class Examined(NamedTuple):
    """A frame, how its files were understood, and the notes that reading it gave."""

    read: Assembled
    notes: list[str]

    @property
    def frame(self) -> Frame:
        return self.read.frame


def examine(source: FilePath | None, allow_outside: bool = False, **load_options: Any) -> Examined:
    """Reads a frame with the options of `load_frame`, except notes, and raises as it does. Of a sequence: the first."""
    notes: list[str] = []
    color, depth = load_options.pop("color", None), load_options.pop("depth", None)
    options = ReadOptions(**load_options)
    return Examined(read_frame(source, depth, color, options, allow_outside, notes.append), notes)


def facts(examined: Examined) -> dict[str, dict[str, Any]]:
    """What was found, by subject; numbers are plain, lengths in metres, so that programs can read it as JSON."""
    read, frame = examined.read, examined.frame
    camera, found = frame.camera, read.found
    known = frame.depth[frame.depth > 0]
    low, middle, high = (float(f"{value:.6g}") for value in np.quantile(known, (0, 0.5, 1)))
    sides = (camera.width, camera.fx), (camera.height, camera.fy)
    color = None if frame.color is None else list(frame.color.shape[1::-1])
    return {
        "frames": {"count": found.frames, "shown": found.shown},
        "depth": {
            "file": found.depth,
            "size": [camera.width, camera.height],
            "stored": read.stored,
            "kind": read.coding.kind,
            "units_per_metre": None if read.coding.kind in RANGED else read.coding.scale,
            "why": read.coding.why,
            "range": [low, high],
            "median": middle,
            "missing": round(1 - frame.points_known / frame.depth.size, 4),
        },
        "color": {"file": found.color, "size": color},
        "camera": {
            **{key: getattr(camera, key) for key in ("fx", "fy", "cx", "cy")},
            "fov": [round(math.degrees(2 * math.atan(side / 2 / abs(focal))), 2) for side, focal in sides],
            "from": read.camera_from,
        },
        "poses": {"count": found.poses, "from": found.poses_from or None},
        "fit": {"compared": read.is_compared, "doubts": [one for one in examined.notes if isinstance(one, Doubt)]},
    }
