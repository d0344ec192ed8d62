"""Draws one sample of a picture: the visible surfaces of all objects, then the light on them."""

from __future__ import annotations

from functools import partial

import numpy as np

from ..gpu.clouds.cloud_objects import PlacedCloud
from ..gpu.core.canvas import Canvas
from ..gpu.core.steps import Steps
from ..gpu.core.view_images import SurfaceImage, Target
from ..gpu.drawables import Drawable, Drawables, Objects
from ..gpu.meshes.grid_objects import ShownGrid
from ..gpu.meshes.mesh_objects import PlacedMesh, joined
from ..gpu.points.point_objects import ShownPoints
from ..gpu.shading.light_pass import LightPass
from ..gpu.shading.light_set import Lighting, LightSet
from ..scene.appearance import LIT_EARLY
from ..scene.camera import Eye, view_matrix
from ..scene.visible_scene import VisibleScene, material_of


class FramePass:
    """Draws what is on the GPU, under lights that are set up.

    A single point object under plain lights is lit while its pixels are looked up. Otherwise all drawables write their
    visible surfaces first, and each pixel is lit once.
    """

    def __init__(self, steps: Steps, objects: Objects, light: LightPass):
        self._steps = steps
        self._objects = objects
        self._light = light

    def draw(
        self, target: Target, canvas: Canvas, visible: VisibleScene, drawables: Drawables, light_set: LightSet
    ) -> None:
        """Draw one sample of the picture onto a canvas."""
        if single := _single(visible, drawables, light_set):
            self._draw_single(target, canvas, single, visible, light_set)
        else:
            self.draw_surfaces(target, visible, drawables, light_set)
            self._light_pixels(target, canvas, visible, light_set)

    def draw_lit_splats(self, target: Target, visible: VisibleScene, drawables: Drawables, light_set: LightSet) -> bool:
        """Draw a single flat-shaded point object in one pass, lit in the vertex shader. Return whether it was drawn.

        It is drawn so only when its points, its colours or the view are new: most views are seen under one light. False
        leaves it to `draw`: for all other objects, and for the same view under another light, for which its splats are
        kept.
        """
        thing, counts, points = _single(visible, drawables, light_set), self._steps.counts, self._objects.points
        if not isinstance(thing, ShownPoints) or thing.shading != "flat" or not points.can_light(thing.points):
            return False
        before = counts["lit splats"]
        inputs = self._light.inputs(light_set.seen_from(thing.points.pose))
        inputs |= {"material": visible.materials[0].strengths}
        inputs |= {"eye": tuple(view_matrix(visible.eye.pose, thing.points.pose)[:3, 3].tolist())}
        draw = partial(points.draw_lit_splats, lights=inputs)  # of which no step sees that they are others
        self._steps.run("lit splats", draw, target, thing.points, thing.colors, visible.eye)
        return counts["lit splats"] > before

    def _draw_single(
        self, target: Target, canvas: Canvas, thing: ShownPoints | ShownGrid, visible: VisibleScene, light_set: LightSet
    ) -> None:
        """Draw a single point object. A new view is lit in the same pass: most views see only one light."""
        run, always, points, eye = self._steps.run, self._steps.always, self._objects.kind_of(thing), visible.eye
        before = target.splats.version
        run("splats", points.draw_splats, target.splats, thing.points, eye)
        looking = target.splats, thing, eye
        if thing.shading != "phong":
            always("resolve", points.draw_picture, canvas, *looking)
        elif target.splats.version > before:
            lights = self._light.inputs(light_set.seen_from(eye.pose), True)
            lights["material"] = visible.materials[0].strengths
            always("resolve", points.draw_lit, canvas, *looking, lights)
        else:
            run("resolve", points.draw_surface, target.surfaces, *looking)
            self._light_pixels(target, canvas, visible, light_set)

    def draw_surfaces(self, target: Target, visible: VisibleScene, drawables: Drawables, light_set: LightSet) -> None:
        """Draw the visible surfaces of all objects (normal, depth, albedo), with the numbers of their materials.

        Those of objects with eye-dome lighting are negative.
        """
        rows, materials = list(joined(drawables[p] for p in visible.shown)), visible.materials
        shown = tuple(thing for _, thing in rows)
        places = (1 + materials.index(material_of(visible.shown[first])) for first, _ in rows)
        numbers = tuple(-k if thing.shading == "edl" else k for k, thing in zip(places, shown, strict=True))
        early = any(map(_is_lit_as_drawn, shown))
        lighting = light_set.seen_from(visible.eye.pose) if early else None
        self._steps.run("surfaces", self._fill_surfaces, target, target.surfaces, shown, numbers, visible.eye, lighting)

    def _fill_surfaces(
        self, target: Target, surfaces: SurfaceImage, shown: tuple[Drawable, ...], numbers: tuple[int, ...], eye: Eye,
        lighting: Lighting | None,
    ) -> None:  # fmt: skip
        """lighting: for meshes that are lit as they are drawn"""
        surfaces.clear()
        surfaces.has_eye_dome = any(number < 0 for number in numbers)
        surfaces.has_doubts = any(
            not isinstance(thing, PlacedMesh | PlacedCloud) and thing.has_doubts for thing in shown
        )
        lights = self._light.inputs(lighting) if lighting else {}
        for thing, number in zip(shown, numbers, strict=True):
            self._objects.add_surface(target, thing, eye, number, lights)
        surfaces.raise_version()

    def _light_pixels(self, target: Target, canvas: Canvas, visible: VisibleScene, light_set: LightSet) -> None:
        """Light the visible surfaces onto the canvas."""
        materials = np.array([material.strengths for material in visible.materials])
        lighting, surfaces = light_set.seen_from(visible.eye.pose), target.surfaces
        inputs = surfaces.surface, surfaces.albedo, visible.eye.camera, lighting, materials
        marks = {"has_doubts": surfaces.has_doubts, "has_eye_dome": surfaces.has_eye_dome}
        with canvas.opened(surfaces.window) as image:
            self._steps.always("light", partial(self._light.draw, linear=canvas.linear, **marks), image, *inputs)


def _single(visible: VisibleScene, drawables: Drawables, light_set: LightSet) -> ShownPoints | ShownGrid | None:
    """Return the only object in view if it can be drawn and lit alone: points at their own scale, without spots and
    shadows.

    A mesh between the points also counts, unless it is lit as it is drawn. Eye-dome lighting needs neighbours.
    """
    one = drawables[visible.shown[0]] if len(visible.shown) == 1 else None
    if light_set.shadow_map is not None or not isinstance(one, ShownPoints | ShownGrid) or _is_lit_as_drawn(one):
        return None
    return one if one.points.scale == 1 and one.shading != "edl" else None


def _is_lit_as_drawn(thing: Drawable) -> bool:
    """Return whether the object's surfaces already hold their light, and so change with it."""
    if isinstance(thing, PlacedMesh):
        return thing.shading in LIT_EARLY
    return isinstance(thing, ShownGrid) and thing.shading == "flat"
