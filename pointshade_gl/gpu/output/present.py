"""Draws the finished picture into a window, with a marker for the light and overlays with text."""

from __future__ import annotations

from typing import NamedTuple

import moderngl
import numpy as np

from ..context.raw_gl import BLEND
from ..context.saved_state import enabled
from ..core.memory import allocate
from ..core.passes import FullscreenPasses


class Marker(NamedTuple):
    """The marker of the light: pixels of the picture from its upper left corner, and an sRGB colour from 0 to 1."""

    x: float
    y: float
    radius: float
    color: tuple[float, float, float]
    is_behind: bool


class PresentPass(FullscreenPasses):
    """Draws into a framebuffer whose first row is at the bottom, as a window's is."""

    def draw(self, window: moderngl.Framebuffer, picture: moderngl.Texture, marker: Marker | None) -> None:
        """Draw the picture over the whole window; where its alpha is 0 the background shows."""
        window.viewport = (0, 0, *picture.size)
        place = (0.0, 0.0, 0.0, 0.0) if marker is None else (marker.x, marker.y, marker.radius, float(marker.is_behind))
        color = (0.0, 0.0, 0.0) if marker is None else marker.color
        present = self.fullscreen("output/present.frag")
        present.draw(window, {"picture": picture}, marker=place, marker_color=color)

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
