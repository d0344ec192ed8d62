"""Checks sizes of points: of frames in source pixels, of clouds in world units, in pixels or in spacings."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import LARGEST, as_array, check_float, check_number
from ..checks.foreign_arrays import Numbers, UnreadableError, as_numpy
from ..notes.words import option, shown
from .values import frozen

UNITS = "px", "x", "m"  # of a cloud's sizes that are texts; metres are world units
ONE = frozen(np.ones(1, np.float32))  # source pixel
_OF_CLOUD = "the radius of a point cloud's points, a number of world units, '3px' or '2x' (times their spacing)"


def check_sizes(size: float | Numbers | str | None, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Splat sizes in source pixels as (1,) or (h*w,) float32; None and "fill" are 1.

    Raises ValueError for an impossible size.
    """
    if size is None or isinstance(size, str):
        return ONE  # the same for every picture
    name = option("point_size")
    complaint = f"{name} is the splats' size in source pixels, one number or an array of {shape}"
    sizes = np.atleast_1d(as_array(size, complaint, np.float32))
    if sizes.shape not in ((1,), shape):
        raise ValueError(f"{complaint}, got {sizes.shape}")
    if not ((sizes >= 0) & (sizes <= LARGEST)).all():
        raise ValueError(f"{name} must be finite and not negative everywhere")
    return sizes.ravel()


def check_look_size(size: Any) -> Any:
    """Return the size of a look, a single number as a float. Raises ValueError for one that cannot be drawn."""
    name = option("point_size")
    if isinstance(size, str):
        if size != "fill" and not _is_cloud_size(size):
            others = "a point cloud takes '3px' and '2x' (times the spacing), too"
            raise ValueError(f"{name} must be a number of source pixels, or 'fill', got {shown(size)}: {others}")
    elif size is not None and is_single(size):
        size = check_float(size, f"{name} must be a number of source pixels, 0 or above", 0)
    return size


def check_cloud_size(size: Any) -> Any:
    """Return the size of a cloud's points. Raises ValueError or TypeError for one that is none."""
    name = option("point_size")
    if isinstance(size, str) and not _is_cloud_size(size):
        raise ValueError(f"{name} must be {_OF_CLOUD}, got {shown(size)}")
    return size if size is None or isinstance(size, str) else check_number(size, name, 0)


def parse_cloud_size(size: float | str) -> tuple[float, str]:
    """Return a size as a number and its unit: "" world units, "px" pixels, "x" spacings."""
    if not isinstance(size, str):
        return size, ""
    text = size.strip().lower()
    unit = next((one for one in UNITS if text.endswith(one)), "")
    return float(text.removesuffix(unit)), unit.replace("m", "")


def is_single(value: Any) -> bool:
    """Return whether a value is no array."""
    if type(value) in (int, float) or isinstance(value, list | tuple):
        return not isinstance(value, list | tuple)
    try:
        return not as_numpy(value).ndim
    except UnreadableError:  # `as_array` says why
        return False


def _is_cloud_size(text: str) -> bool:
    try:
        number, _ = parse_cloud_size(text)
    except ValueError:
        return False
    return 0 <= number <= LARGEST
