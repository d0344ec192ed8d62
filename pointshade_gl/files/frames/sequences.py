"""Sequences of frames: of a folder, a file, or photographs whose depth a network makes; each read when asked for."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from ...notes.errors import Bug, error_text, is_expected
from ...notes.notes import Note, once
from ...notes.words import counted, option
from ...scene.camera import Camera
from ...scene.frame import Frame
from ..access import known_names as names
from ..access.content import FilePath, note_read
from ..access.folders import LEVELS, Folder, Listing
from ..cameras.camera_files import camera_from_exif, read_intrinsics
from ..cameras.intrinsics import Intrinsics, Size, place_camera
from ..cameras.lenses import PANORAMA
from ..cameras.pose_files import FAILS, Reading, find_reading
from ..containers.container_contents import Contents
from ..depth.depth_kinds import Coding, Decoded
from ..depth.scale_over_time import FilmScale, ScaledFrame
from ..finding import folder_frames
from ..finding.folder_cameras import Cameras, FoundPoses, find_poses, given_poses
from ..finding.folder_frames import FrameFiles
from .assembly import assemble, find_filed, read_colors_of
from .frame_parts import Assembled, FrameParts, ReadOptions, is_path
from .panoramas import OF_PANORAMA, as_pinholes, is_marked

if TYPE_CHECKING:
    from ..networks.photo_depth import PhotoDepth

_APART = 0.1  # metres, or what a turn of 6 degrees changes: views that are compared are so far apart
_COMPARED = 3


class FrameSequence(Sequence[Frame]):
    """Frames, each read when it is asked for; slices are sequences too. [k] raises ValueError or OSError, in one
    sentence, for a frame that cannot be read."""

    def __init__(
        self, place: Folder, parts: Sequence[FrameParts], options: ReadOptions, note: Note, poses_from: str = ""
    ):
        self.folder, self.note, self.poses_from = place.path, note, poses_from
        self.reading: Reading | None = None  # how poses and cameras are to be understood
        self._place, self._options = replace(place, listing=Listing()), options  # what was listed is not kept
        self._is_built_in = names.is_built_in(place.path) and options.pose is None
        self._stream = object() if len(parts) > 1 else None  # what its frames have in common
        self._coding: Coding | None = None  # of the first depth that was read: the others are read like it
        self._hold(parts)
        note_read(file for one in parts for file in (one.path, one.color, one.valid))
        # what finds one scale for all frames, which of its pictures each is, and these
        self._film: tuple[FilmScale, Sequence[int], Sequence[FrameParts]] | None = None
        if len(parts) > 1 and options.scale_frames != "keep":
            is_networks = bool(parts[0].maker)
            scale = FilmScale(not self.posed or is_networks, is_networks, note)
            self._film = scale, range(len(parts)), parts

    def _hold(self, parts: Sequence[FrameParts]) -> None:
        self.parts = parts
        self.posed = sum(one.pose is not None for one in parts)  # how many frames have a pose
        if parts and is_path(parts[0].color) and _is_video(parts[0].color):
            weakref.finalize(self, _end_video)

    @property
    def is_placed(self) -> bool:
        """It is known where frames are: by poses of their own, or by one that was given for all."""
        return self.posed > 0 or self._options.pose is not None

    @property
    def is_film(self) -> bool:
        """Its depth is that of a film."""
        return bool(self.parts) and self.parts[0].path is not None and _is_video(self.parts[0].path)

    def __len__(self) -> int:
        return len(self.parts)

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> FrameSequence: ...
    def __getitem__(self, index: int | slice) -> Frame | FrameSequence:
        if isinstance(index, slice):
            chosen = copy(self)
            chosen._hold(self.parts[index])
            chosen._film = self._film and (self._film[0], self._film[1][index], self._film[2])
            return chosen
        return self.assembled(index).frame

    def assembled(self, index: int, note: Note | None = None, with_color: bool = True) -> Assembled:
        """Return a frame, and how its files were understood: all as the first that was read. Raises as [k] does."""
        parts = self.parts[index]
        try:
            for path in (parts.path, parts.color, parts.valid):
                if isinstance(path, Path):
                    self._place.check(path)
            parts = parts if with_color else parts._replace(color=None)
            if self._film is None or self._film[0].is_over or not with_color:
                read = self._put_together(parts, note or self.note)
            else:
                with self._film[0].lock:
                    read = self._put_together(parts, note or self.note, partial(self._scale_of, index))
            if note is None:
                self._coding = self._coding or read.coding
        except Exception as error:
            if len(self) == 1 or isinstance(error, MemoryError):
                raise
            is_file = isinstance(error, OSError)
            if not (is_file or is_expected(error)):
                raise Bug(f"frame {index}: {error_text(error)}") from error
            where = "" if Path(parts.name).name in str(error) else f"{parts.name}: "
            raise (OSError if is_file else ValueError)(f"frame {index}: {where}{error}") from None
        found = read.found._replace(frames=len(self), shown=index, poses=self.posed, poses_from=self.poses_from)
        return read._replace(found=found)

    def _put_together(self, parts: FrameParts, note: Note, scale_of: Any = None) -> Assembled:
        read = assemble(parts, self._options, note, self.reading, self._coding, self._stream, scale_of)
        if not self._is_built_in:
            return read
        return read._replace(frame=read.frame.with_up(names.BUILT_IN_UP, names.BUILT_IN_MIDDLE))

    def _scale_of(self, index: int, decoded: Decoded, colors: Any, camera: Camera) -> ScaledFrame:
        """Return how a frame is laid, after those before it in the film."""
        assert self._film is not None
        film, numbers, parts = self._film

        def read(number: int) -> None:
            scale_of: Any = partial(film.of, number, read=lambda _: None)
            self._put_together(parts[number], self.note, scale_of)

        return film.of(numbers[index], decoded, colors, camera, read)

    def settle(self, may_scale: bool, metric_poses: bool) -> None:
        """Find out how poses and camera are to be understood, from frames that see the same, and note any change.

        may_scale     the unit of the depth was guessed
        metric_poses  the unit of the poses is the metre; else it is anything
        """
        if self.posed < 2:
            return
        try:
            frames = [self.assembled(k, lambda _: None, with_color=False).frame for k in self._apart()]
        except (ValueError, OSError):
            return  # reported when they are asked for
        found = find_reading(frames, may_scale, metric_poses)
        if found is None:
            return
        if found.reading != Reading():
            self.reading = found.reading
            better = f"(their depths differ by {found.error:.1%} instead of {found.error_as_written:.0%})"
            why = f"the views lie over each other only if {found.reading}"
            self.note(f"{self.folder}: {why}, so they are read like that {better}")
        elif found.error > FAILS:
            what = f"the views do not lie over each other (their depths differ by {found.error:.0%})"
            question = f"are {option('depth_scale')}, camera and poses right?"
            self.note(f"{self.folder}: by their poses {what}: {question}")

    def _apart(self) -> list[int]:
        """Return the first frame, and the next ones that were taken from elsewhere."""
        found: list[int] = []
        for index, one in enumerate(self.parts[:5000]):
            last = self.parts[found[-1]].pose if found else None
            if one.pose is not None and (last is None or abs(one.pose - last).max() > _APART):
                found.append(index)
            if len(found) == _COMPARED:
                break
        return found


def _end_video() -> None:
    """End the process that decodes a video, with the sequence."""
    from ..pictures.video import close_video  # only here

    close_video()


def open_frames(source: Path, allow_outside: bool, options: ReadOptions, note: Note) -> FrameSequence:
    """Open the frames of a folder or file. Raises OSError if there are none, ValueError for impossible content."""
    if options.depth_model is not None:
        folder = source.parent if source.is_file() else folder_frames.check_folder(source)
        return open_photographs(Folder(folder, allow_outside), source, options, note)
    if not source.is_file():
        return open_folder(Folder(folder_frames.check_folder(source), allow_outside), options, note)
    if _is_video(source):
        from ..finding.folder_films import find_film  # only here

        beside = Folder(source.parent, allow_outside, levels=0)
        if film := find_film(beside, source, note, options.max_pixels):
            return _from_files(beside, film, options, note)
    if unread := names.what_else(source):
        raise ValueError(f"{source} is {unread}")
    from ..containers.opening import is_zip_folder, unpack_folder  # only here

    if is_zip_folder(source, options.max_pixels):
        return open_folder(Folder(unpack_folder(source, options.max_pixels)), options, note)
    place, source = Folder(source.parent, allow_outside, levels=0), folder_frames.numbers_of(source, note)
    # a container may hold the colours itself, so it need not have any beside it
    color = folder_frames.find_color(place, source, (lambda _: None) if folder_frames.is_container(source) else note)
    return _from_files(place, [FrameFiles(source, color)], options, note)


def open_given_film(depth: Any, color: Any, options: ReadOptions, note: Note) -> FrameSequence | None:
    """The frames of a film of depth that the caller names, perhaps with one of colours; None for anything else."""
    if not is_path(depth) or not _is_video(depth) or not Path(depth).is_file():
        return None
    from ..finding.folder_films import film_pictures, find_film  # only here

    place, film = Folder(Path(depth).parent, levels=0), Path(depth)
    if is_path(color):
        files = film_pictures(film, Path(color), True, note, options.max_pixels)
    else:
        files = find_film(place, film, note, options.max_pixels) or film_pictures(film, None, True, note)
    return _from_files(place, files, options, note)


def open_folder(place: Folder, options: ReadOptions, note: Note) -> FrameSequence:
    if options.depth_model is not None:
        return open_frames(place.path, place.allow_outside, options, note)
    held = _open_container(place.path, note, options.max_pixels)  # of Record3D: its metadata know more than its files
    if held:
        return _from_container(place, place.path, held, options, note)
    files = folder_frames.find_frames(place, note, options.max_pixels) or _photographs_with_depth(place)
    files = files or _film_in(place, note, options.max_pixels)
    missed = place.listing.not_whole(place.path)
    if not files and missed:
        raise OSError(f"{place.path} has no depth picture, but {missed[0]}")
    if missed:
        more = f" (and {counted(len(missed) - 1, 'more folder')} likewise)" if len(missed) > 1 else ""
        note(f"{missed[0]}{more}")
    if not files:
        expected = f"expected depth.png (or {', '.join(names.DEPTH_SUFFIXES[:6])}...) or a folder depth/ in it"
        way_out = f"or pass {option('depth', 'FILE')}{_instead(place)}"
        raise FileNotFoundError(f"{place.path} has no depth picture: {expected}, {way_out}")
    return _from_files(place, files, options, note)


def _photographs_with_depth(place: Folder) -> list[FrameFiles]:
    """The JPEGs of a folder, if the first of them has depth in it."""
    from ..containers.phones import has_gdepth  # only here

    photos = [item.path for item in place.listing.files(place.path, 1, (".jpg", ".jpeg")) if not item.level]
    return [FrameFiles(path, number=k) for k, path in enumerate(photos)] if photos and has_gdepth(photos[0]) else []


def _film_in(place: Folder, note: Note, max_pixels: float) -> list[FrameFiles]:
    """The pictures of a folder's film of depth, where it has one."""
    if not place.listing.files(place.path, 1, names.VIDEO_SUFFIXES):
        return []
    from ..finding.folder_films import find_film  # only here

    return find_film(place, None, note, max_pixels)


