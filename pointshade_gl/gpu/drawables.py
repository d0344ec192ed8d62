"""Draws objects of every kind (splats, grids, meshes, clouds), each by its own passes, into views and shadow maps."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import Any

import moderngl

from ..scene.camera import Eye
from ..scene.node import Placed
from ..scene.objects import Mesh
from .clouds.cloud_objects import CloudObjects, PlacedCloud
from .clouds.splat_layer import SplatLayer
from .core.images import Owner
from .core.steps import Steps
from .core.view_images import Drawable, Target
from .meshes.mesh_objects import Grid, GridObjects, MeshObjects, PlacedMesh, ShownGrid
from .points.point_objects import PointObjects, Points, PointSet, ShownPoints
from .points.rasterizers import Rasterizers
from .points.tiles import TiledPoints
from .shading.light_set import ShadowTile

# A new kind of object is described beside scene/objects.py, may be placed by scene/node.py, and has its passes and its
# Drawable beside meshes/mesh_objects.py. pipeline/gpu_scene.py puts it on the GPU; files/gltf/write_gltf.py and
# page/page_file.py save it.
Drawables = dict[Placed, Drawable]
Shape = Points | Grid | PointSet | TiledPoints | PlacedMesh | PlacedCloud  # all of an object that its shadow depends on


class Objects(Owner):
    """Draws objects, each by the passes of its kind. Those of grids, meshes and clouds are made when first needed."""

    def __init__(self, context: moderngl.Context, steps: Steps, rasterizers: Rasterizers):
        super().__init__(context)
        self._steps = steps
        self._can_compute, self._is_software = rasterizers.can_compute, rasterizers.is_software
        self.points = self._keep(PointObjects(context, rasterizers))

    @cached_property
    def grids(self) -> GridObjects:
        return self._keep(GridObjects(self._context, self._can_compute, self._is_software))

    @cached_property
    def clouds(self) -> CloudObjects:
        return self._keep(CloudObjects(self._context))

    @cached_property
    def splats(self) -> SplatLayer:
        return self._keep(SplatLayer(self._context))

    @cached_property
    def meshes(self) -> MeshObjects:
        return self._keep(MeshObjects(self._context))

    def find_triangles(self, grid: Grid) -> None:
        """Find which triangles of a grid exist, unless that is known."""
        self._steps.run("triangles", self.grids.find_triangles, grid, of=grid.surface)

    def keep_only(self, meshes: Iterable[Mesh]) -> None:
        """Free all other meshes."""
        if "meshes" in vars(self) and (unused := self.meshes.keep_only(meshes)):
            self._steps.forget(of=unused)

    def add_shadow(self, tile: ShadowTile, shape: Shape, eye: Eye) -> None:
        """Draw the depth of an object into a shadow map. eye: the light's camera."""
        shape.add_shadow(self, tile, eye)
        self._steps.counts[shape.kind] += shape.several

    def add_surface(self, target: Target, thing: Drawable, eye: Eye, number: int, lights: dict[str, Any]) -> None:
        """Draw an object's visible surfaces, with the number of its material. lights: if it is lit as it is drawn."""
        thing.add_surface(self, target, eye, number, lights)
        self._steps.counts[thing.shape.kind] += thing.shape.several

    def kind_of(self, thing: ShownPoints | ShownGrid) -> PointObjects | GridObjects:
        """Return the passes that draw such an object when it is alone."""
        return self.grids if isinstance(thing, ShownGrid) else self.points
