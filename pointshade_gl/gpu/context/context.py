"""Opens an off-screen OpenGL context or wraps the caller's, checks it, and knows which one is current."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache, partial
from importlib import import_module
from typing import Any

import moderngl

from ...notes.errors import SPAWN, ContextError, check_process
from ...notes.words import option
from .caller_state import CallersState, managed, textures
from .software_driver import is_software, keep_freed_memory, return_freed_memory, wants_software


class WindowSystem:
    """EGL or GLX, and what it makes current: a display, surfaces to draw into and to read from, and a context.

    loader  the module of moderngl's loaders for it
    """

    def __init__(self, loader: str, library: str, prefix: str, surfaces: tuple[tuple[Any, ...], ...], make: str):
        self.loader = loader
        functions = ctypes.CDLL(library)

        def asking(what: str, *arguments: int) -> Callable[[], int | None]:
            function = functions[f"{prefix}GetCurrent{what}"]
            function.restype = ctypes.c_void_p
            return partial(function, *arguments)

        self.context = asking("Context")  # None if none is current
        self._questions = [asking("Display"), *(asking(*surface) for surface in surfaces), self.context]
        self._make_current = functions[make]
        self._make_current.argtypes = [ctypes.c_void_p] * 4

    def held(self) -> list[int | None]:
        """Return what is current, as `hold` takes it."""
        return [ask() for ask in self._questions]

    def hold(self, held: list[int | None]) -> None:
        """Make a context current."""
        self._make_current(*held)

    def let_go(self) -> None:
        """Leave no context current."""
        self._make_current(self._questions[0](), None, None, None)


KINDS: tuple[tuple[Any, ...], ...] = (
    ("egl", "libEGL.so.1", "egl", (("Surface", 0x3059), ("Surface", 0x305A)), "eglMakeCurrent"),
    ("x11", "libGL.so.1", "glX", (("Drawable",), ("ReadDrawable",)), "glXMakeContextCurrent"),
)


@cache
def window_systems() -> dict[str, WindowSystem]:
    """Return the window systems of this machine, by the names of moderngl's loaders."""
    found = {}
    for kind in KINDS if sys.platform.startswith("linux") else ():
        try:
            found[kind[0]] = WindowSystem(*kind)
        except (OSError, AttributeError):  # it is not installed
            continue
    return found


def current_context() -> tuple[str, int] | None:
    """Return the name of the window system and the context that is current in it; None where neither has one."""
    systems = window_systems()
    for name in systems:
        if context := systems[name].context():
            return name, context
    return None


def loader_of(context: moderngl.Context) -> str:
    """Return the name of the window system in which moderngl makes this context current; '' for any other."""
    return type(context.mglo._context).__module__  # type: ignore[attr-defined]


@managed
def kept(loader: str | None) -> Generator[None, None, None]:
    """Restore what is current at the end; inside, contexts of this window system, or any, can be made current."""
    systems = window_systems()
    before = {name: system.held() for name, system in systems.items() if system.context()}
    for name in before:
        if loader is None or (loader in systems and name != loader):
            systems[name].let_go()
    try:
        yield
    finally:
        for name, system in systems.items():
            if name not in before and system.context():
                system.let_go()
        for name, held in before.items():
            if systems[name].held() != held:
                systems[name].hold(held)


_signals = [int(number) for number in signal.valid_signals()]
INSTALL_HINT = "on Debian or Ubuntu: apt-get install -y libegl1 libgl1-mesa-dri"
_handler_of = getattr(signal.getsignal, "__wrapped__", signal.getsignal)  # without making an Enum: 60 signals are asked


_OF_DRIVERS = (Exception, ValueError, ImportError, RuntimeError, OSError, moderngl.Error)  # by backend of moderngl
# NVIDIA gives the version that is asked for, no newer one. 4.1, which macOS has, does nothing for us beyond 3.3.
VERSIONS = ((4, 6), (4, 5), (4, 3), (3, 3))


