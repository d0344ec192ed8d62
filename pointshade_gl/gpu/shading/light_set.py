"""The lights of a picture with their shadow cameras, in the axes in which shaders read them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import moderngl
import numpy as np

from ...estimation.environment_light import turned_bands
from ...scene.light import Light, light_rows
from ...scene.shadow_cameras import ShadowView, Span
from .shadow_map import ShadowMap


class ShadowLookUp(NamedTuple):
    """The inputs with which shaders look up shadows."""

    shadow_map: ShadowMap
    views: np.ndarray  # (n, 5, 4) as shaders/common/shadow.glsl reads them, for points in the surfaces' axes
    to_world: np.ndarray  # (3, 3) from the surfaces' axes

    @property
    def kind(self) -> int:
        """Return the constant SHADOWS of shaders/common/shadow.glsl."""
        return 2 if self.views[:, 4, 3].any() else 1


class Lobes(NamedTuple):
    """An environment as highlights show it: maps for some exponents."""

    texture: moderngl.Texture  # one map above the other, see shaders/common/surroundings.glsl
    exponents: tuple[float, ...]
    intensity: float = 1.0  # factor on the maps


class AroundLookUp(NamedTuple):
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


HIGHLIGHTS = "lobe_map", "lobe_gain", "lobes", "to_sky"  # the inputs of an environment that only these need
DARK = AroundLookUp(np.zeros((9, 3)), np.eye(3), None)


class Lighting(NamedTuple):
    """The light on surfaces, in the surfaces' axes."""

    rows: np.ndarray  # (n, 5, 4) float32, see `light_rows`
    ambient: tuple[float, float, float]
    shadows: ShadowLookUp | None  # None: no light is a spot or casts a shadow
    around: AroundLookUp | None = None  # an environment, in place of the ambient light


class LightSet(NamedTuple):
    """The lights, each with a position or a direction, in world axes."""

    lights: list[Light]
    ambient: tuple[float, float, float]
    views: Sequence[ShadowView] = ()
    spans: Sequence[Span | None] | None = None  # which of the views are each light's
    shadow_map: ShadowMap | None = None  # None: the lights are plain, no spot and no shadow among them
    gain: float = 1.0  # factor on all light
    around: AroundLookUp | None = None  # an environment, in world axes

    def seen_from(self, axes: np.ndarray) -> Lighting:
        """Return the lights in the axes of a camera with this pose (4, 4)."""
        rows, shadow_map = light_rows(self.lights, axes, self.spans), self.shadow_map
        shadows = shadow_map and ShadowLookUp(shadow_map, shadow_map.rows(self.views, axes), axes[:3, :3])
        rows[:, 1, :3] *= self.gain
        red, green, blue = (self.gain * channel for channel in self.ambient)
        if self.around is None:
            return Lighting(rows, (red, green, blue), shadows)
        turn, around = axes[:3, :3], self.around
        bands = self.gain * turned_bands(around.bands, turn)
        lobes = around.lobes and around.lobes._replace(intensity=self.gain * around.lobes.intensity)
        return Lighting(rows, (0.0, 0.0, 0.0), shadows, AroundLookUp(bands, around.to_sky @ turn, lobes))


def environment_of(inputs: dict[str, Any]) -> dict[str, int]:
    """Return the constant of shaders/shading/around.glsl that inputs of lights need, if any."""
    return {"ENVIRONMENT": 2 if "lobe_map" in inputs else 1} if "first_bands" in inputs else {}


def around_inputs(lighting: Lighting) -> dict[str, Any]:
    """Return the uniforms of shaders/shading/around.glsl, if there is an environment."""
    return {} if lighting.around is None else lighting.around.inputs
