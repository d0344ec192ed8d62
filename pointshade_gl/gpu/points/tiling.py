"""Divides frames that are too large for the GPU into tiles, and measures once what all tiles share, such as noise."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...estimation.noise_model import BLOCK_PATCHES, PATCH_PITCH, noise_grid
from ...notes.words import option
from ...scene.appearance import SWITCHES, Look
from ...scene.frame import Frame
from ...scene.noise import Noise
from ..core.images import Box

LARGEST_WHOLE = 1 << 25  # points of a frame that is still put on the GPU as a whole: about 0.8 GB
TILE_POINTS = 1 << 24  # of a tile
REACH = 32  # pixels: further than any estimator and any rim looks around a pixel
SEAM = 4  # pixels that neighbouring tiles both draw: colours and normals mix across the border
BLOCK = 4  # tiles begin at multiples of it, as the compute rasteriser merges pixels in blocks of 4x4,
GROUP = 128  # and are as wide as a multiple of it, because it draws so many columns at once
SAMPLE = 192  # pixels on each side of the pieces by which the noise of a frame is measured; with a gap round each
GAP = BLOCK_PATCHES * PATCH_PITCH
PIECES = 6  # of them along each side, at most


class Tile(NamedTuple):
    """A part of a frame.

    box    what is uploaded, pixels of the frame
    drawn  what is drawn of it, pixels of the tile; around it lies what estimators look at
    """

    box: Box
    drawn: Box


def needs_tiles(frame: Frame, look: Look, largest_side: int) -> bool:
    """Return whether a frame is drawn in tiles: it has too many points, or is larger than textures may be.

    A mesh, colours of another size than the depth, and what looks at the frame as a whole are not cut: raises
    ValueError if the depth is too large for that.
    """
    height, width = frame.depth.shape
    is_too_large = max(height, width) > largest_side
    obstacle, remedy = "", ""
    if look.splat == "mesh":
        obstacle, remedy = "a mesh", f"use {option('splat', 'footprint')}"
    elif frame.color is not None and frame.color.shape[:2] != (height, width):
        obstacle, remedy = "colours of another size", "bring them to the depth's size"
    elif whole := [name for name in SWITCHES if getattr(look, name)]:
        obstacle, remedy = option(whole[0]), "leave it out"
    if obstacle and is_too_large:
        raise ValueError(
            f"depth of {width}x{height} is too large for {obstacle} on this GPU ({largest_side}): {remedy}"
        )
    return not obstacle and (is_too_large or frame.depth.size > LARGEST_WHOLE)


def tiles_of(width: int, height: int, largest_side: int) -> list[Tile]:
    """Divide a frame into tiles of one size: as wide as the frame, if textures may be so wide."""
    across = min(width, largest_side)
    down = min(height, largest_side, max(TILE_POINTS // across, 4 * REACH))
    columns = _spans(width, across, (across - 2 * REACH) // GROUP * GROUP - 2 * SEAM)
    rows = _spans(height, down, (down - 2 * REACH) // BLOCK * BLOCK)
    return [
        Tile((left, top, across, down), (u, v, wide, high)) for top, v, high in rows for left, u, wide in columns
    ]  # fmt: skip


def _spans(size: int, tile: int, step: int) -> list[tuple[int, int, int]]:
    """Divide one side: (first pixel of a tile, first that is drawn of it, how many are drawn)."""
    if size <= tile:
        return [(0, 0, size)]
    spans = []
    for first in range(0, size, step):
        start = max(min(first - REACH, size - tile), 0)
        low, high = max(first - SEAM, 0), min(first + step + SEAM, size)
        spans.append((start, low - start, high - low))
    return spans


def cut_frame(frame: Frame, box: Box) -> Frame:
    """Return a part of a frame. Its arrays are views of the whole frame's."""
    (left, top, width, height), part = box, object.__new__(Frame)
    cut = np.s_[top : top + height, left : left + width]
    camera = frame.camera
    camera = replace(camera, cx=camera.cx - left, cy=camera.cy - top, width=width, height=height)
    color = None if frame.color is None else frame.color[cut]
    for name, value in (("color", color), ("depth", frame.depth[cut]), ("camera", camera), ("pose", frame.pose)):
        object.__setattr__(part, name, value)
    return part


def cut_look(look: Look, box: Box) -> Look:
    """Return the look for a part of a frame: options that are arrays are cut, too."""
    left, top, width, height = box
    cut, arrays = np.s_[top : top + height, left : left + width], look.options.items()
    cuts = {name: array[cut] for name, array in arrays if isinstance(array, np.ndarray)}
    return replace(look, **cuts) if cuts else look


def sample_depth(depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return pieces of a large depth image, missing depth between them: enough to measure its noise."""
    rows, columns = (_starts(size) for size in depth.shape)
    sample = np.zeros((len(rows) * (SAMPLE + GAP), len(columns) * (SAMPLE + GAP)), np.float32)
    for j, v in enumerate(rows):
        for k, u in enumerate(columns):
            piece = depth[v : v + SAMPLE, u : u + SAMPLE]
            y, x = j * (SAMPLE + GAP), k * (SAMPLE + GAP)
            sample[y : y + piece.shape[0], x : x + piece.shape[1]] = piece
    return sample


def _starts(size: int) -> NDArray[np.int64]:
    """Return the first pixels of the pieces along one side."""
    count = int(np.clip(size // SAMPLE, 1, PIECES))
    return np.linspace(0, max(size - SAMPLE, 0), count).astype(np.int64)


def noise_in(box: Box, noise: Noise, shape: tuple[int, ...]) -> Noise:
    """Return the noise in a tile, from that of its frame's `sample_depth`: its grid between the pieces."""
    if noise.grid is None:
        return noise
    inside, blocks = SAMPLE // GAP, SAMPLE // GAP + 1
    pieces = noise.grid.reshape(noise.grid.shape[0] // blocks, blocks, noise.grid.shape[1] // blocks, blocks, 3)
    levels = np.median(pieces[:, :inside, :, :inside], axis=(1, 3))
    counts, first = noise_grid(*box[2:])
    across, down = (
        _between(box[axis] + first[axis] + GAP * (np.arange(counts[axis]) + 0.5), shape[1 - axis]) for axis in (0, 1)
    )
    return replace(noise, grid=np.einsum("rj,jkc,sk->rsc", down, levels, across).astype(np.float32))


def _between(places: NDArray[Any], size: int) -> NDArray[np.float64]:
    """Return (n, pieces) interpolation weights of the pieces along one side, at each place."""
    middles = _starts(size) + SAMPLE / 2
    return np.stack([np.interp(places, middles, one) for one in np.eye(len(middles))], -1)
