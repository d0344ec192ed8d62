"""Loads point clouds: reads the file, leaves out what is no point, places it; and recognises and examines files."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from ...checks.arguments import check_flag, check_path
from ...checks.foreign_arrays import Numbers
from ...notes.notes import Note, print_note
from ...notes.words import counted, option
from ...scene.cloud import PointCloud, Up
from ...scene.dense_part import sample_of
from ...scene.graph import Scene
from ..access.content import MAX_PIXELS, FilePath, naming, read_head
from ..access.known_names import NOT_PICTURES, builtin_name
from ..arrays.compression import ZIP, Archive
from ..arrays.numpy_files import BROKEN, NUMPY, SURFACES, find_roles, is_named, npz_arrays, read_header
from ..arrays.ply_and_pcd import counts_faces, is_pcd
from ..containers.array_frames import is_organised
from ..frames.frame_parts import LoadOptions
from . import cloud_arrays, cloud_columns, placing
from .cloud_columns import COUNTS, MOST_PLACES, TEXTS, UTF_16, CloudOptions, ColorLegend, FoundPoints
from .mesh_files import read_mesh, read_obj_points
from .scans import E57, LAS, is_ptx, read_e57_points, read_las_points, read_ptx_points
from .splat_files import META, is_sog, is_splat, is_spz, read_sog_points, read_splat_points, read_spz_points

_Reader = Callable[[FilePath, Note, CloudOptions], FoundPoints]


def load_cloud(
    path: FilePath, *, up: Up | None = None, most: int | None = None, color_by: str | None = None,
    color_range: Sequence[float] | None = None, columns: str | Sequence[str] | None = None, all_points: bool = False,
    max_pixels: float = MAX_PIXELS, crop: Numbers | None = None, clean: bool = False,
    seen_from: Numbers | None = None, notes: Note | None = None
) -> PointCloud:  # fmt: skip
    """Read a point cloud from a file.

    Parameters
    ----------
    path : path
        PLY, PCD, text such as .xyz, .pts, .ptx and .csv; .npy and .npz; KITTI's .bin; .obj without faces; with the
        extra las LAS, LAZ and COPC, with the extra e57 E57. Of a mesh the vertices. Of trained splats .ply,
        .compressed.ply, .splat, .spz and .sog: drawn as they were trained, and lit where a light is given.
    up : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Which axis points up. The default is what the format or the file says, else what its planes and extents show.
    most : int, optional
        Read so many points at most, an even sample.
    color_by : str, optional
        Where the colours are from: "rgb", "intensity", "class", "height" or any field of the file. Numbers go from dark
        blue to yellow, labels have colours of their own; a note names both. The default is the file's colours, else its
        intensity as grey.
    color_range : (2,) float, optional
        The numbers that get the first and the last colour. The default is those of all points but stray ones.
    columns : str or sequence of str, optional
        What the columns are, in their order, such as "x,y,z,nx,ny,nz,label"; "_" passes one over. The default is what
        the file says, else what the numbers show.
    all_points : bool
        Keep the points that LAS files mark as noise or withheld, and those at (0, 0, 0) that no scanner saw.
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
    kept = check_flag(all_points, "all_points")
    asked = CloudOptions(up, most, color_by, max_pixels, color_range, columns, kept, crop, clean, seen_from)
    return read_cloud(check_path(path), asked, notes or print_note)[0]


