"""The array of the caller's into which a picture is read."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import as_given, is_a
from ..notes.words import shown
from ..scene.camera import Camera


def output_array(out: Any, camera: Camera) -> NDArray[np.uint8]:
    """Return the array itself; of a tensor or a buffer one in its memory.

    Raises TypeError or ValueError for what a picture of this camera cannot be read into.
    """
    wanted = camera.height, camera.width, 4
    expected = f"out must be an array of shape {wanted}, uint8 and in C order, that can be written to"
    array: NDArray[Any] = out if is_a(out, np.ndarray) else as_given(out, expected)
    if not array.ndim:
        raise TypeError(f"{expected}, got {shown(out)}")
    if array is not out and not np.may_share_memory(array, as_given(out, expected)):
        raise TypeError(f"{expected}, got a {type(out).__name__}, of which NumPy has a copy only")
    if array.dtype != np.uint8:
        raise TypeError(f"{expected}, got {array.dtype}")
    if array.shape != wanted:
        raise ValueError(f"{expected}, got shape {array.shape}")
    if not array.flags.c_contiguous:
        raise ValueError(f"{expected}, got one in another order, with strides {array.strides}")
    if not array.flags.writeable:
        raise ValueError(f"{expected}, got a read-only one")
    return array
