"""The window, opened by GLFW with the newest OpenGL. Its events are plain values."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import replace
from functools import lru_cache
from itertools import product
from typing import Any

import moderngl

from ..gpu.context.context import VERSIONS, kept
from ..notes.errors import ContextError
from ..notes.notes import print_note
from ..notes.words import option
from ..renderer.renderer import Renderer
from ..scene.camera import Camera
from .events import Event, EventKind

NO_WINDOW = "use `pointshade render` to draw without a window"
LONGEST_SLEEP = 0.5  # seconds
BUTTONS = ("left", "right", "middle")  # as GLFW counts them
NAMED = (  # keys, as GLFW calls them
    "SPACE", "ESCAPE", "LEFT", "RIGHT", "UP", "DOWN", "HOME", "END", "TAB", "BACKSPACE", "DELETE", "ENTER", "F11",
)  # fmt: skip


def import_glfw() -> Any:
    """GLFW without its warnings: we raise errors. On macOS, imgui's own copy must load first, or the two clash."""
    if sys.platform == "darwin":
        with suppress(ImportError):
            import imgui_bundle  # noqa: F401
    import glfw

    glfw.ERROR_REPORTING = False  # type: ignore[reportAttributeAccessIssue]
    return glfw


class GLContext:
    """An OpenGL context of GLFW's, current inside `with context:`; a context object for moderngl.create_context."""

    def __init__(self, glfw: Any, handle: Any):
        self.glfw, self.handle = glfw, handle
        self._held: list[ExitStack] = []  # what was current before each `with`

    def load_opengl_function(self, name: str) -> int:
        return self.glfw.get_proc_address(name) or 0

    def __enter__(self) -> GLContext:
        with ExitStack() as undo:
            undo.enter_context(kept(None))
            undo.callback(self.glfw.make_context_current, self.glfw.get_current_context())
            self.glfw.make_context_current(self.handle)
            self._held.append(undo.pop_all())
        return self

    def __exit__(self, *_: object) -> None:
        self._held.pop().close()

    def release(self) -> None:
        """Closes what has the context, once. GLFW stays loaded for other windows of the process."""
        if self.handle:
            self.glfw.destroy_window(self.handle)
            self.handle = None


