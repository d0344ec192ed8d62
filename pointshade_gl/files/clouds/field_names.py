"""Known names of a point cloud's columns, and what each means. Letters' case and signs between them do not count."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .found_points import FoundPoints, side_by_side

Names = tuple[str, ...]

# Role: groups of names, the best first.
_THREES: dict[str, tuple[Names, ...]] = {
    "positions": (("x", "y", "z"), ("px", "py", "pz"), ("easting", "northing", "height"), ("posx", "posy", "posz")),
    "normals": (("nx", "ny", "nz"), ("normalx", "normaly", "normalz"), ("normal0", "normal1", "normal2")),
    "colors": (
        ("red", "green", "blue"), ("r", "g", "b"), ("diffusered", "diffusegreen", "diffuseblue"),
        ("rf", "gf", "bf"), ("colorr", "colorg", "colorb"), ("cr", "cg", "cb"),
    ),
    "seen_from": (("seenx", "seeny", "seenz"),),
}  # fmt: skip
_ONES: dict[str, Names] = {
    "intensity": ("intensity", "scalarintensity", "reflectance", "scalarreflectance", "remission", "i"),
    "classes": ("classification", "scalarclassification", "class"),
    "sizes": ("radius",),
    "confidence": ("confidence",),
}
_PACKED = ("rgb", "rgba")  # a colour in one number of four bytes, as PCL stores it


def has_positions(names: Iterable[str]) -> bool:
    """Whether three of the names are those of positions."""
    return _first_of(_THREES["positions"], {_plain(name) for name in names}) is not None


def found_in(columns: Mapping[str, NDArray[Any]], form: str) -> FoundPoints:
    """The points of named columns (n,), or (n, c). Raises ValueError without x, y and z."""
    known: dict[str, NDArray[Any]] = {}
    for name, column in columns.items():
        if column.ndim == 1:
            known.setdefault(_plain(name), column)
    threes = {role: _first_of(groups, known.keys()) for role, groups in _THREES.items()}
    if threes["positions"] is None:
        raise ValueError(f"it has no x, y and z, only {', '.join([*columns][:12]) or 'nothing'}")
    found: dict[str, Any] = {
        role: side_by_side([known[name] for name in names]) for role, names in threes.items() if names
    }
    found |= {role: known[name] for role, names in _ONES.items() for name in names[::-1] if name in known}
    packed = next((known[name] for name in _PACKED if name in known), None)
    if "colors" not in found and packed is not None and packed.dtype.itemsize == 4:
        found["colors"] = unpacked(packed)
    if "seen_from" in found:
        found["seen_from"] = found["seen_from"].astype(np.float64)
    return FoundPoints(form, **found)


def unpacked(colors: NDArray[Any]) -> NDArray[np.uint8]:
    """(n, 3) colours of (n,) numbers of four bytes, 0xRRGGBB each, also where these bytes are called a float."""
    whole = np.ascontiguousarray(colors).view(np.uint32 if colors.dtype.isnative else ">u4")
    return np.stack([whole >> 16 & 255, whole >> 8 & 255, whole & 255], -1).astype(np.uint8)


def _first_of(groups: Iterable[Names], known: Iterable[str]) -> Names | None:
    return next((names for names in groups if set(names) <= set(known)), None)


def _plain(name: str) -> str:
    return "".join(filter(str.isalnum, name.lower()))