class Context:
    """A moderngl context and its owner: whoever made it releases it, and it is used only in that thread and process.

    context  a moderngl.Context of the caller's (a window's, say), or None to make one off screen
    device   which GPU, counted by EGL; Linux only

    Raises ContextError with what to install when no OpenGL 3.3 can be had, and in a forked process.
    """

    _first_process: int | None = None  # that used OpenGL; its forks have none of the driver's threads

    def __init__(self, context: moderngl.Context | None = None, device: int = 0):
        if Context._first_process not in (None, os.getpid()):  # a driver would wait for threads that a fork lacks
            raise ContextError(f"OpenGL was used before a fork, and hangs after it: {SPAWN}")
        self.owned = context is None
        self.gl = _create(device) if context is None else context
        Context._first_process = os.getpid()
        self._thread, self._process = threading.get_ident(), os.getpid()
        self.is_released, self._in_use = False, InUse(self)
        self.identity: tuple[str, int] | None = None
        self._callers: CallersState | None = None
        try:
            with self._made_current():
                self.identity = current_context()
                self._start()
        except BaseException:
            self.release()
            raise

    def _start(self) -> None:
        if self.gl.version_code < 330:
            name, version = self.gl.info["GL_RENDERER"], self.gl.version_code / 100
            raise ContextError(f"OpenGL 3.3 is needed, {name} offers {version:.1f}")
        self._callers = None if self.owned else CallersState(self.gl)
        with self._set_aside():
            self.info = self.gl.info  # asked of the driver each time, and only right while current
        keep_freed_memory()

    @property
    def renderer(self) -> str:
        """Return the driver's name for the renderer."""
        return str(self.info["GL_RENDERER"])

    @property
    def is_software(self) -> bool:
        return is_software(self.renderer)

    def limits(self) -> dict[str, Any]:
        """Return the limits that `pointshade info` lists."""
        info = self.info
        with self.in_use():
            programs = "software" if wants_software(self.gl) else "hardware"
        return {
            "vendor": info["GL_VENDOR"], "renderer": self.renderer, "version": info["GL_VERSION"],
            "largest texture": info["GL_MAX_TEXTURE_SIZE"], "largest point": info["GL_POINT_SIZE_RANGE"][1],
            "rasterizer": "compute" if self.gl.version_code >= 430 else "points", "programs": programs,
        }  # fmt: skip

    def in_use(self) -> InUse:
        """Make the context current inside, in GL's default state; afterwards restore what the caller had.

        Raises ContextError where it cannot be used.
        """
        return self._in_use

    @managed
    def _made_current(self) -> Generator[None, None, None]:
        """Make the context current inside; afterwards the previous one."""
        if self.identity is not None and self.identity == current_context():
            yield
            return
        with kept(self.identity[0] if self.identity else loader_of(self.gl)), self.gl:
            if self.identity not in (None, current_context()):
                raise ContextError("the OpenGL context cannot be made current: another thread uses it, or it is gone")
            yield

    @managed
    def _set_aside(self) -> Generator[None, None, None]:
        """Set GL's default state inside; restore a caller's afterwards."""
        if self._callers is not None:
            with self._callers.set_aside():
                yield
            return
        screen = self.gl.detect_framebuffer(0)
        try:
            yield
        finally:
            screen.use()  # so that nothing of ours is bound when it is freed

    @property
    def is_gone(self) -> bool:
        """Return whether its owner has released the moderngl context itself."""
        return isinstance(self.gl.mglo, moderngl.InvalidObject)

    @property
    def is_here(self) -> bool:
        """Return whether this is the thread and the process that made it."""
        return (os.getpid(), threading.get_ident()) == (self._process, self._thread)

    def move_here(self) -> None:
        """Belong to this thread from now on. The other one must not be using it, and gets it back in the same way."""
        self._thread = threading.get_ident()

    def check(self) -> None:
        """Raise ContextError where the context cannot be used: GL would draw garbage there, or nothing."""
        is_here = os.getpid() == self._process and threading.get_ident() == self._thread  # every call pays for this
        if is_here and not self.is_released and type(self.gl.mglo) is not moderngl.InvalidObject:
            return
        check_process(self._process, "Renderer")
        if not self.is_here:
            raise ContextError("this Renderer belongs to the thread that made it: make one Renderer in each thread")
        if self.is_released:
            raise ContextError("this Renderer was released: make a new one")
        if self.is_gone:
            raise ContextError("the moderngl context of this Renderer was released: make a new one of both")

    def release(self) -> None:
        """Free the context if it is ours, with all that is in it. Afterwards it cannot be used."""
        if self.is_released:
            return
        self.is_released = True
        if self.owned:
            if self.is_here and self.identity is not None and self.identity == current_context():
                window_systems()[self.identity[0]].let_go()  # a signal has ended a call before it could let go
            self.gl.release()
        return_freed_memory()

    def drop(self) -> bool:
        """Free the context of a Renderer that nobody holds any more, and return whether it was ours and still open.

        EGL lets any thread free a context that is current in none, as ours is between calls; elsewhere only its own
        thread may. At the end of the process nothing is freed: drivers may be gone by then.
        """
        is_closed = self.is_released or self.is_gone or os.getpid() != self._process
        if is_closed or not self.owned or sys.is_finalizing():
            return False
        if self.is_here or loader_of(self.gl) == "egl":
            self.release()
        return True


