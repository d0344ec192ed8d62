"""The interactive window: the light follows the mouse."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..checks import check_flag, check_path, check_size, check_type, shown
from ..files.pictures import save_image
from ..frame import Frame
from ..light import Light, check_lights
from ..renderer import Renderer
from ..scene import Scene
from .command import Typed, render_line
from .controls import press_key, when_seen
from .dropped import read_dropped
from .events import Event
from .history import History, Moment
from .lights import titles
from .messages import Messages
from .panel import MISSING
from .playback import Playback
from .playing import Playing, Shown
from .pointing import Pointing
from .rate import Rate
from .record import RATE, Recorder
from .refining import Refining
from .screen import Screen
from .sources import check_rates, check_sources
from .state import OWN_LIGHT, Stage, State
from .timeline import Strip, Timeline
from .together import Together
from .views import VIEWS, Views, check_views
from .window import Window, window_size

GREETING = "Move the mouse: the light follows.   Drag to turn.   H for help"
SOFTWARE = "\nA software renderer draws: pictures are right, but slow"
GREETING_SECONDS = 12.0
SAMPLES = 64  # of a picture in which nothing moves
OF_SOURCE = (
    "_playing", "typed", "first", "frame", "state", "stage", "held", "lights", "light_number", "_light_names", "_start",
    "_start_pose", "history",
)  # fmt: skip
DISPLAY_RATE = 60.0  # pictures per second while on_frame is overridden


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
        self._count = VIEWS if views is None else check_views(views)
        self._rate = rates[0]
        check_flag(panel, "panel")
        self.typed = None if typed is None else check_type(typed, Typed, "typed")
        self._events: list[Event] = []
        self._messages = Messages()
        self._pointing = Pointing()
        self._shown: Any = None
        self._animates = type(self).on_frame is not Viewer.on_frame
        self.samples = SAMPLES  # of a picture in which nothing moves; 1 does not refine it
        self._refining = Refining()
        self._arriving = Rate()  # of the frames of a stream
        self._timeline = Timeline()
        self.rate = Rate()  # of the pictures that differ
        self.drawn = 0  # how often the window was drawn
        with ExitStack() as undo:
            self._recorder = None if record is None else Recorder(check_path(record), rates[0] or RATE)
            if self._recorder:
                undo.callback(self._recorder.close)
            self._playing = Playing(source, others, rates, self._count, self._messages.skip)
            undo.callback(lambda: self._playing.close())
            self._set_up(self._playing.first(merge=views is not None), state, lights)
            size = size or window_size(self._own_camera)
            self.window = Window(title, size, self._events.append)
            undo.callback(self.window.release)
            self._playing.wake_by(self.window.wake)
            self.screen = Screen(self.window)
            undo.callback(self.screen.release)
            self._began = self._next_frame = time.perf_counter()
            slow = SOFTWARE if self.renderer.context.is_software else ""
            self._messages.say(GREETING + slow, GREETING_SECONDS)
            self._film_camera = self._own_camera.fitted(*size)
            if panel:
                self.toggle_panel()
            self._close = undo.pop_all()

    def _set_up(self, frame: Shown, state: State, lights: Sequence[Light]) -> None:
        """Shows a frame or a scene, under its own lights unless others are given."""
        self.frame: Shown = frame
        self.first = frame  # of which the user may have hidden something since
        self.state = state
        self._light_names: Sequence[str] = ()
        if isinstance(frame, Scene):
            self.state = replace(self.state, shadows=True)
            self._light_names = () if lights else frame.light_names
            lights = lights or frame.lights
        self.stage = Stage.of(self._own)
        if lights:
            self.state = self.state.with_light(lights[0], self.stage, self.pose)
        if any(light.shadow for light in lights):
            self.state = replace(self.state, shadows=True)
        self.held = lights[0] if lights else OWN_LIGHT  # the kind of light that the mouse holds
        self.lights = tuple(lights[1:])
        self.light_number = 0  # of the lights, which one the mouse holds
        self._start_here()

    def _start_here(self) -> None:
        """What is shown now is the start: R comes back to it, and nothing before it can be undone."""
        self._start, self._start_pose = self.moment, self.pose
        self.history = History(self._start)

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
            self._start_here()
            while not self.window.is_closing:
                self.step()
        finally:
            self.release()

    def step(self, wait: bool = True) -> None:
        """One turn: sleeps until there is something to do (if `wait`), and redraws if anything has changed."""
        self.window.wait(self._patience() if wait else 0)
        events, self._events[:] = list(self._events), []
        for event in events:
            self.handle(event)
        now = time.perf_counter()
        self._seek()
        if self._playing.is_merging:
            self._follow(*self._playing.merged(self._messages.text))
        elif not self._timeline.is_dragged and (frame := self._playing.advance(self.frame, now)):
            self.frame = frame
            self._arriving.tick(now)
        if self._animates:
            self.on_frame(now - self._began)
            self._next_frame = now + 1 / DISPLAY_RATE
        self._messages.update(now)
        is_due = self._content() != self._shown or self._panel_settling() or self._refining_patience(now) == 0
        if self.camera and is_due:
            self._draw(self.camera)
        if self._recorder:
            samples = self._refining.samples if self.camera == self._film_camera else 1
            self._recorder.add(time.perf_counter(), lambda: self.screen.read(self, self._film_camera, samples))

    def handle(self, event: Event) -> None:
        """Gives an event to the application first, then to the panel, then to mouse and keys."""
        if event.kind in ("key", "text") and self.state.panel and self.screen.panel.is_deciding:
            self._events.append(event)  # the next turn knows whose it is
            return
        if self.on_event(event):
            return
        self.history.follow(self.moment)
        if event.kind != "move":  # of many moves only the last counts
            self._seek()
        on_timeline = self._timeline.handle(event, *self._timeline_place)
        on_panel = on_timeline or (self.state.panel and self.screen.panel.handle(event))
        if event.kind == "refresh":
            self._shown = None
        elif event.kind == "key":
            if not on_panel:
                press_key(self, event.key, event.ctrl, event.shift)
                self.history.act(self.moment)
        elif event.kind != "text" and self.camera:
            is_away = on_panel or event.kind == "drop"  # with files in the hand the pointer was on its way, too
            self._pointing.handle(self, replace(event, kind="leave") if is_away else event, self.camera)
        if event.kind == "drop":
            self.open(event.paths)
        over = on_panel or self._timeline.is_over(event, *self._timeline_place)
        follows = self.state.light_mode and self.state.is_lit and not over
        self.window.hide_pointer(follows and not self._pointing.turns)

    def open(self, paths: Sequence[str]) -> None:
        """Shows what files or folders hold, as `pointshade view` would. If that fails, says why and shows the same."""
        title = " and ".join(paths)
        self.say(f"opening {title}")
        if self.camera:
            self._draw(self.camera)
        before = {name: vars(self)[name] for name in OF_SOURCE}
        try:
            source, others, self.typed = read_dropped(paths)
            self._playing = Playing(source, others, [self._rate] * (1 + len(others)), self._count, self._messages.skip)
            self._set_up(self._playing.first(merge=False), self.state.reset_view(State()), ())
            if self.camera:
                self._draw(self.camera)
        except (ValueError, TypeError, OSError, MemoryError) as error:
            unused = self._playing
            vars(self).update(before)
            self.say(f"not opened: {error}")
        else:
            unused = before["_playing"]
            self._playing.wake_by(self.window.wake)
            self.window.name(f"pointshade: {title}")
            self._messages.clear()
        if unused is not self._playing:
            unused.close()

    @property
    def moment(self) -> Moment:
        """View and lights as they are."""
        return Moment(self.state, self.stage, self.held, self.lights, self.light_number)

    def _go_to(self, moment: Moment) -> None:
        self.state = self.state.reset_view(moment.state)
        _, self.stage, self.held, self.lights, self.light_number = moment

    def undo(self) -> None:
        """Takes back the last change of view or lights."""
        if moment := self.history.undo(self.moment):
            self._go_to(moment)
        self.say("undone" if moment else "nothing to undo")

    def redo(self) -> None:
        """Makes the change again that was undone last."""
        if moment := self.history.redo(self.moment):
            self._go_to(moment)
        self.say("done again" if moment else "nothing to do again")

    @property
    def camera(self) -> Camera | None:
        """The frame's camera, fitted to the window beside the panel; None while the window is minimised."""
        return self.window.fit(self._own_camera, self.panel_width)

    @property
    def panel_width(self) -> int:
        """Pixels beside which the picture is shown. A film does not change when the panel opens."""
        return self.screen.panel.width(self.window.picture_size[0]) if self.state.panel and not self._recorder else 0

    @property
    def _own(self) -> Frame | Scene:
        """Whose camera looks."""
        return self.frame.home if isinstance(self.frame, Views) else self.frame

    @property
    def _own_camera(self) -> Camera:
        camera = self._own.picture_camera if isinstance(self._own, Frame) else self._own.camera
        assert camera is not None  # `framed` gave scenes a camera
        return camera

    @property
    def pose(self) -> NDArray[np.float64]:
        """(4, 4) camera-to-world of the frame's or the scene's own camera."""
        return np.asarray(self._own.pose)

    def next_light(self) -> None:
        """The mouse takes the next light; the one that it held stays where it is."""
        count = 1 + len(self.lights)
        if count == 1:
            self.say("there is only one light")
            return
        self.take_light((self.light_number + 1) % count)

    def take_light(self, number: int) -> None:
        """The mouse takes the light with this number; the one that it held stays where it is."""
        held = self.state.light(self.stage, self.pose, self.held)
        steps = (number - self.light_number) % (1 + len(self.lights))
        if not steps:
            return
        every = held, *self.lights
        self.held, self.lights, self.light_number = every[steps], (*every[steps + 1 :], *every[:steps]), number
        self.state = self.state.with_light(self.held, self.stage, self.pose)
        titles = self.light_titles
        self.say(f"the mouse holds {titles[number]}, light {number + 1} of {len(titles)}{when_seen(self.state)}")

    @property
    def light_titles(self) -> list[str]:
        """What the lights are called, with their names in the scene."""
        every = self.held, *self.lights
        first = -self.light_number % len(every)
        return titles(self._light_names, (*every[first:], *every[:first]))

    def say(self, text: str) -> None:
        """Shows a line of text for a few seconds."""
        self._messages.say(text)

    def quit(self) -> None:
        """Ends `run`."""
        self.window.close()

    def reset(self) -> None:
        """View and lights as at the start, around the middle of the current frame."""
        start, now = self._start, Stage.of(self._own)
        stays = now.is_as(start.stage) and np.array_equal(self.pose, self._start_pose)
        self._go_to(start._replace(stage=start.stage if stays else now))
        if not stays and self.held is not OWN_LIGHT:  # it stands in the world, not beside the viewer
            light = start.state.light(start.stage, self._start_pose, start.held)
            self.state = self.state.with_light(light, self.stage, self.pose)

    def toggle_panel(self) -> None:
        """Opens or closes the panel. Without its extra, says how to install it."""
        try:
            self.screen.panel  # noqa: B018
        except ImportError:
            self.say(MISSING)
        else:
            self.state = replace(self.state, panel=not self.state.panel)
            self.renderer.steps.forget("surface")  # run it again, so that the panel has a time to show

    def pause(self) -> None:
        """Pauses a stream, or continues it."""
        self.say(self._playing.pause(self.frame))

    def step_frames(self, direction: int) -> None:
        """Pauses a stream and steps one frame forwards (1) or back (-1)."""
        self._follow(*self._playing.step(self.frame, direction))

    def jump(self, index: int) -> None:
        """Shows the frame of a sequence with this number, counted from the end if it is below 0."""
        self._follow(*self._playing.seek(self.frame, index))

    def _seek(self) -> None:
        """Shows the frame that was chosen on the timeline."""
        if (wanted := self._timeline.take()) is not None:
            self._follow(self._playing.seek(self.frame, wanted)[0], "")

    def change_rate(self, factor: float) -> None:
        """Plays frames faster (a factor above 1) or slower."""
        self.say(self._playing.change_rate(self.frame, factor))

    def toggle_loop(self) -> None:
        """Whether a sequence begins again at its end."""
        self.say(self._playing.toggle_loop(self.frame))

    @property
    def strip(self) -> Strip | None:
        """What the timeline shows; None where frames do not play."""
        return self._playing.strip(self.frame, self._arriving.per_second)

    @property
    def _timeline_place(self) -> tuple[int | None, float, float, float]:
        """For how many frames the timeline has room, in how large a picture, at which scale."""
        width, height = self.window.picture_size
        return self._playing.total(self.frame), width - self.panel_width, height, self.window.scale

    def toggle_views(self) -> None:
        """Draws several frames of a sequence as one object, or plays them again."""
        self._follow(*self._playing.toggle_views(self.frame))

    def _follow(self, frame: Shown | None, text: str) -> None:
        """Shows the frame, unless it stays, and says the text, if there is one."""
        if frame is not None:
            self.frame = frame
        if text:
            self.say(text)

    @property
    def playback(self) -> Playback | Together | None:
        """What plays; None while nothing can."""
        return self._playing.playback

    def save_picture(self) -> Path | None:
        """Writes the picture, without marker, text and panel, to a new file in the working directory, and prints its
        name and the command that makes the same, which also goes into the clipboard."""
        camera = self.window.fit(self._own_camera)
        if camera is None:
            return None
        path = next(p for k in range(1, 1_000_000) if not (p := Path(f"pointshade_{k:04d}.png")).exists())
        samples = self._most_samples(camera)
        try:
            save_image(path, self.screen.read(self, camera, samples))
        except OSError as error:
            self.say(f"not saved: {error}")
            return None
        if camera == self.camera:
            self._refining.samples = samples
        self._tell_saved(path.absolute(), *render_line(self, camera, samples, path.name))
        return path

    def _tell_saved(self, path: Path, line: str, left_out: str) -> None:
        sys.stdout.write(f"{path}\n" + (f"{line}\n" if line else ""))
        if line:
            self.window.copy(line)
        said = "the command that makes it is in the clipboard" if line else ""
        said += f"; it leaves out: {left_out}" if line and left_out else left_out
        self.say(f"saved {path}" + (f"\n{said}" if self.typed else ""))

    def release(self) -> None:
        """Closes the window, the stream and the film, and frees everything."""
        self._close.close()

    def _patience(self) -> float | None:
        """Seconds that the next turn may sleep; None: no limit."""
        now = time.perf_counter()
        visible = self.camera is not None
        if self._events or (visible and (self._content() != self._shown or self._panel_settling())):
            return 0
        reasons = [
            max(self._next_frame - now, 0.0) if self._animates and visible else None,
            None if self._timeline.is_dragged else self._playing.patience(self.frame, now),
            self._recorder.patience(now) if self._recorder else None,
            self._refining_patience(now) if visible else None,
            self._messages.patience(now),
        ]
        return min((seconds for seconds in reasons if seconds is not None), default=None)

    def _panel_settling(self) -> bool:
        return self.state.panel and self.screen.panel.settling > 0

    @property
    def samples_shown(self) -> tuple[int, int]:
        """How many samples the window shows, and how many it will show if nothing moves."""
        return self._refining.samples, self._most_samples(self.camera)

    def _most_samples(self, camera: Camera | None) -> int:
        """Of the picture as it is: a photograph seen as it was taken has no more than one, and stays sharp."""
        is_own = isinstance(self.frame, Frame) and camera == self._own_camera
        is_there = np.allclose(self.state.pose(self.stage), np.eye(4), rtol=0, atol=1e-9 * self.stage.radius)
        return 1 if is_own and is_there and not self.state.is_lit else self.samples

    def _refining_patience(self, now: float) -> float | None:
        return self._refining.patience(self._picture(), now, self._most_samples(self.camera))

    def _picture(self) -> tuple[Any, ...]:
        """Everything that the picture below marker, text and panel depends on."""
        return replace(self.state, help=False, panel=False), self.lights, self.held, self.frame, self.camera

    def _content(self) -> tuple[Any, ...]:
        """Everything that the window's content depends on. Another size of the window is another camera."""
        window = self.camera, self.window.scale
        shown = self._messages.text, self._pointing.turns, self.strip
        return self.state, self.lights, self.held, self.frame, window, *shown

    def _draw(self, camera: Camera) -> None:
        content, picture, now = self._content(), self._picture(), time.perf_counter()
        if not self._refining.shows(picture):
            self.rate.tick(now)
        samples = self._refining.following(picture, now, self._most_samples(camera))
        self.history.follow(self.moment)
        self.screen.draw(self, camera, self._messages.text, not self._pointing.turns, samples)
        self.history.act(self.moment, "panel", time.perf_counter())
        self._shown = content
        self.drawn += 1
