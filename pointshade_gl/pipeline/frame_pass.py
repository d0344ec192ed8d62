"""Draws one sample of a picture: the visible surfaces of all objects, then the light on them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import moderngl
import numpy as np

from ..gpu.clouds.splat_layer import ANY, HALF, LayerImage, PlacedSplats
from ..gpu.core.steps import Steps
from ..gpu.core.view_images import Canvas, Drawable, SurfaceImage, Target
from ..gpu.drawables import Drawables, Objects
from ..gpu.meshes.mesh_objects import ShownGrid, joined
from ..gpu.points.point_objects import ShownPoints
from ..gpu.shading.light_pass import LightPass
from ..gpu.shading.light_set import Lighting, LightSet, environment_inputs
from ..gpu.shading.occlusion import ViewVisibilityPass
from ..gpu.shading.present import SurfaceColorsPass
from ..scene.appearance import LIT_EARLY, Material, strengths_in
from ..scene.camera import Eye, view_matrix
from ..scene.node import Placed
from ..scene.visible import VisibleScene, looking_distance


class FramePass:
    """Draws what is on the GPU, under lights that are set up.

    A single point object under plain lights is lit while its pixels are looked up. Otherwise all drawables write their
    visible surfaces first, and each pixel is lit once.
    """

    def __init__(
        self, steps: Steps, objects: Objects, light: LightPass, view_visibility: ViewVisibilityPass,
        colors: SurfaceColorsPass,
    ):  # fmt: skip
        self._steps, self._objects, self._light = steps, objects, light
        self._view_visibility, self._colors = view_visibility, colors

    def draw(
        self, target: Target, canvas: Canvas, visible: VisibleScene, drawables: Drawables, light_set: LightSet
    ) -> Sequence[Material] | None:
        """Draw one sample of the picture onto a canvas. If another light would only need `light_pixels`, return the
        materials for it."""
        if single := single_object(visible, drawables, light_set):
            return self.draw_single_object(target, canvas, single, visible, light_set)
        if visible.scale is None and any(isinstance(drawables[p], PlacedSplats) for p in visible.shown):
            self._draw_layers(target, canvas, visible, drawables, light_set)
            return None
        self.draw_surfaces(target, visible, drawables, light_set)
        if visible.scale is not None:
            colored = target.surfaces, visible.eye.camera, visible.scale
            self._steps.always("colors", self._colors.draw, canvas, *colored)
            return None
        numbered = numbered_materials(visible, drawables)
        self.light_pixels(target, canvas, visible, light_set, numbered)
        return None if any(p.content.shading in LIT_EARLY for p in visible.shown) else numbered

    def keep_surfaces(self, target: Target, visible: VisibleScene, drawables: Drawables, light_set: LightSet) -> None:
        """Draw the surfaces of a picture that `draw` has drawn: they are there already in most cases."""
        if single := single_object(visible, drawables, light_set):
            run, points, eye = self._steps.run, self._objects.kind_of(single), visible.eye
            run("splats", points.draw_splats, target.splats, single.points, eye)
            run("resolve", points.draw_surface, target.surfaces, target.splats, single, eye)
        else:
            self.draw_surfaces(target, visible, drawables, light_set)

    def draw_lit_splats(self, target: Target, visible: VisibleScene, drawables: Drawables, light_set: LightSet) -> bool:
        """Draw a single flat-shaded point object in one pass, lit in the vertex shader. Return whether it was drawn.

        It is drawn so only when its points, its colours or the view are new: most views are seen under one light. False
        leaves it to `draw`: for all other objects, and for the same view under another light, for which its splats are
        kept.
        """
        thing, counts, points = single_object(visible, drawables, light_set), self._steps.counts, self._objects.points
        if not isinstance(thing, ShownPoints) or thing.shading != "flat" or not points.can_light(thing.points):
            return False
        if light_set.environment is not None or thing.visibility is not None:
            return False
        before = counts["lit splats"]
        inputs = self._light.inputs(light_set.seen_from(thing.points.pose))
        inputs |= {"material": strengths_in(visible.materials[0], visible.fill)}
        inputs |= {"eye": tuple(view_matrix(visible.eye.pose, thing.points.pose)[:3, 3].tolist())}
        draw = partial(points.draw_lit_splats, lights=inputs)  # of which no step sees that they are others
        self._steps.run("lit splats", draw, target, thing.points, thing.colors, visible.eye)
        return counts["lit splats"] > before

    def draw_single_object(
        self, target: Target, canvas: Canvas, thing: ShownPoints | ShownGrid, visible: VisibleScene, light_set: LightSet
    ) -> Sequence[Material] | None:
        """Draw a single point object. A new view is lit in the same pass: most views see only one light."""
        run, always, points, eye = self._steps.run, self._steps.always, self._objects.kind_of(thing), visible.eye
        before = target.splats.version
        run("splats", points.draw_splats, target.splats, thing.points, eye)
        looking = target.splats, thing, eye
        if thing.shading != "phong":
            always("resolve", points.draw_picture, canvas, *looking)
        elif target.splats.version > before:
            lighting = light_set.seen_from(eye.pose)
            lights = self._light.inputs(lighting, True) | environment_inputs(lighting)
            lights["material"] = strengths_in(visible.materials[0], visible.fill)
            always("resolve", points.draw_lit, canvas, *looking, lights)
        else:
            run("resolve", points.draw_surface, target.surfaces, *looking)
            self.light_pixels(target, canvas, visible, light_set, visible.materials)
            return visible.materials
        return None

    def _draw_layers(
        self, target: Target, canvas: Canvas, visible: VisibleScene, drawables: Drawables, light_set: LightSet
    ) -> None:
        """Draw trained splats over the picture of all other objects: what they cover of a pixel is seen of them."""
        opaque, trained = _layers(visible, drawables)
        layer = self._objects.splats
        things = tuple(drawables[p] for p in trained.shown)
        is_lit = any(thing.shading not in ("none", "auto") for thing in things)
        image = layer.fit(target.size, is_lit)
        if opaque.shown:
            self.draw(target.behind, layer.canvas(image.behind), opaque, drawables, light_set)
        if is_lit:
            self.draw_surfaces(target, visible, drawables, light_set, ANY)
            both = trained._replace(shown=[*opaque.shown, *trained.shown])
            self.light_pixels(target, layer.canvas(image.lit), both, light_set, numbered_materials(both, drawables))
        else:
            self._blend(image, target, opaque, trained, drawables, light_set, has_surface=False)
        self._steps.always("compose", layer.compose, canvas, image, is_lit, bool(opaque.shown))

    def _blend(
        self, image: LayerImage, target: Target, opaque: VisibleScene, trained: VisibleScene, drawables: Drawables,
        light_set: LightSet, has_surface: bool,
    ) -> None:  # fmt: skip
        behind = None
        if opaque.shown:
            self.keep_surfaces(target.behind, opaque, drawables, light_set)
            behind = target.behind.surfaces
        things = tuple(drawables[p] for p in trained.shown)
        blend = self._objects.splats.blend
        self._steps.run("splat layer", blend, image, things, trained.eye, behind, has_surface, of=image)

    def draw_surfaces(
        self, target: Target, visible: VisibleScene, drawables: Drawables, light_set: LightSet, least: float = HALF
    ) -> None:
        """Draw the visible surfaces of all objects (normal, depth, albedo), with the numbers of their materials.

        Those of objects with eye-dome lighting are negative. least: what trained splats cover of a pixel in which their
        surface is seen.
        """
        opaque, trained = _layers(visible, drawables)
        if trained.shown:
            layer, image = self._objects.splats, self._objects.splats.fit(target.size, True)
            self._blend(image, target, opaque, trained, drawables, light_set, has_surface=True)
            behind = target.behind.surfaces if opaque.shown else None
            surfaces = target.surfaces
            surfaces.knows_visibility, surfaces.has_doubts = False, behind is not None and behind.has_doubts
            number = material_numbers(trained, drawables, len(list(_rows(opaque, drawables))))[0]
            has_eye_dome = any(drawables[p].shading == "edl" for p in trained.shown)
            surfaces.has_eye_dome = has_eye_dome or (behind is not None and behind.has_eye_dome)
            number = -float(number) if has_eye_dome else float(number)
            hides = bool(visible.environment_light.occlusion)
            self._steps.run("merge", layer.merge, surfaces, image, behind, least, number, hides)
            return
        shown = tuple(thing for _, thing in _rows(visible, drawables))
        places = material_numbers(visible, drawables)
        numbers = tuple(-k if thing.shading == "edl" else k for k, thing in zip(places, shown, strict=True))
        early = any(thing.is_lit_as_drawn for thing in shown)
        lighting = light_set.seen_from(visible.eye.pose) if early else None
        hides = bool(visible.environment_light.occlusion)
        marks = visible.scale is not None and visible.scale.show == "certainty"
        inputs = target.surfaces, shown, numbers, visible.eye, lighting, hides, marks
        self._steps.run("surfaces", self._fill_surfaces, target, *inputs)

    def _fill_surfaces(
        self, target: Target, surfaces: SurfaceImage, shown: tuple[Drawable, ...], numbers: tuple[int, ...], eye: Eye,
        lighting: Lighting | None, hides: bool, marks: bool,
    ) -> None:  # fmt: skip
        """lighting: for meshes that are lit as they are drawn; hides: what is near hides light from all around; marks:
        see `SurfaceImage.marks_doubts`"""
        surfaces.has_visibility, surfaces.marks_doubts = hides, marks
        surfaces.clear()
        surfaces.has_eye_dome = any(number < 0 for number in numbers)
        surfaces.has_doubts = any(thing.has_doubts for thing in shown)
        surfaces.knows_visibility = len(shown) <= 1 and all(
            thing.views and all(view.visibility is not None for view in thing.views) for thing in shown
        )
        lights = self._light.inputs(lighting) | environment_inputs(lighting) if lighting else {}
        for thing, number in zip(shown, numbers, strict=True):
            self._objects.add_surface(target, thing, eye, number, lights)
        surfaces.raise_version()

    def in_order(self, visible: VisibleScene, drawables: Drawables) -> list[Placed]:
        """Return what is shown, in the order of the numbers of `draw_surfaces`. Trained splats share their first."""
        return [p for layer in _layers(visible, drawables) for p in layer.shown]

    def light_again(self, image: moderngl.Framebuffer) -> bool:
        """Light the pixels of a picture as they are, if they were lit last. Return whether that was so."""
        last = self._light.last
        if last is None or last[1] is not image or not last[0].holds_inputs:
            return False
        self._steps.always("light", last[0].draw_again, image)
        return True

    def light_pixels(
        self, target: Target, canvas: Canvas, visible: VisibleScene, light_set: LightSet, numbered: Sequence[Material]
    ) -> None:
        """Light the visible surfaces onto the canvas. numbered: their materials."""
        materials = np.array([strengths_in(material, visible.fill) for material in numbered or [Material()]])
        lighting, surfaces = light_set.seen_from(visible.eye.pose), target.surfaces
        inputs = surfaces.surface, surfaces.albedo, visible.eye.camera, lighting, materials
        marks: dict[str, Any] = {"has_doubts": surfaces.has_doubts, "has_eye_dome": surfaces.has_eye_dome}
        if surfaces.has_visibility:
            marks["visibility"] = self.find_visibility(surfaces, visible)
        with canvas.opened(surfaces.window) as image:
            self._steps.always("light", partial(self._light.draw, linear=canvas.linear, **marks), image, *inputs)

    def find_visibility(self, surfaces: SurfaceImage, visible: VisibleScene) -> moderngl.Texture:
        """Return what is seen of the light from all around: see `SurfaceImage.visibility`."""
        if surfaces.knows_visibility:
            return surfaces.visibility
        radius = visible.environment_light.radius(looking_distance(visible.scene, visible.eye.pose))
        needed = surfaces, visible.eye.camera, radius, visible.sample
        return self._steps.run("view visibility", self._view_visibility.find, *needed, of=surfaces)


def _layers(visible: VisibleScene, drawables: Drawables) -> tuple[VisibleScene, VisibleScene]:
    """Return what is opaque of a view, and its trained splats: as each pixel's middle sees them, in all samples."""
    trained = [p for p in visible.shown if isinstance(drawables[p], PlacedSplats)]
    opaque = [p for p in visible.shown if p not in trained] if trained else visible.shown
    return visible._replace(shown=opaque), visible._replace(shown=trained, eye=visible.steady or visible.eye)


