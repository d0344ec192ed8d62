"""Finished pictures on the CPU: samples averaged, over a background and a ground, as in pipeline/accumulation.py."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pointshade_gl.estimation.ground import seen_ground
from pointshade_gl.gpu.shading.occlusion import plane_shift, plane_turn
from pointshade_gl.scene.camera import Eye
from pointshade_gl.scene.environment import NO_ENVIRONMENT, EnvironmentLight
from pointshade_gl.scene.sample_pattern import at_sample
from pointshade_gl.scene.settings import OutputSettings
from pointshade_gl.scene.visible import VisibleScene

from .around import around_of
from .camera import pixel_ray
from .ground import ground_depth, shadow_alpha
from .sample_mean import developed, smooth_ground
from .surroundings import OPEN, environment_light
from .tone import neutral_tone
from .visibility import seen_from_plane

F = np.float32


def finished(
    draw: Callable[[VisibleScene], tuple[np.ndarray, np.ndarray]], shot: VisibleScene, finish: OutputSettings
) -> np.ndarray:
    """(h, w, 4) uint8. draw(shot) gives (h, w, 4) float32, linear light and 1 where something is seen, and (h, w, 2),
    the alphas of the ground elsewhere."""
    samples = [draw(at_sample(shot, k)) for k in range(finish.samples)]
    surfaces, ground = (np.asarray(sum(sums), F) for sums in zip(*samples, strict=True))
    if finish.tone == "neutral":
        coverage = surfaces[..., 3:]
        surfaces[..., :3] = coverage * neutral_tone(surfaces[..., :3] / np.maximum(coverage, F(1e-6)))
    pixel = np.stack(np.meshgrid(*map(np.arange, ground.shape[1::-1])), -1)
    ground = smooth_ground(ground, surfaces, pixel, finish.samples)
    background = np.array((0,) * 4 if finish.background is None else (*finish.background, 1), F)
    return np.round(developed(surfaces, ground, finish.samples, background) * 255).astype(np.uint8)


def draw_ground(
    image: np.ndarray,
    ground: np.ndarray,
    eye: Eye,
    material: np.ndarray,
    rows: np.ndarray,
    shadow_map: np.ndarray,
    views: np.ndarray,
    surroundings: EnvironmentLight = NO_ENVIRONMENT,
    surface_map: np.ndarray | None = None,
    sample: int = 0,
    distance: float = 1.0,
) -> np.ndarray:
    """(h, w, 2) alphas of the shadows on the ground (4,) where nothing is seen in an image; rows (n, 5, 4) as
    `light_rows` makes them. surface_map (h, w, 4): what is seen, which hides light from all around in this sample."""
    v, u = np.nonzero(image[..., 3] == 0)
    ray = pixel_ray(np.stack([u, v], -1).astype(F), np.array(eye.camera.intrinsics, F))
    plane = np.array(seen_ground(ground, eye.pose), F)
    depth = ground_depth(ray, plane)
    met = depth > 0
    point, n = (ray * depth[:, None])[met], np.broadcast_to(plane[:3], (met.sum(), 3))
    to_world = eye.pose[:3, :3].astype(F)
    alpha = np.zeros((*image.shape[:2], 2), F)
    whole = np.concatenate([OPEN * n, np.ones_like(n[:, :1])], -1)
    seen = whole
    if surroundings.occlusion:
        assert surface_map is not None
        texel, own = np.stack([u, v], -1)[met], np.concatenate([n, depth[met, None]], -1).astype(F)
        pixel, intrinsics = texel + np.array(plane_shift(sample)), np.array(eye.camera.intrinsics, F)
        seen = seen_from_plane(
            surface_map, pixel, texel, own, intrinsics, surroundings.radius(distance), plane_turn(sample)
        )
    around = around_of(surroundings, 1.0, eye.pose)
    if around is None:
        light = material[0] * np.ones(3, F), material[0] * seen[:, 3:] * np.ones(3, F)
    else:
        bands = around.bands.reshape(3, 3, 3)
        light = tuple(material[1] * environment_light(one, *bands) for one in (whole, seen))
    alpha[v[met], u[met]] = shadow_alpha(point, n, material, *light, rows, len(rows), shadow_map, views, to_world)
    return alpha