class InUse:
    """What `with` needs to use a Context, also inside itself.

    Every call pays for it, so the usual case, a context of our own where none is current, is written out.
    """

    def __init__(self, context: Context):
        self._context, self._depth = context, 0
        self._screen: moderngl.Framebuffer | None = None  # of our own context
        self._inside: ExitStack | None = None  # None: the usual case

    def __enter__(self) -> None:
        context = self._context
        context.check()
        if not self._depth:
            is_entered = False
            if self._screen is not None and not current_context():
                try:
                    context.gl.__enter__()
                    is_entered = current_context() == context.identity
                finally:
                    if not is_entered:  # also where a signal's handler has raised
                        context.gl.__exit__(None, None, None)
            self._inside = None if is_entered else self._entered()
        self._depth += 1

    def _entered(self) -> ExitStack:
        textures.program = None  # a caller may have bound others
        with ExitStack() as inside:
            inside.enter_context(self._context._made_current())
            inside.enter_context(self._context._set_aside())
            if self._context.owned:
                self._screen = self._screen or self._context.gl.detect_framebuffer(0)
            return inside.pop_all()

    def __exit__(self, *error: Any) -> None:
        self._depth -= 1
        if self._depth:
            return
        if self._inside is not None:
            self._inside.__exit__(*error)
        elif self._screen is not None:
            try:
                self._screen.use()  # so that nothing of ours is bound when it is freed
            finally:
                self._context.gl.__exit__(*error)


