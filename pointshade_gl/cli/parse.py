"""Turns texts of the command line into values. Each error names the option and shows the text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..files.access.content import split_numbers
from ..notes.words import option
from .usage_errors import check_exist


def size_from(text: str | None, name: str, names: Sequence[str] = ()) -> Any:
    """Width and height of WxH, or one of the names; None without a text. Errors name the option and what it takes."""
    if text is None or text in names:
        return text
    expected = f"{option(name)} takes WIDTHxHEIGHT in whole pixels above 0, such as 640x480"
    expected += f", or {', '.join(names)}" if names else ""
    width, height = _numbers(text, 2, "x", expected)
    if width < 1 or height < 1 or width % 1 or height % 1:
        raise ValueError(f"{expected}, got {text!r}")
    return int(width), int(height)


def views_from(text: str) -> int | tuple[int, ...] | None:
    """How many views are merged; None for all; or the numbers of the frames.

    Raises ValueError for anything but 'all', a number of 2 or more, and numbers with commas between them.
    """
    if text == "all":
        return None
    parts = text.split(",")
    if not all(part.isdecimal() for part in parts) or (len(parts) == 1 and int(text) < 2):
        raise ValueError(
            f"{option('views')} takes a whole number of 2 or more, or 'all', or frames such as 0,5,9, got {text!r}"
        )
    return int(text) if len(parts) == 1 else tuple(map(int, parts))


def frames_from(text: str, count: int) -> list[int]:
    """The number of a frame, or one for each of `count` inputs."""
    expected = f"{option('frame')} takes the number of a frame, counted from 0"
    expected += f", for each of {count} INPUTs" if count > 1 else ""
    numbers = _numbers(text, count, ",", expected)
    if any(number < 0 or number % 1 for number in numbers):
        raise ValueError(f"{expected}, got {text!r}")
    return [int(number) for number in numbers]


def pose_from(text: str) -> NDArray[np.float64]:
    """(4, 4) from numbers, or from a file that holds them. Raises OSError or ValueError."""
    from ..files.cameras.pose_files import load_pose, pose_of

    if (numbers := split_numbers(text)) is not None and not Path(text).exists():
        return pose_of(np.array(numbers), option("pose"))
    check_exist(pose=text)
    return load_pose(text)


def environment_from(text: str) -> Any:
    """The environment of a name or a file. Raises OSError or ValueError."""
    from ..files.pictures.hdr_files import find_environment

    return find_environment(text)


def rates_from(text: str, count: int) -> list[float]:
    """Frames per second of each of `count` inputs: one number for all, or one for each."""
    expected = f"{option('fps')} must be a number of frames per second"
    expected += ", or one for each INPUT" if count > 1 else ""
    rates = _numbers(text, count if "," in text else 1, ",", expected)
    return rates * (count if len(rates) == 1 else 1)


def _numbers(text: str, count: int, separator: str, expected: str) -> list[float]:
    try:
        numbers = [float(part) for part in text.lower().split(separator)]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise ValueError(f"{expected}, got {text!r}")
    return numbers
