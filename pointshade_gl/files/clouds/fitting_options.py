"""Which options belong to frames, which to point clouds, and which to both: others are refused in a sentence."""

from __future__ import annotations

from collections.abc import Iterable

from ...notes.words import option
from ...scene.cloud import Up
from ..access.content import FilePath
from ..frames.frame_parts import LoadOptions
from .found_points import ColorBy

LIMITS = ("allow_outside", "max_pixels", "notes")  # that frames, scenes and clouds share
_OF_CLOUDS = ("up", "most", "color_by")


class AnyOptions(LoadOptions, total=False):
    """The options of `load_frame` and of `load_cloud`; None counts as not given."""

    up: Up | None
    most: int | None
    color_by: ColorBy | None


def check_cloud_options(options: Iterable[str], source: FilePath) -> None:
    """Raises ValueError for options of a frame, given with a point cloud."""
    check_fitting(options, (*LIMITS, *_OF_CLOUDS), f"{source} is a point cloud, and no frame")


def check_frame_options(options: Iterable[str], source: FilePath | None) -> None:
    """Raises ValueError for options of a point cloud, given with a frame."""
    if given := [option(name) for name in options if name in _OF_CLOUDS]:
        raise ValueError(f"{source or 'this'} is no point cloud: leave out {', '.join(given)}")


def check_fitting(options: Iterable[str], fitting: tuple[str, ...], fact: str) -> None:
    """Raises ValueError, with the fact, for options that do not fit it."""
    if given := [option(name) for name in options if name not in fitting]:
        raise ValueError(f"{fact}: leave out {', '.join(given)}")
