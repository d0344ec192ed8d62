"""The chain of gpu/surface/surface_normals.py for "auto" and "adaptive" on the CPU, around the mirrored functions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pointshade_gl.estimation.noise_model import (
    BLOCK_PATCHES,
    COARSE,
    find_bumps,
    find_noise,
    flat_grid,
    given_noise,
    noise_grid,
)
from pointshade_gl.scene.noise import Noise, NoiseWords

from .bumpy_planes import bumpy_plane, bumpy_surface, is_bumpy_plane, widest_bumpy_window, window_bumps
from .depth_average import average_pairs
from .flat_cells import flat_middle, flat_plane, flat_surface, widest_window
from .flying_pixels import flying_step
from .inverse_depth import normal_of_slope, pixel_grid, start
from .noise_levels import block_counts, block_quantile, indices, noise_at, patch_corner
from .noise_patch import noise_patch
from .noise_structure import structure_patch
from .normal_variance import known_pixel, steepest_variance, surface_beside, tilt_variance
from .normals_adaptive import estimate_adaptive
from .normals_star import estimate_star
from .toksvig import WANDERING, normal_certainty
from .upsampling_artifacts import add_misplaced, count_copies, misplaced_noise

F = np.float32
CELL = 16  # as in gpu/core/frame_textures.py


def noise_blocks(depth_map: np.ndarray, stride: int) -> tuple[np.ndarray, np.ndarray]:
    """The results of noise_patches.frag and noise_blocks.frag: levels and counts, (rows, columns, 4) each."""
    (columns, rows), first = noise_grid(*depth_map.shape[::-1])
    at = patch_corner(indices(columns * BLOCK_PATCHES, rows * BLOCK_PATCHES), first, stride)
    patches, steps = noise_patch(depth_map, at, stride)
    copies = count_copies(depth_map, at, (1, 0)) + count_copies(depth_map, at, (0, 1)) if stride > 1 else 0 * steps
    steps = np.concatenate([steps, copies], -1)
    block = indices(columns, rows)
    quantiles = ((0, 0.25), (1, 0.25), (2, 0.5), (3, 0.25))
    levels = np.stack([block_quantile(patches, block, which, share) for which, share in quantiles], -1)
    return levels, block_counts(patches, steps, block)


def structure_blocks(depth_map: np.ndarray) -> np.ndarray:
    """The levels of noise_structure.frag and noise_blocks.frag, (rows, columns, 4)."""
    (columns, rows), first = noise_grid(*depth_map.shape[::-1])
    u, v = patch_corner(indices(columns * BLOCK_PATCHES, rows * BLOCK_PATCHES), first, 1)
    patches, block = structure_patch(depth_map, (u + 1, v + 1)), indices(columns, rows)
    noise, *rings = (block_quantile(patches, block, which, share) for which, share in ((0, 0.25), (2, 0.5), (3, 0.5)))
    return np.stack([noise, np.zeros_like(noise), *rings], -1)


def measure_noise(depth_map: np.ndarray, focal: float) -> Noise:
    coarse, structure = lambda: noise_blocks(depth_map, COARSE), lambda: structure_blocks(depth_map)
    noise = find_noise(*noise_blocks(depth_map, 1), focal, coarse, structure)
    if not noise.may_be_bumpy:
        return noise
    cells, first = flat_grid(*depth_map.shape[::-1])
    return replace(noise, bumps=find_bumps(window_bumps(depth_map, flat_middle(indices(*cells), first)), noise))


def surface_by_noise(
    depth_map: np.ndarray, intrinsics: np.ndarray, told: np.ndarray | NoiseWords | None = None, flying: str = "keep"
) -> np.ndarray:
    """Unit normal and depth by "auto", (h, w, 4) float32, 0 where depth is missing.

    told    the caller's noise, (1, 1) or (h, w) metres, or in words
    flying  as in Appearance
    """
    focal = (abs(intrinsics[0]) + abs(intrinsics[1])) / 2
    if isinstance(told, NoiseWords):
        noise, told = given_noise(told, noise_grid(*depth_map.shape[::-1])[0][::-1]), None
    else:
        noise = measure_noise(depth_map, focal)
    pixel = pixel_grid(depth_map)
    if told is None and noise.is_clean:
        normals = estimate_star(depth_map, pixel, intrinsics, 0.0)[..., :3]
        return np.concatenate([normals, np.where(normals.any(-1), depth_map, F(0))[..., None]], -1)
    first = noise_grid(*depth_map.shape[::-1])[1]
    known = depth_map > 0
    z = np.where(known, depth_map, F(1))
    grid = np.zeros((1, 1, 3), F) if noise.grid is None else noise.grid * np.array([told is None, 1, 1], F)
    relative, shared = noise_at(grid, pixel, first, z, noise.powers)
    if told is not None:
        shared = np.where(told / z > relative, F(0), shared)
        relative = np.maximum(told / z, relative)
    if noise.misplaced > 0:
        moved = misplaced_noise(depth_map, pixel, z, noise.misplaced)
        relative, shared = add_misplaced((relative, shared), moved)
    calm = average_pairs(depth_map, pixel, relative, shared)
    if flying == "snap":
        step = flying_step(depth_map, pixel, z, relative, focal)
        flies = known & (step != 0)
        calm = np.where(flies[..., None], np.stack([z / (F(1) + step), relative], -1), calm)
    if noise.bumps and told is None:
        return bumpy_surfaces(depth_map, calm, F(noise.bumps), intrinsics)
    surface = estimate_adaptive(calm, pixel, intrinsics)
    if not noise.is_rounded:
        return surface
    flat = flat_surfaces(depth_map, noise, intrinsics)
    return np.where(flat[..., 3:] > 0, flat, surface)


def bumpy_surfaces(depth_map: np.ndarray, calm: np.ndarray, bumps: np.float32, intrinsics: np.ndarray) -> np.ndarray:
    """The surface of bumpy_windows.frag, normals_bumpy.frag and normals_adaptive.frag. calm: from average_pairs."""
    cells, first = flat_grid(*depth_map.shape[::-1])
    cell, pixel = indices(*cells), indices(*depth_map.shape[::-1])
    windows = widest_bumpy_window(depth_map, flat_middle(cell, first), bumps)
    planes = bumpy_surface(bumpy_plane(windows, depth_map, cell, first, bumps), calm[..., 0], pixel, first)
    surface = estimate_adaptive(calm, pixel_grid(depth_map), intrinsics, planes)
    whole = (planes[..., 3] >= 1) & is_bumpy_plane(calm[..., 0], pixel, planes[..., :3], bumps)
    return np.where(whole[..., None], np.concatenate([surface[..., :3], planes[..., :1]], -1), surface)


def flat_surfaces(depth_map: np.ndarray, noise: Noise, intrinsics: np.ndarray) -> np.ndarray:
    """The surface of flat_cells.frag and normals_flat.frag, (h, w, 4) float32, 0 where they leave it to others."""
    (cells, first), rounding = flat_grid(*depth_map.shape[::-1]), [F(step) for step in noise.rounding]
    cell = indices(*cells)
    planes = widest_window(depth_map, flat_middle(cell, first), rounding)
    planes = flat_plane(planes, depth_map, cell, first, rounding)
    plane = flat_surface(planes, depth_map, indices(*depth_map.shape[::-1]), first, rounding)
    _, _, ray, focal = start(depth_map, pixel_grid(depth_map), intrinsics)
    normals = normal_of_slope((plane[..., 1], plane[..., 2]), ray, focal)
    return np.where(plane[..., 3:] > 0, np.concatenate([normals, plane[..., :1]], -1), F(0))


def certainty_by_noise(surface_map: np.ndarray, noise: Noise, intrinsics: np.ndarray) -> np.ndarray | None:
    """How certain the normals of `surface_by_noise` are, as `normal_certainty.frag` finds it.

    (rows, columns) float32 in steps of 16 bits, one for 16x16 pixels; None without noise.
    """
    if noise.grid is None:
        return None
    size = np.array(surface_map.shape[1::-1])
    columns, rows = -(-size // CELL)
    cell = np.stack(indices(columns, rows), -1).reshape(-1, 2)
    pixel = ((cell.astype(F) + F(0.5)) / np.array((columns, rows), F) * size.astype(F)).astype(int)
    pixel = known_pixel(surface_map, pixel)
    first, depth = noise_grid(*size)[1], np.maximum(surface_beside(surface_map, pixel)[:, 3], F(1e-30))
    found = np.stack(noise_at(noise.grid, (pixel[:, 0], pixel[:, 1]), first, depth, noise.powers), -1)
    variance = np.minimum(tilt_variance(surface_map, pixel, intrinsics), steepest_variance(found, intrinsics))
    return (np.round(normal_certainty(WANDERING * variance) * F(65535)) / F(65535)).reshape(rows, columns)
