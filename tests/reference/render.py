"""Whole pictures of one point object's splats on the CPU: the passes of pipeline.py in their order, and light.frag."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from pointshade_gl.estimation.ground import ground_under
from pointshade_gl.scene.appearance import Appearance
from pointshade_gl.scene.camera import Camera, Eye, view_matrix
from pointshade_gl.scene.environment import NO_ENVIRONMENT, EnvironmentLight
from pointshade_gl.scene.frame import Frame
from pointshade_gl.scene.graph import Scene
from pointshade_gl.scene.light import Light, at_upper_left, light_rows
from pointshade_gl.scene.node import Node
from pointshade_gl.scene.objects import PointObject
from pointshade_gl.scene.sample_pattern import light_part
from pointshade_gl.scene.settings import SIMPLE, OutputSettings
from pointshade_gl.scene.shadow_cameras import ShadowView, Span, shadow_views
from pointshade_gl.scene.visible import MERGE, VisibleScene, bridged_camera, bridged_stride

from .around import around_of, light_from_around, visibility_map
from .camera import pixel_ray
from .color import srgb_to_linear
from .eye_dome import eye_dome
from .finished import draw_ground, finished
from .hidden_planes import hidden_at
from .inverse_depth import pixel_grid
from .lights import light_surface
from .picture import picture_at
from .rasterizers import (
    Pairs,
    buffer_depths,
    covered_pairs,
    drawn_pairs,
    merged_splats,
    nearest,
    single_splats,
    source_ids,
)
from .resolve import color_position, mix_light, seen_weights
from .resolve_pass import seen_by_depth, seen_by_id, surface_map_of, surfaces
from .rim_marks import mark_rim
from .shadowed_lights import light_surface_shadowed
from .surroundings import carried_visibility, unpack_visibility
from .toksvig import certainty_at, widened
from .vectors import normalize, texel

F = np.float32
KEPT = 12  # shadow views and hidden surfaces
_kept: dict[bytes, np.ndarray] = {}


class LightSet(NamedTuple):
    """The lights with their shadow map; without views if no light casts shadows."""

    lights: Sequence[Light]  # each with a position or a direction
    spans: Sequence[Span | None]  # of each one's views
    views: Sequence[ShadowView]
    shadow_map: np.ndarray | None
    surroundings: EnvironmentLight = NO_ENVIRONMENT


class Splatted(NamedTuple):
    """A frame, and how its points become splats."""

    frame: Frame
    surface_map: np.ndarray
    look: Appearance
    rasterizer: str
    merge: float
    certainty: np.ndarray | None = None  # of the normals, see toksvig.py
    visibility: np.ndarray | None = None  # (h, w, 4), see around.py
    light_normals: np.ndarray | None = None  # (h, w, 3), if splats do not lie by them

    def certainty_at(self, at: np.ndarray) -> np.ndarray | None:
        """(n, 1) at positions (n, 2); None where nobody doubts."""
        size = np.array(self.frame.depth.shape[::-1], F)
        return None if self.certainty is None else certainty_at(self.certainty, at, size)


def render(
    frame: Frame,
    normals: np.ndarray,
    lights: Sequence[Light],
    look: Appearance,
    eye: Eye,
    rasterizer: str = "points",
    merge: float = MERGE,
    finish: OutputSettings = SIMPLE,
    certainty: np.ndarray | None = None,
    surroundings: EnvironmentLight = NO_ENVIRONMENT,
    stride: int = 1,
    light_normals: np.ndarray | None = None,
) -> np.ndarray:
    """The result of Renderer.render, (h, w, 4) uint8; normals (h, w, 3) with 0 where missing, certainty of these."""
    marked = mark_rim(frame.depth, pixel_grid(frame.depth), frame.camera.intrinsics)
    surface_map, seen = surface_map_of(normals, marked), None
    if surroundings.occlusion:
        radius = surroundings.radius(frame.scale)
        seen = visibility_map(surface_map, np.array(frame.camera.intrinsics, F), radius, stride)
    points = Splatted(frame, surface_map, look, rasterizer, merge, certainty, seen, light_normals)
    lights = [at_upper_left(light, eye.pose) for light in lights]
    shot = VisibleScene(eye, lights, Scene((Node(PointObject(frame)),)), (), (), environment_light=surroundings)
    return finished(lambda sample: draw_sample(points, sample, finish), shot, finish)


def draw_sample(points: Splatted, shot: VisibleScene, finish: OutputSettings) -> tuple[np.ndarray, np.ndarray]:
    """(h, w, 4) float32: linear light and 1 where something is seen; and (h, w, 2), the ground's alphas elsewhere."""
    eye, lamps, material = shot.eye, hung_up(shot, points), points.look.material
    lamps = lamps._replace(surroundings=shot.environment_light)
    image, seen = draw_splats(points, eye, lamps)
    alpha = np.zeros((*image.shape[:2], 2), F)
    if finish.up is not None and (lamps.shadow_map is not None or shot.environment_light.occlusion):
        rows, strengths = light_rows(lamps.lights, eye.pose, lamps.spans), np.array(material.strengths, F)
        plane, views = ground_under(shot.scene, finish.up, finish.ground_height), view_rows(lamps.views, eye.pose)
        distance = points.frame.scale
        extra = shot.environment_light, seen, shot.sample, distance
        alpha = draw_ground(image, plane, eye, strengths, rows, lamps.shadow_map, views, *extra)
    return image, alpha


