"""The picture that a window shows below marker, text and panel, as `Renderer.render` is asked for it, and when."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..renderer.requests import RenderRequest
from ..scene.appearance import Material
from ..scene.camera import Camera
from ..scene.graph import shaded, without_environment
from ..scene.light import Light
from ..scene.orbit import UPPER_LEFT
from ..scene.settings import Metering
from .state import Shown, Snapshot, camera_of, frame_in, scene_in, views_in


@dataclass(frozen=True, eq=False)
class ShownPicture:
    """A picture of what is shown, by a camera that is fitted to its size.

    now    view, lights and look
    shown  the frame, the views or the scene
    plays  whether the next frame comes by itself
    exposure  as of OutputSettings: found for the first picture, then the same, so that light is seen to grow or fade
    """

    now: Snapshot
    shown: Shown
    camera: Camera
    exposure: float | Metering = "sensor"
    plays: bool = False

    @cached_property
    def content(self) -> tuple[Any, ...]:
        """Everything that it depends on, to be compared."""
        state = replace(self.now.state, help=False, panel=False, readout=None)
        if not state.is_lit:  # the light may go on following the mouse
            return replace(state, light_at=UPPER_LEFT), self.shown, self.camera
        return state, self.now.lights, self.now.held, self.shown, self.camera

    @cached_property
    def pose(self) -> NDArray[np.float64]:
        """(4, 4) camera-to-world of who looks."""
        return self.shown.pose @ self.now.state.pose(self.now.stage)

    @cached_property
    def lights(self) -> list[Light]:
        """The light that the mouse holds, then the others."""
        held = self.now.state.light(self.now.stage, self.shown.pose, self.now.held)
        return [replace(light, shadow=light.shadow and self.now.state.shadows) for light in (held, *self.now.lights)]

    def request(self, samples: int = 1, rests: bool = True) -> RenderRequest:
        """Return what a renderer is asked for. rests: it will be refined no more, or is already."""
        state, scene, views = self.now.state, scene_in(self.shown), views_in(self.shown)
        plain: dict[str, Any] = {"background": None, "ground": False, "ground_height": None}
        if not rests and state.finish.ambient_occlusion is None and (self.plays or scene):
            plain["ambient_occlusion"] = False  # until it rests: it is found for each frame, in scenes for each view
        finish = replace(state.finish, samples=samples, exposure=self.exposure, **plain)
        if scene is None:
            look = state.look if state.lit else state.look.as_taken
            source: Any = views.shown if views else self.shown
            return RenderRequest(source, self.lights, look, self.camera, self.pose, finish=finish)
        scene = without_environment(scene) if finish.environment is None and scene.environment else scene
        shading = "none" if not state.lit else state.look.shading if state.look.shading != "phong" else None
        return RenderRequest(shaded(scene, shading), self.lights, camera=self.camera, pose=self.pose, finish=finish)

    @property
    def preparation(self) -> tuple[tuple[Any, ...], str] | None:
        """Return what must be found before this can be drawn, and takes long: something that compares as what that
        depends on, and what the user reads meanwhile; None if nothing does."""
        state, scene, views = self.now.state, scene_in(self.shown), views_in(self.shown)
        look = state.look if state.lit and state.finish.is_light else state.look.as_taken
        if scene:
            return tuple(placed.content for placed in scene.instances), "preparing the scene"
        if views is None:
            return ((self.shown,), "dividing the light out") if look.finds_light else None
        needs = replace(look.of_points, shading="none", material=Material())
        what = f"{len(views.shown)} views"
        titles = (look.remove_highlights, f"taking the highlights out of {what}"), (look.align, f"aligning {what}")
        return (views.shown, needs), next((title for on, title in titles if on), f"merging {what}")

    def most_samples(self, samples: int) -> int:
        """Return as many, or 1 for a photograph seen as it was taken: it has no more, and stays sharp."""
        return 1 if self._is_photograph else samples

    @cached_property
    def _is_photograph(self) -> bool:
        state, stage = self.now.state, self.now.stage
        is_own = frame_in(self.shown) is not None and self.camera == camera_of(self.shown)
        is_plain = state.finish.is_light and (not state.lit or state.look.shading == "none")
        is_there = is_own and is_plain and np.allclose(state.pose(stage), np.eye(4), rtol=0, atol=1e-9 * stage.radius)
        return bool(is_there)


REST = 0.2  # seconds that nothing moves before the picture is refined: moving must not wait for it
MOST_ADDED = 3  # samples a turn at most: between two turns the window answers
ADDING_SECONDS = 0.1  # seconds that they may take, if that is not less than one
RATE_GAPS = 20  # times between two pictures
RATE_PAUSE = 0.5  # seconds after which the next picture's rate begins anew


class Rate:
    """Measures how many pictures come per second, while they come: `tick` when one does."""

    def __init__(self) -> None:
        self._gaps: deque[float] = deque(maxlen=RATE_GAPS)
        self._last = float("-inf")

    def tick(self, now: float) -> None:
        if now - self._last > RATE_PAUSE:
            self._gaps.clear()
        else:
            self._gaps.append(now - self._last)
        self._last = now

    @property
    def per_second(self) -> float | None:
        """The mean of the last ones; None before two came in a row."""
        spent = sum(self._gaps)
        return len(self._gaps) / spent if spent else None


class Redrawing:
    """Remembers what a window shows: a picture, and what lies over it (marker, text, panel), as values to compare.

    samples  that the picture has: one while things move, more and more while nothing does
    rate     of the pictures that differ
    drawn    how often the window was drawn
    """

    def __init__(self) -> None:
        self.samples, self.rate, self.drawn = 1, Rate(), 0
        self._shown: Any = None
        self._picture: Any = None
        self._since = self._began = 0.0
        self._added, self._more = 1, MOST_ADDED  # samples of this turn, and of the next one

    def forget(self) -> None:
        """Draw anew in any case: the window lost its content."""
        self._shown = None

    def patience(self, picture: Any, over: Any, now: float, most: int) -> float | None:
        """Return the seconds until the window must be drawn; None: not before something changes."""
        return self._rest(picture, now, most) if (picture, over) == self._shown else 0.0

    def begin(self, picture: Any, now: float, most: int) -> int:
        """Return how many samples the next picture has. It is drawn anew if it has changed."""
        before, self._began = self.samples, now
        if picture != self._picture:
            self.rate.tick(now)
            self._picture, self._since, self.samples, before = picture, now, 1, 0
        elif self._rest(picture, now, most) == 0:
            self.samples = min(self.samples + self._more, most)
        self._added = self.samples - before
        return self.samples

    def end(self, picture: Any, over: Any, now: float) -> None:
        """Remember that this was drawn, until now; None is the picture before, drawn again."""
        self._shown = picture, over
        self.drawn += 1
        if picture is not None and self._added:
            self._more = max(1, min(MOST_ADDED, int(ADDING_SECONDS * self._added / max(now - self._began, 1e-6))))

    def _rest(self, picture: Any, now: float, most: int) -> float | None:
        """Seconds until more samples are due; None: they are not."""
        if picture != self._picture or self.samples >= most:
            return None
        return max(self._since + REST - now, 0.0)
