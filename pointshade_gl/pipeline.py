"""The pipeline: a scene in, a lit picture on the GPU out."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from .camera import Camera, Eye
from .consensus import importances
from .explain import SetReport
from .finish import SIMPLE, Finish
from .frame import Frame
from .gpu.canvas import Canvas
from .gpu.consensus import ConsensusPass
from .gpu.context import Context
from .gpu.develop import DevelopPass
from .gpu.frame_store import DrawnPoints, FrameStore
from .gpu.grid_objects import Grid, GridObjects, ShownGrid, depth_step
from .gpu.lamps import Lamps, Lighting
from .gpu.light import LightPass
from .gpu.mesh_objects import MeshObjects, PlacedMesh
from .gpu.passes import FullscreenPass
from .gpu.point_objects import PointObjects, Points, PointSet, ShownPoints, ShownSet
from .gpu.rasterizers import Rasterizers
from .gpu.shadows import ShadowMap
from .gpu.steps import Steps
from .gpu.target_normals import target_estimator
from .gpu.textures import FrameTextures, SurfaceImage, Target, empty
from .ground import ground_under, seen_ground
from .level_of_detail import coarser, coarser_size, coarser_step, finer_camera
from .light import Light
from .look import Material, check_sizes
from .mesh import Mesh
from .noise import Choice
from .samples import at_sample
from .scene import Matrix, Placed, PointObject, Scene
from .shadow_views import ShadowView, shadow_views
from .shot import Shot, compose, is_alone

LIT_EARLY = ("flat", "gouraud")  # shading models that light points or corners, and mix that light
# What a scene holds, on the GPU. A new kind of object is described beside mesh.py, may be placed by scene.py, has its
# passes beside gpu/mesh_objects.py and its type here. It needs a branch wherever this module, shot.py, viewer/screen.py
# and gltf/write.py ask whether something is a mesh: all others count as point objects.
Thing = ShownPoints | ShownGrid | ShownSet | PlacedMesh


class Pipeline:
    """Draws scenes, and keeps what the next picture can use again.

    A single point object under plain lights is lit while its pixels are looked up. Otherwise all things write their
    visible surfaces first, and each pixel is lit once. `gpu/point_objects.py` and `gpu/mesh_objects.py` draw things.
    """

    def __init__(self, context: Context, steps: Steps, can_compute: bool, merge: float):
        self._gl = context.gl
        self.steps = steps
        self.frames = FrameStore(context.gl, self.steps)
        rasterizers = Rasterizers(context.gl, context.is_software, can_compute, merge)
        self._points = PointObjects(context.gl, rasterizers)
        self._light = LightPass(context.gl)
        self._ground: FullscreenPass | None = None  # these six are made for the first scene that needs them
        self._develop: DevelopPass | None = None
        self._consensus: ConsensusPass | None = None
        self._grids: GridObjects | None = None
        self._meshes: MeshObjects | None = None
        self._shadow_map: ShadowMap | None = None
        self._coarse: dict[tuple[Frame, int], Frame] = {}
        self._target: Target | None = None
        self.drawn: dict[Placed, Thing] = {}  # what the last picture shows or casts shadows in it

    def draw(
        self, scene: Scene, lights: Sequence[Light], camera: Camera, pose: Matrix, finish: Finish = SIMPLE
    ) -> Target:
        """The scene under these lights, as a camera at a pose (4, 4) sees it."""
        shot = compose(scene, lights, camera, pose)
        things = self._prepare(shot)
        target = self._fit_target(camera)
        if target.samples.content and target.samples.content[0] is not scene:
            self._forget_samples(target)
        if finish == SIMPLE:
            lamps = self._draw_shadows(shot, things)
            if not self._draw_lit_splats(target, shot, things, lamps):
                self._light_points(tuple(things[p] for p in shot.shown), shot, lamps)
                self._draw_sample(target, shot, things, lamps, Canvas(target.picture))
        else:
            self._develop = self._develop or DevelopPass(self._gl)
            self._add_samples(target, shot, things, self._develop.canvas(target.samples), finish)
            self._develop.develop(target, finish.samples, finish.background)
        return target

    def _forget_samples(self, target: Target) -> None:
        """Lets go of a scene that is no longer shown."""
        target.samples.content = None
        self.steps.forget("ground")

    def _add_samples(
        self, target: Target, shot: Shot, things: dict[Placed, Thing], canvas: Canvas, finish: Finish
    ) -> None:
        """The sum of the samples. Of a picture that shows the same as the last one, only those that are missing."""
        sums = target.samples
        content = shot.scene, tuple(shot.lights), shot.eye.camera, shot.eye.pose.tobytes(), finish.ground
        done = sums.count if sums.content == content and sums.count <= finish.samples else 0
        sums.content = None  # stays so if a sample fails
        if not done:
            empty(sums.target)
        is_soft, lamps = any(light.is_soft for light in shot.lights), None
        for k in range(done, finish.samples):
            sample = at_sample(shot, k)
            lamps = self._hang_up(sample, things) if is_soft or lamps is None else lamps
            self._draw_sample(target, sample, things, lamps, canvas)
            if not isinstance(finish.ground, bool) and lamps.shadow_map is not None:
                self._draw_ground(target, sample, lamps, canvas, finish.ground)
        sums.content, sums.count = content, finish.samples

    def _hang_up(self, shot: Shot, things: dict[Placed, Thing]) -> Lamps:
        """The lights, after they have shone on the points of shading models that mix light."""
        lamps = self._draw_shadows(shot, things)
        self._light_points(tuple(things[p] for p in shot.shown), shot, lamps)
        return lamps

    def _draw_sample(
        self, target: Target, shot: Shot, things: dict[Placed, Thing], lamps: Lamps, canvas: Canvas
    ) -> None:
        shown = tuple(things[p] for p in shot.shown)
        if _is_single(shown, lamps):
            self._draw_single(target, canvas, shown[0], shot, lamps)
        else:
            self._draw_surfaces(target, shown, shot, lamps)
            self._light_pixels(target, canvas, shot, lamps)

    def read_surfaces(self, scene: Scene, camera: Camera, pose: Matrix) -> NDArray[np.float32]:
        """(h, w, 4), read-only: unit normal and z of the surfaces that a camera at a pose (4, 4) sees, its axes, world
        units. z is 0 where there is none, the normal where no light is wanted."""
        shot = compose(scene, (), camera, pose)
        things = self._prepare(shot)
        lamps = self._draw_shadows(shot, things)
        target = self._fit_target(camera)
        self._draw_surfaces(target, tuple(things[p] for p in shot.shown), shot, lamps)
        return target.surfaces.read()

    def read_points(
        self, scene: Scene, lights: Sequence[Light], pose: Matrix
    ) -> tuple[NDArray[np.float32], NDArray[np.uint16]]:
        """The points of a frame whose shading is flat, as somebody at a pose (4, 4) sees them.

        Returns (h, w, 4) unit normal and depth, camera axes, and (h, w, 4) their linear light over 65535. Both are
        read-only; depth 0 where there is no point.
        """
        shot = compose(scene, lights, scene.things[0].content.frame.camera, pose)
        things = self._prepare(shot)
        lamps = self._draw_shadows(shot, things)
        (thing,) = shown = tuple(things[p] for p in shot.shown)
        self._light_points(shown, shot, lamps)
        assert isinstance(thing, ShownPoints)
        return thing.textures.surface.read(), thing.textures.lit.read()

    def read(self) -> NDArray[np.uint8]:
        """The last picture as (h, w, 4), top row first."""
        assert self._target is not None, "nothing was drawn"
        return self._target.read()

    def findings(self) -> list[tuple[str, Choice | SetReport]]:
        """What estimated the normals of each point object in the last picture, or what its frames agree on; by name."""
        return [
            (p.node.name, thing.report() if isinstance(thing, ShownSet) else thing.textures.choice)
            for p, thing in self.drawn.items()
            if not isinstance(thing, PlacedMesh)
        ]

    def weights(self) -> dict[Frame, float]:
        """How much each frame of the last picture counts where several show the same: 1 if it is a primary view."""
        found: dict[Frame | None, float] = {}
        for thing in self.drawn.values():
            if isinstance(thing, ShownSet):
                found |= zip((view.textures.frame for view in thing.views), thing.importances.tolist(), strict=True)
            elif isinstance(thing, ShownPoints):
                found[thing.textures.frame] = 1.0
        return {frame: weight for frame, weight in found.items() if frame}

    def _prepare(self, shot: Shot) -> dict[Placed, Thing]:
        """Puts what is shown or casts a shadow on the GPU: points with their normals, as many as the view needs."""
        self.steps.counts["culled"] += len(shot.scene.things) - len(shot.shown)
        used = [p for p in shot.scene.things if p in shot.shown or p in shot.casting]
        meshes = [p for p in used if isinstance(p.content, Mesh)]
        if self._meshes and (unused := self._meshes.keep_only(p.content for p in meshes)):
            self.steps.forget(of=unused)
        things: dict[Placed, Thing] = {p: PlacedMesh(p.content, p.world) for p in meshes}
        objects = [p for p in used if isinstance(p.content, PointObject)]
        singles = [member for p in objects for member in p.members]
        shown = self._prepare_points(singles, shot, {p for p in objects if p.content.is_single})
        for p in objects:
            if p.content.is_single:
                things[p] = shown[p]
            else:
                views = (shown[member] for member in p.members)
                things[p] = self._as_one(p, tuple(v for v in views if isinstance(v, ShownPoints)), shot)
        self.drawn = things
        return things

    def _prepare_points(
        self, singles: list[Placed], shot: Shot, alone: set[Placed]
    ) -> dict[Placed, ShownPoints | ShownGrid]:
        """The points of frames. Those that stand alone are drawn as coarse or as fine as the view needs."""
        shown: dict[Placed, ShownPoints | ShownGrid] = {}
        steps = [self._coarser_step(p, shot) if p in alone else 1 for p in singles]
        frames = [self._coarser(p.content.frame, step) for p, step in zip(singles, steps, strict=True)]
        self._coarse = {key: frame for key, frame in self._coarse.items() if frame in frames}
        for p, step, frame, textures in zip(singles, steps, frames, self.frames.upload(frames), strict=True):
            look = p.content.look
            is_finer = step == 1 and p in alone
            camera = finer_camera(frame, look, shot.eye.camera) if is_finer else frame.camera
            drawn = self.frames.find_points(textures, frame, look, camera)
            is_mesh = look.splat == "mesh"
            shown[p] = self._as_grid(p, drawn, textures) if is_mesh else _as_splats(p, drawn, textures, step)
        return shown

    def _as_grid(self, p: Placed, drawn: DrawnPoints, textures: FrameTextures) -> ShownGrid:
        """Points as the triangles between them."""
        surface, lit, source = drawn
        look = p.content.look
        grid = Grid(surface, source, *p.rigid_axes, depth_step(look))
        self.steps.run("triangles", self._grid_objects().find_triangles, grid, of=surface)
        light = lit if look.shading == "gouraud" else None
        material = look.material.strengths if look.shading == "flat" else None
        return ShownGrid(grid, textures, look.shading, light, material)

    def _as_one(self, p: Placed, views: tuple[ShownPoints, ...], shot: Shot) -> ShownSet:
        """Several frames of one thing, each with the others' votes on its points, and its weight in this view."""
        self._consensus = self._consensus or ConsensusPass(self._gl, self.steps)
        consensus = self._consensus.find([view.textures for view in views])
        trusts = tuple(view.textures.trust for view in views if view.textures.trust)
        points = PointSet(tuple(view.points for view in views), trusts, consensus.band * p.content.scale)
        weights = importances(p.content.frames, p.seen_from(shot.eye.pose), consensus.wrong)
        return ShownSet(points, views, consensus, weights, views[0].shading, target_estimator(p.content.look))

    def _coarser_step(self, p: Placed, shot: Shot) -> int:
        """1 for all points: of a frame alone, and where an option is an array."""
        return coarser_step(p, shot.eye) if p.content.look.is_uniform and not is_alone(shot.scene.things) else 1

    def _coarser(self, frame: Frame, step: int) -> Frame:
        if step == 1:
            return frame
        if (frame, step) not in self._coarse:
            self._coarse[frame, step] = coarser(frame, step)
        return self._coarse[frame, step]

    def _fit_target(self, camera: Camera) -> Target:
        size = camera.width, camera.height
        if self._target is None or self._target.size != size:
            if self._target is not None:
                self._target.release()
                self._forget_samples(self._target)
                self.steps.forget(of=[self._target, self._target.splats, self._target.surfaces])
            self._target = None  # stays so when the new one does not fit the GPU
            self._target = Target(self._gl, size)
        return self._target

    def _draw_shadows(self, shot: Shot, things: dict[Placed, Thing]) -> Lamps:
        """The lights, with the shadow map of those that cast shadows.

        Spots and corners of meshes need a map even without shadows: only the shaders that look it up know them.
        """
        lights = shot.lights
        early = any(isinstance(p.content, Mesh) and p.content.shading in LIT_EARLY for p in shot.shown)
        if not (early or any(light.shadow or light.is_spot for light in lights)):
            return Lamps(lights, shot.scene.ambient)
        shadow_map = self._shadow_map = self._shadow_map or ShadowMap(self._gl)
        views, spans = shadow_views(lights, *shot.scene.bounds)
        if views:
            drawn = (things[p] for p in shot.casting)
            shapes = tuple(thing if isinstance(thing, PlacedMesh) else thing.points for thing in drawn)
            self.steps.run("shadows", self._fill_shadow_map, shadow_map, views, shapes)
        return Lamps(lights, shot.scene.ambient, views, spans, shadow_map)

    def _fill_shadow_map(
        self, shadow_map: ShadowMap, views: list[ShadowView], things: tuple[Points | PointSet | Grid | PlacedMesh, ...]
    ) -> None:
        if shadow_map.fit(views):
            self.steps.forget("tile")
        for k, view in enumerate(views):
            if not self.steps.is_new("tile", view, things, of=k):
                continue
            tile = shadow_map.tile(k)
            for thing in things:
                if isinstance(thing, PlacedMesh):
                    self._mesh_objects().add_shadow(tile, thing, view.eye)
                elif isinstance(thing, Grid):
                    self._grid_objects().add_shadow(tile, thing, view.eye)
                else:
                    self._points.add_shadow(tile, thing, view.eye)
                self._count(thing)

    def _light_points(self, shown: tuple[Thing, ...], shot: Shot, lamps: Lamps) -> None:
        """Lights the points themselves, for shading models that mix their light; in the axes of their object."""
        for p, thing in zip(shot.shown, shown, strict=True):
            for view in thing.views if isinstance(thing, ShownSet) else (thing,):
                if isinstance(view, ShownPoints | ShownGrid) and view.light:
                    self.steps.always("light", self._light_some, view, p.content.look.material, shot.eye, lamps)

    def _light_some(self, thing: ShownPoints | ShownGrid, material: Material, eye: Eye, lamps: Lamps) -> None:
        points, light = thing.points, thing.light
        assert light is not None
        viewer = _seen_from(points.pose, eye)
        empty(light.target, points.surface.window)  # beside the points values are weighted by 0, but must be defined
        self._light.draw(
            light.target, points.surface.texture, thing.textures.color, points.source, lamps.seen_from(points.pose),
            np.array([material.strengths]), (viewer, points.scale),
        )  # fmt: skip
        light.raise_version()

    def _draw_lit_splats(self, target: Target, shot: Shot, things: dict[Placed, Thing], lamps: Lamps) -> bool:
        """Draws one point object in one pass, where flat shading allows it: a new view, as most see only one light."""
        shown = tuple(things[p] for p in shot.shown)
        if not _is_single(shown, lamps):
            return False
        thing, counts = shown[0], self.steps.counts
        if not isinstance(thing, ShownPoints) or thing.shading != "flat" or not self._points.can_light(thing.points):
            return False
        before = counts["lit splats"]
        inputs = self._light.inputs(lamps.seen_from(thing.points.pose))
        inputs |= {"material": shot.shown[0].content.look.material.strengths}
        inputs |= {"eye": tuple(_seen_from(thing.points.pose, shot.eye).tolist())}
        draw = partial(self._points.draw_lit_splats, lights=inputs)  # of which no step sees that they are others
        self.steps.run("lit splats", draw, target, thing.points, thing.textures, shot.eye)
        return counts["lit splats"] > before

    def _draw_single(self, target: Target, canvas: Canvas, thing: Thing, shot: Shot, lamps: Lamps) -> None:
        """The picture of one point object. A new view is lit at once, because most views see only one light."""
        assert isinstance(thing, ShownPoints)
        run, always, points, eye = self.steps.run, self.steps.always, self._points, shot.eye
        before = target.splats.version
        run("splats", points.draw_splats, target.splats, thing.points, eye)
        looking = target.splats, thing, eye
        if thing.shading != "phong":
            always("resolve", points.draw_picture, canvas, *looking)
        elif target.splats.version > before:
            material = shot.shown[0].content.look.material
            lights = self._light.inputs(lamps.seen_from(eye.pose)) | {"material": material.strengths}
            always("resolve", points.draw_lit, canvas, *looking, lights)
        else:
            run("resolve", points.draw_surface, target.surfaces, *looking)
            self._light_pixels(target, canvas, shot, lamps)

    def _draw_surfaces(self, target: Target, shown: tuple[Thing, ...], shot: Shot, lamps: Lamps) -> None:
        """The visible surfaces of all things, with the numbers of their materials."""
        materials = _materials(shot)
        numbers = tuple(1 + materials.index(_material(p)) for p in shot.shown)
        early = any(map(_is_lit_as_drawn, shown))
        lighting = lamps.seen_from(shot.eye.pose) if early else None
        self.steps.run("surfaces", self._fill_surfaces, target, target.surfaces, shown, numbers, shot.eye, lighting)

    def _fill_surfaces(
        self, target: Target, surfaces: SurfaceImage, shown: tuple[Thing, ...], numbers: tuple[int, ...], eye: Eye,
        lighting: Lighting | None,
    ) -> None:  # fmt: skip
        """lighting: for meshes that are lit as they are drawn"""
        empty(surfaces.shared_target)
        surfaces.window = 0, 0, *surfaces.size
        lights = self._light.inputs(lighting) if lighting else {}
        for thing, number in zip(shown, numbers, strict=True):
            if isinstance(thing, PlacedMesh):
                self._mesh_objects().add_surface(surfaces, thing, eye, number, lights)
            elif isinstance(thing, ShownGrid):
                self._grid_objects().add_surface(surfaces, thing, eye, number, lights)
            elif isinstance(thing, ShownSet):
                self._points.add_set(target, thing, eye, number)
            else:
                self._points.add_surface(surfaces, target.splats, thing, eye, number)
            self._count(thing)
        surfaces.raise_version()

    def _light_pixels(self, target: Target, canvas: Canvas, shot: Shot, lamps: Lamps) -> None:
        """Surfaces -> the picture."""
        materials = np.array([material.strengths for material in _materials(shot)])
        lighting, surfaces = lamps.seen_from(shot.eye.pose), target.surfaces
        inputs = surfaces.surface, surfaces.albedo, shot.eye.camera, lighting, materials
        with canvas.opened(surfaces.window) as image:
            self.steps.always("light", self._light.draw, image, *inputs, None, canvas.linear)

    def _draw_ground(
        self, target: Target, shot: Shot, lamps: Lamps, canvas: Canvas, up: tuple[float, float, float]
    ) -> None:
        """The shadows on the ground, where nothing else is seen. Lights with shadows have left the surfaces there."""
        self._ground = self._ground or FullscreenPass(self._gl, "ground.frag")
        ground = self.steps.run("ground", ground_under, shot.scene, up)
        inputs = self._light.inputs(lamps.seen_from(shot.eye.pose)) | {"surface_map": target.surfaces.surface}
        inputs |= {"intrinsics": shot.eye.camera.intrinsics, "plane": seen_ground(ground, shot.eye.pose)}
        with canvas.opened((0, 0, *target.size)) as image:
            self._ground.draw(image, {}, material=_materials(shot)[0].strengths, **inputs)

    def _mesh_objects(self) -> MeshObjects:
        self._meshes = self._meshes or MeshObjects(self._gl)
        return self._meshes

    def _grid_objects(self) -> GridObjects:
        self._grids = self._grids or GridObjects(self._gl)
        return self._grids

    def _count(self, thing: Points | PointSet | Grid | Thing) -> None:
        points = thing.points if isinstance(thing, ShownSet) else thing
        several = len(points.parts) if isinstance(points, PointSet) else 1
        is_mesh = isinstance(thing, PlacedMesh | Grid | ShownGrid)
        self.steps.counts["mesh" if is_mesh else "splats"] += several

    def release(self) -> None:
        """Frees everything on the GPU, in reverse order. No step counts as done any more."""
        self.steps.forget()
        made = self._target, self._shadow_map, self._meshes, self._grids, self._consensus, self._develop, self._ground
        for item in (*made, self._light, self._points, self.frames):
            if item is not None:
                item.release()


