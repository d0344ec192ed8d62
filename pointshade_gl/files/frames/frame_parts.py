"""The files and options from which one frame is read, what is known of it, and whether colour and depth fit."""

from __future__ import annotations

import re
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
from ...scene.values import median, quantile
from ..access.content import MAX_PIXELS, FilePath
from ..cameras.intrinsics import Intrinsics
from ..cameras.lenses import PROJECTIONS, Projection
from ..containers.container_contents import Contents
from ..depth.depth_kinds import KINDS, Coding, DepthKind
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
    projection: Projection | None = None

    def __post_init__(self) -> None:
        check_positive(self.max_pixels, option("max_pixels", beside_file=True))
        if self.intrinsics is not None and self.fov is not None:
            raise ValueError(f"pass {option('intrinsics')} or {option('fov')}, not both")
        if self.pose is not None and self.poses is not None:
            raise ValueError(f"pass {option('pose')} or {option('poses')}, not both")
        if self.depth_kind is not None:
            check_choice(option("depth_kind"), self.depth_kind, KINDS)
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


def is_path(value: Any) -> TypeGuard[FilePath]:
    return isinstance(value, str | PathLike)


_WIDTH = 160  # pixels to which both are reduced
_REACH = 10  # pixels of those in each direction that are searched
_STEP = 0.06  # change of log z that is a step
_FEW = 150  # steps that are too few to decide
_CLEAR = 3.3  # how far the best shift must stand out from all others, in their standard deviations
_BETTER = 1.15  # how much better it must be than none
_NEAR = 2  # pixels: no shift


def check_registration(frame: Frame, note: Note) -> None:
    """Print a note if the colours look shifted against the depth. A scene without clear edges passes."""
    shift = find_shift(frame)
    if shift:
        x, y = (round(part * frame.depth.shape[1] / _WIDTH) for part in shift)
        where = [f"{abs(x)} pixels to the {'right' if x > 0 else 'left'}"] if x else []
        where += [f"{abs(y)} pixels {'down' if y > 0 else 'up'}"] if y else []
        note(f"the colours look shifted by {' and '.join(where)} of the depth picture: the two may not be registered")


def find_shift(frame: Frame) -> tuple[int, int] | None:
    """Return by how many reduced pixels the colours are shifted right and down; None if they fit or have few edges."""
    height = round(_WIDTH * frame.depth.shape[0] / frame.depth.shape[1])
    if frame.color is None or min(height, _WIDTH) < 4 * _REACH:
        return None
    steps, edges = _depth_steps(frame.depth, height), _color_edges(frame.color, height)
    steps[:_REACH] = steps[-_REACH:] = steps[:, :_REACH] = steps[:, -_REACH:] = 0
    if np.count_nonzero(steps) < _FEW or not edges.any():
        return None
    # the cross-correlation of both pictures' edges has a clear maximum where they fit
    product = np.fft.irfft2(np.fft.rfft2(edges) * np.conj(np.fft.rfft2(steps)), s=steps.shape)
    found = np.roll(product, (_REACH, _REACH), (0, 1))[: 2 * _REACH + 1, : 2 * _REACH + 1]
    usual = median(found)
    spread = 1.48 * median(abs(found - usual))
    row, column = np.unravel_index(found.argmax(), found.shape)
    y, x = int(row) - _REACH, int(column) - _REACH
    here = found[_REACH - _NEAR : _REACH + _NEAR + 1, _REACH - _NEAR : _REACH + _NEAR + 1].max()
    if max(abs(x), abs(y)) <= _NEAR or max(abs(x), abs(y)) == _REACH:
        return None
    is_clear = found.max() - usual > _CLEAR * spread and found.max() > _BETTER * here
    return (x, y) if is_clear else None


def _depth_steps(depth: NDArray[np.float32], height: int) -> NDArray[np.float64]:
    """(height, _WIDTH) 1 beside a step between two known depths."""
    sizes = zip((height, _WIDTH), depth.shape, strict=True)
    rows, columns = (((np.arange(n) + 0.5) * size / n).astype(int) for n, size in sizes)
    z = depth[np.ix_(rows, columns)]
    with np.errstate(divide="ignore", invalid="ignore"):
        return (_changes(np.log(z)) > _STEP).astype(np.float64)


