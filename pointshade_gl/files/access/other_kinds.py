"""What files are that hold no frame which can be read here, and what to do with them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

from ...notes.words import option


class _Kind(NamedTuple):
    """A kind of file. head: how its first bytes begin; None: only the suffix shows it."""

    title: str
    suffixes: str
    head: bytes | None
    way_out: str


_TOPICS = "write its colour and depth topics as PNG, 16 bits for depth, then pass their folder"
_TOOL = "export colour and 16-bit depth as pictures, then pass their folder; that does"
_MODEL = "it has no pictures: of models glTF (.gltf, .glb) and PLY are read, Blender and MeshLab convert to them"
_SPLATS = "it has no pictures: convert it to .ply, as SuperSplat does, which load_cloud and `pointshade render` read"
_CLOUD = "it has no pictures: `pointshade render` draws it, load_cloud reads it"
_TENSORS = "save its depth as .npy or .npz and pass that"
_NETWORK = "depth_model"
_VIDEO = (
    "pass the folder of its depth pictures, put its film of depth beside it (clip.mp4, clip_depth.mp4), or pass a "
    f"network that makes depth of its pictures as {_NETWORK}"
)
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
    _Kind("a point cloud", "ply|las|laz|xyz|pts|e57|spz|splat|sog", None, _CLOUD),
    _Kind("a file of Gaussian splats", "ksplat|rad|lcc", None, _SPLATS),
    _Kind(
        "a model",
        "obj|mtl|stl|fbx|usdz?|usd[ac]|dae|off|3mf|3ds|blend|abc|wrl|x3d|max|c4d|ifc|step|stp|iges",
        None,
        _MODEL,
    ),
    _Kind("a scene of glTF", "gltf|glb", None, "pass it alone, as INPUT"),
    _Kind("a video", "mp4|mov|avi|webm|m4v", None, _VIDEO),
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
        if not path.is_file():
            return None
        with path.open("rb") as file:
            if not file.read(len(kind.head)).startswith(kind.head):
                return None
    return f"{kind.title}: {kind.way_out.replace(_NETWORK, option(_NETWORK, 'FILE'))}"