def draw_splats(points: Splatted, eye: Eye, lamps: LightSet) -> tuple[np.ndarray, np.ndarray]:
    """(h, w, 4) float32: linear light and 1 where something is seen; and (h, w, 4), normals of phong and depths."""
    frame, surface_map, look, rasterizer, *_ = points
    source, depth, camera = frame.camera, frame.depth, eye.camera
    view = view_matrix(frame.pose, eye.pose).astype(F)
    picture = (np.full((1, 1, 3), 204, np.uint8) if frame.color is None else frame.color).astype(F) / F(255)
    pairs = carried_pairs(points, eye)
    if rasterizer == "points":
        target_pixel, seen = seen_by_id(*source_ids(pairs, eye.near, camera), surface_map, source, camera, view)
    else:
        target_pixel, seen = seen_by_depth(nearest(pairs, camera), surface_map, source, camera, view)
    image = np.zeros((camera.height, camera.width, 4), F)
    shown = np.zeros_like(image)
    u, v = target_pixel.T
    image[v, u, 3], shown[v, u, 3] = 1, 1 / seen.inverse_depth.ravel()
    if look.shading in ("none", "edl"):
        colors = picture_at(picture, seen.pixel.astype(F), np.array(depth.shape[::-1], F))
        image[v, u, :3] = srgb_to_linear(colors)
        if look.shading == "edl":
            depths = np.zeros_like(image)
            depths[v, u, 3] = 1 / seen.inverse_depth.ravel()
            image[v, u, :3] *= eye_dome(depths, target_pixel, depths[v, u, 3])[:, None]
    elif look.shading == "phong":
        surface, albedo = surfaces(seen, picture, source, view, points.light_normals)
        shown[v, u] = surface
        axes = camera, np.zeros(3, F), lamps, eye.pose
        certainty, visibility = points.certainty_at(seen.at), None
        if points.visibility is not None:
            at = color_position(seen, seen_weights(seen, np.array(source.intrinsics, F)))
            size = np.array(depth.shape[::-1], F)
            visibility = carried_visibility(points.visibility, at, size, view[:3, :3])
        image[v, u, :3] = light(target_pixel.astype(F), surface, albedo, *axes, look, certainty, visibility)
    else:
        light_map = light_points(points, picture, viewer_in(frame.pose, eye), lamps)
        weights = seen_weights(seen, np.array(source.intrinsics, F))
        is_flat = look.shading == "flat"
        image[v, u, :3] = texel(light_map, seen.pixel) if is_flat else mix_light(seen, weights, light_map)
    return image, shown


