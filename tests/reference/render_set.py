"""Pictures of several frames drawn as one thing, on the CPU: what view_consensus.py and set_merge.py do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pointshade_gl.estimation.multi_view import (
    Comparison,
    band_of,
    compared,
    gains_of,
    importances,
    nearest_others,
    primary_shares,
)
from pointshade_gl.estimation.pose_outliers import contradictions
from pointshade_gl.scene.appearance import Look
from pointshade_gl.scene.camera import Eye, view_matrix
from pointshade_gl.scene.frame import Frame
from pointshade_gl.scene.graph import Scene
from pointshade_gl.scene.level_of_detail import MERGE
from pointshade_gl.scene.light import Light, at_upper_left, light_rows
from pointshade_gl.scene.node import Node
from pointshade_gl.scene.point_object import PointObject
from pointshade_gl.scene.render_settings import SIMPLE, Finish
from pointshade_gl.scene.shadow_cameras import shadow_views
from pointshade_gl.scene.visible_scene import VisibleScene

from .camera import pixel_ray
from .color import srgb_to_linear
from .consensus import carry_forth, depth_excess, end_around, end_in_row, log_ratio, surface_ends, trust_in, vote_on
from .finished import finished
from .inverse_depth import pixel_grid
from .lights import light_surface
from .parts import (
    agreement,
    fallback_weight,
    is_among,
    is_stretched,
    key_inverse_depth,
    look_twice,
    merged_inverse_depth,
    part_is_known,
    share_across,
    splat_key,
    splat_level,
    target_normal,
    view_weight,
)
from .picture import picture_at
from .rasterizers import DEPTH_STEPS, Pairs, drawn_pairs, merged_splats, single_splats
from .render import tiling, view_rows
from .resolve import color_position, mix_normal, seen_weights
from .resolve_pass import some_of, surface_map_of
from .rim_marks import mark_rim
from .shadowed_lights import light_surface_shadowed
from .splat import footprint_extent, splat_reach
from .splat_corners import surface_at
from .surface_pass import surface_by_noise
from .vectors import normalize, texel

F = np.float32
STRIDE = 8


class View(NamedTuple):
    """One of the frames."""

    frame: Frame
    surface_map: np.ndarray  # (h, w, 4)
    picture: np.ndarray  # (h, w, 3|4), 0 to 1
    intrinsics: np.ndarray  # (4,)


class Judged(NamedTuple):
    """What the frames agree on."""

    views: list[View]
    trusts: list[np.ndarray]  # (h, w, 2) each
    band: float
    gains: np.ndarray  # (n, 3)
    wrong: frozenset[int]  # frames that contradict the others


def judge(frames: Sequence[Frame], normals: Sequence[np.ndarray]) -> Judged:
    """normals (h, w, 3) each, with 0 where missing."""
    views = [_view(frame, own) for frame, own in zip(frames, normals, strict=True)]
    others = nearest_others(frames)
    pairs = {(i, j): _compare(views[i], views[j]) for i, known in enumerate(others) for j in known}
    wrong = contradictions(pairs, len(frames)).frames
    pairs = {pair: one for pair, one in pairs.items() if not wrong.intersection(pair)}
    band = band_of(pairs)
    trusts = [_trust(views[i], [views[j] for j in known if j not in wrong], band) for i, known in enumerate(others)]
    trusts = [trust * F(k not in wrong) for k, trust in enumerate(trusts)]
    return Judged(views, trusts, band, gains_of(pairs, len(frames)), wrong)


def render_set(
    judged: Judged, lights: Sequence[Light], look: Look, eye: Eye, rasterizer: str, finish: Finish = SIMPLE
) -> np.ndarray:
    """The result of Renderer.render for several frames, phong or none, without a ground, (h, w, 4) uint8.

    Normals at the target are those of "auto".
    """
    lights = [at_upper_left(light, eye.pose) for light in lights]
    shot = VisibleScene(eye, lights, Scene((Node(PointObject([view.frame for view in judged.views])),)), (), ())
    no_ground = np.zeros((eye.camera.height, eye.camera.width), F)

    def draw(sample: VisibleScene) -> tuple[np.ndarray, np.ndarray]:
        return _draw_sample(judged, sample.lights, look, sample.eye, rasterizer), no_ground

    return finished(draw, shot, finish)


def _draw_sample(judged: Judged, lights: Sequence[Light], look: Look, eye: Eye, rasterizer: str) -> np.ndarray:
    """(h, w, 4) float32: linear light and 1 where something is seen."""
    camera, target = eye.camera, np.array(eye.camera.intrinsics, F)
    weights = importances([view.frame for view in judged.views], eye.pose, judged.wrong)
    key = _keys(judged, eye, primary_shares(weights), rasterizer)
    v, u = np.nonzero(key)
    inverse_depth, hidden = key_inverse_depth(key[v, u]), key[v, u] & 1 == 1
    pixel = np.stack([u, v], -1).astype(F)
    sums = np.zeros((len(u), 8), F)
    for view, trust, weight, gain in zip(judged.views, judged.trusts, weights, judged.gains, strict=True):
        sums += _part(view, trust, float(weight), gain.astype(F), inverse_depth, hidden, pixel, eye, judged.band)
    known = sums[:, 7] > 0
    u, v, pixel, sums = u[known], v[known], pixel[known], sums[known]
    z = F(1) / merged_inverse_depth(key[v, u], sums[:, 3], sums[:, 7])
    albedo = sums[:, 4:7] / sums[:, 7:]
    image = np.zeros((camera.height, camera.width, 4), F)
    image[v, u, 3] = 1
    lit = albedo
    if look.shading == "phong":
        point, normal = pixel_ray(pixel, target) * z[:, None], normalize(sums[:, :3] / sums[:, 7:])
        if look.normals_at == "target":
            depth = np.zeros(key.shape, F)
            depth[v, u] = z
            normal = target_normal(surface_by_noise(depth, target)[v, u], normal)
        lit = _light(point, normal, albedo, judged, lights, look, eye, rasterizer)
    image[v, u, :3] = lit
    return image


def _view(frame: Frame, normals: np.ndarray) -> View:
    picture = np.full((1, 1, 3), 204, np.uint8) if frame.color is None else frame.color
    depth = np.where(normals.any(-1), frame.depth, F(0))
    surface_map = surface_map_of(normals, mark_rim(depth, pixel_grid(depth), frame.camera.intrinsics))
    return View(frame, surface_map, picture.astype(F) / F(255), np.array(frame.camera.intrinsics, F))


def _way(view: View, pose: np.ndarray) -> np.ndarray:
    return view_matrix(view.frame.pose, pose).astype(F)


def _compare(one: View, other: View) -> Comparison:
    height, width = one.frame.depth.shape
    columns, rows = max(width // STRIDE, 1), max(height // STRIDE, 1)
    at = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), -1).reshape(-1, 2) * STRIDE + STRIDE // 2
    place = np.minimum(at, (width - 1, height - 1))
    own = surface_at(one.surface_map, place)
    known = own[:, 3] > 0
    place, at, own = place[known], at[known], own[known]
    there = carry_forth(
        place.astype(F), F(1) / own[:, 3], one.intrinsics, _way(one, other.frame.pose), other.intrinsics
    )
    excess = depth_excess(other.surface_map, there, other.intrinsics)
    seen = excess < 1e29
    ours = picture_at(one.picture, at[seen].astype(F), np.array((width, height), F))
    theirs = picture_at(other.picture, there[seen, :2], np.array(other.frame.depth.shape[::-1], F))
    ratios = log_ratio(ours, theirs, srgb_to_linear(ours), srgb_to_linear(theirs))
    colored = one.frame.color is not None and other.frame.color is not None
    return compared(np.concatenate([excess[seen, None], ratios], -1).astype(F), colored)


def _trust(view: View, others: Sequence[View], band: float) -> np.ndarray:
    height, width = view.frame.depth.shape
    pixel = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1)
    known = view.surface_map[..., 3] != 0
    votes = np.zeros((height, width, 2), F)
    w = F(1) / np.where(known, np.abs(view.surface_map[..., 3]), F(1))
    for other in others:
        there = carry_forth(pixel.astype(F), w, view.intrinsics, _way(view, other.frame.pose), other.intrinsics)
        votes += vote_on(other.surface_map, there, other.intrinsics, band) * known[..., None]
    ends = surface_ends(view.surface_map, pixel, view.intrinsics)
    edge = end_around(end_in_row(ends, pixel), pixel)
    border = np.minimum(np.minimum(pixel[..., 0], width - 1 - pixel[..., 0]), pixel[..., 1])
    border = np.minimum(border, height - 1 - pixel[..., 1]) + 1
    ray = normalize(pixel_ray(pixel.astype(F), view.intrinsics))
    trust = trust_in(votes, edge, border, -(view.surface_map[..., :3] * ray).sum(-1))
    return np.round(trust * 255).astype(F) / F(255)  # as a texture of 8 bits keeps it


def _keys(judged: Judged, eye: Eye, primary: np.ndarray, rasterizer: str) -> np.ndarray:
    """(h, w) uint32: what the splats of all frames leave."""
    result = np.zeros((eye.camera.height, eye.camera.width), np.uint32)
    depth = np.full(result.shape, np.inf)
    for view, trust, share in zip(judged.views, judged.trusts, primary, strict=True):
        pairs, sides = _pairs(view, eye, rasterizer)
        stretched = is_stretched(footprint_extent(pairs.splat, splat_reach(sides, False), False), sides)
        row, column = np.divmod(pairs.source_index, trust.shape[1])
        among = is_among(np.stack([column, row], -1), share)
        level = splat_level(trust[row, column, 0], stretched, among)
        level = np.where(pairs.is_hidden, level & 1, level)
        inverse_depth = pairs.inverse_depth
        keys, place = splat_key(inverse_depth, level, pairs.is_hidden), (pairs.q[:, 1], pairs.q[:, 0])
        if rasterizer == "compute":
            np.maximum.at(result, place, keys)
            continue
        window = (F(4) - level - np.clip(F(eye.near) * inverse_depth, F(0), F(1))) * F(0.25)
        window = np.round(window.astype(float) * DEPTH_STEPS)
        order = np.argsort(window, kind="stable")[::-1]
        nearest = np.full(result.shape, np.inf)
        np.minimum.at(nearest, place, window)
        picked = np.zeros_like(result)
        picked[pairs.q[order, 1], pairs.q[order, 0]] = keys[order]
        result = np.where(nearest < depth, picked, result)
        depth = np.minimum(depth, nearest)
    return result


def _pairs(view: View, eye: Eye, rasterizer: str) -> tuple[Pairs, np.ndarray]:
    """What the splats cover, and (n,) how many source pixels along a side each has."""
    way, source = _way(view, eye.pose), view.frame.camera
    depth, normals = view.surface_map[..., 3], view.surface_map[..., :3]
    if rasterizer == "points":
        splats = single_splats(depth, normals, np.ones(1, F))
    else:
        splats = merged_splats(depth, normals, source, MERGE, way)
    size = np.ones(depth.size, F)
    size[splats.source_index] = splats.size
    pairs = drawn_pairs(splats, view.surface_map, source, eye.camera, way, eye.near)
    return pairs, size[pairs.source_index]


def _part(
    view: View,
    trust: np.ndarray,
    importance: float,
    gain: np.ndarray,
    inverse_depth: np.ndarray,
    hidden: np.ndarray,
    pixel: np.ndarray,
    eye: Eye,
    band: float,
) -> np.ndarray:
    """(n, 8) what set_accumulate.frag adds: normal, difference of 1/z, albedo, times the weight; and the weight."""
    way, target, size = _way(view, eye.pose), np.array(eye.camera.intrinsics, F), view.frame.depth.shape[::-1]
    with np.errstate(all="ignore"):
        seen = look_twice(view.surface_map, inverse_depth, hidden, pixel, view.intrinsics, way, target, band)
        known = part_is_known(seen, np.array(size, F))
    seen = some_of(seen, known)
    corner = seen_weights(seen, view.intrinsics)
    color = picture_at(view.picture, color_position(seen, corner), np.array(size, F))
    off = seen.inverse_depth / inverse_depth[known] - F(1)
    said = texel(trust, seen.pixel)
    across = off * share_across(seen.own[:, :3], pixel[known], way, target)
    weight = F(importance) * said[:, 0] * said[:, 1] * agreement(across, band)
    weight = weight * view_weight(seen, pixel[known], view.intrinsics, way, target)
    total = weight + fallback_weight(across, band)
    normal = mix_normal(seen, corner) @ way[:3, :3].T
    values = total[:, None] * normal, (weight * off)[:, None], total[:, None] * (gain * srgb_to_linear(color))
    result = np.zeros((len(pixel), 8), F)
    result[known] = np.concatenate([*values, total[:, None]], -1)
    return result


def _light(
    point: np.ndarray,
    normal: np.ndarray,
    albedo: np.ndarray,
    judged: Judged,
    lights: Sequence[Light],
    look: Look,
    eye: Eye,
    rasterizer: str,
) -> np.ndarray:
    strengths, viewer = np.array(look.material.strengths, F), np.zeros(3, F)
    common = point, viewer, normal, albedo, strengths, np.ones(3, F)
    if not any(light.shadow or light.is_spot for light in lights):
        rows = light_rows(lights, eye.pose, [None] * len(lights))
        return light_surface(*common, rows, len(rows))
    frames = [view.frame for view in judged.views]
    views, spans = shadow_views(lights, Scene((Node(PointObject(frames)),)).extent)
    columns, side = tiling(views)
    shadow_map = np.ones((-(-len(views) // columns) * side, columns * side), F)
    for k, shadow in enumerate(views):
        own = shadow.eye
        w = key_inverse_depth(_keys(judged, own, np.ones(len(frames)), rasterizer))
        w = w / (F(1) + F(judged.band * PointObject(frames).scale) * w)
        depth = np.round((F(1) - F(own.near) * w).astype(float) * DEPTH_STEPS) / DEPTH_STEPS
        left, top = k % columns * side, k // columns * side
        shadow_map[top : top + side, left : left + side] = depth
    rows = light_rows(lights, eye.pose, spans)
    to_world = eye.pose[:3, :3].astype(F)
    return light_surface_shadowed(*common, rows, len(rows), shadow_map, view_rows(views, eye.pose), to_world)
