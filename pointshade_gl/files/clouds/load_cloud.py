"""Loads point clouds: reads the file, leaves out what is no point, places it; and says what a file holds."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...checks.arguments import check_choice, check_count, check_path, check_positive
from ...notes.notes import Note, print_note
from ...notes.words import option
from ...scene.cloud import UPS, PointCloud, Up
from ..access.content import MAX_PIXELS, FilePath, read_head
from ..arrays.compression import ZIP
from ..arrays.numpy_files import NUMPY
from ..arrays.ply_and_pcd import is_pcd
from ..frames.frame_parts import LoadOptions
from .cloud_arrays import read_lidar_points, read_npy_points, read_npz_points, read_pcd_points, read_ply_points
from .cloud_columns import COLOR_BY, TEXTS, ColorBy, FoundPoints, read_text_points
from .placing import choices, colors_of, drop_invalid, guess_up, keep_most, main_box, placed, spacing_of
from .scans import E57, LAS, read_e57_points, read_las_points

_OTHER = {"x": "z", "y": "z", "z": "y"}  # what is most likely if it is not that
_Reader = Callable[[FilePath, Note, float], FoundPoints]


@dataclass(frozen=True)
class CloudOptions:
    """What the caller says about a cloud; see `load_cloud`."""

    up: Up | None = None
    most: int | None = None
    color_by: ColorBy | None = None
    max_pixels: float = MAX_PIXELS

    def __post_init__(self) -> None:
        check_positive(self.max_pixels, option("max_pixels", beside_file=True))
        if self.up is not None:
            check_choice(option("up"), self.up, UPS)
        if self.most is not None:
            check_count(self.most, option("most"), 1)
        if self.color_by is not None:
            check_choice(option("color_by"), self.color_by, COLOR_BY)


def load_cloud(
    path: FilePath,
    *,
    up: Up | None = None,
    most: int | None = None,
    color_by: ColorBy | None = None,
    max_pixels: float = MAX_PIXELS,
    notes: Note | None = None,
) -> PointCloud:
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
    options = CloudOptions(up, most, color_by, max_pixels)
    return read_cloud(check_path(path), options, notes or print_note)[0]


@np.errstate(all="ignore")  # numbers of broken files are of any size; positions are checked
def read_cloud(path: Path, options: CloudOptions, note: Note) -> tuple[PointCloud, FoundPoints]:
    """As `load_cloud`, with what the file says."""
    name = str(path)
    found = _reader_for(path)(path, note, options.max_pixels)
    drop_invalid(found, name, note)
    keep_most(found, options.most, name, note)
    positions, origin = placed(found)
    up = _up(found, positions, origin, options.up, name, note)
    colors = colors_of(found, options.color_by, up, name)
    seen_from = None if found.seen_from is None else found.seen_from - origin
    front = found.front if up == found.up else None
    each = positions, _units(found), colors, _positive(found.sizes), _shares(found)
    return PointCloud(*each, origin, up, seen_from, front=front), found


def _reader_for(path: Path) -> _Reader:
    head = read_head(path, 1024)
    known = next((reader for is_kind, reader in _READERS if is_kind(head)), None)
    is_bare = path.suffix.lower() == ".bin" or (b"\0" in head and path.suffix.lower() not in TEXTS)
    return known or (read_lidar_points if is_bare else read_text_points)


_READERS: tuple[tuple[Callable[[bytes], bool], _Reader], ...] = (
    (lambda head: head.startswith((b"ply\n", b"ply\r")), read_ply_points),
    (is_pcd, read_pcd_points),
    (lambda head: head.startswith(LAS), read_las_points),
    (lambda head: head.startswith(E57), read_e57_points),
    (lambda head: head.startswith(NUMPY), read_npy_points),
    (lambda head: head.startswith(ZIP), read_npz_points),
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


def _positive(sizes: np.ndarray | None) -> np.ndarray | None:
    """Radii, 0 where the file has none that can be drawn."""
    return None if sizes is None else np.nan_to_num(sizes.astype(np.float32), posinf=0, neginf=0).clip(0, None)


def _shares(found: FoundPoints) -> np.ndarray | None:
    """How sure each normal is: a confidence that belongs to normals, 0 to 1."""
    if found.confidence is None or found.normals is None:
        return None
    return np.nan_to_num(found.confidence.astype(np.float32), posinf=1).clip(0, 1)


def cloud_facts(path: FilePath, **options: Any) -> dict[str, Any]:
    """What was found; numbers are plain, lengths in the file's units, so that programs can read it as JSON.

    options  those of `load_cloud`, except notes. Raises as it does.
    """
    notes: list[str] = []
    cloud, found = read_cloud(check_path(path), CloudOptions(**options), notes.append)
    low, high = (_plain(end + cloud.origin) for end in main_box(cloud.positions)) if len(cloud) else ([], [])
    return {
        "file": str(path),
        "format": found.form,
        "points": len(cloud),
        "extent": [_rounded(b - a) for a, b in zip(low, high, strict=True)],
        "box": [low, high],
        "spacing": _rounded(spacing_of(cloud.positions)),
        "stored_as": str(cloud.positions.dtype),
        "origin": _plain(cloud.origin),
        "up": {"axis": cloud.up, "why": found.up_from},
        "front": cloud.front,
        "colors": cloud.colors is not None,
        "normals": _share(cloud),
        "sizes": cloud.sizes is not None,
        "seen_from": _places(cloud),
        "color_by": choices(found),
        "assumed": notes,
    }


def _share(cloud: PointCloud) -> float:
    """Of the points that have a normal."""
    return 0.0 if cloud.normals is None else round(float(cloud.normals.any(1).mean()), 4)


def _places(cloud: PointCloud) -> list[list[float]]:
    """Where scanners stood, in the file's coordinates."""
    if cloud.seen_from is None:
        return []
    return [_plain(place + cloud.origin) for place in np.unique(np.atleast_2d(cloud.seen_from), axis=0)]


def _plain(numbers: np.ndarray) -> list[float]:
    return [float(one) for one in numbers]


def _rounded(number: float) -> float:
    return float(f"{number:.4g}")


LIMITS = ("allow_outside", "max_pixels", "notes")  # that frames, scenes and clouds share
_OF_CLOUDS = ("up", "most", "color_by")


class AnyOptions(LoadOptions, total=False):
    """The options of `load_frame` and of `load_cloud`; None counts as not given."""

    up: Up | None
    most: int | None
    color_by: ColorBy | None


def check_cloud_options(options: Iterable[str], source: FilePath) -> None:
    """Raises ValueError for options of a frame, given with a point cloud."""
    check_fitting(options, (*LIMITS, *_OF_CLOUDS), f"{source} is a point cloud, and no frame")


def check_frame_options(options: Iterable[str], source: FilePath | None) -> None:
    """Raises ValueError for options of a point cloud, given with a frame."""
    if given := [option(name) for name in options if name in _OF_CLOUDS]:
        raise ValueError(f"{source or 'this'} is no point cloud: leave out {', '.join(given)}")


def check_fitting(options: Iterable[str], fitting: tuple[str, ...], fact: str) -> None:
    """Raises ValueError, with the fact, for options that do not fit it."""
    if given := [option(name) for name in options if name not in fitting]:
        raise ValueError(f"{fact}: leave out {', '.join(given)}")
