"""Loads point clouds: reads the file, leaves out what is no point, places it; and recognises and examines files."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from ...checks.arguments import (
    as_array,
    check_choice,
    check_count,
    check_flag,
    check_numbers,
    check_path,
    check_positive,
)  # fmt: skip
from ...checks.foreign_arrays import Numbers
from ...notes.notes import Note, print_note
from ...notes.words import counted, option
from ...scene.cloud import UPS, PointCloud, Up
from ...scene.dense_part import sample_of
from ..access.content import MAX_PIXELS, FilePath, naming, read_head
from ..access.known_names import NOT_PICTURES, builtin_name
from ..arrays.compression import ZIP, Archive
from ..arrays.numpy_files import BROKEN, NUMPY, SURFACES, find_roles, is_named, npz_arrays, read_header
from ..arrays.ply_and_pcd import is_pcd
from ..containers.array_frames import is_organised
from ..frames.frame_parts import LoadOptions
from . import cloud_arrays
from .cloud_columns import (
    COLOR_BY,
    COUNTS,
    TEXTS,
    ColorBy,
    FoundPoints,
    has_positions,
    read_text_head,
    read_text_points,
)  # fmt: skip
from .placing import (
    choices,
    colors_of,
    drop_invalid,
    drop_strays,
    guess_up,
    keep_box,
    keep_most,
    main_box,
    placed,
    places_of,
    spacing_of,
    strays_of,
)  # fmt: skip
from .scans import E57, LAS, read_e57_points, read_las_points

_BOX = "crop must be two opposite corners of a box, six finite numbers"
_MOST_PLACES = 100
_PLACES = f"seen_from must be a place (3,), or up to {_MOST_PLACES} of them (k, 3), of finite numbers"
_OTHER = {"x": "z", "y": "z", "z": "y"}  # what is most likely if it is not that
_Reader = Callable[[FilePath, Note, float], FoundPoints]


@dataclass(frozen=True)
class CloudOptions:
    """What the caller gives with a cloud; see `load_cloud`."""

    up: Up | None = None
    most: int | None = None
    color_by: ColorBy | None = None
    max_pixels: float = MAX_PIXELS
    crop: Numbers | None = None
    clean: bool = False
    seen_from: Numbers | None = None

    def __post_init__(self) -> None:
        check_positive(self.max_pixels, option("max_pixels", beside_file=True))
        check_flag(self.clean, option("clean"))
        if self.crop is not None:
            numbers = as_array(self.crop, _BOX)
            check_numbers(numbers.reshape(-1) if numbers.shape == (2, 3) else numbers, 6, _BOX)
        if self.seen_from is not None:
            places = as_array(self.seen_from, _PLACES)
            if places.shape[-1:] != (3,) or not 0 < places.size <= 3 * _MOST_PLACES:
                raise ValueError(f"{_PLACES}, got shape {places.shape}")
            check_numbers(places.reshape(-1), places.size, _PLACES)
        if self.up is not None:
            check_choice(option("up"), self.up, UPS)
        if self.most is not None:
            check_count(self.most, option("most"), 1)
        if self.color_by is not None:
            check_choice(option("color_by"), self.color_by, COLOR_BY)


def load_cloud(
    path: FilePath, *, up: Up | None = None, most: int | None = None, color_by: ColorBy | None = None,
    max_pixels: float = MAX_PIXELS, crop: Numbers | None = None, clean: bool = False,
    seen_from: Numbers | None = None, notes: Note | None = None
) -> PointCloud:  # fmt: skip
    """Read a point cloud from a file.

    Parameters
    ----------
    path : path
        PLY, also of 3-D Gaussians; PCD; text such as .xyz, .pts and .csv; .npy and .npz; KITTI's .bin; with the extra
        las LAS, LAZ and COPC, with the extra e57 E57.
    up : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Which axis points up. The default is what the format or the file says, else what its planes and extents show.
    most : int, optional
        Read so many points at most, an even sample.
    color_by : {"rgb", "intensity", "class", "height"}, optional
        Where the colours are from. The default is the file's colours, else its intensity as grey.
    max_pixels : float
        Limit for the number of points; other limits follow from it, see files/access/content.py.
    crop : (6,) or (2, 3), optional
        Two opposite corners of a box, in the file's coordinates: what lies outside is left out.
    clean : bool
        Leave out stray points: few, and far from all others. Otherwise they are only no part of what pictures are
        framed by.
    seen_from : (3,) or (k, 3), optional
        Where the scanner stood, in the file's coordinates: normals that are estimated point there. Of several places
        each point takes the nearest from which it is not hidden. The default is what the file says.
    notes : callable, optional
        Called with one sentence for every guess; the default prints it to stderr.

    Returns
    -------
    PointCloud
        Positions are float32 from `origin`, which is zero unless the points lie far from there, as those of maps do.

    Raises
    ------
    ValueError, TypeError, OSError
        In one sentence, for a file that cannot be read right, or without the extra that it needs.
    """
    return read_cloud(
        check_path(path), CloudOptions(up, most, color_by, max_pixels, crop, clean, seen_from), notes or print_note
    )[0]


@np.errstate(all="ignore")  # numbers of broken files are of any size; positions are checked
def read_cloud(path: Path, options: CloudOptions, note: Note) -> tuple[PointCloud, FoundPoints]:
    """As `load_cloud`, with what the file holds."""
    name, head = str(path), read_head(path, 1024)
    read = next((reader for is_kind, reader in _READERS if is_kind(head)), None)
    is_bare = path.suffix.lower() == ".bin" or (b"\0" in head and path.suffix.lower() not in TEXTS)
    read = read or (cloud_arrays.read_lidar_points if is_bare else read_text_points)
    found = read(path, note, options.max_pixels)
    drop_invalid(found, name, note)
    keep_box(found, options.crop, name, note)
    if options.clean:
        drop_strays(found, name, note)
    keep_most(found, options.most, name, note)
    positions, origin = placed(found)
    up = _up(found, positions, origin, options.up, name, note)
    colors = colors_of(found, options.color_by, up, name)
    if options.seen_from is not None:
        found.seen_from = places_of(positions + origin, as_array(options.seen_from, _PLACES).reshape(-1, 3))
    seen_from = None if found.seen_from is None else found.seen_from - origin
    front = found.front if up == found.up else None
    sizes, shares = found.sizes, None
    if sizes is not None:  # 0 where the file has none that can be drawn
        sizes = np.nan_to_num(sizes.astype(np.float32), posinf=0, neginf=0).clip(0, None)
    if found.confidence is not None and found.normals is not None:  # how sure each normal is, 0 to 1
        shares = np.nan_to_num(found.confidence.astype(np.float32), posinf=1).clip(0, 1)
    cloud = PointCloud(positions, _units(found), colors, sizes, shares, origin, up, seen_from, front=front)
    _note_strays(cloud, name, note)
    return cloud, found


def _note_strays(cloud: PointCloud, name: str, note: Note) -> None:
    """A note where pictures are not framed by all points."""
    some = len(sample_of(cloud.positions))
    if lost := some - len(cloud.main_points):
        count = counted(lost, "point") if some == len(cloud) else f"{lost / some:.1%} of the points"
        are = "lies" if count == "1 point" else "lie"
        clean = option("clean", True)
        note(f"{name}: {count} {are} far from all others: pictures are framed without, {clean} leaves out such")


_READERS: tuple[tuple[Callable[[bytes], bool], _Reader], ...] = (
    (lambda head: head.startswith((b"ply\n", b"ply\r")), cloud_arrays.read_ply_points),
    (is_pcd, cloud_arrays.read_pcd_points),
    (lambda head: head.startswith(LAS), read_las_points),
    (lambda head: head.startswith(E57), read_e57_points),
    (lambda head: head.startswith(NUMPY), cloud_arrays.read_npy_points),
    (lambda head: head.startswith(ZIP), cloud_arrays.read_npz_points),
)


def _up(found: FoundPoints, positions: np.ndarray, origin: np.ndarray, given: Up | None, name: str, note: Note) -> Up:
    if given is not None:
        found.up_from = option("up")
        return given
    if found.up is None:
        found.up, found.up_from = guess_up(positions, bool(origin.any()))
        found.up_is_guessed = True
    if found.up_is_guessed:
        other = option("up", _OTHER[found.up[-1]])
        note(f"{name}: up is taken as {found.up} ({found.up_from}); pass {other} if it is not")
    return found.up


def _units(found: FoundPoints) -> np.ndarray | None:
    """Normals of length 1, or 0 where they are unknown; None if all are."""
    if found.normals is None:
        return None
    normals = found.normals.astype(np.float32)
    lengths = np.linalg.norm(normals, axis=1)
    is_known = np.isfinite(lengths) & (lengths > 0)
    if not is_known.any():
        return None
    if np.abs(lengths[is_known] - 1).max() > 1e-6 or not is_known.all():
        normals = np.where(is_known[:, None], normals / lengths[:, None], 0).astype(np.float32)
    return normals


def cloud_facts(path: FilePath, **options: Any) -> dict[str, Any]:
    """What was found; numbers are plain, lengths in the file's units, so that programs can read it as JSON.

    Options are those of `load_cloud`, except notes. Raises as it does.
    """
    notes: list[str] = []
    cloud, found = read_cloud(check_path(path), CloudOptions(**options), notes.append)
    low, high = ((end + cloud.origin).tolist() for end in main_box(cloud.positions)) if len(cloud) else ([], [])
    places = [] if cloud.seen_from is None else np.unique(sample_of(np.atleast_2d(cloud.seen_from)), axis=0)
    places = [place + cloud.origin for place in places[:: -(-len(places) // _MOST_PLACES) or 1]]
    with_normal = 0.0 if cloud.normals is None else float(cloud.normals.any(1).mean())
    return {
        "file": str(path),
        "format": found.form,
        "points": len(cloud),
        "extent": [_rounded(b - a) for a, b in zip(low, high, strict=True)],
        "box": [low, high],
        "strays": int(np.count_nonzero(strays_of(cloud.positions))),  # points far from all others
        "spacing": _rounded(spacing_of(cloud.positions)),
        "stored_as": str(cloud.positions.dtype),
        "origin": cloud.origin.tolist(),
        "up": {"axis": cloud.up, "why": found.up_from},
        "front": cloud.front,
        "colors": cloud.colors is not None,
        "normals": round(with_normal, 4),  # the share of points that have one
        "sizes": cloud.sizes is not None,
        "seen_from": np.asarray(places).tolist(),  # where scanners stood, in the file's coordinates; of a path a part
        "color_by": choices(found),
        "assumed": notes,
    }


def _rounded(number: float) -> float:
    return float(f"{number:.4g}")


_LIMITS = ("allow_outside", "max_pixels", "notes")  # that frames, scenes and clouds share
_OF_CLOUDS = ("up", "most", "color_by", "crop", "clean", "seen_from")


class AnyOptions(LoadOptions, total=False):
    """The options of `load_frame` and of `load_cloud`; None counts as not given."""

    up: Up | None
    most: int | None
    color_by: ColorBy | None
    crop: Numbers | None
    clean: bool | None
    seen_from: Numbers | None


def check_cloud_options(options: Iterable[str], source: FilePath) -> None:
    """Raises ValueError for options of a frame, given with a point cloud."""
    check_fitting(options, _OF_CLOUDS, f"{source} is a point cloud, and no frame")


def check_frame_options(options: Iterable[str], source: FilePath | None) -> None:
    """Raises ValueError for options of a point cloud, given with a frame."""
    if given := [option(name) for name in options if name in _OF_CLOUDS]:
        raise ValueError(f"{source or 'this'} is no point cloud: leave out {', '.join(given)}")


def check_fitting(options: Iterable[str], fitting: tuple[str, ...], fact: str) -> None:
    """Raises ValueError, with the fact, for options that neither fit it nor are those that all inputs share."""
    if given := [option(name) for name in options if name not in (*_LIMITS, *fitting)]:
        raise ValueError(f"{fact}: leave out {', '.join(given)}")


# Names decide which files are point clouds where they are certain, else the content: NumPy's may be depth as well.
#
# PLY, LAS, E57   always, as .xyz, .pts and the like
# PCD             unless its points lie in a picture that a pinhole camera sees: that is a frame
# NumPy           records (n,) with x, y and z, or an array (n, 3|4|6|7|9) of very many rows; (h, w) is depth, and so is
#                 what holds an array called depth; (h, w, 3) and records (h, w) are a frame's points
# .bin            float32 of a lidar, some of it below 0, which depth never is
# .txt, .csv      many lines of 3, 4, 6, 7 or 9 numbers, or columns called x, y and z
_HEAD = 1 << 16  # bytes that are looked at
_MANY = 100  # rows: no picture is so much higher than wide
CLOUD_SUFFIXES = (".ply", ".las", ".laz", ".e57", *TEXTS)
_MAYBE_TEXTS = (".txt", ".csv")


def is_cloud(source: FilePath | None) -> TypeGuard[FilePath]:
    """Whether it is the path of a file that `load_cloud` reads, and `load_frame` does not."""
    if not isinstance(source, str | PathLike) or builtin_name(source) is not None:
        return False
    path = Path(source)
    try:
        if not path.is_file():
            return False
        if path.suffix.lower() in CLOUD_SUFFIXES:
            return True
        return _is_cloud(path, read_head(path, _HEAD))
    except (OSError, ValueError):  # reported by whoever reads it
        return path.suffix.lower() == ".pcd"


def _is_cloud(path: Path, head: bytes) -> bool:
    suffix = path.suffix.lower()
    if head.startswith((b"ply\n", b"ply\r", LAS, E57)):
        return True
    if suffix == ".pcd" or is_pcd(head):
        return not is_organised(path)
    if head.startswith(NUMPY):
        return _is_table(path)
    if head.startswith(ZIP):
        return suffix == ".npz" and _has_points(path)
    if suffix == ".bin" and not NOT_PICTURES.fullmatch(path.name):
        columns = cloud_arrays.lidar_columns(head, path.stat().st_size) or 0
        numbers = np.frombuffer(head[: len(head) // (4 * columns) * 4 * columns], "<f4") if columns else None
        return numbers is not None and bool(numbers.reshape(-1, columns)[:, :3].min() < 0)
    if suffix in _MAYBE_TEXTS and (found := read_text_head(head)):
        return has_positions(found.names) or (found.columns in COUNTS and head.count(b"\n") > _MANY)
    return False


def _is_table(path: Path) -> bool:
    with path.open("rb") as file, naming(path, BROKEN):  # NumPy raises of everything for broken bytes
        shape, _, dtype = read_header(file, "biufV")
    if dtype.names:
        return has_positions(dtype.names) and len(shape) < 2
    return dtype.kind in "iuf" and _is_of_points(shape)


def _has_points(path: Path) -> bool:
    arrays = npz_arrays(Archive(path))
    for role, name in find_roles(arrays).items():
        shape = arrays[name].shape
        is_of_pixels = role in SURFACES and math.prod(shape) and sum(side != 1 for side in shape) > 2
        if is_of_pixels or role in ("depth", "inverse", "ray"):
            return False
    return any(_is_of_points(array.shape) for name, array in arrays.items() if is_named(name, cloud_arrays.POSITIONS))


def _is_of_points(shape: tuple[int, ...]) -> bool:
    return len(shape) == 2 and shape[1] in COUNTS and shape[0] > _MANY
