"""Finds how much light a picture needs to be as bright as the photograph, as the frame's own camera sees it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import moderngl
import numpy as np

from ..checks.arguments import check_type
from ..estimation.light_fit import stops_to_match
from ..gpu.clouds.cloud_objects import PlacedCloud
from ..gpu.core.images import Fitted, Image, empty
from ..gpu.core.programs import FullscreenPasses
from ..gpu.core.steps import Steps
from ..gpu.core.view_images import Target
from ..gpu.drawables import Drawable, Drawables
from ..gpu.meshes.mesh_objects import PlacedMesh, ShownGrid
from ..gpu.points.point_objects import ShownPoints, ShownSet
from ..gpu.points.tiles import TiledPoints
from ..gpu.shading.light_pass import LightPass
from ..gpu.shading.light_set import Lighting
from ..notes.notes import print_note
from ..notes.words import option
from ..scene.appearance import NOT_LIT, Material
from ..scene.camera import Camera, view_matrix
from ..scene.environment import Surroundings
from ..scene.graph import Scene, shaded
from ..scene.light import Light
from ..scene.settings import Metering
from ..scene.visible import VisibleScene, compose, is_alone
from .accumulation import Accumulator
from .gpu_scene import GpuScene
from .light_setup import LightSetup

LONGEST = 80  # pixels of the longer side of the copy
ALL_AROUND = Lighting(np.zeros((0, 5, 4), np.float32), (1.0, 1.0, 1.0), None)  # in which this shows its own colours
OWN_COLORS = Material(1.0, 0.0, 0.0)
Measure = Callable[[VisibleScene, Drawables], tuple[np.ndarray, np.ndarray]]


class ExposureMeter(FullscreenPasses):
    """Compares the lit picture with the photograph; of a frame alone only some of its points, without drawing it."""

    def __init__(
        self,
        context: moderngl.Context,
        steps: Steps,
        gpu_scene: GpuScene,
        light: LightPass,
        light_setup: LightSetup,
        accumulator: Accumulator,
    ):
        super().__init__(context)
        self._steps = steps
        self._gpu_scene = gpu_scene
        self._light = light
        self._light_setup = light_setup
        self._accumulator = accumulator
        self._surfaces, self._visibility, self._lit = (self._keep(Fitted(context, Image)) for _ in range(3))

    def find(
        self, exposure: float | Metering, visible: VisibleScene, lights: Sequence[Light], drawables: Drawables
    ) -> float:
        """Return the stops of a picture: of a scene under these lights the same from wherever it is seen."""
        if not isinstance(exposure, str):
            return exposure
        scene = visible.scene
        alone = drawables[scene.things[0]] if is_alone(scene.things) else None
        is_guessed = exposure == "sensor"
        if is_guessed and (alone is None or not is_noisy(alone)):
            return 0.0
        if alone is not None and not isinstance(alone, PlacedMesh | PlacedCloud) and alone.shading in NOT_LIT:
            return 0.0  # the photograph itself
        first = alone.views[0] if isinstance(alone, ShownSet) else alone
        measure = partial(self._of_points, first) if isinstance(first, ShownPoints | ShownGrid) else self._of_scene
        meter = partial(self._measure, measure, is_guessed, drawables)
        return self._steps.run("exposure", meter, scene, tuple(lights), visible.surroundings)

    def _measure(
        self, measure: Measure, is_guessed: bool, drawables: Drawables, scene: Scene, lights: Sequence[Light],
        surroundings: Surroundings,
    ) -> float:  # fmt: skip
        camera = check_type(scene.camera, Camera, "camera")
        seen = compose(scene, lights, _small(camera), np.asarray(scene.pose), surroundings)
        stops = stops_to_match(*measure(seen, drawables))
        if is_guessed and stops:
            text = f"exposure {stops:+g} stops, to be as bright as the photograph"
            print_note(f"{text}: {option('exposure', 0)} leaves the lights as given")
        return stops

    def _of_points(
        self, seen: ShownPoints | ShownGrid, visible: VisibleScene, drawables: Drawables
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the light of a frame's points, and that of its photograph: `stops_to_match` takes them."""
        points, light_set = seen.points, self._light_setup.prepare(visible, drawables)
        small, viewer = _small(points.source), view_matrix(visible.eye.pose, points.pose)[:3, 3]
        sample, size = self.fullscreen("points/surface_samples.frag"), (small.width, small.height)
        copy, visibility = self._surfaces.fit(size), None
        sample.draw(copy.target, {"copied_map": points.surface.texture}, cells=size)
        if seen.visibility is not None:
            copied = self._visibility.fit(size)
            sample.draw(copied.target, {"copied_map": seen.visibility.texture}, cells=size)
            visibility = copied.texture

        def shine(
            colors: moderngl.Texture, lighting: Lighting, material: Material, hides: moderngl.Texture | None = None
        ) -> np.ndarray:
            lit = self._lit.fit(copy.size)
            empty(lit.target)
            strengths, place = np.array([material.strengths]), (viewer, points.scale)
            inputs = copy.texture, colors, small, lighting, strengths, place
            self._light.draw(lit.target, *inputs, certainty=points.surface.certainty, visibility=hides)
            return lit.read()

        lit = shine(seen.colors.texture, light_set.seen_from(points.pose), visible.materials[0], visibility)
        return lit, shine(seen.textures.color, ALL_AROUND, OWN_COLORS)

    def _of_scene(self, visible: VisibleScene, _: Drawables) -> tuple[np.ndarray, np.ndarray]:
        """The same of whatever a scene's camera sees."""
        (camera, pose), lights = visible.eye[:2], visible.lights
        target = Target(self._context, (camera.width, camera.height))
        try:
            scenes, around = (visible.scene, shaded(visible.scene, "none")), visible.surroundings
            views = (compose(one, lights, camera, pose, around) for one in scenes)
            lit, own = (self._accumulator.read_light(target, one, self._gpu_scene.prepare(one)) for one in views)
        finally:
            self._steps.forget(of=[target, target.splats, target.surfaces])
            target.release()
        return lit, own


def _small(camera: Camera) -> Camera:
    """Return the camera with as few pixels as tell how bright its picture is."""
    shrunk = min(LONGEST / max(camera.width, camera.height), 1.0)
    return camera.resized(*(max(round(side * shrunk), 1) for side in (camera.width, camera.height)))


def is_noisy(thing: Drawable) -> bool:
    """Return whether noise was found in the depth of a frame, or in one of several."""
    if isinstance(thing, PlacedMesh | PlacedCloud):
        return False
    views = thing.views if isinstance(thing, ShownSet) else (thing,)
    choices = (view.choice if isinstance(view, TiledPoints) else view.textures.choice for view in views)
    return any(choice.noise is not None and not choice.noise.is_clean for choice in choices)