def _instead(place: Folder) -> str:
    """What a folder holds instead of depth, and what to do with it, to end a sentence; "" if nothing is known."""
    folder, files = place.path, [item.path for item in place.listing.files(place.path, 1)]
    for path in files:
        if found := names.what_else(path):
            return f"; {path.relative_to(folder)} is {found}"
    photo = next((path for path in files if path.suffix.lower() in names.COLOR_SUFFIXES), None)
    if photo is None:
        is_deep = not files and bool(place.listing.folders(folder))
        return f"; look into its folders, more than {LEVELS} deep" if is_deep else "" if files else "; it is empty"
    from ..networks.model_options import how_to_make_depth  # only here

    return f"; {photo.relative_to(folder)} is a photograph: {how_to_make_depth()}"


def _open_container(path: Path, note: Note, max_pixels: float) -> Sequence[Contents] | None:
    from ..containers.opening import open_container  # only here: its readers are many

    return open_container(path, note, max_pixels)


def _from_files(place: Folder, files: Sequence[FrameFiles], options: ReadOptions, note: Note) -> FrameSequence:
    limit, first = options.max_pixels, files[0].depth
    is_chosen = options.channel is not None and first.suffix.lower() == ".npz"  # one array alone
    held = _open_container(first, note, limit) if folder_frames.is_container(first) and not is_chosen else None
    if held is not None and len(files) == 1 < len(held):
        return _from_container(place, first, held, options, note)
    cameras = find_filed(place, files, options, note)
    poses = FoundPoses([None] * len(files))
    if options.poses is not None:
        poses = given_poses(options.poses, place.path, files, note, limit)
    elif options.pose is None and len(files) > 1:
        poses = find_poses(place, files, note, limit)
    parts = []
    for one, pose in zip(files, poses.poses, strict=True):
        contents = None if held is None else partial(_only, one.depth, limit)
        if held and one is files[0]:  # whose notes are printed
            contents = partial(held.__getitem__, 0)
        where = cameras.of(one.number), pose, one.valid, cameras.missing, one.number
        parts.append(FrameParts(one.depth, one.color, *where, contents, one.depth))
    # ScanNet writes -inf where a pose was lost
    good = [one for one in parts if one.pose is None or np.isfinite(one.pose).all()] or parts
    if lost := len(parts) - len(good):
        note(f"{place.path}: {lost} of {len(parts)} frames have lost their pose (it is not finite): left out")
    known = cameras.of(0)
    guessed = options.depth_scale is None and (known is None or known.depth_scale is None)
    return _settled(place, good, options, note, poses, may_scale=guessed)


