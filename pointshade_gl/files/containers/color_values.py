"""Converts colours of any array type to 8 bits."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

_WHITE = 1.01  # filters overshoot a little


def as_color(picture: NDArray[Any]) -> NDArray[np.uint8]:
    """(h, w, 3|4) uint8 of a picture of any type: floating point from 0 or -1 to 1, or up to 255; 16 bits; grey."""
    if picture.dtype.kind == "f":
        picture = np.nan_to_num(picture.astype(np.float32), posinf=0, neginf=0)
        low, high = picture.min(), picture.max()
        scale, offset = (1, 0) if high > _WHITE else (127.5, 127.5) if low < 0 else (255, 0)
        picture = np.rint(picture * scale + offset).clip(0, 255).astype(np.uint8)
    elif picture.dtype == bool:
        picture = picture * np.uint8(255)
    elif picture.dtype != np.uint8:
        is_deep = picture.dtype.itemsize == 2 and picture.max(initial=0) > 255
        picture = (picture // 257 if is_deep else picture.clip(0, 255)).astype(np.uint8)
    return np.repeat(picture[..., None], 3, axis=2) if picture.ndim == 2 else picture
