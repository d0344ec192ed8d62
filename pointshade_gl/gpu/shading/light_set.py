"""The lights of a picture as shaders read them, with their shadow map, and the light from all around."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import moderngl
import numpy as np

from ...estimation.environment_light import above_horizon, lobe_maps, radiance_bands, sh_rotation
from ...scene.environment import Environment, EnvironmentLight
from ...scene.light import Light, light_rows
from ...scene.shadow_cameras import ShadowView, Span
from ..core.images import Box, Image, Owner, check_size, confine
from ..core.steps import Steps, Versioned


class ShadowTile(NamedTuple):
    """The part of the shadow map that shows one light's view."""

    target: moderngl.Framebuffer
    first: tuple[int, int]  # column and row in the map
    side: int

    def part(self, window: Box) -> Box:
        """Return where a window of the view lies in the map."""
        return self.first[0] + window[0], self.first[1] + window[1], *window[2:]


class ShadowMap(Versioned, Owner):
    """Depth, as 1 - near/z, of every view of the lights; a single texel until there are any."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._layout = 0, 0  # pixels a side, number of views
        self._make(1, 1)

    def fit(self, views: Sequence[ShadowView]) -> bool:
        """Make room for the views, all of one size. Returns whether the map had to be made anew."""
        layout = views[0].eye.camera.width, len(views)
        is_new = layout != self._layout
        if is_new:
            columns = math.ceil(math.sqrt(len(views)))
            self._make(columns * layout[0], math.ceil(len(views) / columns) * layout[0])
            self._layout = layout
        return is_new

    def tile(self, k: int) -> ShadowTile:
        """Return the k-th view's part, emptied. Its target draws only there, until the next one is asked for."""
        side, first = self._layout[0], self.place(k)
        confine(self._target, None)
        self._target.use()
        self._target.clear(depth=1.0, viewport=(*first, side, side))
        self._target.viewport = (*first, side, side)
        confine(self._target, (*first, side, side))  # large points reach over a viewport
        self.raise_version()
        return ShadowTile(self._target, first, side)

    def rows(self, views: Sequence[ShadowView], axes: np.ndarray) -> np.ndarray:
        """Return (n, 6, 4) for shaders/common/shadow.glsl. axes: the pose of the camera in whose axes points are."""
        rows = np.zeros((max(len(views), 1), 6, 4))
        for k, (eye, contact, farther, spread) in enumerate(views):
            rows[k, :3] = (np.linalg.inv(eye.pose) @ axes)[:3]
            rows[k, 3] = (eye.camera.fx, eye.camera.cx, *self.place(k))
            rows[k, 4] = eye.near, eye.camera.width, contact, spread * eye.camera.fx
            rows[k, 5] = farther @ axes
        return rows

    def place(self, k: int) -> tuple[int, int]:
        """Return the first column and row of the k-th view's part."""
        side, count = self._layout
        columns = math.ceil(math.sqrt(count))
        return k % columns * side, k // columns * side

    def _make(self, width: int, height: int) -> None:
        check_size(self._context, width, height)
        self.release()
        self._layout = 0, 0  # stays so when the new one does not fit the GPU
        with self._all_or_nothing():
            self.texture = self._allocate(self._context.depth_texture, (width, height))
            self.texture.compare_func = ""
            self.texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self._target: Any = self._allocate(self._context.framebuffer, [], self.texture)


class SplatShadows(NamedTuple):
    """The shadows of trained splats, in tiles as those of the shadow map: see shaders/splats/shadow.frag."""

    image: Image
    thickness: float  # of a surface of them, world units


class ShadowLookUp(NamedTuple):
    """The inputs with which shaders look up shadows."""

    shadow_map: ShadowMap
    views: np.ndarray  # (n, 6, 4) as shaders/common/shadow.glsl reads them, for points in the surfaces' axes
    to_world: np.ndarray  # (3, 3) from the surfaces' axes
    splats: SplatShadows | None = None  # of trained splats, beside those of the shadow map

    @property
    def kind(self) -> int:
        """Return the constant SHADOWS of shaders/common/shadow.glsl."""
        return 2 if self.views[:, 4, 3].any() else 1


class Lobes(NamedTuple):
    """An environment as highlights show it: maps for some exponents."""

    texture: moderngl.Texture  # one map above the other, see shaders/common/surroundings.glsl
    exponents: tuple[float, ...]
    intensity: float = 1.0  # factor on the maps


class EnvironmentLookUp(NamedTuple):
    """The inputs with which shaders look up an environment."""

    bands: np.ndarray  # (9, 3), see `turned_bands`, in the surfaces' axes
    to_sky: np.ndarray  # (3, 3) from the surfaces' axes to the environment's
    lobes: Lobes | None  # None: no material has highlights

    @property
    def inputs(self) -> dict[str, Any]:
        """Return the uniforms of shaders/shading/around.glsl."""
        parts = self.bands.astype("f4").reshape(3, 3, 3)
        names = "first_bands", "second_bands", "third_bands"
        inputs: dict[str, Any] = {name: part.tobytes() for name, part in zip(names, parts, strict=True)}
        if self.lobes is not None:
            inputs |= {"lobe_map": self.lobes.texture, "lobes": float(len(self.lobes.exponents))}
            inputs["lobe_gain"] = self.lobes.intensity
            inputs["to_sky"] = self.to_sky.T.astype("f4").tobytes()
        return inputs


