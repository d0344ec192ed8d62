"""What a page does not show as the renderer does, in sentences."""

from __future__ import annotations

from collections.abc import Iterator

from ..notes.words import counted
from ..scene.cloud import PointCloud
from ..scene.graph import Scene
from ..scene.objects import PointObject
from ..scene.settings import Finish


def left_out(scene: Scene, finish: Finish, points: int) -> Iterator[str]:
    """Of a scene, finished like this. points: of its clouds, before some were left out."""
    objects = [p.content for p in scene.things if isinstance(p.content, PointObject)]
    shown = sum(len(p.content) for p in scene.things if isinstance(p.content, PointCloud))
    if shown < points:
        yield f"of {counted(points, 'point')} an even sample is drawn, {counted(shown, 'point')}"
    if finish.ground:
        yield "the ground and its shadows are in the still picture only"
    if not finish.is_light:
        yield f"{finish.show} in colours is in the still picture only"
    if any(one.look.splat == "mesh" for one in objects):
        yield "triangles between pixels are drawn as splats"
    if not all(one.is_single for one in objects):
        yield "several frames are one surface, the same from everywhere, without points that other frames contradict"
