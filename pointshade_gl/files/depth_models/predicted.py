"""What a network has given -> one frame's contents: depth with its kind, camera, mask."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...checks.foreign_arrays import as_numpy
from ...notes.notes import Note
from ...notes.words import shown
from ..arrays.array_roles import find_roles, list_arrays
from ..arrays.stored_arrays import HeldArray
from ..cameras.intrinsics import Intrinsics, Size
from ..containers.contents import Contents
from ..containers.networks import open_arrays
from .affine_points import settle_points
from .families import CANONICAL
from .onnx_network import Network, Prepared

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
    """Return what a function gave for a photograph of this size: depth, or a mapping with depth, mask, intrinsics.

    Raises ValueError or TypeError for anything else.
    """
    named = given if isinstance(given, Mapping) else {"depth": given}
    arrays = {str(key): array for key, one in named.items() if (array := _as_array(one)) is not None}
    if "predicted_depth" in arrays:
        arrays.pop("depth", None)  # beside it transformers puts a picture for the eye
    if not _SURFACES & find_roles(arrays).keys():
        raise TypeError(
            f"{name} gave {shown(given)}: expected depth of shape (h, w), or a mapping with depth and perhaps mask and "
            "intrinsics"
        )
    contents = _assembled(name, arrays, note, max_pixels)
    own, camera = (contents.depth.shape[1], contents.depth.shape[0]), contents.intrinsics
    return _as_photo(contents, own if camera is None else min((size, own), key=partial(_off, camera)), size)


def contents_of_network(arrays: _Arrays, taken: Taken, note: Note, max_pixels: float) -> Contents:
    """Return what a network gave. Raises ValueError where there is no depth in it."""
    roles = find_roles(arrays)
    if not _SURFACES & roles.keys():
        arrays = arrays | {"depth": _only_picture(arrays, taken)}
    if "metric_scale" in arrays or (taken.network.family.title == "MoGe" and "points" in roles):
        return _of_affine_points(arrays, taken, note, max_pixels)
    camera = _own_camera(arrays, roles, taken)
    left_out = {*_ANGLES, roles.get("focal", "")}
    pictures = {name: array for name, array in arrays.items() if name not in left_out}
    contents = _cropped(_assembled(taken.name, pictures, note, max_pixels), taken.prepared)
    contents = _with_kind(contents, camera if any(name in arrays for name in _ANGLES) else None, taken)
    contents = _as_photo(contents, taken.prepared.size, taken.size)
    return contents if camera is None else replace(contents, intrinsics=camera)


def _off(camera: Intrinsics, size: Size) -> float:
    """Return how far its axis is from the middle of a picture of this size, in its sides."""
    return max(abs(center / side - 0.5) for center, side in zip(camera.numbers[2:], size, strict=True))


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


def _only_picture(arrays: _Arrays, taken: Taken) -> NDArray[Any]:
    """Return the one output that is a picture of numbers. Raises ValueError if none is, or several are."""
    found = [array for one in arrays.values() if (array := np.squeeze(one)).ndim == 2 and min(array.shape) > 1]
    if len(found) != 1:
        listed = list_arrays({name: array.shape for name, array in arrays.items()})
        raise ValueError(f"{taken.network.path} gave {listed or 'nothing'}: expected one output with a number a pixel")
    return found[0]


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
    height, width = contents.depth.shape
    own = _scaled(prepared.rows, height / prepared.whole[1]), _scaled(prepared.columns, width / prepared.whole[0])
    valid = None if contents.valid is None else contents.valid[own]
    return replace(contents, depth=contents.depth[own], valid=valid, intrinsics=None, normals=None)


def _scaled(part: slice, scale: float) -> slice:
    start = round(part.start * scale)
    return slice(start, max(round(part.stop * scale), start + 1))


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
    """Return the contents in the shape of the photograph, which the network saw in another; the camera is of it, too.

    seen  (width, height) of the picture that their camera is of; size: the photograph's
    """
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
