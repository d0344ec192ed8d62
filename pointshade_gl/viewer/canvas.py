"""The viewer on a canvas of rendercanvas: in a Qt or wx application, a notebook, a browser, or off screen."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterable, Mapping
from contextlib import contextmanager
from importlib import import_module
from threading import RLock
from typing import Any

import moderngl

from ..checks.arguments import is_a
from ..files.access.known_names import VASE, builtin_name
from ..gpu.core.images import RGBA8, Fitted, Image
from ..notes.words import shown
from ..renderer.renderer import Renderer
from ..renderer.requests import FilePath, load_all_sides, loaded
from ..scene.cloud import PointCloud
from ..scene.frame import Frame
from ..scene.graph import Scene
from .events import Event, EventKind
from .viewer import Viewer
from .window import Window

KINDS: dict[str, EventKind] = {  # of events, as rendercanvas calls them
    "pointer_move": "move", "pointer_down": "press", "pointer_up": "release", "pointer_leave": "leave",
    "wheel": "wheel", "key_down": "key", "char": "text",
}  # fmt: skip
BUTTONS = {1: "left", 2: "right", 3: "middle"}
KEYS = {" ": "SPACE", "\r": "ENTER"}
NOTCH = 100.0  # of the wheel
FASTEST = 60  # pictures a second
OTHERS = 'name another, such as "qt", "http" or "offscreen", or open the window of `pointshade_gl.viewer.Viewer`'


def event_of(told: Mapping[str, Any], ratio: float) -> Event | None:
    """Return an event of rendercanvas as the viewer knows it; None where it does not. ratio: pixels for one of its."""
    kind, held = KINDS.get(told["event_type"]), told.get("modifiers") or ()
    ctrl, shift = "Control" in held or "Meta" in held, "Shift" in held
    key = told["data"] if kind == "text" else BUTTONS.get(told.get("button", 0), "")
    if kind == "key":
        key = told["key"].removeprefix("Arrow").upper()
        key = KEYS.get(key) or (chr(ord(key) + 64) if ctrl and "" < key < " " else key)  # Qt: Ctrl+Z is "\x1a"
    if kind is None or (kind in ("press", "release") and not key):
        return None
    x, y = told.get("x", 0) * ratio, told.get("y", 0) * ratio
    steps = -(told.get("dy") or told.get("dx") or 0) / NOTCH  # macOS turns Shift+wheel sideways
    return Event(kind, key, x, y, steps, ctrl, shift, time=told.get("time_stamp", time.perf_counter()))


class CanvasWindow(Window):
    """A canvas in the place of a window. It has one OpenGL context, the renderer's own, off screen."""

    has_files = False

    def __init__(self, canvas: Any):
        self.canvas, self._bitmap, self.renderer, self._copied = canvas, canvas.get_bitmap_context(), Renderer(), ""
        self._picture = Fitted(self.renderer.context.gl, Image, RGBA8)
        self.close, self.name, self.wake = canvas.close, canvas.set_title, canvas.request_draw
        self.release = self.release_contexts = self.renderer.release

    def make_contexts(self) -> tuple[moderngl.Context, Renderer]:
        return self.renderer.context.gl, self.renderer

    def __enter__(self) -> CanvasWindow:
        self.renderer.context.in_use().__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self.renderer.context.in_use().__exit__(*error)

    @property
    def picture_size(self) -> tuple[int, int]:
        return self.canvas.get_physical_size()

    @property
    def framebuffer(self) -> moderngl.Framebuffer:
        return self._picture.fit(self.picture_size).target

    @property
    def scale(self) -> float:
        return max(1.0, self.canvas.get_pixel_ratio())

    def hide_pointer(self, hidden: bool) -> None:
        self.canvas.set_cursor("none" if hidden else "default")

    def swap(self) -> None:
        self._bitmap.set_bitmap(self._picture.fit(self.picture_size).read()[::-1].copy())

    def wait(self, seconds: float | None) -> None:
        """The canvas calls when there is something to do."""

    def copy(self, text: str) -> None:
        self._copied = text

    def pasted(self) -> str:
        return self._copied


