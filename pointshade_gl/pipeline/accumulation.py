"""Averages samples of a picture, draws them at once where they can be, and finds how much light it needs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import Count, check_type
from ..gpu.clouds.splat_layer import SOLID, PlacedSplats
from ..gpu.core.images import Fitted, Image, depth_tested, empty, empty_part, read_texture
from ..gpu.core.programs import FullscreenPasses
from ..gpu.core.steps import Steps
from ..gpu.core.view_images import TILE, Target
from ..gpu.drawables import Drawables, Objects
from ..gpu.meshes.mesh_objects import ShownGrid
from ..gpu.points.point_objects import ShownPoints
from ..gpu.shading.light_pass import LightPass
from ..gpu.shading.light_set import HIGHLIGHTS, Lighting, LightSet, environment_inputs
from ..gpu.shading.occlusion import plane_shift, plane_turn
from ..notes.notes import print_note
from ..notes.words import option
from ..scene.appearance import NOT_LIT, Material, Strengths, strengths_in
from ..scene.camera import Camera, view_matrix
from ..scene.environment import EnvironmentLight
from ..scene.graph import Scene, shaded
from ..scene.light import Light
from ..scene.sample_pattern import at_sample
from ..scene.settings import FILL, Metering, OutputSettings, Vector
from ..scene.visible import VisibleScene, compose, is_alone, looking_distance
from .frame_pass import FramePass, single_object
from .gpu_scene import GpuScene
from .light_setup import LightSetup

if TYPE_CHECKING:
    from ..gpu.shading.present import ResolveSamplesPass

WORTH = 1 << 23  # pixels of all samples: with fewer, drawing them takes less time than the programs made for this
AT_FRAME = 1e-6  # of the scene's radius: so near is a viewer where the frame's camera was
BAND = 16  # part of the view's width that is tried first
MOST = 0.5  # of its tiles that may be left open: else nothing is won


class SharedSamples(FullscreenPasses):
    """Looks for pixels that show one smooth, evenly lit surface, as the frame's own camera saw it, or nothing.

    Their samples share splats, normals and light. Only the frame's colours are averaged.
    """

    def __init__(self, context: moderngl.Context, steps: Steps, objects: Objects, light: LightPass):
        super().__init__(context)
        self._steps, self._objects, self._light = steps, objects, light

    def draw(
        self, target: Target, visible: VisibleScene, drawables: Drawables, light_set: LightSet, samples: int
    ) -> bool:
        """Add up the samples of such pixels in an empty sum. Return whether there are many; the others are open."""
        thing = single_object(visible, drawables, light_set)
        is_large = samples * target.size[0] * target.size[1] >= WORTH
        if thing is None or not is_large or thing.shading != "phong":
            return False
        points, camera = thing.points, visible.eye.camera
        away = float(np.linalg.norm(visible.eye.pose[:3, 3] - points.pose[:3, 3]))
        larger = min(abs(camera.fx / points.source.fx), abs(camera.fy / points.source.fy))
        if away > AT_FRAME * visible.scene.bounds[1] or larger <= 1 - 1e-3:
            return False  # it is not seen as the frame's own camera saw it, or larger
        kind, eye = self._objects.kind_of(thing), visible.eye
        self._steps.run("splats", kind.draw_splats, target.splats, thing.points, eye)
        return self._steps.always("shared", self._share, target, thing, visible, light_set, samples)

    def _share(
        self, target: Target, thing: ShownPoints | ShownGrid, visible: VisibleScene, light_set: LightSet, samples: int
    ) -> bool:
        """Try a band first: where all is rough, nothing is shared, and the sum stays empty."""
        whole = left, top, width, height = target.splats.window
        target.splats.window = left + width // 2, top, width // BAND, height
        self._fill(target, thing, visible, light_set, samples, is_trial=True)
        left, top, width, height = (edge // TILE for edge in target.splats.window)
        tiles = target.samples.active.read()[top : top + height, left : left + width]
        is_worth = bool(tiles.size) and float(tiles.mean()) <= MOST
        target.splats.window = whole
        if is_worth:
            self._fill(target, thing, visible, light_set, samples)
        else:
            target.samples.clear(target.samples.has_ground)
        return is_worth

    def _fill(
        self, target: Target, thing: ShownPoints | ShownGrid, visible: VisibleScene, light_set: LightSet, samples: int,
        is_trial: bool = False,
    ) -> None:  # fmt: skip
        """Give the pixels of the window that are not open their sum."""
        kind: Any = self._objects.kind_of(thing)
        eye, surfaces, lit = visible.eye, target.surfaces, target.samples.shades
        kind.draw_surface(surfaces, target.splats, thing, eye, samples)
        clear = empty_part if is_trial else empty
        clear(lit.target, surfaces.window)
        self._light.draw(
            lit.target, surfaces.surface, surfaces.albedo, eye.camera, light_set.seen_from(eye.pose),
            np.array([strengths_in(visible.materials[0], visible.fill)]), linear=True, has_doubts=surfaces.has_doubts,
            visibility=surfaces.visibility if surfaces.has_visibility else None, split=True,
        )  # fmt: skip
        target.samples.open_surfaces.depth_mask = True
        clear(target.samples.open_surfaces, surfaces.window)
        sums, (shade, shine) = target.samples, lit.textures
        maps = {"albedo_map": surfaces.albedo, "shade_map": shade, "shine_map": shine}
        with depth_tested(self._context, sums.open_surfaces, surfaces.window):
            self.fullscreen("output/shared_pixels.frag").draw(sums.open_surfaces, maps, count=float(samples))
        tiles = self.fullscreen("output/active_tiles.frag")
        tiles.draw(sums.active.target, {"open_map": sums.open}, side=TILE)


class Accumulator(FullscreenPasses):
    """Averages samples into finished pictures. A target keeps its sum, for more samples of the same picture."""

    def __init__(
        self, context: moderngl.Context, steps: Steps, light: LightPass, light_setup: LightSetup,
        frame_pass: FramePass, shared: SharedSamples,
    ):  # fmt: skip
        super().__init__(context)
        self._steps, self._light, self._light_setup = steps, light, light_setup
        self._frame_pass, self._shared = frame_pass, shared
        self.may_share = True  # pixels that are alike in all samples are drawn once

    @cached_property
    def _resolve(self) -> ResolveSamplesPass:
        from ..gpu.shading.present import ResolveSamplesPass  # only here

        return self._keep(ResolveSamplesPass(self._context))

    def draw(
        self, target: Target, visible: VisibleScene, drawables: Drawables, finish: OutputSettings, count: Count
    ) -> None:
        """Draw the finished picture: all its samples, averaged and counted."""
        self._add_samples(target, visible, drawables, finish, count)
        self._resolve.resolve(target, finish, bool(visible.environment_light.occlusion))

    def read_light(
        self, target: Target, visible: VisibleScene, drawables: Drawables, samples: int = 1, count: Count | None = None
    ) -> NDArray[np.float32]:
        """Return (h, w, 4), read-only: the mean light of samples, linear, not cut off at 1, and their coverage."""
        self._add_samples(target, visible, drawables, OutputSettings(samples), count or Count())
        return self.read_mean(target)

    def read_mean(self, target: Target) -> NDArray[np.float32]:
        """Return the same of what was drawn last."""
        total = read_texture(self._context, target.samples.surfaces.texture)
        return (total / target.samples.count).astype(np.float32, copy=False)

    def read_alpha(self, target: Target, environment_light: EnvironmentLight) -> NDArray[np.float32]:
        """Return (h, w) the alpha of what was drawn last, with the shadows on its ground."""
        return self._resolve.read_alpha(target, bool(environment_light.occlusion))

    def forget(self, target: Target) -> None:
        """Forget a scene that is no longer shown."""
        target.samples.content = None
        for step in ("up", "ground"):
            self._steps.forget(step)

    def _add_samples(
        self, target: Target, visible: VisibleScene, drawables: Drawables, finish: OutputSettings, count: Count
    ) -> None:
        """Add up the samples. If the picture shows the same as the last one, only the missing ones are drawn."""
        sums, has_ground = target.samples, not isinstance(finish.ground, bool)
        eye, ground = (visible.eye.camera, visible.eye.pose.tobytes()), (finish.ground, finish.ground_height)
        light = tuple(visible.lights), visible.gain, visible.fill, visible.environment_light
        content = visible.scene, *eye, *ground, *light, visible.scale
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
        self, target: Target, visible: VisibleScene, drawables: Drawables, finish: OutputSettings, count: Count,
        done: int
    ) -> None:  # fmt: skip
        """Add up the samples that are not there yet. In large stills many pixels share what they have in common."""
        sums, is_soft, light_set = target.samples, any(light.is_soft for light in visible.lights), None
        canvas = self._resolve.canvas(sums.surfaces)
        for k in range(done, finish.samples):
            sample = at_sample(visible, k)
            if is_soft or light_set is None:
                light_set = self._light_setup.prepare(sample, drawables)
                self._light_setup.light_points(sample, drawables, light_set)
            is_shared = k == 0 and not is_soft and self.may_share
            if is_shared and self._shared.draw(target, visible, drawables, light_set, finish.samples):
                canvas = canvas._replace(image=sums.open_surfaces, is_masked=True)
                target.splats.draw_only(sums.active.texture)
            self._frame_pass.draw(target, canvas, sample, drawables, light_set)
            if finish.up is not None and light_set.shadow_map is not None:
                if any(isinstance(drawables[p], PlacedSplats) for p in sample.shown):  # the ground is seen through them
                    self._frame_pass.draw_surfaces(target, sample, drawables, light_set, SOLID)
                self._draw_ground(target, sample, light_set, finish.up, finish.ground_height)
            count.step()

    def _draw_ground(
        self, target: Target, visible: VisibleScene, light_set: LightSet, up: Vector, height: float | None
    ) -> None:
        """Draw shadows on the ground where no surface is visible. Lights with shadows make `draw` keep surfaces."""
        from ..estimation.ground import ground_under, seen_ground  # only here

        ground = self._steps.run("ground", ground_under, visible.scene, up, height)
        lighting, environment_light = light_set.seen_from(visible.eye.pose), visible.environment_light
        inputs = self._light.inputs(lighting) | {"surface_map": target.surfaces.surface}
        inputs |= {"intrinsics": visible.eye.camera.intrinsics, "plane": seen_ground(ground, visible.eye.pose)}
        inputs |= environment_inputs(lighting)
        constants = {"SHADOWS": lighting.shadows.kind} if lighting.shadows else {}
        constants |= {"SPLATS": 1} if "splat_map" in inputs else {}
        constants |= {"ENVIRONMENT": 1} if environment_light.environment else {}  # the ground is matt
        inputs = {name: value for name, value in inputs.items() if name not in HIGHLIGHTS}
        if environment_light.occlusion:
            constants |= {"VISIBILITY": 1}
            inputs["radius"] = environment_light.radius(looking_distance(visible.scene, visible.eye.pose))
            inputs["shift"] = plane_shift(visible.sample)
            inputs["turned"] = plane_turn(visible.sample)
        with self._resolve.canvas(target.samples.ground).opened((0, 0, *target.size)) as image:
            shadows = self.fullscreen("shading/ground.frag", None, **constants)
            shadows.draw(image, {}, material=visible.materials[0].strengths, **inputs)


LONGEST = 80  # pixels of the longer side of the copy
EVEN_LIGHT = Lighting(np.zeros((0, 5, 4), np.float32), (1.0, 1.0, 1.0), None)  # in which this shows its own colours
OWN_COLORS = Material(1.0, 0.0, 0.0)
Measure = Callable[[VisibleScene, Drawables], tuple[np.ndarray, np.ndarray]]


class ExposureMeter(FullscreenPasses):
    """Compares the lit picture with the photograph; of a frame alone only some of its points, without drawing it."""

    def __init__(
        self, context: moderngl.Context, steps: Steps, gpu_scene: GpuScene, light: LightPass,
        light_setup: LightSetup, accumulator: Accumulator,
    ):  # fmt: skip
        super().__init__(context)
        self._steps, self._gpu_scene, self._light = steps, gpu_scene, light
        self._light_setup, self._accumulator = light_setup, accumulator
        self._surfaces, self._visibility, self._lit = (self._keep(Fitted(context, Image)) for _ in range(3))

    def fill(self, finish: OutputSettings, visible: VisibleScene, drawables: Drawables) -> float:
        """Return the share of light from all around, of a picture."""
        scene = visible.scene
        if not is_alone(scene.instances) or visible.environment_light.environment or not visible.materials[0].ambient:
            return 0.0
        if finish.fill is not None:
            return finish.fill
        is_found = isinstance(finish.exposure, str) and not scene.instances[0].content.look.unlight
        return FILL if is_found and _is_photograph(scene, drawables) else 0.0

    def find(
        self, exposure: float | Metering, visible: VisibleScene, lights: Sequence[Light], drawables: Drawables
    ) -> float:
        """Return the stops of a picture: of a scene under these lights the same from wherever it is seen."""
        if not isinstance(exposure, str):
            return exposure
        scene = visible.scene
        alone = drawables[scene.instances[0]] if is_alone(scene.instances) else None
        is_guessed = exposure == "sensor"
        if is_guessed and not (alone and _is_photograph(scene, drawables)):
            return 0.0  # nothing that a camera saw
        if alone is not None and alone.shading in NOT_LIT:
            return 0.0  # the photograph itself
        measure = partial(self._of_points, alone.views[0]) if alone is not None and alone.views else self._of_scene
        meter = partial(self._measure, measure, is_guessed, drawables)
        return self._steps.run("exposure", meter, scene, tuple(lights), visible.environment_light, visible.fill)

    def _measure(
        self, measure: Measure, is_guessed: bool, drawables: Drawables, scene: Scene, lights: Sequence[Light],
        environment_light: EnvironmentLight, fill: float,
    ) -> float:  # fmt: skip
        camera = check_type(scene.camera, Camera, "camera")
        seen = compose(scene, lights, _small(camera), np.asarray(scene.pose), environment_light)._replace(fill=fill)
        from ..estimation.light_fit import stops_to_burn, stops_to_match  # only here

        lit, own = measure(seen, drawables)
        stops = stops_to_match(lit, own)
        if fill:
            stops = min(stops, stops_to_burn(lit, own))
        if is_guessed and stops:
            text = f"fill {fill:g} and exposure {stops:+g} stops, to be as bright as the photograph"
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
            colors: moderngl.Texture, lighting: Lighting, strengths: Strengths, hides: moderngl.Texture | None = None
        ) -> np.ndarray:
            lit = self._lit.fit(copy.size)
            empty(lit.target)
            inputs = copy.texture, colors, small, lighting, np.array([strengths]), (viewer, points.scale)
            self._light.draw(lit.target, *inputs, certainty=points.surface.certainty, visibility=hides)
            return lit.read()

        own = strengths_in(visible.materials[0], visible.fill)
        lit = shine(seen.colors.texture, light_set.seen_from(points.pose), own, visibility)
        return lit, shine(seen.textures.color, EVEN_LIGHT, OWN_COLORS.strengths)

    def _of_scene(self, visible: VisibleScene, _: Drawables) -> tuple[np.ndarray, np.ndarray]:
        """The same of whatever a scene's camera sees."""
        (camera, pose), lights = visible.eye[:2], visible.lights
        target = Target(self._context, (camera.width, camera.height))
        try:
            scenes, environment_light = (visible.scene, shaded(visible.scene, "none")), visible.environment_light
            views = (compose(one, lights, camera, pose, environment_light) for one in scenes)
            lit, own = (self._accumulator.read_light(target, one, self._gpu_scene.prepare(one)) for one in views)
        finally:
            self._steps.forget(of=[target, target.splats, target.surfaces])
            target.release()
        return lit, own


def _is_photograph(scene: Scene, drawables: Drawables) -> bool:
    """Return whether an object that is alone has colours, and the noise of a sensor."""
    alone = scene.instances[0]
    has_colors = any(frame.color is not None for frame in alone.content.frames)
    return has_colors and any(choice.noise and not choice.noise.is_clean for choice in drawables[alone].choices)


def _small(camera: Camera) -> Camera:
    """Return the camera with as few pixels as tell how bright its picture is."""
    shrunk = min(LONGEST / max(camera.width, camera.height), 1.0)
    return camera.resized(*(max(round(side * shrunk), 1) for side in (camera.width, camera.height)))
