"""The points of a cloud that are kept, where positions count from, which axis points up, and colours."""

from __future__ import annotations

import math
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import LARGEST
from ...notes.notes import Note
from ...notes.words import counted, option
from ...scene.cloud import Up
from ...scene.dense_part import STRAY, dense_part, main_points, sample_of
from ...scene.values import linear_to_bytes
from ..arrays.numpy_files import plain
from ..depth.depth_files import ramp
from .cloud_columns import COLOR_BY, CloudOptions, ColorLegend, FoundPoints

_LOSS = 1e-3  # of the points' spacing may be lost by float32
_COARSE = 5e-4  # units that float32 may be off in any case: half a millimetre
_FAR = 2.0  # sizes of a cloud from zero: nearer, another origin gains nothing
_HALF_STEP = 2.0**-24  # of a number: what float32 rounds it by at most
_NEIGHBOURS = 1500  # points that are compared with each other
_NEAREST = 0.47  # of sqrt(area / n) is the median way to the nearest of points that lie at random
_SEED = 31


def drop_invalid(found: FoundPoints, name: str, note: Note) -> None:
    """Leave out points that are nowhere: NaN, infinite or too far away."""
    at = found.positions
    if at.dtype.kind != "f" or not at.size or (np.abs((at.min(), at.max())) <= LARGEST).all():
        return
    good = np.asarray((np.abs(at) <= LARGEST).all(1))
    lost = counted(int(np.count_nonzero(~good)), "point")
    note(f"{name}: {lost} of {len(at)} lie nowhere (NaN or infinite): left out")
    found.select(good)


def keep_box(found: FoundPoints, crop: Any, name: str, note: Note) -> None:
    """Keep what lies between two opposite corners. Raises ValueError if nothing does."""
    if crop is None:
        return
    low, high = np.sort(np.reshape(crop, (2, 3)), axis=0)
    inside = ((found.positions >= low) & (found.positions <= high)).all(1)
    kept, count = int(np.count_nonzero(inside)), len(found)
    if not kept and count:
        low, high = (", ".join(f"{one:.10g}" for one in end) for end in main_box(found.positions))
        raise ValueError(f"{name} has no point in the box of {option('crop')}: its points lie from {low} to {high}")
    note(f"{name}: {kept} of its {counted(count, 'point')} lie in the box of {option('crop')}")
    found.select(inside)


def drop_strays(found: FoundPoints, name: str, note: Note) -> None:
    """Leave out points that lie far from all others."""
    strays = strays_of(found.positions)
    lost, count = int(np.count_nonzero(strays)), len(found)
    note(f"{name}: {lost} of its {counted(count, 'point')} lie far from all others: left out")
    found.select(~strays)


_PART = 1 << 20  # points at a time