def _settled(
    place: Folder, parts: Sequence[FrameParts], options: ReadOptions, note: Note, poses: FoundPoses, may_scale: bool
) -> FrameSequence:
    """The frames of these parts; of panoramas six for each, whose poses are taken as they are."""
    unrolled, options = as_pinholes(parts, options, note)
    if len(unrolled) > len(parts):
        return FrameSequence(place, unrolled, options, note, poses.source or OF_PANORAMA)
    sequence = FrameSequence(place, unrolled, options, note, poses.source)
    sequence.settle(may_scale, poses.metric)
    return sequence


def _from_container(
    place: Folder, path: Path, held: Sequence[Contents], options: ReadOptions, note: Note
) -> FrameSequence:
    """Return the frames of one file, whose colours and camera may lie beside it."""
    first = held[0]
    cameras = find_filed(place, [], options, note) if first.intrinsics is None else Cameras(None)
    poses = FoundPoses([None] * len(held))
    if options.poses is not None:
        entries = [FrameFiles(path / str(k), number=k) for k in range(len(held))]
        poses = given_poses(options.poses, path, entries, note, options.max_pixels)
    elif first.pose is not None:
        is_alone = len(held) == 1  # it is read with the rest
        poses = FoundPoses([None if is_alone else held[k].pose for k in range(len(held))], path.name)
    parts = []
    for k, pose in enumerate(poses.poses):
        known = cameras.of(k), pose, None, cameras.missing, k
        parts.append(FrameParts(None, None, *known, partial(held.__getitem__, k), path))
    return _settled(place, parts, options, note, poses, may_scale=False)


