"""How a scene is drawn: surfaces of all objects into one picture, the lights' shadow maps, then light, once a pixel."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .camera import Camera, check_pose
from .culling import coarser, coarser_step, is_in_view
from .frame import Frame
from .gpu.light import Shadows
from .gpu.meshes import MeshPass
from .gpu.shadows import ShadowPass
from .gpu.textures import FrameTextures, Target, empty
from .light import Light, at_upper_left, count_views, light_rows
from .look import Material, check_sizes
from .mesh import Mesh
from .scene import Placed, PointObject, Scene, bounding_sphere
from .shadow_views import Matrix, ShadowView, shadow_views

if TYPE_CHECKING:
    import moderngl

    from .renderer import Renderer

NEAR = 0.001  # share of the distance to the scene's middle: what comes closer to the viewer is cut away
SHADOW_SIDE = 1024  # pixels of a shadow view
SHADOW_MAP = 8192  # pixels of all of them, side by side: beyond 64 views each becomes smaller


class Points(NamedTuple):
    """A point object on the GPU."""

    placed: Placed
    frame: Frame
    textures: FrameTextures
    pose: Matrix  # (4, 4) from the frame's camera to the world, without the scale
    scale: float


class SceneRenderer:
    """Draws scenes with the passes of a Renderer, and those that only scenes need."""

    def __init__(self, renderer: Renderer):
        self._renderer = renderer
        self._meshes = MeshPass(renderer.context.gl)
        self._shadows = ShadowPass(renderer.context.gl)
        self._coarse: dict[tuple[Frame, int], Frame] = {}
        self._nothing = renderer.context.gl.texture((1, 1), 4, dtype="f4")

    def draw(self, scene: Scene, lights: Sequence[Light] | None, camera: Camera | None, pose: Matrix | None) -> Target:
        """The picture in the renderer's target. Lights, camera and pose in place of the scene's own."""
        run, stamp = self._renderer.steps.run, self._renderer.steps.stamp
        scene = scene.framed()
        camera, pose = camera or scene.camera, check_pose(scene.pose if pose is None else pose)
        assert camera is not None
        placed = list(scene.placed())
        things = [p for p in placed if not isinstance(p.content, Light)]
        lights = scene.lights or [Light()] if lights is None else lights
        lights = [at_upper_left(light, pose) for light in lights]
        centre, radius = bounding_sphere(things)
        near = NEAR * max(float(np.linalg.norm(centre - pose[:3, 3])), radius)
        shown = [p for p in things if is_in_view(p.corners, np.eye(4), camera, pose, near)]
        casting = [light for light in lights if light.shadow]
        cast = [p for p in things if p.node.shadow and casting]
        self._renderer.steps.counts["culled"] += len(things) - len(shown)
        self._meshes.keep_only([p.content for p in (*shown, *cast) if isinstance(p.content, Mesh)])
        points = self._prepare([p for p in things if p in shown or p in cast], camera, pose)
        target = self._renderer.fit_target(camera)

        columns = math.ceil(math.sqrt(sum(map(count_views, casting))))
        side = min(SHADOW_SIDE, SHADOW_MAP // max(columns, 1))
        views = [shadow_views(light, centre, radius, side) for light in casting]
        if views:
            geometry = tuple(self._shape(p, points) for p in cast)
            flat = [view for several in views for view in several]
            run("shadows", (tuple(flat), geometry), self._draw_shadows, flat, cast, points)
        firsts = np.cumsum([0, *map(len, views)])
        first_of = [int(firsts[casting.index(light)]) if light.shadow else None for light in lights]

        for p in shown:
            if p in points and look_of(p).shading in ("flat", "gouraud"):
                run(
                    "lit points",
                    None,
                    self._light_points,
                    points[p],
                    pose,
                    lights,
                    first_of,
                    scene.ambient,
                    views,
                    of=points[p].textures,
                )
        materials = list(dict.fromkeys(look_of(p).material for p in shown)) or [Material()]

        def light_of(p: Placed) -> int:
            return stamp("lit points", points[p].textures) if p in points else 0

        looks = tuple((*self._shape(p, points), look_of(p).material, look_of(p).shading, light_of(p)) for p in shown)
        rows, shadows = light_rows(lights, pose, first_of), self._look_ups(views, pose)
        lit = self._renderer.light.scene_inputs(rows, scene.ambient, shadows)
        if any(isinstance(p.content, Mesh) and look_of(p).shading in ("flat", "gouraud") for p in shown):
            looks += (rows, stamp("shadows"), tuple(scene.ambient))  # these are lit as they are drawn
        surfaces = shown, points, target, camera, pose, near, materials, lit
        run("surfaces", (camera, pose, near, looks), self._draw_surfaces, *surfaces)
        table = np.array([[m.strengths] for m in materials])
        run("light", None, self._renderer.light.draw_scene, target, camera, rows, table, scene.ambient, shadows)
        return target

    def _prepare(self, things: list[Placed], camera: Camera, pose: Matrix) -> dict[Placed, Points]:
        """Textures and normals of the point objects, each as fine as the view shows it."""
        objects = [p for p in things if isinstance(p.content, PointObject)]
        frames = [self._as_fine_as_seen(p, camera, pose) for p in objects]
        self._coarse = {key: frame for key, frame in self._coarse.items() if frame in frames}
        found = {}
        for p, frame, textures in zip(objects, frames, self._renderer.upload(frames), strict=True):
            content: PointObject = p.content
            self._renderer.find_normals(
                textures, frame, content.look.normals, content.look.max_depth_step, content.look.noise
            )
            found[p] = Points(p, frame, textures, *p.rigid_axes())
        return found

    def _as_fine_as_seen(self, p: Placed, camera: Camera, pose: Matrix) -> Frame:
        """The object's frame, or a coarser one; options that are arrays need all of it."""
        content: PointObject = p.content
        step = coarser_step(content.frame, p.axes, camera, pose)
        if step == 1 or not content.look.is_uniform:
            return content.frame
        key = content.frame, step
        if key not in self._coarse:
            self._coarse[key] = coarser(content.frame, step)
        return self._coarse[key]

    def _shape(self, p: Placed, points: dict[Placed, Points]) -> tuple[Any, ...]:
        """What tells whether it would be drawn in the same place and form as before."""
        if p not in points:
            return p.world, p.content
        content, one = p.content, points[p]
        sizes = check_sizes(content.look.size, one.frame.depth.shape)
        return p.world, one.textures, self._renderer.steps.stamp("surface", one.textures), sizes, content.look.splat

    def _draw_splats(
        self, one: Points, target: Target, camera: Camera, pose: Matrix, near: float
    ) -> tuple[Matrix, bool]:
        """The view, source axes to target axes over the object's scale, and whether to look up in `nearest`."""
        content: PointObject = one.placed.content
        view = np.linalg.inv(pose) @ one.pose
        view[:3, 3] /= one.scale
        sizes = check_sizes(content.look.size, one.frame.depth.shape)
        splats = self._renderer.rasterizer(sizes, content.look.splat)
        way = one.textures, one.frame.camera, target, camera, view
        splats.draw(*way, near / one.scale, sizes, content.look.splat)
        self._renderer.steps.counts["splats"] += 1
        return view, splats.look_up

    def _draw_surfaces(
        self, shown: list[Placed], points: dict[Placed, Points], target: Target, camera: Camera, pose: Matrix,
        near: float, materials: list[Material], lights: dict[str, Any],
    ) -> None:  # fmt: skip
        empty(target.shared_surfaces)
        for p in shown:
            number = (materials.index(look_of(p).material) + 1) / 65535
            if p in points:
                one = points[p]
                view, look_up = self._draw_splats(one, target, camera, pose, near)
                way = target.shared_surfaces, one.textures, one.frame.camera, target, camera, view
                shown_as = look_of(p).shading, look_up, number, (near, one.scale)
                self._renderer.resolve.draw_surfaces(*way, *shown_as)
            else:
                view = np.linalg.inv(pose) @ p.world
                self._meshes.draw_surface(target.shared_surfaces, p.content, camera, view, near, number, lights)
                self._renderer.steps.counts["mesh"] += 1

    def _draw_shadows(self, views: list[ShadowView], cast: list[Placed], points: dict[Placed, Points]) -> None:
        def draw_meshes(target: moderngl.Framebuffer, view: ShadowView) -> None:
            for p in cast:
                if p not in points:
                    matrix = np.linalg.inv(view.pose) @ p.world
                    self._meshes.draw_shadow(target, p.content, view.camera, matrix, view.near)
                    self._renderer.steps.counts["mesh"] += 1

        def splats_of(one: Points) -> Callable[[Target, ShadowView], tuple[bool, float]]:
            def draw(target: Target, view: ShadowView) -> tuple[bool, float]:
                look_up = self._draw_splats(one, target, view.camera, view.pose, view.near)[1]
                return look_up, view.near / one.scale

            return draw

        self._shadows.draw(views, draw_meshes, [splats_of(points[p]) for p in cast if p in points])

    def _light_points(
        self,
        one: Points,
        pose: Matrix,
        lights: Sequence[Light],
        first_of: list[int | None],
        ambient: Any,
        views: list[list[ShadowView]],
    ) -> None:
        """Light of the points themselves, for shading models that show it between them; in the object's turned axes."""
        content: PointObject = one.placed.content
        eye = (np.linalg.inv(one.pose) @ pose)[:3, 3]
        rows = light_rows(lights, one.pose, first_of)
        shadows = self._look_ups(views, one.pose)
        self._renderer.light.draw_scene_points(
            one.textures, one.frame.camera, eye, rows, content.look.material, one.scale, ambient, shadows
        )

    def _look_ups(self, views: list[list[ShadowView]], axes: Matrix) -> Shadows:
        flat = [view for several in views for view in several]
        if not flat:
            return Shadows({"shadow_map": self._nothing, "views": self._nothing}, axes[:3, :3])
        return Shadows({"shadow_map": self._shadows.map, "views": self._shadows.write_views(flat, axes)}, axes[:3, :3])

    def release(self) -> None:
        for item in (self._nothing, self._shadows, self._meshes):
            item.release()


def look_of(p: Placed) -> Any:
    return p.content.look if isinstance(p.content, PointObject) else p.content
