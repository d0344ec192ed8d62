"""The pipeline: a scene in, a lit picture on the GPU out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .camera import Camera
from .drawing import Drawing
from .finish import SIMPLE, Finish
from .gpu.canvas import Canvas
from .gpu.context import Context
from .gpu.images import Box
from .gpu.light import LightPass
from .gpu.objects import Objects, Thing
from .gpu.point_objects import ShownPoints
from .gpu.rasterizers import Rasterizers
from .gpu.steps import Steps
from .gpu.target import Target
from .gpu.tiles import TiledPoints
from .lamplighting import Lamplighting
from .light import Light
from .placed import Matrix, Placed
from .scene import Scene
from .shot import compose
from .summing import Summing
from .things import Things


class Pipeline:
    """Draws scenes, and keeps what the next picture can use again.

    What is in view (shot.py) is put on the GPU (things.py), lamps are hung up (lamplighting.py), and what is seen is
    drawn and lit (drawing.py); several such samples are added up (summing.py).
    """

    def __init__(self, context: Context, steps: Steps, can_compute: bool, merge: float):
        self._gl = context.gl
        self.steps = steps
        rasterizers = Rasterizers(context.gl, context.is_software, can_compute, merge)
        self._objects = Objects(context.gl, steps, rasterizers)
        self.things = Things(context.gl, steps, self._objects)
        self._light = LightPass(context.gl)
        self._lamplighting = Lamplighting(context.gl, steps, self._objects, self._light)
        self._drawing = Drawing(steps, self._objects, self._light)
        self._summing = Summing(context.gl, steps, self._light, self._lamplighting, self._drawing)
        self._target: Target | None = None
        self._drawn: Scene | None = None  # the last scene

    def draw(
        self, scene: Scene, lights: Sequence[Light], camera: Camera, pose: Matrix, finish: Finish = SIMPLE
    ) -> Target:
        """The scene under these lights, as a camera at a pose (4, 4) sees it."""
        shot = compose(scene, lights, camera, pose)
        things = self.things.prepare(shot)
        self._drawn = scene
        target = self._fit_target(camera)
        if target.samples.content and target.samples.content[0] is not scene:
            self._summing.forget(target)
        if finish != SIMPLE:
            self._summing.draw(target, shot, things, finish)
            return target
        lamps = self._lamplighting.hang_up(shot, things)
        if not self._drawing.draw_lit_splats(target, shot, things, lamps):
            self._lamplighting.light_points(shot, things, lamps)
            self._drawing.draw(target, Canvas(target.picture), shot, things, lamps)
        return target

    def read(self) -> NDArray[np.uint8]:
        """The last picture as (h, w, 4), top row first."""
        assert self._target is not None, "nothing was drawn"
        return self._target.read()

    def read_surfaces(self, scene: Scene, camera: Camera, pose: Matrix) -> NDArray[np.float32]:
        """(h, w, 4), read-only: unit normal and z of the surfaces that a camera at a pose (4, 4) sees, its axes, world
        units. z is 0 where there is none, the normal where no light is wanted."""
        return self._draw_surfaces(scene, camera, pose).surfaces.read()

    def read_depth(self, camera: Camera, pose: Matrix, box: Box) -> NDArray[np.float32]:
        """(h, w) of a part of a view of the last scene that was drawn: z of its surfaces as in `read_surfaces`."""
        assert self._drawn is not None, "nothing was drawn"
        return self._draw_surfaces(self._drawn, camera, pose).surfaces.read_depth(box)

    def _draw_surfaces(self, scene: Scene, camera: Camera, pose: Matrix) -> Target:
        shot = compose(scene, (), camera, pose)
        things = self.things.prepare(shot)
        lamps = self._lamplighting.hang_up(shot, things)
        target = self._fit_target(camera)
        self._drawing.draw_surfaces(target, shot, things, lamps)
        return target

    def read_points(
        self, scene: Scene, lights: Sequence[Light], pose: Matrix
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """The points of a frame whose shading is flat, as somebody at a pose (4, 4) sees them.

        Returns (h, w, 4) unit normal and depth, camera axes, and (h, w, 4) their linear light. Both are read-only;
        depth 0 where there is no point.
        """
        shot = compose(scene, lights, scene.things[0].content.frame.camera, pose)
        things = self.things.prepare(shot)
        lamps = self._lamplighting.hang_up(shot, things)
        self._lamplighting.light_points(shot, things, lamps)
        thing = things[shot.shown[0]]
        if isinstance(thing, TiledPoints):
            read = (lambda part: part.textures.surface.read()), (lambda part: part.textures.lit.read())
            return thing.gather(read[0]), thing.gather(read[1])
        assert isinstance(thing, ShownPoints)
        return thing.textures.surface.read(), thing.textures.lit.read()

    def prepare_all(self, scene: Scene, camera: Camera, pose: Matrix) -> dict[Placed, Thing]:
        """All things of a scene on the GPU, also those that this view does not show."""
        return self.things.prepare(compose(scene, (), camera, pose)._replace(shown=scene.things))

    def _fit_target(self, camera: Camera) -> Target:
        size = camera.width, camera.height
        if self._target is None or self._target.size != size:
            if self._target is not None:
                self._target.release()
                self._summing.forget(self._target)
                self.steps.forget(of=[self._target, self._target.splats, self._target.surfaces])
            self._target = None  # stays so when the new one does not fit the GPU
            self._target = Target(self._gl, size)
        return self._target

    def release(self) -> None:
        """Frees everything on the GPU, in reverse order. No step counts as done any more."""
        self.steps.forget()
        if self._target is not None:
            self._target.release()
        for part in (self._summing, self._lamplighting, self._light, self.things, self._objects):
            part.release()
