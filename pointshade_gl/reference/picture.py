"""Whole pictures on the CPU: what splats.vert, splats.frag and resolve.frag do, around the mirrored functions."""

from __future__ import annotations

import numpy as np

from ..camera import Camera, view_matrix
from ..frame import Frame
from ..shading import Material
from .camera import pixel_ray
from .color import linear_to_srgb, srgb_to_linear
from .lights import light_surface
from .splat import carry_footprint, footprint_covers, footprint_extent, inverse_depth_slope, invert_footprint, splat_reach
from .surface import neighbour_weight, point_on_plane, source_position
from .vectors import normalize, texel

F = np.float32
DEPTH_STEPS = float(2**24 - 1)  # the depth buffer is 24-bit fixed point


def render(
    frame: Frame,
    normals: np.ndarray,
    lights: np.ndarray,
    material: Material,
    camera: Camera,
    pose: np.ndarray,
    near: float,
    shading: str = "phong",
    size: np.ndarray | float = 1.0,
    is_round: bool = False,
) -> np.ndarray:
    """What Renderer.render gives, (h, w, 4) uint8; normals (h, w, 3) with 0 where missing, lights (n, 3, 4)."""
    view = view_matrix(frame.pose, pose)
    color = np.full((1, 1, 3), 204, np.uint8) if frame.color is None else frame.color
    sizes = np.asarray(size, F).ravel()
    ids = source_ids(frame.depth, normals, frame.camera, camera, view, near, sizes, is_round)
    return resolve(ids, frame.depth, normals, color, frame.camera, camera, view, lights, material, shading)


