"""The last passes: they average samples, draw the picture into a window, and colours that are no light."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...scene.camera import Camera
from ...scene.settings import OutputSettings
from ...scene.values import SHOWS, ColorScale
from ..context.caller_state import BLEND, enabled
from ..core.images import Fitted, Image, allocate, empty
from ..core.programs import AdditiveBlend, FullscreenPasses
from ..core.view_images import Canvas, SurfaceImage, Target


class PresentPass(FullscreenPasses):
    """Draws into a framebuffer whose first row is at the bottom, as a window's is."""

    def draw(self, window: moderngl.Framebuffer, picture: moderngl.Texture, size: tuple[int, int]) -> None:
        """Draw the picture over the whole window, of a size; where its alpha is 0 the background shows."""
        window.viewport = (0, 0, *size)
        self.fullscreen("output/present.frag").draw(window, {"picture": picture}, size=tuple(map(float, size)))

    def lay_over(self, window: moderngl.Framebuffer, drawing: moderngl.Texture, x: int, y: int) -> None:
        """Draw an overlay with straight alpha, its lower left pixel at (x, y) of the window, y upwards."""
        window.viewport = (x, y, *drawing.size)
        self._context.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA
        with enabled(self._context, BLEND):
            self.fullscreen("output/overlay.frag").draw(window, {"drawing": drawing}, corner=(x, y))

    def upload(self, drawing: np.ndarray) -> moderngl.Texture:
        """Return a texture of a (h, w, 4) uint8 drawing; the caller releases it."""
        size, make = (drawing.shape[1], drawing.shape[0]), self._context.texture
        return allocate(self._context, make, size, 4, np.ascontiguousarray(drawing))


class ResolveSamplesPass(FullscreenPasses):
    """Averages samples in linear light, weighted by coverage."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._adding = AdditiveBlend(context)
        self._alpha = self._keep(Fitted(context, Image))

    def canvas(self, sums: Image) -> Canvas:
        """What samples are drawn on, to be added up: the surfaces, or the ground, of SampleSums."""
        return Canvas(sums.target, self._adding)

    def resolve(self, target: Target, finish: OutputSettings, is_occluded: bool) -> None:
        """Average the samples into the picture. is_occluded: whether what is near hides light from all around."""
        self._draw(target, target.picture, finish, is_occluded)

    def read_alpha(self, target: Target, is_occluded: bool) -> NDArray[np.float32]:
        """Return (h, w) the share of each pixel that surfaces, and shadows on the ground, cover."""
        image = self._alpha.fit(target.size)
        self._draw(target, image.target, OutputSettings(target.samples.count), is_occluded)
        return image.read()[..., 3]

    def _draw(self, target: Target, image: moderngl.Framebuffer, finish: OutputSettings, is_occluded: bool) -> None:
        behind = (0.0,) * 4 if finish.behind is None else (*finish.behind, 1.0)
        sums = {"sums": target.samples.surfaces.texture}
        if target.samples.has_ground:
            sums["grounds"] = target.samples.ground.texture
        empty(image)
        ground, rolls_off = int(target.samples.has_ground) * (1 + is_occluded), int(finish.tone == "neutral")
        program = self.fullscreen("output/resolve_samples.frag", GROUND=ground, TONE=rolls_off)
        program.draw(image, sums, count=float(finish.samples), background=behind)


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
