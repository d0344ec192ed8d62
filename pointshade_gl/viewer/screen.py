"""Draws the window: the renderer's picture, the light's marker, text and the panel."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..gpu.context.software_driver import return_freed_memory
from ..gpu.core.steps import Steps
from ..gpu.shading.present import Marker, PresentPass
from ..renderer.renderer import Renderer
from ..scene.orbit import marker_place
from .controller import BAR, MOUSE
from .events import Effect
from .keys import KEYS
from .overlay import draw_message, draw_readout, draw_strip, draw_table, legend, values_of
from .panel import Panel
from .panel_sections import PanelFacts
from .picture import ShownPicture
from .playback import TimelineBar
from .state import Snapshot
from .window import Window

MARKER = 7.0  # radius, pixels at scale 1
BESIDE = 3  # pixels at scale 1 by which a double click may miss a surface: sensors leave holes
HELP = ("mouse", MOUSE), ("keys", tuple((key.label, key.says) for key in KEYS))
Readout = tuple[tuple[str, str, str] | None, tuple[str, ...]]  # what colours stand for, and the values under the mouse


class Overlay(NamedTuple):
    """What lies over the picture.

    message    "" if there is none
    is_marked  the light's marker is shown, if there is light
    strip      of the timeline; None: there is none
    covered    pixels at the right that the panel stands on: nothing else is there
    scale      of everything, also of the panel
    pointer    pixel whose values are shown; None: of none
    """

    message: str
    is_marked: bool
    strip: TimelineBar | None
    help: bool
    panel: bool
    covered: int
    scale: float
    pointer: tuple[int, int] | None = None


class Screen:
    """Owns all OpenGL objects of a window.

    The renderer has a context of its own, so that a thread can have it for a while: `lend`. Meanwhile the window shows
    the last picture.
    """

    def __init__(self, window: Window):
        self.window, beside = window, window.beside()
        with beside:
            self._beside = moderngl.create_context(require=330, context=beside)  # type: ignore[reportArgumentType]
            self.renderer = Renderer(self._beside)
        with window:
            self.gl = moderngl.create_context(require=330, context=window)  # type: ignore[reportArgumentType]
            self._present = PresentPass(self.gl)
            self._steps = Steps(self.gl, self.renderer.context.is_software)
        self._drawings: dict[str, tuple[Any, moderngl.Texture]] = {}
        self._drawn: moderngl.Texture | None = None  # by the renderer
        self._readout: Readout = None, ()
        self._last: tuple[ShownPicture, int] | None = None  # what that shows, of how many samples
        self._kept: moderngl.Texture | None = None  # a copy of that, while the renderer is lent
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

    def draw(self, picture: ShownPicture, over: Overlay, facts: PanelFacts) -> tuple[Snapshot, list[Effect]]:
        """Redraw the whole window, and return what the user chose in the panel. While the renderer is lent, the picture
        is the last one, with marker, text and panel as they are now."""
        self._steps.timed = over.panel
        if self._kept is None:
            samples, most = facts.samples
            self.renderer.steps.timed = over.panel
            with self.renderer.context.in_use():
                self._drawn = self.renderer.draw(picture.request(samples, samples > 1 or most == 1))
                self.renderer.steps.finish()  # before the window's context reads it
            values: tuple[str, ...] = ()
            if over.pointer is not None:
                found = self.renderer.read_surface(*over.pointer, picture.camera, picture.pose)
                values = values_of(picture, *over.pointer, found)
            self._last, self._readout = (picture, samples), (legend(self.renderer.color_scale), values)
        with self.window:
            self._steps.always("present", self._show, self._kept or self._drawn, picture, over)
            chosen = picture.now, []
            if over.panel:
                self.gl.screen.viewport = (0, 0, picture.camera.width, picture.camera.height)
                chosen = self.panel.draw(picture, facts._replace(laps=self.renderer.steps.laps | self._steps.laps))
            if over.help:  # beside the panel, and over what is left of it while it is collapsed
                wide, high = max(picture.camera.width - over.covered, 1), picture.camera.height
                table = self._drawing("help", draw_table, HELP, over.scale, wide, high)
                self._present.lay_over(self.gl.screen, table, (wide - table.width) // 2, (high - table.height) // 2)
            self.window.swap()
        return chosen

    def lend(self) -> Renderer:
        """Return the renderer for another thread, whose `renderer.context.move_here()` takes it. See `take_back`."""
        pixels = np.zeros((1, 1, 4), np.uint8) if self._last is None else self.read(*self._last)
        with self.window:
            self._kept = self._present.upload(pixels)
        return self.renderer

    def take_back(self) -> None:
        """Have the renderer again: the other thread has left it."""
        self.renderer.context.move_here()
        if self._kept is not None:
            with self.window:
                self._kept.release()
        self._kept = None
        if self.renderer.context.is_software:
            return_freed_memory()  # malloc keeps some for each thread

    def read(self, picture: ShownPicture, samples: int) -> NDArray[np.uint8]:
        """Return the picture without marker and text: (h, w, 4) uint8."""
        return self.renderer.render(picture.request(samples))

    def find_surface(self, picture: ShownPicture, x: float, y: float) -> tuple[float, float, float] | None:
        """Return the point that the window shows at a pixel, or next to it: view axes; None if there is none."""
        camera = picture.camera
        found = self.renderer.find_surface(x, y, camera, picture.pose, round(BESIDE * self.window.scale))
        if found is None:
            return None
        u, v, z = found
        return (u - camera.cx) / camera.fx * z, (v - camera.cy) / abs(camera.fy) * z, z

    def release(self) -> None:
        self.renderer.release()
        self._beside.release()
        with self.window:
            if self._panel is not None:
                self._panel.release()
            for _, texture in self._drawings.values():
                texture.release()
            self._present.release()
        self.gl.release()  # closes the window, too

    def _marker(self, picture: ShownPicture) -> Marker | None:
        state, camera = picture.now.state, picture.camera
        if not state.is_lit:
            return None
        x, y = marker_place(state, picture.now.stage, camera)
        radius = MARKER * self.window.scale
        x, y = min(max(x, radius), camera.width - radius), min(max(y, radius), camera.height - radius)
        return Marker(x, y, radius, state.light_color, state.is_behind)

    def _show(self, drawn: Any, picture: ShownPicture, over: Overlay) -> None:
        """Marker and text over what was drawn."""
        self._present.draw(self.gl.screen, drawn, self._marker(picture) if over.is_marked else None)
        scale, wide = over.scale, max(picture.camera.width - over.covered, 1)
        above, margin, drawings = 0, round(10 * scale), []
        if over.strip:
            drawings.append((0, self._drawing("strip", draw_strip, *over.strip, scale, wide, round(BAR * scale))))
        if any(self._readout):
            drawings.append((0, self._drawing("readout", draw_readout, *self._readout, scale, wide)))
        if over.message:
            line = self._drawing("message", draw_message, over.message, scale, max(wide - 2 * margin, 1))
            drawings.append((margin, line))
        for aside, drawing in drawings:  # from the lower edge up
            self._present.lay_over(self.gl.screen, drawing, aside, aside + above)
            above += drawing.height

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
