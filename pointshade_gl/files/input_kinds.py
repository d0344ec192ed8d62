"""What a source is, by its name and, where that is not certain, its first bytes: frames, a scene or a point cloud."""

from __future__ import annotations

from enum import Enum
from os import PathLike

from .access.content import FilePath
from .access.known_names import SCENE_SUFFIXES, SCENES, builtin_name


class Kind(Enum):
    """What a source is; the values are in words."""

    FRAMES, SCENE, CLOUD = "a frame", "a scene", "a point cloud"

    @classmethod
    def of(cls, source: FilePath | None) -> Kind:
        """The kind of what a source names; None is the built-in frame, or files that are named one by one."""
        from .clouds.load_cloud import is_cloud, is_mesh  # only here: it imports the readers of many files

        if names_scene(source) or is_mesh(source):
            return cls.SCENE
        return cls.CLOUD if is_cloud(source) else cls.FRAMES


def names_scene(source: FilePath | None) -> bool:
    """As `ps.sources.is_scene`, without the readers of files."""
    is_file = isinstance(source, str | PathLike) and str(source).lower().endswith(SCENE_SUFFIXES)
    return is_file or builtin_name(source) in SCENES