def viewer_in(pose: np.ndarray, eye: Eye) -> np.ndarray:
    """(3,) where an eye is, in the axes of a camera with this pose."""
    return (np.linalg.inv(pose) @ eye.pose)[:3, 3].astype(F)


def carried_pairs(points: Splatted, eye: Eye) -> Pairs:
    """What the splats cover in a view: of every pixel by itself, or for the compute rasteriser of blocks on a plane."""
    frame, surface_map, look, rasterizer, merge, *_ = points
    depth, normals = surface_map[..., 3], surface_map[..., :3]
    view = view_matrix(frame.pose, eye.pose).astype(F)
    if rasterizer == "points":
        size = np.asarray(1.0 if look.point_size is None else look.point_size, F).ravel()
        splats = single_splats(depth, normals, size)
    else:
        splats = merged_splats(depth, normals, frame.camera, merge, view)
    if has_rims(points):
        return drawn_pairs(splats, surface_map, frame.camera, eye.camera, view, eye.near)
    return covered_pairs(splats, frame.camera, eye.camera, view, eye.near, look.splat == "round")


def has_rims(points: Splatted) -> bool:
    """Footprints of size 1 have rims."""
    size = 1 if points.look.point_size is None else points.look.point_size
    return points.look.splat == "footprint" and bool((np.asarray(size) == 1).all())


def hung_up(shot: VisibleScene, points: Splatted) -> LightSet:
    """The lights with what those that cast shadows see of the frame, which is all of the scene."""
    lights = shot.lights
    if not any(one.shadow or one.is_spot or one.is_area for one in lights):
        return LightSet(lights, [None] * len(lights), [], None)
    views, spans = shadow_views(lights, shot.scene.extent, light_part(shot.sample))
    return LightSet(lights, spans, views, draw_views(points, views))


def draw_views(points: Splatted, views: Sequence[ShadowView]) -> np.ndarray:
    """The shadow map: 1 - near/z, the views as tiles."""
    columns, side = tiling(views)
    result = np.ones((max(math.ceil(len(views) / columns), 1) * side, columns * side), F)
    for k, (eye, *_) in enumerate(views):
        left, top = k % columns * side, k // columns * side
        result[top : top + side, left : left + side] = window_depths(points, eye)
    return result


def window_depths(points: Splatted, eye: Eye) -> np.ndarray:
    """(h, w) 1 - near/z as a depth buffer keeps it. Read-only: kept for another sample or picture with this view."""
    camera, size = points.frame.camera, points.look.point_size
    size = None if size is None else (np.shape(size), np.asarray(size, F).tobytes())
    how = camera, points.frame.pose.tolist(), points.look.splat, size, points.rasterizer, float(points.merge)
    asked = points.surface_map, how, eye.camera, eye.pose.tolist(), float(eye.near)
    return _once(lambda: np.minimum(*(splat_depths(some, eye) for some in (points, hidden_points(points)))), *asked)


def _once(make: Callable[[], np.ndarray], surface_map: np.ndarray, *asked: object) -> np.ndarray:
    """What is made of a surface map and of values that their repr tells apart; the last ones are kept."""
    key = hashlib.sha256(np.ascontiguousarray(surface_map).tobytes() + repr(asked).encode()).digest()
    if key not in _kept:
        found = make()
        found.flags.writeable = False
        while len(_kept) >= KEPT:
            _kept.pop(next(iter(_kept)))
        _kept[key] = found
    return _kept[key]


def hidden_points(points: Splatted) -> Splatted:
    """What the points hide and what goes on behind them."""
    frame, camera, stride = points.frame, bridged_camera(points.frame.camera), bridged_stride(points.frame.camera)
    middle = stride * np.stack(np.meshgrid(np.arange(camera.width), np.arange(camera.height)), -1) + stride // 2
    pixel = np.minimum(middle, (frame.camera.width - 1, frame.camera.height - 1)).reshape(-1, 2)
    source = np.array(frame.camera.intrinsics, F)
    surface = _once(lambda: hidden_at(points.surface_map, pixel, stride, source), points.surface_map, frame.camera)
    surface = surface.reshape(camera.height, camera.width, 4)
    hidden = Frame(None, surface[..., 3], camera, frame.pose)
    return Splatted(hidden, surface, Appearance(), points.rasterizer, points.merge)