def _color_edges(color: NDArray[np.uint8], height: int) -> NDArray[np.float64]:
    """(height, _WIDTH) changes of brightness; the strongest 5 % count alike."""
    from PIL import Image

    grey = Image.fromarray(np.ascontiguousarray(color[..., :3])).convert("L")
    edges = _changes(np.asarray(grey.resize((_WIDTH, height), Image.Resampling.BOX), np.float64))
    return np.minimum(edges, quantile(edges, 0.95))


def _changes(values: NDArray[np.floating]) -> NDArray[np.float64]:
    """The largest difference to one of four neighbours; 0 beside what is not finite."""
    result = np.zeros(values.shape)
    for own, found in ((values, result), (values.T, result.T)):
        change = np.nan_to_num(abs(np.diff(own, axis=0)), nan=0.0, posinf=0.0)
        found[1:] = np.maximum(found[1:], change)
        found[:-1] = np.maximum(found[:-1], change)
    return result


class _Kind(NamedTuple):
    """A kind of file. head: how its first bytes begin; None: only the suffix shows it."""

    title: str
    suffixes: str
    head: bytes | None
    way_out: str


_TOPICS = "write its colour and depth topics as PNG, 16 bits for depth, then pass their folder"
_TOOL = "export colour and 16-bit depth as pictures, then pass their folder; that does"
_MODEL = "it has no pictures: only glTF (.gltf, .glb) is read among models, Blender and MeshLab convert to it"
_CLOUD = "it has no pictures: `pointshade render` draws it, load_cloud reads it"
_TENSORS = "save its depth as .npy or .npz and pass that"
_NETWORK = "depth_model"
_VIDEO = f"pass the folder of its depth pictures, or a network that makes depth of its pictures as {_NETWORK}"
_UNPACK = "unpack it and pass the folder"
_KINDS = (
    _Kind("a ROS bag", "bag", b"#ROSBAG", _TOPICS),
    _Kind("a ROS 2 bag", "mcap", b"\x89MCAP", _TOPICS),
    _Kind("a ROS 2 bag", "db3", b"SQLite", _TOPICS),
    _Kind("a database of RTAB-Map", "db", b"SQLite", f"{_TOOL} `rtabmap-export --images --poses`"),
    _Kind("a recording of a ZED camera", "svo|svo2", None, f"{_TOOL} `ZED_SVO_Export`"),
    _Kind("a recording of an Azure Kinect, or a video", "mkv", None, f"{_TOOL} Open3D's azure_kinect_mkv_reader.py"),
    _Kind("a recording of OpenNI", "oni", None, f"{_TOOL} OpenNI's or PCL's tools"),
    _Kind("a recording of ElasticFusion's Logger", "klg", None, f"{_TOOL} any converter from .klg to PNG"),
    _Kind("a ScanNet recording", "sens", None, f"{_TOOL} ScanNet's SensReader"),
    _Kind("a point cloud", "ply|las|laz|xyz|pts|e57", None, _CLOUD),
    _Kind("a model", "obj|stl|fbx|usdz?|usd[ac]|dae|off", None, _MODEL),
    _Kind("a video", "mp4|mov|avi|webm", None, _VIDEO),
    _Kind("a file of Python objects", "pkl|pickle|pt|pth|joblib", None, _TENSORS),
    _Kind("an archive", "tar|gz|tgz|bz2|xz|7z|rar", None, _UNPACK),
)


def what_else(path: Path) -> str | None:
    """Return what a file is that cannot be read here, and what to do, to end a sentence; None for any other file."""
    suffix = path.suffix.lower().removeprefix(".")
    kind = next((kind for kind in _KINDS if re.fullmatch(kind.suffixes, suffix)), None)
    if kind is None:
        return None
    if kind.head is not None:
        with path.open("rb") as file:
            if not file.read(len(kind.head)).startswith(kind.head):
                return None
    return f"{kind.title}: {kind.way_out.replace(_NETWORK, option(_NETWORK, 'FILE'))}"
