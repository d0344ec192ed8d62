"""Planes through the points of a cloud and their neighbours: normals, spacing, and how wide they are fitted."""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...estimation.by_threads import by_threads, parts_of, sorted_by_threads, taken_by_threads
from ...estimation.cloud_estimates import Spacing, any_of, estimate_spacing, surface_residuals
from ..core.images import Owner, confine
from ..core.programs import FullscreenPass, FullscreenPasses

MOST_CELLS = 1 << 20  # cells along an axis: what lies further out is in the cells at the border
MARGIN = 8  # empty cells between rows, so that none runs into the next
SAMPLE = 1 << 16  # points that the middle is taken from


class CellGrid:
    """Cells of one size, of which only those with points are kept.

    order   (n,) which point of the input each point is, sorted by cells: first x, then y, then z
    cells   (m,) the number of each occupied cell, ascending
    starts  (m + 1,) where its points begin
    """

    def __init__(self, positions: NDArray[np.float32], side: float):
        self.side = side
        self._low = np.median(positions[:: len(positions) // SAMPLE + 1], axis=0) if len(positions) else np.zeros(3)
        index = self._index_of(positions)
        self._first = index.min(1, initial=MOST_CELLS) - MARGIN
        x, y, _ = (int(count) for count in index.max(1, initial=0) - self._first + 1)
        self._strides = 1, x, x * y
        keys = self._keys(index)
        self.order = sorted_order(keys)
        keys = taken_by_threads(keys, self.order)
        first = np.flatnonzero(np.append([True] * (len(keys) > 0), keys[1:] != keys[:-1]))
        self.cells = keys[first]
        self.starts = np.append(first, len(keys))

    @cached_property
    def cell_of(self) -> NDArray[np.int32]:
        """Return the place in `cells` of each point, in the order of the grid."""
        return np.repeat(np.arange(len(self.cells), dtype=np.int32), np.diff(self.starts))

    @cached_property
    def spans(self) -> NDArray[np.int32]:
        """Return (m, 9, 2): from where to where in `cells` the cells round each one lie, in its nine rows."""
        return self._spans(self.cells, 1)

    def keys_of(self, positions: NDArray[np.float32]) -> NDArray[np.int64]:
        """Return the cells that other points lie in."""
        return self._keys(self._index_of(positions))

    def ranges(self, keys: NDArray[np.int64] | None = None, reach: int = 1) -> NDArray[np.int32]:
        """Return (m, rows, 2): from where to where the points round cells lie, for each row of cells.

        keys   of the cells; None: those of the grid
        reach  how many cells away; 1: nine rows
        """
        spans, starts = self.spans if keys is None else self._spans(keys, reach), self.starts.astype(np.int32)

        found = np.empty_like(spans)

        def fill(part: slice) -> None:
            np.take(starts, spans[part], out=found[part], mode="clip")  # see taken_by_threads

        by_threads(fill, parts_of(len(spans)))
        return found

    def _spans(self, keys: NDArray[np.int64], reach: int) -> NDArray[np.int32]:
        _, y, z = self._strides
        steps = range(-reach, reach + 1)
        offsets = [b * y + c * z for c in steps for b in steps]
        found = np.empty((len(keys), len(offsets), 2), np.int32)

        def find(k: int) -> None:
            found[:, k, 0] = np.searchsorted(self.cells, keys + (offsets[k] - reach))
            found[:, k, 1] = np.searchsorted(self.cells, keys + (offsets[k] + reach), "right")

        by_threads(find, range(len(offsets)))
        return found

    def _index_of(self, positions: NDArray[np.float32]) -> NDArray[np.int64]:
        index = np.empty((3, len(positions)), np.int64)

        def fill(k: int) -> None:
            steps = (positions[:, k] - np.float32(self._low[k])) * np.float32(1 / self.side)
            np.clip(np.floor(steps, out=steps), -MOST_CELLS // 2, MOST_CELLS // 2 - 1, out=steps)
            index[k] = steps

        by_threads(fill, range(3))
        return index

    def _keys(self, index: NDArray[np.int64]) -> NDArray[np.int64]:
        _, y, z = self._strides
        x0, y0, z0 = self._first
        keys = np.empty(index.shape[1], np.int64)

        def fill(part: slice) -> None:
            keys[part] = (index[0, part] - x0) + (index[1, part] - y0) * y + (index[2, part] - z0) * z

        by_threads(fill, parts_of(len(keys)))
        return keys


def sorted_order(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the order that sorts keys from 0 on; equal ones stay in theirs. Numbers sort faster than their places."""
    bits = max(len(keys) - 1, 0).bit_length()
    # a key and its place must fit into one positive number of 64 bits
    if not len(keys) or int(keys.max()) >> (63 - bits):
        return np.argsort(keys, kind="stable")
    packed = np.empty_like(keys)

    def pack(part: slice) -> None:
        packed[part] = (keys[part] << bits) | np.arange(part.start, part.stop)

    def unpack(part: slice) -> None:
        packed[part] &= (1 << bits) - 1

    by_threads(pack, parts_of(len(keys)))
    packed = sorted_by_threads(packed)
    by_threads(unpack, parts_of(len(keys)))
    return packed


LEAST, WIDEST = 2.7, 14.0  # spacings: about 20 neighbours, about 600
CALM = 180.0  # radius² = 180 x noise x spacing: the mean error of a normal is 140 degrees x noise x spacing / radius²
SURE, UNSURE = 0.15, 0.2  # radii of noise: more, and a wider radius may tell it better; where none does, there is none
WIDER = 1.6
CALM_PLACE, BENT_PLACE = 0.35, 0.5  # share of the places with less: others have edges; or bend
BENT, NARROWER = 1.25, 1.2  # of what points lie off within the first radius: more, and a smaller one is taken
ASKED = 384  # places where the noise is measured
SEEN = 80  # neighbours of each
LOOKED_AT = 512  # points of a row of cells at most: of crowds each k-th
MOST_POINTS = 64  # points of three cells in a row that are looked at; with a wider radius so many more


class FitRadius(NamedTuple):
    """Within which radius planes are fitted.

    length   of the first level; each further one is 1.6 times as wide
    spacing  of the points
    noise    its standard deviation
    """

    length: float
    spacing: float
    noise: float

    @property
    def most(self) -> int:
        """Return how many points of three cells in a row are looked at."""
        return int(MOST_POINTS * (self.length / (LEAST * self.spacing)) ** 2)

    def of_level(self, level: int) -> float:
        return self.length * WIDER**level

    def noise_share(self, level: int) -> float:
        """Return the noise in radii of a level."""
        return self.noise / self.of_level(level)


def fit_radius(grid: CellGrid, points: NDArray[np.float32], spacing: float, noise: float | None) -> FitRadius:
    """Choose a radius by the noise that is given, or else measured.

    Where no radius tells the noise from a surface, as in foliage, there is no noise: a wide radius would not help.

    grid  of the points, its cells as large as the least radius
    """
    if noise is not None:
        return _by_noise(noise, spacing)
    asked = np.random.default_rng(0).choice(len(points), min(ASKED, len(points)), replace=False)

    def residuals(radius: float) -> tuple[float, float]:
        return tuple(radius * surface_residuals(*neighbours(grid, points, asked, radius), (CALM_PLACE, BENT_PLACE)))

    radius, found = LEAST * spacing, (UNSURE, 0.0, 0.0, 0.0)
    while radius <= WIDEST * spacing and found[0] > SURE:
        noise, bent = residuals(radius)
        found = min(found, (noise / radius, noise, bent, radius))
        radius *= WIDER
    _, noise, bent, radius = found
    wanted = _by_noise(noise, spacing)
    length = wanted.length
    while radius and length > NARROWER * radius and residuals(length)[1] > BENT * bent:
        length /= NARROWER
    return wanted._replace(length=length)


def _by_noise(noise: float, spacing: float) -> FitRadius:
    return FitRadius(spacing * float(np.clip(np.sqrt(CALM * noise / spacing), LEAST, WIDEST)), spacing, noise)


def neighbours(
    grid: CellGrid, points: NDArray[np.float32], asked: NDArray[np.integer], radius: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return (m, SEEN, 3) offsets to neighbours of points within a radius, radii, and which of these there are."""
    here = points[asked, :3].astype(np.float64)
    keys = grid.keys_of(points[asked])
    ranges = grid.ranges(keys, int(np.ceil(radius / grid.side))).reshape(-1, 2)
    owner = np.repeat(np.arange(len(asked)), len(ranges) // len(asked))
    stride = 1 + np.maximum(ranges[:, 1] - ranges[:, 0] - 1, 0) // LOOKED_AT
    length = -(-(ranges[:, 1] - ranges[:, 0]) // stride)
    steps = np.arange(length.sum()) - np.repeat(np.cumsum(length) - length, length)
    places = np.repeat(ranges[:, 0], length) + steps * np.repeat(stride, length)
    owner = np.repeat(owner, length)
    offsets = (points[places, :3] - here[owner]) / radius
    inside = np.einsum("ni,ni->n", offsets, offsets) < 1
    owner, offsets = owner[inside], offsets[inside]
    count = np.bincount(owner, minlength=len(asked))
    rank = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    share = np.minimum(SEEN / np.maximum(count, 1), 1)[owner]
    slot = (rank * share).astype(int)
    taken = slot > ((rank - 1) * share).astype(int)
    taken |= rank == 0
    found, known = np.zeros((len(asked), SEEN, 3)), np.zeros((len(asked), SEEN), bool)
    found[owner[taken], slot[taken]] = offsets[taken]
    known[owner[taken], slot[taken]] = True
    return found, known


WIDTH = 4096  # CLOUD_WIDTH of common/cloud_moments.glsl
ROWS = 256  # of a texture that are drawn at once: drivers end passes that take long


class Neighbourhood(Owner):
    """Textures of a cell grid and of the points that are asked for; each value one after the other, WIDTH in a row.

    queries  (n, 4) float32: the points that are asked for; None: all of the grid
    """

    def __init__(
        self, context: moderngl.Context, grid: CellGrid, points: NDArray[np.float32],
        queries: NDArray[np.float32] | None = None,
    ):  # fmt: skip
        super().__init__(context)
        with self._all_or_nothing():
            keys, cell_of = None, grid.cell_of
            if queries is not None:
                keys, cell_of = np.unique(grid.keys_of(queries), return_inverse=True)
            self.count = len(points if queries is None else queries)
            self.points = value_texture(self, points)
            self.queries = self.points if queries is None else value_texture(self, queries)
            self._cells = value_texture(self, cell_of.astype(np.int32)[:, None])
            self._ranges = value_texture(self, grid.ranges(keys).reshape(-1, 2))

    def run(self, work: FullscreenPass, radius: float, most: int, **inputs: Any) -> list[NDArray[np.float32]]:
        """Return what a pass writes for each point that is asked for: two (n, 4)."""
        own = Owner(self._context)
        try:
            size = self.queries.size
            made = [own._allocate(self._context.texture, size, 4, dtype="f4") for _ in range(2)]
            target = own._allocate(self._context.framebuffer, made, None)
            textures = {
                "query_map": self.queries, "cell_map": self._cells, "range_map": self._ranges, "point_map": self.points,
            }  # fmt: skip
            textures |= {name: inputs.pop(name) for name in list(inputs) if isinstance(inputs[name], moderngl.Texture)}
            for row in range(0, size[1], ROWS):
                confine(target, (0, row, WIDTH, min(ROWS, size[1] - row)))
                work.draw(target, dict(textures), count=self.count, radius=radius, most=most, **inputs)
            return [read_values(one, self.count) for one in made]
        finally:
            own.release()


def read_values(texture: moderngl.Texture, count: int) -> NDArray[np.float32]:
    """Return the first values (n, components) of a float32 texture."""
    values = np.empty((texture.width * texture.height, texture.components), np.float32)
    texture.read_into(values, alignment=1)
    return values[:count]


def value_texture(owner: Owner, values: NDArray[Any]) -> moderngl.Texture:
    """Return a texture of float32 or int32 values (n, 1 to 4), WIDTH in a row, that belongs to the owner."""
    count, components = values.shape
    rows, kind = max(-(-count // WIDTH), 1), "i4" if values.dtype == np.int32 else "f4"
    texture = owner._allocate(owner._context.texture, (WIDTH, rows), components, dtype=kind)
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    full = count // WIDTH
    if full:
        texture.write(np.ascontiguousarray(values[: full * WIDTH]), (0, 0, WIDTH, full))
    if count % WIDTH:
        texture.write(np.ascontiguousarray(values[full * WIDTH :]), (0, full, count % WIDTH, 1))
    return texture


PLANES, TRIMMED, EDGES = "clouds/planes.frag", "clouds/trimmed.frag", "clouds/edges.frag"
NEAREST = "clouds/nearest.frag"
ENOUGH = 12  # neighbours
LEVELS = 7  # each looks further
LINE, LINE_LEVELS = 1.0, 3  # LINE of common/cloud_planes.glsl; how much further it is worth to look
OWN, NONE = 6.0, 0.09  # OWN, and THICKEST squared, of common/cloud_edges.glsl
FLAT = 1e-4  # cost of a plane, radii squared: what is flatter has no edge near it
TRIM = 0.1  # of the squared thickness: a neighbour's is less where a few points lie off
QUIET = 0.03  # radii of noise: with more, thinner planes are chance
GATE, NOISY_GATE, NOISE = 0.02, 0.2, 2.5  # what a better plane may cost: of the cost so far, of that with noise
ROUNDS = 2
MANY = 0.01  # of the points: for fewer it pays to find those around them first
BESIDE, SOME, EVEN = 10, 0.1, 0.06  # of a scan some points have neighbours whose own are as far, but for this share
LEAFY = 0.18  # share of the points whose planes are not alike: with more it is foliage
THICK, THIN = 0.1, 0.03  # radii: thicker planes need neighbours that confirm them; thinner ones may be plain
DISC_REACH, BALL_REACH = 0.375, 0.227  # of the distance of the sixth neighbour; of discs on a surface twice that
ALIKE, PLAIN = (
    (0.7, 0.9),
    0.98,
)  # mean cosines of the planes of neighbours: from no surface to one; of a plain one
AMIDST = 0.2  # radii by which neighbours lie aside: where less, no end is near


class FitShape(NamedTuple):
    """What is known of planes without looking at their neighbours again."""

    known: NDArray[np.bool_]
    thickness2: NDArray[np.float32]  # radii squared; infinite without a plane
    cost: NDArray[np.float32]  # cost_of in common/cloud_edges.glsl


class CloudFit:
    """The planes of all points, in the order of a cell grid.

    points  (n, 4) xyz, 0
    planes  (n, 4), see common/cloud_planes.glsl
    leans   (n, 4) how far aside the mean of the neighbours lies, radii; how many there are
    levels  (n,) how often the radius was made wider
    """

    def __init__(
        self, context: moderngl.Context, passes: FullscreenPasses, grid: CellGrid, points: NDArray[np.float32],
        radius: FitRadius,
    ):  # fmt: skip
        self._context, self._passes, self._grid = context, passes, grid
        self.points, self._radius = points, radius
        self.levels = np.zeros(len(points), np.uint8)
        near = Neighbourhood(context, grid, points)
        try:
            self.planes, self.leans = near.run(passes.fullscreen(PLANES), radius.of_level(0), radius.most)
        finally:
            near.release()
        for level in range(1, LEVELS + 1):
            self._look_further(level)
        if radius.noise < QUIET * radius.length:
            self._trim()
        for _ in range(ROUNDS):
            self._sharpen()

    @property
    def radii(self) -> NDArray[np.float32]:
        """Return (n,) within which radius the neighbours lie."""
        return np.array([self._radius.of_level(level) for level in range(LEVELS + 1)], np.float32)[self.levels]

    def _look_further(self, level: int) -> None:
        """Fit again where neighbours were few, or on a line as those of a scan's row are."""
        again = self.leans[:, 3] < ENOUGH
        if level <= LINE_LEVELS:
            again |= (self.planes[:, 3] == LINE) & ~any_of(self.planes)
        asked = np.flatnonzero(again)
        if len(asked):
            self.planes[asked], self.leans[asked] = self._ask(PLANES, level, self.points[asked])
            self.levels[asked] = level

    def _trim(self) -> None:
        """Fit again where a few points lie off: a neighbour's plane is thinner."""
        shape = self._shape()
        is_thicker = self._best_near(shape.thickness2) < TRIM * shape.thickness2
        asked = np.flatnonzero(shape.known & (self.levels == 0) & (shape.cost > FLAT) & is_thicker)
        if len(asked):
            own = self.planes[asked]
            self._take(asked, *self._ask(TRIMMED, 0, self.points[asked], own_map=own))

    def _sharpen(self) -> None:
        """Take neighbours' planes at edges. All are chosen among those from before."""
        shape = self._shape()
        # what a neighbour's plane must cost less than: curves have neighbours that are a little better
        gate = np.minimum(NOISY_GATE * shape.cost, GATE * shape.cost + NOISE * self._noise2())
        is_worth = (shape.cost > FLAT) & ((self.levels > 0) | (self._best_near(shape.thickness2) < gate))
        answers = []
        for level in range(self.levels.max(initial=0) + 1):
            asked = np.flatnonzero(is_worth & (self.levels == level))
            if len(asked):
                queries = self.points[asked]
                queries[:, 3] = gate[asked]
                answers.append((asked, *self._ask(EDGES, level, queries)))
        for answer in answers:
            self._take(*answer)

    def _take(self, asked: NDArray[np.integer], planes: NDArray[np.float32], leans: NDArray[np.float32]) -> None:
        found = any_of(planes)
        self.planes[asked[found]], self.leans[asked[found]] = planes[found], leans[found]

    def reaches(self) -> NDArray[np.float32]:
        """Return (n,) the largest spacing that the neighbours of each point allow it; infinite where they allow any."""
        shape, reach = self._shape(), np.full(len(self.points), np.inf, np.float32)
        is_strewn = self._is_strewn()
        is_plain = (shape.thickness2 < THIN**2) & (_lengths(self.leans) < AMIDST)
        is_asked = ~shape.known | (shape.thickness2 > THICK**2) | (not is_strewn) | ((self.levels > 0) & ~is_plain)
        for level in range(self.levels.max(initial=0) + 1):
            asked = np.flatnonzero(is_asked & (self.levels == level))
            if len(asked):
                far, alike = self._nearest(level, self.points[asked], self.planes[asked])
                share = 1 + np.clip((alike - ALIKE[0]) / (ALIKE[1] - ALIKE[0]), 0, is_strewn)
                share[is_plain[asked] & (alike > PLAIN)] = np.inf
                reach[asked] = far * np.where(shape.known[asked], DISC_REACH * share, BALL_REACH)
        return reach

    def _is_strewn(self) -> bool:
        """Return whether points are strewn over surfaces: only discs that are large close the gaps between them.

        Those of a scanner are not: its rays are even, so neighbours have neighbours as far away. Nor are those of
        leaves: the planes of neighbours are not alike.
        """
        asked = np.random.default_rng(0).choice(len(self.points), min(ASKED, len(self.points)), replace=False)
        radius = self._radius.of_level(0)
        offsets, known = neighbours(self._grid, self.points, asked, radius)
        order = np.argsort(np.where(known, np.einsum("nki,nki->nk", offsets, offsets), np.inf), axis=1)[:, :BESIDE]
        queries, own = np.zeros((2, *order.shape, 4), np.float32)
        queries[..., :3] = self.points[asked, None, :3] + radius * np.take_along_axis(offsets, order[..., None], 1)
        own[:, 0] = self.planes[asked]  # the nearest is the point itself
        far, alike = self._nearest(0, queries.reshape(-1, 4), own.reshape(-1, 4)).reshape(2, *order.shape)
        far, is_leafy = far[(far < radius).all(1)], np.mean(alike[:, 0] < ALIKE[0]) > LEAFY
        is_even = len(far) > 0 and np.quantile(far.std(1) / far.mean(1), SOME) < EVEN
        return not (is_leafy or is_even)

    def _nearest(self, level: int, queries: NDArray[np.float32], own: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (2, m) how far the sixth neighbours of some points are, and how alike the planes of all six lie."""
        found, _ = self._ask(NEAREST, level, queries, own)
        return found[:, :2].T * np.array([[self._radius.of_level(level)], [1]], np.float32)

    def _shape(self) -> FitShape:
        size = np.sqrt(np.einsum("nk,nk->n", self.planes[:, :3], self.planes[:, :3]))
        known = size > 0.5
        thickness2 = np.where(known, (size - 1) ** 2, np.float32(np.inf))
        off = np.maximum(self.planes[:, 3] ** 2 - OWN * self._noise2(), 0)
        return FitShape(known, thickness2, np.where(known, thickness2 + off, np.float32(NONE)))

    def _noise2(self) -> NDArray[np.float32]:
        """Return the square of the noise, radii, of each point."""
        by_level = [self._radius.noise_share(level) ** 2 for level in range(LEVELS + 1)]
        return np.array(by_level, np.float32)[self.levels]

    def _best_near(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return for each point the least value in the cells around its own."""
        grid = self._grid
        least = np.minimum.reduceat(values, grid.starts[:-1])
        runs = np.full((4, len(least) + 1), np.inf, np.float32)  # of none to three cells, one after the other
        for count in (1, 2, 3):
            runs[count, :-1] = least
            np.minimum(runs[count, :-1], runs[count - 1, 1:], out=runs[count, :-1])
        best = np.empty_like(least)

        def find(part: slice) -> None:
            first, end = grid.spans[part].transpose(2, 1, 0)
            best[part] = runs[end - first, first].min(0)

        by_threads(find, parts_of(len(best)))
        return np.repeat(best, np.diff(grid.starts))

    def _ask(
        self, shader: str, level: int, queries: NDArray[np.float32], own_map: NDArray[np.float32] | None = None
    ) -> list[NDArray[np.float32]]:
        """Return what a pass answers for some points, with the radius of a level."""
        radius = self._radius.of_level(level)
        is_wide = level == 0 and len(queries) > MANY * len(self.points)
        grid, order = (self._grid, slice(None)) if is_wide else self._around(queries, radius)
        near = Neighbourhood(self._context, grid, self.points[order], queries)
        has_noise = shader in (TRIMMED, EDGES)
        inputs: dict[str, Any] = {"noise": self._radius.noise_share(level) ** 2} if has_noise else {}
        try:
            if own_map is not None:
                inputs["own_map"] = value_texture(near, own_map)
            if shader == EDGES:
                inputs |= {"plane_map": value_texture(near, self._in_first_radii(order)), "unit": WIDER**-level}
            if shader == NEAREST:
                inputs["plane_map"] = value_texture(near, self.planes[order])
            most = max(self._radius.most, LOOKED_AT * (shader == NEAREST))
            return near.run(self._passes.fullscreen(shader), radius, most, **inputs)
        finally:
            near.release()

    def _around(self, queries: NDArray[np.float32], radius: float) -> tuple[CellGrid, NDArray[np.integer]]:
        """Return a grid of the points that lie within a radius of some, or a little further, and which these are."""
        fine = self._grid
        if radius <= fine.side:
            some = np.flatnonzero(_is_in_a_range(fine.ranges(np.unique(fine.keys_of(queries))), len(self.points)))
        else:
            first = CellGrid(self.points[fine.starts[:-1]], radius + fine.side)  # of each cell one point
            is_near = np.empty(len(fine.cells), bool)
            ranges = first.ranges(np.unique(first.keys_of(queries)))
            is_near[first.order] = _is_in_a_range(ranges, len(fine.cells))
            some = np.flatnonzero(np.repeat(is_near, np.diff(fine.starts)))
        grid = CellGrid(self.points[some], radius)
        return grid, some[grid.order]

    def _in_first_radii(self, order: NDArray[np.integer] | slice) -> NDArray[np.float32]:
        """Return planes with their lengths in the radius of the first level."""
        planes, levels = self.planes[order], self.levels[order]
        wide = np.flatnonzero((levels > 0) & any_of(planes))
        if len(wide):
            planes, factor = planes.copy(), np.float32(WIDER) ** levels[wide]
            size = np.sqrt(np.einsum("nk,nk->n", planes[wide, :3], planes[wide, :3]))
            planes[wide, :3] *= ((1 + (size - 1) * factor) / size)[:, None]
            planes[wide, 3] *= factor
        return planes


def _is_in_a_range(ranges: NDArray[np.int32], count: int) -> NDArray[np.bool_]:
    """Return (count,) which numbers lie in one of some ranges, (..., 2): from, to."""
    first, end = ranges.reshape(-1, 2).T
    return np.cumsum(np.bincount(first, minlength=count + 1) - np.bincount(end, minlength=count + 1))[:-1] > 0


LARGEST = 2.5  # median spacings: those of stray points are no plates
BORDER = 0.35  # radii by which the neighbours lie aside where a surface ends
LEANING = 1.2  # of a disc within the surface: .42 radii aside is one half, .6 a quarter
CORNER = 0.25  # and not less
ALONE = 3.0  # spacings: more where all points are stray ones
DOUBTFUL = 0.1  # radians: the expected error of a normal whose confidence is one half


class PlaneArrays(NamedTuple):
    """What the textures of CloudPlanes hold.

    order    (n,) which point of the input each one is
    points   (n, 4), planes (n, 4), details (n, 4)
    fit      within which radius the planes were fitted; None without points
    """

    order: NDArray[np.integer]
    points: NDArray[np.float32]
    planes: NDArray[np.float32]
    details: NDArray[np.float32]
    fit: FitRadius | None = None


class CloudPlanes(Owner):
    """The planes of a point cloud as textures for drawing it, sorted by cells, WIDTH points in a row.

    order    (n,) which point of the input each one is
    points   RGBA32F: xyz, 0
    planes   RGBA32F: unit normal, or 0 0 0 without a plane; spacing of the surface here
    details  RGBA32F: unit direction in which the surface goes on at its border, or 0 0 0; confidence of the normal,
             0 to 1

    Normals that are given are kept, those of length 0 are estimated; `noise` is measured unless it is given.
    """

    def __init__(
        self, context: moderngl.Context, positions: NDArray[np.float32],
        normals: NDArray[np.float32] | None = None, noise: float | None = None,
    ):  # fmt: skip
        super().__init__(context)
        found = find_planes(context, positions, normals, noise)
        self.count, self.order = len(positions), found.order
        with self._all_or_nothing():
            self.points = value_texture(self, found.points)
            self.planes = value_texture(self, found.planes)
            self.details = value_texture(self, found.details)

    def read_normals(self) -> NDArray[np.float32]:
        """Return (n, 3) in the order of the input: unit normals, 0 without a plane."""
        return self._unsorted(self.planes)[:, :3]

    def read_spacing(self) -> NDArray[np.float32]:
        """Return (n,) in the order of the input."""
        return self._unsorted(self.planes)[:, 3]

    def read_confidence(self) -> NDArray[np.float32]:
        """Return (n,) in the order of the input."""
        return self._unsorted(self.details)[:, 3]

    def _unsorted(self, texture: moderngl.Texture) -> NDArray[np.float32]:
        values = np.empty((self.count, 4), np.float32)
        values[self.order] = read_values(texture, self.count)
        return values


def find_planes(
    context: moderngl.Context, positions: NDArray[np.float32],
    normals: NDArray[np.float32] | None = None, noise: float | None = None,
) -> PlaneArrays:  # fmt: skip
    """Return what the textures of CloudPlanes hold, with nothing left on the GPU."""
    if not len(positions):
        none = np.zeros((0, 4), np.float32)
        return PlaneArrays(np.zeros(0, np.int64), none, none, none)
    spacing = estimate_spacing(positions)
    grid = CellGrid(positions, LEAST * spacing.length)
    points = _sorted(positions, grid)
    radius = fit_radius(grid, points, spacing.length, noise)
    if radius.length > grid.side:
        grid = CellGrid(positions, radius.length)
        points = _sorted(positions, grid)
    passes = FullscreenPasses(context)
    try:
        fit = CloudFit(context, passes, grid, points, radius)
        reaches = fit.reaches()
    finally:
        passes.release()
    planes, details = finished(fit.planes, fit.leans, fit.radii, spacing)
    np.minimum(planes[:, 3], reaches, out=planes[:, 3])
    if normals is not None:  # those that are given take the place of those that were found, and are trusted
        given = np.take(normals, grid.order, 0)
        size = np.sqrt(np.einsum("nk,nk->n", given, given))
        np.divide(given, size[:, None], out=planes[:, :3], where=(size > 0)[:, None])
        details[size > 0, 3] = 1
    return PlaneArrays(grid.order, points, planes, details, radius)


def _sorted(positions: NDArray[np.float32], grid: CellGrid) -> NDArray[np.float32]:
    points = np.zeros((len(positions), 4), np.float32)
    points[:, :3] = taken_by_threads(positions, grid.order)
    return points


def finished(
    plane: NDArray[np.float32], lean: NDArray[np.float32], radii: NDArray[np.float32], spacing: Spacing
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return what the textures `planes` and `details` hold.

    plane, lean  as the passes of CloudFit write them, radii: (n,) within which they fitted
    """
    planes, details = np.zeros_like(plane), np.zeros_like(plane)

    def fill(part: slice) -> None:
        count = np.maximum(lean[part, 3], 1)
        size = _lengths(plane[part])
        known = size > 0.5
        np.divide(plane[part, :3], size[:, None], out=planes[part, :3], where=known[:, None])
        aside = _lengths(lean[part])
        border = known & (aside > BORDER)
        np.divide(lean[part, :3], aside[:, None], out=details[part, :3], where=border[:, None])
        share = np.where(border, np.maximum(1 - LEANING * aside, CORNER), 1)
        planes[part, 3] = radii[part] * np.sqrt(np.pi * share / np.maximum(spacing.distinct * count, 1))
        error = 2 * np.maximum(size - 1, 0) / np.sqrt(count)  # of the slope of a plane through a disc
        details[part, 3] = np.where(known, 1 / (1 + (error / DOUBTFUL) ** 2), 0)

    by_threads(fill, parts_of(len(plane)))
    largest = LARGEST * min(float(np.median(planes[:, 3])), ALONE * spacing.length)
    np.minimum(planes[:, 3], np.float32(largest), out=planes[:, 3])
    return planes, details


def _lengths(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return (n,) the lengths of the first three of (n, 4)."""
    return np.sqrt(np.einsum("nk,nk->n", vectors[:, :3], vectors[:, :3]))
