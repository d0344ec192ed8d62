"""Checks that several values share. Each raises an error that names what was wrong."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .wording import option, shown


def check_choice(name: str, value: str, known: tuple[str, ...], place: str = "") -> None:
    """Raises ValueError, listing the known names, if the value is not one of them.

    place  of the value, such as " in intrinsics.json"
    """
    if value not in known:
        raise ValueError(f"unknown {name} {shown(value)}{place}: known are {', '.join(known)}")


def check_positive(value: Any, name: str) -> None:
    """Raises ValueError unless the value is a finite number above 0."""
    if not (isinstance(value, int | float | np.number) and 0 < value < math.inf):
        raise ValueError(f"{name} must be a finite number above 0, got {shown(value)}")


def check_number(value: float, name: str, low: float, high: float) -> None:
    """Raises ValueError unless the value is finite and lies between low and high."""
    if not (low <= value <= high and math.isfinite(value)):  # NaN fails the first test
        raise ValueError(f"{name} must be a number from {low:g} to {high:g}, got {value}")


def check_fps(fps: float, what: str) -> None:
    """Raises ValueError unless so many pictures a second can be shown and written. what  they are: "pictures"."""
    if not 0.01 <= fps <= 1000:  # a GIF counts hundredths of a second, up to 65 535
        raise ValueError(f"{option('fps')} must be {what} per second, from 0.01 to 1000, got {fps:g}")


def check_point(value: Any, name: str) -> tuple[float, float, float]:
    """Three finite numbers. Raises ValueError, naming them, for anything else."""
    point = np.asarray(value, dtype=np.float64)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise ValueError(f"{name} must be three finite numbers, got {shown(value)}")
    return float(point[0]), float(point[1]), float(point[2])