def _only(path: Path, max_pixels: float) -> Contents:
    held = _open_container(path, lambda _: None, max_pixels)
    if not held:
        raise ValueError(f"{path} holds no depth, unlike the first file beside it")
    return held[0]


def first_readable(sequence: FrameSequence) -> tuple[int, Assembled]:
    """Return the first readable frame, and its index; else raises the first frame's error."""
    for index in dict.fromkeys((0, len(sequence) // 2, len(sequence) - 1)):
        try:
            return index, sequence.assembled(index)
        except (ValueError, OSError):
            continue
    return 0, sequence.assembled(0)


def open_photographs(place: Folder, source: Any, options: ReadOptions, note: Note) -> FrameSequence:
    """Open a photograph, a film or a folder of photographs; a network makes depth of each that is asked for.

    The source is a file in the folder, the folder itself, or (h, w, 3|4) uint8. Raises ValueError or OSError for what
    is no photograph.
    """
    network = options.network
    assert network is not None
    note = once(note)
    found = _list(place, source, options, note)
    first = found[0].color
    if options.projection == PANORAMA or (options.projection is None and is_path(first) and is_marked(first)):
        name = Path(first).name if is_path(first) else "the photograph"
        fix = "make its depth with a program for panoramas, and pass both pictures"
        raise ValueError(f"{name} is a panorama, and networks are made for pictures of a pinhole: {fix}")
    filed: Sequence[Intrinsics | None] = [None] * len(found)
    if is_path(source) and Path(source) == place.path:
        cameras = find_filed(place, [FrameFiles(Path(one.color)) for one in found], options, note)  # type: ignore[arg-type]
        cameras_of = (cameras.of(one.number) for one in found)  # what a file states about depth is of another one
        filed = [
            one and replace(one, depth_scale=None, depth_kind=None, baseline=None, doffs=None) for one in cameras_of
        ]
    poses = FoundPoses([None] * len(found))
    if options.poses is not None:  # then there is a file or a folder; pictures of a video are called by their numbers
        paths = [Path(one.color) for one in found]  # type: ignore[arg-type]
        paths = [path / str(one.number) if _is_video(path) else path for path, one in zip(paths, found, strict=True)]
        files = [FrameFiles(path, number=k) for k, path in enumerate(paths)]
        poses = given_poses(options.poses, Path(source), files, note, options.max_pixels)
    found = [
        one._replace(filed=camera, pose=pose, maker=network.title)
        for one, camera, pose in zip(found, filed, poses.poses, strict=True)
    ]
    from ..networks.photo_depth import PhotoDepth  # only here: few depth is made by a network

    shown = _Shown(found, options, PhotoDepth(network, note, options.max_pixels), note)
    parts = [one._replace(contents=partial(shown.contents, index)) for index, one in enumerate(found)]
    return FrameSequence(place, parts, options, note, poses.source)


def _list(place: Folder, source: Any, options: ReadOptions, note: Note) -> list[FrameParts]:
    if not is_path(source):
        return [FrameParts(None, source)]
    path = Path(source)
    colors = folder_frames.find_photographs(place, note) if path == place.path else [path]
    if len(colors) == 1 and colors[0].suffix.lower() in names.VIDEO_SUFFIXES:
        from ..pictures.video import count_pictures  # only here

        return [FrameParts(None, colors[0], number=k) for k in range(count_pictures(colors[0], options.max_pixels))]
    if not colors:
        photographs = f"photographs ({', '.join(names.COLOR_SUFFIXES[:4])}...)"
        raise FileNotFoundError(f"{path} has no {photographs} of which {option('depth_model')} could make depth")
    return [FrameParts(None, color, number=k) for k, color in enumerate(colors)]


class _Shown:
    """Photographs and the network that is shown them."""

    def __init__(self, parts: Sequence[FrameParts], options: ReadOptions, depth: PhotoDepth, note: Note):
        self._parts, self._options, self._depth, self._note = parts, options, depth, note

    def contents(self, index: int) -> Contents:
        """Return a photograph's depth. A film has one camera: what the network gives for its first picture."""
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
        array = np.asarray(read_colors_of(parts, self._options.max_pixels))
        if array.dtype != np.uint8 or array.ndim != 3 or array.shape[2] not in (3, 4):
            raise ValueError(f"a photograph must have shape (h, w, 3) and be uint8, got {array.dtype} {array.shape}")
        photo, size = np.ascontiguousarray(array[..., :3]), (array.shape[1], array.shape[0])  # nothing is transparent
        focal = self._focal(parts, size)
        path = Path(parts.color) if is_path(parts.color) else None
        try:
            return self._depth.of(photo, index, path, focal), size, focal
        except (ValueError, TypeError) as error:
            where = "" if path is None or path.name in str(error) else f"{path}: "
            raise type(error)(f"{where}{error}") from error

    def _focal(self, parts: FrameParts, size: Size) -> float | None:
        options = self._options  # what a camera needs is noted when the frame is put together
        if options.fov is not None:
            return Camera.from_fov(options.fov, *size).fx
        source = parts.filed
        if options.intrinsics is not None:
            source = read_intrinsics(options.intrinsics, lambda _: None, options.max_pixels)
        elif source is None and is_path(parts.color) and not _is_video(parts.color):
            source = camera_from_exif(parts.color, options.max_pixels)
        return None if source is None else abs(place_camera(source, size, size, lambda _: None).fx)


def _is_video(path: FilePath) -> bool:
    return Path(path).suffix.lower() in names.VIDEO_SUFFIXES