def _as_splats(p: Placed, drawn: DrawnPoints, textures: FrameTextures, step: int) -> ShownPoints:
    look, (surface, lit, source) = p.content.look, drawn
    sizes = check_sizes(look.size, p.content.frame.depth.shape)
    sizes = sizes if step == 1 else np.array([coarser_size(float(sizes[0]), step)], np.float32)
    points = Points(surface, source, *p.rigid_axes, sizes, look.splat)
    return ShownPoints(points, textures, lit if look.shading in LIT_EARLY else None, look.shading)


def _seen_from(pose: Matrix, eye: Eye) -> NDArray[np.float64]:
    """(3,) where an eye is, in the axes of this pose (4, 4)."""
    return (np.linalg.inv(pose) @ eye.pose)[:3, 3]


def _is_single(shown: tuple[Thing, ...], lamps: Lamps) -> bool:
    """One point object at its own scale, without spots and shadows."""
    one = shown[0] if len(shown) == 1 else None
    return lamps.shadow_map is None and isinstance(one, ShownPoints) and one.points.scale == 1


def _is_lit_as_drawn(thing: Thing) -> bool:
    """Its surfaces change with the light."""
    if isinstance(thing, PlacedMesh):
        return thing.mesh.shading in LIT_EARLY
    return isinstance(thing, ShownGrid) and thing.shading == "flat"


def _material(p: Placed) -> Material:
    return p.content.look.material if isinstance(p.content, PointObject) else p.content.material


def _materials(shot: Shot) -> list[Material]:
    """The materials of all that is shown, each once; never empty."""
    return list(dict.fromkeys(map(_material, shot.shown))) or [Material()]
