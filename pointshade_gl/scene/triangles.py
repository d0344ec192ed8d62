"""Triangles of a frame's pixels, cut at depth edges, and the scene of textured meshes that lit frames make."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .camera import Camera, shortest_turn
from .cloud import Up
from .frame import Frame
from .graph import Scene
from .node import Node
from .noise import Step
from .objects import Mesh

SAME_SURFACE = 0.02  # a neighbour off the plane by more than this share of 1/z is another surface
STEEPEST = 10.0  # tangent of the steepest slope of a surface
ROUGH = 0.4  # tangent by which slopes differ from pixel to pixel: from here on they are smoothed
WINDOW = (1, 2, 4)  # pixels between those whose mean is taken, one round each
EVEN = 1e-3  # share of 1/z by which the slopes of two sides may differ and count the same
MOST_PIXELS = 1_600_000  # of a mesh: all of a picture of 1280x960
BLEED = 4  # pixels by which a texture goes on where nothing is known, for who takes the mean of some
TO_GLTF = np.array([1.0, -1.0, -1.0], np.float32)  # axes of a camera
Floats = NDArray[np.float32]
Flags = NDArray[np.bool_]
Part = tuple[slice, slice]


class CutVertices(NamedTuple):
    """Vertices of triangles, each beside a pixel of a grid."""

    at: NDArray[np.intp]  # (n,) the pixel's number
    place: Floats  # (n, 3) how far it is from the pixel's middle to the right and down, steps of the grid; and its 1/z


class TriangleSurface(NamedTuple):
    """Vertices of a frame in the axes of a glTF camera, (n, 3) and (n, 2), and the (m, 3) corners of its triangles."""

    positions: Floats
    normals: Floats
    uv: Floats
    faces: NDArray[np.uint32]


def frame_surface(
    frame: Frame, most: int, step: Step | None = None, normals: Floats | None = None, whole: bool = False
) -> TriangleSurface:
    """Return the triangles between pixels that lie on one surface, and their corners.

    Of pictures with more pixels than `most` each second is left out, or more. step: see `Appearance.depth_step`;
    normals (h, w, 3), camera axes: in place of those of the depth. whole: at edges each pixel keeps its whole square,
    which goes on as its surface does; else surfaces end at the middles of their pixels.
    """
    every = max(1, math.ceil(math.sqrt(frame.depth.size / most)))
    v, u = np.mgrid[every // 2 : frame.depth.shape[0] : every, every // 2 : frame.depth.shape[1] : every]
    z = frame.depth[v, u]
    w = np.divide(1, z, out=np.zeros_like(z), where=z > 0)
    focal = abs(frame.camera.fx * frame.camera.fy) ** 0.5 / every
    right, down = _slopes(w), _slopes(w.T).T
    if (noise := _unevenness(w)) * focal > ROUGH:
        right, down = _smoothed(w, right, down, noise)
    if whole:  # the squares of the outermost pixels reach out of the picture
        w, right, down = (np.pad(part, 1) for part in (w, right, down))
        u, v = np.pad(u, 1), np.pad(v, 1)
    joined = _joints(w, right, down, focal, step)
    faces, is_cut = _triangles(w, joined)
    at, place = np.arange(w.size), np.zeros((w.size, 3), np.float32)
    place[:, 2] = w.ravel()
    if whole:
        faces, squares = _with_squares(faces, is_cut, w, right, down, joined, focal)
        at = np.concatenate([at, *(one.at for one in squares)])
        place = np.concatenate([place, *(one.place for one in squares)])
    used = np.zeros(len(at), bool)
    used[faces] = True
    number = np.cumsum(used, dtype=np.uint32) - 1  # of each vertex among those used
    at, place = at[used], place[used]
    u, v, right, down = u.ravel()[at], v.ravel()[at], right.ravel()[at] / every, down.ravel()[at] / every
    column, row, w = u + place[:, 0] * every, v + place[:, 1] * every, place[:, 2]
    (height, width), camera = frame.depth.shape, frame.camera
    if normals is None:
        outward = [camera.fx * right, camera.fy * down, w - right * (column - camera.cx) - down * (row - camera.cy)]
        found = -np.stack(outward, -1)
    else:
        found = normals[v, u]
    length = np.linalg.norm(found, axis=1, keepdims=True)
    ahead = np.broadcast_to(np.array([0, 0, -1.0]), found.shape)  # where there is no normal
    units = np.divide(found, length, out=ahead.copy(), where=length > 0).astype(np.float32)
    (x, y), z = camera.ray_at(column, row), 1 / w
    positions = np.stack([x * z, y * z, z], -1).astype(np.float32)
    uv = np.stack([(column + 0.5) / width, (row + 0.5) / height], -1).astype(np.float32)
    corners = number[faces[:, ::-1] if camera.fx * camera.fy < 0 else faces]
    return TriangleSurface(positions * TO_GLTF, units * TO_GLTF, uv, corners)


def _slopes(w: Floats) -> Floats:
    """Return the slope of w from column to column, by the side that goes on more evenly; 0 without neighbours."""
    known = np.pad(w > 0, ((0, 0), (2, 2)))
    padded = np.pad(w, ((0, 0), (2, 2)))
    step = np.where(known[:, 1:] & known[:, :-1], np.diff(padded, axis=1), np.nan)
    bend = np.diff(step, axis=1)  # of the pixels from 1 on
    sides = step[:, 1:-2], step[:, 2:-1]
    slope, total, safe = np.zeros_like(w), np.zeros_like(w), np.where(w > 0, w, 1)
    for side, beyond in zip(sides, (bend[:, :-2], bend[:, 2:]), strict=True):
        # two pixels that stand alone have no bend: they count little
        uneven = np.where(np.isnan(beyond), 1, np.abs(beyond) / safe)
        weight = np.where(np.isnan(side), 0, 1 / (EVEN + uneven) ** 2)
        slope += weight * np.nan_to_num(side)
        total += weight
    return np.divide(slope, total, out=np.zeros_like(w), where=total > 0)


def _unevenness(w: Floats) -> float:
    """Return by how much w bends from pixel to pixel, as a share of it; jumps do not count."""
    known = (w[:, :-2] > 0) & (w[:, 1:-1] > 0) & (w[:, 2:] > 0)
    bend = np.abs(np.diff(w, 2, axis=1)[known]) / w[:, 1:-1][known]
    bend = bend[bend < SAME_SURFACE]
    return float(bend.mean()) if bend.size else 0.0


def _smoothed(w: Floats, right: Floats, down: Floats, noise: float) -> tuple[Floats, Floats]:
    """Return the mean slopes of pixels around that lie on the plane of the one in the middle, up to the noise."""
    safe = np.where(w > 0, w, 1)
    for step in WINDOW:
        there = np.pad(np.stack([w, right, down]), ((0, 0), (step, step), (step, step)))
        total, sums = np.zeros_like(w), np.zeros((2, *w.shape), np.float32)
        for dy in (0, step, 2 * step):
            for dx in (0, step, 2 * step):
                other = there[:, dy : dy + w.shape[0], dx : dx + w.shape[1]]
                off = (other[0] - w - (dx - step) * right - (dy - step) * down) / safe
                weight = np.where(other[0] > 0, 1 / (1 + (off / (4 * noise * (1 + step))) ** 2) ** 2, 0)
                total += weight
                sums += weight * other[1:]
        right, down = sums / np.where(total > 0, total, 1)
    return right, down


FIRST, LAST = slice(None, -1), slice(1, None)
CORNERS = {"a": (FIRST, FIRST), "b": (FIRST, LAST), "c": (LAST, FIRST), "d": (LAST, LAST)}  # of squares of four pixels
PAIRS = {"ab": (1, 0), "cd": (1, 0), "ac": (0, 1), "bd": (0, 1), "bc": (-1, 1), "ad": (1, 1)}  # from one to the other
# of a corner: on which side of it the square lies, and the corners beside, above or below, and opposite
AROUND = {"a": (1, 1, "bcd"), "b": (-1, 1, "adc"), "c": (1, -1, "dab"), "d": (-1, -1, "cba")}


def _joints(w: Floats, right: Floats, down: Floats, focal: float, max_step: Step | None) -> dict[str, Flags]:
    """Return for each pair of corners in which squares both lie on one surface."""

    def joined(a: Part, b: Part, off: tuple[int, int]) -> Flags:
        rises = [off[0] * right[k] + off[1] * down[k] for k in (a, b)]  # of w from one to the other, by each plane
        known = (w[a] > 0) & (w[b] > 0)
        near, far = np.maximum(w[a], w[b]), np.where(known, np.minimum(w[a], w[b]), 1)
        if max_step:
            z, far_z = 1 / np.where(known, near, 1), 1 / far
            return known & (far_z - z <= max_step[0] + max_step[1] * z)
        step = w[b] - w[a]
        goes_on = np.minimum(np.abs(step - rises[0]), np.abs(step - rises[1])) < SAME_SURFACE * far
        return known & goes_on & (np.abs(step) < max(SAME_SURFACE, STEEPEST / focal) * far)

    return {pair: joined(CORNERS[pair[0]], CORNERS[pair[1]], off) for pair, off in PAIRS.items()}


def _triangles(w: Floats, joined: dict[str, Flags]) -> tuple[NDArray[np.intp], Flags]:
    """Return (m, 3) pixels of the triangles in each square of one surface, cut along either diagonal.

    Also which squares have not both, (h - 1, w - 1).
    """
    above, below, left, beside, rising, falling = (joined[pair] for pair in PAIRS)
    usual = above & left & rising, below & beside & rising
    is_other = ~(usual[0] | usual[1])
    others = above & beside & falling & is_other, left & below & falling & is_other
    pixel = np.arange(w.size).reshape(w.shape)
    kept = zip((*usual, *others), ("acb", "bcd", "adb", "acd"), strict=True)
    faces = [np.stack([pixel[CORNERS[one]][there] for one in three], -1) for there, three in kept]
    return np.concatenate(faces), ~(usual[0] & usual[1] | others[0] & others[1])


def _with_squares(
    faces: NDArray[np.intp], is_cut: Flags, w: Floats, right: Floats, down: Floats, joined: dict[str, Flags],
    focal: float,
) -> tuple[NDArray[np.intp], list[CutVertices]]:  # fmt: skip
    """Return the triangles in which each pixel of a cut square keeps its own quarter of it, and their new vertices.

    These come behind those of the pixels, and the quarters in place of the triangles of cut squares.
    """
    row, column = np.divmod(faces, w.shape[1])
    faces = faces[~is_cut[row.min(1), column.min(1)]]
    steepest = min(STEEPEST / focal, 0.5) * w
    right, down = np.clip(right, -steepest, steepest), np.clip(down, -steepest, steepest)
    middles = {one: (w + 0.5 * sx * right + 0.5 * sy * down)[CORNERS[one]] for one, (sx, sy, _) in AROUND.items()}
    pixel, count = np.arange(w.size).reshape(w.shape), w.size
    every, found = [faces], list[CutVertices]()
    for one, (sx, sy, others) in AROUND.items():
        own = CORNERS[one]
        there = is_cut & (w[own] > 0)
        is_one = [joined["".join(sorted(one + other))][there] for other in others]
        number, height = pixel[own][there], w[own][there]
        total, of = middles[one][there], np.ones(len(number), np.float32)
        for other, is_joined in zip(others, is_one, strict=True):
            total, of = total + np.where(is_joined, middles[other][there], 0), of + is_joined
        sides = 0.5 * sx * right[own][there], 0.5 * sy * down[own][there]
        ends = [
            height + np.where(is_joined, (w[CORNERS[other]][there] - height) / 2, side)
            for other, is_joined, side in zip(others, is_one, sides, strict=False)
        ]
        new = count + np.arange(3 * len(number)).reshape(3, -1)  # beside, above or below, and the square's middle
        count += new.size
        two = (number, new[1], new[2]), (number, new[2], new[0])
        every += [np.stack(three if sx == sy else three[::-1], -1) for three in two]
        place = np.zeros((3, len(number), 3), np.float32)
        place[..., :2] = np.array([(sx, 0), (0, sy), (sx, sy)])[:, None] / 2
        place[..., 2] = *ends, total / of
        found.append(CutVertices(np.tile(number, 3), place.reshape(-1, 3)))
    return np.concatenate(every), found


def meshes_of(
    found: Iterable[tuple[Frame, Floats, NDArray[np.uint8]]], camera: Camera, pose: NDArray[np.float64],
    step: Step | None = None,
) -> Scene:  # fmt: skip
    """Return the scene of frames as meshes in the world, whose textures are shown as they are, and who looks at it.

    found  each frame, with (h, w, 4) unit normal and depth, camera axes, depth 0 where there is no point; and its
           picture, (h', w', 4), alpha 0 where nothing is known
    """
    nodes, every = list[Node](), list(found)
    is_one = len(every) == 1  # of several each ends where another has more, and squares would stick out
    for k, (frame, surface, picture) in enumerate(every):
        seen = Frame(None, surface[..., 3], frame.camera)
        shape = frame_surface(seen, MOST_PIXELS, step, surface[..., :3], whole=is_one)
        if not len(shape.faces):
            continue
        turn, shift = frame.pose[:3, :3].T, frame.pose[:3, 3]
        places = (shape.positions * TO_GLTF) @ turn + shift
        normals = (shape.normals * TO_GLTF) @ turn
        stands: Up | None = None if frame.upright is None else "-y"
        lean = np.eye(4)
        if frame.upright is not None:  # in the node's own axes it stands
            lean[:3, :3] = shortest_turn(np.array([0.0, -1.0, 0.0]), frame.upright)
            places, normals = places @ lean[:3, :3], normals @ lean[:3, :3]
        mesh = Mesh(places, shape.faces, normals, shape.uv, texture=_without_gaps(picture), shading="none", up=stands)
        nodes.append(Node(mesh, "surface" if is_one else f"surface {k}", lean))
    return Scene(tuple(nodes), camera, pose)


def _without_gaps(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the colours of a picture, (h, w, 3), that go on where nothing is known; farther out the mean of all."""
    known = picture[..., 3] > 0
    if known.all() or not known.any():
        return picture[..., :3]
    colors = np.where(known[..., None], picture[..., :3], 0).astype(np.float32)
    for _ in range(BLEED):
        wide, weight = np.pad(colors, ((1, 1), (1, 1), (0, 0))), np.pad(known, 1).astype(np.float32)
        total, count = np.zeros_like(colors), np.zeros(known.shape, np.float32)
        for dy in range(3):
            for dx in range(3):
                part = np.s_[dy : dy + known.shape[0], dx : dx + known.shape[1]]
                total, count = total + wide[part], count + weight[part]
        colors = np.where(known[..., None], colors, total / np.maximum(count, 1)[..., None])
        known = known | (count > 0)
    mean = picture[picture[..., 3] > 0][:, :3].mean(0)
    return np.rint(np.where(known[..., None], colors, mean)).astype(np.uint8)
