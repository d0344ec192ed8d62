"""Mirror of shaders/common/completion.glsl, for n places at once. The candidates, global there, come first: (n, k, 4).

SAME_SIZE of the shader is asked of the sizes themselves.
"""

from __future__ import annotations

import numpy as np

from .texels import texel_at
from .upsample_vote import GUIDE_SPAN, is_cut_out, mean_color
from .vectors import dot

F = np.float32
SIDE, ELECTIONS = 4, 3
AGREES, DISTINCT, MANY, UNLIKE, UNSEEN = F(0.02), F(0.3), F(8), F(0.02), F(0.05)
UNPROVEN, NEARER = F(0.1), F(1.1)


def once_if(share: np.ndarray) -> np.ndarray:
    return np.ceil(share).astype(int)


def agrees(w: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.abs(w - other) < AGREES * other


def supporters_of(candidates: np.ndarray, w: np.ndarray) -> np.ndarray:
    total = np.zeros((len(candidates), 4), F)
    for one in np.moveaxis(candidates, 1, 0):
        weighed = np.concatenate([one[:, 3:] * one[:, :3], one[:, 3:]], -1)
        total += np.where(agrees(one[:, 0], w)[:, None], weighed, F(0))
    return total


def elect(candidates: np.ndarray) -> np.ndarray:
    w, votes = candidates[..., 0], candidates[..., 3]
    winner, most = np.zeros(len(candidates), F), np.zeros(len(candidates), F)
    may_stand = votes > 0
    for _ in range(ELECTIONS):
        strongest = np.where(may_stand, votes, F(0)).argmax(1)
        standing = np.where(may_stand.any(1), np.take_along_axis(w, strongest[:, None], 1)[:, 0], F(0))
        support = supporters_of(candidates, standing)[:, 3]
        winner, most = np.where(support > most, standing, winner), np.maximum(support, most)
        may_stand &= np.abs(standing[:, None] - w) >= DISTINCT * AGREES * standing[:, None]
    return winner


def elected(candidates: np.ndarray, w: np.ndarray) -> np.ndarray:
    total, votes = supporters_of(candidates, w), np.zeros(len(candidates), F)
    for one in np.moveaxis(candidates, 1, 0):
        votes += one[:, 3]
    some = total[:, 3:] > 0
    plane = total[:, :3] / np.where(some, total[:, 3:], F(1))
    share = total[:, 3:] / np.where(some, votes[:, None], F(1))
    return np.where(some, np.concatenate([plane, share], -1), F(0))


def cell_middle(cell: np.ndarray) -> np.ndarray:
    return F(SIDE) * (cell.astype(F) + F(0.5)) - F(0.5)


def moved_plane(plane: np.ndarray, off: np.ndarray) -> np.ndarray:
    return np.concatenate([plane[..., :1] + dot(plane[..., 1:3], off), plane[..., 1:3]], -1)


def candidate_of(plane: np.ndarray, votes: np.ndarray, hidden_below: np.ndarray) -> np.ndarray:
    seen = np.where((hidden_below > 0) & (plane[..., 0] > hidden_below), UNSEEN, F(1))
    return np.concatenate([plane, np.where(plane[..., 0] > 0, votes * seen, F(0))[..., None]], -1)


def color_vote(likeness: np.ndarray) -> np.ndarray:
    return UNLIKE + likeness


def proven_share(likeness: np.ndarray) -> np.ndarray:
    return (UNPROVEN * UNLIKE + likeness) / color_vote(likeness)


def pack_color(color: np.ndarray) -> np.ndarray:
    steps = np.floor(color * F(255) + F(0.5))
    return steps[..., 0] * F(65536) + steps[..., 1] * F(256) + steps[..., 2]


def unpack_color(number: np.ndarray) -> np.ndarray:
    whole = np.asarray(number).astype(int)
    return np.stack([whole >> 16, whole >> 8 & 255, whole & 255], -1).astype(F) / F(255)


def guide_at(color_map: np.ndarray, pixel: np.ndarray, size: np.ndarray) -> np.ndarray:
    """size: (2,), width and height of the surface."""
    opaque = np.ones((len(pixel), 1), F)
    if tuple(size) == color_map.shape[1::-1]:
        there = texel_at(color_map, pixel).astype(F)
        return there if there.shape[-1] == 4 else np.concatenate([there, opaque], -1)
    span = F(GUIDE_SPAN) * F(color_map.shape[1]) / F(size[0])
    at, size = pixel.astype(F), np.asarray(size, F)
    nothing = is_cut_out(color_map, at, size)[:, None]
    return np.concatenate([mean_color(color_map, at, size, span), np.where(nothing, F(0), opaque)], -1)


def hidden_below_at(hidden_map: np.ndarray, pixel: np.ndarray, size: np.ndarray) -> np.ndarray:
    place = (pixel.astype(F) + F(0.5)) * (np.array(hidden_map.shape[1::-1], F) / np.asarray(size, F))
    return texel_at(hidden_map, place.astype(int))
