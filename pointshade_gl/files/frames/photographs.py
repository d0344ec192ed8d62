"""Opens photographs as frames: a network makes the depth of each when it is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note, once
from ...notes.words import option
from ...scene.camera import Camera
from ..access.content import FilePath
from ..access.file_name_patterns import COLOR_SUFFIXES, VIDEO_SUFFIXES
from ..access.safe_paths import Folder
from ..cameras.camera_files import read_intrinsics
from ..cameras.exif import camera_from_exif
from ..cameras.intrinsics import Intrinsics, Size, place_camera
from ..containers.contents import Contents
from ..depth_models.photo_depth import PhotoDepth
from ..index.folder_poses import FoundPoses
from ..index.folders import FrameFiles, find_photographs
from ..index.given_poses import given_poses
from .camera_choice import find_filed
from .color_files import read_colors_of
from .frame_parts import Parts, ReadOptions, is_path
from .frame_sequence import FrameSequence


def open_photographs(place: Folder, source: Any, options: ReadOptions, note: Note) -> FrameSequence:
    """Open a photograph, a film or a folder of photographs; a network makes depth of each that is asked for.

    place   the folder
    source  a file in it, the folder itself, or (h, w, 3|4) uint8

    Raises ValueError or OSError for what is no photograph.
    """
    network = options.network
    assert network is not None
    note = once(note)
    found = _list(place, source, options, note)
    filed: Sequence[Intrinsics | None] = [None] * len(found)
    if is_path(source) and Path(source) == place.path:
        cameras = find_filed(place, [FrameFiles(Path(one.color)) for one in found], options, note)  # type: ignore[arg-type]
        filed = [_plain(cameras.of(one.number)) for one in found]
    poses = FoundPoses([None] * len(found))
    if options.poses is not None:  # then there is a file or a folder
        poses = given_poses(options.poses, Path(source), list(map(_files_of, found)), note, options.max_pixels)
    found = [
        one._replace(filed=camera, pose=pose, maker=network.title)
        for one, camera, pose in zip(found, filed, poses.poses, strict=True)
    ]
    shown = _Shown(found, options, PhotoDepth(network, note, options.max_pixels), note)
    parts = [one._replace(contents=partial(shown.contents, index)) for index, one in enumerate(found)]
    return FrameSequence(place, parts, options, note, poses.source)


def _files_of(parts: Parts) -> FrameFiles:
    """Return the file of a photograph; that of a picture of a video is called by its number."""
    path = Path(parts.color)  # type: ignore[arg-type]
    return FrameFiles(path / str(parts.number) if _is_video(path) else path, number=parts.number)


def _list(place: Folder, source: Any, options: ReadOptions, note: Note) -> list[Parts]:
    """Return a part for each photograph, without its depth."""
    if not is_path(source):
        return [Parts(None, source)]
    path = Path(source)
    colors = find_photographs(place, note) if path == place.path else [path]
    if len(colors) == 1 and colors[0].suffix.lower() in VIDEO_SUFFIXES:
        from ..pictures.video import count_pictures  # only here

        return [Parts(None, colors[0], number=k) for k in range(count_pictures(colors[0], options.max_pixels))]
    if not colors:
        raise FileNotFoundError(
            f"{path} has no photographs ({', '.join(COLOR_SUFFIXES[:4])}...) of which {option('depth_model')} could "
            "make depth"
        )
    return [Parts(None, color, number=k) for k, color in enumerate(colors)]


def _plain(camera: Intrinsics | None) -> Intrinsics | None:
    """Return a camera without what its file says about depth, which is another one."""
    return camera and replace(camera, depth_scale=None, depth_kind=None, baseline=None, doffs=None)


class _Shown:
    """Photographs and the network that is shown them."""

    def __init__(self, parts: Sequence[Parts], options: ReadOptions, depth: PhotoDepth, note: Note):
        self._parts, self._options, self._depth, self._note = parts, options, depth, note

    def contents(self, index: int) -> Contents:
        """Return a photograph's depth. A film has one camera: what the network says of its first picture."""
        found, size, focal = self._seen(index)
        if focal is not None:
            return replace(found, intrinsics=None)
        if index == 0 or found.intrinsics is None:
            return found
        first, first_size, _ = self._seen(0)
        return replace(found, intrinsics=first.intrinsics) if first_size == size else found

    def _seen(self, index: int) -> tuple[Contents, Size, float | None]:
        """Return a photograph's depth and size, and its focal length where it is known without the network."""
        parts = self._parts[index]
        photo = _rgb(read_colors_of(parts, self._options.max_pixels))
        size = photo.shape[1], photo.shape[0]
        focal = self._focal(parts, size)
        path = Path(parts.color) if is_path(parts.color) else None
        try:
            return self._depth.of(photo, index, path, focal), size, focal
        except (ValueError, TypeError) as error:
            where = "" if path is None or path.name in str(error) else f"{path}: "
            raise type(error)(f"{where}{error}") from error

    def _focal(self, parts: Parts, size: Size) -> float | None:
        options = self._options
        if options.fov is not None:
            return Camera.from_fov(options.fov, *size).fx
        source = parts.filed
        if options.intrinsics is not None:
            source = read_intrinsics(options.intrinsics, _unheard, options.max_pixels)
        elif source is None and is_path(parts.color) and not _is_video(parts.color):
            source = camera_from_exif(parts.color, options.max_pixels)
        return None if source is None else abs(place_camera(source, size, size, _unheard).fx)


def _rgb(color: Any) -> NDArray[np.uint8]:
    """Return (h, w, 3) uint8 without what is transparent being hidden."""
    array = np.asarray(color)
    if array.dtype != np.uint8 or array.ndim != 3 or array.shape[2] not in (3, 4):
        raise ValueError(f"a photograph must have shape (h, w, 3) and be uint8, got {array.dtype} {array.shape}")
    return np.ascontiguousarray(array[..., :3])


def _is_video(path: FilePath) -> bool:
    return Path(path).suffix.lower() in VIDEO_SUFFIXES


def _unheard(_: str) -> None:
    """What a camera needs is told when the frame is put together."""
