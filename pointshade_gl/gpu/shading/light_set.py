"""The lights of a picture with their shadow cameras, in the axes in which shaders read them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...scene.light import Light, light_rows
from ...scene.shadow_cameras import ShadowView, Span
from .shadow_map import ShadowMap


class ShadowLookUp(NamedTuple):
    """The inputs with which shaders look up shadows."""

    shadow_map: ShadowMap
    views: np.ndarray  # (n, 5, 4) as shaders/common/shadow.glsl reads them, for points in the surfaces' axes
    to_world: np.ndarray  # (3, 3) from the surfaces' axes


class Lighting(NamedTuple):
    """The light on surfaces, in the surfaces' axes."""

    rows: np.ndarray  # (n, 5, 4) float32, see `light_rows`
    ambient: tuple[float, float, float]
    shadows: ShadowLookUp | None  # None: no light is a spot or casts a shadow


class LightSet(NamedTuple):
    """The lights, each with a position or a direction, in world axes."""

    lights: list[Light]
    ambient: tuple[float, float, float]
    views: Sequence[ShadowView] = ()
    spans: Sequence[Span | None] | None = None  # which of the views are each light's
    shadow_map: ShadowMap | None = None  # None: the lights are plain, no spot and no shadow among them
    gain: float = 1.0  # factor on all light

    def seen_from(self, axes: np.ndarray) -> Lighting:
        """Return the lights in the axes of a camera with this pose (4, 4)."""
        rows, shadow_map = light_rows(self.lights, axes, self.spans), self.shadow_map
        shadows = shadow_map and ShadowLookUp(shadow_map, shadow_map.rows(self.views, axes), axes[:3, :3])
        rows[:, 1, :3] *= self.gain
        red, green, blue = (self.gain * channel for channel in self.ambient)
        return Lighting(rows, (red, green, blue), shadows)