def strays_of(positions: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Which points lie far from all others, few as they are."""
    part = dense_part(positions)
    if part is None:
        return np.zeros(len(positions), np.bool_)
    starts = range(0, len(positions), _PART)
    return ~np.concatenate([part.holds(positions[k : k + _PART]) for k in starts])


_ROWS = 16, 180  # of directions from a place, and twice as many columns: so many that most hold points
_PER_ROOT = 0.5  # rows for the root of the number of points
_BEHIND = 1.06  # times as far as the nearest there: it is hidden
_WORSE = 1e6  # times: where all places are hidden, the nearest counts
_RUNS = 8  # of points that follow each other, for each place
_UNEVEN = 10  # times as uneven as chance are runs of files that hold one scan after the other


def places_of(positions: NDArray[np.floating], places: NDArray[np.float64]) -> NDArray[np.float64]:
    """From which of several places (k, 3) each point is seen, (n, 3): the nearest that nothing hides. Of one (3,). In a
    file that holds one scan after the other it is the one from which most points beside it are."""
    if len(places) == 1:
        return places[0].astype(np.float64)
    chosen, best = np.zeros(len(positions), np.int64), np.full(len(positions), np.inf)
    rows = int(np.clip(_PER_ROOT * math.sqrt(len(positions)), *_ROWS))
    nearest = np.full((len(places), 2 * rows * rows), np.inf)
    for k, place in enumerate(places):
        cells, away = _seen_at(positions, place, rows)
        np.minimum.at(nearest[k], cells, away)
        cost = np.where(away > _BEHIND * nearest[k, cells], _WORSE, 1) * away
        better = cost < best
        best[better], chosen[better] = cost[better], k
    wanted = _of_runs(chosen, len(places))
    for k, place in enumerate(places):
        others = np.flatnonzero((wanted == k) & (chosen != k))
        cells, away = _seen_at(positions[others], place, rows)
        chosen[others[away <= _BEHIND * nearest[k, cells]]] = k
    return places[chosen]


def _of_runs(chosen: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """What most points of the run round each one have, where runs differ; else what each one has."""
    length = len(chosen) // (_RUNS * count)
    if length < _RUNS:
        return chosen
    shares = np.stack(
        [(chosen[: len(chosen) // length * length] == k).reshape(-1, length).mean(1) for k in range(count)]
    )
    usual = shares.mean(1)
    if (shares.var(1) <= _UNEVEN * usual * (1 - usual) / length).all():
        return chosen
    most = np.repeat(shares.argmax(0), length)
    return np.append(most, chosen[len(most) :])


def _seen_at(
    positions: NDArray[np.floating], place: NDArray[np.float64], rows: int
) -> tuple[NDArray[np.int64], NDArray[Any]]:
    """In which direction each point is seen from a place, as the number of a cell, and how far away."""
    columns = 2 * rows
    x, y, z = (positions - place).T
    level = np.hypot(x, y)
    row = ((np.arctan2(z, level) / np.pi + 0.5) * rows).astype(np.int64).clip(0, rows - 1)
    column = ((np.arctan2(y, x) / (2 * np.pi) + 0.5) * columns).astype(np.int64).clip(0, columns - 1)
    return row * columns + column, np.hypot(level, z)


def drop_unreturned(found: FoundPoints, name: str, note: Note) -> None:
    """Leave out points at (0, 0, 0), as scanners write returns that never came; a single one may be a point."""
    at = found.positions
    some = sample_of(at)
    if not len(some) or some[:, 0].all() or some.any(1).all():  # 10 million are not looked at for nothing
        return
    good = np.asarray(at.any(1))
    lost = int(np.count_nonzero(~good))
    if lost < 2 or lost == len(at):
        return
    keeps = option("all_points", True)
    note(f"{name}: {lost} of {len(at)} points lie at (0, 0, 0), returns that never came: left out; {keeps} keeps them")
    found.select(good)


def keep_most(found: FoundPoints, most: int | None, name: str, note: Note) -> None:
    """Keep an even sample, one point of each of so many equal parts of the file."""
    count = len(found)
    if most is None or count <= most:
        return
    edges = np.arange(most + 1) * count // most
    within = np.random.default_rng(_SEED).random(most) * np.diff(edges)
    found.select(edges[:-1] + within.astype(np.int64))
    note(f"{name}: {most} of its {counted(count, 'point')} are read, an even sample")


_AROUND = 40_075_017 / 360  # metres of a degree along the equator
_POLES = 40_007_863 / 360  # and from pole to pole
_SMALL = 100.0  # sides from 0 do places on the earth lie at least
_STEEP = 500.0  # times larger than both other sides is the height of what lies in degrees, and of nothing else


def to_metres(found: FoundPoints, name: str, note: Note) -> None:
    """Turn longitude and latitude into metres."""
    if found.in_degrees is False or not len(found):
        return
    order, is_certain = _degrees_in(found.positions)
    if found.in_degrees is None and not is_certain:
        if order:
            names = option("columns", f"{','.join(order)},z,...")
            note(f"{name}: its x and y may be degrees, which show nothing of their shape: pass {names} if they are")
        return
    if found.in_degrees is None and order == _LATITUDE_FIRST:
        found.positions = found.positions[:, [1, 0, 2]]
    low, high = main_box(found.positions)
    latitude = float(np.clip((low[1] + high[1]) / 2, -90, 90))
    metres = np.array([_AROUND * np.cos(np.radians(latitude)), _POLES, 1.0])
    found.positions, found.up = found.positions * metres, found.up or "z"
    found.up_from = found.up_from or "x and y are degrees"
    other = "" if found.in_degrees else f"; pass {option('columns', 'x,y,z,...')} if they are metres"
    which = "latitude and longitude" if order == _LATITUDE_FIRST else "longitude and latitude"
    become = f"they become metres, by the latitude {latitude:.4g}, and z counts as metres{other}"
    note(f"{name}: x and y are degrees, {which}: {become}")


_LONGITUDE_FIRST, _LATITUDE_FIRST = ("lon", "lat"), ("lat", "lon")


def _degrees_in(positions: NDArray[Any]) -> tuple[tuple[str, str] | None, bool]:
    """The order of longitude and latitude if x and y may be these, and whether they are: heights show it."""
    low, high = main_box(positions)
    sides, farthest = high - low, np.maximum(np.abs(low), np.abs(high))[:2]
    side = sides[:2].max()
    if not (0 < side < 2 and farthest.min() <= 90 and farthest.max() <= 180 and farthest.max() > _SMALL * side):
        return None, False
    order = _LATITUDE_FIRST if farthest[1] > 90 else _LONGITUDE_FIRST
    is_certain = bool(sides[2] > _STEEP * side)
    return (order if is_certain or farthest.max() > 10 * _SMALL * side else None), is_certain


def placed(found: FoundPoints, name: str, note: Note) -> tuple[NDArray[np.floating], NDArray[np.float64]]:
    """Positions (n, 3), and the origin (3,) that they count from: zero, where float32 distinguishes points from there.
    Else the origin is the middle, in whole units. Positions stay float64 only where float32 loses points even so."""
    at, origin = found.positions, _origin(found)
    if origin.any() and at.dtype == np.float32 and found.origin is None:
        step = 2 * _HALF_STEP * np.abs(main_box(at)).max()
        lost = "finer detail was lost when it was written; write doubles, or take an offset from them first"
        note(f"{name}: its coordinates are float32 and lie so far from 0 that they are {step:.2g} apart: {lost}")
    if origin.any():
        at = at.astype(np.float64, copy=False) - origin  # never the other way round: float32 has lost them by then
    if at.dtype == np.float32:
        return at, origin
    return at.astype(np.float64 if len(at) and _is_lost(at) else np.float32, copy=False), origin


def _origin(found: FoundPoints) -> NDArray[np.float64]:
    if found.origin is not None:
        return found.origin
    if not len(found):
        return np.zeros(3)
    low, high = main_box(found.positions)
    farthest = max(np.abs(low).max(), np.abs(high).max())
    is_far, is_coarse = farthest > _FAR * (high - low).max(), farthest * _HALF_STEP > _COARSE
    return np.rint((low + high) / 2) if is_far and (is_coarse or _is_lost(found.positions)) else np.zeros(3)


def _is_lost(positions: NDArray[np.floating]) -> bool:
    """Whether float32 moves points by more than a small share of their spacing."""
    low, high = main_box(positions)
    farthest = max(np.abs(low).max(), np.abs(high).max())
    return bool(farthest * _HALF_STEP > _LOSS * (spacing_of(positions) or 1.0))


def main_box(positions: NDArray[np.floating]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper corner (3,) of the box of all points but stray ones."""
    low, high = np.quantile(main_points(positions).astype(np.float64), (STRAY, 1 - STRAY), axis=0)
    return low, high


def spacing_of(positions: NDArray[np.floating]) -> float:
    """About sqrt(area / n): how far a point of the surface is from the next; 0 for less than two different points."""
    if len(positions) < 2:
        return 0.0
    count = min(_NEIGHBOURS, len(positions))
    chosen = np.random.default_rng(_SEED).choice(len(positions), count, replace=False, shuffle=False)
    some = positions[chosen].astype(np.float64)
    squared = sum(np.square(one[:, None] - one) for one in some.T)
    nearest = np.sqrt(np.where(squared > 0, squared, np.inf).min(1))
    middle = float(np.median(nearest))
    return middle / _NEAREST * float(np.sqrt(count / len(positions))) if np.isfinite(middle) else 0.0


_FLAT = 0.4  # of both other sides is the height of a terrain or a street, at most
_UP_SAMPLE = 60_000  # points whose planes are looked at
_CELLS = 24  # of the longest side
_FEWEST = 6  # points of a cell that show its plane
_PLANES = 30  # that must be there to decide
_THIN = 0.15  # of its width is the thickness of such a plane
_UPRIGHT = np.cos(np.radians(10))
_CLEAR = 0.3  # of the planes face along one axis
_AHEAD = 1.5  # times as many as along the next
_WIDEST = 1.2  # slope of a camera's rays, which see up to 100 degrees
_DEEP = 0.1  # of the farthest point's distance lies between the nearest and it: a terrain from above has less
_RANDOM = 7  # seed


def guess_up(positions: NDArray[np.floating], is_far: bool) -> tuple[Up, str]:
    """Which axis points up, and why. is_far: the positions are those of a map, where z is the height."""
    if is_far:
        return "z", "its coordinates are those of a map"
    if len(positions) < _FEWEST:
        return "y", "nothing shows it"
    low, high = main_box(positions)
    sides = high - low
    least, middle = np.argsort(sides)[:2]
    if least != 0 and sides[least] < _FLAT * sides[middle]:
        return _directed("xyz"[least], positions, least), "it is least high there"
    normals = _planes(positions, low, sides.max())
    shares = (np.abs(normals) > _UPRIGHT).mean(0) if len(normals) >= _PLANES else np.zeros(3)
    first = int(np.argmax(shares[1:])) + 1
    if shares[first] > _CLEAR and shares[first] > _AHEAD * np.delete(shares, first).max():
        return _directed("xyz"[first], positions, first), "most of its planes lie level so"
    return "y", "nothing shows it"


_OTHER = {"x": "z", "y": "z", "z": "y"}  # what is most likely if it is not that


def up_of(
    found: FoundPoints, positions: NDArray[Any], origin: NDArray[Any], given: Up | None, name: str, note: Note
) -> Up:
    """Which axis points up: as given, as the file says it, or a guess, with a note."""
    if given is not None:
        found.up_from = option("up")
        return given
    if found.up is None:
        found.up, found.up_from = guess_up(positions, bool(origin.any()))
        found.up_is_guessed = True
    if found.up_is_guessed:
        other = option("up", _OTHER[found.up[-1]])
        note(f"{name}: up is taken as {found.up} ({found.up_from}); pass {other} if it is not")
    return found.up


def is_before_camera(positions: NDArray[np.floating]) -> bool:
    """Whether all points lie in the view of a camera at the origin that looks along z, as those of depth cameras do."""
    some = positions[:: -(-len(positions) // _UP_SAMPLE)] if len(positions) else positions
    some = some[np.isfinite(some).all(1)].astype(np.float64)
    if len(some) < _FEWEST or some[:, 2].min() <= 0:
        return False
    slopes = np.abs(some[:, :2] / some[:, 2:])
    return bool(slopes.max() < _WIDEST and np.ptp(some[:, 2]) > _DEEP * some[:, 2].max())


def _directed(axis: str, positions: NDArray[np.floating], k: int) -> Up:
    """The axis with its sign. y points down where most points lie in its upper half, as ground does; z never does."""
    if axis == "z":
        return "z"
    some = positions[:: -(-len(positions) // _UP_SAMPLE), k].astype(np.float64)
    low, middle, high = np.quantile(some, (0.02, 0.5, 0.98))
    return "-y" if high - middle < 0.5 * (middle - low) else "y"


def _planes(positions: NDArray[np.floating], low: NDArray[np.float64], size: float) -> NDArray[np.float64]:
    """(m, 3) unit normals of the cells of a coarse grid in which the points lie in a plane."""
    chosen = np.random.default_rng(_RANDOM).integers(0, len(positions), min(_UP_SAMPLE, len(positions)))
    some = (positions[chosen] - low) / (size or 1.0) * _CELLS
    some = some[(np.abs(some) < 2 * _CELLS).all(1)]
    cells = np.floor(some).astype(np.int64)
    _, cell, counts = np.unique(cells @ np.array([1, 10**3, 10**6]), return_inverse=True, return_counts=True)
    middle = np.stack([np.bincount(cell, some[:, k], len(counts)) for k in range(3)], -1) / counts[:, None]
    away = some - middle[cell]
    axes = combinations_with_replacement(range(3), 2)
    products = [np.bincount(cell, away[:, i] * away[:, j], len(counts)) for i, j in axes]
    enough = counts >= _FEWEST
    xx, xy, xz, yy, yz, zz = (one[enough] for one in products)
    values, vectors = np.linalg.eigh(np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], -1).reshape(-1, 3, 3))
    is_flat = (values[:, 0] < _THIN**2 * values[:, 1]) & (values[:, 1] > 0)
    return vectors[is_flat, :, 0]


_ENDS = 0.02, 0.98  # quantiles of the intensity that become the darkest grey and white
DARKEST = 0.05  # linear: what is black answers no light
_SAMPLE = 1 << 16
_GREY = (150, 150, 150)
_CLASS_NAMES = {
    0: "never classified", 1: "unassigned", 2: "ground", 3: "low plants", 4: "middle plants", 5: "high plants",
    6: "building", 7: "low noise", 9: "water", 10: "rail", 11: "road", 13: "wire guard", 14: "wire", 15: "tower",
    17: "bridge", 18: "high noise",
}  # fmt: skip
_CLASSES = {  # of ASPRS, LAS 1.4
    2: (160, 120, 80), 3: (150, 190, 90), 4: (100, 165, 70), 5: (45, 120, 50), 6: (205, 85, 65), 7: (230, 60, 200),
    8: (230, 170, 60), 9: (60, 120, 215), 10: (120, 80, 160), 11: (95, 95, 105), 13: (240, 220, 90),
    14: (240, 200, 40), 15: (200, 140, 220), 16: (250, 230, 130), 17: (190, 190, 215), 18: (250, 30, 60),
}  # fmt: skip


def colors_of(found: FoundPoints, options: CloudOptions, up: Up, name: str, note: Note) -> NDArray[np.uint8] | None:
    """The colours, None for a cloud without any. Raises ValueError for a choice that the file does not have."""
    color_by, limits = options.color_by, options.color_range
    if color_by in COLOR_BY and color_by in choices(found):
        if limits is not None and color_by in ("rgb", "class"):
            raise ValueError(f"{option('color_range')} is of numbers: leave it out with {option('color_by', color_by)}")
    elif color_by:
        field = found.field_named(color_by)
        if field is None:
            some = ", ".join(choices(found))
            raise ValueError(f"{name} has no {color_by} for {option('color_by')}, only {some}")
        return _by_field(found, field, limits, name, note)
    elif limits is not None:
        raise ValueError(f"{option('color_range')} needs {option('color_by')}, a field of numbers")
    if color_by == "height":
        low, high = limits or _heights(found, up)
        _explain(found, color_by, low, high, ramp("viridis"), name, note)
        return _by_height(found, up, low, high)
    if color_by == "class":
        return _by_class(found)
    if color_by == "intensity":
        low, high = limits or _ends(np.nan_to_num(np.asarray(found.intensity), posinf=0, neginf=0))
        _explain(found, color_by, low, high, _greys()[:, None].repeat(3, 1), name, note)
        return _grey(np.asarray(found.intensity), (low, high))
    if found.colors is not None:
        return _bytes(found.colors)
    if found.intensity is None:
        return None
    low, middle, high = np.nan_to_num(np.quantile(_some(found.intensity), (_ENDS[0], 0.5, _ENDS[1])))
    # the least or the largest intensity of most points shows nothing of the surface
    return None if middle in (low, high) else _grey(found.intensity)


def choices(found: FoundPoints) -> list[str]:
    columns = {"rgb": found.colors, "intensity": found.intensity, "class": found.classes, "height": found.positions}
    known = [one for one in COLOR_BY if columns[one] is not None]
    return known + [name for name in found.fields if name not in known]


_LABELS = ("label", "class", "segment", "instance", "cluster", "object", "semantic", "category", "return", "id")
_MOST_LABELS = 24  # that have colours of their own
_DISTINCT = (  # far from each other to the eye, the farthest first (CIE Lab)
    (31, 119, 180), (255, 127, 14), (44, 160, 44), (214, 39, 40), (148, 103, 189), (240, 220, 60), (23, 190, 207),
    (227, 119, 194), (140, 86, 75), (188, 225, 120), (60, 60, 70), (250, 190, 160), (0, 90, 90), (150, 10, 90),
    (120, 140, 255), (128, 128, 0), (200, 170, 250), (0, 220, 130), (90, 50, 0), (190, 190, 190), (255, 80, 140),
    (20, 40, 130), (170, 255, 230), (110, 120, 110),
)  # fmt: skip


def _by_field(
    found: FoundPoints, field: str, limits: tuple[float, float] | None, name: str, note: Note
) -> NDArray[np.uint8]:
    """Colours by any numbers of the points. A label has its own, grey is what is not known."""
    values = np.asarray(found.fields[field])
    values = values.astype(np.float64) if values.dtype.kind == "b" else values
    known = np.isfinite(values)
    labels = _labels(values[known], field) if limits is None else None
    colors = np.full((len(values), 3), _GREY, np.uint8)
    if labels is not None:
        table = np.array(_DISTINCT, np.uint8)
        is_small = len(labels) and labels[0] >= 0 and labels[-1] < _MOST_LABELS  # these look alike in every file
        numbers = values[known].astype(np.int64) if is_small else np.searchsorted(labels, values[known])
        colors[known] = table[numbers % _MOST_LABELS]
        shown = labels.astype(np.int64) if is_small else np.arange(len(labels))
        texts = [f"{one:g}" for one in labels]
        found.legend = ColorLegend(field, texts[:_MOST_LABELS], table[shown % _MOST_LABELS][:_MOST_LABELS])
        more = f": {', '.join(texts[:_MOST_LABELS])}" + (", ..." if len(labels) > _MOST_LABELS else "")
        note(f"{name}: coloured by {field}, {counted(len(labels), 'label')}{more}")
        return colors
    low, high = limits or _ends(values[known])
    share = (values[known].astype(np.float64) - low) / ((high - low) or 1.0)
    colors[known] = ramp("viridis")[(share * 255).clip(0, 255).astype(np.uint8)]
    _explain(found, field, low, high, ramp("viridis"), name, note)
    return colors


def _labels(values: NDArray[Any], field: str) -> NDArray[Any] | None:
    """The labels of a field that has some, in their order; None for numbers."""
    some = _some(values)
    if not len(values) or not (some % 1 == 0).all():
        return None
    is_named = any(word in plain(field).removeprefix("scalar") for word in _LABELS)
    if len(np.unique(some)) > (_SAMPLE if is_named else _MOST_LABELS):
        return None
    labels = np.unique(values)
    return labels if (labels % 1 == 0).all() and (is_named or len(labels) <= _MOST_LABELS) else None


def _ends(values: NDArray[Any]) -> tuple[float, float]:
    """The lowest and the highest number but stray ones."""
    if not len(values):
        return 0.0, 1.0
    low, high = (float(one) for one in np.quantile(_some(values).astype(np.float64), _ENDS))
    return (low, high) if low < high else (float(values.min()), float(values.max()))


def _explain(
    found: FoundPoints, title: str, low: float, high: float, row: NDArray[np.uint8], name: str, note: Note
) -> None:
    """Say between which numbers the colours of a row lie."""
    largest, span = max(abs(low), abs(high)), high - low  # as many digits as tell them apart
    digits = min(4 + max(0, int(np.log10(largest / span))), 15) if span > 0 and largest > 0 else 4
    first, last = (f"{float(f'{one:.{digits}g}'):.12g}" for one in (low, high))
    found.legend = ColorLegend(title, [first, last], row)
    words = ("black", "white") if (row[:, :1] == row).all() else ("dark blue", "yellow")
    note(f"{name}: coloured by {title}, {first} {words[0]} to {last} {words[1]}; {option('color_range')} sets these")


def _by_class(found: FoundPoints) -> NDArray[np.uint8]:
    table = np.full((256, 3), _GREY, np.uint8)
    table[[*_CLASSES]] = [*_CLASSES.values()]
    numbers = np.asarray(found.classes).astype(np.int64).clip(0, 255)
    shown = np.flatnonzero(np.bincount(numbers, minlength=256))[:_MOST_LABELS]
    texts = [f"{one} {_CLASS_NAMES.get(one, '')}".strip() for one in shown.tolist()]
    found.legend = ColorLegend("class", texts, table[shown])
    return table[numbers]


def _some(values: NDArray[Any]) -> NDArray[Any]:
    return values[:: -(-len(values) // _SAMPLE)] if len(values) else np.zeros(1)


def _bytes(colors: NDArray[Any]) -> NDArray[np.uint8]:
    """Colours of 8 bits, of 16 bits, of 0 to 1 or of 0 to 255: the largest value shows which."""
    if colors.dtype == np.uint8 or not colors.size:
        return colors.astype(np.uint8, copy=False)
    largest = np.nanmax(colors)
    if colors.dtype.kind == "f":
        scale = 255.0 if largest <= 1 else 1.0 if largest <= 255 else 1 / 257
    else:
        scale = 1.0 if largest <= 255 else 1 / 257
    return np.rint(np.nan_to_num(colors.astype(np.float32) * np.float32(scale)).clip(0, 255)).astype(np.uint8)


def _grey(intensity: NDArray[Any], limits: tuple[float, float] | None = None) -> NDArray[np.uint8]:
    values = np.nan_to_num(intensity.astype(np.float32), posinf=0, neginf=0)
    if not values.size:
        return np.empty((0, 3), np.uint8)
    low, high = limits or np.quantile(_some(values), _ENDS)
    share = ((values - np.float32(low)) / np.float32(high - low if high > low else 1.0)).clip(0, 1)
    return np.repeat(_greys()[np.rint(255 * share).astype(np.uint8)][:, None], 3, 1)


def _greys() -> NDArray[np.uint8]:
    return linear_to_bytes(DARKEST + (1 - DARKEST) * np.arange(256) / 255)  # reflected light is linear


def _heights(found: FoundPoints, up: Up) -> tuple[float, float]:
    """The lowest and the highest place but those of stray points."""
    if not len(found):
        return 0.0, 1.0
    low, high = sorted(_sign(up) * float(corner["xyz".index(up[-1])]) for corner in main_box(found.positions))
    return low, high


def _by_height(found: FoundPoints, up: Up, low: float, high: float) -> NDArray[np.uint8]:
    """From the lowest point, dark blue, to the highest, yellow; stray points have the colours of the ends."""
    share = (_sign(up) * found.positions[:, "xyz".index(up[-1])] - low) / ((high - low) or 1.0)
    return ramp("viridis")[(share * 255).clip(0, 255).astype(np.uint8)]


def _sign(up: Up) -> int:
    return -1 if up[0] == "-" else 1


_EVEN = 0.1  # lengths may differ by this share
_UNITS = 0.9  # of the known normals must be that long


def units_of(found: FoundPoints, name: str, note: Note) -> NDArray[np.float32] | None:
    """Normals of length 1, or 0 where they are unknown; None if all are, and where the field holds no normals."""
    if found.normals is None or not len(found):
        return None
    some = _some(found.normals).astype(np.float64)
    lengths = np.linalg.norm(some, axis=1)
    lengths = lengths[np.isfinite(lengths) & (lengths > 0)]
    if len(lengths) and (np.abs(lengths / np.median(lengths) - 1) < _EVEN).mean() < _UNITS:
        low, high = np.quantile(lengths, _ENDS)
        ends = f"from {low:.3g} to {high:.3g} and not to 1: they are left out, normals are estimated"
        note(f"{name}: its fields called normals hold none, their lengths go {ends}")
        return None
    normals = found.normals.astype(np.float32)
    lengths = np.linalg.norm(normals, axis=1)
    is_known = np.isfinite(lengths) & (lengths > 0)
    if not is_known.any():
        note(f"{name}: its normals are all 0 or NaN: they are left out, normals are estimated")
        return None
    if np.abs(lengths[is_known] - 1).max() > 1e-6 or not is_known.all():
        normals = np.where(is_known[:, None], normals / lengths[:, None], 0).astype(np.float32)
    return normals
