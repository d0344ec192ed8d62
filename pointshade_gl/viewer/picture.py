"""The picture that a window shows below marker, text and panel, as `Renderer.render` is asked for it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..renderer.requests import RenderRequest
from ..scene.appearance import Material
from ..scene.camera import Camera
from ..scene.frame import Frame
from ..scene.graph import shaded, without_environment
from ..scene.light import Light
from ..scene.orbit import UPPER_LEFT
from ..scene.settings import Metering
from .state import Shown, Snapshot, camera_of, pose_of, scene_in, views_in


@dataclass(frozen=True, eq=False)
class ShownPicture:
    """A picture of what is shown, by a camera that is fitted to its size.

    now    view, lights and look
    shown  the frame, the views or the scene
    plays  whether the next frame comes by itself
    exposure  as of Finish: found for the first picture, then the same, so that light is seen to become more or less
    """

    now: Snapshot
    shown: Shown
    camera: Camera
    exposure: float | Metering = "sensor"
    plays: bool = False

    @property
    def content(self) -> tuple[Any, ...]:
        """Everything that it depends on, to be compared."""
        state = replace(self.now.state, help=False, panel=False, readout=None)
        if not state.is_lit:  # the light may go on following the mouse
            return replace(state, light_at=UPPER_LEFT), self.shown, self.camera
        return state, self.now.lights, self.now.held, self.shown, self.camera

    @property
    def pose(self) -> NDArray[np.float64]:
        """(4, 4) camera-to-world of who looks."""
        return pose_of(self.shown) @ self.now.state.pose(self.now.stage)

    @property
    def lights(self) -> list[Light]:
        """The light that the mouse holds, then the others."""
        held = self.now.state.light(self.now.stage, pose_of(self.shown), self.now.held)
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
            source = views.shown if views else self.shown
            return RenderRequest(source, self.lights, look, self.camera, self.pose, finish=finish)
        scene = without_environment(scene) if finish.environment is None and scene.environment else scene
        shading = "none" if not state.lit else state.look.shading if state.look.shading != "phong" else None
        return RenderRequest(shaded(scene, shading), self.lights, camera=self.camera, pose=self.pose, finish=finish)

    @property
    def preparation(self) -> Preparation | None:
        """Return what must be found before this can be drawn, and takes long; None if nothing does."""
        state, scene, views = self.now.state, scene_in(self.shown), views_in(self.shown)
        look = state.look if state.lit and state.finish.is_light else state.look.as_taken
        if scene:
            return Preparation((tuple(placed.content for placed in scene.things),), "preparing the scene")
        if views is None:
            return Preparation((self.shown,), "dividing the light out") if look.finds_light else None
        needs = replace(look.of_points, shading="none", material=Material())
        what = f"{len(views.shown)} views"
        titles = (look.remove_highlights, f"taking the highlights out of {what}"), (look.align, f"aligning {what}")
        return Preparation((views.shown, needs), next((title for on, title in titles if on), f"merging {what}"))

    def most_samples(self, samples: int) -> int:
        """Return as many, or 1 for a photograph seen as it was taken: it has no more, and stays sharp."""
        state, stage = self.now.state, self.now.stage
        is_own = isinstance(self.shown, Frame) and self.camera == camera_of(self.shown)
        is_there = np.allclose(state.pose(stage), np.eye(4), rtol=0, atol=1e-9 * stage.radius)
        is_plain = state.finish.is_light and (not state.lit or state.look.shading == "none")
        return 1 if is_own and is_there and is_plain else samples


class Preparation(NamedTuple):
    """What is found before a picture is drawn.

    key    compares as what it depends on
    title  what the user is told meanwhile
    """

    key: tuple[Any, ...]
    title: str