class Window(GLContext):
    """A window and its OpenGL context, which is current inside `with window:`.

    on_event   called with each Event while `wait` runs
    title, size  size in screen coordinates, reduced to fit the monitor; a note says so if it is_asked for

    has_files  the user may open and save files, and close the window

    Raises ContextError without a display, or without OpenGL 3.3.
    """

    has_files = True

    def __init__(self, title: str, size: tuple[int, int], on_event: Callable[[Event], None], is_asked: bool = False):
        super().__init__(glfw := import_glfw(), None)
        if not glfw.init():
            raise ContextError(f"no display ({_complaint(glfw)}): {NO_WINDOW}")
        self._on_event = on_event
        self._pointer_hidden = False
        self._before: tuple[int, int, int, int] | None = None  # place and size, while it fills the screen
        self._pointer = (0.0, 0.0)  # of the last event that had it, screen coordinates
        self._unseen = 0.0  # seconds in which events may have come that were seen later
        self._looked = time.perf_counter()  # when `wait` ended
        self._has_come = False  # an event, in this `wait`
        with kept(None):
            self.handle = self._create(title, fits := self._fit_monitor(size))
        if is_asked and fits != size:
            asked, room = ("x".join(map(str, one)) for one in (size, fits))
            print_note(f"{option('window_size', asked)} is larger than the screen: the window has {room}")
        for set_callback, callback in (
            (glfw.set_key_callback, self._on_key),
            (glfw.set_char_callback, lambda _, code: self._emit("text", chr(code))),
            (glfw.set_cursor_pos_callback, self._on_move),
            (glfw.set_cursor_enter_callback, lambda _, entered: None if entered else self._emit("leave")),
            (glfw.set_mouse_button_callback, self._on_button),
            # macOS turns Shift+wheel sideways
            (glfw.set_scroll_callback, lambda _, dx, dy: self._emit("wheel", steps=dy or dx)),
            (glfw.set_drop_callback, lambda _, paths: self._emit("drop", paths=tuple(map(str, paths)))),
            (glfw.set_window_refresh_callback, lambda _: self._emit("refresh")),
        ):
            set_callback(self.handle, callback)

    def _create(self, title: str, size: tuple[int, int]) -> Any:
        """The first that the driver can make: of newer GL by the display's own API, by EGL, then both with GL 3.3."""
        glfw = self.glfw
        ways = glfw.NATIVE_CONTEXT_API, glfw.EGL_CONTEXT_API
        newer = VERSIONS[1:-1]  # nothing here needs 4.6, and each version that is refused costs 12 ms
        for way, version in (*product(ways, newer), *product(ways, VERSIONS[-1:])):
            glfw.default_window_hints()
            glfw.window_hint(glfw.CONTEXT_VERSION_MAJOR, version[0])
            glfw.window_hint(glfw.CONTEXT_VERSION_MINOR, version[1])
            glfw.window_hint(glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE)
            glfw.window_hint(glfw.OPENGL_FORWARD_COMPAT, sys.platform == "darwin")
            glfw.window_hint(glfw.CONTEXT_CREATION_API, way)
            glfw.window_hint(glfw.SCALE_TO_MONITOR, True)
            glfw.window_hint(glfw.DEPTH_BITS, 0)
            glfw.window_hint(glfw.STENCIL_BITS, 0)
            glfw.window_hint_string(glfw.X11_CLASS_NAME, "pointshade")
            if handle := glfw.create_window(*size, title, None, None):
                return handle
        raise ContextError(f"no window with OpenGL 3.3 ({_complaint(glfw)}): {NO_WINDOW}")

    def beside(self) -> GLContext:
        """Another context, which shares the textures of this one and may be current in another thread. Raises
        ContextError if there is none."""
        glfw = self.glfw
        glfw.window_hint(glfw.VISIBLE, False)  # else as this window was made
        with kept(None):
            handle = glfw.create_window(16, 16, "", None, self.handle)
        if not handle:
            raise ContextError(f"no second OpenGL context ({_complaint(glfw)}): update the graphics driver")
        return GLContext(glfw, handle)

    def make_contexts(self) -> tuple[moderngl.Context, Renderer]:
        """Return the window's own context, and a renderer in one beside it, so that a thread can have it for a while.
        Raises as `beside` does."""
        beside = self.beside()
        with beside:
            self._beside = moderngl.create_context(require=330, context=beside)  # type: ignore[reportArgumentType]
            self._renderer = Renderer(self._beside)
        with self:
            self._gl = moderngl.create_context(require=330, context=self)  # type: ignore[reportArgumentType]
        return self._gl, self._renderer

    def release_contexts(self) -> None:
        """Free what `make_contexts` made, and close the window."""
        self._renderer.release()
        self._beside.release()
        self._gl.release()

    @property
    def framebuffer(self) -> moderngl.Framebuffer:
        """What `swap` shows."""
        return self._gl.screen

    def _fit_monitor(self, size: tuple[int, int]) -> tuple[int, int]:
        monitor = self.glfw.get_primary_monitor()
        if not monitor:
            return size
        _, _, width, height = self.glfw.get_monitor_workarea(monitor)
        share = min(1.0, 0.9 * width / size[0], 0.9 * height / size[1]) if width and height else 1.0
        return max(1, round(size[0] * share)), max(1, round(size[1] * share))

    @property
    def picture_size(self) -> tuple[int, int]:
        """Width and height of the framebuffer in pixels; (0, 0) while the window is minimised."""
        if self.glfw.get_window_attrib(self.handle, self.glfw.ICONIFIED):
            return 0, 0
        return self.glfw.get_framebuffer_size(self.handle)

    def fit(self, camera: Camera, taken: int = 0) -> Camera | None:
        """The camera fitted to the window, whatever size it has now; None while nothing of it can be seen. taken:
        pixels at the right side which something else is shown in."""
        width, height = self.picture_size
        return _fitted(camera, width, height, taken) if width > taken and height else None

    @property
    def scale(self) -> float:
        """How much larger to draw text than at 96 dots per inch."""
        return max(1.0, self.glfw.get_window_content_scale(self.handle)[0])

    @property
    def is_closing(self) -> bool:
        return bool(self.glfw.window_should_close(self.handle))

    def close(self) -> None:
        self.glfw.set_window_should_close(self.handle, True)

    def name(self, title: str) -> None:
        self.glfw.set_window_title(self.handle, title)

    @property
    def is_full_screen(self) -> bool:
        return self._before is not None

    def toggle_full_screen(self) -> None:
        """Fills the monitor on which most of the window is, or goes back to its place and size before."""
        glfw, before = self.glfw, self._before
        if before is not None:
            self._before = None
            glfw.set_window_monitor(self.handle, None, *before, glfw.DONT_CARE)
            return
        place, size = glfw.get_window_pos(self.handle), glfw.get_window_size(self.handle)
        monitor = max(glfw.get_monitors(), key=lambda one: self._shared(one, place, size), default=None)
        if monitor is None:
            return
        mode, self._before = glfw.get_video_mode(monitor), (*place, *size)
        glfw.set_window_monitor(self.handle, monitor, 0, 0, *mode.size, mode.refresh_rate)

    def _shared(self, monitor: Any, place: tuple[int, int], size: tuple[int, int]) -> int:
        """How much of the window is on a monitor, in pixels of the screen."""
        starts, sizes = self.glfw.get_monitor_pos(monitor), self.glfw.get_video_mode(monitor).size
        spans = (
            min(at + long, start + most) - max(at, start)
            for at, long, start, most in zip(place, size, starts, sizes, strict=True)
        )
        return math.prod(max(span, 0) for span in spans)

    def copy(self, text: str) -> None:
        self.glfw.set_clipboard_string(None, text.replace("\0", ""))

    def pasted(self) -> str:
        """The text in the clipboard; "" if there is none."""
        return (self.glfw.get_clipboard_string(None) or b"").decode(errors="replace")

    def hide_pointer(self, hidden: bool) -> None:
        if hidden != self._pointer_hidden:
            mode = self.glfw.CURSOR_HIDDEN if hidden else self.glfw.CURSOR_NORMAL
            self.glfw.set_input_mode(self.handle, self.glfw.CURSOR, mode)
            self._pointer_hidden = hidden

    def swap(self) -> None:
        self.glfw.swap_buffers(self.handle)

    def wait(self, seconds: float | None) -> None:
        """Sleeps until an event comes or the time is over, then handles events. None: no limit, 0: no sleep."""
        unseen = time.perf_counter() - self._looked
        self._unseen, self._has_come = self._unseen + unseen, False
        try:
            if seconds is None or seconds > 0:
                # GLFW sleeps through signals: Python must wake up now and then to notice Ctrl+C.
                self.glfw.wait_events_timeout(LONGEST_SLEEP if seconds is None else min(seconds, LONGEST_SLEEP))
            else:
                self.glfw.poll_events()
        except UnicodeDecodeError:  # of the name of a file that was dropped
            self._emit("drop")
        self._unseen -= 0.0 if self._has_come else unseen  # no event had been waiting
        self._looked = time.perf_counter()

    def wake(self) -> None:
        """Ends `wait`. May be called from any thread."""
        self.glfw.post_empty_event()

    def _emit(self, kind: EventKind, key: str = "", mods: int | None = None, **more: Any) -> None:
        """The pointer was where the events before had it: asked now, it may have gone on."""
        glfw = self.glfw
        wide, high = glfw.get_window_size(self.handle)
        width, height = glfw.get_framebuffer_size(self.handle)
        x, y = self._pointer[0] * width / max(wide, 1), self._pointer[1] * height / max(high, 1)
        if mods is None:
            mods = self._held_modifiers()
        ctrl, shift = bool(mods & (glfw.MOD_CONTROL | glfw.MOD_SUPER)), bool(mods & glfw.MOD_SHIFT)
        now, self._has_come = time.perf_counter() - self._unseen, True
        self._on_event(Event(kind, key, x, y, ctrl=ctrl, shift=shift, time=now, **more))

    def _held_modifiers(self) -> int:
        glfw = self.glfw
        held = 0
        for name, bit in (("CONTROL", glfw.MOD_CONTROL), ("SUPER", glfw.MOD_SUPER), ("SHIFT", glfw.MOD_SHIFT)):
            keys = getattr(glfw, f"KEY_LEFT_{name}"), getattr(glfw, f"KEY_RIGHT_{name}")
            held |= bit * any(glfw.get_key(self.handle, key) == glfw.PRESS for key in keys)
        return held

    def _on_key(self, _: Any, key: int, scancode: int, action: int, mods: int) -> None:
        if action != self.glfw.RELEASE and (name := key_name(self.glfw, key, scancode)):
            self._emit("key", name, mods=mods)

    def _on_move(self, _: Any, x: float, y: float) -> None:
        self._pointer = x, y
        self._emit("move")

    def _on_button(self, _: Any, button: int, action: int, mods: int) -> None:
        if button < len(BUTTONS):
            self._emit("press" if action == self.glfw.PRESS else "release", BUTTONS[button], mods=mods)