def source_ids(
    depth: np.ndarray,
    normals: np.ndarray,
    source: Camera,
    target: Camera,
    view: np.ndarray,
    near: float,
    size: np.ndarray,
    is_round: bool,
) -> np.ndarray:
    """(h, w) int: the source pixel that each target pixel shows, -1 for none. size (1,) or (n,) source pixels."""
    v, u = np.nonzero(depth)
    pixel = np.stack([u, v], -1)
    reach = splat_reach(np.broadcast_to(size, depth.size)[v * source.width + u].astype(F), is_round)
    shown = reach > splat_reach(F(0), is_round)
    intrinsics = np.array(source.intrinsics, F), np.array(target.intrinsics, F)
    splat = carry_footprint(pixel.astype(F), depth[v, u], normals[v, u], intrinsics[0], view.astype(F), intrinsics[1])
    shown &= (splat.inverse_depth > 0) & (splat.inverse_depth * F(near) < 1)
    extent = footprint_extent(splat.to_target, reach, is_round)
    edge = np.array([target.width, target.height]) - 1
    low = np.ceil(np.maximum(splat.centre - extent, -0.5)).astype(int)
    high = np.floor(np.minimum(splat.centre + extent, edge + 0.5)).astype(int)
    low, high = np.maximum(low, 0), np.minimum(high, edge)
    across, down = np.moveaxis(np.where(shown[:, None], np.maximum(high - low + 1, 0), 0), -1, 0)
    # Every (splat, pixel of its box) pair; then the nearest splat of each pixel, the first drawn among equals.
    which = np.repeat(np.arange(len(u)), across * down)
    place = np.arange(len(which)) - np.repeat(np.cumsum(across * down) - across * down, across * down)
    q = low[which] + np.stack([place % np.maximum(across[which], 1), place // np.maximum(across[which], 1)], -1)
    to_source = invert_footprint(splat.to_target)[which]
    keep = footprint_covers(to_source, q.astype(F) - splat.centre[which], reach[which], is_round)
    which, q = which[keep], q[keep]
    z_clip = F(1) - F(2) * F(near) * splat.inverse_depth[which]
    window = np.round((z_clip * F(0.5) + F(0.5)).astype(float) * DEPTH_STEPS)
    order = np.lexsort((which, window))[::-1]  # farthest first: the nearest writes last and stays
    result = np.full((target.height, target.width), -1)
    result[q[order, 1], q[order, 0]] = (v * source.width + u)[which[order]]
    return result


def picture_at(color: np.ndarray, pixel: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """The colour picture at a depth pixel's position, bilinear, 0..1. size (w, h) of the depth picture."""
    shape = np.array(color.shape[1::-1])
    at = (pixel + 0.5) / np.array(size) * shape - 0.5
    corner = np.floor(at).astype(int)
    share = at - corner
    total = np.zeros((*pixel.shape[:-1], 3))
    for du, dv in ((0, 0), (1, 0), (0, 1), (1, 1)):
        weight = np.abs(1 - du - share[..., 0]) * np.abs(1 - dv - share[..., 1])
        total += weight[..., None] * texel(color, np.clip(corner + (du, dv), 0, shape - 1))[..., :3]
    return (total / 255).astype(F)


def resolve(
    ids: np.ndarray,
    depth: np.ndarray,
    normals: np.ndarray,
    color: np.ndarray,
    source: Camera,
    target: Camera,
    view: np.ndarray,
    lights: np.ndarray,
    material: Material,
    shading: str,
) -> np.ndarray:
    """The lit picture (h, w, 4) uint8 of `source_ids`. lights as the GPU gets them."""
    image = np.zeros((*ids.shape, 4), np.uint8)
    v, u = np.nonzero(ids >= 0)
    texel_of = np.stack([ids[v, u] % source.width, ids[v, u] // source.width], -1)
    own = picture_at(color, texel_of, (source.width, source.height))
    image[v, u, 3] = 255
    if shading == "none":
        image[v, u, :3] = np.round(own * 255)
        return image
    intrinsics = np.array(source.intrinsics, F), np.array(target.intrinsics, F)
    view = view.astype(F)
    strengths = np.array([material.ambient, material.diffuse, material.specular, material.shininess], F)

    def lit(source_point: np.ndarray, source_normal: np.ndarray, albedo: np.ndarray) -> np.ndarray:
        point = source_point @ view[:3, :3].T + view[:3, 3]
        n = source_normal @ view[:3, :3].T
        return light_surface(point, n, albedo, strengths, np.ones(3, F), lights, len(lights))

    pixel, z, normal = texel_of.astype(F), texel(depth, texel_of), texel(normals, texel_of)
    albedo = srgb_to_linear(own)
    splat = carry_footprint(pixel, z, normal, intrinsics[0], view, intrinsics[1])
    at = source_position(splat, pixel, np.stack([u, v], -1).astype(F))
    plain = lit(pixel_ray(pixel, intrinsics[0]) * z[:, None], normal, albedo)
    result = plain
    if shading != "flat":
        w = F(1) / z
        slope = inverse_depth_slope(normal, pixel_ray(pixel, intrinsics[0]), z, intrinsics[0])
        total, mixed_color, mixed_normal = np.zeros((len(z), 1), F), np.zeros_like(own), np.zeros_like(own)
        for k in range(4):
            corner = np.floor(at).astype(int) + (k & 1, k >> 1)
            weight = neighbour_weight(depth, corner, at, pixel, w, slope)[:, None]
            corner = np.where(weight > 0, corner, texel_of)
            n, c = texel(normals, corner), srgb_to_linear(picture_at(color, corner, (source.width, source.height)))
            if shading == "gouraud":
                c = lit(pixel_ray(corner.astype(F), intrinsics[0]) * texel(depth, corner)[:, None], n, c)
            mixed_color += weight * c
            mixed_normal += weight * n
            total += weight
        alone = total < F(0.001)
        safe = np.where(alone, F(1), total)
        albedo = np.where(alone, albedo, mixed_color / safe)
        normal = np.where(alone, normal, normalize(np.where(alone, normal, mixed_normal)))
        result = albedo
        light_at = lit(point_on_plane(at, pixel, w, slope, intrinsics[0]), normal, albedo)
        result = light_at if shading != "gouraud" else np.where(alone, light_at, albedo)
        still = (np.abs(at - pixel) < F(0.001)).all(-1, keepdims=True)
        result = np.where(still, plain, result)
    image[v, u, :3] = np.round(linear_to_srgb(result) * 255)
    return image
