"""Copies a scene with one shading model for all of its objects, or without its environment."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

from .graph import Scene
from .mesh import Mesh
from .node import Node
from .point_cloud import CLOUD_SHADINGS, PointCloud
from .point_object import PointObject


@lru_cache(maxsize=4)
def shaded(scene: Scene, shading: str | None) -> Scene:
    """Return the scene with one shading model for all objects; None leaves each object its own."""
    if shading is None:
        return scene

    def changes(node: Node) -> dict[str, Any]:
        parts = node.content if isinstance(node.content, tuple) else (node.content,)
        return {"content": tuple(_part_shaded(part, shading) for part in parts if part is not None)}

    return scene.with_every_node(changes)


@lru_cache(maxsize=4)
def without_environment(scene: Scene) -> Scene:
    """Return the scene without light from all around but the ambient light."""
    return replace(scene, environment=None)


def _part_shaded(part: Any, shading: str) -> Any:
    if isinstance(part, PointObject):
        return replace(part, look=replace(part.look, shading=shading))
    if isinstance(part, PointCloud):
        return part.styled(shading=shading if shading in CLOUD_SHADINGS else "phong")
    return replace(part, shading=shading) if isinstance(part, Mesh) else part
