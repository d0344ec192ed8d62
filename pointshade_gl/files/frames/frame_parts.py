"""The files and options from which one frame is read, and what is known of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple, TypedDict, TypeGuard

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import check_choice, check_positive
from ...checks.foreign_arrays import AnyArray
from ...notes.notes import Note
from ...notes.words import option
from ...scene.camera import Camera
from ...scene.frame import Frame
from ..access.content import MAX_PIXELS, FilePath
from ..cameras.intrinsics import Intrinsics
from ..cameras.lenses import PROJECTIONS, Projection
from ..containers.container_contents import Contents
from ..depth.depth_kinds import KINDS, Coding, DepthKind
from ..depth.depth_range import check_range
from ..depth.scale_over_time import SCALES, ScaleName
from ..networks.model_options import Model, ModelOptions, PixelsName, checked_options


@dataclass(frozen=True)
class ReadOptions:
    """What the caller gives with frames; see `load_frame`."""

    intrinsics: FilePath | AnyArray | Camera | None = None
    fov: float | None = None
    depth_scale: float | None = None
    depth_kind: DepthKind | None = None
    baseline: float | None = None
    pose: FilePath | AnyArray | None = None
    max_pixels: float = MAX_PIXELS
    depth_model: Model | None = None
    model_size: str | int | tuple[int, int] | None = None
    model_pixels: PixelsName | None = None
    cache: bool = False
    scale_frames: ScaleName | None = None
    poses: FilePath | None = None
    near: float | None = None
    far: float | None = None
    channel: str | None = None
    projection: Projection | None = None

    def __post_init__(self) -> None:
        check_positive(self.max_pixels, option("max_pixels", beside_file=True))
        if self.intrinsics is not None and self.fov is not None:
            raise ValueError(f"pass {option('intrinsics')} or {option('fov')}, not both")
        if self.pose is not None and self.poses is not None:
            raise ValueError(f"pass {option('pose')} or {option('poses')}, not both")
        if self.depth_kind is not None:
            check_choice(option("depth_kind"), self.depth_kind, KINDS)
        check_range(self.near, self.far, self.depth_kind, self.depth_scale)
        if self.projection is not None:
            check_choice(option("projection"), self.projection, PROJECTIONS)
        if self.scale_frames is not None:
            check_choice(option("scale_frames"), self.scale_frames, SCALES)
        self.network  # noqa: B018 - raises

    @property
    def network(self) -> ModelOptions | None:
        """The network that makes depth of photographs. Raises ValueError or TypeError for what is none."""
        if self.depth_model is not None:
            return checked_options(self.depth_model, self.model_size, self.model_pixels, self.cache)
        for name in ("model_size", "model_pixels", "cache"):
            if getattr(self, name):
                raise ValueError(f"{option(name)} is about a network: pass it as {option('depth_model', 'FILE')}")
        return None


class LoadOptions(TypedDict, total=False):
    """The options of `load_frame`; None counts as not given."""

    color: FilePath | AnyArray | None
    depth: Model | FilePath | AnyArray | None
    intrinsics: FilePath | AnyArray | Camera | None
    fov: float | None
    depth_scale: float | None
    depth_kind: DepthKind | None
    baseline: float | None
    near: float | None
    far: float | None
    channel: str | None
    pose: FilePath | AnyArray | None
    poses: FilePath | None
    allow_outside: bool | None
    max_pixels: float | None
    depth_model: Model | None
    model_size: str | int | tuple[int, int] | None
    model_pixels: PixelsName | None
    cache: bool | None
    scale_frames: ScaleName | None
    projection: Projection | None
    notes: Note | None


class FrameParts(NamedTuple):
    """What belongs to one frame; files are read when it is assembled."""

    depth: FilePath | NDArray[Any] | None
    color: FilePath | NDArray[Any] | None = None
    filed: Intrinsics | None = None  # the camera that lies beside the pictures
    pose: NDArray[np.float64] | None = None
    valid: FilePath | NDArray[Any] | None = None
    missing: str = ""  # why no camera is known
    number: int = 0  # counted from 0: which picture of a video is the colour
    contents: Callable[[], Contents] | None = None  # reads what a container gives instead of a depth picture
    path: Path | None = None  # the file that holds the depth; None for the caller's own array
    coded: tuple[str | None, float | None] = (None, None)  # kind and scale of the depth, where its maker states them
    maker: str = ""  # the network that makes the depth; "" for none

    @property
    def name(self) -> str:
        """The file that the depth is from; "" for the caller's own array."""
        return str(self.path) if self.path else ""


class FoundFiles(NamedTuple):
    """Where a frame was found: its files (None for arrays), and the sequence that it belongs to."""

    depth: str | None
    color: str | None
    frames: int = 1  # of the sequence
    shown: int = 0  # which of them this is
    poses: int = 0  # how many have one
    poses_from: str = ""


class Assembled(NamedTuple):
    """A frame, and how its files were understood."""

    frame: Frame
    found: FoundFiles
    camera_from: str
    coding: Coding
    stored: str  # type and size of the depth as it is stored
    is_compared: bool = False  # whether edges of both show how colours lie on the depth


def is_path(value: Any) -> TypeGuard[FilePath]:
    return isinstance(value, str | PathLike)
