"""Estimates the camera of a photograph from the focal length in its EXIF data."""

from __future__ import annotations

import math
from typing import Any

from ..access.content import FilePath, check_size, open_regular, read_head
from ..access.limits import LONGEST_SIDE, MAX_PIXELS
from ..pictures.picture_files import TURNED, opened_picture
from .intrinsics import Intrinsics

EXIF = 0x8769  # the tag under which the others lie
_FOCAL_35, _WIDTH, _HEIGHT = 0xA405, 0xA002, 0xA003
_DIAGONAL_35 = math.hypot(36, 24)  # mm; cameras compare diagonals (CIPA DCG-001): a phone's 4:3 has no width of 36 mm
_SAME_SHAPE = 0.02


def camera_from_exif(path: FilePath, max_pixels: float = MAX_PIXELS) -> Intrinsics | None:
    """The camera of a picture with EXIF FocalLengthIn35mmFilm, upright, its principal point in the middle.

    Whole millimetres make it right to a few per cent. None if the picture does not say it, or was cropped.
    """
    head = read_head(path)
    with open_regular(path) as file:
        check_size(file, path, max_pixels)
        try:
            with opened_picture(file, head) as image:
                return camera_of_lens(str(path), image.getexif(), image.size)
        except Exception:  # broken bytes make Pillow raise of everything: then the picture does not say it
            return None


def camera_of_lens(name: str, exif: Any, size: tuple[int, int]) -> Intrinsics | None:
    """The same from EXIF data (`PIL.Image.Exif`) of a picture of this width and height, not yet turned."""
    tags = exif.get_ifd(EXIF)
    focal, width, height = (_number(tags.get(key)) for key in (_FOCAL_35, _WIDTH, _HEIGHT))
    if not 1 <= focal <= 10_000 or not all(1 <= side <= LONGEST_SIDE for side in size):
        return None
    if width > 0 and height > 0 and abs(_elongation(*size) / _elongation(width, height) - 1) > _SAME_SHAPE:
        return None
    if exif.get(TURNED, 1) in (5, 6, 7, 8):
        size = size[1], size[0]
    pixels = focal / _DIAGONAL_35 * math.hypot(*size)
    return Intrinsics(name, (pixels, pixels, (size[0] - 1) / 2, (size[1] - 1) / 2), size)


def _elongation(width: float, height: float) -> float:
    return max(width, height) / min(width, height)


def _number(value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError, ZeroDivisionError, OverflowError):
        return 0.0
