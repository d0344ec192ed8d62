"""Reads colour images of every format as 8-bit RGB; a video gives one image for each frame."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import as_given
from ...checks.foreign_arrays import way_to
from ...notes.notes import Note
from ..access.content import FilePath
from ..access.file_name_patterns import VIDEO_SUFFIXES
from ..access.limits import MAX_PIXELS
from ..pictures.picture_files import read_image
from .frame_parts import Parts, is_path


def read_colors_of(parts: Parts, max_pixels: float, note: Note = lambda _: None) -> NDArray[Any] | None:
    """The colours of a frame in sRGB, (h, w, 3|4) uint8; None without any."""
    if parts.color is None:
        return None
    if not is_path(parts.color):
        return _check_color(parts.color)
    if Path(parts.color).suffix.lower() in VIDEO_SUFFIXES:
        from ..pictures.video import read_video_frame  # only here

        return read_video_frame(parts.color, parts.number, max_pixels)
    return read_color(parts.color, max_pixels, note)


def read_color(path: FilePath, max_pixels: float = MAX_PIXELS, to_srgb: Note | None = None) -> NDArray[np.uint8]:
    """(h, w, 3|4) uint8 of any picture: palettes are looked up, grey is repeated, 16 bits become 8.

    to_srgb  convert colours of other colour spaces, and say so
    """
    return to_color(read_image(path, max_pixels, to_srgb), str(path))


def to_color(image: NDArray[Any], name: str) -> NDArray[np.uint8]:
    """(h, w, 3|4) uint8 of a picture's values. Raises ValueError, with the name, for floating point."""
    if image.dtype.kind == "f":
        raise ValueError(f"{name} is a floating point picture, expected colours of 8 or 16 bits")
    if image.dtype != np.uint8:
        image = ((np.clip(image, 0, 65535).astype(np.uint32) * 255 + 32767) // 65535).astype(np.uint8)
    return np.repeat(image[..., None], 3, axis=2) if image.ndim == 2 else image


def _check_color(color: Any) -> NDArray[Any]:
    expected = "color must have shape (h, w, 3) or (h, w, 4)"
    array = as_given(color, expected)
    if array.ndim != 3 or 0 in array.shape:
        raise ValueError(f"{expected}, got {array.shape}{way_to(array.shape, 'color', color, (3, 4))}")
    return array
