"""The switches of what is shown: which views are on, which nodes are visible, and how clouds look."""

from __future__ import annotations

from dataclasses import replace
from typing import Any
from weakref import WeakKeyDictionary

from ..scene.cloud import PointCloud
from ..scene.graph import Scene
from ..scene.node import Node
from .clouds import parts_of
from .views import Shown, Views

NodeSwitch = tuple[bool, tuple[Any, ...]]  # whether a node is visible; splat and point size of each of its clouds
Switches = tuple[bool | NodeSwitch, ...]
_known: WeakKeyDictionary[Scene, Switches] = WeakKeyDictionary()  # asked for at each event


def switches_of(shown: Shown) -> Switches:
    """Return one for each view, or one for each node of a scene; a frame has none."""
    if isinstance(shown, Views):
        return shown.on
    if not isinstance(shown, Scene):
        return ()
    if shown not in _known:
        _known[shown] = tuple(_switch_of(node) for _, node in shown.every_node())
    return _known[shown]


def as_switched(shown: Shown, switches: Switches) -> Shown:
    """Return what is shown, with other switches. Those of something else change nothing."""
    now = switches_of(shown)
    if now == switches or len(now) != len(switches):
        return shown
    if isinstance(shown, Views):
        return replace(shown, on=switches)
    assert isinstance(shown, Scene), "a frame has no switches"
    nodes = list(shown.every_node())
    for (path, node), before, after in zip(nodes, now, switches, strict=True):
        if before != after:
            shown = shown.with_node(path, **_changes(node, after))
    return shown


def _switch_of(node: Node) -> NodeSwitch:
    clouds = (part for part in parts_of(node) if isinstance(part, PointCloud))
    return node.visible, tuple((cloud.splat, cloud.point_size) for cloud in clouds)


def _changes(node: Node, switch: Any) -> Any:
    visible, looks = switch
    if not looks:
        return {"visible": visible}
    following = iter(looks)
    parts = []
    for part in parts_of(node):
        if isinstance(part, PointCloud):
            splat, size = next(following)
            part = part.styled(splat=splat, point_size=size)
        parts.append(part)
    return {"visible": visible, "content": tuple(parts)}
