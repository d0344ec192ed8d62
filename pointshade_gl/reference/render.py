"""Whole pictures on the CPU: the passes of renderer.py in their order, and what light.frag does."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..camera import Camera, view_matrix
from ..culling import MERGE
from ..frame import Frame
from ..light import Light, at_upper_left, light_rows
from ..look import Material
from .camera import pixel_ray
from .color import linear_to_srgb, srgb_to_linear
from .lights import light_surface
from .picture import picture_at
from .rasterizers import covered_pairs, merged_splats, nearest, single_splats, source_ids
from .resolve import mix_light, seen_weights, stored
from .resolve_pass import seen_by_depth, seen_by_id, surface_map_of, surfaces
from .vectors import texel

F = np.float32


def render(
    frame: Frame,
    normals: np.ndarray,
    lights: Sequence[Light],
    material: Material,
    camera: Camera,
    pose: np.ndarray,
    near: float,
    shading: str = "phong",
    size: np.ndarray | float = 1.0,
    is_round: bool = False,
    rasterizer: str = "points",
    merge: float = MERGE,
) -> np.ndarray:
    """What Renderer.render gives, (h, w, 4) uint8; normals (h, w, 3) with 0 where missing."""
    view, source, depth = view_matrix(frame.pose, pose).astype(F), frame.camera, frame.depth
    picture = (np.full((1, 1, 3), 204, np.uint8) if frame.color is None else frame.color).astype(F) / F(255)
    surface_map = surface_map_of(normals, depth)
    if rasterizer == "points":
        splats = single_splats(depth, normals, np.asarray(size, F).ravel())
        ids = source_ids(covered_pairs(splats, source, camera, view, near, is_round), near, camera)
        target_pixel, seen = seen_by_id(ids, surface_map, source, camera, view)
    else:
        splats = merged_splats(depth, normals, source, merge)
        inverse_depth = nearest(covered_pairs(splats, source, camera, view, near, False), camera)
        target_pixel, seen = seen_by_depth(inverse_depth, surface_map, source, camera, view)
    image = np.zeros((camera.height, camera.width, 4), np.uint8)
    u, v = target_pixel.T
    image[v, u, 3] = 255
    if shading == "none":
        colors = picture_at(picture, seen.pixel.astype(F), np.array(depth.shape[::-1], F))
        image[v, u, :3] = np.round(colors * 255)
        return image
    if shading == "phong":
        surface, albedo = surfaces(seen, picture, source, view)
        rows, pixel = light_rows([at_upper_left(x, pose) for x in lights], pose), target_pixel.astype(F)
        lit = light(pixel, surface, albedo, camera, np.zeros(3, F), rows, material)
    else:
        rows, eye = (
            light_rows([at_upper_left(x, pose) for x in lights], frame.pose),
            np.linalg.inv(view_matrix(frame.pose, pose))[:3, 3],
        )
        points = light_points(depth, normals, picture, source, eye.astype(F), rows, material)
        weight = seen_weights(seen, np.array(source.intrinsics, F))
        lit = texel(points, seen.pixel) if shading == "flat" else mix_light(seen, weight, points)
    image[v, u, :3] = np.round(linear_to_srgb(lit) * 255)
    return image


def light(
    pixel: np.ndarray,
    surface: np.ndarray,
    albedo: np.ndarray,
    camera: Camera,
    eye: np.ndarray,
    lights: np.ndarray,
    material: Material,
) -> np.ndarray:
    """Linear light (n, 3) of surfaces (n, 4), unit normal and depth, that these pixels (n, 2) of the camera show."""
    strengths = np.array([material.ambient, material.diffuse, material.specular, material.shininess], F)
    point = pixel_ray(pixel, np.array(camera.intrinsics, F)) * surface[:, 3:]
    return light_surface(point, eye, surface[:, :3], albedo, strengths, np.ones(3, F), lights, len(lights))


def light_points(
    depth: np.ndarray,
    normals: np.ndarray,
    picture: np.ndarray,
    camera: Camera,
    eye: np.ndarray,
    lights: np.ndarray,
    material: Material,
) -> np.ndarray:
    """Linear light (h, w, 3) of every point of a frame."""
    v, u = np.nonzero(depth)
    pixel = np.stack([u, v], -1).astype(F)
    surface = np.concatenate([normals[v, u], depth[v, u, None]], -1)
    albedo = srgb_to_linear(picture_at(picture, pixel, np.array(depth.shape[::-1], F)))
    result = np.zeros((*depth.shape, 3), F)
    result[v, u] = stored(light(pixel, surface, albedo, camera, eye, lights, material))
    return result
