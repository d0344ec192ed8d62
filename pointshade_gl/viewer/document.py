"""What a window has opened, how it is seen, and what actions of the user do to that. No GL, no window."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import check_fps, items_of
from ..files.access.folders import ListedFile
from ..files.access.known_names import COLOR_SUFFIXES, DEPTH_SUFFIXES, ONLY_DEPTH, VIDEO_SUFFIXES
from ..files.frame_sources import check_posed, load_any, open_source
from ..files.frames.frame_files import load_frame
from ..files.input_kinds import Kind
from ..files.pictures.picture_files import is_deep_grey
from ..notes.errors import Cancelled, error_text
from ..notes.words import option, shown
from ..scene.camera import Camera
from ..scene.cloud import PointCloud
from ..scene.frame import Frame
from ..scene.graph import Scene, beside, scene_of
from ..scene.light import Light
from ..scene.orbit import BESIDE, OWN_LIGHT, OrbitStage, State
from ..scene.settings import Metering
from ..scene.viewpoint import View, turns_away
from .controller import Answer, Control, added, removed, taking, titles
from .events import Command, Effect, PlayEffect, Remember, RemoveLight, Scrub, Seek, ShowFrame, ShowMessage, TakeLight
from .keys import when_seen
from .overlay import Messages
from .playback import Playback, TimelineBar
from .state import (
    History,
    Shown,
    ShownPicture,
    Snapshot,
    as_switched,
    camera_of,
    frame_in,
    home_of,
    scene_in,
    switches_of,
    views_in,
)

PICTURES = {*COLOR_SUFFIXES, *DEPTH_SUFFIXES} - set(VIDEO_SUFFIXES)


class Dropped(NamedTuple):
    sources: Sequence[Any]  # the frame, the sequence or the scene; or several sources of frames of the same thing
    inputs: tuple[str, ...]  # paths of the folders or of the file
    # of a single frame, by the names of `load_frame`'s options, where they were dropped one by one
    files: dict[str, Path]
    paths: tuple[str, ...] = ()  # as they were dropped


class SavedPicture(NamedTuple):
    """A picture that the key P saved, with all that a command line needs to make the same."""

    picture: ShownPicture
    samples: int
    name: str  # of its file
    document: Document  # that was open


CommandLine = Callable[[SavedPicture], tuple[str, str]]  # the words of a command, and what it leaves out, in words


class Document:
    """A frame, a stream of frames or a scene, under its own lights unless others are given.

    playback  closed here if it has nothing to show; afterwards whoever opened it does that
    dropped  what of it came by a drop onto the window; None: the program opened it
    merge    frames of a sequence are read to be merged
    place    from where it is seen at first, of which only the pose or how it is moved counts; None: as the state has it

    title    what was dropped, in words
    first    what was shown first: the user may have hidden nodes of a scene since
    start    the moment that R brings back
    history  the steps since then
    metered  exposure and fill of its first lit picture, as soon as that is drawn
    """

    def __init__(
        self, playback: Playback, state: State, lights: Sequence[Light] = (), merge: bool = False,
        dropped: Dropped | None = None, place: View | None = None,
    ):  # fmt: skip
        self.playback, self.dropped = playback, dropped
        self.title = " and ".join(dropped.paths) if dropped else ""
        self.metered: tuple[float | Metering, float | None] = "sensor", None
        try:
            self.first = playback.first(merge)
            self.start_at(_start_of(self.first, state, lights, place), self.first)
        except BaseException:
            playback.close()
            raise

    def instead(self, paths: Sequence[str], state: State) -> Document:
        """Open what was dropped onto the window, with this look. Raises ValueError, TypeError or OSError."""
        found = read_dropped(paths)._replace(paths=tuple(paths))
        return Document(self.playback.instead(found.sources), state.reset_view(State()), dropped=found)

    def start_at(self, moment: Snapshot, shown: Shown) -> None:
        """R comes back to this, and nothing before it can be undone."""
        self.start, self._pose = moment, shown.pose
        self.history = History(moment)

    def restart(self, shown: Shown) -> Snapshot:
        """All as at the start, around the middle of what is shown now. Lights of the world stay there."""
        stage, pose = OrbitStage.of(home_of(shown)), shown.pose
        views = views_in(shown)
        start = self.start._replace(switches=views.all_on().on) if views else self.start
        state, before, held, *_ = start
        if stage == before and np.array_equal(pose, self._pose):
            return start
        if held is not OWN_LIGHT:  # it stands in the world, not beside the viewer
            state = state.with_light(state.light(before, self._pose, held), stage, pose)
        return start._replace(state=state, stage=stage)


def _start_of(shown: Shown, state: State, lights: Sequence[Light], place: View | None) -> Snapshot:
    """The mouse holds the first of the lights. There are shadows if one of them casts any. Lights and environment of a
    scene count unless there are others."""
    home, scene, pose, names = home_of(shown), scene_in(shown), shown.pose, ()
    stage = OrbitStage.of(home)
    if place is not None:
        state = state.seen_from(np.linalg.inv(pose) @ place.seen(home)[1], stage)
    if scene and not lights:
        names, lights = tuple(scene.light_names), scene.lights
    if scene and state.finish.environment is None:
        state = state.with_finish(environment=scene.environment)
    if lights:
        state = state.with_light(lights[0], stage, pose)
    if any(light.shadow for light in lights):
        state = replace(state, shadows=True)
    if not lights and state.finish.environment is not None:
        state = replace(state, light_intensity=BESIDE)
    held, *others = lights or [OWN_LIGHT]
    return Snapshot(state, stage, held, tuple(others), 0, names, switches_of(shown))


class Session:
    """A frame, a stream of frames or a scene that is shown, with its view and its lights.

    document  what is open
    frame     of it is shown
    state, stage, held, lights, light_number, light_names  are those of a Snapshot
    messages  what is shown in words
    """

    def __init__(self, document: Document, messages: Messages):
        self.messages = messages
        self.show(document, document.first, document.start)
        self._control = Control(self.moment)
        self._news = ""  # to be shown once what is shown is seen
        self._wanted: int | None = None  # the frame that was chosen on the timeline
        self._last_good: tuple[Document, Shown, Snapshot] | None = None  # what could be drawn

    def show(self, document: Document, frame: Shown, moment: Snapshot) -> None:
        """Show a frame of a document, as it was at a moment."""
        self.document, self.frame, self.moment = document, frame, moment

    @property
    def moment(self) -> Snapshot:
        """All that is undone, as it is."""
        lights, stage = (self.held, self.lights, self.light_number, self.light_names), self.stage
        is_one = frame_in(self.frame) is not None and not self.document.playback.whole
        if stage.one_sided != is_one:
            stage = replace(stage, one_sided=is_one)
        return Snapshot(self.state, stage, *lights, switches_of(self.frame))

    @moment.setter
    def moment(self, moment: Snapshot) -> None:
        self.state, self.stage, self.held, self.lights, self.light_number, self.light_names, switches = moment
        self.frame = as_switched(self.frame, switches)

    @property
    def control(self) -> Control:
        """All that events change, as the application may have changed it since the last one."""
        return replace(self._control, now=self.moment)

    def take(self, answer: Answer) -> None:
        """Become what the controller made of an event, and do what else it asks for."""
        self._control, asked = answer
        self.moment = self._control.now
        for effect in asked:
            self.perform(effect)

    def perform(self, effect: Effect) -> None:
        """Do what a key, the mouse or the panel asks for (see events.py)."""
        now, history = self.moment, self.document.history
        match effect:
            case ShowMessage(text):
                self.say(text)
            case Remember(kind, seconds, pause):
                history.act(now, kind, seconds, pause)
            case Command.DROP_STEP:
                history.drop_step(now)
            case Command.UNDO | Command.REDO:
                is_undo = effect is Command.UNDO
                found = history.undo(now) if is_undo else history.redo(now)
                self.moment = (found or now).beside(now)
                texts = ("undone", "nothing to undo") if is_undo else ("done again", "nothing to do again")
                self.say(texts[found is None])
            case Command.RESET:
                self.moment = self.document.restart(self.frame).beside(now)
                self.say("all is as at the start")
            case TakeLight(number):  # the one that the mouse held stays where it is
                if number != now.number:
                    self.moment = taking(number, now, self.pose)
                    names, when = titles(now), when_seen(now.state)
                    self.say(f"the mouse holds {names[number]}, light {number + 1} of {len(names)}{when}")
            case Command.ADD_LIGHT:
                self.moment = added(now, self.pose)
            case RemoveLight(number):
                self.moment = removed(number, now, self.pose)
            case ShowFrame(frame):
                self.frame = frame
            case Scrub(index):
                self._wanted = index
            case _:
                assert isinstance(effect, PlayEffect)  # all others need the window
                self._follow(*self.document.playback.obey(effect, self.frame))
                history.follow(self.moment)  # what is shown now has other switches

    def _go_back_after(self, error: BaseException) -> None:
        """Shows what was shown before: the user has ended what takes long, or what was opened cannot be drawn."""
        is_ended, good = isinstance(error, Cancelled), self._last_good
        if good is None and is_ended:
            self.perform(Command.CLOSE)
            return
        if good is None or (good[0] is self.document and not is_ended):
            raise error
        unused, now, was = self.document, self.moment, good[2]
        self.show(*good)
        if unused is self.document:
            state = replace(now.state, look=was.state.look, lit=was.state.lit, finish=was.state.finish)
            self.moment = now._replace(state=state, switches=was.switches)
            self.document.history.withdraw(self.moment)
            self.say("ended: nothing has changed")
        else:
            unused.playback.close()
            self._show_failed("not opened", error)

    def _show_failed(self, what: str, error: BaseException) -> None:
        """Shows why something failed until it is read; whoever has ended it knows."""
        if isinstance(error, Cancelled):
            self.say(what)
        else:
            self.messages.keep(f"{what}: {error_text(error)}")

    def say(self, text: str) -> None:
        """Show a line of text for a few seconds."""
        self.messages.say(text)

    @property
    def own_camera(self) -> Camera:
        """The frame's or the scene's own camera."""
        return camera_of(self.frame)

    @property
    def pose(self) -> NDArray[np.float64]:
        """(4, 4) camera-to-world of the frame's or the scene's own camera."""
        return self.frame.pose

    @property
    def strip(self) -> TimelineBar | None:
        """What the timeline shows; None where frames do not play."""
        return self.document.playback.strip(self.frame)

    def play(self, now: float) -> None:
        """Show the frame that was chosen on the timeline or is due, or the views once they are merged."""
        self.seek()
        playback = self.document.playback
        if playback.whole and (self.state.shadows or turns_away(self.state.pose(self.stage))):  # lights see other sides
            self._follow(playback.completed(), "")
        if playback.is_merging:
            views, self._news = playback.merged()
            self._follow(views, "")
            if views is None:
                self.show_news()
        elif not self._control.is_scrubbing and (frame := playback.advance(self.frame, now)):
            self.frame = frame

    def show_news(self) -> None:
        """Show in words what is seen now."""
        self._follow(None, self._news)
        self._news = ""

    def seek(self) -> None:
        """Show the frame that was chosen on the timeline, if one was."""
        wanted, self._wanted = self._wanted, None
        if wanted is not None:
            self._follow(self.document.playback.obey(Seek(wanted), self.frame)[0], "")

    def plays_in(self, now: float) -> float | None:
        """Return the seconds until something plays; None: no limit."""
        return None if self._control.is_scrubbing else self.document.playback.patience(self.frame, now)

    def _follow(self, frame: Shown | None, text: str) -> None:
        """Shows the frame, unless it stays, and the text, if there is one."""
        if frame is not None:
            self.frame = frame
        if text:
            self.say(text)


def read_dropped(paths: Sequence[str]) -> Dropped:
    """Read what was dropped onto a window, as if `pointshade view` had been given it.

    paths  a folder, a depth file, a scene or point clouds; or several of these kinds, which become one scene; or the
           files of one frame: depth, colour, camera; or several folders

    Raises ValueError, TypeError or OSError for anything else.
    """
    if not paths:
        raise ValueError("the name of what was dropped cannot be read")
    kinds, names = [Kind.of(path) for path in paths], [Path(path).stem for path in paths]
    if {*kinds} == {Kind.CLOUD}:
        clouds: list[Any] = [load_any(path) for path in paths]
        return Dropped([scene_of(*clouds, names=names)], tuple(paths), {})
    if len(paths) == 1:
        return Dropped([(open_source if kinds[0] is Kind.FRAMES else load_any)(paths[0])], tuple(paths), {})
    if {*kinds} != {Kind.FRAMES}:
        return Dropped([beside([load_any(path) for path in paths], names)], tuple(paths), {})
    if all(Path(path).is_dir() for path in paths):
        sources = [open_source(path) for path in paths]
        check_posed(sources)
        return Dropped(sources, tuple(paths), {})
    files = _files_of([Path(path) for path in paths])
    folder = files["depth"].parent
    return Dropped([load_frame(folder, **files)], (str(folder),), files)


def _files_of(paths: list[Path]) -> dict[str, Any]:
    """The files of a frame, by the names of options: one depth, one colour picture at most, one camera at most."""
    items = [ListedFile(path, path.name.lower()) for path in paths]
    pictures = [item for item in items if item.suffix in PICTURES and item.path.is_file()]
    depths = [item for item in pictures if item.role == "depth"] or [
        item for item in pictures if item.suffix in ONLY_DEPTH or is_deep_grey(item.path)
    ]
    colors = [item for item in pictures if item not in depths]
    cameras = [item for item in items if item not in pictures]
    if len(depths) != 1 or len(colors) > 1 or len(cameras) > 1:
        names = ", ".join(path.name for path in paths[:4]) + (", ..." if len(paths) > 4 else "")
        raise ValueError(f"{names}: drop the depth and the colour picture of one frame, a folder, or a scene")
    found = {"depth": depths, "color": colors, "intrinsics": cameras}
    return {name: some[0].path for name, some in found.items() if some}


def check_sources(source: Any, others: Any, views: Any) -> list[Any]:
    """All sources, of a cloud its scene. Raises TypeError or ValueError for what cannot be shown, or not as asked."""
    source = scene_of(source) if isinstance(source, PointCloud) else source
    shows_scene, found = isinstance(source, Scene), items_of(others)
    if not (shows_scene or _gives_frames(source)):
        raise TypeError(f"source must be a Frame, a Scene, a PointCloud or an iterable of frames, got {shown(source)}")
    for other in [others] if found is None else found:
        if found is None or not _gives_frames(other):
            raise TypeError(f"others must be Frames or iterables of frames, got {shown(other)}")
    if found and shows_scene:
        raise TypeError("a scene has no others: they are more sources of frames of the same thing")
    if views is not None and found:
        raise ValueError(f"{option('views')} merges the frames of one sequence, and others are given: leave it out")
    if views is not None and not isinstance(source, Sequence):
        got = "a single frame" if isinstance(source, Frame) else f"a {type(source).__name__}"
        raise ValueError(f"{option('views')} merges the frames of a sequence, and this is {got}: leave it out")
    return [source, *(found or ())]


def _gives_frames(source: Any) -> bool:
    return isinstance(source, Frame | Iterable) and not isinstance(source, str | bytes)


def check_rates(fps: Any, count: int) -> list[float | None]:
    """Frames per second of each source. Raises ValueError for another number of them, or impossible ones."""
    rates = items_of(fps)
    if rates is None or isinstance(fps, str):
        rates = [fps] * count
    if len(rates) != count:
        name = option("fps")
        raise ValueError(f"{name} must be a number of frames per second, or one for each source, got {shown(fps)}")
    return [None if rate is None else check_fps(rate, option("fps"), "frames") for rate in rates]
