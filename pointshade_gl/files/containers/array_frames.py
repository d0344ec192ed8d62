"""Assembles frames from named arrays: of NumPy, HDF5, MATLAB, networks and data sets; and organised clouds."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note, once
from ...notes.words import option, shown
from ..access.content import MAX_PIXELS, PARTS, FilePath, check_limit, check_pixels, open_regular
from ..arrays.matlab import hdf5_arrays
from ..arrays.numpy_files import (
    MAYBE_ERROR,
    MAYBE_INVERSE,
    SURFACES,
    HeldArray,
    Stored,
    find_roles,
    is_named,
    list_arrays,
)
from ..arrays.ply_and_pcd import PCD_HEADER, Pcd, read_pcd, read_pcd_header
from ..cameras.intrinsics import Intrinsics, Numbers
from .container_contents import NUMBERS, PLANES, SURE, ArrayItem, Contents, Frames, as_color, turn_normals

_LOOKED_AT = 50_000  # points
MOST_OFF = 0.02  # of the picture's width; networks' points are off by less, those in other axes by more
_FEWEST = 16
_OPENGL = np.array([1, -1, -1], np.float32)


def fit_pinhole(points: NDArray[np.floating]) -> tuple[tuple[float, float, float, float], float]:
    """(fx, fy, cx, cy) by least squares from (h, w, 3) points in the camera's axes, and how far pixels are from it. The
    distance is the root mean square, as a share of the width; infinite if hardly any point is before the camera."""
    height, width = points.shape[:2]
    step = max(1, int(np.sqrt(height * width / _LOOKED_AT)))
    some = points[::step, ::step].astype(np.float64)
    rows, columns = np.mgrid[0:height:step, 0:width:step]
    seen = np.isfinite(some).all(axis=2) & (some[..., 2] > 0)
    nothing = (0.0, 0.0, 0.0, 0.0), float("inf")
    if np.count_nonzero(seen) < max(_FEWEST, seen.size / 100):
        return nothing
    x, y, z = some[seen].T  # u = fx*x/z + cx and v = fy*y/z + cy, each a straight line
    (fx, cx, off_x), (fy, cy, off_y) = _line(x / z, columns[seen]), _line(y / z, rows[seen])
    return ((fx, fy, cx, cy), float(np.hypot(off_x, off_y)) / width) if fx > 0 and fy != 0 else nothing


def _line(slopes: NDArray[np.float64], pixels: NDArray[np.intp]) -> tuple[float, float, float]:
    """The line pixel = a*slope + b, and the root mean square of what is left."""
    centred = slopes - slopes.mean()
    spread = float(centred @ centred)
    a = float(centred @ pixels) / spread if spread else 0.0
    b = float(pixels.mean()) - a * float(slopes.mean())
    return a, b, float(np.sqrt(np.mean((a * slopes + b - pixels) ** 2)))


@dataclass(frozen=True)
class Assembly:
    """Assembles frames from arrays that fit each other: `read(k)`."""

    name: str
    items: dict[str, ArrayItem]
    surface: str
    is_transposed: bool
    usual: Intrinsics | None
    note: Note
    max_pixels: float

    @np.errstate(all="ignore")  # what is missing may be infinite, or anything else
    def read(self, k: int) -> Contents:
        pose, fitted, depth = self._pose(k), None, self._part(self.surface, k)
        if self.surface in ("points", "own_points"):
            points, fitted = self._own_points(depth, pose)
            depth = points[..., 2]
        color, scale = self._color(k), self._scale()
        kind = self.surface if self.surface in ("inverse", "ray") else None
        numbers = self._camera(k, depth.shape) or fitted
        intrinsics = None
        if numbers is not None:
            height, width = depth.shape
            is_inside = 0 < numbers[2] < width and 0 < numbers[3] < height  # else it may be of another picture
            is_one = is_inside and (color is None or color.shape[:2] == depth.shape)
            intrinsics = Intrinsics(self.name, numbers, (width, height) if is_one else None, scale, kind)
        elif self.usual is not None:
            intrinsics, kind = self.usual, kind or self.usual.depth_kind
        valid = self._valid(k)
        normals = self._part("normals", k) if "normals" in self.items else None
        if normals is not None:
            normals = turn_normals(normals, depth, numbers if kind is None else None, self.name, self.note)
        return Contents(depth, color, intrinsics, pose, valid, normals, kind, scale)

    def _part(self, role: str, k: int) -> NDArray[Any]:
        return self.items[role].part(k, self.is_transposed)

    def _own_points(self, points: NDArray[Any], pose: NDArray[np.float64] | None) -> tuple[NDArray[Any], Any]:
        """The points in the camera's axes, and the camera that sees them."""
        fitted, off = fit_pinhole(points)
        if self.surface == "points" and pose is not None and not np.array_equal(pose, np.eye(4)):
            inverse = _inverse(pose, self.name)
            moved = (points @ inverse[:3, :3].T + inverse[:3, 3]).astype(points.dtype)
            fitted_moved, off_moved = fit_pinhole(moved)
            if off_moved < off:
                points, fitted, off = moved, fitted_moved, off_moved
        if off >= MOST_OFF:
            fitted_turned, off_turned = fit_pinhole(points * _OPENGL)
            if off_turned < MOST_OFF:
                self.note(f"{self.name}: its points are in OpenGL's axes (y up, z backwards), and turned")
                points, fitted, off = points * _OPENGL, fitted_turned, off_turned
        if off >= MOST_OFF:
            axes = "x right, y down and z forward, in the camera's axes or with the camera's pose beside them"
            fact = "no pinhole camera sees its points where they are in the picture"
            raise ValueError(f"{self.name}: {fact}: expected {axes}")
        return points, fitted

    def _pose(self, k: int) -> NDArray[np.float64] | None:
        for role in ("camera_to_world", "world_to_camera"):
            if role in self.items:
                pose = np.eye(4)
                rows = self._part(role, k)[:3]
                pose[:3, : rows.shape[1]] = rows
                return pose if role == "camera_to_world" else _inverse(pose, self.name)
        return None

    def _camera(self, k: int, shape: tuple[int, ...]) -> Numbers | None:
        height, width = shape
        if "intrinsics" in self.items:
            matrix = self._part("intrinsics", k).astype(np.float64)
            fx, fy, cx, cy = matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]
            if 0 < cx <= 1 and 0 < cy <= 1:  # from edge to edge
                fx, fy, cx, cy = fx * width, fy * height, cx * width - 0.5, cy * height - 0.5
            return float(fx), float(fy), float(cx), float(cy)
        focal, center = self._numbers("focal", k), self._numbers("center", k)
        if focal is None:
            return None
        cx, cy = ((width - 1) / 2, (height - 1) / 2) if center is None else center[:2]
        return float(focal[0]), float(focal[-1]), float(cx), float(cy)

    def _numbers(self, role: str, k: int) -> NDArray[np.float64] | None:
        """One or two numbers of a frame, from an array of these for one or all frames."""
        if role not in self.items:
            return None
        count, stored = self.items[self.surface].count, self.items[role].array
        size = math.prod(stored.shape)
        if (role == "center" and size not in (2, 2 * count)) or size not in (1, 2, count, 2 * count):
            return None
        numbers = stored.part(()).astype(np.float64).ravel()
        rows = count if size in (count, 2 * count) and not (role == "center" and size == 2) else 1
        return numbers.reshape(rows, -1)[k if rows > 1 else 0]

    def _scale(self) -> float | None:
        """Raw values per metre; below 1 the file has metres per raw value, as RealSense does."""
        numbers = self._numbers("scale", 0)
        scale = 0.0 if numbers is None else float(numbers[0])
        return None if not 0 < scale < math.inf else 1 / scale if scale < 1 else scale

    def _color(self, k: int) -> NDArray[np.uint8] | None:
        if "color" not in self.items:
            return None
        height, width = self.items["color"].size
        check_pixels(width, height, f"{self.name}'s colour", self.max_pixels)
        return as_color(self._part("color", k))

    def _valid(self, k: int) -> NDArray[np.bool_] | None:
        valid = None
        for role in ("mask", "sky", "confidence"):
            if role not in self.items:
                continue
            part = self._part(role, k)
            if role == "confidence":
                is_good = _is_sure(part)
                if share := np.mean(~is_good):
                    self.note(f"{self.name}: {share:.0%} of the depth is of low confidence and left out")
            else:
                is_good = (part > (0.5 if part.dtype.kind == "f" else 0)) == (role == "mask")
            valid = is_good if valid is None else valid & is_good
        return valid


