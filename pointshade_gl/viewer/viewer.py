"""The interactive window: the light follows the mouse."""

from __future__ import annotations

import math
import operator
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from contextvars import copy_context
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

from ..checks.arguments import Progress, check_flag, check_path, check_size, check_type, is_a
from ..notes.errors import Cancelled, check_function
from ..notes.notes import Note, print_note, taken_by
from ..notes.words import shown
from ..renderer.renderer import Renderer
from ..scene.camera import Camera
from ..scene.cloud import PointCloud
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.light import Light, check_lights
from ..scene.noise import Choice
from ..scene.orbit import State
from ..scene.settings import STILL
from ..scene.viewpoint import View
from .background import CHOICE_CHECK, RATE, Background, OpenDialog, Recorder, Work, report, save_new
from .controller import ControllerInputs, controller, hides_pointer, is_for_timeline, turned_around
from .document import CommandLine, Document, SavedPicture, Session, check_rates, check_sources
from .events import Command, Effect, Event, Open, Remember, TurnAround
from .overlay import GREETING_SECONDS, Buttons, Messages, greeting
from .panel_sections import PanelFacts
from .playback import Playback, TimelineBar
from .screen import MISSING, Overlay, Redrawing, Screen
from .state import VIEWS, ShownPicture, check_views
from .window import Window, size_for

SAVING = "saving a picture"
SAMPLES = 64  # of a picture in which nothing moves
OF_FILES_AND_WINDOW = (
    Command.SAVE_PICTURE, Command.OPEN_FILES, Command.OPEN_FOLDER, Command.TOGGLE_FULL_SCREEN, Command.LEAVE,
    Command.CLOSE,
)  # fmt: skip
DISPLAY_RATE = 60.0  # pictures per second while on_frame is overridden


