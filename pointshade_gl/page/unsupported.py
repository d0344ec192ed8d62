"""What a page does not show as the renderer does, in sentences."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.light import Light
from ..scene.point_cloud import PointCloud
from ..scene.point_object import PointObject
from ..scene.render_settings import Finish


def check_shown(source: Frame | Sequence[Frame] | Scene | PointCloud) -> Frame | Sequence[Frame] | Scene:
    """Return what a page is to show. Raises ValueError for what no page shows."""
    things = source.things if isinstance(source, Scene) else ()
    if isinstance(source, PointCloud) or any(isinstance(p.content, PointCloud) for p in things):
        raise ValueError("a page shows no point clouds yet: write a picture or a film of them")
    return source


def left_out(scene: Scene, lights: Iterable[Light], finish: Finish) -> Iterator[str]:
    """Of a scene under these lights, finished like this."""
    objects = [p.content for p in scene.things if isinstance(p.content, PointObject)]
    if finish.ground:
        yield "the ground and its shadows are in the still picture only"
    if any(light.is_soft for light in lights):
        yield "lights have no size: their shadows are hard"
    if any(one.look.splat == "mesh" for one in objects):
        yield "triangles between pixels are drawn as splats"
    if not all(one.is_single for one in objects):
        yield "where several frames show the same, the nearest is seen, not their mean"
