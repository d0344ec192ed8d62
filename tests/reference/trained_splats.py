"""Mirror of shaders/common/trained_splats.glsl, and of the blend of trained splats: EWA in float64, pixel by pixel."""

from __future__ import annotations

import numpy as np

from pointshade_gl.scene.camera import rotation_of
from pointshade_gl.scene.gaussians import harmonics_at

F = np.float32
MOST_OPAQUE = F(0.99)
NEAREST_PAST, SURELY_PAST = F(1), F(3.5)
RIDGE = F(1e-6)
PIXEL_BLUR = F(0.3)


def splat_alpha(opacity: np.ndarray, square: np.ndarray) -> np.ndarray:
    return np.minimum(MOST_OPAQUE, opacity * np.exp(F(-0.5) * square))


def density(area: np.ndarray, most: np.ndarray) -> np.ndarray:
    return area / (np.maximum(area - PIXEL_BLUR, F(0)) / most + PIXEL_BLUR)


def dense_opacity(opacity: np.ndarray, denser: np.ndarray) -> np.ndarray:
    return F(1) - (F(1) - np.minimum(opacity, MOST_OPAQUE)) ** denser


def two_depths(sums: np.ndarray) -> np.ndarray:
    """sums (n, 4); (n, 3)"""
    mean, square, cube = np.moveaxis(sums[:, :3] / sums[:, 3:], -1, 0)
    variance = np.maximum(square - mean * mean, F(0))
    deviation = np.sqrt(variance)
    flat = deviation < 1e-6
    skewness = (cube - F(3) * mean * variance - mean**3) / np.where(flat, F(1), variance * deviation)
    half, root = F(0.5) * skewness, np.sqrt(F(1) + F(0.25) * skewness * skewness)
    low, high = half - root, half + root
    found = np.stack([mean + deviation * low, mean + deviation * high, high / (high - low)], -1)
    return np.where(flat[:, None], np.stack([mean, mean, np.ones_like(mean)], -1), found)


def share_past_splats(seen: np.ndarray, depth: np.ndarray, thickness: np.ndarray) -> np.ndarray:
    """seen (n, 4), depth and thickness (n,); (n,)"""
    steps = ((depth[:, None] - seen[:, :2]) / thickness[:, None] - NEAREST_PAST) / (SURELY_PAST - NEAREST_PAST)
    past = np.clip(steps, 0, 1)
    hidden = past[:, 0] * seen[:, 2] + past[:, 1] * (seen[:, 3] - seen[:, 2])
    return F(1) - hidden**4


def fitted_normal(
    first: np.ndarray, second: np.ndarray, right: np.ndarray, ray: np.ndarray, focal: np.ndarray
) -> np.ndarray:
    """All (n, 3) but the last two, (n, 2); (n, 3)"""
    (a, b, c), (bb, bc, cc) = first.T, second.T
    squares = np.stack([a, b, c, b, bb, bc, c, bc, cc], -1).reshape(-1, 3, 3) + RIDGE * np.eye(3, dtype=F)
    plane = np.linalg.solve(squares, right[..., None])[..., 0]
    aside = plane[:, 1:] * focal
    normal = np.concatenate([aside, plane[:, :1] - (aside * ray).sum(1, keepdims=True)], 1)
    return -normal / np.linalg.norm(normal, axis=1, keepdims=True)


def blended(cloud, camera, pose, before: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """The exact picture of trained splats, the nearest first: sRGB times cover (h, w, 3), and cover (h, w).

    before  (h, w) depth of what hides the splats whose middles lie behind it; 0 is nothing
    """
    held = cloud.gaussians
    at = (cloud.positions + cloud.origin - pose[:3, 3]) @ pose[:3, :3]
    turns = held.rotations / np.linalg.norm(held.rotations, axis=1, keepdims=True)
    arms = pose[:3, :3].T @ (rotation_of(turns.astype(float)) * held.scales[:, None])
    slope = at[:, :2] / at[:, 2:]
    ends = 1.3 * np.array([camera.width / camera.fx, camera.height / abs(camera.fy)]) / 2
    bent, focal = np.clip(slope, -ends, ends), np.array([camera.fx, camera.fy])
    ways = np.zeros((len(at), 2, 3))
    ways[:, [0, 1], [0, 1]] = focal / at[:, 2:]
    ways[:, :, 2] = -focal * bent / at[:, 2:]
    spread = ways @ arms
    own = spread @ spread.transpose(0, 2, 1)
    wide = own + 0.3 * np.eye(2)
    opacity = held.opacities.astype(float)
    if held.antialiased:
        opacity = opacity * np.sqrt(np.maximum(np.linalg.det(own), 0) / np.linalg.det(wide))
    color = held.base.astype(float)
    if held.harmonics is not None:
        way = (cloud.positions + cloud.origin - pose[:3, 3]).T
        shown = harmonics_at(held.degree, way / np.linalg.norm(way, axis=0))
        color = color + np.einsum("kn,nkc->nc", shown, held.harmonics.astype(float))
    middle, inverse = focal * slope + [camera.cx, camera.cy], np.linalg.inv(wide)
    picture, left = np.zeros((camera.height, camera.width, 3)), np.ones((camera.height, camera.width))
    v, u = np.mgrid[: camera.height, : camera.width]
    for k in np.argsort(at[:, 2], kind="stable"):
        if at[k, 2] <= 0.01 or opacity[k] < 1 / 255:
            continue
        off = np.stack([u - middle[k, 0], v - middle[k, 1]], -1)
        square = np.einsum("hwi,ij,hwj->hw", off, inverse[k], off)
        alpha = np.where(square <= 2 * np.log(255 * opacity[k]), np.minimum(0.99, opacity[k] * np.exp(-square / 2)), 0)
        if before is not None:
            alpha = np.where((before > 0) & (at[k, 2] >= before), 0, alpha)
        picture += (left * alpha)[..., None] * np.maximum(color[k], 0)
        left *= 1 - alpha
    return picture, 1 - left
