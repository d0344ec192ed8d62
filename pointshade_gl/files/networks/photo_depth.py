"""Depth of photographs by a network, each shown to it once: contents of a frame, kept beside the photograph."""

from __future__ import annotations

import hashlib
import io
import math
import threading
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...checks.foreign_arrays import as_numpy
from ...notes.errors import is_expected
from ...notes.notes import Note
from ...notes.words import cut, option, shown
from ..access.atomic_write import sha256_of, written_whole
from ..access.content import check_pixels
from ..arrays.numpy_files import HeldArray, find_roles, list_arrays
from ..cameras.intrinsics import Intrinsics, Size
from ..containers.array_frames import open_arrays
from ..containers.container_contents import Contents
from .model_options import CANONICAL, PIXELS, ModelOptions
from .onnx_network import Network, Prepared, open_network

_ROUNDS = 8
_MOST = 20_000  # points that vote
_NEAREST = 1e-3  # of the median distance: what the shift leaves in front of the camera


def settle_points(
    points: NDArray[np.floating], valid: NDArray[np.bool_], focal: float | None
) -> tuple[NDArray[np.float32], float]:
    """Return (h, w) depth, NaN where there is none, and the focal length in pixels of the picture of points (h, w, 3).

    Of a known focal length the shift alone is found. Raises ValueError if no pinhole camera sees the points where they
    are in the picture.
    """
    height, width = valid.shape
    v, u = (np.mgrid[:height, :width] - np.array([height - 1, width - 1])[:, None, None] / 2).astype(np.float64)
    known = valid & np.isfinite(points).all(axis=2)
    places = np.flatnonzero(known)
    places = places[:: max(1, places.size // _MOST)]
    if places.size < 3:
        raise ValueError("it gave no points")
    x, y, z = points.reshape(-1, 3)[places].astype(np.float64).T
    across, seen, flat = np.concatenate([u.flat[places], v.flat[places]]), np.concatenate([x, y]), np.tile(z, 2)
    shift, found = 0.0, focal or 1.0
    for _ in range(_ROUNDS):
        ahead = np.maximum(flat + shift, _NEAREST * np.median(np.abs(flat)) + 1e-12)
        shift, found = _solve(across / ahead, seen / ahead, across * flat / ahead, focal)
    ahead = z + shift
    if not (np.isfinite(found) and found > 0 and np.median(ahead) > 0):
        raise ValueError("no pinhole camera sees its points where they are in the picture")
    depth = points[..., 2] + shift
    return np.where(known & (depth > 0), depth, np.nan).astype(np.float32), float(found)


def _solve(
    across: NDArray[np.float64], seen: NDArray[np.float64], known: NDArray[np.float64], focal: float | None
) -> tuple[float, float]:
    """Return the shift and the focal length for which across * shift - focal * seen = -known."""
    if focal is not None:
        return float((across @ (focal * seen - known)) / max(across @ across, 1e-30)), focal
    (shift, found), *_ = np.linalg.lstsq(np.stack([across, -seen], axis=1), -known, rcond=None)
    return float(shift), float(found)


_USUAL_FOV = 60.0  # degrees across the longer side
_SAME_SHAPE = 0.02  # ratios of sides that differ by less are one
_FARTHEST = 1e4  # metres: Depth Pro's
_ANGLES = ("fov_deg", "field_of_view", "fov")  # degrees from left to right
_SURFACES = {"depth", "inverse", "ray", "points", "own_points"}
_Arrays = dict[str, NDArray[Any]]


class Taken(NamedTuple):
    """A photograph that a network was shown: its size, and its focal length in pixels if it is known."""

    network: Network
    prepared: Prepared
    size: Size
    focal: float | None

    @property
    def name(self) -> str:
        return self.network.path.name

    @property
    def shrunk(self) -> float:
        """How wide the network saw the picture, to how wide it is."""
        return self.prepared.size[0] / self.size[0]


def contents_of_function(given: Any, name: str, size: Size, note: Note, max_pixels: float) -> Contents:
    """Return what a function gave for a photograph: depth, or a mapping. Raises ValueError or TypeError."""
    named = given if isinstance(given, Mapping) else {"depth": given}
    arrays = {str(key): array for key, one in named.items() if (array := _as_array(one)) is not None}
    if "predicted_depth" in arrays:
        arrays.pop("depth", None)  # beside it transformers puts a picture for the eye
    if not _SURFACES & find_roles(arrays).keys():
        expected = "depth of shape (h, w), or a mapping with depth and perhaps mask and intrinsics"
        raise TypeError(f"{name} gave {shown(given)}: expected {expected}")
    contents = _assembled(name, arrays, note, max_pixels)
    own, camera = (contents.depth.shape[1], contents.depth.shape[0]), contents.intrinsics
    if camera is None:
        return _as_photo(contents, own, size)

    def off(seen: Size) -> float:
        """Return how far the camera's axis is from the middle of a picture of this size, in its sides."""
        return max(abs(center / side - 0.5) for center, side in zip(camera.numbers[2:], seen, strict=True))

    return _as_photo(contents, min((size, own), key=off), size)


def contents_of_network(arrays: _Arrays, taken: Taken, note: Note, max_pixels: float) -> Contents:
    """Return what a network gave. Raises ValueError where there is no depth in it."""
    roles = find_roles(arrays)
    if not _SURFACES & roles.keys():
        found = [array for one in arrays.values() if (array := np.squeeze(one)).ndim == 2 and min(array.shape) > 1]
        if len(found) != 1:
            listed = list_arrays({name: array.shape for name, array in arrays.items()}) or "nothing"
            raise ValueError(f"{taken.network.path} gave {listed}: expected one output with a number a pixel")
        arrays = arrays | {"depth": found[0]}
    if "metric_scale" in arrays or (taken.network.family.title == "MoGe" and "points" in roles):
        return _of_affine_points(arrays, taken, note, max_pixels)
    camera = _own_camera(arrays, roles, taken)
    left_out = {*_ANGLES, roles.get("focal", "")}
    pictures = {name: array for name, array in arrays.items() if name not in left_out}
    contents = _cropped(_assembled(taken.name, pictures, note, max_pixels), taken.prepared)
    contents = _with_kind(contents, camera if any(name in arrays for name in _ANGLES) else None, taken)
    contents = _as_photo(contents, taken.prepared.size, taken.size)
    return contents if camera is None else replace(contents, intrinsics=camera)


def _as_array(value: Any) -> NDArray[Any] | None:
    """Return numbers as an array: of a tensor on any device and of any type, too; None for what are none."""
    to_float = ("float",) if "bfloat" in str(getattr(value, "dtype", "")) else ()  # NumPy lacks it
    for step in ("detach", "cpu", *to_float):
        value = getattr(value, step, lambda value=value: value)()
    try:
        array = as_numpy(value)
    except (TypeError, ValueError):
        return None
    return array if array.dtype.kind in "biuf" else None


def _assembled(name: str, arrays: _Arrays, note: Note, max_pixels: float) -> Contents:
    """Return the frame that named arrays make. Raises ValueError, with the name, for shapes that do not."""
    plain = {key: _without_ones(array) for key, array in arrays.items()}
    frames = open_arrays(name, {key: HeldArray(array) for key, array in plain.items()}, note, max_pixels)
    if len(frames) != 1:
        raise ValueError(f"{name} gave {len(frames)} pictures of depth for one photograph: expected shape (h, w)")
    return frames[0]


def _without_ones(array: NDArray[Any]) -> NDArray[Any]:
    """Return an array without leading axes of length 1, in 32 bits."""
    while array.ndim > 2 and array.shape[0] == 1:
        array = array[0]
    return array.astype(np.float32) if array.dtype.kind == "f" else array


def _of_affine_points(arrays: _Arrays, taken: Taken, note: Note, max_pixels: float) -> Contents:
    """Return MoGe's frame: its points lack a shift, and their unit."""
    roles = find_roles(arrays)
    points = _without_ones(arrays[roles.get("points") or roles["own_points"]])
    points = np.moveaxis(points, 0, 2) if points.shape[0] == 3 and points.shape[-1] != 3 else points
    if points.ndim != 3:
        raise ValueError(f"{taken.network.path} gave points of shape {points.shape}: expected (h, w, 3)")
    mask = _without_ones(arrays[roles["mask"]]) > 0.5 if "mask" in roles else np.ones(points.shape[:2], bool)
    across = points.shape[1] / taken.size[0]
    try:
        depth, focal = settle_points(points, mask, taken.focal and taken.focal * across)
    except ValueError as error:
        raise ValueError(f"{taken.network.path}: {error}") from None
    depth *= np.float32(np.ravel(arrays.get("metric_scale", 1.0))[0])
    camera = None if taken.focal else _square(taken.name, focal / across, taken.size)
    contents = Contents(depth, None, camera, None, mask, None, "z", 1.0)
    return replace(_as_photo(contents, depth.shape[::-1], taken.size), intrinsics=camera)


def _own_camera(arrays: _Arrays, roles: dict[str, str], taken: Taken) -> Intrinsics | None:
    """Return the photograph's camera, if the network gives an angle or a focal length."""
    angle = next((float(np.ravel(arrays[name])[0]) for name in _ANGLES if name in arrays), None)
    if angle is not None and 1 < angle < 179:
        return _square(taken.name, taken.size[0] / 2 / math.tan(math.radians(angle) / 2), taken.size)
    focal = float(np.ravel(arrays[roles["focal"]])[0]) if "focal" in roles else math.nan
    return _square(taken.name, focal / taken.shrunk, taken.size) if 0 < focal < math.inf else None


def _square(name: str, focal: float, size: Size) -> Intrinsics:
    """Return the camera of a focal length, with square pixels and its axis in the middle."""
    return Intrinsics(name, (focal, focal, (size[0] - 1) / 2, (size[1] - 1) / 2), size)


def _cropped(contents: Contents, prepared: Prepared) -> Contents:
    """Return what the photograph covers of a picture with a border."""
    if prepared.size == prepared.whole:
        return contents
    own = []
    for part, side, whole in zip(
        (prepared.rows, prepared.columns), contents.depth.shape, prepared.whole[::-1], strict=True
    ):
        start = round(part.start * (side / whole))
        own.append(slice(start, max(round(part.stop * (side / whole)), start + 1)))
    valid = None if contents.valid is None else contents.valid[tuple(own)]
    return replace(contents, depth=contents.depth[tuple(own)], valid=valid, intrinsics=None, normals=None)


def _with_kind(contents: Contents, angle: Intrinsics | None, taken: Taken) -> Contents:
    """Return the contents in metres where the network gives these in a form of its own, and with their kind."""
    output, depth = taken.network.output, contents.depth
    if contents.depth_kind is not None:  # by the name of the output
        return contents
    if angle is not None and taken.network.family.title == "Depth Pro":  # 1/z for a focal length as long as wide
        inverse = depth * np.float32(taken.size[0] / angle.numbers[0])
        return replace(contents, depth=1 / inverse.clip(1 / _FARTHEST, _FARTHEST), depth_kind="z", depth_scale=1.0)
    if output == "canonical":
        focal = taken.focal or max(taken.size) / 2 / math.tan(math.radians(_USUAL_FOV) / 2)
        depth = depth * np.float32(focal * taken.shrunk / CANONICAL)
    if output in ("metres", "canonical"):
        return replace(contents, depth=depth, depth_kind="z", depth_scale=1.0)
    return replace(contents, depth_kind=output or None)


def _as_photo(contents: Contents, seen: Size, size: Size) -> Contents:
    """Return the contents in the shape of the photograph; seen: size of the picture that its camera is of."""
    camera = contents.intrinsics
    if camera is not None:
        (fx, fy, cx, cy), across, down = camera.numbers, size[0] / seen[0], size[1] / seen[1]
        numbers = fx * across, fy * down, (cx + 0.5) * across - 0.5, (cy + 0.5) * down - 0.5
        camera = replace(camera, numbers=numbers, size=size, depth_kind=None, depth_scale=None)
    height, width = contents.depth.shape
    stretched = size[0] * height / (size[1] * width)
    wanted = (round(width * stretched), height) if stretched > 1 else (width, round(height / stretched))
    wanted = size if wanted[0] > size[0] else wanted
    if wanted == (width, height) or (abs(stretched - 1) < _SAME_SHAPE and wanted != size):
        return replace(contents, intrinsics=camera)
    valid = None if contents.valid is None else _resized(contents.valid.astype(np.uint8), wanted, "NEAREST") > 0
    depth = _resized(np.asarray(contents.depth, np.float32), wanted, "BILINEAR")
    return replace(contents, depth=depth, valid=valid, intrinsics=camera, normals=None)


def _resized(picture: NDArray[Any], size: Size, how: str) -> NDArray[Any]:
    from PIL import Image

    return np.asarray(Image.fromarray(picture).resize(size, Image.Resampling[how]))


FOLDER = ".pointshade"
_VERSION = "1"  # of what is kept: another one is not read
_LETTERS = 24
_WEIGHTS = "_data", ".data"


def place_of(photo_file: Path, photo: NDArray[np.uint8], options: ModelOptions, focal: float | None) -> Path:
    """Return the file of a photograph's depth. It differs by all that decides about the depth."""
    assert options.path is not None
    status = options.path.stat()
    network = _digest_of(options.path, status.st_mtime_ns, status.st_size)
    text = f"{_VERSION} {network} {photo.shape} {options.size} {options.pixels} {focal and round(focal, 3)}"
    name = hashlib.sha256(text.encode() + np.ascontiguousarray(photo).tobytes()).hexdigest()[:_LETTERS]
    return photo_file.parent / FOLDER / f"{name}.npz"


@lru_cache(4)
def _digest_of(path: Path, _time: int, _size: int) -> str:
    """Return the digest of a network; large ones have their weights in a file beside them."""
    weights = [one for name in _WEIGHTS if (one := path.with_name(path.name + name)).is_file()]
    return " ".join(sha256_of(one)[1] for one in (path, *weights))


def kept(place: Path, name: str) -> Contents | None:
    """Return the depth that is kept there; None without any, and for a file that is damaged."""
    try:
        with place.open("rb") as held, np.load(held, allow_pickle=False) as file:
            found = {key: file[key] for key in file.files}
        depth, camera = found["depth"], None
        if depth.ndim != 2 or depth.dtype != np.float32:
            return None
        if "camera" in found:
            fx, fy, cx, cy, width, height = (float(one) for one in found["camera"])
            camera = Intrinsics(name, (fx, fy, cx, cy), (int(width), int(height)))
        scale = float(found["scale"])
        return Contents(depth, None, camera, None, found.get("valid"), None, str(found["kind"]) or None, scale or None)
    except Exception:  # broken bytes make NumPy and zipfile raise of everything
        return None


def keep(place: Path, contents: Contents, note: Note) -> None:
    """Write a depth, or print a note where that is impossible."""
    held: dict[str, Any] = {
        "depth": np.asarray(contents.depth, np.float32),
        "kind": np.array(contents.depth_kind or ""),
        "scale": np.array(contents.depth_scale or 0.0),
    }
    if contents.valid is not None:
        held["valid"] = contents.valid
    if contents.intrinsics is not None and contents.intrinsics.size is not None:
        held["camera"] = np.array([*contents.intrinsics.numbers, *contents.intrinsics.size], np.float64)
    packed = io.BytesIO()
    np.savez_compressed(packed, **held)
    try:
        place.parent.mkdir(exist_ok=True)
        with written_whole(place) as temporary:
            temporary.write_bytes(packed.getvalue())
    except OSError as error:
        note(f"depth is not kept beside the photograph: {cut(error)}")


_REMEMBERED = 32  # depths, as a frame is often read again


class PhotoDepth:
    """A network that is shown photographs. From any thread."""

    def __init__(self, options: ModelOptions, note: Note, max_pixels: float):
        self._options, self._note, self._max_pixels = options, note, max_pixels
        self._lock = threading.RLock()  # functions of others may not be made for threads
        self._recent: OrderedDict[Any, Contents] = OrderedDict()

    def of(self, photo: NDArray[np.uint8], key: Any, beside: Path | None, focal: float | None) -> Contents:
        """Return what the network makes of a photograph (h, w, 3), each by its key.

        beside  the photograph's file, beside which depth may be kept; focal: in pixels, if it is known

        Raises ValueError, TypeError or OSError, in one sentence.
        """
        with self._lock:
            if key not in self._recent:
                found = self._made(photo, beside, focal)
                values = found.depth[np.isfinite(found.depth)] if found.depth.dtype.kind == "f" else found.depth
                if not values.size or values.min() == values.max():
                    gave = f"{values.min():g} everywhere" if values.size else "no number that is finite"
                    raise ValueError(f"{self._options.title} gave {gave} for this photograph, which is no depth")
                self._recent[key] = found
            self._recent.move_to_end(key)
            while len(self._recent) > _REMEMBERED:
                self._recent.popitem(last=False)
            return self._recent[key]

    def _made(self, photo: NDArray[np.uint8], beside: Path | None, focal: float | None) -> Contents:
        size = photo.shape[1], photo.shape[0]
        check_pixels(*size, "the photograph", self._max_pixels)
        if self._options.path is None:
            function: Any = self._options.model
            try:
                given = function(photo)
            except (MemoryError, KeyboardInterrupt):
                raise
            except Exception as error:
                reason = cut(error) if is_expected(error) else f"{type(error).__name__}: {cut(error)}"
                raise ValueError(f"{self._options.title} failed: {reason}") from error
            return contents_of_function(given, self._options.title, size, self._note, self._max_pixels)
        place = place_of(beside, photo, self._options, focal) if self._options.cache and beside else None
        if place is not None and (found := kept(place, self._options.title)):
            return found
        network = open_network(self._options.path)
        self._note_guesses(network, size)
        prepared = network.prepare(photo, self._options)
        outputs = network.run(prepared)
        contents = contents_of_network(outputs, Taken(network, prepared, size, focal), self._note, self._max_pixels)
        if place is not None:
            keep(place, contents, self._note)
        return contents

    def _note_guesses(self, network: Network, size: tuple[int, int]) -> None:
        if network.remark:
            self._note(network.remark)
        width, height = network.size(self._options, *size)
        mean = round(network.normalization(self._options)[0][0], 3)
        usual = {0.485: "imagenet", 0.5: "symmetric", 0.0: "unit or byte"}
        pixels = self._options.pixels or usual.get(mean, "its own")
        kinds = {"inverse": "inverse depth", "z": "depth without a scale", "": "depth of the kind that its values show"}
        gives = kinds.get(network.output, "metres")
        why = f"{network.family.title}, by its names" if network.family.known_by else network.family.title
        if network.facts.source:
            why += f", and {network.facts.source}"
        self._note(
            f"{network.path.name} is taken as {why}: input {width}x{height} with {pixels} pixels, output {gives}; if "
            f"not, pass {option('model_size', 'WxH')}, {option('model_pixels', *PIXELS)} or {option('depth_kind')}"
        )
