"""Mirror of shaders/common/surroundings.glsl."""

from __future__ import annotations

import numpy as np

from .vectors import dot, length

F = np.float32
OPEN = F(2) / F(3)
NARROWEST, LEAST = F(0.8), F(0.3)


def pack_visibility(visibility: np.ndarray) -> np.ndarray:
    return np.concatenate([F(0.5) + F(0.5) * visibility[..., :3], np.sqrt(visibility[..., 3:])], -1)


def unpack_visibility(texel: np.ndarray) -> np.ndarray:
    return np.concatenate([F(2) * texel[..., :3] - F(1), texel[..., 3:] ** 2], -1)


def carried_visibility(visibility_map: np.ndarray, at: np.ndarray, size: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Of a map with values of 0 to 1; the filter of the GPU has weights of 8 bits."""
    place = (at + F(0.5)) / size * np.array(visibility_map.shape[1::-1], F) - F(0.5)
    low, last = np.floor(place).astype(int), np.array(visibility_map.shape[1::-1]) - 1
    share = (place - low).astype(F)
    texels = 0
    for y in range(2):
        for x in range(2):
            u, v = np.moveaxis(np.clip(low + np.array([x, y]), 0, last), -1, 0)
            weight = (share[..., :1] if x else 1 - share[..., :1]) * (share[..., 1:] if y else 1 - share[..., 1:])
            texels = texels + weight * visibility_map[v, u]
    visibility = unpack_visibility(texels)
    return np.concatenate([visibility[..., :3] @ turn.T, visibility[..., 3:]], -1)


def environment_light(visibility: np.ndarray, first: np.ndarray, second: np.ndarray, third: np.ndarray) -> np.ndarray:
    """first, second and third: (3, 3), each row a colour."""
    far = np.maximum(length(visibility[..., :3]), F(1e-4))
    mean, d = np.minimum(far, NARROWEST), visibility[..., :3] / far
    wide = np.maximum(F(1.5) * mean / (F(2) - mean) - F(0.5), F(0))
    x, y, z = (d[..., k : k + 1] for k in range(3))
    along = first[1] * x + first[2] * y + second[0] * z
    across = second[1] * (x * y) + second[2] * (y * z) + third[0] * (x * z)
    across = across + third[1] * (F(3) * z * z - F(1)) + third[2] * (x * x - y * y)
    return visibility[..., 3:] * np.maximum(first[0] + mean * along + wide * across, LEAST * first[0])


def highlight_strength(material: np.ndarray) -> np.ndarray:
    return material[..., 2] * F(2) / (material[..., 3] + F(1))


def highlight_visibility(visibility: np.ndarray, mirrored: np.ndarray, shininess: np.ndarray) -> np.ndarray:
    far = np.maximum(length(visibility[..., :3]), F(1e-4))[..., 0]
    opened = np.sqrt(np.clip(F(1) - visibility[..., 3], F(0), F(1)))
    lobe = np.asarray(shininess / (shininess + F(2)), F)
    wide, narrow = np.arccos(opened), np.arccos(lobe)
    apart = np.arccos(np.clip(dot(visibility[..., :3], mirrored)[..., 0] / far, F(-1), F(1)))
    low, high = np.abs(wide - narrow), wide + narrow + F(1e-4)
    t = np.clip((apart - low) / (high - low), F(0), F(1))
    return (F(1) - t * t * (F(3) - F(2) * t)) * np.minimum((F(1) - opened) / (F(1) - lobe), F(1))


def texture_of_lobes(lobe_map: np.ndarray, direction: np.ndarray, lobe: int, lobes: int) -> np.ndarray:
    """Of (lobes * h, w, 4) pictures of the whole sphere."""
    around = np.arctan2(direction[..., 2], direction[..., 0]) / F(6.2831853) + F(0.5)
    down = np.arccos(np.clip(direction[..., 1] / length(direction)[..., 0], F(-1), F(1))) / F(3.14159265)
    height, width = lobe_map.shape[0] // lobes, lobe_map.shape[1]
    column, row = around * F(width) - F(0.5), np.clip(down * F(height), F(0.5), F(height - 0.5)) - F(0.5)
    left, top = np.floor(column).astype(int), np.floor(row).astype(int)
    across, below = (column - left)[..., None].astype(F), (row - top)[..., None].astype(F)
    rows = [lobe * height + np.minimum(top + k, height - 1) for k in (0, 1)]
    mixed = [(1 - across) * lobe_map[r, left % width, :3] + across * lobe_map[r, (left + 1) % width, :3] for r in rows]
    return (1 - below) * mixed[0] + below * mixed[1]


def both_visible(one: np.ndarray, other: np.ndarray, n: np.ndarray) -> np.ndarray:
    certain = np.maximum(length(n), F(1e-4))
    return np.concatenate([one[..., :3] + other[..., :3] - OPEN * n / certain, one[..., 3:] * other[..., 3:]], -1)
