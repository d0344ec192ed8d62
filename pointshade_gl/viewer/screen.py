"""Draws the window: the renderer's picture, the light's marker, text and the panel."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..gpu.output.present import Marker, PresentPass
from ..rendering.renderer import Renderer
from ..scene.orbit_state import marker_place
from .controller import BAR
from .events import Effect
from .history import Moment
from .keys import KEYS
from .messages import draw_message, draw_strip, draw_table
from .mouse import MOUSE
from .panel import Panel
from .panel_sections import Facts
from .picture import Picture
from .playing import Strip
from .window import Window

MARKER = 7.0  # radius, pixels at scale 1
BESIDE = 3  # pixels at scale 1 by which a double click may miss a surface: sensors leave holes
HELP = ("mouse", MOUSE), ("keys", tuple((key.label, key.says) for key in KEYS))


class Overlay(NamedTuple):
    """What lies over the picture.

    message    "" if there is none
    is_marked  the light's marker is shown, if there is light
    strip      of the timeline; None: there is none
    taken      pixels at the right that the panel takes
    scale      of everything, also of the panel
    """

    message: str
    is_marked: bool
    strip: Strip | None
    help: bool
    panel: bool
    taken: int
    scale: float


class Screen:
    """Owns all OpenGL objects of a window."""

    def __init__(self, window: Window):
        self.window = window
        with window:
            self.gl = moderngl.create_context(require=330, context=window)  # type: ignore[reportArgumentType]
            self.renderer = Renderer(self.gl)
            self._present = PresentPass(self.gl)
        self._drawings: dict[str, tuple[Any, moderngl.Texture]] = {}
        self._panel: Panel | None = None

    @property
    def panel(self) -> Panel:
        """The panel, made on first use, and again for a screen of another scale. Raises ImportError without `gui`."""
        if self._panel is None or self._panel.scale != self.window.scale:
            with self.window:
                if self._panel is not None:
                    self._panel.release()
                self._panel = Panel(self.window)
        return self._panel

    def draw(self, picture: Picture, over: Overlay, facts: Facts) -> tuple[Moment, list[Effect]]:
        """Redraw the whole window, and return what the user chose in the panel."""
        camera, chosen = picture.camera, (picture.now, [])
        self.renderer.steps.timed = over.panel
        with self.window:
            drawn = self.renderer.draw(picture.request(facts.samples[0], facts.samples[0] > 1 or facts.samples[1] == 1))
            self.renderer.steps.always("present", self._show, drawn, picture, over)
            if over.panel:
                self.gl.screen.viewport = (0, 0, camera.width, camera.height)
                chosen = self.panel.draw(picture, facts)
            self.window.swap()
        return chosen

    def read(self, picture: Picture, samples: int) -> NDArray[np.uint8]:
        """Return the picture without marker and text: (h, w, 4) uint8."""
        with self.window:
            return self.renderer.render(picture.request(samples))

    def find_surface(self, picture: Picture, x: float, y: float) -> tuple[float, float, float] | None:
        """Return the point that the window shows at a pixel, or next to it: view axes; None if there is none."""
        camera = picture.camera
        with self.window:
            found = self.renderer.find_surface(x, y, camera, picture.pose, round(BESIDE * self.window.scale))
        if found is None:
            return None
        u, v, z = found
        return (u - camera.cx) / camera.fx * z, (v - camera.cy) / abs(camera.fy) * z, z

    def release(self) -> None:
        with self.window:
            if self._panel is not None:
                self._panel.release()
            for _, texture in self._drawings.values():
                texture.release()
            self._present.release()
            self.renderer.release()
        self.gl.release()  # closes the window, too

    def _marker(self, picture: Picture) -> Marker | None:
        state, camera = picture.now.state, picture.camera
        if not state.is_lit:
            return None
        x, y = marker_place(state, picture.now.stage, camera)
        radius = MARKER * self.window.scale
        x, y = min(max(x, radius), camera.width - radius), min(max(y, radius), camera.height - radius)
        return Marker(x, y, radius, state.light_color, state.is_behind)

    def _show(self, drawn: Any, picture: Picture, over: Overlay) -> None:
        """Marker and text over what was drawn."""
        self._present.draw(self.gl.screen, drawn, self._marker(picture) if over.is_marked else None)
        camera, scale, above = picture.camera, over.scale, 0
        if over.strip:
            above, wide = round(BAR * scale), max(camera.width - over.taken, 1)
            drawing = self._drawing("strip", draw_strip, *over.strip, scale, wide, above)
            self._present.lay_over(self.gl.screen, drawing, 0, 0)
        if over.message:
            margin = round(10 * scale)
            line = self._drawing("message", draw_message, over.message, scale, max(camera.width - 2 * margin, 1))
            self._present.lay_over(self.gl.screen, line, margin, margin + above)
        if over.help:
            table = self._drawing("help", draw_table, HELP, scale, camera.width, camera.height)
            x, y = (camera.width - table.width) // 2, (camera.height - table.height) // 2
            self._present.lay_over(self.gl.screen, table, x, y)

    def _drawing(self, name: str, draw: Callable[..., NDArray[np.uint8]], *arguments: Any) -> moderngl.Texture:
        """A texture of draw(*arguments), drawn again only when the arguments change."""
        if name in self._drawings:
            before, texture = self._drawings[name]
            if before == arguments:
                return texture
            self._drawings.pop(name)[1].release()
        texture = self._present.upload(draw(*arguments))
        self._drawings[name] = arguments, texture
        return texture
