"""Errors in a glTF file name the part where they are: `scene.gltf: node 'vase': there is no folder ...`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...notes.errors import is_expected
from ...notes.words import shown

Item = TypeVar("Item")
FAR = 1e30  # nothing in a scene is larger, and its cube still is a number


@contextmanager
def telling(part: str) -> Iterator[None]:
    """Every ValueError, TypeError and OSError inside begins with the part's name. Deep nesting is a ValueError."""
    try:
        yield
    except (ValueError, TypeError, OSError) as error:
        text = str(error).removeprefix("node '': ")  # a Node without a name; the part's number is known here
        if text.startswith((f"{part}:", f"{part} ")) or not is_expected(error):
            raise
        kind = type(error) if isinstance(error, OSError) else ValueError
        raise kind(f"{part}: {text}") from None
    except RecursionError:
        raise ValueError(f"{part}: is nested too deeply") from None


def pick(items: Sequence[Item | None] | None, index: Any, what: str) -> Item:
    """One of the file's numbered parts, or a ValueError."""
    items = items or ()
    if isinstance(index, bool) or not isinstance(index, int):
        raise ValueError(f"a {what} must be named by its number, got {shown(index)}")
    if not 0 <= index < len(items):
        raise ValueError(f"there is no {what} {index}, the file has {len(items)}")
    item = items[index]
    if item is None:
        raise ValueError(f"{what} {index} is null")
    return item


def label(what: str, index: int, name: str | None) -> str:
    """How messages call a part: by its name, else by its number."""
    return f"{what} {shown(name)}" if name else f"{what} {index}"


def numbers(value: Any, shape: tuple[int, ...], what: str) -> NDArray[np.float64]:
    """Numbers of that shape, finite and below FAR, or a ValueError."""
    try:
        array = np.asarray(value, np.float64).reshape(shape)
    except (TypeError, ValueError, OverflowError):
        expected = f"{int(np.prod(shape))} numbers" if shape else "a number"
        raise ValueError(f"{what} must be {expected}, got {shown(value)}") from None
    if not (np.abs(array) < FAR).all():  # NaN compares false
        raise ValueError(f"{what} must be finite and below {FAR:g}, got {shown(value)}")
    return array
