"""Point clouds in a window: a scene whose clouds are drawn otherwise, and its size of points in words."""

from __future__ import annotations

from collections.abc import Callable

from ..scene.cloud import CloudLook, PointCloud
from ..scene.graph import Scene
from ..scene.node import Node, NodeOptions
from .views import Shown

LARGEST = 100.0  # pixels or spacings
SMALLEST = 0.1
UNITS = {"x": "times the spacing of the points", "px": "pixels", "": "(world units)"}


def clouds_of(shown: Shown) -> list[PointCloud]:
    """Return the clouds of a scene, also those that are hidden; none of anything else."""
    nodes = (node for _, node in shown.every_node()) if isinstance(shown, Scene) else ()
    return [part for node in nodes for part in parts_of(node) if isinstance(part, PointCloud)]


def restyled(scene: Scene, look: Callable[[PointCloud], CloudLook]) -> Scene:
    """Return a scene whose clouds are drawn as a function of each says."""

    def changes(node: Node) -> NodeOptions:
        return {"content": tuple(p.styled(**look(p)) if isinstance(p, PointCloud) else p for p in parts_of(node))}

    return scene.with_every_node(changes)  # type: ignore[arg-type]


def resized(scene: Scene, factor: float) -> tuple[Scene, str]:
    """Return a scene with larger or smaller points of its clouds, and what there is to say."""

    def look(cloud: PointCloud) -> CloudLook:
        number, unit = size_of(cloud)
        return {"point_size": with_unit(_limited(number * factor, unit), unit)}

    changed = restyled(scene, look)
    number, unit = size_of(clouds_of(changed)[0])
    end = {SMALLEST: ", the smallest", LARGEST: ", the largest"}.get(number, "") if unit else ""
    return changed, f"point size: {number:g} {UNITS[unit]}{end}"


def size_of(cloud: PointCloud) -> tuple[float, str]:
    """Return the size of a cloud's points and its unit. Sizes of its own are 1."""
    return (1.0, "x") if cloud.sizes is not None and cloud.point_size is None else cloud.radius_rule


def with_unit(number: float, unit: str) -> float | str:
    """Return a size as `PointCloud.point_size` has it."""
    return f"{number:.3g}{unit}" if unit else float(f"{number:.3g}")


def _limited(number: float, unit: str) -> float:
    return min(max(number, SMALLEST), LARGEST) if unit else number


def parts_of(node: Node) -> tuple:
    """Return what a node holds."""
    return node.content if isinstance(node.content, tuple) else () if node.content is None else (node.content,)