def _rows(visible: VisibleScene, drawables: Drawables) -> Iterator[tuple[int, Any]]:
    """Yield what is drawn at once, with the number of its first object: copies of one mesh, unless they stay apart."""
    shown = (drawables[p] for p in visible.shown)
    return enumerate(shown) if visible.apart else joined(shown)


def material_numbers(visible: VisibleScene, drawables: Drawables, after: int = 0) -> list[int]:
    """Return the numbers of the objects' materials, from 1: of each object one where they hide each other.

    after  how many objects come before
    """
    rows, materials = list(_rows(visible, drawables)), visible.materials
    if visible.environment_light.occlusion:
        return [after + k + 1 for k in range(len(rows))]
    return [1 + materials.index(visible.shown[first].content.material) for first, _ in rows]


def numbered_materials(visible: VisibleScene, drawables: Drawables) -> Sequence[Material]:
    """Return the materials by these numbers."""
    if not visible.environment_light.occlusion:
        return visible.materials
    return [visible.shown[first].content.material for first, _ in _rows(visible, drawables)]


def single_object(visible: VisibleScene, drawables: Drawables, light_set: LightSet) -> ShownPoints | ShownGrid | None:
    """Return the only object in view if it can be drawn and lit alone: points at their own scale, without spots and
    shadows.

    A mesh between the points also counts, unless it is lit as it is drawn. Eye-dome lighting needs neighbours.
    """
    one = drawables[visible.shown[0]] if len(visible.shown) == 1 else None
    if visible.scale is not None or light_set.shadow_map is not None or not isinstance(one, ShownPoints | ShownGrid):
        return None
    return one if one.points.scale == 1 and one.shading != "edl" and not one.is_lit_as_drawn else None
