"""Draws objects of every kind (splats, grids, meshes), each by its own pass, into views and into shadow maps."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import Any

import moderngl

from ..scene.camera import Eye
from ..scene.node import Placed
from ..scene.objects import Mesh
from .clouds.cloud_objects import CloudObjects, PlacedCloud
from .core.images import Owner
from .core.steps import Steps
from .core.view_images import Target
from .meshes.mesh_objects import Grid, GridObjects, MeshObjects, PlacedMesh, ShownGrid
from .points.point_objects import PointObjects, Points, PointSet, ShownPoints, ShownSet
from .points.rasterizers import Rasterizers
from .points.tiles import TiledPoints
from .shading.light_set import ShadowTile

# A new kind of object is described beside scene/objects.py, may be placed by scene/node.py, has its passes beside
# meshes/mesh_objects.py and its type here. It needs a branch wherever this module, pipeline/gpu_scene.py,
# scene/visible.py, viewer/screen.py and files/gltf/write_gltf.py ask whether something is a mesh: all others count as
# point objects.
Drawable = ShownPoints | ShownGrid | ShownSet | TiledPoints | PlacedMesh | PlacedCloud
Drawables = dict[Placed, Drawable]
Shape = Points | Grid | PointSet | TiledPoints | PlacedMesh | PlacedCloud  # all of an object that its shadow depends on


def shape_of(thing: Drawable) -> Shape:
    """Return all of a drawable that its shadow depends on."""
    return thing if isinstance(thing, PlacedMesh | PlacedCloud) else thing.points


class Objects(Owner):
    """Draws objects, each by the passes of its kind. Those of grids and meshes are made when first needed."""

    def __init__(self, context: moderngl.Context, steps: Steps, rasterizers: Rasterizers):
        super().__init__(context)
        self._steps = steps
        self._can_compute, self._is_software = rasterizers.can_compute, rasterizers.is_software
        self.points = self._keep(PointObjects(context, rasterizers))
        self._meshes: MeshObjects | None = None

    def find_triangles(self, grid: Grid) -> None:
        """Find which triangles of a grid exist, unless that is known."""
        self._steps.run("triangles", self._grids.find_triangles, grid, of=grid.surface)

    def keep_only(self, meshes: Iterable[Mesh]) -> None:
        """Free all other meshes."""
        if self._meshes and (unused := self._meshes.keep_only(meshes)):
            self._steps.forget(of=unused)

    def add_shadow(self, tile: ShadowTile, shape: Shape, eye: Eye) -> None:
        """Draw the depth of an object into a shadow map. eye: the light's camera."""
        if isinstance(shape, PlacedMesh):
            self._mesh_objects().add_shadow(tile, shape, eye)
        elif isinstance(shape, PlacedCloud):
            self._clouds.add_shadow(tile, shape, eye)
        elif isinstance(shape, Grid):
            self._grids.add_shadow(tile, shape, eye)
        elif isinstance(shape, TiledPoints):
            for part in shape.each(lit=False):
                self.points.add_shadow(tile, part.points, eye)
        else:
            self.points.add_shadow(tile, shape, eye)
        self._count(shape)

    def add_surface(self, target: Target, thing: Drawable, eye: Eye, number: int, lights: dict[str, Any]) -> None:
        """Draw an object's visible surfaces, with the number of its material. lights: if it is lit as it is drawn."""
        if isinstance(thing, PlacedMesh):
            self._mesh_objects().add_surface(target.surfaces, thing, eye, number, lights)
        elif isinstance(thing, PlacedCloud):
            self._clouds.add_surface(target.surfaces, thing, eye, number)
        elif isinstance(thing, ShownGrid):
            self._grids.add_surface(target, thing, eye, number, lights)
        elif isinstance(thing, ShownSet):
            self.points.add_set(target, thing, eye, number)
        elif isinstance(thing, TiledPoints):
            for part in thing.each():
                self.points.add_surface(target, part, eye, number)
        else:
            self.points.add_surface(target, thing, eye, number)
        self._count(shape_of(thing))

    def kind_of(self, thing: ShownPoints | ShownGrid) -> PointObjects | GridObjects:
        """Return the passes that draw such an object when it is alone."""
        return self._grids if isinstance(thing, ShownGrid) else self.points

    @cached_property
    def _grids(self) -> GridObjects:
        return self._keep(GridObjects(self._context, self._can_compute, self._is_software))

    @cached_property
    def _clouds(self) -> CloudObjects:
        return self._keep(CloudObjects(self._context))

    def _mesh_objects(self) -> MeshObjects:
        self._meshes = self._meshes or self._keep(MeshObjects(self._context))
        return self._meshes

    def _count(self, shape: Shape) -> None:
        several = len(shape.parts) if isinstance(shape, PointSet) else 1
        several = len(shape.worlds) if isinstance(shape, PlacedMesh) else several
        self._steps.counts["mesh" if isinstance(shape, PlacedMesh | Grid) else "splats"] += several
