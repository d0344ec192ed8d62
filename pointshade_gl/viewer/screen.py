"""Draws the window: the renderer's picture, the light's marker, text and the panel."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..gpu.core.steps import Lap
from ..gpu.output.present import Marker, PresentPass
from ..rendering.renderer import Renderer
from ..scene.camera import Camera
from ..scene.graph import Scene
from ..scene.orbit_state import State, marker_place
from ..scene.orbit_target import Stage
from ..scene.shading_override import shaded
from .keys import KEYS
from .mouse import MOUSE
from .panel import Panel
from .text import draw_message, draw_strip, draw_table
from .timeline import HEIGHT
from .views import Views
from .window import Window

if TYPE_CHECKING:
    from .viewer import Viewer

MARKER = 7.0  # radius, pixels at scale 1
BESIDE = 3  # pixels at scale 1 by which a double click may miss a surface: sensors leave holes
HELP = ("mouse", MOUSE), ("keys", tuple((key.label, key.says) for key in KEYS))


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
        self._present_lap: Lap | None = None

    @property
    def panel(self) -> Panel:
        """The panel, made on first use, and again for a screen of another scale. Raises ImportError without `gui`."""
        if self._panel is None or self._panel.scale != self.window.scale:
            with self.window:
                if self._panel is not None:
                    self._panel.release()
                self._panel = Panel(self.window)
        return self._panel

    def draw(self, viewer: Viewer, camera: Camera, message: str, marked: bool, samples: int) -> None:
        """Redraws the whole window."""
        state = viewer.state
        self.renderer.steps.timed = state.panel
        with self.window:
            picture = self.renderer.draw(**render_arguments(viewer, camera), samples=samples)
            began = time.perf_counter()
            marker = self._marker(state, viewer.stage, camera) if marked else None
            self._present.draw(self.gl.screen, picture, marker)
            self._draw_text(message, state.help, camera, self._draw_strip(viewer, camera))
            if state.panel:
                self.gl.finish()
                self._present_lap = Lap((time.perf_counter() - began) * 1e3, None)
                self.gl.screen.viewport = (0, 0, camera.width, camera.height)
                self.panel.draw(viewer, camera.width, camera.height, self._present_lap)
            self.window.swap()

    def read(self, viewer: Viewer, camera: Camera, samples: int) -> NDArray[np.uint8]:
        """The picture without marker and text: (h, w, 4) uint8."""
        with self.window:
            return self.renderer.render(**render_arguments(viewer, camera), samples=samples)

    def find_surface(self, viewer: Viewer, camera: Camera, x: float, y: float) -> tuple[float, float, float] | None:
        """The point that the window shows at a pixel, or next to it: view axes; None if there is none."""
        pose = viewer.pose @ viewer.state.pose(viewer.stage)
        with self.window:
            found = self.renderer.find_surface(x, y, camera, pose, round(BESIDE * self.window.scale))
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

    def _marker(self, state: State, stage: Stage, camera: Camera) -> Marker | None:
        if not state.is_lit:
            return None
        x, y = marker_place(state, stage, camera)
        radius = MARKER * self.window.scale
        x, y = min(max(x, radius), camera.width - radius), min(max(y, radius), camera.height - radius)
        return Marker(x, y, radius, state.light_color, state.is_behind)

    def _draw_strip(self, viewer: Viewer, camera: Camera) -> int:
        """The timeline, if frames play: its height in pixels."""
        strip, scale = viewer.strip, self.window.scale
        if strip is None:
            return 0
        high, wide = round(HEIGHT * scale), max(camera.width - viewer.panel_width, 1)
        drawing = self._drawing("strip", draw_strip, *strip, scale, wide, high)
        self._present.lay_over(self.gl.screen, drawing, 0, 0)
        return high

    def _draw_text(self, message: str, with_help: bool, camera: Camera, above: int) -> None:
        """above: how many pixels at the bottom are taken"""
        scale = self.window.scale
        if message:
            margin = round(10 * scale)
            line = self._drawing("message", draw_message, message, scale, max(camera.width - 2 * margin, 1))
            self._present.lay_over(self.gl.screen, line, margin, margin + above)
        if with_help:
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


def render_arguments(viewer: Viewer, camera: Camera) -> dict[str, Any]:
    """The arguments of `Renderer.render` for what a viewer shows."""
    state, frame = viewer.state, viewer.frame
    held = state.light(viewer.stage, viewer.pose, viewer.held)
    lights = [replace(light, shadow=light.shadow and state.shadows) for light in (held, *viewer.lights)]
    common = {"camera": camera, "pose": viewer.pose @ state.pose(viewer.stage), "light": lights}
    if isinstance(frame, Scene):
        shading = "none" if not state.lit else state.look.shading if state.look.shading != "phong" else None
        return common | {"frame": shaded(frame, shading)}
    shown = state if state.lit else state.with_look(shading="none", unlight=False, remove_highlights=False)
    return common | {"frame": frame.shown if isinstance(frame, Views) else frame, **shown.look.options}
