"""The interactive window: the light follows the mouse."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..messages.formatting import shown
from ..messages.validation import check_flag, check_path, check_size, check_type
from ..rendering.renderer import Renderer
from ..scene.camera import Camera
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.light import Light, check_lights
from ..scene.orbit_state import State
from .command import Typed
from .dropped import show_dropped
from .events import Event
from .history import Moment
from .lights import in_order, taking, titles
from .messages import Messages, when_seen
from .opened import Opened
from .panel import MISSING
from .playback import Playback
from .playing import Playing
from .pointing import Pointing
from .record import RATE, Recorder
from .redrawing import Redrawing, most_samples
from .routing import route
from .saving import save_picture
from .screen import Screen
from .shown import Shown, camera_of, home_of
from .timeline import Strip, Timeline
from .together import Together
from .turns import Turns
from .viewable_sources import check_rates, check_sources
from .views import VIEWS, check_views
from .window import Window, window_size

GREETING = "Move the mouse: the light follows.   Drag to turn.   H for help"
SOFTWARE = "\nA software renderer draws: pictures are right, but slow"
GREETING_SECONDS = 12.0
SAMPLES = 64  # of a picture in which nothing moves


class Viewer:
    """A window that shows a frame, a stream of frames or a scene; `run()` shows it until it is closed.

    source  a Frame, a Sequence of frames (see `open_source`), anything else that `for frame in source:` accepts, or a
            Scene with its own lights and shadows
    title   of the window
    size    (width, height) of the window in screen coordinates; None: that of the frame
    state   what the window shows at first: view, light, look
    lights  the mouse holds the first one, the others stay where they are; the window starts with shadows if one of them
            casts any
    others  more sources of frames of the same thing, as the source: they play at once and are drawn as one object, by
            their poses
    fps     frames of a stream per second, or of each source, in a sequence; None: as fast as they come
    views   how many frames of a sequence, evenly chosen, or "all", or their numbers: drawn as one object, by their
            poses, as soon as they are read; the key M switches between that and playing. None plays at first, and M
            draws 8 as one object
    record  an .mp4 or .gif to which the window is recorded
    panel   opens the panel, if its extra is installed
    typed   how the command line names the source, so that the key P can tell the line that makes the same picture

    An application subclasses Viewer and overrides `on_start`, `on_frame`, `on_event`. To change what the window shows,
    it gives `state`, `frame` or `lights` a new value. The window is redrawn when one of them or its size changes, then
    refined to `samples` samples, and sleeps otherwise. Use it in the main thread of the process, as windows require.

    Raises ContextError without a display; ValueError, TypeError or OSError for anything that cannot be shown.
    """

    def __init__(
        self,
        source: Frame | Scene | Iterable[Frame],
        *,
        title: str = "pointshade",
        size: tuple[int, int] | None = None,
        state: State | None = None,
        lights: Sequence[Light] = (),
        others: Sequence[Frame | Iterable[Frame]] = (),
        fps: float | Sequence[float | None] | None = None,
        views: int | str | Sequence[int] | None = None,
        record: str | Path | None = None,
        panel: bool = False,
        typed: Typed | None = None,
    ):
        others = check_sources(source, others, views)
        if not isinstance(title, str):
            raise TypeError(f"title must be a text, got {shown(title)}")
        size = None if size is None else check_size(size)
        state = State() if state is None else check_type(state, State, "state")
        lights = check_lights(lights)
        rates = check_rates(fps, 1 + len(others))
        count = VIEWS if views is None else check_views(views)
        check_flag(panel, "panel")
        typed = None if typed is None else check_type(typed, Typed, "typed")
        self.events: list[Event] = []  # of the next turn
        self.messages, self.pointing, self.timeline, self.redrawing = Messages(), Pointing(), Timeline(), Redrawing()
        self.rate = self.redrawing.rate  # of the pictures that differ
        self.samples = SAMPLES  # of a picture in which nothing moves; 1 does not refine it
        with ExitStack() as undo:
            recorder = None if record is None else Recorder(check_path(record), rates[0] or RATE)
            if recorder:
                undo.callback(recorder.close)
            playing = Playing(source, others, rates, count, self.messages.skip)
            opened = Opened(playing, typed, state, lights, merge=views is not None)
            undo.callback(lambda: self.opened.playing.close())
            self.show(opened, opened.first, opened.start)
            size = size or window_size(self.own_camera)
            self._open_window(title, size, undo)
            animates = type(self).on_frame is not Viewer.on_frame
            self.turns = Turns(animates, recorder, self.own_camera.fitted(*size))
            if panel:
                self.toggle_panel()
            self._close = undo.pop_all()

    def _open_window(self, title: str, size: tuple[int, int], undo: ExitStack) -> None:
        self.window = Window(title, size, self.events.append)
        undo.callback(self.window.release)
        self.opened.playing.wake_by(self.window.wake)
        self.screen = Screen(self.window)
        undo.callback(self.screen.release)
        slow = SOFTWARE if self.renderer.context.is_software else ""
        self.messages.say(GREETING + slow, GREETING_SECONDS)

    @property
    def renderer(self) -> Renderer:
        """The renderer of the window; its `steps` and `choice` tell what ran."""
        return self.screen.renderer

    # For applications to override.
    def on_start(self) -> None:
        """Called once by `run`, with the window open."""

    def on_frame(self, seconds: float) -> None:
        """Called before each picture with the seconds since the start. Overriding it keeps the pictures coming."""

    def on_event(self, event: Event) -> bool | None:
        """Called with each action of the user. Return True to suppress its usual effect."""

    def run(self) -> None:
        """Shows the window until it is closed."""
        try:
            self.on_start()
            self.opened.start_at(self.moment, self.frame)
            while not self.window.is_closing:
                self.step()
        finally:
            self.release()

    def step(self, wait: bool = True) -> None:
        """One turn: sleeps until there is something to do (if `wait`), and redraws if anything has changed."""
        self.turns.take(self, wait)

    def handle(self, event: Event) -> None:
        """Gives an event to the application first, then to timeline and panel, then to mouse and keys."""
        route(self, event)

    def open(self, paths: Sequence[str]) -> None:
        """Shows what files or folders hold, as `pointshade view` would. If that fails, says why and shows the same."""
        show_dropped(self, paths)

    def show(self, opened: Opened, frame: Shown, moment: Moment) -> None:
        """Shows a frame of what was opened, as it was at a moment."""
        self.opened = opened
        self.frame = frame
        self.state, self.stage, self.held, self.lights, self.light_number = moment

    @property
    def moment(self) -> Moment:
        """View and lights as they are."""
        return Moment(self.state, self.stage, self.held, self.lights, self.light_number)

    def _go_to(self, moment: Moment) -> None:
        """The look stays, which is not undone."""
        self.show(self.opened, self.frame, moment._replace(state=self.state.reset_view(moment.state)))

    def undo(self) -> None:
        """Takes back the last change of view or lights."""
        if moment := self.opened.history.undo(self.moment):
            self._go_to(moment)
        self.say("undone" if moment else "nothing to undo")

    def redo(self) -> None:
        """Makes the change again that was undone last."""
        if moment := self.opened.history.redo(self.moment):
            self._go_to(moment)
        self.say("done again" if moment else "nothing to do again")

    def reset(self) -> None:
        """View and lights as at the start, around the middle of the current frame."""
        self._go_to(self.opened.restart(self.frame))

    @property
    def camera(self) -> Camera | None:
        """The frame's camera, fitted to the window beside the panel; None while the window is minimised."""
        return self.window.fit(self.own_camera, self.panel_width)

    @property
    def own_camera(self) -> Camera:
        """The frame's or the scene's own camera."""
        return camera_of(self.frame)

    @property
    def panel_width(self) -> int:
        """Pixels beside which the picture is shown. A film does not change when the panel opens."""
        return (
            self.screen.panel.width(self.window.picture_size[0]) if self.state.panel and not self.turns.recorder else 0
        )

    @property
    def pose(self) -> NDArray[np.float64]:
        """(4, 4) camera-to-world of the frame's or the scene's own camera."""
        return np.asarray(home_of(self.frame).pose)

    def next_light(self) -> None:
        """The mouse takes the next light; the one that it held stays where it is."""
        if self.lights:
            self.take_light((self.light_number + 1) % (1 + len(self.lights)))
        else:
            self.say("there is only one light")

    def take_light(self, number: int) -> None:
        """The mouse takes the light with this number; the one that it held stays where it is."""
        if number != self.light_number:
            self._go_to(taking(number, self.moment, self.pose))
            titles = self.light_titles
            self.say(f"the mouse holds {titles[number]}, light {number + 1} of {len(titles)}{when_seen(self.state)}")

    @property
    def light_titles(self) -> list[str]:
        """What the lights are called, with their names in the scene."""
        return titles(self.opened.light_names, in_order(self.moment))

    def say(self, text: str) -> None:
        """Shows a line of text for a few seconds."""
        self.messages.say(text)

    def quit(self) -> None:
        """Ends `run`."""
        self.window.close()

    def toggle_panel(self) -> None:
        """Opens or closes the panel. Without its extra, says how to install it."""
        try:
            self.screen.panel  # noqa: B018
        except ImportError:
            self.say(MISSING)
        else:
            self.state = replace(self.state, panel=not self.state.panel)
            self.renderer.steps.forget("surface")  # run it again, so that the panel has a time to show

    @property
    def playback(self) -> Playback | Together | None:
        """What plays; None while nothing can."""
        return self.opened.playing.playback

    @property
    def strip(self) -> Strip | None:
        """What the timeline shows; None where frames do not play."""
        return self.opened.playing.strip(self.frame)

    def play(self, now: float) -> None:
        """Shows the frame that is due, or the views once they are merged."""
        playing = self.opened.playing
        if playing.is_merging:
            self._follow(*playing.merged(self.messages.text))
        elif not self.timeline.is_dragged and (frame := playing.advance(self.frame, now)):
            self.frame = frame

    def pause(self) -> None:
        """Pauses a stream, or continues it."""
        self.say(self.opened.playing.pause(self.frame))

    def step_frames(self, direction: int) -> None:
        """Pauses a stream and steps one frame forwards (1) or back (-1)."""
        self._follow(*self.opened.playing.step(self.frame, direction))

    def jump(self, index: int) -> None:
        """Shows the frame of a sequence with this number, counted from the end if it is below 0."""
        self._follow(*self.opened.playing.seek(self.frame, index))

    def seek(self) -> None:
        """Shows the frame that was chosen on the timeline, if one was."""
        if (wanted := self.timeline.take()) is not None:
            self._follow(self.opened.playing.seek(self.frame, wanted)[0], "")

    def change_rate(self, factor: float) -> None:
        """Plays frames faster (a factor above 1) or slower."""
        self.say(self.opened.playing.change_rate(self.frame, factor))

    def toggle_loop(self) -> None:
        """Whether a sequence begins again at its end."""
        self.say(self.opened.playing.toggle_loop(self.frame))

    def toggle_views(self) -> None:
        """Draws several frames of a sequence as one object, or plays them again."""
        self._follow(*self.opened.playing.toggle_views(self.frame))

    def _follow(self, frame: Shown | None, text: str) -> None:
        """Shows the frame, unless it stays, and says the text, if there is one."""
        if frame is not None:
            self.frame = frame
        if text:
            self.say(text)

    @property
    def drawn(self) -> int:
        """How often the window was drawn."""
        return self.redrawing.drawn

    @property
    def samples_shown(self) -> tuple[int, int]:
        """How many samples the window shows, and how many it will show if nothing moves."""
        return self.redrawing.refining.samples, most_samples(self, self.camera)

    def save_picture(self) -> Path | None:
        """Writes the picture, without marker, text and panel, to a new file in the working directory, and prints its
        name and the command that makes the same, which also goes into the clipboard."""
        return save_picture(self)

    def release(self) -> None:
        """Closes the window, the stream and the film, and frees everything."""
        self._close.close()
