"""Names and options of the methods that estimate normals from depth. The GPU and its CPU mirror read the same list."""

from __future__ import annotations

import math
from typing import Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import LARGEST, as_array, check_choice
from ..checks.foreign_arrays import AnyArray, way_to
from ..notes.words import option, shown

TRIANGLES = {"triangles-1": 1, "triangles-2": 2, "triangles-4": 4, "triangles-8": 8}
PLANE_FITS = {f"plane-fit-{window}": window for window in range(3, 14, 2)}
SPARSE_LEVELS = 6  # "sparse" looks at cells of up to 2**6 pixels
SPARSE_TILTS = (0.02, 0.08, 0.32)  # radians of error: the first that some cells reach is good enough
Method = Literal[
    "auto", "adaptive", "star", "star-borrow", "sparse", "triangles-1", "triangles-2", "triangles-4", "triangles-8",
    "central", "one-sided", "plane-fit-3", "plane-fit-5", "plane-fit-7", "plane-fit-9", "plane-fit-11", "plane-fit-13",
]  # fmt: skip
METHODS: tuple[Method, ...] = get_args(Method)
Step = tuple[float, float]
NO_LIMIT: Step = (3.0e38, 0.0)


def check_method(method: str) -> Method:
    """The method's name, or a ValueError that lists the known ones."""
    check_choice(f"{option('normals')} method", method, METHODS)
    return cast("Method", method)


def parse_max_depth_step(value: float | str | None) -> Step:
    """Return (metres, share of the depth) beyond which a neighbour belongs to another surface.

    A number is metres, "3%" a share of the pixel's own depth, None no limit.
    """
    if value is None:
        return NO_LIMIT
    try:
        text = str(value).strip()
        number = float(text.removesuffix("%"))
    except ValueError:
        text, number = "", math.nan
    if not 0 < number <= LARGEST:
        name = option("max_depth_step")
        raise ValueError(f"{name} must be metres above 0 or a share such as '3%', got {shown(value)}")
    return (0.0, number / 100) if text.endswith("%") else (number, 0.0)


def check_normals(normals: AnyArray, shape: tuple[int, int]) -> NDArray[np.float32]:
    """The caller's own normals: (h, w, 3) float32, unit length, (0, 0, 0) where they are NaN or zero.

    Raises ValueError for another shape and for components that are infinite or above 1e18, TypeError without numbers.
    """
    complaint = f"normals must be a method's name or have shape {(*shape, 3)}"
    array = as_array(normals, complaint, np.float32)
    if array.shape != (*shape, 3):
        raise ValueError(f"{complaint}, got {array.shape}{way_to(array.shape, 'normals', normals, (3,))}")
    if (np.abs(array) > 1.01 * LARGEST).any():  # NaN passes
        longest = np.nanmax(np.abs(array))
        raise ValueError(f"normals must be finite and below {LARGEST:g}, NaN where missing, got {longest:g}")
    length = np.linalg.norm(array, axis=-1, keepdims=True)
    return np.where(length > 0, array / np.where(length > 0, length, 1), 0).astype(np.float32)
