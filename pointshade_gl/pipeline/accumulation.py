"""Averages several samples of a picture into the final one, with shadows on the ground."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import Count
from ..gpu.core.images import read_texture
from ..gpu.core.programs import FullscreenPasses
from ..gpu.core.steps import Steps
from ..gpu.core.view_images import Target
from ..gpu.drawables import Drawables
from ..gpu.shading.light_pass import LightPass
from ..gpu.shading.light_set import HIGHLIGHTS, LightSet, around_inputs
from ..gpu.shading.occlusion import plane_shift, plane_turn
from ..scene.sample_pattern import at_sample
from ..scene.settings import SIMPLE, Finish, Vector
from ..scene.visible import VisibleScene, looking_distance
from .frame_pass import FramePass
from .light_setup import LightSetup
from .shared_samples import SharedSamples

if TYPE_CHECKING:
    from ..gpu.shading.present import ResolveSamplesPass


class Accumulator(FullscreenPasses):
    """Averages samples into finished pictures. A target keeps its sum, for more samples of the same picture."""

    def __init__(
        self,
        context: moderngl.Context,
        steps: Steps,
        light: LightPass,
        light_setup: LightSetup,
        frame_pass: FramePass,
        shared: SharedSamples,
    ):
        super().__init__(context)
        self._steps = steps
        self._light = light
        self._light_setup = light_setup
        self._frame_pass = frame_pass
        self._shared = shared

    @cached_property
    def _develop(self) -> ResolveSamplesPass:
        from ..gpu.shading.present import ResolveSamplesPass  # only here

        return self._keep(ResolveSamplesPass(self._context))

    def draw(self, target: Target, visible: VisibleScene, drawables: Drawables, finish: Finish, count: Count) -> None:
        """Draw the finished picture: all its samples, averaged and counted."""
        self._add_samples(target, visible, drawables, finish, count)
        self._develop.develop(target, finish)

    def read_light(self, target: Target, visible: VisibleScene, drawables: Drawables) -> NDArray[np.float32]:
        """Return (h, w, 4), read-only: the light of one sample, linear, not cut off at 1, and its coverage."""
        self._add_samples(target, visible, drawables, SIMPLE, Count())
        return read_texture(self._context, target.samples.surfaces.texture)

    def forget(self, target: Target) -> None:
        """Forget a scene that is no longer shown."""
        target.samples.content = None
        for step in ("up", "ground"):
            self._steps.forget(step)

    def _add_samples(
        self, target: Target, visible: VisibleScene, drawables: Drawables, finish: Finish, count: Count
    ) -> None:
        """Add up the samples. If the picture shows the same as the last one, only the missing ones are drawn."""
        sums, has_ground = target.samples, not isinstance(finish.ground, bool)
        eye = visible.eye.camera, visible.eye.pose.tobytes()
        content = (
            visible.scene,
            tuple(visible.lights),
            *eye,
            finish.ground,
            finish.ground_height,
            visible.gain,
            visible.surroundings,
            visible.scale,
        )
        done = sums.count if sums.content == content and sums.count <= finish.samples else 0
        if not done:
            sums.clear(has_ground)
        sums.content = None  # stays so if a sample fails
        count.step(done)
        try:
            self._add_missing(target, visible, drawables, finish, count, done)
        finally:
            target.splats.draw_only(None)
        sums.content, sums.count = content, finish.samples

    def _add_missing(
        self, target: Target, visible: VisibleScene, drawables: Drawables, finish: Finish, count: Count, done: int
    ) -> None:
        """Add up the samples that are not there yet. In large stills many pixels share what they have in common."""
        sums, is_soft, light_set = target.samples, any(light.is_soft for light in visible.lights), None
        canvas = self._develop.canvas(sums.surfaces)
        for k in range(done, finish.samples):
            sample = at_sample(visible, k)
            if is_soft or light_set is None:
                light_set = self._light_setup.prepare(sample, drawables)
                self._light_setup.light_points(sample, drawables, light_set)
            if k == 0 and not is_soft and self._shared.draw(target, visible, drawables, light_set, finish.samples):
                canvas = self._develop.rest_canvas(sums)
                target.splats.draw_only(sums.active.texture)
            self._frame_pass.draw(target, canvas, sample, drawables, light_set)
            if finish.up is not None and light_set.shadow_map is not None:
                self._draw_ground(target, sample, light_set, finish.up, finish.ground_height)
            count.step()

    def _draw_ground(
        self, target: Target, visible: VisibleScene, light_set: LightSet, up: Vector, height: float | None
    ) -> None:
        """Draw shadows on the ground where no surface is visible. Lights with shadows make `draw` keep surfaces."""
        from ..estimation.ground import ground_under, seen_ground  # only here

        ground = self._steps.run("ground", ground_under, visible.scene, up, height)
        lighting, around = light_set.seen_from(visible.eye.pose), visible.surroundings
        inputs = self._light.inputs(lighting) | {"surface_map": target.surfaces.surface}
        inputs |= {"intrinsics": visible.eye.camera.intrinsics, "plane": seen_ground(ground, visible.eye.pose)}
        inputs |= around_inputs(lighting)
        constants = {"SHADOWS": lighting.shadows.kind} if lighting.shadows else {}
        constants |= {"ENVIRONMENT": 1} if around.environment else {}  # the ground is matt
        inputs = {name: value for name, value in inputs.items() if name not in HIGHLIGHTS}
        if around.occlusion:
            constants |= {"VISIBILITY": 1}
            inputs["radius"] = around.radius(looking_distance(visible.scene, visible.eye.pose))
            inputs["shift"] = plane_shift(visible.sample)
            inputs["turned"] = plane_turn(visible.sample)
        with self._develop.canvas(target.samples.ground).opened((0, 0, *target.size)) as image:
            shadows = self.fullscreen("shading/ground.frag", None, **constants)
            shadows.draw(image, {}, material=visible.materials[0].strengths, **inputs)
