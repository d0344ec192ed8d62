"""Draws pictures of surfaces whose colours are no light, and finds the range of what they show."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...scene.camera import Camera
from ...scene.values import SHOWS, ColorScale
from ..core.canvas import Canvas
from ..core.images import Fitted, Image, empty
from ..core.passes import FullscreenPasses
from ..core.view_images import SurfaceImage

LONGEST = 96  # pixels of the longer side of the copy that is read


class SurfaceColorsPass(FullscreenPasses):
    """Colours the pixels of a view by their normals, their depth or their certainty."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._copy = self._keep(Fitted(context, Image))

    def draw(self, canvas: Canvas, surfaces: SurfaceImage, camera: Camera, scale: ColorScale) -> None:
        """Draw the visible surfaces onto a canvas."""
        constants = {"SHOW": SHOWS.index(scale.show) - 1, "LINEAR": int(canvas.linear)}
        colors = self.fullscreen("output/surface_colors.frag", None, **constants)
        is_normals = scale.show == "normals"
        inputs = {"upwards": -float(np.sign(camera.fy))} if is_normals else {"range": scale.even}
        with canvas.opened(surfaces.window) as image:
            colors.draw(image, {"surface_map": surfaces.surface}, **inputs)

    def read_depths(self, surfaces: SurfaceImage) -> NDArray[np.float32]:
        """Return some of the depths that a view shows, (n,), evenly chosen: few pixels leave the GPU."""
        shrunk = min(LONGEST / max(surfaces.size), 1.0)
        size = max(round(surfaces.size[0] * shrunk), 1), max(round(surfaces.size[1] * shrunk), 1)
        copy = self._copy.fit(size)
        empty(copy.target)
        sample = self.fullscreen("points/surface_samples.frag")
        sample.draw(copy.target, {"copied_map": surfaces.surface}, cells=size)
        depth = np.abs(copy.read()[..., 3])
        return depth[depth > 0]
