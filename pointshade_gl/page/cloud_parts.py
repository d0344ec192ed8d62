"""The part of a page that is a point cloud: its points in an order in which each is near the one before."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..gpu.clouds import cloud_objects as drawing
from ..gpu.clouds.cloud_objects import PlacedCloud
from .parts import Part, Quality
from .picture_coding import code_colors, code_depth, code_normals, code_plane

FINE = 256  # steps of positions in the typical distance of two points
FARTHEST = 2**30  # steps: more are no whole number of a browser
SIZE_STEP = 0.002  # share of a size: sizes are kept to half of it
EDGE_BITS = 8  # of each of two coordinates of a direction
RULES = {
    "core": drawing.CORE,
    "band": drawing.BAND,
    "stepBack": drawing.STEP_BACK,
    "ring": drawing.RING,
    "shadowShare": drawing.SHADOW_SHARE,
    "shadowPush": drawing.SHADOW_PUSH,
    "ballShare": drawing.BALL_SHARE,
}


def cloud_part(placed: PlacedCloud, quality: Quality) -> Part:
    """The points of a cloud, all of them: `placed` may have those that one view needs."""
    with placed.points.complete(placed.cloud) as points:
        grown = placed.grown if points is placed.points else 1.0
        return _coded(placed._replace(points=points, grown=grown), quality)


def _coded(placed: PlacedCloud, quality: Quality) -> Part:
    vertices, discs = _in_order(placed)
    count, has_sizes = len(vertices), placed.radius[1] > 0
    low, step = _grid(vertices["position"], placed.points.spacing)
    codes = np.rint((vertices["position"].astype(np.float64) - low) / step).astype(np.int64)
    planes = [_line(codes[:, axis]) for axis in range(3)]
    smallest = 0.0
    if has_sizes:
        sizes, smallest = code_depth(vertices["spacing"], SIZE_STEP)
        planes.append(_line(sizes))
    flat, edges = vertices["normal"][:discs], vertices["edge"][:discs, :3].astype(np.float64)
    planes += [_line(code) for code in code_normals(flat, quality.normal_bits).T]
    border = np.asarray(edges.any(-1))
    directions = np.zeros((discs, 2), np.int64)
    directions[border] = code_normals(edges[border], EDGE_BITS)
    planes += [_line(code, border) for code in directions.T]
    has_colors = placed.cloud.colors is not None and count > 0
    colors = code_colors(vertices["color"][None, :, :3], np.ones((1, count), np.bool_)) if has_colors else b""
    axes = placed.pose.copy()
    axes[:3, 3] += axes[:3, :3] @ (placed.scale * placed.points.middle)
    head: dict[str, Any] = {
        "kind": "cloud",
        "count": count,
        "discs": discs,
        "isBlended": placed.is_blended,
        "low": low.tolist(),
        "high": (low + step * codes.max(0, initial=0)).tolist(),
        "step": step,
        "smallest": smallest,
        "sizeStep": SIZE_STEP,
        "hasSizes": has_sizes,
        "hasColors": has_colors,
        "normalBits": quality.normal_bits,
        "edgeBits": EDGE_BITS,
        "edges": int(border.sum()),
        "bytes": [size for _, size in planes],
        "radius": list(placed.radius),
        "spacing": placed.points.spacing,
        "largest": placed.points.largest,
        "rules": RULES,
        "axes": axes,
        "scale": placed.scale,
    }
    return head, b"".join([border.astype(np.uint8).tobytes(), *(data for data, _ in planes), colors])


def _line(codes: NDArray[np.int64], known: NDArray[np.bool_] | None = None) -> tuple[bytes, int]:
    """Numbers as a picture of one row."""
    if not len(codes):
        return b"", 1
    return code_plane(codes[None], np.ones((1, len(codes)), np.bool_) if known is None else known[None])


def _grid(at: NDArray[np.float32], spacing: float) -> tuple[NDArray[np.float64], float]:
    """Where positions are counted from, and the step in which they are."""
    if not len(at):
        return np.zeros(3), 1.0
    low = at.min(0).astype(np.float64)
    extent = float((at.max(0) - low).max())
    typical = spacing if 0 < spacing < extent else extent / np.sqrt(len(at))
    return low, max(typical / FINE, extent / FARTHEST) or 1.0


def _in_order(placed: PlacedCloud) -> tuple[NDArray[Any], int]:
    """The points that are drawn, discs first, both along a curve that fills space (Morton 1966); how many discs."""
    vertices = placed.points.read()
    is_disc = vertices["normal"].any(-1) if placed.is_blended else np.zeros(len(vertices), np.bool_)
    drawn = vertices["spacing"] > 0 if placed.radius[1] > 0 else np.ones(len(vertices), np.bool_)
    order = np.lexsort((_curve(vertices["position"]), ~is_disc))
    order = order[drawn[order]]
    return vertices[order], int((is_disc & drawn).sum())


def _curve(at: NDArray[np.float32]) -> NDArray[np.int64]:
    """(n,) places of points (n, 3) on the curve."""
    if not len(at):
        return np.zeros(0, np.int64)
    low, high = np.quantile(at, (0.001, 0.999), axis=0)
    cells = np.clip((at - low) / max(float((high - low).max()), 1e-30) * 1024, 0, 1023).astype(np.int64)
    bits = [(cells[:, axis] >> bit & 1) << (3 * bit + axis) for bit in range(10) for axis in range(3)]
    return np.sum(bits, axis=0)