@np.errstate(all="ignore")  # numbers of broken files are of any size; positions are checked
def read_cloud(path: Path, options: CloudOptions, note: Note) -> tuple[PointCloud, FoundPoints]:
    """As `load_cloud`, with what the file holds."""
    name, head = str(path), read_head(path, _HEAD)
    read = next((reader for is_kind, reader in _READERS if is_kind(head)), None)
    is_bare = path.suffix.lower() == ".bin" or (
        b"\0" in head and path.suffix.lower() not in TEXTS and head[:2] not in UTF_16
    )
    if path.suffix.lower() == _MODEL:
        read = read_obj_points
    if _is_of_splats(path, head):
        read = read_splat_points if not head.startswith(ZIP) and path.name != META else read_sog_points
    read = read or (cloud_arrays.read_lidar_points if is_bare else cloud_columns.read_text_points)
    found = read(path, note, options)
    if is_mesh_head(head):
        note(f"{name}: it is a mesh with faces, only its vertices are read; load_scene and render show it whole")
    found.keep_field(options.color_by)
    placing.drop_invalid(found, name, note)
    if not options.all_points:
        placing.drop_unreturned(found, name, note)
    placing.keep_box(found, options.crop, name, note)
    if options.clean:
        placing.drop_strays(found, name, note)
    placing.keep_most(found, options.most, name, note)
    placing.to_metres(found, name, note)
    positions, origin = placing.placed(found, name, note)
    up = placing.up_of(found, positions, origin, options.up, name, note)
    colors = placing.colors_of(found, options, up, name, note)
    if options.seen_from is not None:
        found.seen_from = placing.places_of(positions + origin, np.reshape(options.seen_from, (-1, 3)))
    seen_from = None if found.seen_from is None else found.seen_from - origin
    front = found.front if up == found.up else None
    sizes, shares = found.sizes, None
    if sizes is not None:  # 0 where the file has none that can be drawn
        sizes = np.nan_to_num(sizes.astype(np.float32), posinf=0, neginf=0).clip(0, None)
    normals = placing.units_of(found, name, note)
    if found.confidence is not None and found.normals is not None:  # how sure each normal is, 0 to 1
        shares = np.nan_to_num(found.confidence.astype(np.float32), posinf=1).clip(0, 1)
    cloud = PointCloud(positions, normals, colors, sizes, shares, origin, up, seen_from, front=front)
    if (held := found.gaussians) is not None:
        if options.color_by not in (None, "rgb") and colors is not None:
            held = replace(held, base=colors / np.float32(255), harmonics=None)
        cloud = replace(cloud, gaussians=held, splat="gaussian", shading="auto")
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


def load_with_legend(path: FilePath, **options: Any) -> tuple[PointCloud | Scene, ColorLegend | None]:
    """A cloud, or a mesh as a scene, and what its colours mean. Options and errors are those of `load_cloud`."""
    allow_outside, notes = options.pop("allow_outside", False), options.pop("notes", None) or print_note
    file, asked = check_path(path), CloudOptions(**options)
    with np.errstate(all="ignore"):
        if is_mesh(str(file)):
            scene, found = read_mesh(file, asked, allow_outside, notes)
            return scene, found.legend
        cloud, found = read_cloud(file, asked, notes)
    return cloud, found.legend


def load_mesh(path: FilePath, *, allow_outside: bool = False, notes: Note | None = None, **options: Any) -> Scene:
    """The mesh of a PLY file as a scene. Options are those of `load_cloud` in OF_MESHES; raises as it does."""
    with np.errstate(all="ignore"):  # as in read_cloud
        return read_mesh(check_path(path), CloudOptions(**options), allow_outside, notes or print_note)[0]


_READERS: tuple[tuple[Callable[[bytes], bool], _Reader], ...] = (
    (lambda head: head.startswith(cloud_arrays.PLY), cloud_arrays.read_ply_points),
    (is_pcd, cloud_arrays.read_pcd_points),
    (lambda head: head.startswith(LAS), read_las_points),
    (lambda head: head.startswith(E57), read_e57_points),
    (lambda head: head.startswith(NUMPY), cloud_arrays.read_npy_points),
    (lambda head: head.startswith(ZIP), cloud_arrays.read_npz_points),
    (is_ptx, read_ptx_points),
    (is_spz, read_spz_points),
)


def _is_of_splats(path: Path, head: bytes) -> bool:
    """Whether a file that has no beginning of its own holds trained splats: .splat, .sog."""
    if head.startswith(ZIP):
        return path.suffix.lower() != ".npz" and is_sog(Archive(path))
    if path.name == META:
        return path.with_name("means_l.webp").exists()
    return path.suffix.lower() == SPLAT or _is_bare_splats(path, head)


def _is_bare_splats(path: Path, head: bytes) -> bool:
    """Whether the content alone shows that it is a .splat, which has no header: of a few rows it may be chance."""
    size = path.stat().st_size
    return path.suffix.lower() not in CLOUD_SUFFIXES and size >= _FEWEST_SPLATS * 32 and is_splat(head, size)


