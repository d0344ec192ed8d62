"""Whole pictures of one point object on the CPU: the passes of pipeline.py in their order, and light.frag."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..camera import Camera, Eye, view_matrix
from ..frame import Frame
from ..level_of_detail import MERGE
from ..light import Light, at_upper_left, light_rows
from ..look import Look
from ..scene import Node, PointObject, Scene
from ..shadow_views import ShadowView, Span, shadow_views
from .camera import pixel_ray
from .color import linear_to_srgb, srgb_to_linear
from .inverse_depth import pixel_grid
from .lights import light_surface
from .picture import picture_at
from .rasterizers import (
    Pairs,
    covered_pairs,
    drawn_pairs,
    merged_splats,
    nearest,
    point_depths,
    single_splats,
    source_ids,
)
from .resolve import mix_light, seen_weights, stored
from .resolve_pass import seen_by_depth, seen_by_id, surface_map_of, surfaces
from .rim_marks import mark_rim
from .shadowed_lights import light_surface_shadowed
from .vectors import texel

F = np.float32


class Lamps(NamedTuple):
    """The lights with their shadow map; without views if no light casts shadows."""

    lights: Sequence[Light]  # each with a position or a direction
    spans: Sequence[Span | None]  # of each one's views
    views: Sequence[ShadowView]
    shadow_map: np.ndarray | None


class Splatted(NamedTuple):
    """A frame, and how its points become splats."""

    frame: Frame
    surface_map: np.ndarray
    look: Look
    rasterizer: str
    merge: float


def render(
    frame: Frame,
    normals: np.ndarray,
    lights: Sequence[Light],
    look: Look,
    eye: Eye,
    rasterizer: str = "points",
    merge: float = MERGE,
) -> np.ndarray:
    """The result of Renderer.render, (h, w, 4) uint8; normals (h, w, 3) with 0 where missing."""
    source, depth, camera = frame.camera, frame.depth, eye.camera
    view = view_matrix(frame.pose, eye.pose).astype(F)
    picture = (np.full((1, 1, 3), 204, np.uint8) if frame.color is None else frame.color).astype(F) / F(255)
    surface_map = surface_map_of(normals, mark_rim(depth, pixel_grid(depth), source.intrinsics))
    points = Splatted(frame, surface_map, look, rasterizer, merge)
    pairs = carried_pairs(points, eye)
    if rasterizer == "points":
        target_pixel, seen = seen_by_id(*source_ids(pairs, eye.near, camera), surface_map, source, camera, view)
    else:
        target_pixel, seen = seen_by_depth(nearest(pairs, camera), surface_map, source, camera, view)
    image = np.zeros((camera.height, camera.width, 4), np.uint8)
    u, v = target_pixel.T
    image[v, u, 3] = 255
    if look.shading == "none":
        colors = picture_at(picture, seen.pixel.astype(F), np.array(depth.shape[::-1], F))
        image[v, u, :3] = np.round(colors * 255)
        return image
    lamps = hung_up([at_upper_left(light, eye.pose) for light in lights], points)
    if look.shading == "phong":
        surface, albedo = surfaces(seen, picture, source, view)
        lit = light(target_pixel.astype(F), surface, albedo, camera, np.zeros(3, F), lamps, eye.pose, look)
    else:
        viewer = (np.linalg.inv(frame.pose) @ eye.pose)[:3, 3].astype(F)
        light_map = light_points(frame, normals, picture, viewer, lamps, look)
        if look.shading == "flat":
            lit = texel(light_map, seen.pixel)
        else:
            lit = mix_light(seen, seen_weights(seen, np.array(source.intrinsics, F)), light_map)
    image[v, u, :3] = np.round(linear_to_srgb(lit) * 255)
    return image


def carried_pairs(points: Splatted, eye: Eye) -> Pairs:
    """What the splats cover in a view: of every pixel by itself, or for the compute rasteriser of blocks on a plane."""
    frame, surface_map, look, rasterizer, merge = points
    depth, normals = surface_map[..., 3], surface_map[..., :3]
    view = view_matrix(frame.pose, eye.pose).astype(F)
    if rasterizer == "points":
        size = np.asarray(1.0 if look.size is None else look.size, F).ravel()
        splats = single_splats(depth, normals, size)
    else:
        splats = merged_splats(depth, normals, frame.camera, merge, view)
    if has_rims(points):
        return drawn_pairs(splats, surface_map, frame.camera, eye.camera, view, eye.near)
    return covered_pairs(splats, frame.camera, eye.camera, view, eye.near, look.splat == "round")


def has_rims(points: Splatted) -> bool:
    """Footprints of size 1 have rims."""
    size = 1 if points.look.size is None else points.look.size
    return points.look.splat == "footprint" and bool((np.asarray(size) == 1).all())


def hung_up(lights: Sequence[Light], points: Splatted) -> Lamps:
    """The lights with what those that cast shadows see of the frame, which is all of the scene."""
    if not any(one.shadow or one.is_spot for one in lights):
        return Lamps(lights, [None] * len(lights), [], None)
    views, spans = shadow_views(lights, *Scene((Node(PointObject(points.frame)),)).bounds)
    return Lamps(lights, spans, views, draw_views(points, views))


def draw_views(points: Splatted, views: Sequence[ShadowView]) -> np.ndarray:
    """The shadow map: 1 - near/z, the views as tiles."""
    columns, side = tiling(views)
    result = np.ones((max(math.ceil(len(views) / columns), 1) * side, columns * side), F)
    for k, (eye, _) in enumerate(views):
        pairs = carried_pairs(points, eye)
        planes = nearest(pairs, eye.camera) if points.rasterizer == "compute" else None
        left, top = k % columns * side, k // columns * side
        result[top : top + side, left : left + side] = point_depths(pairs, eye.near, eye.camera, planes)
    return result


def view_rows(views: Sequence[ShadowView], axes: np.ndarray) -> np.ndarray:
    """(n, 5, 4) as shaders/common/shadow.glsl reads them, for points in the axes of a camera with this pose."""
    columns, side = tiling(views)
    rows = np.zeros((max(len(views), 1), 5, 4))
    for k, ((camera, pose, near), contact) in enumerate(views):
        rows[k, :3] = (np.linalg.inv(pose) @ axes)[:3]
        rows[k, 3] = camera.fx, camera.cx, k % columns * side, k // columns * side
        rows[k, 4, :3] = near, side, contact
    return rows.astype(F)


def tiling(views: Sequence[ShadowView]) -> tuple[int, int]:
    """Columns of tiles in the shadow map, and pixels of a tile's side."""
    return math.ceil(math.sqrt(max(len(views), 1))), views[0].eye.camera.width if views else 1