def splat_depths(points: Splatted, eye: Eye) -> np.ndarray:
    """The same of splats alone."""
    pairs, frame = carried_pairs(points, eye), points.frame
    if points.rasterizer == "compute":
        inverse_depth = nearest(pairs, eye.camera)
    else:
        view, ids = view_matrix(frame.pose, eye.pose).astype(F), source_ids(pairs, eye.near, eye.camera)
        pixel, seen = seen_by_id(*ids, points.surface_map, frame.camera, eye.camera, view)
        inverse_depth = np.zeros((eye.camera.height, eye.camera.width), F)
        inverse_depth[pixel[:, 1], pixel[:, 0]] = seen.inverse_depth
    return buffer_depths(eye.near, inverse_depth)


def view_rows(views: Sequence[ShadowView], axes: np.ndarray) -> np.ndarray:
    """(n, 6, 4) as shaders/common/shadow.glsl reads them, for points in the axes of a camera with this pose."""
    columns, side = tiling(views)
    rows = np.zeros((max(len(views), 1), 6, 4))
    for k, ((camera, pose, near), contact, farther, spread) in enumerate(views):
        rows[k, :3] = (np.linalg.inv(pose) @ axes)[:3]
        rows[k, 3] = camera.fx, camera.cx, k % columns * side, k // columns * side
        rows[k, 4] = near, side, contact, spread * camera.fx
        rows[k, 5] = farther @ axes
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
    lamps: LightSet,
    axes: np.ndarray,
    look: Appearance,
    certainty: np.ndarray | None = None,
    visibility: np.ndarray | None = None,
) -> np.ndarray:
    """Linear light (n, 3) of surfaces (n, 4), unit normal and depth, which these pixels (n, 2) of the camera show.

    viewer (3,) in the axes of the camera, whose pose `axes` is; certainty (n, 1) of the normals; visibility (n, 4)
    """
    strengths, rows = np.array(look.material.strengths, F), light_rows(lamps.lights, axes, lamps.spans)
    strengths = strengths if certainty is None else widened(strengths, certainty)
    point = pixel_ray(pixel, np.array(camera.intrinsics, F)) * surface[:, 3:]
    around = around_of(lamps.surroundings, look.material.shininess, axes)
    ambient = np.full(3, around is None, F) * (F(1) if visibility is None else visibility[:, 3:])
    common = point, viewer, surface[:, :3], albedo, strengths, ambient, rows, len(rows)
    if lamps.shadow_map is None:
        lit = light_surface(*common)
    else:
        turn = axes[:3, :3].astype(F)
        lit = light_surface_shadowed(*common, lamps.shadow_map, view_rows(lamps.views, axes), turn)
    if around is None:
        return lit
    return lit + light_from_around(around, visibility, normalize(viewer - point), surface[:, :3], albedo, strengths)


def light_points(points: Splatted, picture: np.ndarray, viewer: np.ndarray, lamps: LightSet) -> np.ndarray:
    """Linear light (h, w, 3) of every point of a frame."""
    frame, normals, depth = points.frame, points.surface_map[..., :3], points.frame.depth
    v, u = np.nonzero(depth)
    pixel = np.stack([u, v], -1).astype(F)
    surface = np.concatenate([normals[v, u], depth[v, u, None]], -1)
    albedo = srgb_to_linear(picture_at(picture, pixel, np.array(depth.shape[::-1], F)))
    result = np.zeros((*depth.shape, 3), F)
    axes, certainty = (frame.camera, viewer, lamps, frame.pose), points.certainty_at(pixel)
    visibility = None if points.visibility is None else unpack_visibility(points.visibility[v, u])
    result[v, u] = light(pixel, surface, albedo, *axes, points.look, certainty, visibility)
    return result