def cloud_facts(path: FilePath, **options: Any) -> dict[str, Any]:
    """What was found; numbers are plain, lengths in the file's units, so that programs can read it as JSON. Options are
    those of `load_cloud`, except notes. Raises as it does."""
    notes: list[str] = []
    cloud, found = read_cloud(check_path(path), CloudOptions(**options), notes.append)
    low, high = ((end + cloud.origin).tolist() for end in placing.main_box(cloud.positions)) if len(cloud) else ([], [])
    places = [] if cloud.seen_from is None else np.unique(sample_of(np.atleast_2d(cloud.seen_from)), axis=0)
    places = [place + cloud.origin for place in places[:: -(-len(places) // MOST_PLACES) or 1]]
    with_normal = 0.0 if cloud.normals is None else float(cloud.normals.any(1).mean())
    return {
        "file": str(path),
        "format": found.form,
        "points": len(cloud),
        "extent": [_rounded(b - a) for a, b in zip(low, high, strict=True)],
        "box": [low, high],
        "strays": int(np.count_nonzero(placing.strays_of(cloud.positions))),  # points far from all others
        "spacing": _rounded(placing.spacing_of(cloud.positions)),
        "stored_as": str(cloud.positions.dtype),
        "origin": cloud.origin.tolist(),
        "up": {"axis": cloud.up, "why": found.up_from},
        "front": cloud.front,
        "colors": cloud.colors is not None,
        "normals": round(with_normal, 4),  # the share of points that have one
        "sizes": cloud.sizes is not None,
        "seen_from": np.asarray(places).tolist(),  # where scanners stood, in the file's coordinates; of a path a part
        "color_by": placing.choices(found),
        "assumed": notes,
    }


def _rounded(number: float) -> float:
    return float(f"{number:.4g}")


_LIMITS = ("allow_outside", "max_pixels", "notes")  # that frames, scenes and clouds share
OF_MESHES = ("up", "color_by", "color_range", "columns")
_OF_CLOUDS = ("up", "most", "color_by", "color_range", "columns", "all_points", "crop", "clean", "seen_from")


class AnyOptions(LoadOptions, total=False):
    """The options of `load_frame` and of `load_cloud`; None counts as not given."""

    up: Up | None
    most: int | None
    color_by: str | None
    color_range: Sequence[float] | None
    columns: str | Sequence[str] | None
    all_points: bool | None
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
# PLY             without faces; with some it is a mesh
# LAS, E57        always, as .xyz, .pts and the like; .obj without faces
# PCD             unless its points lie in a picture that a pinhole camera sees: that is a frame
# NumPy           records (n,) with x, y and z, or an array (n, 3|4|6|7|9) of very many rows, others with colours or
#                 normals; (h, w) is depth, and so is what holds an array called depth; (h, w, 3) and records (h, w) are
#                 a frame's points
# .bin            float32 of a lidar, some of it below 0, which depth never is
# .txt, .csv      many lines of 3, 4, 6, 7 or 9 numbers, or of others with colours or normals; columns called x, y and z
_HEAD = 1 << 16  # bytes that are looked at
_MANY = 100  # rows: no picture is so much higher than wide
_WIDE = 12  # columns
_LOOKED_AT = 1000  # rows
_NARROW = 20  # times as high as wide is no picture
SPLAT = ".splat"
CLOUD_SUFFIXES = (".ply", ".las", ".laz", ".e57", SPLAT, *TEXTS)
_FEWEST_SPLATS = 4
_MODEL = ".obj"  # with faces it is no cloud, and is not read
_MAYBE_TEXTS = (".txt", ".csv")


def is_cloud(source: FilePath | None) -> TypeGuard[FilePath]:
    """Whether it is the path of a file that `load_cloud` reads, and `load_frame` does not."""
    if not isinstance(source, str | PathLike) or builtin_name(source) is not None:
        return False
    path = Path(source)
    try:
        if not path.is_file():
            return False
        if path.suffix.lower() == _MODEL:
            return _has_no_faces(path)
        head = read_head(path, _HEAD)
        if head.startswith(cloud_arrays.PLY):
            return not is_mesh_head(head)
        return path.suffix.lower() in CLOUD_SUFFIXES or _is_cloud(path, head)
    except (OSError, ValueError):  # reported by whoever reads it
        return path.suffix.lower() in (".pcd", *CLOUD_SUFFIXES)


def is_mesh(source: FilePath | None) -> TypeGuard[FilePath]:
    """Whether it is the path of a PLY file with faces."""
    if not isinstance(source, str | PathLike) or builtin_name(source) is not None:
        return False
    try:
        return Path(source).is_file() and is_mesh_head(read_head(Path(source), _HEAD))
    except (OSError, ValueError):  # reported by whoever reads it
        return False


def is_mesh_head(head: bytes) -> bool:
    """Whether these are the first bytes of a PLY file with faces."""
    return head.startswith(cloud_arrays.PLY) and counts_faces(head) > 0


def _has_no_faces(path: Path) -> bool:
    has_vertices = False
    with path.open("rb") as file:
        for line in file:
            if line.startswith((b"f ", b"f\t")):
                return False
            has_vertices = has_vertices or line.startswith((b"v ", b"v\t"))
    return has_vertices


def _is_cloud(path: Path, head: bytes) -> bool:
    suffix = path.suffix.lower()
    if head.startswith((LAS, E57)):
        return True
    if suffix == ".pcd" or is_pcd(head):
        return not is_organised(path)
    if head.startswith(NUMPY):
        return _is_table(path)
    if is_spz(head) or (path.name == META and _is_of_splats(path, head)):
        return True
    if head.startswith(ZIP):
        return _has_points(path) if suffix == ".npz" else is_sog(Archive(path))
    if suffix == ".bin" and not NOT_PICTURES.fullmatch(path.name):
        columns = cloud_arrays.lidar_columns(head, path.stat().st_size) or 0
        numbers = np.frombuffer(head[: len(head) // (4 * columns) * 4 * columns], "<f4") if columns else None
        return numbers is not None and bool(numbers.reshape(-1, columns)[:, :3].min() < 0)
    if suffix not in _MAYBE_TEXTS and _is_bare_splats(path, head):
        return True
    if suffix in _MAYBE_TEXTS and (found := cloud_columns.read_text_head(head)):
        is_long = head.count(b"\n") > _MANY
        return cloud_columns.has_positions(found.names) or (
            is_long and (found.columns in COUNTS or cloud_columns.shows_points(head, found))
        )
    return False


def _is_table(path: Path) -> bool:
    with path.open("rb") as file, naming(path, BROKEN):  # NumPy raises of everything for broken bytes
        shape, is_by_column, dtype = read_header(file, "biufV")
        if dtype.names:
            return cloud_columns.has_points(dtype) and len(shape) < 2
        if dtype.kind not in "iuf" or len(shape) != 2 or _is_of_points(shape):
            return dtype.kind in "iuf" and _is_of_points(shape)
        if is_by_column or not COUNTS[0] < shape[1] <= _WIDE or shape[0] <= max(_MANY, _NARROW * shape[1]):
            return False
        row = dtype.itemsize * shape[1]
        data = file.read(_LOOKED_AT * row)
        return cloud_columns.are_points(np.frombuffer(data[: len(data) // row * row], dtype).reshape(-1, shape[1]))


def _has_points(path: Path) -> bool:
    arrays = npz_arrays(Archive(path), "biufV")
    for role, name in find_roles(arrays).items():
        shape = arrays[name].shape
        is_of_pixels = role in SURFACES and math.prod(shape) and sum(side != 1 for side in shape) > 2
        if is_of_pixels or role in ("depth", "inverse", "ray"):
            return False
    if cloud_columns.has_positions(name for name, one in arrays.items() if len(one.shape) == 1):
        return True
    named = [one for name, one in arrays.items() if is_named(name, cloud_arrays.POSITIONS)]
    return any(cloud_columns.has_points(one.dtype) if one.dtype.names else _is_of_points(one.shape) for one in named)


def _is_of_points(shape: tuple[int, ...]) -> bool:
    return len(shape) == 2 and shape[1] in COUNTS and shape[0] > _MANY
