"""Keeps point clouds on the GPU: of each as many points as the last views needed; normals in slabs."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...estimation.by_threads import by_threads, parts_of
from ...estimation.cloud_estimates import any_of, estimate_spacing
from ...scene.cloud import PointCloud
from ...scene.visible import points_at
from ..context.caller_state import managed
from ..core.images import Owner
from .cloud_planes import WIDEST, FitRadius, PlaneArrays, find_planes

DRAWN_AT_ONCE = 1 << 20  # points: one draw of many millions may end a driver's patience
VERTEX = np.dtype([
    ("position", "f4", 3), ("spacing", "f4"), ("normal", "f4", 3), ("edge", "f2", 4), ("color", "u1", 4),
])  # fmt: skip
FEW = 64  # points: of fewer there is no surface
LAYOUT = {"position": ("3f", 12), "spacing": ("1f", 4), "normal": ("3f", 12), "edge": ("4f2", 8), "color": ("4f1", 4)}


class CloudPoints(Owner):
    """The points of one level of a cloud on the GPU: first those that lie on a surface, then the others.

    cloud    that they were taken from, or one that looks otherwise
    middle   (3,) node axes, that positions count from
    discs    buffers of those that lie on a surface
    others   buffers of those that do not
    spacing  the median of their spacings, or of their sizes
    largest  of these
    corners  (8, 3) of the box round them, from the middle
    fit      how their planes were found; None if they need none
    """

    def __init__(self, context: moderngl.Context, cloud: PointCloud, level: int):
        super().__init__(context)
        self.cloud = cloud
        some = points_at(cloud, level)
        at = cloud.positions if some is None else cloud.positions[some]
        self.count = len(at)
        self.middle: NDArray[np.float64] = cloud.origin + _middle(at)
        local = (at + (cloud.origin - self.middle)).astype(np.float32)
        vertices, self.fit = _vertices(context, cloud, some, local)
        self.spacing = float(np.median(vertices["spacing"])) if self.count else 0.0
        self.largest = float(vertices["spacing"].max()) if self.count else 0.0
        self.corners = cloud.corners - self.middle
        discs = int(np.count_nonzero(any_of(vertices["normal"])))
        self._arrays: dict[tuple[moderngl.Program, int], moderngl.VertexArray] = {}
        with self._all_or_nothing():
            self.discs = self._buffers(vertices[:discs])
            self.others = self._buffers(vertices[discs:])

    @managed
    def complete(self, cloud: PointCloud) -> Generator[CloudPoints, None, None]:
        """Have all points of this cloud, `cloud` or one that looks otherwise, on the GPU."""
        if self.count == len(cloud):
            yield self
            return
        whole = CloudPoints(self._context, cloud, 0)
        try:
            yield whole
        finally:
            whole.release()

    def read(self) -> NDArray[Any]:
        """Return (count,) of VERTEX."""
        return np.frombuffer(b"".join(buffer.read() for buffer in self.discs + self.others), VERTEX)

    def draw(self, buffers: list[moderngl.Buffer], program: moderngl.Program, as_quads: bool) -> None:
        """Draw some of the points by a program of shaders/clouds/splat.vert. as_quads: by one with QUADS."""
        for buffer in buffers:
            array, count = self._array(program, buffer, as_quads), buffer.size // VERTEX.itemsize
            if as_quads:
                array.render(moderngl.TRIANGLE_STRIP, 4, instances=count)
            else:
                array.render(moderngl.POINTS, count)

    def _buffers(self, vertices: NDArray[Any]) -> list[moderngl.Buffer]:
        parts = (vertices[k : k + DRAWN_AT_ONCE] for k in range(0, len(vertices), DRAWN_AT_ONCE))
        return [self._allocate(self._context.buffer, part.tobytes()) for part in parts]

    def _array(self, program: moderngl.Program, buffer: moderngl.Buffer, as_quads: bool) -> moderngl.VertexArray:
        key = program, buffer.glo
        if key not in self._arrays:
            read = [name for name in LAYOUT if name in program]  # drivers leave out what a program does not use
            form = " ".join(form if name in read else f"{size}x" for name, (form, size) in LAYOUT.items())
            content = [(buffer, form + "/i" * as_quads, *read)]
            self._arrays[key] = self._allocate(self._context.vertex_array, program, content)
        return self._arrays[key]


class CloudStore(Owner):
    """The clouds of the last picture. Those that only look otherwise share their points."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._kept: dict[tuple[int, ...], CloudPoints] = {}  # by the ids of arrays, which each keeps

    def get(self, cloud: PointCloud, level: int) -> CloudPoints:
        """Return the points of a level of a cloud."""
        key = (*_identity(cloud), level)
        if key not in self._kept:
            self._kept[key] = CloudPoints(self._context, cloud, level)
        return self._kept[key]

    def keep_only(self, clouds: Iterable[PointCloud]) -> list[CloudPoints]:
        """Free all levels of clouds that are not among these, and return them."""
        wanted = {_identity(cloud) for cloud in clouds}
        freed = [self._kept.pop(key) for key in [*self._kept] if key[:-1] not in wanted]
        for one in freed:
            one.release()
        return freed

    def release(self) -> None:
        self.keep_only([])
        super().release()