class Viewer(Session):
    """A window that shows a frame, a stream of frames, a scene or a point cloud; `run()` shows it until it is closed.

    An application subclasses Viewer and overrides `on_start`, `on_frame`, `on_event`. To change what the window shows,
    it gives `state`, `frame` or `lights` a new value, or calls `perform`. The window is redrawn when one of them or its
    size changes, then refined to `samples` samples, and sleeps otherwise. Use it in the main thread of the process, as
    windows require.

    Parameters
    ----------
    source : Frame, Scene, PointCloud or iterable of Frame
        What is shown: a frame, a sequence of frames (see `open_source`), anything else that `for frame in source:`
        accepts, a scene with its own lights and shadows, or a point cloud.
    title : str
        Of the window.
    window_size : (width, height), optional
        Size of the window in screen coordinates; None: that of the frame.
    state : State, optional
        What the window shows at first: view, light, look.
    lights : sequence of Light
        The mouse holds the first one, the others stay where they are; the window starts with shadows if one of them
        casts any.
    others : sequence
        More sources of frames of the same thing: they play at once and are drawn as one object, by their poses.
    fps : float or sequence of float, optional
        Frames of a stream per second, or of each source; None: as fast as they come.
    place : View, optional
        From where it is seen at first, of which only the pose or how it is moved counts; None: as the state has it.
    views : int, "all" or sequence of int, optional
        How many frames of a sequence, evenly chosen, or their numbers: drawn as one object, by their poses, as soon as
        they are read; the key M switches between that and playing. None plays at first, and M draws 8 as one object.
    record : path, optional
        An .mp4 or .gif to which the window is recorded.
    panel : bool
        Opens the panel, if its extra is installed.
    command_line : callable, optional
        Gives the words of a command that makes a saved picture again ("": none does), and what it leaves out; None:
        the key P only saves.
    notes : callable, optional
        Called with one sentence for each note; None logs them ("pointshade_gl").

    Raises
    ------
    ContextError
        Without a display.
    ValueError, TypeError, OSError
        For anything that cannot be shown.
    """

    def __init__(
        self, source: Frame | Scene | PointCloud | Iterable[Frame], *, title: str = "pointshade",
        window_size: tuple[int, int] | None = None, state: State | None = None, lights: Sequence[Light] = (),
        others: Sequence[Frame | Iterable[Frame]] = (), fps: float | Sequence[float | None] | None = None,
        place: View | None = None, views: int | Literal["all"] | Sequence[int] | None = None,
        record: str | Path | None = None, panel: bool = False, command_line: CommandLine | None = None,
        notes: Note | None = None,
    ):  # fmt: skip
        sources = check_sources(source, others, views)
        if not is_a(title, str):
            raise TypeError(f"title must be a text, got {shown(title)}")
        size = None if window_size is None else check_size(window_size, "window_size")
        state = State() if state is None else check_type(state, State, "state")
        lights = check_lights(lights)
        place = None if place is None else check_type(place, View, "place")
        rates = check_rates(fps, len(sources))
        count = VIEWS if views is None else check_views(views)
        check_flag(panel, "panel")
        self.events: list[Event] = []  # of the next turn
        messages, self.redrawing = Messages(), Redrawing()
        self._dialog: OpenDialog | None = None
        self.samples = SAMPLES  # of a picture in which nothing moves; 1 does not refine it
        self._notes = None if notes is None else check_function(notes, "notes")
        self._command_line = None if command_line is None else check_function(command_line, "command_line")
        with ExitStack() as undo:
            self.recorder = None if record is None else Recorder(check_path(record), rates[0] or RATE)
            if self.recorder:
                undo.callback(self.recorder.close)
            playback = Playback(sources, rates, count, messages.skip)
            super().__init__(Document(playback, state, lights, merge=views is not None, place=place), messages)
            undo.callback(lambda: self.document.playback.close())
            size = size or size_for(self.own_camera)
            with taken_by(self._notes):
                self.window = self._open_window(title, size, window_size is not None)
            undo.callback(self.window.release)
            self.document.playback.wake_by(self.window.wake)
            self.screen = Screen(self.window)
            undo.callback(self.screen.release)
            self.background = Background(self.window.wake, self.screen.take_back)
            undo.callback(self.background.close)
            self._close = undo.pop_all()
        self._prepared: tuple[Any, ...] | None = None  # what was found last, before a picture was drawn
        self._known: tuple[Choice | None, Mapping[Frame, float]] = None, {}  # of the renderer, for while it is lent
        self._seen: ShownPicture | None = None
        self._parts: tuple[Any, ...] = ()  # of that
        self._animates = type(self).on_frame is not Viewer.on_frame
        self._film_camera = self.own_camera.fitted(*size)
        self._began = self._next_frame = time.perf_counter()
        is_software, has_files = self.screen.renderer.context.is_software, self.window.has_files
        messages.say(greeting(state.light_mode, is_software, opens=has_files), GREETING_SECONDS)
        self._buttons = Buttons(self._began + GREETING_SECONDS, saves=has_files)
        if panel:
            self.toggle_panel()

    def _open_window(self, title: str, size: tuple[int, int], is_asked: bool) -> Window:
        return Window(title, size, self.events.append, is_asked)

    # For applications to override.
    def on_start(self) -> None:
        """Called once by `run`, with the window open."""

    def on_frame(self, seconds: float) -> None:
        """Called before each picture with the seconds since the start. Overriding it keeps the pictures coming."""

    def on_event(self, event: Event) -> bool | None:
        """Called with each action of the user. Return True to suppress its usual effect."""

    # The loop: it sleeps, sees what the user did, plays, draws, and records.
    def run(self) -> None:
        """Show the window until it is closed."""
        try:
            self.on_start()
            self.document.start_at(self.moment, self.frame)
            while not self.window.is_closing:
                self.step()
            if self.background.title.startswith(SAVING):  # a picture that was asked for is not lost
                self.background.finish()
        finally:
            self.release()

    def step(self, wait: bool = True) -> None:
        """Make one turn: sleep until there is something to do (if `wait`), and redraw if anything has changed."""
        with taken_by(self._notes):
            self._turn(wait)

    def _turn(self, wait: bool) -> None:
        self.window.wait(self.patience(time.perf_counter()) if wait else 0)
        events, self.events[:] = list(self.events), []
        for event in events:
            self.handle(event)
        self.background.poll()
        self._take_chosen()
        now = time.perf_counter()
        self.play(now)
        if self._animates:
            self.on_frame(now - self._began)
            self._next_frame = now + 1 / DISPLAY_RATE
        self.messages.update(now)
        if self._draws_in(now) == 0:
            try:
                self._draw()
            except Exception as error:  # also a bug: the window stays open if something else was
                self._go_back_after(error)
        if self.recorder and self.background.lends:
            self.recorder.hold(time.perf_counter())
        elif self.recorder:  # the film has the samples of the window, if both show the same
            film = self._seen_by(self._film_camera)
            samples = self.redrawing.samples if self.camera == film.camera else 1
            self.recorder.add(time.perf_counter(), lambda: self.screen.read(film, samples))

    def patience(self, now: float) -> float | None:
        """Return the seconds that the turn may sleep; None: no limit."""
        reasons = [
            0.0 if self.events else None,
            max(self._next_frame - now, 0.0) if self._animates and self.camera else None,
            self.plays_in(now),
            self.recorder.patience(now) if self.recorder else None,
            self._draws_in(now),
            self.messages.patience(now),
            self._buttons.patience(now),
            CHOICE_CHECK if self._dialog else None,
        ]
        return min((seconds for seconds in reasons if seconds is not None), default=None)

    def handle(self, event: Event) -> None:
        """Give an event to the application first, then to timeline and panel, then to mouse and keys."""
        if event.kind in ("key", "text") and self.state.panel and self.screen.panel.is_deciding:
            self.events.append(event)  # the next turn knows whose it is
            return
        if self.on_event(event):
            return
        if key := self._buttons.handle(event):
            self.handle(Event("key", key))
        if key is not None:  # it was on the bar
            return
        if (event.kind, event.key) == ("key", "ESCAPE") and self.end_work():
            return
        if self.messages.kept and event.kind in ("key", "press"):  # it was read: Esc does no more than to close it
            self.messages.clear()
            if event.key == "ESCAPE":
                return
        self.document.history.follow(self.moment)
        if event.kind != "move":  # of many moves only the last counts
            self.seek()
        control, place = self.control, self._inputs
        is_taken = is_for_timeline(control, place, event) or (self.state.panel and self.screen.panel.handle(event))
        self.take(controller(control, place, event, is_taken))
        self.window.hide_pointer(hides_pointer(self.control, self._inputs, event, is_taken or bool(self._buttons.over)))

    def perform(self, effect: Effect) -> None:
        """Do what a key, the mouse or the panel asks for, such as `Seek(0)` (see events.py)."""
        match effect:
            case Command() if effect in OF_FILES_AND_WINDOW and not self.window.has_files:
                self.say("not here: saving, opening and closing are up to the application")
            case TurnAround() | Command.SAVE_PICTURE | Open() if self.background.work:
                self.say(f"not yet: {self.background.title}")
            case TurnAround(x, y):
                if picture := self.picture:
                    self.take(turned_around(self.control, self.screen.find_surface(picture, x, y)))
            case Open(paths):
                self.open(paths)
            case Command.SAVE_PICTURE:
                self._start_saving()
            case Command.TOGGLE_PANEL:
                self.toggle_panel()
            case Command.REDRAW:
                self.redrawing.forget()
            case Command.FRAME_OBJECT:
                if camera := self.camera:
                    self.state = self.state.framed(self.stage, camera)
            case Command.TOGGLE_FULL_SCREEN:
                self.window.toggle_full_screen()
            case Command.LEAVE:
                self.window.toggle_full_screen() if self.window.is_full_screen else self.quit()
            case Command.OPEN_FILES | Command.OPEN_FOLDER:
                self.ask_for(is_folder=effect is Command.OPEN_FOLDER)
            case Command.CLOSE:
                self.quit()
            case _:
                super().perform(effect)

    @property
    def _inputs(self) -> ControllerInputs:
        width, height = self.window.picture_size
        total = self.document.playback.total(self.frame)
        width -= self.panel_covers
        return ControllerInputs(self.camera, width, height, self.window.scale, total, self.frame)

    @property
    def renderer(self) -> Renderer:
        """The renderer of the window; its `steps` and `choice` show what ran. Waits while the background has it."""
        self.background.finish()
        return self.screen.renderer

    @property
    def camera(self) -> Camera | None:
        """The frame's camera, fitted to the window beside the panel; None while the window is minimised."""
        return self.window.fit(self.own_camera, self.panel_width)

    @property
    def picture(self) -> ShownPicture | None:
        """What the window shows below marker, text and panel; None while it is minimised."""
        return self._seen_by(camera) if (camera := self.camera) else None

    def _seen_by(self, camera: Camera) -> ShownPicture:
        """The same object while nothing that it is made of has changed: what it finds is found once."""
        document = self.document
        parts = *self.moment, self.frame, camera, document.metered, document.playback.is_moving(self.frame)
        if self._seen is None or not all(map(operator.is_, parts, self._parts)):
            self._seen, self._parts = ShownPicture(self.moment, *parts[-4:]), parts
        return self._seen

    @property
    def panel_width(self) -> int:
        """Pixels beside which the picture is shown. A film does not change when the panel opens."""
        return 0 if self.recorder else self.panel_covers

    @property
    def panel_covers(self) -> int:
        """Pixels at the right that the panel stands on."""
        return self.screen.panel.width(*self.window.picture_size) if self.state.panel else 0

    @property
    def _overlay(self) -> Overlay:
        state, mouse = self.state, self._control.mouse
        pointer = None
        if state.reads and not mouse.drag and mouse.last is not None:
            pointer = round(mouse.last[0]), round(mouse.last[1])
        places = state.help, state.panel, self.panel_covers, self.window.scale, pointer
        title, share = self.background.title, self.background.share
        strip = TimelineBar(title, share) if title else self.strip
        buttons = self._buttons.seen(state, self.window.picture_size[0] - places[2], self.window.scale)
        return Overlay(self.messages.text, not mouse.turns, strip, *places, buttons)

    @property
    def drawn(self) -> int:
        """How often the window was drawn."""
        return self.redrawing.drawn

    def _draws_in(self, now: float) -> float | None:
        """Seconds until the window must be drawn; None: not before something changes."""
        picture = self.picture
        if picture is None:
            return None
        if self.state.panel and self.screen.panel.settling:
            return 0.0
        if self.background.lends:
            return self.redrawing.patience(None, self._overlay, now, 1)
        return self.redrawing.patience(picture.content, self._overlay, now, picture.most_samples(self.samples))

    def _draw(self) -> None:
        """Draws the window now, unless it is minimised, and does what the user chose in the panel. What takes long to
        find is found in the background first."""
        if self.picture and not self.background.work:
            self._prepare(self.picture)
        picture, over = self.picture, self._overlay
        if picture is None:
            return
        is_old, most = self.background.lends, picture.most_samples(self.samples)
        samples, is_fine = self.redrawing.samples, over.pointer is not None or self.recorder is not None
        if not is_old and self._last_good is None:
            self.screen.announce(picture, over._replace(strip=TimelineBar("preparing the first picture", 0.0)))
        if not is_old:
            samples = self.redrawing.begin(picture.content, time.perf_counter(), most, not is_fine)
        self.document.history.follow(self.moment)
        renderer, explain, rate = self.screen.renderer, None, self.redrawing.rate.per_second
        if not is_old:
            self._known, explain = (renderer.choice, renderer.weights), renderer.explain
        facts = PanelFacts(renderer.context.renderer, *self._known, explain, rate, (samples, most))
        coarse = self.redrawing.coarse, self.redrawing.shadows
        self.moment, chosen = self.screen.draw(picture, over, facts, *coarse)
        if not is_old:
            self._keep_good()
            metered = renderer.exposure, renderer.fill
            if picture.now.state.is_lit and metered != self.document.metered:
                self.document.metered = metered
        for effect in chosen:
            self.perform(effect)
        if self.state.panel:  # all that it changes between two presses of a button is one step
            self.perform(Remember(("panel", self.screen.panel.presses), pause=math.inf))
        self.redrawing.end(None if is_old else picture.content, over, time.perf_counter())

    def _keep_good(self) -> None:
        """What is shown can be drawn: what was opened takes the place of what was there before."""
        before, self._last_good = self._last_good, (self.document, self.frame, self.moment)
        if before and before[0] is not self.document:
            before[0].playback.close()
            self.document.playback.wake_by(self.window.wake)
            self.window.name(f"pointshade: {self.document.title}")
            self.messages.clear()
        self.show_news()

    def _prepare(self, picture: ShownPicture) -> None:
        """Finds in the background what the picture needs and takes long."""
        key, title = picture.preparation or (self._prepared, "")
        if key == self._prepared:
            return
        found: list[str] = []  # what was noted
        is_same = self._last_good is not None and self._last_good[1] is picture.shown  # it only looks otherwise
        outside = copy_context()

        def note(text: str) -> None:
            found.append(text)
            outside.run(print_note, text)

        def do(progress: Progress) -> None:
            renderer.context.move_here()
            with taken_by(note):
                renderer.draw(picture.request(rests=False), progress=progress)

        def done(_: object) -> None:
            self._prepared = key
            if is_same and found:  # what was asked for came out otherwise
                self.say("\n".join(found))

        renderer = self.screen.lend()
        title = "" if picture.plays else title  # each set of frames needs it anew
        self.background.start(Work(title, do, done, self._go_back_after))

    def end_work(self) -> bool:
        """End what runs in the background, if the user sees it. Return whether something did."""
        if self.background.title:
            self.background.end()
            return True
        return self.document.playback.end_merging()

    def toggle_panel(self) -> None:
        """Open or close the panel. Without its extra, show how to install it."""
        try:
            self.screen.panel  # noqa: B018
        except ImportError:
            self.say(MISSING)
        else:
            self.state = replace(self.state, panel=not self.state.panel)
            self.screen.renderer.steps.forget("surface")  # run it again, so that the panel has a time to show

    def ask_for(self, is_folder: bool) -> None:
        """Show the system's dialog for files or for a folder; what is chosen is opened while `step` runs."""
        if self._dialog is not None:
            self.say("a dialog is open already")
            return
        try:
            self._dialog = OpenDialog(is_folder)
        except RuntimeError as error:
            self.say(str(error))

    def _take_chosen(self) -> None:
        if self._dialog is not None and self._dialog.is_done and not self.background.work:
            paths, self._dialog = self._dialog.chosen, None
            if paths:
                self.open(paths)

    def open(self, paths: Sequence[str]) -> None:
        """Show what files or folders hold, as `pointshade view` would. If it fails, show why and the same as before."""
        document, state = self.document, self.state
        self.background.start(Work(
            f"opening {' and '.join(paths)}", do=lambda _: document.instead(paths, state),
            done=lambda opened: self.show(opened, opened.first, opened.start),
            failed=partial(self._show_failed, "not opened"),  # also after a bug: the window stays open
            lends=False, unused=lambda opened: opened.playback.close(),
        ))  # fmt: skip

    def save_picture(self) -> Path | None:
        """Write the picture, without marker, text and panel, to a new file in the working directory. Print its name
        and the command that makes the same, which also goes into the clipboard. None: it failed, see the message."""
        self.background.finish()
        self._start_saving()
        self.background.finish()
        return self._saved

    def _start_saving(self) -> None:
        self._saved: Path | None = None
        camera = self.window.fit(self.own_camera)
        if camera is None:
            return
        picture = self._seen_by(camera)
        refined = self.redrawing.samples if camera == self.camera else 1  # nobody waits for the rest of them
        samples = picture.most_samples(min(self.samples, max(refined, STILL)))

        def do(progress: Progress) -> Path:
            renderer.context.move_here()
            return save_new(renderer.render(picture.request(samples), progress=progress))

        def done(path: Path) -> None:
            self._saved = path
            if camera == self.camera:
                self.redrawing.samples, self.redrawing.coarse, self.redrawing.shadows = samples, 1, 1
            self._report_saved(picture, samples, path)

        def failed(error: BaseException) -> None:
            if not isinstance(error, Cancelled | OSError):
                raise error
            self._show_failed("not saved", error)

        renderer = self.screen.lend()
        self.background.start(Work(SAVING, do, done, failed))

    def _report_saved(self, picture: ShownPicture, samples: int, path: Path) -> None:
        saved = SavedPicture(picture, samples, path.name, self.document)
        line, left_out = self._command_line(saved) if self._command_line else ("", "")
        if line:
            self.window.copy(line)
        self.say(report(path, line, left_out))

    def quit(self) -> None:
        """End `run`."""
        self.window.close()

    def release(self) -> None:
        """Close the window, its dialog, the stream and the film, and free everything."""
        if self._dialog is not None:
            self._dialog.close()
        self._close.close()
