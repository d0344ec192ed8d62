"""What a viewer has opened: where frames come from, what they began with, and what was done to them since."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace

import numpy as np

from ..scene.graph import Scene
from ..scene.light import Light
from ..scene.orbit_state import OWN_LIGHT, State
from ..scene.orbit_target import Stage
from .command import Typed
from .history import History, Moment
from .playing import Playing
from .shown import Shown, home_of


class Opened:
    """A frame, a stream of frames or a scene, under its own lights unless others are given.

    playing  closed here if it has nothing to show; afterwards whoever opened it does that
    typed    how the command line names it; None: it does not
    merge    frames of a sequence are read to be merged

    first    what was shown first: the user may have hidden something since
    light_names  of the lights of a scene
    start    the moment that R brings back
    history  the steps since then
    """

    def __init__(
        self, playing: Playing, typed: Typed | None, state: State, lights: Sequence[Light] = (), merge: bool = False
    ):
        self.playing, self.typed = playing, typed
        with ExitStack() as undo:
            undo.callback(playing.close)
            self.first = first = playing.first(merge)
            self.light_names: Sequence[str] = ()
            if isinstance(first, Scene) and not lights:
                self.light_names, lights = first.light_names, first.lights
            self.start_at(_moment(first, state, lights), first)
            undo.pop_all()

    def start_at(self, moment: Moment, shown: Shown) -> None:
        """R comes back to this, and nothing before it can be undone."""
        self.start, self._pose = moment, np.asarray(home_of(shown).pose)
        self.history = History(moment)

    def restart(self, shown: Shown) -> Moment:
        """View and lights as at the start, around the middle of what is shown now. Lights of the world stay there."""
        stage, pose = Stage.of(home_of(shown)), np.asarray(home_of(shown).pose)
        state, before, held, *_ = start = self.start
        if stage.is_as(before) and np.array_equal(pose, self._pose):
            return start
        if held is not OWN_LIGHT:  # it stands in the world, not beside the viewer
            state = state.with_light(state.light(before, self._pose, held), stage, pose)
        return start._replace(state=state, stage=stage)


def _moment(shown: Shown, state: State, lights: Sequence[Light]) -> Moment:
    """The mouse holds the first of the lights. There are shadows if one of them casts any, and in scenes."""
    home = home_of(shown)
    stage = Stage.of(home)
    if lights:
        state = state.with_light(lights[0], stage, np.asarray(home.pose))
    if isinstance(shown, Scene) or any(light.shadow for light in lights):
        state = replace(state, shadows=True)
    return Moment(state, stage, lights[0] if lights else OWN_LIGHT, tuple(lights[1:]))
