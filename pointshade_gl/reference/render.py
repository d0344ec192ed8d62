"""Whole pictures on the CPU: what splats.vert, splats.frag and resolve.frag do, around the mirrored functions."""

from __future__ import annotations

import numpy as np

from ..camera import Camera, view_matrix
from ..frame import Frame
from ..shading import Material
from .camera import pixel_ray
from .color import linear_to_srgb, srgb_to_linear
from .lights import light_surface
from .picture import rescale_position, sample_picture
from .splat import (
    carry_footprint,
    footprint_covers,
    footprint_extent,
    inverse_depth_slope,
    invert_footprint,
    splat_reach,
)
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
    sizes = np.broadcast_to(size, depth.size)[v * source.width + u].astype(F)
    shown, reach = sizes > 0, splat_reach(sizes, is_round)
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
    """The colours, 0..1, at a position of the depth picture, whose size is (w, h)."""
    own = np.array(color.shape[1::-1], F)
    return sample_picture(color.astype(F) / F(255), rescale_position(pixel.astype(F), np.array(size, F), own))


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

    def lit(source_point: np.ndarray, source_normal: np.ndarray, encoded_albedo: np.ndarray) -> np.ndarray:
        point = source_point @ view[:3, :3].T + view[:3, 3]
        n, albedo = source_normal @ view[:3, :3].T, srgb_to_linear(encoded_albedo)
        return light_surface(point, n, albedo, strengths, np.ones(3, F), lights, len(lights))

    size = source.width, source.height
    pixel, z, normal = texel_of.astype(F), texel(depth, texel_of), texel(normals, texel_of)
    ray = pixel_ray(pixel, intrinsics[0])
    if shading == "flat":
        result = lit(ray * z[:, None], normal, own)
    else:
        splat = carry_footprint(pixel, z, normal, intrinsics[0], view, intrinsics[1])
        at = source_position(splat, pixel, np.stack([u, v], -1).astype(F))
        w = F(1) / z
        slope = inverse_depth_slope(normal, ray, z, intrinsics[0])
        total, mixed_normal, mixed_light = np.zeros((len(z), 1), F), np.zeros_like(own), np.zeros_like(own)
        whole = np.ones((len(z), 1), bool)
        for k in range(4):
            corner = np.clip(np.floor(at).astype(int) + np.array([k & 1, k >> 1]), 0, np.array(size) - 1)
            z_k, n_k = texel(depth, corner), texel(normals, corner)
            weight = neighbour_weight(z_k, corner.astype(F), at, pixel, w, slope)[:, None]
            whole &= weight > 0
            mixed_normal += weight * n_k
            total += weight
            if shading == "gouraud":
                z_k = np.where(weight > 0, z_k[:, None], F(1))
                light_k = lit(pixel_ray(corner.astype(F), intrinsics[0]) * z_k, n_k, picture_at(color, corner, size))
                mixed_light += np.where(weight > 0, weight * light_k, F(0))
        blended = total > F(0.001)
        safe = np.where(blended, total, F(1))
        albedo = picture_at(color, np.where(whole, at, pixel), size)
        normal = np.where(blended, normalize(np.where(blended, mixed_normal, normal)), normal)
        result = lit(point_on_plane(at, pixel, w, slope, intrinsics[0]), normal, albedo)
        if shading == "gouraud":
            result = np.where(blended, mixed_light / safe, result)
    image[v, u, :3] = np.round(linear_to_srgb(result) * 255)
    return image