SPLAT_SHADOWS = "splat_map", "splat_thickness"  # the inputs of shadows of trained splats
HIGHLIGHTS = "lobe_map", "lobe_gain", "lobes", "to_sky"  # the inputs of an environment that only these need
DARK = EnvironmentLookUp(np.zeros((9, 3)), np.eye(3), None)


class Lighting(NamedTuple):
    """The light on surfaces, in the surfaces' axes."""

    rows: np.ndarray  # (n, 5, 4) float32, see `light_rows`
    ambient: tuple[float, float, float]
    shadows: ShadowLookUp | None  # None: no light is a spot or casts a shadow
    environment: EnvironmentLookUp | None = None  # an environment, in place of the ambient light


class LightSet(NamedTuple):
    """The lights, each with a position or a direction, in world axes."""

    lights: list[Light]
    ambient: tuple[float, float, float]
    views: Sequence[ShadowView] = ()
    spans: Sequence[Span | None] | None = None  # which of the views are each light's
    shadow_map: ShadowMap | None = None  # None: the lights are plain, no spot and no shadow among them
    gain: float = 1.0  # factor on all light
    environment: EnvironmentLookUp | None = None  # an environment, in world axes
    splat_shadows: SplatShadows | None = None  # those of trained splats: see shaders/splats/shadow.frag

    def seen_from(self, axes: np.ndarray) -> Lighting:
        """Return the lights in the axes of a camera with this pose (4, 4)."""
        rows, shadow_map, gain = light_rows(self.lights, axes, self.spans), self.shadow_map, self.gain
        seen_by = axes[:3, :3], self.splat_shadows
        shadows = shadow_map and ShadowLookUp(shadow_map, shadow_map.rows(self.views, axes), *seen_by)
        rows[:, 1, :3] *= gain
        if self.environment is None:
            red, green, blue = self.ambient
            return Lighting(rows, (gain * red, gain * green, gain * blue), shadows)
        turn, environment = axes[:3, :3], self.environment
        bands = self.gain * sh_rotation(environment.bands, turn)
        lobes = environment.lobes and environment.lobes._replace(intensity=self.gain * environment.lobes.intensity)
        return Lighting(rows, (0.0, 0.0, 0.0), shadows, EnvironmentLookUp(bands, environment.to_sky @ turn, lobes))


def environment_of(inputs: dict[str, Any]) -> dict[str, int]:
    """Return the constant of shaders/shading/around.glsl that inputs of lights need, if any."""
    return {"ENVIRONMENT": 2 if "lobe_map" in inputs else 1} if "first_bands" in inputs else {}


def environment_inputs(lighting: Lighting) -> dict[str, Any]:
    """Return the uniforms of shaders/shading/around.glsl, if there is an environment."""
    return {} if lighting.environment is None else lighting.environment.inputs


class EnvironmentMaps(Owner):
    """Keeps what was made of the last environment."""

    def __init__(self, context: moderngl.Context, steps: Steps):
        super().__init__(context)
        self._steps = steps
        self._texture: moderngl.Texture | None = None

    def find(self, light: EnvironmentLight, exponents: Sequence[float]) -> EnvironmentLookUp | None:
        """Return what shaders look up, in world axes; None without an environment.

        exponents  of the highlights in a picture
        """
        if light.environment is None:
            return None
        to_sky, wanted = np.array(light.to_sky), tuple(exponents)
        up = None if light.floor_in_sky is None else tuple(light.floor_in_sky.tolist())
        bands = self._steps.run("environment", _bands, light.environment, up)
        lobes = self._steps.run("lobes", self._fill, light.environment, up, wanted) if wanted else None
        if lobes is not None and light.intensity != 1:
            lobes = lobes._replace(intensity=light.intensity)
        return EnvironmentLookUp(light.intensity * sh_rotation(bands, to_sky), to_sky, lobes)

    def _fill(self, environment: Environment, up: tuple[float, ...] | None, exponents: tuple[float, ...]) -> Lobes:
        picture = environment.picture if up is None else above_horizon(environment.picture, np.array(up))
        maps = lobe_maps(picture, exponents)
        texels = np.concatenate([maps, np.ones_like(maps[..., :1])], -1)
        if self._texture is None or self._texture.size != texels.shape[1::-1]:
            self.release()
            self._texture = self._allocate(self._context.texture, texels.shape[1::-1], 4, dtype="f4")
            self._texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
            self._texture.repeat_x, self._texture.repeat_y = True, False
        self._texture.write(np.ascontiguousarray(texels))
        return Lobes(self._texture, exponents)

    def release(self) -> None:
        self._texture = None
        super().release()


def _bands(environment: Environment, up: tuple[float, ...] | None) -> np.ndarray:
    return radiance_bands(environment.picture, None if up is None else np.array(up))
