"""The rendering pipeline: takes a scene, lights and a camera, and draws the lit picture on the GPU."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import Count, Progress
from ..gpu.context.context import Context
from ..gpu.core.frame_textures import frame_of
from ..gpu.core.images import Box, Owner, read_texture
from ..gpu.core.steps import Steps
from ..gpu.core.view_images import Canvas, Target
from ..gpu.drawables import Drawables, Objects
from ..gpu.points.point_objects import ShownPoints, ShownSet
from ..gpu.points.rasterizers import Rasterizers
from ..gpu.points.tiles import TiledPoints
from ..gpu.shading.light_pass import LightPass
from ..gpu.shading.light_set import LightSet
from ..gpu.shading.occlusion import ViewVisibilityPass
from ..gpu.shading.present import SurfaceColorsPass
from ..notes.errors import check_function
from ..scene.appearance import LIT_EARLY, Appearance, Material
from ..scene.camera import Camera, Eye
from ..scene.environment import NO_ENVIRONMENT, EnvironmentLight
from ..scene.frame import Frame
from ..scene.graph import Scene, shaded
from ..scene.light import Light, at_upper_left
from ..scene.node import Matrix, Placed
from ..scene.passes import AROUND, EACH_LIGHT, Layer, kind_of, shadow_of
from ..scene.settings import METERINGS, SIMPLE, OutputSettings
from ..scene.values import CERTAINTY, ColorScale, scale_of_depths
from ..scene.visible import VisibleScene, compose, is_alone
from .accumulation import Accumulator, ExposureMeter, SharedSamples
from .aligned_poses import Aligned, Aligner, alignment_steps
from .frame_pass import FramePass, single_object
from .gpu_scene import GpuScene, merged_frames
from .light_setup import LightSetup, environment_light_of

if TYPE_CHECKING:
    from ..estimation.pose_search import FoundPose


class LitPoints(NamedTuple):
    """The lit points of a frame.

    surface  (h, w, 4) unit normal and depth, camera axes; depth 0 where there is no point
    light    (h, w, 4) linear light
    """

    frame: Frame
    surface: NDArray[np.float32]
    light: NDArray[np.float32]


@dataclass
class PicturePlan:
    """What the last picture was made of: the same one, or one under another light, then only has its pixels lit, and
    one from another place only its splats drawn."""

    scene: Scene
    source: Frame | Scene | None
    finish: OutputSettings
    camera: Camera
    pose: bytes
    forgotten: int  # `Steps.forgotten`
    lights: Sequence[Light]  # as they were given
    visible: VisibleScene
    drawables: Drawables
    target: Target
    is_alone: bool  # a frame, of which every view shows all
    light_set: LightSet
    has_places: bool  # all lights have a place or a direction: they stay where they are when the viewer moves
    versions: tuple[int, int] = (-1, -1)  # of its splats and its surfaces
    numbered: Sequence[Material] | None = None  # of its surfaces; None: they were not drawn

    def shows(self, scene: Scene, source: Frame | Scene | None, finish: OutputSettings, camera: Camera) -> bool:
        """Whether a picture of this scene differs in who looks from where, and in its lights, at most."""
        is_same = scene is self.scene and source is self.source and (finish is self.finish or finish == self.finish)
        return is_same and (camera is self.camera or camera == self.camera)


class Pipeline(Owner):
    """Draws scenes, and keeps what the next picture can use again.

    What is in view (scene/visible.py) is put on the GPU (gpu_scene.py), its lights are set up (light_setup.py),
    and what is seen is drawn and lit (frame_pass.py); several such samples are added up, as bright as asked for
    (accumulation.py).
    """

    def __init__(self, context: Context, steps: Steps, can_compute: bool, merge: float):
        super().__init__(context.gl)
        self.steps = steps
        rasterizers = Rasterizers(context.gl, context.is_software, can_compute, merge)
        objects = self._keep(Objects(context.gl, steps, rasterizers))
        self.gpu_scene = self._keep(GpuScene(context.gl, steps, objects))
        light = self._keep(LightPass(context.gl))
        self._light_setup = self._keep(LightSetup(context.gl, steps, objects, light))
        view_visibility = self._keep(ViewVisibilityPass(context.gl))
        self._colors = self._keep(SurfaceColorsPass(context.gl))
        self._frame_pass = FramePass(steps, objects, light, view_visibility, self._colors)
        shared = self._keep(SharedSamples(context.gl, steps, objects, light))
        passes = light, self._light_setup, self._frame_pass, shared
        self._accumulator = self._keep(Accumulator(context.gl, steps, *passes))
        setup = self.gpu_scene, light, self._light_setup, self._accumulator
        self._meter = self._keep(ExposureMeter(context.gl, steps, *setup))
        self._aligner = Aligner(self.gpu_scene)
        self._target: Target | None = None
        self._drawn: Scene | None = None  # the last scene
        self._seen: VisibleScene | None = None  # what was last seen of it, from the middle of its pixels
        self._has_surfaces = False  # whether the target certainly holds the surfaces of that
        self.exposure = 0.0  # of the last picture, stops
        self.fill = 0.0  # of it
        self.environment_light = NO_ENVIRONMENT  # of it
        self.scale: ColorScale | None = None  # of its colours, if they are no light
        self._stands: tuple[Hashable, tuple[np.ndarray, bool]] | None = None  # the last stream, and where up is in it
        self._plan: PicturePlan | None = None  # of the last picture

    def draw(
        self, scene: Scene, lights: Sequence[Light], camera: Camera, pose: Matrix, finish: OutputSettings = SIMPLE,
        source: Frame | Scene | None = None, progress: Progress | None = None, coarse: int = 1,
    ) -> Target:  # fmt: skip
        """Draw the scene under these lights, as a camera at a pose (4, 4) sees it.

        source    of which the scene was made; None is the scene itself
        progress  told of each frame of several that is prepared and compared, and of each sample
        coarse    how many times larger the pixels of shadow maps are
        """
        plan = self._plan
        if plan is not None and progress is None and plan.shows(scene, source, finish, camera):
            is_kept = plan.forgotten == self.steps.forgotten and self.gpu_scene.drawn is plan.drawables
            is_kept = is_kept and plan.target is self._target and plan.visible.coarse == coarse
            if is_kept and self._draw_again(plan, lights, pose):
                return plan.target
        self._plan = None
        count, given = self._count(progress, scene, camera, pose, finish.samples), scene
        uploads = self.steps.counts["upload"]
        scene = self._aligner.aligned(scene, count)
        visible = compose(scene, lights, camera, pose)
        if coarse != visible.coarse:
            visible = visible._replace(coarse=coarse)
        found = finish, source or given, scene, lights, visible.materials, self._upright
        self.environment_light = environment_light_of(*found)
        if self.environment_light != visible.environment_light:
            visible = visible._replace(environment_light=self.environment_light)
        drawables = self.gpu_scene.prepare(visible, count if progress else None)
        if self._drawn is not scene:
            self.steps.forget("exposure")
        self._drawn = scene
        self.fill = 0.0
        if finish.fill or finish.exposure in METERINGS:
            self.fill = self._meter.fill(finish, visible, drawables)
            visible = visible._replace(fill=self.fill)
        self.exposure = self._meter.find(finish.exposure, visible, lights, drawables)
        if self.gpu_scene.drawn is not drawables:  # it has looked from elsewhere
            drawables = self.gpu_scene.prepare(visible)
        self._aligner.watch(drawables)
        if self.exposure:
            visible = visible._replace(gain=2.0**self.exposure)
        target = self._fit_target(camera)
        if target.samples.content and target.samples.content[0] is not scene:
            self._accumulator.forget(target)
        self.scale = self._scale_of(finish, target, visible, drawables)
        if self.scale is not None:
            visible = visible._replace(scale=self.scale)
        self._seen = visible
        self._has_surfaces = self.scale is not None
        given_finish = finish
        if finish.tone != "none" and not visible.is_lit:
            finish = replace(finish, tone="none")
        if not finish.is_plain:
            self._accumulator.draw(target, visible, drawables, finish, count)
            return target
        light_set, before = self._light_setup.prepare(visible, drawables), target.surfaces.version
        content = scene.instances[0].content if is_alone(scene.instances) else None
        is_whole = content is not None and content.is_alike_from_everywhere
        state = pose.tobytes(), self.steps.forgotten, lights, visible, drawables, target, is_whole, light_set
        plan = PicturePlan(scene, source, given_finish, camera, *state, has_places=visible.lights == [*lights])
        self._draw_planned(plan)
        if self.steps.counts["upload"] > uploads and target.surfaces.version == before:
            target.surfaces.free()  # new frames are lit as they are drawn: a third of a stream's memory
        self._plan = plan if scene is given else None
        count.step()
        return target

    def _draw_planned(self, plan: PicturePlan) -> None:
        target, visible, drawables, light_set = plan.target, plan.visible, plan.drawables, plan.light_set
        plan.numbered, canvas = None, Canvas(target.picture)
        single = single_object(visible, drawables, light_set)
        if single is not None and single.shading not in LIT_EARLY:
            plan.numbered = self._frame_pass.draw_single_object(target, canvas, single, visible, light_set)
        elif not self._frame_pass.draw_lit_splats(target, visible, drawables, light_set):
            self._light_setup.light_points(visible, drawables, light_set)
            plan.numbered = self._frame_pass.draw(target, canvas, visible, drawables, light_set)
        plan.versions = target.splats.version, target.surfaces.version

    def _draw_again(self, plan: PicturePlan, lights: Sequence[Light], pose: Matrix) -> bool:
        """Draw what a plan shows, also from another place or under other lights, unless that needs more than drawing.

        Return whether it was drawn.
        """
        visible, target, place = plan.visible, plan.target, pose.tobytes()
        is_lit, is_there = lights == plan.lights, place == plan.pose
        if is_lit and is_there and self._frame_pass.light_again(target.picture):
            self.gpu_scene.photo_lights = []
            return True
        if not is_there and (not plan.is_alone or visible.scale is not None):
            return False  # colours stand for the depths of one view
        if not is_lit and isinstance(plan.finish.exposure, str):
            return False
        if not is_there:
            visible = VisibleScene(Eye(plan.camera, pose, visible.eye.near), *visible[1:])
        light_set, placed = plan.light_set, visible.lights
        if not is_lit or not plan.has_places:
            placed = [at_upper_left(light, pose) for light in lights]
        if not is_lit or placed != visible.lights:
            for light in (*lights, *plan.lights):
                if light.shadow:
                    return False
            visible = visible._replace(lights=placed)
            found = plan.finish, plan.source or plan.scene, visible.scene, lights, visible.materials, self._upright
            if environment_light_of(*found) != visible.environment_light:
                return False
            light_set = self._light_setup.prepare(visible, plan.drawables)
        self._plan = None  # stays so if it fails
        plan.visible, plan.light_set, plan.lights, plan.pose = visible, light_set, lights, place
        plan.has_places = placed == [*lights]
        self._seen = visible
        if plan.is_alone:
            self.gpu_scene.photo_lights = []
        else:
            self.gpu_scene.prepare(visible)
        is_drawn = is_there and (target.splats.version, target.surfaces.version) == plan.versions
        if is_drawn and plan.numbered is not None and light_set.shadow_map is None:
            self._frame_pass.light_pixels(target, Canvas(target.picture), visible, light_set, plan.numbered)
        else:
            self._draw_planned(plan)
        self._plan, self._has_surfaces = plan, False
        return True

    def _scale_of(
        self, finish: OutputSettings, target: Target, visible: VisibleScene, drawables: Drawables
    ) -> ColorScale | None:
        """Return what colours stand for: that of depths is found once for a view, from the middle of its pixels."""
        if finish.show != "depth":
            return None if finish.is_light else CERTAINTY._replace(show=finish.show)

        def measure(*_: object) -> ColorScale:
            self._frame_pass.draw_surfaces(target, visible, drawables, self._light_setup.prepare(visible, drawables))
            return scale_of_depths(self._colors.read_depths(target.surfaces))

        return self.steps.run("depth range", measure, visible.scene, visible.eye)

    def _upright(self, source: Frame | Scene) -> tuple[np.ndarray, bool]:
        """Return where up is, and whether a floor says so; of a stream its first frame decides: it would tremble."""
        from ..estimation.ground import up_and_floor  # only here

        stream = source.source if isinstance(source, Frame) else None
        if stream is None or self._stands is None or self._stands[0] != stream:
            self._stands = stream, self.steps.run("up", up_and_floor, source)
        return self._stands[1]

    def _count(self, progress: Progress | None, scene: Scene, camera: Camera, pose: Matrix, samples: int = 1) -> Count:
        """Count the steps of a picture. One that is told of is done on the GPU, too."""
        if progress is None:
            return Count()
        report_to = check_function(progress, "progress")

        def finished(done: int, all: int) -> object:
            self.steps.finish()
            return report_to(done, all)

        steps = self._aligner.steps_of(scene) + 2 * merged_frames(compose(scene, (), camera, pose))
        return Count(finished, steps + samples)

    def align(self, frames: Sequence[Frame], look: Appearance, progress: Progress | None = None) -> Aligned:
        """Return frames of one thing with corrected poses. progress: told of each that is read, and of each level."""
        return self._aligner.align(frames, look, Count(progress, alignment_steps(len(frames))))

    def search(self, frames: Sequence[Frame], look: Appearance, progress: Progress | None = None) -> list[FoundPose]:
        """Return the poses of frames of which nothing is known, and how sure they are."""
        from .aligned_poses import search, search_steps  # only here

        return search(self.gpu_scene, frames, look, Count(progress, search_steps(len(frames))))

    def alignment_of(self, drawables: Drawables) -> dict[Placed, Aligned]:
        """Return what was found about the poses of objects that were drawn with aligned frames."""
        return self._aligner.found(drawables)

    def read(self, out: NDArray[np.uint8] | None = None) -> NDArray[np.uint8]:
        """Return the last picture as (h, w, 4), top row first, in a new array or in that of the caller's."""
        assert self._target is not None, "nothing was drawn"
        return self._target.read(out)

    def read_surfaces(
        self, scene: Scene, camera: Camera, pose: Matrix, progress: Progress | None = None
    ) -> NDArray[np.float32]:
        """Return (h, w, 4), read-only: unit normal and z of the surfaces that a camera at a pose (4, 4) sees, in its
        axes and world units. z is 0 where there is none, the normal where no light is wanted. progress: as `draw`."""
        return self._draw_surfaces(scene, camera, pose, progress).surfaces.read()

    def read_layers(
        self, scene: Scene, lights: Sequence[Light], camera: Camera, pose: Matrix, finish: OutputSettings,
        source: Frame | Scene, names: Sequence[str], progress: Progress | None = None,
    ) -> dict[str, Layer]:  # fmt: skip
        """Return layers of the picture that `draw` draws, linear light times coverage, those of the passes with these
        names: see scene/passes.py. The light of a lamp is what it adds to the picture, one without shadows what it
        would add.

        progress  told as by `draw`, and of the samples of each further picture
        """
        target, done = self._fit_target(camera), [0, 0]
        is_each, is_around = any(one in names for one in EACH_LIGHT), any(one in names for one in AROUND)
        of_lamps = is_each * (len(lights) + sum(light.shadow for light in lights))
        further = finish.samples * (of_lamps + is_around + (is_each or is_around))

        def relay(*counted: int) -> object:
            done[:] = counted[0], counted[1] + further
            return progress(*done) if progress else None

        target.samples.content, self._accumulator.may_share = None, False  # light decides what is shared
        try:
            summed = replace(finish, background=(0.0, 0.0, 0.0))  # a plain picture would have no sums
            self.draw(scene, lights, camera, pose, summed, source, progress and relay)
            visible, drawables, count = self._seen, self.gpu_scene.drawn, Count(progress, done[1])
            assert visible is not None
            count.done = done[0]

            def shine(lamps: list[Light], gain: float = 1.0) -> Layer:
                view = visible._replace(lights=lamps, gain=gain)
                return self._accumulator.read_light(target, view, drawables, finish.samples, count)[..., :3]

            beauty = self._accumulator.read_mean(target)
            alpha = self._accumulator.read_alpha(target, visible.environment_light)
            found = {"beauty": np.dstack([beauty[..., :3], alpha]), "ground": alpha - beauty[..., 3]}
            lamps, dark = visible.lights, [replace(light, intensity=0.0) for light in visible.lights]
            around = shine(dark) if is_each or is_around else beauty
            if is_around:
                found["unlit"] = shine(dark, 0.0)
                ambient = np.maximum(around - found["unlit"], 0)
                is_ambient = visible.environment_light.environment is None
                found |= {"ambient": ambient * is_ambient, "environment": ambient * (not is_ambient)}
            for k, light in enumerate(lamps if is_each else [], 1):  # all of them have the same shadow maps
                one = np.maximum(shine([*dark[: k - 1], light, *dark[k:]]) - around, 0)
                found |= {f"light_{k}": one, f"unshadowed_{k}": one, f"shadow_{k}": np.zeros_like(one[..., 0])}
            for k, light in enumerate(lamps if is_each else [], 1):
                if light.shadow:
                    whole = np.maximum(shine([replace(light, shadow=False)]) - around, 0)
                    found |= {f"unshadowed_{k}": whole, f"shadow_{k}": shadow_of(found[f"light_{k}"], whole)}
        finally:
            target.samples.content, self._accumulator.may_share = None, True
        return {name: layer for name, layer in found.items() if kind_of(name) in names}

    def read_colors(self, scene: Scene, camera: Camera, pose: Matrix, samples: int) -> Layer:
        """Return (h, w, 3) the mean of the objects' own colours, linear, times coverage."""
        visible = compose(shaded(self._aligner.aligned(scene), "none"), (), camera, pose)
        drawables = self.gpu_scene.prepare(visible)
        return self._accumulator.read_light(self._fit_target(camera), visible, drawables, samples)[..., :3]

    def read_data(
        self, scene: Scene, camera: Camera, pose: Matrix, radius: float
    ) -> tuple[Layer, Layer, NDArray[np.int64]]:
        """Return what `surface_layers` takes of a view: surfaces, the open share, numbers of instances from 1.

        radius  how far things may be that hide light from all around, world units
        """
        visible = compose(self._aligner.aligned(scene), (), camera, pose)
        around = EnvironmentLight(radius)
        visible = visible._replace(environment_light=around, scale=CERTAINTY, apart=True)
        drawables = self.gpu_scene.prepare(visible)
        target, self._has_surfaces = self._fit_target(camera), False
        surfaces = target.surfaces
        self._frame_pass.draw_surfaces(target, visible, drawables, self._light_setup.prepare(visible, drawables))
        open_share = read_texture(self._context, self._frame_pass.find_visibility(surfaces, visible))[..., 3]
        rows = np.rint(np.abs(read_texture(self._context, surfaces.albedo)[..., 3])).astype(np.int64)
        places = {id(p): 1 + k for k, p in enumerate(visible.scene.instances)}
        shown = self._frame_pass.in_order(visible, drawables)
        numbers = np.array([0, *(places[id(p)] for p in shown), 0])
        return surfaces.read(), open_share, numbers[np.minimum(rows, len(shown))]

    def read_part(self, camera: Camera, pose: Matrix, box: Box) -> NDArray[np.float32]:
        """Return (h, w, 4), a part of a view of the last scene that was drawn: as `read_surfaces`."""
        seen = self._seen
        assert self._drawn is not None and seen is not None, "nothing was drawn"
        if seen.eye.camera != camera or not np.array_equal(seen.eye.pose, pose):
            return self._draw_surfaces(self._drawn, camera, pose).surfaces.read_part(box)
        target = self._fit_target(camera)
        if self._has_surfaces:  # of its last sample: less than a pixel aside
            return target.surfaces.read_part(box)
        drawables = self.gpu_scene.prepare(seen)
        self._frame_pass.keep_surfaces(target, seen, drawables, self._light_setup.prepare(seen, drawables))
        return target.surfaces.read_part(box)

    def _draw_surfaces(self, scene: Scene, camera: Camera, pose: Matrix, progress: Progress | None = None) -> Target:
        count = self._count(progress, scene, camera, pose)
        visible = compose(self._aligner.aligned(scene, count), (), camera, pose)
        drawables = self.gpu_scene.prepare(visible, count)
        light_set = self._light_setup.prepare(visible, drawables)
        target, self._has_surfaces = self._fit_target(camera), False
        self._frame_pass.draw_surfaces(target, visible, drawables, light_set)
        count.step()
        return target

    def read_points(
        self, scene: Scene, lights: Sequence[Light], pose: Matrix, progress: Progress | None = None, overlap: int = 0
    ) -> list[LitPoints]:
        """Light the points of one object whose shading is flat, as somebody at a pose (4, 4) sees them.

        Of several frames a point that several of them see is there once, and none that others contradict.

        progress  told of each frame of several that is prepared and compared, and of the points at the end
        overlap   pixels by which what is there once reaches over what other frames show
        """
        content = scene.instances[0].content
        count = self._count(progress, scene, content.frame.camera, pose)
        scene = self._aligner.aligned(scene, count)
        content = scene.instances[0].content
        visible = compose(scene, lights, content.frame.camera, pose, shows_all=True)
        drawables = self.gpu_scene.prepare(visible, count)
        self._aligner.watch(drawables)
        light_set = self._light_setup.prepare(visible, drawables)
        self._light_setup.light_points(visible, drawables, light_set)
        count.step()
        thing = drawables[visible.shown[0]]
        if isinstance(thing, TiledPoints):
            read = (lambda part: part.textures.surface.read()), (lambda part: part.textures.lit.read())
            return [LitPoints(content.frame, thing.gather(read[0]), thing.gather(read[1]))]
        if isinstance(thing, ShownSet):
            return _points_of_set(thing, overlap)
        assert isinstance(thing, ShownPoints) and thing.light is not None
        return [LitPoints(content.frame, thing.points.surface.read(), thing.light.read())]

    def prepare_all(self, scene: Scene, camera: Camera, pose: Matrix) -> Drawables:
        """Put all objects of a scene on the GPU, also those that this view does not show, and return them."""
        scene = self._aligner.aligned(scene)
        return self.gpu_scene.prepare(compose(scene, (), camera, pose, shows_all=True))

    def _fit_target(self, camera: Camera) -> Target:
        size = camera.width, camera.height
        if self._target is None or self._target.size != size:
            if self._target is not None:
                self._target.release()
                self._accumulator.forget(self._target)
                self.steps.forget(of=[self._target, self._target.splats, self._target.surfaces])
            self._target = None  # stays so when the new one does not fit the GPU
            self._target = Target(self._context, size)
        return self._target

    def release(self) -> None:
        """Free everything on the GPU, in reverse order. No step counts as done any more."""
        self.steps.forget()
        if self._target is not None:
            self._target.release()
        self._target = self._drawn = self._seen = self._plan = None
        super().release()


def _points_of_set(thing: ShownSet, overlap: int) -> list[LitPoints]:
    """Return the points of several frames of one object, each place once, in one exposure."""
    from ..estimation.multi_view import FramePoints, kept_once  # only here

    views, trusts, consensus = thing.views, thing.points.trusts, thing.consensus
    every = [
        FramePoints(frame_of(view.textures), view.points.surface.read(), trust.read()[..., 0] > 0)
        for view, trust in zip(views, trusts, strict=True)
    ]
    found = []
    once = kept_once(every, consensus.band, overlap)
    for view, one, kept, gain in zip(views, every, once, consensus.gains, strict=True):
        assert view.light is not None
        light = view.light.read() * np.array([*gain, 1], np.float32)
        found.append(LitPoints(one.frame, np.where(kept[..., None], one.surface, np.float32(0)), light))
    return found