@lru_cache(maxsize=8)  # asked for several times a turn
def _fitted(camera: Camera, width: int, height: int, taken: int) -> Camera:
    return replace(camera.fitted(width - taken, height), width=width)


def size_for(camera: Camera) -> tuple[int, int]:
    """A size with the aspect ratio of the camera's pictures: theirs, unless that is very small or very large."""
    scale = min(max(1.0, 640 / camera.width), 1280 / camera.width, 960 / camera.height)
    return max(round(camera.width * scale), 1), max(round(camera.height * scale), 1)


def key_name(glfw: Any, key: int, scancode: int) -> str:
    """What is printed on the user's key, upper case; digits, those of the keypad and named keys by their position. ""
    for all others."""
    named = {getattr(glfw, f"KEY_{name}"): name for name in NAMED} | {
        glfw.KEY_KP_ENTER: "ENTER", glfw.KEY_KP_ADD: "+", glfw.KEY_KP_SUBTRACT: "-", glfw.KEY_KP_DECIMAL: "KP.",
    }  # fmt: skip
    if glfw.KEY_KP_0 <= key <= glfw.KEY_KP_9:
        return f"KP{key - glfw.KEY_KP_0}"
    if glfw.KEY_0 <= key <= glfw.KEY_9:  # on French keyboards these keys show other signs
        return chr(key)
    return named.get(key) or (glfw.get_key_name(key, scancode) or "").upper()


def _complaint(glfw: Any) -> str:
    code, text = glfw.get_error()
    words = text.decode() if isinstance(text, bytes) else text
    return " ".join(words.split()) if code and words else "GLFW gives no reason"
