"""Checks of arguments that several modules share, each an error of one sentence; and how far work has come."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..notes.errors import Cancelled, check_function
from ..notes.words import counted, did_you_mean, shown
from .foreign_arrays import UnreadableError, as_numpy

LARGEST = 1e18  # shaders square lengths: squares of larger numbers overflow 32-bit floats
ABOVE_0 = math.nextafter(0, 1)  # the smallest float that is not 0
LARGEST_SIZE = 2**31 - 1  # pixels: the largest integer of OpenGL
FPS = 0.01, 1000.0  # a GIF cannot show a picture for longer than 655 seconds
_T = TypeVar("_T")


def items_of(value: Any) -> list[Any] | None:
    """What a list, a generator or another iterable holds; None for anything else."""
    try:
        iterator = iter(value)
    except TypeError:
        return None
    return list(iterator)


def is_a(value: object, *kinds: Any) -> bool:
    """Return isinstance(value, kinds), for what a declared type promises and a caller may not keep."""
    return isinstance(value, kinds)


def check_choice(name: str, value: str, known: tuple[str, ...], place: str = "") -> None:
    """Raises ValueError, listing the known names, if the value is not one of them.

    place  of the value, such as " in intrinsics.json"
    """
    if not (isinstance(value, str) and value in known):
        near = did_you_mean(value, known)
        raise ValueError(f"unknown {name} {shown(value)}{place}{near}: known are {', '.join(known)}")


def check_type(value: Any, kind: type[_T], name: str) -> _T:
    """The value. Raises TypeError unless it is of this kind."""
    if not isinstance(value, kind):
        raise TypeError(
            f"{name} must be {'an' if kind.__name__[0] in 'AEIOU' else 'a'} {kind.__name__}, got {shown(value)}"
        )
    return value


def check_flag(value: Any, name: str) -> bool:
    """The value as a bool. Raises TypeError for anything but True and False: the text "no" is true in Python."""
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{name} must be True or False, got {shown(value)}")
    return bool(value)


def check_path(path: Any) -> Path:
    """The path as a Path. Raises TypeError for anything else, ValueError for characters that no file name can have."""
    text = os.fspath(path) if isinstance(path, str | os.PathLike) else None
    if not isinstance(text, str):
        raise TypeError(f"path must be a text or a Path, got {shown(path)}")
    try:
        is_valid = b"\0" not in os.fsencode(text)
    except UnicodeEncodeError:  # half of a surrogate pair
        is_valid = False
    if not is_valid:
        raise ValueError(f"path must be a text or a Path of valid characters, got {shown(path)}")
    return Path(text)


def check_float(value: Any, complaint: str, low: float = -LARGEST, high: float = LARGEST) -> float:
    """The number as a float. Raises ValueError with the complaint unless it lies between low and high."""
    if value.__class__ is float and low <= value <= high:
        return value
    try:
        if isinstance(value, str | bytes | bytearray | np.complexfloating) or getattr(value, "ndim", 0):
            raise TypeError
        if _is_flag(value):
            raise TypeError
        value = value.detach() if getattr(value, "requires_grad", False) is True else value  # of PyTorch, which warns
        number = math.nan if is_masked(value) else float(value)
    except OverflowError:  # a very long integer
        number = math.inf
    except (TypeError, ValueError, RuntimeError):
        raise TypeError(f"{complaint}, got {shown(value)}") from None
    if not low <= number <= high:  # NaN fails, too
        raise ValueError(f"{complaint}, got {shown(value)}")
    return number


def check_number(value: Any, name: str, low: float, high: float = LARGEST) -> float:
    """The number as a float. Raises ValueError unless it lies between low and high."""
    if type(value) is float and low <= value <= high:
        return value  # without the complaint: what was checked before is checked for every picture
    return check_float(value, f"{name} must be a number from {low:g} to {high:g}", low, high)


def check_positive(value: Any, name: str) -> float:
    """The number as a float. Raises ValueError unless it is finite and above 0."""
    return check_float(value, f"{name} must be a finite number above 0", ABOVE_0, sys.float_info.max)


def check_fps(value: Any, name: str, what: str) -> float:
    """Pictures or frames ("what") per second as a float. Raises ValueError unless films and windows can show them."""
    return check_float(value, f"{name} must be {what} per second, from {FPS[0]:g} to {FPS[1]:g}", *FPS)


def check_count(value: Any, name: str, low: int = 0, unit: str = "") -> int:
    """The number as an int. Raises ValueError unless it is whole and lies between low and 2147483647."""
    complaint = f"{name} must be a whole number {unit}from {low} to {LARGEST_SIZE}"
    number = check_float(value, complaint, low, LARGEST_SIZE)
    if number % 1:
        raise ValueError(f"{complaint}, got {shown(value)}")
    return int(number)


def check_size(value: Any, name: str) -> tuple[int, int]:
    """Width and height of a picture or a window. Raises ValueError unless both are whole and above 0."""
    complaint = f"{name} must be a width and a height in whole pixels above 0"
    sides = items_of(value)
    if sides is None:
        raise TypeError(f"{complaint}, got {shown(value)}")
    numbers = [check_float(side, complaint, 1, LARGEST_SIZE) for side in sides]
    if len(numbers) != 2 or any(side % 1 for side in numbers):
        raise ValueError(f"{complaint}, got {shown(value)}")
    return int(numbers[0]), int(numbers[1])


def _is_flag(value: Any) -> bool:
    """Whether a value is True or False, which Python takes for 1 and 0, also as a number of NumPy or PyTorch."""
    return isinstance(value, bool | np.bool_) or str(getattr(value, "dtype", "")).endswith("bool")


def is_masked(value: Any) -> bool:
    """Whether a masked array, or a list with one in it, hides a value. An empty mask hides none."""
    masked = getattr(sys.modules.get("numpy.ma"), "MaskedArray", None)  # its import takes 10 ms
    if masked is None:
        return False
    parts = value if isinstance(value, list | tuple) else (value,)
    return any(isinstance(part, masked) and np.ascontiguousarray(part.mask).view(bool).any() for part in parts)


def depth_as_given(depth: Any, missing: float = 0.0, complaint: str = "depth must have shape (h, w)") -> NDArray[Any]:
    """A depth picture as an array of its own type. What a masked array hides is missing: 0, or this value of floats."""
    if isinstance(depth, list | tuple):
        depth = [depth_as_given(row, missing, complaint) if is_masked(row) else row for row in depth]
    elif is_masked(depth):
        depth = depth.filled(missing if depth.dtype.kind == "f" else 0)
    return as_given(depth, complaint)


def as_given(value: Any, complaint: str) -> NDArray[Any]:
    """The value as an array of its own type, see `as_numpy`: it shares the memory of what others can read in place.

    Raises ValueError with the complaint for rows of different lengths and for masked values: nobody knows what they
    stand for. Those of depth are missing, see `depth_as_given`. Raises TypeError with the complaint for what NumPy
    cannot read, such as a tensor on a GPU.
    """
    if is_masked(value):
        raise ValueError(f"{complaint}, got masked values: give them numbers with array.filled(...)")
    try:
        return as_numpy(value)
    except UnreadableError as error:
        raise TypeError(f"{complaint}, got {error}") from None
    except (ValueError, RecursionError):
        raise ValueError(f"{complaint}, got rows of different lengths") from None


def as_array(value: Any, complaint: str, dtype: Any = np.float64) -> NDArray[Any]:
    """A new array of these numbers, infinite beyond the range of the type.

    Raises TypeError with the complaint for anything but real numbers, ValueError for rows of different lengths and for
    numbers beyond float64.
    """
    array = as_given(value, complaint)
    try:
        if array.dtype.kind == "O":
            array = array.astype(np.float64)
        if value is None or array.dtype.kind not in "fiu":
            raise TypeError
    except OverflowError:
        raise ValueError(f"{complaint}, got {shown(value)}") from None
    except (TypeError, ValueError):
        raise TypeError(f"{complaint}, got {shown(value)}") from None
    with np.errstate(over="ignore"):
        return np.array(array, dtype, order="C")


def check_numbers(
    value: Any, count: int, complaint: str, low: float = -LARGEST, high: float = LARGEST
) -> tuple[float, ...]:
    """Exactly `count` numbers, as floats. Raises ValueError with the complaint unless all lie between low and high."""
    if type(value) is tuple and len(value) == count:
        for x in value:
            if type(x) is not float or not low <= x <= high:
                break
        else:
            return value  # checked before: lights are made anew for every picture
    array = as_array(value, complaint)
    if isinstance(value, list | tuple) and any(map(_is_flag, value)):
        raise TypeError(f"{complaint}, got {shown(value)}")
    if array.ndim == 1 and len(array) != count:
        raise ValueError(f"{complaint}, got {counted(len(array), 'number')}: {shown(value)}")
    if array.shape != (count,) or not ((array >= low) & (array <= high)).all():
        raise ValueError(f"{complaint}, got {shown(value)}")
    return tuple(array.tolist())


def check_point(value: Any, name: str) -> tuple[float, float, float]:
    """A place. Raises ValueError unless it is three finite numbers."""
    x, y, z = check_numbers(value, 3, f"{name} must be three finite numbers up to {LARGEST:g}")
    return x, y, z


def check_direction(value: Any, name: str) -> tuple[float, float, float]:
    """A direction of any length but 0. Raises ValueError unless it is three finite numbers."""
    most = sys.float_info.max
    x, y, z = check_numbers(value, 3, f"{name} must be three finite numbers", -most, most)
    if not any((x, y, z)):
        raise ValueError(f"{name} must not be (0, 0, 0)")
    return x, y, z


def check_color(value: Any, name: str) -> tuple[float, float, float]:
    """A linear colour. Raises ValueError unless it is three numbers of 0 or more."""
    red, green, blue = check_numbers(value, 3, f"{name} must be three numbers from 0 to {LARGEST:g}", low=0)
    return red, green, blue


Progress = Callable[[int, int], object]
_is_ended: ContextVar[Callable[[], bool] | None] = ContextVar("is_ended", default=None)  # asked between two steps


@contextmanager
def endable(is_ended: Callable[[], bool]) -> Iterator[None]:
    """End work inside that takes long with Cancelled, at its next `checkpoint`, once the function returns True."""
    token = _is_ended.set(is_ended)
    try:
        yield
    finally:
        _is_ended.reset(token)


def is_endable() -> bool:
    """Return whether the work that runs here may be ended, and others wait for a thread that answers."""
    return _is_ended.get() is not None


def checkpoint() -> None:
    """Raise Cancelled if the work that runs here has been ended. Called where it can be left."""
    is_ended = _is_ended.get()
    if is_ended is not None and is_ended():
        raise Cancelled("ended by the user")


class Count:
    """Counts the steps of work, and calls `progress(done, all)` after each.

    done  so many of all the steps, whose number may become known late
    """

    def __init__(self, progress: Progress | None = None, all: int = 0):
        self._progress = None if progress is None else check_function(progress, "progress")
        self.done, self.all = 0, all

    def step(self, count: int = 1) -> None:
        """Count steps as done. Raises Cancelled if `progress` returns False, and whatever it raises."""
        self.done += count
        checkpoint()
        answer = None if self._progress is None or not count else self._progress(self.done, self.all)
        if isinstance(answer, bool | np.bool_) and not answer:
            raise Cancelled(f"cancelled after {self.done} of {self.all} steps: progress returned False")
