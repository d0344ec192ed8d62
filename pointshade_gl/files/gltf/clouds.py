"""Reads and writes point clouds, which are primitives of points in glTF."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.cloud import PointCloud
from ...scene.values import linear_to_bytes, srgb_to_linear
from .buffers import Parts
from .cameras_and_lights import Matrix
from .checks import numbers
from .extras import options

POINTS = 0  # the mode of a primitive
UP = "y"  # in glTF
FARTHEST = 16  # extents from zero: float32 keeps a millionth of the extent there
SINGLES = {"_SIZE": "sizes", "_CONFIDENCE": "confidence"}  # attributes of one number for each point
_ATTRIBUTES = {key: (name, "SCALAR") for key, name in SINGLES.items()} | {
    "NORMAL": ("normals", "VEC3"),
    "_SEEN_FROM": ("seen_from", "VEC3"),
}
_KEYS = ("splat", "size", "up", "front", "seen_from")
_WHITE = 1.0, 1.0, 1.0


def read_cloud(parts: Parts, primitive: SimpleNamespace, look: dict[str, Any], part: str) -> PointCloud:
    """The points of a primitive. Raises ValueError.

    look  what its material says: material, shading, color, texture
    """
    held = primitive.attributes
    said = options(primitive.extras, _KEYS)
    if look.pop("texture", None) is not None:
        parts.note(f"{part}: its texture is not drawn, it has points")
    look.pop("channel", None)
    color = look.pop("color", _WHITE)
    each: dict[str, Any] = {"positions": _floats(parts, held["POSITION"], "VEC3")}
    each |= {name: _floats(parts, held[key], kind) for key, (name, kind) in _ATTRIBUTES.items() if key in held}
    each |= {name: one[:, 0] for name, one in each.items() if one.shape[1] == 1}
    if "COLOR_0" in held or color != _WHITE:
        linear = _shares(parts, held["COLOR_0"]) if "COLOR_0" in held else np.ones_like(each["positions"])
        each["colors"] = linear_to_bytes(np.clip(np.nan_to_num(linear[:, :3] * np.float32(color)), 0, 1))
    if primitive.indices is not None:
        each = _chosen(each, parts.array(primitive.indices, ("SCALAR",))[:, 0])
    if "seen_from" in said:
        each["seen_from"] = numbers(said.pop("seen_from"), (3,), "seen_from")
    return PointCloud(**each, **look, up=said.pop("up", UP), point_size=said.pop("size", None), **said)


def _floats(parts: Parts, index: Any, kind: str) -> NDArray[np.float32]:
    return parts.array(index, (kind,)).astype(np.float32)


def _shares(parts: Parts, index: Any) -> NDArray[Any]:
    """Return colours of 0 to 1: whole numbers are shares of the largest, also where the accessor forgets to say so."""
    values = parts.array(index, ("VEC3", "VEC4"))
    return values / np.float32(np.iinfo(values.dtype).max) if values.dtype.kind in "iu" else values


def _chosen(each: dict[str, Any], indices: NDArray[Any]) -> dict[str, Any]:
    """Return those points that indices name."""
    least = min(map(len, each.values()))
    if indices.dtype.kind != "u" or indices.max() >= least:
        raise ValueError(f"its indices must name one of {least} points, got {indices.max()}")
    return {name: one[indices] for name, one in each.items()}


def cloud_place(cloud: PointCloud) -> Matrix:
    """(4, 4) the place below our node of a glTF node that holds the points as float32."""
    place = np.eye(4)
    place[:3, 3] = cloud.origin
    low, high = cloud.positions.min(0), cloud.positions.max(0)
    if cloud.positions.dtype == np.float64 and (np.maximum(-low, high) > FARTHEST * (high - low).max()).any():
        place[:3, 3] += np.rint((low + high) / 2)
    return place


def cloud_attributes(cloud: PointCloud) -> dict[str, NDArray[Any]]:
    """The arrays of the primitive by their names, but normals."""
    shift = cloud_place(cloud)[:3, 3] - cloud.origin
    held: dict[str, NDArray[Any]] = {"POSITION": (cloud.positions - shift).astype(np.float32)}
    if cloud.colors is not None:
        held["COLOR_0"] = linear_colors(cloud.colors)
    for key, name in SINGLES.items():
        if getattr(cloud, name) is not None:
            held[key] = getattr(cloud, name)[:, None]
    if cloud.seen_from is not None and cloud.seen_from.ndim == 2:
        held["_SEEN_FROM"] = (cloud.seen_from - shift).astype(np.float32)
    return held


def linear_colors(colors: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return sRGB colours (n, 3) as linear ones: float32, as trimesh takes glTF's 16 bits for 8."""
    return srgb_to_linear(np.arange(256) / 255).astype(np.float32)[colors]


def cloud_extras(cloud: PointCloud) -> dict[str, Any]:
    """What extras say of the cloud: all that differs from the default."""
    said: dict[str, Any] = {} if cloud.splat == "disc" else {"splat": cloud.splat}
    said |= {} if cloud.point_size is None else {"size": cloud.point_size}
    said |= {} if cloud.up == UP else {"up": cloud.up}
    said |= {} if cloud.front is None else {"front": cloud.front}
    if cloud.seen_from is not None and cloud.seen_from.ndim == 1:
        said["seen_from"] = (cloud.seen_from - (cloud_place(cloud)[:3, 3] - cloud.origin)).tolist()
    return said
