"""Finds files that come with the package: the frame "vase" and the scene "demo"."""

from __future__ import annotations

from pathlib import Path

from ...messages.validation import check_path
from .content import FilePath

FRAMES = ("vase",)
SCENES = {"demo": "scene/scene.gltf"}


def builtin_folder(source: FilePath) -> Path:
    """The folder of a built-in frame for its name; any other text is a path already."""
    return asset(source) if isinstance(source, str) and source in FRAMES else check_path(source)


def builtin_scene(source: FilePath) -> Path:
    """The file of a built-in scene for its name; any other text is a path already."""
    return asset(SCENES[source]) if isinstance(source, str) and source in SCENES else check_path(source)


def asset(name: str) -> Path:
    """A file or folder that comes with the package."""
    package = Path(__file__).resolve().parents[2]
    places = [parent / "assets" / name for parent in (package, package.parent)]  # installed, checked out
    return next((place for place in places if place.exists()), places[0])
