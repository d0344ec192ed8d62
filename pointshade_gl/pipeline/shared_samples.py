"""Draws all samples of a picture at once in the pixels where they differ only in the colour of one surface."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from ..gpu.core.images import depth_tested, empty, empty_part
from ..gpu.core.programs import FullscreenPasses
from ..gpu.core.steps import Steps
from ..gpu.core.view_images import TILE, Target
from ..gpu.drawables import Drawables, Objects
from ..gpu.meshes.mesh_objects import ShownGrid
from ..gpu.points.point_objects import ShownPoints
from ..gpu.shading.light_pass import LightPass
from ..gpu.shading.light_set import LightSet
from ..scene.visible import VisibleScene
from .frame_pass import single_object

WORTH = 1 << 23  # pixels of all samples: with fewer, drawing them takes less time than the programs made for this
AT_FRAME = 1e-6  # of the scene's radius: so near is a viewer where the frame's camera was
BAND = 16  # part of the view's width that is tried first
MOST = 0.5  # of its tiles that may be left open: else nothing is won


class SharedSamples(FullscreenPasses):
    """Looks for pixels that show one smooth, evenly lit surface, as the frame's own camera saw it, or nothing.

    Their samples share splats, normals and light. Only the frame's colours are averaged.
    """

    def __init__(self, context: moderngl.Context, steps: Steps, objects: Objects, light: LightPass):
        super().__init__(context)
        self._steps, self._objects, self._light = steps, objects, light

    def draw(
        self, target: Target, visible: VisibleScene, drawables: Drawables, light_set: LightSet, samples: int
    ) -> bool:
        """Add up the samples of such pixels in an empty sum. Return whether there are many; the others are open."""
        thing = single_object(visible, drawables, light_set)
        is_large = samples * target.size[0] * target.size[1] >= WORTH
        if thing is None or not is_large or not _can_share(thing, visible):
            return False
        kind, eye = self._objects.kind_of(thing), visible.eye
        self._steps.run("splats", kind.draw_splats, target.splats, thing.points, eye)
        return self._steps.always("shared", self._share, target, thing, visible, light_set, samples)

    def _share(
        self, target: Target, thing: ShownPoints | ShownGrid, visible: VisibleScene, light_set: LightSet, samples: int
    ) -> bool:
        """Try a band first: where all is rough, nothing is shared, and the sum stays empty."""
        whole = left, top, width, height = target.splats.window
        target.splats.window = left + width // 2, top, width // BAND, height
        self._fill(target, thing, visible, light_set, samples, is_trial=True)
        is_worth = self._open_share(target) <= MOST
        target.splats.window = whole
        if is_worth:
            self._fill(target, thing, visible, light_set, samples)
        else:
            target.samples.clear(target.samples.has_ground)
        return is_worth

    def _open_share(self, target: Target) -> float:
        """Return the share of tiles in the window that are open."""
        left, top, width, height = (edge // TILE for edge in target.splats.window)
        tiles = target.samples.active.read()[top : top + height, left : left + width]
        return float(tiles.mean()) if tiles.size else 1.0

    def _fill(
        self, target: Target, thing: ShownPoints | ShownGrid, visible: VisibleScene, light_set: LightSet, samples: int,
        is_trial: bool = False,
    ) -> None:  # fmt: skip
        """Give the pixels of the window that are not open their sum."""
        kind: Any = self._objects.kind_of(thing)
        eye, surfaces, lit = visible.eye, target.surfaces, target.samples.shades
        kind.draw_surface(surfaces, target.splats, thing, eye, samples)
        clear = empty_part if is_trial else empty
        clear(lit.target, surfaces.window)
        self._light.draw(
            lit.target, surfaces.surface, surfaces.albedo, eye.camera, light_set.seen_from(eye.pose),
            np.array([visible.materials[0].strengths]), linear=True, has_doubts=surfaces.has_doubts,
            visibility=surfaces.visibility if surfaces.has_visibility else None, split=True,
        )  # fmt: skip
        target.samples.open_surfaces.depth_mask = True
        clear(target.samples.open_surfaces, surfaces.window)
        self._find_open(target, samples)

    def _find_open(self, target: Target, samples: int) -> None:
        """Give the pixels that are not open the sum of all samples."""
        sums, surfaces = target.samples, target.surfaces
        shade, shine = sums.shades.textures
        maps = {"albedo_map": surfaces.albedo, "shade_map": shade, "shine_map": shine}
        with depth_tested(self._context, sums.open_surfaces, surfaces.window):
            self.fullscreen("output/shared_pixels.frag").draw(sums.open_surfaces, maps, count=float(samples))
        tiles = self.fullscreen("output/active_tiles.frag")
        tiles.draw(sums.active.target, {"open_map": sums.open}, side=TILE)


def _can_share(thing: ShownPoints | ShownGrid, visible: VisibleScene) -> bool:
    """Return whether each pixel is lit by itself, and is seen as the frame's own camera saw it, or larger."""
    points, camera = thing.points, visible.eye.camera
    away = float(np.linalg.norm(visible.eye.pose[:3, 3] - points.pose[:3, 3]))
    larger = min(abs(camera.fx / points.source.fx), abs(camera.fy / points.source.fy))
    return thing.shading == "phong" and away <= AT_FRAME * visible.scene.bounds[1] and larger > 1 - 1e-3
