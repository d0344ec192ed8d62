"""Collects what was estimated about a picture's objects: normal methods, agreement of frames, light."""

from __future__ import annotations

from typing import NamedTuple

from ..estimation.light_fit import FoundLight
from ..estimation.multi_view import SetReport
from ..gpu.clouds.cloud_objects import PlacedCloud
from ..gpu.clouds.cloud_planes import FitRadius
from ..gpu.core.frame_textures import FrameTextures
from ..gpu.drawables import Drawables
from ..gpu.meshes.mesh_objects import PlacedMesh, ShownGrid
from ..gpu.points.point_objects import ShownPoints, ShownSet
from ..gpu.points.tiles import TiledPoints
from ..scene.frame import Frame
from ..scene.noise import Choice


class CloudFinding(NamedTuple):
    """What was drawn of a cloud: how many of its points, how far they lie apart, and how their planes were found.

    fit  None where they have none, as balls of a given size
    """

    points: int
    drawn: int
    spacing: float
    fit: FitRadius | None


Finding = Choice | SetReport | CloudFinding


def findings(drawn: Drawables) -> list[tuple[str, Finding]]:
    """Return, by object, which method estimated its normals, or what its several frames agree on."""
    found: list[tuple[str, Finding]] = []
    for p, thing in drawn.items():
        if isinstance(thing, ShownSet):
            found.append((p.node.name, thing.report()))
        elif isinstance(thing, PlacedCloud):
            points = thing.points
            found.append((p.node.name, CloudFinding(len(thing.cloud), points.count, points.spacing, points.fit)))
        elif not isinstance(thing, PlacedMesh):
            found.append((p.node.name, (thing if isinstance(thing, TiledPoints) else thing.textures).choice))
    return found


def lights(drawn: Drawables) -> list[tuple[str, FoundLight]]:
    """Return the light that was found in each frame whose shading is to be removed, by the name of its object."""
    return [(name, textures.light) for name, textures in _frames(drawn) if textures.light]


def weights(drawn: Drawables) -> dict[Frame, float]:
    """Return the weight of each frame where several show the same surface: 1 if it is a primary view."""
    found: dict[Frame | None, float] = {}
    for thing in drawn.values():
        if isinstance(thing, ShownSet):
            found |= zip((view.textures.frame for view in thing.views), thing.importances.tolist(), strict=True)
        elif isinstance(thing, ShownPoints):
            found[thing.textures.frame] = 1.0
        elif isinstance(thing, TiledPoints):
            found[thing.frame] = 1.0
    return {frame: weight for frame, weight in found.items() if frame}


def _frames(drawn: Drawables) -> list[tuple[str, FrameTextures]]:
    """Return the frames that are on the GPU as a whole, by object: in others no light is looked for."""
    return [
        (p.node.name, view.textures)
        for p, thing in drawn.items()
        if isinstance(thing, ShownPoints | ShownGrid | ShownSet)
        for view in (thing.views if isinstance(thing, ShownSet) else (thing,))
    ]