def _is_there(library: str) -> bool:
    """Return whether the loader finds a library: quicker than find_library, which asks another process."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


@contextmanager
def signals_later() -> Iterator[None]:
    """Call the handlers of signals that come inside afterwards: moderngl's C code crashes where one raises in it.

    That is every signal with a handler of Python's: Ctrl+C, but also the soft limits of job queues (SIGUSR1, SIGALRM).
    What another thread raises in this one (PyThreadState_SetAsyncExc) nothing can postpone.
    """
    handlers: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():  # no other thread handles signals
        found = ((number, _handler_of(number)) for number in _signals)
        handlers = {number: handler for number, handler in found if callable(handler)}
    came: list[tuple[int, Any]] = []
    is_inside = True

    def note(number: int, frame: Any) -> None:
        if is_inside:
            came.append((number, frame))
        else:  # one of those before has raised, so that this one still stands here
            handlers[number](number, frame)

    try:
        for number in handlers:
            signal.signal(number, note)
        yield
    finally:
        is_inside = False
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for number, frame in came:
            handlers[number](number, frame)


def _newest(create: Callable[[int], Any]) -> Any:
    """Return what create(version) gives for the newest version that the driver has."""
    *newer, oldest = (100 * major + 10 * minor for major, minor in VERSIONS)
    for version in newer:
        try:
            return create(version)
        except Exception as error:
            if type(error) not in _OF_DRIVERS:
                raise
    return create(oldest)


@signals_later()
def _create(device: int) -> moderngl.Context:
    store = getattr(moderngl, "_store", None)  # with the context that moderngl.get_context() gives: not ours
    default = getattr(store, "default_context", None)
    try:
        if sys.platform.startswith("linux"):
            # EGL itself hands out all of GL: without libGL (package libgl1) its own library will do.
            libgl = "libGL.so.1" if _is_there("libGL.so.1") else "libEGL.so.1"
            how = {"mode": "standalone", "libgl": libgl, "libegl": "libEGL.so.1", "device_index": device}
            # moderngl itself would import ctypes.util first: 8 ms of the first picture
            egl: Any = import_module("glcontext.egl")
            with kept("egl"):
                opened = _newest(lambda version: egl.create_context(**how, glversion=version))
                return moderngl.create_context(standalone=True, require=330, context=opened)
        if sys.platform == "darwin":  # gives its newest
            return moderngl.create_context(standalone=True, require=330)
        return _newest(lambda version: moderngl.create_context(standalone=True, require=version))
    except Exception as error:
        if type(error) not in _OF_DRIVERS:  # what a caller raises in this thread is not about OpenGL
            raise
        hint = INSTALL_HINT if sys.platform.startswith("linux") else "update the graphics driver"
        which = f" on device {device}: try {option('device', 0)}" if device else ""
        raise ContextError(f"no OpenGL 3.3 context{which} ({error}); {hint}") from error
    finally:
        if store is not None:
            store.default_context = default


EGL_CUDA_DEVICE_NV = 0x323A  # of EGL_NV_device_cuda
_MOST_DEVICES = 64


def egl_device(gpu: int | str, visible: str) -> int:
    """Return the number of the EGL device that is this GPU.

    gpu      as Ray and CUDA_VISIBLE_DEVICES name it: a number, or a text such as "GPU-8932f937"
    visible  what CUDA_VISIBLE_DEVICES holds in this process; "" where it is not set
    """
    return matching(_cuda_numbers(), str(gpu), [name for name in visible.split(",") if name])


def matching(numbers: Sequence[int | None], gpu: str, visible: Sequence[str]) -> int:
    """Return the place of a GPU among EGL devices, from the numbers that their driver gives them, None where it gives
    none.

    A driver counts within CUDA_VISIBLE_DEVICES. Some old ones do not: they give numbers beyond it, or one number twice;
    then the GPU's own number counts. Without an answer EGL's order is used, and the first device beyond its end.
    """
    given = [number for number in numbers if number is not None]
    is_within = gpu in visible and max(given, default=0) < len(visible) and given.count(visible.index(gpu)) == 1
    wanted = visible.index(gpu) if is_within else int(gpu) if gpu.isdecimal() else 0
    if given.count(wanted) == 1:
        return numbers.index(wanted)
    return wanted if wanted < len(numbers) else 0


def _cuda_numbers() -> list[int | None]:
    """Return the CUDA number of each EGL device, in EGL's order; None for one that has none."""
    egl = ctypes.CDLL("libEGL.so.1")
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    list_devices = egl.eglGetProcAddress(b"eglQueryDevicesEXT")
    ask = egl.eglGetProcAddress(b"eglQueryDeviceAttribEXT")
    if not (list_devices and ask):
        return []
    devices, count = (ctypes.c_void_p * _MOST_DEVICES)(), ctypes.c_int()
    ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)(list_devices)(
        _MOST_DEVICES, devices, ctypes.byref(count)
    )
    number = ctypes.c_ssize_t()
    attribute = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p)(ask)
    return [
        number.value if attribute(device, EGL_CUDA_DEVICE_NV, ctypes.byref(number)) else None
        for device in devices[: count.value]
    ]
