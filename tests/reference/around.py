"""The light from all around on the CPU: visibility.py and environment_maps.py of the package, and around.glsl."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pointshade_gl.estimation.environment_light import above_horizon, lobe_map, radiance_bands, sh_rotation
from pointshade_gl.scene.environment import EnvironmentLight

from .surroundings import (
    OPEN,
    environment_light,
    highlight_strength,
    highlight_visibility,
    pack_visibility,
    texture_of_lobes,
)
from .vectors import dot
from .visibility import look_along, mean_hidden, sum_of_sectors, visibility_at, weight_of_plane

F = np.float32


class Around(NamedTuple):
    """An environment in the axes of a camera."""

    bands: np.ndarray  # (9, 3)
    to_sky: np.ndarray  # (3, 3)
    lobes: np.ndarray  # (h, w, 4) of one exponent


def visibility_map(surface_map: np.ndarray, intrinsics: np.ndarray, radius: float, stride: int) -> np.ndarray:
    """Return (h, w, 4) in steps of 8 bits, 0 to 1: what the points of a frame see."""
    height, width = surface_map.shape[:2]
    pixel = np.stack(np.meshgrid(np.arange(-(-width // stride)), np.arange(-(-height // stride))), -1)
    texel = np.minimum(pixel * stride, (width - 1, height - 1))
    own = surface_map[texel[..., 1], texel[..., 0]]
    plane = look_along(surface_map, pixel, texel, own, intrinsics, radius, 0)
    sums, weights = sum_of_sectors(plane, plane.hidden), weight_of_plane(plane)[..., None]
    sums = mean_hidden(sums, weights, True, surface_map, pixel, -2, stride, intrinsics)
    sums = mean_hidden(sums, sums, False, surface_map, pixel, -1, stride, intrinsics)
    whole = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1)
    found = pack_visibility(visibility_at(sums, surface_map, whole, stride, intrinsics))
    return (np.round(np.clip(found, 0, 1) * 255) / 255).astype(F)


def around_of(surroundings: EnvironmentLight, exponent: float, axes: np.ndarray) -> Around | None:
    """Return the environment in the axes of a camera with this pose (4, 4)."""
    if surroundings.environment is None:
        return None
    turn, floor, picture = np.array(surroundings.to_sky), surroundings.floor, surroundings.environment.picture
    up = None if floor is None else turn @ floor
    bands = sh_rotation(radiance_bands(picture, up), turn @ axes[:3, :3])
    lobes = lobe_map(picture if up is None else above_horizon(picture, up), exponent)
    lobes = np.concatenate([lobes, np.ones_like(lobes[..., :1])], -1)
    gain = surroundings.intensity
    return Around((gain * bands).astype(F), (turn @ axes[:3, :3]).astype(F), gain * lobes)


def light_from_around(
    around: Around,
    visibility: np.ndarray | None,
    v: np.ndarray,
    n: np.ndarray,
    albedo: np.ndarray,
    material: np.ndarray,
) -> np.ndarray:
    """Return what surfaces (n) send back; visibility None is all of it."""
    if visibility is None:
        visibility = np.concatenate([OPEN * n, np.ones_like(n[:, :1])], -1)
    light = material[..., 1:2] * albedo * environment_light(visibility, *around.bands.reshape(3, 3, 3))
    if not np.any(material[..., 2] > 0):
        return light
    mirrored = F(2) * dot(n, v) * n - v
    strength = highlight_strength(material) * highlight_visibility(visibility, mirrored, material[..., 3])
    return light + np.reshape(strength, (-1, 1)) * texture_of_lobes(around.lobes, mirrored @ around.to_sky.T, 0, 1)
