"""What visible_point.glsl and resolve_surfaces.frag do around the mirrored functions, for a whole view at once."""

from __future__ import annotations

import numpy as np

from pointshade_gl.scene.camera import Camera

from .color import srgb_to_linear
from .depth_lookup import pixel_of
from .picture import picture_at
from .resolve import Seen, color_position, look_up, mix_light, mix_normal, see_splat, seen_weights
from .splat_corners import Corners
from .vectors import normalize

F = np.float32


def surface_map_of(normals: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """(h, w, 4) float32 from normals (h, w, 3) and depth (h, w), negative at rims."""
    return np.concatenate([normals, depth[..., None]], -1).astype(F)


def seen_by_id(
    ids: np.ndarray,
    rim_depths: np.ndarray,
    surface_map: np.ndarray,
    source: Camera,
    target: Camera,
    view: np.ndarray,
) -> tuple[np.ndarray, Seen]:
    """The pixels of the view that show something, (n, 2) int, and what they show; from `source_ids`."""
    v, u = np.nonzero(ids >= 0)
    target_pixel, pixel = np.stack([u, v], -1), pixel_of(ids[v, u], source.width)
    cameras = np.array(source.intrinsics, F), view, np.array(target.intrinsics, F)
    return target_pixel, see_splat(surface_map, pixel, target_pixel.astype(F), *cameras, rim_depths[v, u])


def seen_by_depth(
    nearest: np.ndarray, surface_map: np.ndarray, source: Camera, target: Camera, view: np.ndarray
) -> tuple[np.ndarray, Seen]:
    """The same from the nearest 1/z, (h, w), 0 where there is nothing."""
    v, u = np.nonzero(nearest)
    target_pixel = np.stack([u, v], -1)
    cameras = np.array(source.intrinsics, F), view, np.array(target.intrinsics, F)
    hidden = np.ascontiguousarray(nearest[v, u]).view(np.uint32) & 1 == 1
    seen = look_up(surface_map, nearest[v, u], hidden, target_pixel.astype(F), *cameras)
    found = seen.own[:, 3] > 0
    return target_pixel[found], some_of(seen, found)


def some_of(seen: Seen, which: np.ndarray) -> Seen:
    """What some of the pixels show; which (n,) bool."""
    at, w, pixel, own = (part[which] for part in seen[:4])
    return Seen(at, w, pixel, own, Corners(*(part[which] for part in seen.corners)))


def surfaces(
    seen: Seen, picture: np.ndarray, source: Camera, view: np.ndarray, light_normals: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Surface (n, 4), unit normal and depth in target axes, and linear albedo (n, 3); picture (h, w, 3|4) 0..1."""
    weight = seen_weights(seen, np.array(source.intrinsics, F))
    calm = None if light_normals is None else normalize(mix_light(seen, weight, light_normals))
    normal = (mix_normal(seen, weight) if calm is None else calm) @ view[:3, :3].T
    encoded = picture_at(picture, color_position(seen, weight), np.array([source.width, source.height], F))
    return np.concatenate([normal, F(1) / seen.inverse_depth[:, None]], -1), srgb_to_linear(encoded)
