"""Whole pictures of one point cloud on the CPU: the passes of cloud_objects.py in their order, and light.frag.

Normals and sizes are given, and in which direction the surface goes on at its borders.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from pointshade_gl.gpu.clouds.cloud_objects import BALL_SHARE, BAND, CORE, RING, SHADOW_PUSH, SHADOW_SHARE, STEP_BACK
from pointshade_gl.scene.appearance import Appearance
from pointshade_gl.scene.camera import Eye, view_matrix
from pointshade_gl.scene.cloud import PointCloud
from pointshade_gl.scene.graph import Scene
from pointshade_gl.scene.light import Light, at_upper_left
from pointshade_gl.scene.node import Node
from pointshade_gl.scene.sample_pattern import light_part
from pointshade_gl.scene.settings import OutputSettings
from pointshade_gl.scene.shadow_cameras import shadow_views
from pointshade_gl.scene.visible import VisibleScene

from .camera import mean_focal_length, pixel_ray, project
from .cloud_front import closed_depth
from .cloud_splat import (
    NEAREST_SPLAT,
    OUTLINE,
    CloudSplat,
    SplatHit,
    facing,
    facing_weight,
    hit_ball,
    hit_disc,
    hit_weight,
    outline_normal,
    splat_extent,
    steeper,
)  # fmt: skip
from .color import srgb_to_linear
from .finished import finished
from .render import LightSet, light, tiling
from .vectors import dot, normalize, texel

F = np.float32
DEPTHS = 2**24 - 1  # steps of a depth buffer


class Splats(NamedTuple):
    """The points of a cloud in the axes of an eye."""

    centres: np.ndarray  # (n, 3)
    normals: np.ndarray  # (n, 3) towards the eye; 0: a ball
    edges: np.ndarray  # (n, 3) in which direction the surface goes on; 0: in all
    radii: np.ndarray  # (n, 1)
    colors: np.ndarray  # (n, 3) linear
    blended: bool
    median: float  # of the radii

    def sized(self, share: float) -> np.ndarray:
        """(n, 1) radii of which a share is drawn: of balls always the same."""
        is_ball = ~self.normals.any(-1, keepdims=True)
        return self.radii * np.where(is_ball, F(BALL_SHARE if self.blended else 1), F(share))


class Bordered(NamedTuple):
    """A cloud with `normals` and `sizes`, and where its surface goes on."""

    cloud: PointCloud
    edges: np.ndarray  # (n, 3) unit; 0: in all directions


def render(points: Bordered, lights: Sequence[Light], eye: Eye, finish: OutputSettings) -> np.ndarray:
    """The result of Renderer.render, (h, w, 4) uint8, of a cloud in a scene of its own."""
    scene = Scene((Node(points.cloud),))
    lights = [at_upper_left(one, eye.pose) for one in lights]
    shot = VisibleScene(eye, lights, scene, (), ())
    return finished(lambda sample: draw_sample(points, sample), shot, finish)


def draw_sample(points: Bordered, shot: VisibleScene) -> tuple[np.ndarray, np.ndarray]:
    """(h, w, 4) float32: linear light and 1 where something is seen; and (h, w, 2), a ground of nothing."""
    eye, lamps = shot.eye, hung_up(points, shot)
    surface, albedo = surfaces(splats_of(points, eye), eye)
    v, u = np.nonzero(surface[..., 3])
    image = np.zeros((eye.camera.height, eye.camera.width, 4), F)
    image[v, u, 3], image[v, u, :3] = 1, albedo[v, u]
    if points.cloud.shading == "phong":
        at, viewer, look = np.stack([u, v], -1).astype(F), np.zeros(3, F), Appearance(points.cloud.material)
        image[v, u, :3] = light(at, surface[v, u], albedo[v, u], eye.camera, viewer, lamps, eye.pose, look)
    return image, np.zeros((*image.shape[:2], 2), F)


def hung_up(points: Bordered, shot: VisibleScene) -> LightSet:
    """The lights with what those that cast shadows see of the cloud."""
    if not any(one.shadow for one in shot.lights):
        return LightSet(shot.lights, [None] * len(shot.lights), [], None)
    views, spans = shadow_views(shot.lights, shot.scene.extent, light_part(shot.sample))
    columns, side = tiling(views)
    shadow_map = np.ones((-(-len(views) // columns) * side, columns * side), F)
    for k, (eye, *_) in enumerate(views):
        left, top = k % columns * side, k // columns * side
        shadow_map[top : top + side, left : left + side] = depths(
            splats_of(points, eye), eye, SHADOW_SHARE, SHADOW_PUSH
        )
    return LightSet(shot.lights, spans, views, shadow_map)


def splats_of(points: Bordered, eye: Eye) -> Splats:
    cloud, edges = points
    middle = np.median(cloud.positions, axis=0).astype(np.float64)
    local, view = (cloud.positions - middle).astype(F), view_matrix(np.eye(4), eye.pose)
    view[:3, 3] += view[:3, :3] @ middle
    centres = (local @ view[:3, :3].astype(F).T + view[:3, 3].astype(F)).astype(F)
    (number, unit), blended = cloud.radius_rule, cloud.splat == "disc"
    radii = F(number) * (cloud.sizes if unit == "x" else np.ones_like(cloud.sizes))
    normals = np.zeros_like(centres)
    if blended:
        known = cloud.normals.any(-1, keepdims=True)
        turned = normalize(np.where(known, cloud.normals @ view[:3, :3].astype(F).T, F(1)))
        normals = np.where(known, facing(turned, centres), F(0))
    edges = (edges @ view[:3, :3].T).astype(F)
    colors = srgb_to_linear(cloud.colors.astype(F) / F(255))
    order = np.argsort(~normals.any(-1), kind="stable")
    arrays = (one[order] for one in (centres, normals, edges, radii[:, None], colors))
    return Splats(*arrays, blended, float(np.median(radii)))


def each_hit(splats: Splats, eye: Eye, share: float) -> Iterator[tuple[int, np.ndarray, SplatHit]]:
    """Yield the number of each splat in view, the pixels in its box, (n, 2), and what their rays meet."""
    k, size, radii = np.array(eye.camera.intrinsics, F), (eye.camera.width, eye.camera.height), splats.sized(share)
    for j, (centre, normal, radius) in enumerate(zip(splats.centres, splats.normals, radii, strict=True)):
        if not radius > 0 or centre[2] < max(F(eye.near), NEAREST_SPLAT * radius):
            continue
        splat, middle = CloudSplat(centre, normal, radius), project(centre, k)
        extent = np.maximum(splat_extent(splat, k), F(0.5)) + F(0.07)
        low = np.maximum(np.ceil(middle - extent), 0).astype(int)
        high = np.minimum(np.floor(middle + extent), np.array(size) - 1).astype(int)
        if (low > high).any():
            continue
        pixel = np.stack(np.meshgrid(np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1)), -1).reshape(-1, 2)
        offset = pixel.astype(F) - middle
        if normal.any():
            hit = hit_disc(splat, steeper(normal, centre), splats.edges[j], offset, k)
        else:
            hit = hit_ball(splat, offset, k)
        met = hit.depth[:, 0] > 0
        yield j, pixel[met], SplatHit(*(one[met] for one in hit))


def depths(splats: Splats, eye: Eye, share: float, push: float) -> np.ndarray:
    """(h, w) 1 - near/z of the nearest splats, as a depth buffer keeps it."""
    result, radii = np.ones((eye.camera.height, eye.camera.width), F), splats.sized(share)
    for j, pixel, hit in each_hit(splats, eye, share):
        z = hit.depth[:, 0] + (F(push) * radii[j] if splats.normals[j].any() else F(0))
        at = pixel[:, 1], pixel[:, 0]
        result[at] = np.minimum(result[at], F(1) - F(eye.near) / z)
    return (np.round(result.astype(np.float64) * DEPTHS) / DEPTHS).astype(F)


def surfaces(splats: Splats, eye: Eye) -> tuple[np.ndarray, np.ndarray]:
    """(h, w, 4) unit normal and depth, 0 where nothing is, and (h, w, 3) linear albedo."""
    if splats.blended:
        return resolved(*blended(splats, eye, front_of(splats, eye)), eye)
    surface, albedo = (np.zeros((eye.camera.height, eye.camera.width, n), F) for n in (4, 3))
    for j, pixel, hit in each_hit(splats, eye, 1):
        at, known = (pixel[:, 1], pixel[:, 0]), surface[pixel[:, 1], pixel[:, 0], 3]
        nearer = (known == 0) | (hit.depth[:, 0] < known)
        at = at[0][nearer], at[1][nearer]
        surface[at] = np.concatenate([hit.normal, hit.depth], -1)[nearer]
        albedo[at] = splats.colors[j]
    return surface, albedo


def front_of(splats: Splats, eye: Eye) -> np.ndarray:
    """(h, w) z of the front surface, 0 where there is none."""
    cores = depths(splats, eye, CORE, 0)
    focal = float(mean_focal_length(np.array(eye.camera.intrinsics, F)))
    away = max(float(np.median(splats.centres[:, 2])), eye.near)
    ring = np.array((RING * splats.median * focal, RING * splats.median * focal / away), F)
    u, v = np.meshgrid(np.arange(eye.camera.width), np.arange(eye.camera.height))
    return closed_depth(cores, np.stack([u, v], -1), eye.near, STEP_BACK * splats.median, ring)


def blended(splats: Splats, eye: Eye, front: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The front, and sums (h, w, 4): normal and 1/z times the weight; linear colour times the weight, the weight."""
    geometry, albedo = (np.zeros((*front.shape, 4), F) for _ in range(2))
    radii = splats.sized(1)
    for j, pixel, hit in each_hit(splats, eye, 1):
        surface = texel(front, pixel)
        on_it = (surface > 0) & (np.abs(hit.depth[:, 0] - surface) <= F(BAND) * radii[j])
        at = pixel[on_it, 1], pixel[on_it, 0]
        weight = hit_weight(hit.outside[on_it])
        normal = facing_weight(hit.normal[on_it], splats.centres[j]) * hit.normal[on_it]
        geometry[at] += weight * np.concatenate([normal, F(1) / hit.depth[on_it]], -1)
        albedo[at] += weight * np.append(splats.colors[j], F(1))
    return front, geometry, albedo


