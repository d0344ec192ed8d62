"""The lights of a picture: what is around its objects, shadow maps, points that are lit before they are drawn."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import cast

import moderngl
import numpy as np

from ..estimation.environment_light import exponents_of
from ..gpu.clouds.splat_layer import PlacedSplats
from ..gpu.core.images import Owner, empty
from ..gpu.core.steps import Steps
from ..gpu.drawables import Drawables, Objects, Shape
from ..gpu.meshes.mesh_objects import ShownGrid, joined
from ..gpu.points.point_objects import ShownPoints, ShownSet
from ..gpu.points.tiles import TiledPoints
from ..gpu.shading.light_pass import LightPass
from ..gpu.shading.light_set import EnvironmentMaps, LightSet, ShadowMap
from ..scene.appearance import LIT_EARLY, Material, Strengths, strengths_in
from ..scene.camera import Eye, view_matrix
from ..scene.environment import FAR_AS_SEEN, Environment, EnvironmentLight, Row
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.light import Light, unit
from ..scene.sample_pattern import light_part
from ..scene.settings import OutputSettings
from ..scene.shadow_cameras import SMOOTH, Roughness, ShadowView, shadow_views
from ..scene.visible import VisibleScene

AGREED_GRAIN = 0.4  # at 1, creases of 2 pixels stay lit; at .2, surfaces are specked


class LightSetup(Owner):
    """Draws shadow maps and lights points, before the view is drawn."""

    def __init__(self, context: moderngl.Context, steps: Steps, objects: Objects, light: LightPass):
        super().__init__(context)
        self._steps, self._objects, self._light = steps, objects, light
        self._environments = self._keep(EnvironmentMaps(context, steps))

    @cached_property
    def _shadow_map(self) -> ShadowMap:
        return self._keep(ShadowMap(self._context))

    def prepare(self, visible: VisibleScene, drawables: Drawables) -> LightSet:
        """Return the lights, with the shadow map of those that cast shadows.

        Spots, area lights, corners of meshes and a ground need a map even without shadows: only shaders that look it up
        know them.
        """
        lights, light = visible.lights, visible.environment_light
        environment = None
        if light.environment is not None:
            environment = self._environments.find(light, exponents_of(visible.materials))
        needs_map = bool(light.on_ground and light.occlusion)
        for one in lights:
            needs_map = needs_map or one.shadow or one.is_spot or one.is_area
        for p in visible.shown:
            needs_map = needs_map or (p.content.shading in LIT_EARLY and not p.content.frames)
        ambient, gain = _filled(visible)
        if not needs_map:
            return LightSet(lights, ambient, gain=gain, environment=environment)
        extent = visible.scene.extent
        extent = extent._replace(grain=extent.grain * grain_share(drawables))
        part, roughness = light_part(visible.sample), roughness_of(drawables)
        views, spans = shadow_views(lights, extent, part, roughness, visible.coarse)
        splat_shadows = None
        if views:
            drawn = [thing for _, thing in joined(drawables[p] for p in visible.shadow_casters)]
            trained = tuple(thing for thing in drawn if isinstance(thing, PlacedSplats))
            shapes = tuple(thing.shape for thing in drawn if not isinstance(thing, PlacedSplats))
            self._steps.run("shadows", self._fill_shadow_map, self._shadow_map, views, shapes)
            if trained:
                find = self._objects.splats.find_shadows
                splat_shadows = self._steps.run("splat shadows", find, self._shadow_map, views, trained)
        return LightSet(lights, ambient, views, spans, self._shadow_map, gain, environment, splat_shadows)

    def _fill_shadow_map(self, shadow_map: ShadowMap, views: list[ShadowView], shapes: tuple[Shape, ...]) -> None:
        if shadow_map.fit(views):
            self._steps.forget("tile")
        for k, view in enumerate(views):
            if self._steps.is_new("tile", view, shapes, of=k):
                tile = shadow_map.tile(k)
                for shape in shapes:
                    self._objects.add_shadow(tile, shape, view.eye)

    def light_points(self, visible: VisibleScene, drawables: Drawables, light_set: LightSet) -> None:
        """Light the points themselves, in their object's axes, where shading interpolates light between them."""
        for p in visible.shown:
            thing, strengths = drawables[p], strengths_in(p.content.material, visible.fill)
            if isinstance(thing, TiledPoints):
                if thing.shading in LIT_EARLY:
                    some = partial(self._light_some, strengths=strengths, eye=visible.eye, light_set=light_set)
                    thing.light_with(lambda part, some=some: self._steps.always("light", some, part))
                continue
            for view in thing.views:
                if view.light:
                    self._steps.always("light", self._light_some, view, strengths, visible.eye, light_set)

    def _light_some(self, thing: ShownPoints | ShownGrid, strengths: Strengths, eye: Eye, light_set: LightSet) -> None:
        points, light = thing.points, thing.light
        assert light is not None
        viewer = view_matrix(eye.pose, points.pose)[:3, 3]
        empty(light.target, points.surface.window)  # beside the points values are weighted by 0, but must be defined
        self._light.draw(
            light.target, points.surface.texture, thing.colors.texture, points.source, light_set.seen_from(points.pose),
            np.array([strengths]), (viewer, points.scale), certainty=points.surface.certainty,
            visibility=thing.visibility and thing.visibility.texture,
        )  # fmt: skip
        light.raise_version()