class CanvasViewer(Viewer):
    """What `canvas` returns: a Viewer that draws when its canvas asks.

    What takes long, such as merging views, keeps the application waiting. Saving, opening and closing are up to the
    application: their keys do nothing. After another `state`, `frame` or `lights`, `canvas.request_draw()` shows them.

    Parameters
    ----------
    source, backend, **options
        As `pointshade_gl.canvas` takes them.
    """

    window: CanvasWindow

    def __init__(self, source: Any, backend: Any, **options: Any):
        self._backend, self._loop, self._is_first = backend, None, True
        self._lock = RLock()
        super().__init__(source, **options)
        self.background.grace = None  # there is one context
        self.canvas.add_event_handler(self.send, *KINDS, "close")
        self.canvas.request_draw(self._turn_of_canvas)

    def _open_window(self, title: str, size: tuple[int, int], is_asked: bool) -> CanvasWindow:
        if hasattr(self._backend, "get_bitmap_context"):
            return CanvasWindow(self._backend)
        if not is_a(self._backend, str):
            raise TypeError(f"backend must be the name of one, or a canvas of rendercanvas, got {shown(self._backend)}")
        try:
            import_module("rendercanvas")
        except ImportError:
            raise ValueError("a canvas needs rendercanvas: pip install '.[canvas]' in the clone") from None
        try:
            module = import_module(f"rendercanvas.{self._backend}")
            made = module.RenderCanvas(size=size, title=title, max_fps=FASTEST)
            made.get_bitmap_context()  # that of glfw needs wgpu
        except (ImportError, RuntimeError) as error:
            raise ValueError(f"backend {shown(self._backend)} cannot be used ({error}): {OTHERS}") from error
        self._loop = module.loop
        return CanvasWindow(made)

    @property
    def canvas(self) -> Any:
        """The canvas of rendercanvas: the widget in Qt, in wx and in a notebook."""
        return self.window.canvas

    def send(self, told: Mapping[str, Any]) -> None:
        """Take an event. Canvases do that by themselves, except those off screen.

        Parameters
        ----------
        told : mapping
            As rendercanvas describes it: `{"event_type": "pointer_move", "x": 10, "y": 20}`, in logical pixels.
        """
        with self._here():
            if told["event_type"] == "close":
                if not self.window.renderer.context.is_released:  # nobody holds it any more: the renderer went first
                    self.release()
            elif event := event_of(told, self.canvas.get_pixel_ratio()):
                self.events.append(event)
                self.canvas.request_draw()

    def _turn_of_canvas(self) -> None:
        """Draw, and let the canvas come back when there is something to do."""
        with self._here():
            if self._is_first:
                self._is_first = False
                self.on_start()
                self.document.start_at(self.moment, self.frame)
            began = time.perf_counter()
            self.step(wait=False)
            now = time.perf_counter()
            if (seconds := self.patience(now)) == 0:
                self.canvas.request_draw()
            self.canvas.set_update_mode("ondemand", min_fps=1 / (now + seconds - began) if seconds else 0.0)

    @contextmanager
    def _here(self) -> Generator[None, None, None]:
        """Be of this thread: notebooks tell events, and ask for pictures, in several."""
        with self._lock:
            self.window.renderer.context.move_here()
            yield

    def run(self) -> None:
        """Run the backend's loop until its canvases are closed. In a notebook, or where a loop runs, do nothing."""
        if self._loop is not None:
            self._loop.run()

    def _repr_mimebundle_(self, **how: Any) -> Any:
        return self.canvas._repr_mimebundle_(**how)


def canvas(
    source: Frame | Scene | PointCloud | Iterable[Frame] | FilePath, backend: str | Any = "auto", **options: Any
) -> CanvasViewer:
    """Show something on a canvas of rendercanvas, under the mouse as in the window. Needs the extra `canvas`.

    Parameters
    ----------
    source : Frame, Scene, PointCloud, iterable of Frame or path
        As `Viewer` takes it; of a path what `load_any` loads, "vase" from all sides.
    backend : str or canvas
        "qt", "wx", "anywidget" (notebooks), "http", "offscreen" and others. "auto" is what rendercanvas finds: that of
        a notebook, of a running Qt application, else perhaps glfw, which needs wgpu. Or a canvas of the application's
        own, such as `rendercanvas.qt.QRenderWidget()`.
    **options
        `window_size`, `state`, `lights`, `views` and others of `Viewer`.

    Returns
    -------
    CanvasViewer
        Its `canvas` is the widget; `run()` runs the loop of a backend that was chosen by its name.

    Raises
    ------
    ValueError
        Without the extra, or for a backend that is not installed.
    ContextError
        Without OpenGL 3.3.
    """
    viewer = CanvasViewer(loaded(source), backend, **options)
    if builtin_name(source) == VASE:
        viewer.document.playback.whole = load_all_sides  # as soon as it is turned
    return viewer
