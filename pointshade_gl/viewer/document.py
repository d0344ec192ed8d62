"""What a window has opened: where frames come from, what they began with, and what was done to them since."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..checks.arguments import check_fps, items_of
from ..files.access.folders import ListedFile
from ..files.access.known_names import COLOR_SUFFIXES, DEPTH_SUFFIXES, ONLY_DEPTH, VIDEO_SUFFIXES
from ..files.frame_sources import check_posed, is_cloud, is_scene, load_any, open_source
from ..files.frames.frame_files import load_frame
from ..files.pictures.picture_files import is_deep_grey
from ..notes.words import option, shown
from ..scene.frame import Frame
from ..scene.graph import Scene, scene_of
from ..scene.light import Light
from ..scene.orbit import OWN_LIGHT, OrbitStage, State
from ..scene.settings import Metering
from ..scene.viewpoint import View
from .playback import Playback
from .state import History, Shown, Snapshot, Views, home_of, pose_of, switches_of

PICTURES = {*COLOR_SUFFIXES, *DEPTH_SUFFIXES} - set(VIDEO_SUFFIXES)


class Dropped(NamedTuple):
    """What was dropped onto a window.

    source  the frame, the sequence or the scene
    others  more sources of frames of the same thing
    inputs  paths of the folders or of the file
    files   of a single frame, by the names of `load_frame`'s options, where they were dropped one by one
    paths   as they were dropped
    """

    source: Any
    others: Sequence[Any]
    inputs: tuple[str, ...]
    files: dict[str, Path]
    paths: tuple[str, ...] = ()


class Document:
    """A frame, a stream of frames or a scene, under its own lights unless others are given.

    playback  closed here if it has nothing to show; afterwards whoever opened it does that
    dropped  what of it came by a drop onto the window; None: the program opened it
    merge    frames of a sequence are read to be merged
    place    from where it is seen at first, of which only the pose or how it is moved counts; None: as the state says

    title    what was dropped, in words
    first    what was shown first: the user may have hidden something since
    start    the moment that R brings back
    history  the steps since then
    exposure  of its first lit picture, as soon as that is drawn
    """

    def __init__(
        self,
        playback: Playback,
        state: State,
        lights: Sequence[Light] = (),
        merge: bool = False,
        dropped: Dropped | None = None,
        place: View | None = None,
    ):
        self.playback, self.dropped = playback, dropped
        self.title = " and ".join(dropped.paths) if dropped else ""
        self.exposure: float | Metering = "sensor"
        with ExitStack() as undo:
            undo.callback(playback.close)
            self.first = first = playback.first(merge)
            names: Sequence[str] = ()
            if isinstance(first, Scene) and not lights:
                names, lights = first.light_names, first.lights
            self.start_at(_moment(first, _placed(state, first, place), lights, names), first)
            undo.pop_all()

    def instead(self, paths: Sequence[str], state: State) -> Document:
        """Open what was dropped onto the window, with this look. Raises ValueError, TypeError or OSError."""
        found = read_dropped(paths)._replace(paths=tuple(paths))
        playback = self.playback.instead([found.source, *found.others])
        return Document(playback, state.reset_view(State()), dropped=found)

    def start_at(self, moment: Snapshot, shown: Shown) -> None:
        """R comes back to this, and nothing before it can be undone."""
        self.start, self._pose = moment, pose_of(shown)
        self.history = History(moment)

    def restart(self, shown: Shown) -> Snapshot:
        """All as at the start, around the middle of what is shown now. Lights of the world stay there."""
        stage, pose = OrbitStage.of(home_of(shown)), pose_of(shown)
        start = self.start._replace(switches=shown.all_on().on) if isinstance(shown, Views) else self.start
        state, before, held, *_ = start
        if stage.is_as(before) and np.array_equal(pose, self._pose):
            return start
        if held is not OWN_LIGHT:  # it stands in the world, not beside the viewer
            state = state.with_light(state.light(before, self._pose, held), stage, pose)
        return start._replace(state=state, stage=stage)


def _placed(state: State, shown: Shown, place: View | None) -> State:
    """Return the state as it is seen from a place."""
    if place is None:
        return state
    _, pose = place.seen(home_of(shown))
    return state.seen_from(np.linalg.inv(pose_of(shown)) @ pose, OrbitStage.of(home_of(shown)))


def _moment(shown: Shown, state: State, lights: Sequence[Light], names: Sequence[str]) -> Snapshot:
    """The mouse holds the first of the lights. There are shadows if one of them casts any, and in scenes, whose
    environment counts unless there is another."""
    stage = OrbitStage.of(home_of(shown))
    if lights:
        state = state.with_light(lights[0], stage, pose_of(shown))
    if isinstance(shown, Scene) and state.finish.environment is None:
        state = state.with_finish(environment=shown.environment)
    if isinstance(shown, Scene) or any(light.shadow for light in lights):
        state = replace(state, shadows=True)
    held, *others = lights or [OWN_LIGHT]
    return Snapshot(state, stage, held, tuple(others), 0, tuple(names), switches_of(shown))


def read_dropped(paths: Sequence[str]) -> Dropped:
    """Read what was dropped onto a window, as if `pointshade view` had been given it.

    paths  a folder, a depth file, a scene or point clouds; or the files of one frame: depth, colour, camera; or several
           folders

    Raises ValueError, TypeError or OSError for anything else.
    """
    if not paths:
        raise ValueError("the name of what was dropped cannot be read")
    if all(map(is_cloud, paths)):
        clouds: list[Any] = [load_any(path) for path in paths]
        return Dropped(scene_of(*clouds, names=[Path(path).stem for path in paths]), (), tuple(paths), {})
    if len(paths) == 1:
        return Dropped((load_any if is_scene(paths[0]) else open_source)(paths[0]), (), tuple(paths), {})
    if all(Path(path).is_dir() for path in paths):
        first, *others = map(open_source, paths)
        check_posed((first, *others))
        return Dropped(first, others, tuple(paths), {})
    files = _files_of([Path(path) for path in paths])
    folder = files["depth"].parent
    return Dropped(load_frame(folder, **files), (), (str(folder),), files)


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
    """The others in a list. Raises TypeError or ValueError for what cannot be shown, or not as it is asked for."""
    if not isinstance(source, Frame | Scene | Iterable) or isinstance(source, str | bytes):
        raise TypeError(f"source must be a Frame, a Scene, a PointCloud or an iterable of frames, got {shown(source)}")
    for other in [others] if (found := items_of(others)) is None else found:
        if found is None or not isinstance(other, Frame | Iterable) or isinstance(other, str | bytes):
            raise TypeError(f"others must be Frames or iterables of frames, got {shown(other)}")
    if found and isinstance(source, Scene):
        raise TypeError("a scene has no others: they are more sources of frames of the same thing")
    if views is not None and found:
        raise ValueError(f"{option('views')} merges the frames of one sequence, and others are given: leave it out")
    if views is not None and (isinstance(source, Frame) or not isinstance(source, Sequence)):
        got = "a single frame" if isinstance(source, Frame) else f"a {type(source).__name__}"
        raise ValueError(f"{option('views')} merges the frames of a sequence, and this is {got}: leave it out")
    return list(found or ())


def check_rates(fps: Any, count: int) -> list[float | None]:
    """Frames per second of each source. Raises ValueError for another number of them, or impossible ones."""
    rates = items_of(fps)
    if rates is None or isinstance(fps, str):
        rates = [fps] * count
    if len(rates) != count:
        name = option("fps")
        raise ValueError(f"{name} must be a number of frames per second, or one for each source, got {shown(fps)}")
    return [None if rate is None else check_fps(rate, option("fps"), "frames") for rate in rates]