def _is_sure(confidence: NDArray[Any]) -> NDArray[np.bool_]:
    """Return where a network is sure of its depth: a tenth of the picture's median confidence or more."""
    if confidence.dtype.kind != "f":
        return confidence > 0  # ARKit's 0, 1, 2
    values = confidence.astype(np.float64)
    known = values[np.isfinite(values)]
    if not known.size:
        return np.ones(values.shape, bool)
    if known.min() < 0:  # Pi3's logits
        values, known = (1 / (1 + np.exp(-v.clip(-50, 50))) for v in (values, known))
    elif known.min() >= 1:  # VGGT, DUSt3R and Depth Anything 3 give 1 + exp(x)
        values, known = values - 1, known - 1
    return values >= SURE * np.median(known)


def _inverse(pose: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    try:
        return np.asarray(np.linalg.inv(pose), np.float64)
    except np.linalg.LinAlgError:
        raise ValueError(f"{name}: its pose cannot be inverted: {shown(pose[:3].tolist())}") from None


_LONGEST = 4  # times as high as wide is a picture of depth at most


def open_arrays(
    name: str,  # of the file, for messages
    arrays: dict[str, Stored],
    note: Note,
    max_pixels: float = MAX_PIXELS,
    is_transposed: bool = False,  # (w, h) instead of (h, w), and so on: MATLAB's arrays in HDF5
    usual: Intrinsics | None = None,  # the camera if the arrays have none
) -> Frames:
    """The frames that arrays make, by their names. Raises ValueError if none is a depth, or a too large one."""
    roles = find_roles(arrays)
    items = {role: ArrayItem(role, arrays[key]) for role, key in roles.items()}
    surface = next((role for role in SURFACES if role in items and items[role].lead is not None), None)
    if surface is None:
        listed = list_arrays({key: array.shape for key, array in arrays.items()})
        way_out = f"save the depth alone as .npy and pass it as {option('depth', 'FILE')}"
        raise ValueError(f"{name} has no array called depth or points, only {listed or 'nothing'}: {way_out}")
    _check_surface(name, roles[surface], items[surface], max_pixels)
    for role, item in list(items.items()):
        if not _fits(role, item, items[surface]):
            note(f"{name}: {list_arrays({roles[role]: item.array.shape})} does not fit the depth and is not used")
            del items[role]
    is_video = surface == "depth" and items[surface].count > 1 and items[surface].array.dtype.kind == "f"
    has_camera = usual is not None or "intrinsics" in items or "focal" in items
    # inverse depth is known by its name, and videos of floats without a camera often are inverse
    if is_named(roles[surface], MAYBE_INVERSE) or (is_video and not has_camera):
        kind = option("depth_kind", "inverse")
        note(f"{name}: {roles[surface]} is read as distances; pass {kind} for Depth Anything, DepthCrafter or MiDaS")
    key = roles.get("confidence", "")
    if "confidence" in items and is_named(key, MAYBE_ERROR) and items["confidence"].array.dtype.kind == "f":
        note(f"{name}: {key} is not used, it may be an expected error as UniDepth's is")
        del items["confidence"]
    assembly = Assembly(name, items, surface, is_transposed, usual, once(note), max_pixels)
    return Frames(items[surface].count, assembly.read)


def _check_surface(name: str, key: str, item: ArrayItem, max_pixels: float) -> None:
    """Raises ValueError for too many pixels or frames, and if the last axis seems to count frames."""
    height, width = item.size
    check_pixels(width, height, f"{name}/{key}", max_pixels)
    check_limit(item.count, f"{name} has {item.count} frames", max_pixels, PARTS)
    if item.count > 1 and _LONGEST * width < min(height, item.count):
        given, way_out = list_arrays({key: item.array.shape}), "move the axis that counts frames to the front"
        raise ValueError(f"{name}: {given} must have the shape (h, w) or (n, h, w): {way_out}")


def _fits(role: str, item: ArrayItem, surface: ArrayItem) -> bool:
    """Return whether an array is for one or for all frames, and of the depth's size if it belongs to its pixels."""
    if role in NUMBERS:
        return True
    is_same = role not in (*PLANES, "normals") or item.size == surface.size
    return item.lead is not None and item.count in (1, surface.count) and is_same


_PACKED = 4  # channels of a position and a colour in the bytes of a float


def points_of(array: NDArray[Any], name: str, note: Note, max_pixels: float = MAX_PIXELS) -> Contents:
    """The frame of (h, w, 3) positions, or of 4, 6 or 7 channels with colours. Raises ValueError for no such points."""
    arrays = {"points": HeldArray(np.ascontiguousarray(array[..., :3]))}
    colors = _packed_colors(array[..., 3]) if array.shape[2] == _PACKED else array[..., 3:6]
    if colors is not None and colors.size:
        arrays["color"] = HeldArray(np.where(np.isfinite(colors), colors, 0))
        note(f"{name} holds points (x, y, z) and their colours")
    else:
        note(f"{name} holds points (x, y, z): their z is taken as the depth, and the camera that sees them so")
    return open_arrays(name, dict(arrays), note, max_pixels)[0]


def _packed_colors(packed: NDArray[Any]) -> NDArray[np.uint8] | None:
    """(h, w, 3) red, green and blue in the bytes of floats: of ZED with alpha 255, of PCL blue first with 0."""
    if packed.dtype != np.float32:
        return None
    parts = np.ascontiguousarray(packed).view(np.uint8).reshape(*packed.shape, 4)
    used = parts[np.isfinite(packed) | (parts[..., 3] == 255)]
    alpha = np.bincount(used[:, 3], minlength=256)
    if alpha[0] + alpha[255] < 0.99 * max(1, len(used)):
        return None  # numbers
    return parts[..., 2::-1] if alpha[0] > alpha[255] else parts[..., :3]


_HYPERSIM = "depth_meters"  # in the file's name; its only array is called dataset
_HYPERSIM_FOCAL = 886.81  # pixels of 1024x768 (Roberts et al. 2021)
_NYU = 518.857901, 519.469611, 325.582449, 253.736166  # the colour camera (Silberman et al. 2012)


def open_hdf5(path: FilePath, note: Note, max_pixels: float = MAX_PIXELS, is_matlab: bool = False) -> Frames:
    """The frames of an HDF5 file. Raises ValueError without the extra, for a broken file and without any depth."""
    arrays = hdf5_arrays(path, max_pixels)
    usual = _usual_camera(Path(path), arrays, note, is_matlab)
    if list(arrays) == ["dataset"] and "depth" in Path(path).name:
        arrays = {"ray_depth" if _HYPERSIM in Path(path).name else "depth": arrays["dataset"]}
    return open_arrays(str(path), arrays, note, max_pixels, is_matlab, usual)


def _usual_camera(path: Path, arrays: dict[str, Stored], note: Note, is_matlab: bool) -> Intrinsics | None:
    """The camera of data sets whose files have none."""
    shapes = {name: array.shape for name, array in arrays.items()}
    if is_matlab and shapes.get("depths", ())[-2:] == (640, 480) and "images" in shapes:
        note(f"{path}: the camera is taken as NYU Depth v2's, fx {_NYU[0]:.1f} at 640x480")
        return Intrinsics(f"{path} (NYU Depth v2)", _NYU, (640, 480))
    if shapes == {"dataset": (768, 1024)} and _HYPERSIM in path.name:
        note(f"{path}: the camera is taken as Hypersim's usual one, fx {_HYPERSIM_FOCAL} at 1024x768")
        numbers = _HYPERSIM_FOCAL, _HYPERSIM_FOCAL, 511.5, 383.5
        return Intrinsics(f"{path} (Hypersim)", numbers, (1024, 768), None, "ray")
    return None


_AXES = ("x", "y", "z")
_COLORS = ("rgb", "rgba")  # four bytes: blue, green, red, and one more


def open_pcd(path: FilePath, note: Note, max_pixels: float = MAX_PIXELS) -> Frames:
    """The frame of an organised PCD file. Raises ValueError for any other."""
    pcd = read_pcd(path, max_pixels)
    points = _seen_points(pcd)
    if points is None:
        raise ValueError(f"{path} is a point cloud, no depth: `pointshade render` draws it, load_cloud reads it")
    arrays = {"points": HeldArray(points)}
    color = next((pcd.columns[name] for name in _COLORS if name in pcd.columns), None)
    if color is not None and color.dtype.itemsize == 4:
        blue_first = np.ascontiguousarray(color).view(np.uint8).reshape(*points.shape[:2], 4)
        arrays["color"] = HeldArray(np.ascontiguousarray(blue_first[..., 2::-1]))
    return open_arrays(str(path), dict(arrays), note, max_pixels)


def is_organised(path: FilePath, max_pixels: float = MAX_PIXELS) -> bool:
    """Whether a PCD file's points are a picture that a pinhole camera sees. Raises OSError, or ValueError if broken."""
    with open_regular(path) as file:
        header = read_pcd_header(file.read(PCD_HEADER))
        status = os.fstat(file.fileno())
    is_picture = min(header.width, header.height) > 1
    return is_picture and _is_seen(str(path), status.st_mtime_ns, status.st_size, max_pixels)


@lru_cache(64)
def _is_seen(path: str, changed: int, size: int, max_pixels: float) -> bool:
    return _seen_points(read_pcd(path, max_pixels)) is not None


@np.errstate(all="ignore")  # what is missing may be infinite, or anything else
def _seen_points(pcd: Pcd) -> NDArray[Any] | None:
    """(h, w, 3), None for points that lie in no picture that a pinhole camera sees."""
    width, height, columns = pcd.header.width, pcd.header.height, pcd.columns
    if min(width, height) < 2 or any(name not in columns or columns[name].ndim > 1 for name in _AXES):
        return None
    points = np.stack([columns[name] for name in _AXES], -1).reshape(height, width, 3)
    return points if points.dtype.kind == "f" and fit_pinhole(points)[1] < MOST_OFF else None
