"""Undo and redo: what view, lights, look and switches were before each step of the user."""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable
from dataclasses import replace
from typing import NamedTuple

from ..scene.light import Light
from ..scene.orbit import Pair, Stage, State
from .switches import Switches

STEPS = 200  # that can be undone
PAUSE = 0.7  # seconds between two changes of one kind that are one step: of the wheel, of a slider


class Moment(NamedTuple):
    """All that is undone: view, lights, look and switches. Whether help, panel and readout are shown is not.

    held    the kind of light that the mouse holds
    lights  the others
    number  of the light that the mouse holds
    names   of the lights, by their numbers; those without one may be missing at the end
    switches  of what is shown: views or nodes that are off, how clouds look
    """

    state: State
    stage: Stage
    held: Light
    lights: tuple[Light, ...]
    number: int = 0
    names: tuple[str, ...] = ()
    switches: Switches = ()

    def shows(self, other: Moment) -> bool:
        """Whether all that is undone is the same."""
        return self.stage is other.stage and self.beside(other)._replace(stage=None) == other._replace(stage=None)

    def beside(self, now: Moment) -> Moment:
        """The same, with help, panel and readout as they are at another moment."""
        state = now.state
        return self._replace(state=replace(self.state, help=state.help, panel=state.panel, readout=state.readout))


class History:
    """Remembers the moments before the last steps."""

    def __init__(self, now: Moment):
        self._past: deque[Moment] = deque(maxlen=STEPS)
        self._future: deque[Moment] = deque(maxlen=STEPS)
        self._now = now
        self._rest: Pair = now.state.light_at  # where the light was after the last step
        self._kind: Hashable = None
        self._until = 0.0

    def follow(self, now: Moment) -> None:
        """Something changed that is no step: the light went with the mouse, an application moved something."""
        self._now = now

    def act(self, now: Moment, kind: Hashable = None, time: float = 0.0, pause: float = PAUSE) -> None:
        """Something may have changed by a step. Changes of one kind with no longer pause (seconds) are one step.

        kind  None: a step of its own; "place": it takes the light back to where it was after the step before
        """
        if now.shows(self._now):
            return
        if kind is None or kind != self._kind or time > self._until:
            before = self._now
            if kind == "place":
                before = before._replace(state=replace(before.state, light_at=self._rest))
            self._past.append(before)
        elif now.shows(self._past[-1]):  # there and back
            self.drop_step(now)
            return
        self._future.clear()
        self._kind, self._until = kind, time + pause
        self._settle(now)

    def undo(self, now: Moment) -> Moment | None:
        """What was before the last step; None if there is none."""
        return self._go(now, self._past, self._future)

    def redo(self, now: Moment) -> Moment | None:
        """What was before the last undo; None if another step was made since."""
        return self._go(now, self._future, self._past)

    def drop_step(self, now: Moment) -> None:
        """The last step becomes a part of the one that follows."""
        self._past.pop()
        self._kind = None
        self.follow(now)

    def withdraw(self, now: Moment) -> None:
        """The last step did not come to be: this is what was before it."""
        if self._past and now.shows(self._past[-1]):
            self._past.pop()
        self._kind = None
        self._settle(now)

    def _go(self, now: Moment, there: deque[Moment], back: deque[Moment]) -> Moment | None:
        if not there:
            return None
        back.append(now)
        self._kind = None
        self._settle(there.pop())
        return self._now

    def _settle(self, now: Moment) -> None:
        self._now, self._rest = now, now.state.light_at
