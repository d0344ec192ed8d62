"""Reads environments: pictures of the whole sphere, of Radiance, OpenEXR, or any picture of colours."""

from __future__ import annotations

from functools import lru_cache
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import LARGEST, check_path, is_a
from ...notes.notes import print_note
from ...notes.words import did_you_mean, near_path, option, shown
from ...scene.environment import NAMES, Environment, check_environment
from ...scene.values import srgb_to_linear
from ..access.content import FilePath, read_head
from ..access.limits import MAX_PIXELS
from .exr import EXR, read_exr_colors
from .picture_files import read_image
from .radiance import RADIANCE, read_radiance

_SLACK = 0.02  # of the width by which a picture may miss that it is twice as wide as high


def load_environment(path: FilePath, *, max_pixels: float = MAX_PIXELS) -> Environment:
    """Read light from all around from a picture of the whole sphere.

    Parameters
    ----------
    path : path
        .hdr (Radiance), .exr (needs the extra `exr`), or a picture such as .png or .jpg, whose colours are taken for
        sRGB: its light ends at 1, and a note says so. It is twice as wide as high; see `Environment` for its axes.
    max_pixels : float
        Limit for its pixels.

    Raises
    ------
    ValueError
        For a broken picture, one of another shape, and one that is too large.
    OSError
        If the path is not a file.
    """
    path = check_path(path)
    head = read_head(path)
    if head.startswith(RADIANCE):
        picture: NDArray[Any] = read_radiance(path, max_pixels)
    elif head.startswith(EXR):
        picture = read_exr_colors(path, max_pixels)
    else:
        picture = _linear(read_image(path, max_pixels, print_note), path)
    height, width = picture.shape[:2]
    if abs(width - 2 * height) > _SLACK * width:
        raise ValueError(
            f"{path} has {width}x{height} pixels: expected a picture of the whole sphere (equirectangular), "
            "twice as wide as high"
        )
    return Environment(_repaired(picture, path), str(path))


def find_environment(value: Any) -> Environment | None:
    """Return the environment that an option names: a name, a file, or what `Environment` takes; None stays.

    Raises ValueError, TypeError or OSError for anything else.
    """
    if not is_a(value, str, PathLike) or value in NAMES:
        return check_environment(value)
    path = check_path(value)
    if not path.exists():
        near = did_you_mean(value, NAMES) or near_path(path)
        expected = f"{option('environment')} must be {' or '.join(NAMES)}, or a file such as studio.hdr"
        raise FileNotFoundError(f"{expected}: {shown(str(value))} does not exist{near}")
    seen = path.stat()
    return _loaded(path, seen.st_mtime_ns, seen.st_size)


@lru_cache(2)
def _loaded(path: Path, *changed: int) -> Environment:
    """The same object again while the file stays as it is: the pipeline sees that nothing has changed."""
    return load_environment(path)


def _linear(picture: NDArray[Any], path: Path) -> NDArray[np.float32]:
    """(h, w, 3) linear light of colours of 8 or 16 bits."""
    if picture.dtype.kind == "f":
        raise ValueError(f"{path} holds numbers of one channel, expected colours: write them as .hdr or .exr")
    print_note(f"{path} is read as sRGB: its light ends at 1, so sun and lamps are dimmer than in an .hdr or .exr")
    most = 255 if picture.dtype == np.uint8 else 65535
    values = srgb_to_linear(np.arange(most + 1, dtype=np.float32) / most)
    grey = picture if picture.ndim == 3 else picture[..., None]
    return np.broadcast_to(values[np.clip(grey[..., :3], 0, most)], (*grey.shape[:2], 3))


def _repaired(picture: NDArray[Any], path: Path) -> NDArray[Any]:
    """Without numbers that are no light: filters leave negative ones, and the sun may be infinite in 16 bits."""
    is_light = (picture >= 0) & (picture <= LARGEST)
    if is_light.all():
        return picture
    most = picture[is_light].max(initial=0)
    count = int((~is_light).any(-1).sum())
    print_note(f"{path}: {count} pixels are negative or not finite: they are taken for 0, or for the brightest other")
    return np.where(is_light, picture, np.where(picture > LARGEST, most, 0))
