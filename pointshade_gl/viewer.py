"""The interactive window: the light follows the mouse."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import moderngl

from .camera import Camera
from .frame import Frame
from .gpu.present import Marker, PresentPass
from .images import save_image
from .renderer import Renderer
from .shading import Light
from .viewer_controls import KEYS, MOUSE, Mouse, press_key
from .viewer_events import Event
from .viewer_state import Stage, State, marker_place
from .viewer_text import draw_line, draw_table
from .viewer_window import Window

GREETING = "Move the mouse: the light follows.   Drag to turn.   H for help"
MESSAGE_SECONDS = 3.0
DISPLAY_RATE = 60.0  # frames a second where on_frame moves something


class Viewer:
    """A window on a frame; `run()` shows it until it is closed.

    An application subclasses it and overrides `on_start`, `on_frame`, `on_event`; it changes what is seen by giving
    `state` a new value. The window is drawn anew when that, the frame or its size has changed, and sleeps otherwise.

    Raises ContextError without a display, ValueError and TypeError for options that do not fit.
    """

    def __init__(
        self,
        source: Frame,
        *,
        title: str = "pointshade",
        size: tuple[int, int] | None = None,
        state: State | None = None,
        lights: Sequence[Light] = (),
    ):
        self.frame = source
        self.state = state or State()
        self.lights = tuple(lights)
        self.stage = Stage.of(self.frame)
        self.drawn = 0
        self._mouse = Mouse()
        self._events: list[Event] = []
        self._shown: Any = None
        self._message, self._until = GREETING, float("inf")
        self._drawings: dict[str, tuple[Any, moderngl.Texture]] = {}
        self._animates = type(self).on_frame is not Viewer.on_frame
        self.window = Window(title, size or _window_size(self.frame.camera), self._events.append)
        with self.window:
            self.gl = moderngl.create_context(require=330, context=self.window)  # type: ignore[reportArgumentType]
            self.renderer = Renderer(self.gl)
            self._present = PresentPass(self.gl)
        self._began = time.perf_counter()

    # The seam for applications.
    def on_start(self) -> None:
        """Called once by `run`, with the window open."""

    def on_frame(self, seconds: float) -> None:
        """Called before each picture with the seconds since the start; overridden, it keeps the pictures coming."""

    def on_event(self, event: Event) -> bool | None:
        """Called with each thing that the user did; True keeps it from having its usual effect."""

    def run(self) -> None:
        """Shows the window until it is closed."""
        try:
            self.on_start()
            while not self.window.is_closing:
                self.step()
        finally:
            self.release()

    def step(self, wait: bool = True) -> None:
        """One turn: sleeps until there is something to do, if it may, and draws what has changed."""
        self.window.wait(self._patience() if wait else 0)
        events, self._events[:] = list(self._events), []
        for event in events:
            self.handle(event)
        if self._animates:
            self.on_frame(time.perf_counter() - self._began)
        if self._until < time.perf_counter():
            self._message, self._until = "", float("inf")
        width, height = self.window.picture_size
        if width and height and self._look(width, height) != self._shown:
            self._draw(width, height)

    def handle(self, event: Event) -> None:
        """What the event does: the application's answer first, then ours."""
        if self.on_event(event):
            return
        if event.kind == "refresh":
            self._shown = None
        elif event.kind == "key":
            press_key(self, event.key)
        elif (camera := self.camera) is not None:
            self.state = self._mouse.handle(event, self.state, self.stage, camera)
            self.window.hide_pointer(self.state.light_mode and self._mouse.drag in ("", "light"))

    @property
    def camera(self) -> Camera | None:
        """Who looks: the frame's camera, fitted to the window; None while nothing of the window can be seen."""
        width, height = self.window.picture_size
        return self.frame.camera.fitted(width, height) if width and height else None

    def say(self, text: str) -> None:
        """Shows a line for a few seconds."""
        self._message, self._until = text, time.perf_counter() + MESSAGE_SECONDS

    def quit(self) -> None:
        self.window.close()

    def toggle_panel(self) -> None:
        self.say("no panel yet")

    def pause(self) -> None:
        self.say("a single frame: nothing to play")

    def step_frames(self, direction: str) -> None:
        self.say("a single frame: nothing to step through")

    def save_picture(self) -> Path:
        """Writes what is seen, without marker and text, to a new file in the working directory."""
        path = next(p for k in range(1, 100_000) if not (p := Path(f"pointshade_{k:04d}.png")).exists())
        with self.window:
            save_image(path, self.renderer.render(self.frame, **self._picture()))
        sys.stdout.write(f"{path}\n")
        self.say(f"saved {path}")
        return path

    def release(self) -> None:
        with self.window:
            for _, texture in self._drawings.values():
                texture.release()
            self._present.release()
            self.renderer.release()
            self.gl.release()  # closes the window, too

    def _patience(self) -> float | None:
        """Seconds that the next turn may sleep; None is without end."""
        width, height = self.window.picture_size
        if not (width and height):
            return None
        if self._look(width, height) != self._shown:
            return 0
        now = time.perf_counter()
        if self._animates:
            return 1 / DISPLAY_RATE
        return None if self._until == float("inf") else max(self._until - now, 0.001)

    def _look(self, width: int, height: int) -> tuple[Any, ...]:
        """All that the window's content depends on."""
        return self.state, self.lights, self.frame, width, height, self._message, self._mouse.drag

    def _picture(self) -> dict[str, Any]:
        """The options of `Renderer.render` for what is seen now."""
        state = self.state
        return {
            "light": [state.light(self.stage, self.frame.pose), *self.lights],
            "material": state.material,
            "camera": self.camera,
            "pose": self.frame.pose @ state.pose(self.stage),
            "normals": state.normals,
            "shading": state.shading if state.lit else "none",
            "size": state.size,
            "splat": state.splat,
            "max_depth_step": state.max_depth_step,
        }

    def _draw(self, width: int, height: int) -> None:
        look = self._look(width, height)
        camera = self.frame.camera.fitted(width, height)
        with self.window:
            picture = self.renderer.draw(self.frame, **self._picture())
            screen = self.gl.screen
            self._present.draw(screen, picture, self._marker(camera))
            self._draw_text(screen, width, height)
            self.window.swap()
        self._shown = look
        self.drawn += 1

    def _marker(self, camera: Camera) -> Marker | None:
        state = self.state
        if not state.lit or state.shading == "none" or self._mouse.drag in ("orbit", "pan"):
            return None
        x, y = marker_place(state, self.stage, camera)
        scale = self.window.scale
        margin = 9 * scale
        x, y = min(max(x, margin), camera.width - margin), min(max(y, margin), camera.height - margin)
        return Marker(x, y, 7 * scale, state.light_color, state.is_behind)

    def _draw_text(self, screen: moderngl.Framebuffer, width: int, height: int) -> None:
        scale = self.window.scale
        margin = round(10 * scale)
        if self._message:
            line = self._drawing("message", (self._message, scale), draw_line)
            self._present.lay_over(screen, line, margin, margin)
        if self.state.help:
            sections = ("mouse", MOUSE), ("keys", tuple((key.label, key.says) for key in KEYS))
            table = self._drawing("help", (sections, scale), draw_table)
            self._present.lay_over(screen, table, (width - table.width) // 2, (height - table.height) // 2)

    def _drawing(self, name: str, arguments: tuple[Any, ...], draw: Any) -> moderngl.Texture:
        """A texture of draw(*arguments), made anew when they have changed."""
        if name in self._drawings:
            before, texture = self._drawings[name]
            if before == arguments:
                return texture
            texture.release()
        texture = self._present.upload(draw(*arguments))
        self._drawings[name] = arguments, texture
        return texture


def _window_size(camera: Camera) -> tuple[int, int]:
    """A size in the shape of the camera's pictures: its own, unless that is very small or very large."""
    scale = min(max(1.0, 640 / camera.width), 1280 / camera.width, 960 / camera.height)
    return round(camera.width * scale), round(camera.height * scale)
