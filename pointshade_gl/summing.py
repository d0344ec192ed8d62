"""Adds up the samples of a picture, with the shadows on its ground, and develops the sum."""

from __future__ import annotations

import moderngl

from .drawing import Drawing
from .finish import Finish, Vector
from .gpu.canvas import Canvas
from .gpu.develop import DevelopPass
from .gpu.lamps import Lamps
from .gpu.light import LightPass
from .gpu.objects import Thing
from .gpu.passes import FullscreenPass
from .gpu.steps import Steps
from .gpu.target import Target
from .ground import ground_under, seen_ground
from .lamplighting import Lamplighting
from .placed import Placed
from .samples import at_sample
from .shot import Shot


class Summing:
    """Makes finished pictures. A target keeps its sum: more samples of the same are added to it."""

    def __init__(
        self, context: moderngl.Context, steps: Steps, light: LightPass, lamplighting: Lamplighting, drawing: Drawing
    ):
        self._gl = context
        self._steps = steps
        self._light = light
        self._lamplighting = lamplighting
        self._drawing = drawing
        self._develop: DevelopPass | None = None  # these two are made for the first picture that needs them
        self._ground: FullscreenPass | None = None

    def draw(self, target: Target, shot: Shot, things: dict[Placed, Thing], finish: Finish) -> None:
        """The finished picture."""
        self._develop = self._develop or DevelopPass(self._gl)
        self._add_samples(target, shot, things, self._develop, finish)
        self._develop.develop(target, finish.samples, finish.background)

    def forget(self, target: Target) -> None:
        """Lets go of a scene that is no longer shown."""
        target.samples.content = None
        for step in ("up", "ground"):
            self._steps.forget(step)

    def _add_samples(
        self, target: Target, shot: Shot, things: dict[Placed, Thing], develop: DevelopPass, finish: Finish
    ) -> None:
        """The sums of the samples. Of a picture that shows the same as the last one, only those that are missing."""
        sums, has_ground = target.samples, not isinstance(finish.ground, bool)
        content = (
            shot.scene,
            tuple(shot.lights),
            shot.eye.camera,
            shot.eye.pose.tobytes(),
            finish.ground,
            finish.ground_height,
        )
        done = sums.count if sums.content == content and sums.count <= finish.samples else 0
        if not done:
            sums.clear(has_ground)
        sums.content = None  # stays so if a sample fails
        is_soft, lamps = any(light.is_soft for light in shot.lights), None
        for k in range(done, finish.samples):
            sample = at_sample(shot, k)
            if is_soft or lamps is None:
                lamps = self._lamplighting.hang_up(sample, things)
                self._lamplighting.light_points(sample, things, lamps)
            self._drawing.draw(target, develop.canvas(sums), sample, things, lamps)
            if not isinstance(finish.ground, bool) and lamps.shadow_map is not None:
                self._draw_ground(
                    target, sample, lamps, develop.ground_canvas(sums), finish.ground, finish.ground_height
                )
        sums.content, sums.count = content, finish.samples

    def _draw_ground(
        self, target: Target, shot: Shot, lamps: Lamps, canvas: Canvas, up: Vector, height: float | None
    ) -> None:
        """The shadows on the ground, where nothing else is seen. Lights with shadows have left the surfaces there."""
        self._ground = self._ground or FullscreenPass(self._gl, "ground.frag")
        ground = self._steps.run("ground", ground_under, shot.scene, up, height)
        inputs = self._light.inputs(lamps.seen_from(shot.eye.pose)) | {"surface_map": target.surfaces.surface}
        inputs |= {"intrinsics": shot.eye.camera.intrinsics, "plane": seen_ground(ground, shot.eye.pose)}
        with canvas.opened((0, 0, *target.size)) as image:
            self._ground.draw(image, {}, material=shot.materials[0].strengths, **inputs)

    def release(self) -> None:
        for item in (self._develop, self._ground):
            if item is not None:
                item.release()
