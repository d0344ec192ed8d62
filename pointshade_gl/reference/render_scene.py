"""A point object under lights with shadows, on the CPU: the passes of scene_renderer.py in their order."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..camera import Camera, view_matrix
from ..culling import MERGE
from ..frame import Frame
from ..light import Light, at_upper_left, light_rows
from ..look import Material
from ..scene import Node, Placed, PointObject, bounding_sphere
from ..shadow_views import ShadowView, shadow_views
from .camera import pixel_ray
from .color import linear_to_srgb
from .rasterizers import DEPTH_STEPS, covered_pairs, merged_splats, nearest
from .resolve_pass import seen_by_depth, surface_map_of, surfaces
from .scene_light import scene_light

F = np.float32


def render_scene(
    frame: Frame,
    normals: np.ndarray,
    lights: Sequence[Light],
    material: Material,
    camera: Camera,
    pose: np.ndarray,
    near: float,
    side: int,
) -> np.ndarray:
    """What Renderer.render gives of a scene with this frame only, phong, by the compute rasteriser; (h, w, 4) uint8.

    normals (h, w, 3) with 0 where missing; side of a shadow view in pixels.
    """
    view, source, depth = view_matrix(frame.pose, pose).astype(F), frame.camera, frame.depth
    picture = (np.full((1, 1, 3), 204, np.uint8) if frame.color is None else frame.color).astype(F) / F(255)
    splats = merged_splats(depth, normals, source, MERGE)
    inverse_depth = nearest(covered_pairs(splats, source, camera, view, near, False), camera)
    target_pixel, seen = seen_by_depth(inverse_depth, surface_map_of(normals, depth), source, camera, view)
    surface, albedo = surfaces(seen, picture, source, view)
    place = Placed(PointObject(frame), np.eye(4), Node(), ())
    casting = [light for light in lights if light.shadow]
    several = [shadow_views(light, *bounding_sphere([place]), side) for light in casting]
    firsts = np.cumsum([0, *map(len, several)])
    first_of = [int(firsts[casting.index(light)]) if light.shadow else None for light in lights]
    views = [one for group in several for one in group]
    shadow_map = draw_views(frame, normals, views, side)
    rows, table = light_rows([at_upper_left(x, pose) for x in lights], pose, first_of), view_rows(views, pose, side)
    strengths, pixel = np.array(material.strengths, F), target_pixel.astype(F)
    point = pixel_ray(pixel, np.array(camera.intrinsics, F)) * surface[:, 3:]
    lit = scene_light(
        point, np.zeros(3, F), surface[:, :3], albedo, strengths, np.ones(3, F), rows, len(lights),
        shadow_map, table, pose[:3, :3].astype(F),
    )  # fmt: skip
    image = np.zeros((camera.height, camera.width, 4), np.uint8)
    u, v = target_pixel.T
    image[v, u] = np.concatenate([np.round(linear_to_srgb(lit) * 255), np.full((len(u), 1), 255)], -1)
    return image


def draw_views(frame: Frame, normals: np.ndarray, views: Sequence[ShadowView], side: int) -> np.ndarray:
    """The shadow map: 1 - near/z, the views as tiles."""
    columns = math.ceil(math.sqrt(max(len(views), 1)))
    result = np.ones((max(math.ceil(len(views) / columns), 1) * side, columns * side), F)
    splats = merged_splats(frame.depth, normals, frame.camera, MERGE)
    for k, one in enumerate(views):
        matrix = view_matrix(frame.pose, one.pose).astype(F)
        inverse_depth = nearest(covered_pairs(splats, frame.camera, one.camera, matrix, one.near, False), one.camera)
        window = np.round((F(1) - F(one.near) * inverse_depth).astype(float) * DEPTH_STEPS) / DEPTH_STEPS
        left, top = k % columns * side, k // columns * side
        result[top : top + side, left : left + side] = window
    return result


def view_rows(views: Sequence[ShadowView], axes: np.ndarray, side: int) -> np.ndarray:
    """(n, 5, 4) as shaders/common/shadow.glsl reads them, for points in the axes of a camera with this pose."""
    columns = math.ceil(math.sqrt(max(len(views), 1)))
    rows = np.zeros((max(len(views), 1), 5, 4))
    for k, one in enumerate(views):
        rows[k, :3] = (np.linalg.inv(one.pose) @ axes)[:3]
        rows[k, 3] = one.camera.fx, one.camera.cx, k % columns * side, k // columns * side
        rows[k, 4, :3] = one.near, side, one.contact
    return rows.astype(F)
