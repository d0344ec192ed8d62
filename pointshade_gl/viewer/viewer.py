"""The interactive window: the light follows the mouse."""

from __future__ import annotations

import sys
import time
from collections import deque
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..files.pictures import save_image
from ..frame import Frame
from ..light import Light
from ..renderer import Renderer
from ..scene import Scene
from .controls import Mouse, press_key
from .events import Event
from .panel import MISSING
from .playback import Playback
from .record import RATE, Recorder
from .screen import Screen
from .state import Stage, State
from .window import Window, window_size

GREETING = "Move the mouse: the light follows.   Drag to turn.   H for help"
MESSAGE_SECONDS, GREETING_SECONDS = 4.0, 12.0
DISPLAY_RATE = 60.0  # pictures a second where on_frame keeps them coming


class Viewer:
    """A window on a frame or a stream of frames; `run()` shows it until it is closed.

    source  a Frame, a Sequence of them (a folder's, see `open_source`), anything that `for frame in source:` accepts,
            or a Scene, with its own lights and shadows
    title   of the window
    size    (width, height) of the window in screen coordinates; None follows the frame
    state   what is seen at first: view, light, material, estimator
    lights  the first is the one that the mouse holds, the others stay where they are
    fps     frames of a stream a second; None is as fast as they come
    record  an .mp4 or .gif that becomes a film of what is seen
    panel   opens the panel, if its extra is there

    An application subclasses it and overrides `on_start`, `on_frame`, `on_event`; it changes what is seen by giving
    `state` (or `frame`, `lights`) a new value. The window is drawn anew when one of them or its size has changed, and
    sleeps otherwise. It belongs to the main thread of the process, as windows do.

    Raises ContextError without a display, ValueError, TypeError or OSError for what cannot be shown.
    """

    def __init__(
        self,
        source: Frame | Scene | Iterable[Frame],
        *,
        title: str = "pointshade",
        size: tuple[int, int] | None = None,
        state: State | None = None,
        lights: Sequence[Light] = (),
        fps: float | None = None,
        record: str | Path | None = None,
        panel: bool = False,
    ):
        self._events: list[Event] = []
        self._said: deque[str] = deque()  # by the thread that reads a stream
        self._told: set[str] = set()
        self._mouse = Mouse()
        self._shown: Any = None
        self._animates = type(self).on_frame is not Viewer.on_frame
        self.drawn = 0  # how often the window was drawn
        with ExitStack() as undo:
            self._recorder = None if record is None else Recorder(Path(record), fps or RATE)
            if self._recorder:
                undo.callback(self._recorder.close)
            self._playback = None
            self.frame: Frame | Scene
            self.held: Light | None = None  # the kind of light that the mouse holds; None is a point light
            self.state = state or State()
            if isinstance(source, Frame):
                self.frame = source
            elif isinstance(source, Scene):
                self.frame = source.framed()
                self.state = replace(self.state, shadows=True)
                lights = lights or source.lights or [Light()]
                self.held = lights[0]
            else:
                self._playback = Playback(source, fps, self._said.append)
                undo.callback(self._playback.close)
                self.frame = self._playback.first()
            self.stage = Stage.of(self.frame)
            if lights:
                self.state = self.state.with_light(lights[0], self.stage, self.pose)
            self.lights = tuple(lights[1:])
            size = size or window_size(self._own_camera)
            self.window = Window(title, size, self._events.append)
            undo.callback(self.window.release)
            if self._playback:
                self._playback.wake = self.window.wake
            self.screen = Screen(self.window)
            undo.callback(self.screen.release)
            self._began = self._next_frame = time.perf_counter()
            self._message, self._until = GREETING, self._began + GREETING_SECONDS
            self._film_camera = self._own_camera.fitted(*size)
            if panel:
                self.toggle_panel()
            self._close = undo.pop_all()

    @property
    def renderer(self) -> Renderer:
        """What draws; its `steps` and `choice` tell how."""
        return self.screen.renderer

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
        now = time.perf_counter()
        if self._playback and (frame := self._playback.advance(now)):
            self.frame = frame
        if self._animates:
            self.on_frame(now - self._began)
            self._next_frame = now + 1 / DISPLAY_RATE
        self._expire_message(now)
        if self.camera and (self._look() != self._shown or self._panel_settling()):
            self._draw(self.camera)
        if self._recorder:
            self._recorder.add(time.perf_counter(), lambda: self.screen.read(self, self._film_camera))

    def handle(self, event: Event) -> None:
        """What an event does: to the application first, then to the panel, to us."""
        if self.on_event(event):
            return
        on_panel = self.state.panel and self.screen.panel.handle(event)
        if event.kind == "refresh":
            self._shown = None
        elif event.kind == "key":
            press_key(self, event.key)
        elif self.camera and not on_panel:
            self.state = self._mouse.handle(event, self.state, self.stage, self.camera)
        self.window.hide_pointer(self.state.light_mode and not on_panel and self._mouse.drag in ("", "light"))

    @property
    def camera(self) -> Camera | None:
        """Who looks: the frame's camera, fitted to the window; None while nothing of the window can be seen."""
        width, height = self.window.picture_size
        return self._own_camera.fitted(width, height) if width and height else None

    @property
    def _own_camera(self) -> Camera:
        assert self.frame.camera is not None  # a scene was framed
        return self.frame.camera

    @property
    def pose(self) -> NDArray[np.float64]:
        """(4, 4) camera-to-world of the frame's or the scene's own camera."""
        return np.asarray(self.frame.pose)

    def next_light(self) -> None:
        """Gives the mouse the next light; the one that it held stays where it is."""
        if not self.lights:
            self.say("one light only")
            return
        left = self.state.light(self.stage, self.pose, self.held)
        following, *others = self.lights
        self.lights = (*others, left)
        if isinstance(self.frame, Scene):
            self.held = following
        self.state = self.state.with_light(following, self.stage, self.pose)
        self.say(f"another light of {len(self.lights) + 1}")

    def say(self, text: str) -> None:
        """Shows a line for a few seconds."""
        self._message, self._until = text, time.perf_counter() + MESSAGE_SECONDS

    def quit(self) -> None:
        """Ends `run`."""
        self.window.close()

    def reset(self) -> None:
        """View and light as at the start, round the middle of the frame that is shown."""
        self.stage, self.state = Stage.of(self.frame), self.state.reset_view()

    def toggle_panel(self) -> None:
        """Opens or closes the panel; without its extra says how to get it."""
        try:
            self.screen.panel  # noqa: B018
        except ImportError:
            self.say(MISSING)
        else:
            self.state = replace(self.state, panel=not self.state.panel)
            self.renderer.steps.forget("surface")  # so that there are times to show

    def pause(self) -> None:
        """Pauses a stream or plays on."""
        if self._playback is None:
            self.say("a single frame: nothing to play")
        else:
            self._playback.toggle()
            self.say("paused" if self._playback.is_paused else "playing")

    def step_frames(self, direction: int) -> None:
        """Pauses a stream and goes on by one frame, or back (-1)."""
        if self._playback is None:
            self.say("a single frame: nothing to step through")
        else:
            self.frame = self._playback.step(direction) or self.frame
            self.say(f"frame {self._playback.index}" if self._playback.index >= 0 else "paused")

    def save_picture(self) -> Path | None:
        """Writes what is seen, without marker and text, to a new file in the working directory; prints its name."""
        if self.camera is None:
            return None
        path = next(p for k in range(1, 1_000_000) if not (p := Path(f"pointshade_{k:04d}.png")).exists())
        try:
            save_image(path, self.screen.read(self, self.camera))
        except OSError as error:
            self.say(f"not saved: {error}")
            return None
        sys.stdout.write(f"{path}\n")
        self.say(f"saved {path}")
        return path

    def release(self) -> None:
        """Closes the window, the stream and the film; frees everything."""
        self._close.close()

    def _patience(self) -> float | None:
        """Seconds that the next turn may sleep; None is without end."""
        now = time.perf_counter()
        visible = self.camera is not None
        if (visible and (self._look() != self._shown or self._panel_settling())) or self._said:
            return 0
        reasons = [
            max(self._next_frame - now, 0.0) if self._animates and visible else None,
            self._playback.patience(now) if self._playback else None,
            self._recorder.patience(now) if self._recorder else None,
            max(self._until - now, 0.0) if self._until < float("inf") else None,
        ]
        return min((seconds for seconds in reasons if seconds is not None), default=None)

    def _expire_message(self, now: float) -> None:
        while self._said:
            if (text := self._said.popleft()) not in self._told:  # a sequence that starts over meets it again
                self._told.add(text)
                self.say(f"skipped: {text}")
                sys.stderr.write(f"warning: skipped: {text}\n")
        if self._until < now:
            self._message, self._until = "", float("inf")

    def _panel_settling(self) -> bool:
        return self.state.panel and self.screen.panel.settling > 0

    def _look(self) -> tuple[Any, ...]:
        """All that the window's content depends on."""
        window = self.camera, self.window.scale
        return self.state, self.lights, self.held, self.frame, window, self._message, self._mouse.drag

    def _draw(self, camera: Camera) -> None:
        look = self._look()
        self.screen.draw(self, camera, self._message, marked=self._mouse.drag not in ("orbit", "pan"))
        self._shown = look
        self.drawn += 1