def grain_share(drawables: Drawables) -> float:
    """Return which part of a frame's pixel is the grain of the points: less than 1 where frames agree without noise."""
    sets = [isinstance(thing, ShownSet) and thing.points.is_exact for p, thing in drawables.items() if p.content.frames]
    return AGREED_GRAIN if sets and all(sets) else 1.0


def roughness_of(drawables: Drawables) -> Roughness:
    """Return the noise of depth of the roughest frame. It grows with the square of depth, as of all who triangulate."""
    roughest = SMOOTH
    for p, thing in drawables.items():
        for choice in thing.choices if p.content.frames else ():
            noise = choice.noise
            if noise is not None and not noise.is_clean:
                (axes, factor), z = p.rigid_axes, p.content.scale
                plane = np.linalg.inv(axes)[2] / (factor * z)
                found = factor * math.hypot(noise.relative * z, noise.bumps * z * z)
                roughest = max(roughest, Roughness(found, tuple(plane.tolist())))
    return roughest


def _filled(visible: VisibleScene) -> tuple[tuple[float, float, float], float]:
    """Return ambient light and gain with the fill: the rest of the light, and the fill through the material's ambient
    strength."""
    red, green, blue = visible.scene.ambient
    if not visible.fill:
        return (red, green, blue), visible.gain
    rest = max(1.0 - visible.fill, 1e-6)
    more = visible.fill / (rest * visible.materials[0].ambient)
    return (red + more, green + more, blue + more), visible.gain * rest


AS_IN_GLTF = np.diag([1.0, -1, -1, 1])  # pose of who looks along -z: a scene's own environment has the world's axes
Upright = Callable[[Frame | Scene], tuple[np.ndarray, bool]]
MIN_AMBIENT_SHARE = 0.1  # of the light, above which it is worth looking at what hides it


def environment_light_of(
    finish: OutputSettings, source: Frame | Scene, scene: Scene, lights: Sequence[Light], materials: Sequence[Material],
    upright: Upright,
) -> EnvironmentLight:  # fmt: skip
    """Return what is around a scene.

    source   of which the scene was made, which tells where up is
    upright  finds where, as `up_and_floor` does
    """
    environment = cast("Environment | None", finish.environment) or scene.environment
    wanted = finish.ambient_occlusion
    if wanted is None:
        wanted = environment is not None or _is_mostly_ambient(scene, lights, materials)
    occlusion = FAR_AS_SEEN if wanted is True else float(wanted)
    on_ground = finish.ground is not False
    if environment is None:
        return EnvironmentLight(occlusion, on_ground=on_ground)
    if finish.up is not None:
        up, has_floor = np.array(finish.up), True
    else:
        up, has_floor = upright(source)
    floor = _row(up) if has_floor or on_ground else None
    rotation = cast("float | tuple[Row, Row, Row]", finish.environment_rotation)
    facing = AS_IN_GLTF if environment is scene.environment else np.asarray(scene.pose)
    to_sky = rotation if isinstance(rotation, tuple) else standing(up, rotation, facing)
    return EnvironmentLight(occlusion, environment, finish.environment_intensity, to_sky, floor, on_ground)


def standing(up: np.ndarray, degrees: float, pose: np.ndarray) -> tuple[Row, Row, Row]:
    """Return the rotation (3, 3) from world axes to those of an environment that stands upright.

    up       (3,) unit, world
    degrees  by which it is turned about up, counterclockwise seen from above
    pose     (4, 4) of the scene's own camera, which looks along -z of an environment that is not turned
    """
    back = -pose[:3, 2] + up * (pose[:3, 2] @ up)
    if np.linalg.norm(back) < 1e-6:
        back = pose[:3, 1] - up * (pose[:3, 1] @ up)
    z = unit(back)
    x = np.cross(up, z)
    sine, cosine = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    return _row(cosine * x - sine * z), _row(up), _row(sine * x + cosine * z)


def _is_mostly_ambient(scene: Scene, lights: Sequence[Light], materials: Sequence[Material]) -> bool:
    """Return whether ambient light is more than MIN_AMBIENT_SHARE of what reaches the eye from some material."""
    brightest, arriving = max(scene.ambient), 0.0
    for light in lights:
        arriving += _arriving(light, scene)
    for material in materials:
        ambient, direct = material.ambient * brightest, material.diffuse * arriving
        if ambient > MIN_AMBIENT_SHARE * (ambient + direct) * (1 + 1e-6):
            return True
    return False


def _arriving(light: Light, scene: Scene) -> float:
    """Return how much of a light arrives in the middle of a scene."""
    strength = light.intensity * max(light.color)
    if light.position is None:
        return strength
    constant, linear, quadratic = light.attenuation
    if linear == quadratic == 0:  # the middle of a new frame is not found for nothing
        return strength / max(constant, 1e-9)
    distance = float(np.linalg.norm(scene.bounds[0] - light.position))
    return strength / max(constant + linear * distance + quadratic * distance * distance, 1e-9)


def _row(vector: np.ndarray) -> Row:
    x, y, z = np.asarray(vector, np.float64).tolist()
    return x, y, z
