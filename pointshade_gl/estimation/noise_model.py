"""Estimates the noise and the rounding of a depth image from statistics of its blocks, and keeps them in a stream."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scene.noise import FEW, Noise, NoiseWords

PATIENCE = 3  # frames in a row that must differ, unless they differ clearly
CLEARLY = 5.0  # times FEW, or a fifth of it
STREAMS = 64  # that are remembered


class Decisions:
    """Keeps, for each stream, the noise estimate in use, and how many frames in a row have contradicted it."""

    def __init__(self) -> None:
        self._kept: dict[Hashable, tuple[Noise, int]] = {}

    def settle(self, stream: Hashable, measured: Noise) -> Noise:
        """Return the noise to use for the next frame of a stream, on which `measured` was found."""
        noise, doubts = self._kept.pop(stream, (measured, 0))
        doubts = 0 if _kind(measured) == _kind(noise) else doubts + 1
        # a change between clean and noisy is beyond doubt if the new frame lies far on the other side
        is_far = measured.share < FEW / CLEARLY if measured.is_clean else measured.share > FEW * CLEARLY
        is_clear = measured.is_clean != noise.is_clean and is_far
        if doubts == 0 or doubts >= PATIENCE or is_clear:
            noise, doubts = measured, 0
        self._kept[stream] = noise, doubts
        if len(self._kept) > STREAMS:
            del self._kept[next(iter(self._kept))]
        return noise


def _kind(noise: Noise) -> tuple[Any, ...]:
    """Return the properties of noise on which neighbouring frames of a stream must agree."""
    return noise.is_clean, noise.domain, noise.misplaced > 0, noise.is_shared, noise.bumps > 0


Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Noise is as large between near pixels as between distant ones; structure grows with their distance. Growth here is
# that of third differences (of the level) and of ring residuals, from neighbours to pixels 3 apart, and from ring
# to wider ring. White noise has 1 for both, noise that neighbours share up to 3 and 1.8.
GROWN, PARTLY_GROWN, RING_GROWN = 2.5, 1.75, 1.75  # the first alone, or the others together
WEAK_GROWN, WEAK_RING = 1.7, 1.45  # both together, beside blocks that are certain
SHARED_RING = 1.25  # from here on, what grows with distance is not noise that neighbours share
# Rounded depth comes from sensors, whose neighbours do share noise: only rings count, and more of them are needed.
ROUNDED_RING, ROUNDED_WEAK_RING = 2.2, 1.8
FRAME_RING, FRAME_GROWN, FRAME_COARSE = 2.05, 3.6, 4.5  # medians of a rounded frame that is busy everywhere: the first
# alone, or the weak one and another; the last is the growth to COARSE pixels
NOTHING = 1e-30  # the quantiles of noise_levels.glsl are never exactly zero
MOSTLY = 0.5  # share of certain blocks from which on the weak evidence is enough everywhere


class Structure(NamedTuple):
    """Where depth varies by fine structure, not by noise; (rows, columns) of blocks each."""

    found: Mask  # blocks that hold structure: their own level is not that of the noise
    uneven: Mask  # blocks where growth with distance is structure, not noise that neighbours share
    noise: Array  # share of the level measured between neighbours that is noise, 0 to 1


def neighbours3(values):
    """Return (9, rows, cols): every cell of a grid with its 8 neighbours, the border repeated."""
    padded = np.pad(values, 1, mode="edge")
    rows, cols = values.shape
    return np.stack([padded[i : i + rows, j : j + cols] for i in range(3) for j in range(3)])


def median3(values: Array, known: Mask) -> Array:
    """Return the 3x3 median of a grid (rows, cols); cells that are not known count as the median of all."""
    filled = np.where(known, values, np.median(values[known]) if known.any() else 0.0)
    return np.partition(neighbours3(filled), 4, axis=0)[4]


def find_structure(near: Array, levels: Array, coarse: Array, rounded: bool, hidden: Mask) -> Structure:
    """Return which blocks of a frame hold structure.

    near    (rows, columns) quartile of the noise of w between neighbours, negative where it could not be measured;
            coarse the same between pixels COARSE apart
    levels  (rows, columns, 4) from noise_blocks.frag with MEASURED 2
    hidden  blocks where rounding or repeated lines would hide structure
    """
    far, ring, far_ring = (levels[..., k] for k in (0, 2, 3))
    known = np.minimum(np.minimum(near, far), np.minimum(ring, far_ring)) > NOTHING
    grown, ring_grown = _growth(near, far, known), _growth(ring, far_ring, known)
    asked = (near > NOTHING) & ~hidden
    if rounded:
        seen = known & asked
        both = seen & (coarse >= 0)
        growths = ring_grown[seen], grown[seen], coarse[both] / near[both]
        ring, third, far_third = (float(np.median(values)) if values.size else 0.0 for values in growths)
        busy = ring > FRAME_RING or (ring > WEAK_RING and (third > FRAME_GROWN or far_third > FRAME_COARSE))
        certain = ring_grown > (WEAK_RING if busy else ROUNDED_RING)
        likely, uneven = ring_grown > (WEAK_RING if busy else ROUNDED_WEAK_RING), np.full(known.shape, busy)
    else:
        certain = (grown > GROWN) | (grown > PARTLY_GROWN) & (ring_grown > RING_GROWN)
        likely, uneven = (grown > WEAK_GROWN) & (ring_grown > WEAK_RING), ring_grown > SHARED_RING
    certain, likely, uneven = certain & known & asked, (likely | ~known) & asked, uneven & known & asked
    beside = neighbours3(certain).any(0) | (np.count_nonzero(certain) > MOSTLY * np.count_nonzero(known & asked))
    found = certain | likely & beside
    left = np.sqrt(np.clip((GROWN**2 - grown**2) / (GROWN**2 - 1), 0, 1))
    return Structure(found, found | uneven, np.where(uneven & (not rounded), left, 1.0))


def _growth(near: Array, far: Array, known: Mask) -> Array:
    ratio = np.where(known, far, 1.0).astype(np.float64) / np.where(known, near, 1.0)
    return np.exp(median3(np.log(ratio), known))


PATCH_PITCH, BLOCK_PATCHES = 8, 6  # pixels between patches, patches along a block: as in noise_levels.glsl
FLAT_CELL = 9  # pixels, as in flat_cells.glsl

QUARTILE = 0.31864  # a quarter of |N(0, 1)| lies below
STAR_GAIN = 0.45  # tilt of the edge-exact estimator in radians per sigma / depth times focal length in pixels
MARGIN = 1.1  # factor on the level: plane fits fail if the noise is underestimated; overestimating costs little
WORTH = np.radians(0.1)  # less tilt than this is not worth the second estimator
LATTICE_VOTES = 0.2  # share of the blocks that must find a lattice of depths, and how well their quartiles must agree
LATTICE_SPREAD = 0.02
LATTICE_ALIKE = 0.5  # share of the votes that must agree; or all but some are a multiple, up to LATTICE_REACH, of few
LATTICE_FITS, LATTICE_REACH = 0.9, 10
JUMP_SHARE = 0.01  # a frame counts as rounded if this share of its patches has an isolated jump
# Steps per pixel: up to the first, a neighbourhood shares its rounding error; from the second on, errors are random.
FULL_WIDTH, NO_WIDTH = 0.1, 0.5
# Noise of random rounding errors in steps: 1 / sqrt(12), and a third more because they are not normally distributed.
ROUNDED = 1.3 / np.sqrt(12)
ROUNDED_STRUCTURE = 0.8 / np.sqrt(12)  # the same amid structure, where edges are worth more than calm
PLATEAU_STEPS, PLATEAU_VOTES = 1.5, 0.64  # steps of a lattice between its plateaus, in so many blocks that have some
# Depth interpolated after 1 / z was rounded has parts of a step, too: in more than so many blocks that have steps, and
# of all blocks; filtered noise has such jumps in fewer. Stairs of real surfaces are as unequal, but rare along a line.
PARTS_VOTES, PARTS_BLOCKS = 0.6, 0.1
WHOLE = 0.9  # quantile of the parts that is a whole step: no part is larger
ALIKE = 0.25  # median deviation of the logarithm up to which steps count as equal
MATCHED = 0.5  # least shared noise of depth from disparity: windows are matched, and windows of neighbours overlap
FEWEST_CREDIBLE = 0.3  # share of the blocks without structure that suffice for the noise of the others
COARSE = 7  # pixels, more than the 5x5 that are averaged: noise that neighbours share shows only at such a distance
# By these factors noise may grow from neighbours to COARSE pixels without proving that neighbours share noise. For the
# lower quartile of a frame, noise is overestimated by as much anyway. For a single block, structure of the block's size
# adds as much, because third differences let such structure pass.
FRAME_GROWTH, BLOCK_GROWTH = MARGIN, 2.0
STRUCTURE = 2.0  # a block may have this many times the shared noise of the frame
COPY_BLOCKS = 0.2  # share of the blocks that must show whether lines are repeated; some edges only look so
COPY_SHARE = 0.1  # share of repeated lines, in most blocks: enlarged or moved pictures repeat lines everywhere


def noise_grid(width: int, height: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return ((columns, rows) of the blocks, (u, v) of the first pixel of the first patch), centred on the picture."""
    block = PATCH_PITCH * BLOCK_PATCHES
    blocks = tuple(max(1, (n + block // 2) // block) for n in (width, height))
    return blocks, tuple((n - (b * block - PATCH_PITCH + 4)) // 2 for n, b in zip((width, height), blocks, strict=True))


def flat_grid(width: int, height: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return ((columns, rows) of the cells of flat_cells.glsl, (u, v) of the first's middle), centred likewise."""
    # the middles of the first and the last cell lie outside
    sizes = [(n, (n - 1) // FLAT_CELL + 2) for n in (width, height)]
    columns, rows = (cells + (n - cells) % 2 for n, cells in sizes)
    u, v = ((n - 1 - FLAT_CELL * (cells - 1)) // 2 for n, cells in ((width, columns), (height, rows)))
    return (columns, rows), (u, v)


def lattice_step(lattice: Array, seen: NDArray[np.bool_]) -> float:
    """Return the step between the depths of a 16-bit picture, or 0.0 if they do not lie on a lattice.

    lattice: (rows, columns) step of each block, not above 0 where it has none; seen: whether it has depth
    """
    votes = np.sort(lattice[lattice > 0])
    if votes.size < max(LATTICE_VOTES * np.count_nonzero(seen), 2):
        return 0.0
    middle = votes[votes.size // 2]
    if np.count_nonzero(np.abs(votes / middle - 1) < LATTICE_SPREAD) > LATTICE_ALIKE * votes.size:
        return float(middle)
    times = votes / votes[votes.size // 10]
    whole = np.maximum(np.round(times), 1)
    near = whole <= LATTICE_REACH
    fits = near & (np.abs(times - whole) < LATTICE_SPREAD * whole)
    if np.count_nonzero(fits) < LATTICE_FITS * np.count_nonzero(near):
        return 0.0
    return float(np.median(votes[fits] / whole[fits]))


def plateau_step(levels: Array, counts: Array, jumps: NDArray[np.bool_], step_z: float) -> tuple[float, str]:
    """Return (step, domain) of the plateaus: the lattice of z, or steps of equal size in 1 / z or in z."""
    jump_w, density, z = levels[..., 2][jumps], counts[..., 2][jumps], counts[..., 3]
    jump_z = jump_w * z[jumps] ** 2
    if step_z:
        # Where plateaus of a lattice lie several of its steps apart, 1 / z was rounded before.
        apart = jump_z > PLATEAU_STEPS * step_z
        votes = np.count_nonzero(apart)
        if votes > PLATEAU_VOTES * apart.size and _spread(jump_w[apart]) < ALIKE:
            return float(np.median(jump_w[apart])), "1/z"
        many = votes > PARTS_VOTES * apart.size and votes > PARTS_BLOCKS * np.count_nonzero(z > 0)
        if many and np.median(density[apart]) > NO_WIDTH:
            return float(np.quantile(jump_w[apart], WHOLE)), "1/z"
        return step_z, "z"
    spread_w, spread_z = _spread(jump_w), _spread(jump_z)
    if min(spread_w, spread_z) > ALIKE:
        return 0.0, ""
    return (float(np.median(jump_w)), "1/z") if spread_w <= spread_z else (float(np.median(jump_z)), "z")


def _spread(values: Array) -> float:
    return float(np.median(np.abs(np.log(values / np.median(values)))))


def shared_noise(far: Array, seen: Array, near: Array, known: NDArray[np.bool_]) -> Array:
    """Return, per block (rows, columns), the noise that neighbouring pixels share, divided by `near`.

    far    noise of w = 1/z measured between pixels COARSE apart; seen: between neighbours, which do not show a rounding
           or matching error that both have; near: from which the averaging starts
    known  blocks in which all of these were measured
    """
    far, seen = (np.where(known, x / np.maximum(near, 1e-30), 0) ** 2 for x in (far, seen))
    block = median3(far - BLOCK_GROWTH**2 * seen, known)
    frame = np.quantile((far - FRAME_GROWTH**2 * seen)[known], 0.25) if known.any() else 0.0
    # A block far above the calmest quarter of the frame holds structure, not noise: curved surfaces differ over COARSE.
    return np.sqrt(np.maximum(np.maximum(np.minimum(block, STRUCTURE**2 * frame), frame), 0))


def misplaced_pixels(copied: Array) -> float:
    """Return by how many pixels (standard deviation) depths are displaced, as in enlarged pictures.

    copied: (rows, columns) share of lines that repeat their neighbour, below 0 where no line can show it
    """
    votes = copied[copied >= 0]
    if votes.size < max(COPY_BLOCKS * copied.size, 2) or np.median(votes) < COPY_SHARE:
        return 0.0
    if np.quantile(votes, 0.25) < COPY_SHARE / 2:  # whole lines are repeated: so nearly all blocks must show it
        return 0.0
    # A line of the original picture covers 1 / (1 - share) lines of this one. The nearest of them is off by up to half
    # of that, all distances being equally likely.
    return float(1 / (1 - min(np.median(votes), 0.75)) / np.sqrt(12))


def noise_power(z: Array, sigma_z: Array) -> float:
    """Return the power of z with which the noise sigma_z of depth grows, 0 to 2; 1 if the picture does not show it."""
    if z.size < 6:
        return 1.0
    log_z, log_sigma = np.log(z), np.log(sigma_z)
    log_z = log_z - log_z.mean()
    prior = 0.0025 * z.size  # spread of 5 % in depth
    return float(np.clip((log_z @ (log_sigma - log_sigma.mean()) + prior) / (log_z @ log_z + prior), 0, 2))


def find_noise(
    levels: Array, counts: Array, focal: float, measure_coarse: Callable[[], tuple[Array, Array]],
    measure_structure: Callable[[], Array],
) -> Noise:  # fmt: skip
    """Estimate the Noise of a frame from the statistics of its blocks.

    levels  (rows, columns, 4) float32 from noise_blocks.frag; channels: lower quartile of the noise in w = 1/z (below 0
            where unknown), the same in z, median isolated jump in w, step of the lattice on which z lies
    counts  (rows, columns, 4) float32 from noise_blocks.frag; channels: share of lines that repeat their neighbour,
            share of patches with an isolated jump, rounding steps per pixel along the gradient, mean depth (0 where
            missing)
    focal   mean focal length, pixels
    measure_coarse     measures levels and counts again, between pixels COARSE apart; called only for noisy frames
    measure_structure  measures the levels that distinguish structure from noise; called only for noisy frames
    """
    z = counts[..., 3].astype(np.float64)
    seen = z > 0
    blocks = max(np.count_nonzero(seen), 1)
    z = np.where(seen, z, 1.0)
    measured = levels[..., 0] >= 0
    raw = np.where(measured, levels[..., 0], 0.0) / QUARTILE
    worth = WORTH / (STAR_GAIN * focal)
    step_z = lattice_step(levels[..., 3], seen)
    jumps = (counts[..., 1] > 0) & (counts[..., 2] < 0.9) & seen
    plateaus = (counts[..., 1] * jumps).sum() > JUMP_SHARE * blocks
    if not step_z and not plateaus and np.count_nonzero(raw * z > worth) < 0.01 * blocks:
        of_z, of_w = (raw * z * z).ravel(), (raw * z).ravel()
        of_z.sort()
        of_w.sort()
        return Noise(float(of_z[z.size // 2]), float(of_w[z.size // 2]), 0.0, "", 0.0, 0.0, 0.0, None, (0.0, 0.0))

    coarse_levels, coarse_counts = measure_coarse()
    misplaced = misplaced_pixels(coarse_counts[..., 0])
    # Where lines are repeated, isolated jumps are the slope of the surface, not rounding.
    plateaus = plateaus and not misplaced
    step, domain = plateau_step(levels, counts, jumps, step_z) if plateaus else (step_z, "z" if step_z else "")
    density = median3(counts[..., 2], seen)
    # Steps of 1 / z come from matched windows: noise that neighbours share, which looks like structure.
    hidden = np.full(z.shape, misplaced > 0 or domain == "1/z") | (plateaus & (density < NO_WIDTH))
    structure = find_structure(levels[..., 0], measure_structure(), coarse_levels[..., 0], step > 0, hidden)
    level, power = noise_level(levels, z, measured, structure, worth)
    powers = (power - 1, -1.0 if domain == "z" else 1.0)

    local = np.full_like(z, step)
    if plateaus:
        own = jumps & (counts[..., 1] > 0.15) & (density < NO_WIDTH)
        local = median3(np.where(own, np.maximum(step, levels[..., 2] * z ** (1 - powers[1])), step), seen)
    local = np.maximum(local, step_z * z ** (-1 - powers[1]))
    t = np.clip((NO_WIDTH - density) / (NO_WIDTH - FULL_WIDTH), 0, 1)
    random = np.where(structure.uneven, ROUNDED_STRUCTURE, ROUNDED)
    plateau = (random + (1 - random) * t * t * (3 - 2 * t)) * local
    relative = np.maximum(level * z ** powers[0], plateau * z ** powers[1])
    far = coarse_levels[..., 0] / QUARTILE
    both = measured & (far >= 0) & (relative > worth) & ~structure.uneven
    shared = shared_noise(far, raw, relative / z, both)
    if step_z and domain == "1/z":
        shared = np.maximum(shared, MATCHED)
    shared = np.where(structure.uneven, 0.0, shared)
    correlation = float(np.median(shared[both])) if both.any() else 0.0
    share = float((relative[seen] > worth).mean())
    grid = np.stack([MARGIN * level, plateau, shared], -1).astype(np.float32)
    sigma, middle = float(np.median((relative * z)[seen])), float(np.median(relative[seen]))
    return Noise(sigma, middle, step, domain, correlation, misplaced, share, grid, powers)


def noise_level(levels: Array, z: Array, measured: Mask, structure: Structure, worth: float) -> tuple[Array, float]:
    """Return (level of each block, power p): noise / z = level * z**(p - 1)."""
    in_w = np.log(np.maximum(np.where(measured, levels[..., 0], 0) / QUARTILE, 1e-30))
    in_z = np.log(np.maximum(levels[..., 1] / QUARTILE, 1e-30))
    credible = measured & ~structure.found
    noisy = credible & (np.exp(in_w) * z > 1e-6)
    power = noise_power(z[noisy], np.exp(in_z[noisy]))
    if np.count_nonzero(credible) < FEWEST_CREDIBLE * np.count_nonzero(measured) or not credible.any():
        return np.zeros_like(z), power
    own = (1 - power / 2) * in_z + power / 2 * in_w
    level = np.exp(median3(own + np.log(np.maximum(structure.noise, 1e-30)), credible))
    # Structure adds to a block's own level: such a block has the noise of the others, or less.
    level = np.where(structure.found, np.minimum(level, np.exp(own)), level)
    # If noise begins inside a block, its quartile still looks clean: so calm blocks beside noisy ones count as noisy.
    calm = (level * z ** (power - 1) < worth) & ~structure.found
    return np.where(calm, neighbours3(level).max(0), level), power


def given_noise(words: NoiseWords, shape: tuple[int, ...]) -> Noise:
    """Return the Noise that the caller's words describe, the same in all blocks of a grid of this shape."""
    powers = (0.0 if words.is_share else -1.0, 1.0 if words.domain == "1/z" else -1.0)
    grid = np.empty((*shape, 3), np.float32)
    grid[:] = MARGIN * words.level, ROUNDED * words.step, words.shared
    share = 1.0 if words.level else 0.0
    sigma, relative = (0.0, words.level) if words.is_share else (words.level, 0.0)
    shared, misplaced, bumps = words.shared, words.repeated, words.bumps
    return Noise(sigma, relative, words.step, words.domain, shared, misplaced, share, grid, powers, bumps)


LATERAL = 0.8  # pixels by which depths are displaced, as in bumpy_planes.glsl
STEEP = 0.7  # share of the deviation from which on it may be all displacement
SHAPELESS = 4.0  # shape up to which a window shows a plane; noise has 1 to 5
GROWN_ON_PLANES = 2.0  # on a plane, a window of twice the width deviates less than so many times more
FEWEST, FEWEST_SHARE = 20, 0.12  # such windows, and their share of all: sensors .21 to .54, rough rock up to .07
CALM = 0.1  # the quantile of their deviations: all that are no plane deviate more
LARGEST = 4.0  # times the noise between near pixels that bumps may be: sensors .6 to 2; shelves 40
SHARED = 0.75  # correlation of near pixels from which on bumps may exceed steps: sensors 1 and more, stairs 0 to .5
LONELY = 0.8  # steps that bumps may be where near pixels share less: larger ones would be shared
ROUNDED_STEPS = 0.33  # steps up to which rounding alone deviates: 0.29, if errors are random


def find_bumps(windows: NDArray[np.float32], noise: Noise) -> float:
    """Return the standard deviation of w = 1/z about the planes of a frame, 0.0 if it shows none or no bumps on them.

    windows  (rows, columns, 4) from bumpy_windows.frag with MEASURE: deviation of w in a window, negative where samples
             are missing, and in one twice as wide; shape; slope of w per pixel
    noise    of the frame
    """
    wide, far, shape, slope = np.moveaxis(windows.astype(np.float64), -1, 0)
    lateral = LATERAL * slope
    flat = (wide > 0) & (shape < SHAPELESS) & (far < GROWN_ON_PLANES * wide)
    if np.count_nonzero(flat) < max(FEWEST, FEWEST_SHARE * np.count_nonzero(wide > 0)):
        return 0.0
    facing = flat & (lateral < STEEP * wide)
    used = facing if np.count_nonzero(facing) >= FEWEST else flat
    own = np.sqrt(np.maximum(wide**2 - lateral**2, (1 - STEEP) ** 2 * wide**2))[used]
    bumps = float(np.quantile(own, CALM))
    near = noise.relative**2 * np.hypot(1, noise.correlation) / max(noise.sigma, 1e-30)
    rounded = noise.domain == "1/z" and bumps < ROUNDED_STEPS * noise.step
    lonely = noise.correlation < SHARED and bumps > LONELY * noise.step
    return 0.0 if rounded or lonely or bumps > LARGEST * near else bumps