def resolved(front: np.ndarray, geometry: np.ndarray, albedo: np.ndarray, eye: Eye) -> tuple[np.ndarray, np.ndarray]:
    """What resolve.frag makes of the sums."""
    holes = (front > 0) & (albedo[..., 3] == 0)
    sums = [np.where(holes[..., None], sum(beside(one)), one) for one in (geometry, albedo)]
    seen = (front > 0) & (sums[1][..., 3] > 0)
    weight = np.where(seen, sums[1][..., 3], F(1))[..., None]
    mean = sums[0] / weight
    size = np.sqrt(dot(mean[..., :3], mean[..., :3]))
    normal = mean[..., :3] / np.where(size > 0, size, F(1))
    normal = np.where(seen[..., None], turned_as_beside(normal, mean[..., 3], geometry, albedo, eye), F(0))
    inverse = np.where(seen, mean[..., 3], F(1))
    surface = np.concatenate([normal, np.where(seen, F(1) / inverse, F(0))[..., None]], -1)
    return surface, sums[1][..., :3] / weight


def turned_as_beside(
    normal: np.ndarray, inverse_depth: np.ndarray, geometry: np.ndarray, albedo: np.ndarray, eye: Eye
) -> np.ndarray:
    u, v = np.meshgrid(np.arange(eye.camera.width), np.arange(eye.camera.height))
    ray = normalize(pixel_ray(np.stack([u, v], -1).astype(F), np.array(eye.camera.intrinsics, F)))
    nearer = np.zeros_like(normal)
    for one, weights in zip(beside(geometry), beside(albedo), strict=True):
        nearer += np.where((one[..., 3] > inverse_depth * weights[..., 3])[..., None], one[..., :3], F(0))
    at_outline = np.abs(dot(normal, ray)) < OUTLINE
    return np.where(at_outline, outline_normal(normal, nearer, ray), normal)


def beside(image: np.ndarray) -> list[np.ndarray]:
    """The images, row by row, of what is one pixel aside in each direction, of borders the border, and of the image."""
    wide = np.pad(image, ((1, 1), (1, 1), (0, 0)), mode="edge")
    height, width = image.shape[:2]
    return [wide[y : y + height, x : x + width] for y in range(3) for x in range(3)]
