"""Finds files that come with the package: the frame "vase" and the scene "demo"."""

from __future__ import annotations

import os
from pathlib import Path

from ...checks.arguments import check_path
from .content import FilePath

FRAMES = ("vase",)
SCENES = {"demo": "scene/scene.gltf"}


def builtin_name(source: object) -> str | None:
    """The built-in frame or scene that a source names; None for any other.

    A text is the built-in name whatever lies in the folder one is in, as "./vase" is the folder of that name. A Path
    knows no such difference: it is the built-in name only where no such file or folder exists.
    """
    name = os.fspath(source) if isinstance(source, str | os.PathLike) else None
    if name not in (*FRAMES, *SCENES) or (not isinstance(source, str) and Path(name).exists()):
        return None
    return name


def builtin_folder(source: FilePath) -> Path:
    """The folder of a built-in frame for its name; anything else is a path already."""
    name = builtin_name(source)
    return asset(name) if name in FRAMES else check_path(source)


def builtin_scene(source: FilePath) -> Path:
    """The file of a built-in scene for its name; anything else is a path already."""
    name = builtin_name(source)
    return asset(SCENES[name]) if name in SCENES else check_path(source)


def asset(name: str) -> Path:
    """A file or folder that comes with the package."""
    package = Path(__file__).resolve().parents[2]
    places = [parent / "assets" / name for parent in (package, package.parent)]  # installed, checked out
    return next((place for place in places if place.exists()), places[0])