def light(
    pixel: np.ndarray,
    surface: np.ndarray,
    albedo: np.ndarray,
    camera: Camera,
    viewer: np.ndarray,
    lamps: Lamps,
    axes: np.ndarray,
    look: Look,
) -> np.ndarray:
    """Linear light (n, 3) of surfaces (n, 4), unit normal and depth, which these pixels (n, 2) of the camera show.

    viewer (3,) in the axes of the camera, whose pose `axes` is.
    """
    strengths, rows = np.array(look.material.strengths, F), light_rows(lamps.lights, axes, lamps.spans)
    point = pixel_ray(pixel, np.array(camera.intrinsics, F)) * surface[:, 3:]
    common = point, viewer, surface[:, :3], albedo, strengths, np.ones(3, F), rows, len(rows)
    if lamps.shadow_map is None:
        return light_surface(*common)
    return light_surface_shadowed(*common, lamps.shadow_map, view_rows(lamps.views, axes), axes[:3, :3].astype(F))


def light_points(
    frame: Frame, normals: np.ndarray, picture: np.ndarray, viewer: np.ndarray, lamps: Lamps, look: Look
) -> np.ndarray:
    """Linear light (h, w, 3) of every point of a frame."""
    depth = frame.depth
    v, u = np.nonzero(depth)
    pixel = np.stack([u, v], -1).astype(F)
    surface = np.concatenate([normals[v, u], depth[v, u, None]], -1)
    albedo = srgb_to_linear(picture_at(picture, pixel, np.array(depth.shape[::-1], F)))
    result = np.zeros((*depth.shape, 3), F)
    result[v, u] = stored(light(pixel, surface, albedo, frame.camera, viewer, lamps, frame.pose, look))
    return result
