"""Hangs up the lamps of a picture: draws their shadow maps, and lights the points of shading models that mix light."""

from __future__ import annotations

from functools import partial

import moderngl
import numpy as np

from .camera import Eye, view_matrix
from .gpu.grid_objects import ShownGrid
from .gpu.images import empty
from .gpu.lamps import Lamps
from .gpu.light import LightPass
from .gpu.mesh_objects import PlacedMesh
from .gpu.objects import Objects, Shape, Thing
from .gpu.point_objects import ShownPoints, ShownSet
from .gpu.shadows import ShadowMap
from .gpu.steps import Steps
from .gpu.tiles import TiledPoints
from .look import LIT_EARLY, Material
from .mesh import Mesh
from .placed import Placed
from .shadow_views import ShadowView, shadow_views
from .shot import Shot, material_of


class Lamplighting:
    """Lights shine on things here, before anybody looks at them."""

    def __init__(self, context: moderngl.Context, steps: Steps, objects: Objects, light: LightPass):
        self._gl = context
        self._steps = steps
        self._objects = objects
        self._light = light
        self._shadow_map: ShadowMap | None = None  # made for the first lights that need it

    def hang_up(self, shot: Shot, things: dict[Placed, Thing]) -> Lamps:
        """The lights, with the shadow map of those that cast shadows.

        Spots and corners of meshes need a map even without shadows: only the shaders that look it up know them.
        """
        lights = shot.lights
        early = any(isinstance(p.content, Mesh) and p.content.shading in LIT_EARLY for p in shot.shown)
        if not (early or any(light.shadow or light.is_spot for light in lights)):
            return Lamps(lights, shot.scene.ambient)
        shadow_map = self._shadow_map = self._shadow_map or ShadowMap(self._gl)
        views, spans = shadow_views(lights, shot.scene.extent)
        if views:
            drawn = (things[p] for p in shot.casting)
            shapes = tuple(thing if isinstance(thing, PlacedMesh) else thing.points for thing in drawn)
            self._steps.run("shadows", self._fill_shadow_map, shadow_map, views, shapes)
        return Lamps(lights, shot.scene.ambient, views, spans, shadow_map)

    def _fill_shadow_map(self, shadow_map: ShadowMap, views: list[ShadowView], shapes: tuple[Shape, ...]) -> None:
        if shadow_map.fit(views):
            self._steps.forget("tile")
        for k, view in enumerate(views):
            if self._steps.is_new("tile", view, shapes, of=k):
                tile = shadow_map.tile(k)
                for shape in shapes:
                    self._objects.add_shadow(tile, shape, view.eye)

    def light_points(self, shot: Shot, things: dict[Placed, Thing], lamps: Lamps) -> None:
        """Lights the points themselves, for shading models that mix their light; in the axes of their object."""
        for p in shot.shown:
            thing = things[p]
            if isinstance(thing, TiledPoints):
                if thing.shading in LIT_EARLY:
                    some = partial(self._light_some, material=material_of(p), eye=shot.eye, lamps=lamps)
                    thing.light_with(lambda part, some=some: self._steps.always("light", some, part))
                continue
            for view in thing.views if isinstance(thing, ShownSet) else (thing,):
                if isinstance(view, ShownPoints | ShownGrid) and view.light:
                    self._steps.always("light", self._light_some, view, material_of(p), shot.eye, lamps)

    def _light_some(self, thing: ShownPoints | ShownGrid, material: Material, eye: Eye, lamps: Lamps) -> None:
        points, light = thing.points, thing.light
        assert light is not None
        viewer = view_matrix(eye.pose, points.pose)[:3, 3]
        empty(light.target, points.surface.window)  # beside the points values are weighted by 0, but must be defined
        self._light.draw(
            light.target, points.surface.texture, thing.colors.texture, points.source, lamps.seen_from(points.pose),
            np.array([material.strengths]), (viewer, points.scale), certainty=points.surface.certainty,
        )  # fmt: skip
        light.raise_version()

    def release(self) -> None:
        if self._shadow_map is not None:
            self._shadow_map.release()