def _identity(cloud: PointCloud) -> tuple[int, ...]:
    """Return by what clouds are told apart whose points on the GPU differ."""
    return (*map(id, cloud.arrays), _has_planes(cloud))


def _has_planes(cloud: PointCloud) -> bool:
    """Return whether the points need planes, or at least spacings: not balls of a given size."""
    return cloud.splat == "disc" or (cloud.sizes is None and cloud.radius_rule[1] == "x")


def _middle(at: NDArray[Any]) -> NDArray[np.float64]:
    """Return a point amidst these, (3,)."""
    return np.median(at[:: max(len(at) // 1024, 1)], axis=0).astype(np.float64) if len(at) else np.zeros(3)


def _vertices(
    context: moderngl.Context, cloud: PointCloud, some: NDArray[Any] | None, local: NDArray[np.float32]
) -> tuple[NDArray[Any], FitRadius | None]:
    """Return (n,) of VERTEX: points near each other follow each other, those without a plane come last. And the fit."""
    normals, colors, sizes = (_part(one, some) for one in (cloud.normals, cloud.colors, cloud.sizes))
    if _has_planes(cloud):
        order, _, planes, details, fit = find_planes(context, local, normals)
        few, spacing = len(local) < FEW, fit.spacing if fit else 0.0
        alone = few | ~any_of(planes)  # no neighbours tell how far apart such points are
        planes[alone, 3] = np.minimum(planes[alone, 3], min(spacing, cloud.rough_spacing) if few else spacing)
    else:
        order, planes, details, fit = np.arange(len(local)), np.zeros((len(local), 4), np.float32), None, None
    last = np.argsort(~any_of(planes), kind="stable")
    order, planes = order[last], planes[last]
    vertices = np.zeros(len(local), VERTEX)
    vertices["position"], vertices["normal"] = local[order], planes[:, :3]
    vertices["spacing"] = planes[:, 3] if sizes is None else sizes[order]
    if details is not None:
        vertices["edge"][:, :3] = details[last, :3]
    vertices["color"] = 255
    if colors is not None:
        vertices["color"][:, :3] = colors[order]
    return vertices, fit


def _part(values: NDArray[Any] | None, some: NDArray[Any] | None) -> Any:
    return values if values is None or some is None else values[some]


MOST = 8 << 20  # points of a slab
SAMPLE = 1 << 20  # points that the borders of slabs are found from


class CloudNormals(NamedTuple):
    """What is known of each point.

    normals     (n, 3) unit, 0 0 0 without a plane
    confidence  (n,) of the normal, 0 to 1
    spacing     (n,) of the surface there
    """

    normals: NDArray[np.float32]
    confidence: NDArray[np.float32]
    spacing: NDArray[np.float32]


def planes_of_slabs(
    context: moderngl.Context, positions: NDArray[np.floating[Any]], normals: NDArray[np.float32] | None = None,
    noise: float | None = None, most: int = MOST,
) -> CloudNormals:  # fmt: skip
    """Return the planes of a cloud, in its order. Only one slab at a time is on the GPU.

    positions  (n, 3) float32 or float64: each slab counts from its own middle
    normals    (n, 3) those that are known, others 0
    """
    count = len(positions)
    found = CloudNormals(np.zeros((count, 3), "f4"), np.zeros(count, "f4"), np.zeros(count, "f4"))
    for inside, around in _slabs(positions, most):
        if not len(around):
            continue
        local = positions[around]
        local = (local - np.rint(local.mean(0))).astype(np.float32)
        planes = find_planes(context, local, None if normals is None else normals[around], noise)
        _put(found, planes, inside, around)
    return found


def _put(found: CloudNormals, planes: PlaneArrays, inside: NDArray[np.bool_], around: NDArray[np.integer]) -> None:
    """Keep what was found of the points inside a slab; around: the numbers of all that it was found from."""

    def put(part: slice) -> None:
        places = around[planes.order[part]]
        kept = inside[places]
        places, plane, detail = places[kept], planes.planes[part][kept], planes.details[part][kept]
        found.normals[places] = plane[:, :3]
        found.spacing[places], found.confidence[places] = plane[:, 3], detail[:, 3]

    by_threads(put, parts_of(len(planes.order)))


def _slabs(positions: NDArray[np.floating[Any]], most: int) -> Iterator[tuple[NDArray[np.bool_], NDArray[np.integer]]]:
    """Yield for each slab which points are inside, (n,) bool, and which lie inside or near it, their numbers."""
    count = len(positions)
    if count <= most:
        yield np.ones(count, bool), np.arange(count)
        return
    some = positions[:: -(-count // SAMPLE)]
    axis = int(np.argmax(np.subtract(*np.quantile(some, (0.99, 0.01), axis=0))))
    parts = -(-count // most)
    edges = np.quantile(some[:, axis], np.linspace(0, 1, parts + 1))
    edges[0], edges[-1] = -np.inf, np.inf
    along = positions[:, axis]
    border = WIDEST * estimate_spacing((positions - some.mean(0)).astype(np.float32)).length
    for low, high in pairwise(edges):
        inside = (along >= low) & (along < high)
        yield inside, np.flatnonzero((along >= low - border) & (along < high + border))
