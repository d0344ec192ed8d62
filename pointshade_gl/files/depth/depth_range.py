"""Depth between a near and a far plane: depth buffers of OpenGL, and linear depth in which white is near."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import check_positive
from ...notes.notes import Note
from ...notes.words import option
from ...scene.camera import Camera
from ...scene.values import median
from . import missing_depth
from .depth_kinds import FARTHEST, NEAREST, Coding, Decoded, DepthHints, NearFar
from .planes import direction_of, measure_bending, offset_by_corners, offset_by_flatness

_FULL = (1, 2**8 - 1, 2**16 - 1, 2**24 - 1, 2**32 - 1)  # what a value of 1 is stored as
_MIDDLE = 2.0  # metres: near is the power of ten that puts the middle of a buffer closest to them
_USUAL_RATIO = 1000.0  # far to near
_TOO_FAR = 0.5  # with the usual far plane, what is seen ends before twice that distance
_INFINITE = 1e-7  # a far plane beyond so many times the near one is none
_SKY = 0.005  # of the pixels that are exactly 1: a background
_FLAT = 0.8  # bending of a plane in a buffer, at most
_NOT_BENT, _BENT = 1.2, 3.0  # z against the values themselves: more, and less, than that
_CLOSE = 1.15  # where 1/z is 0 is below that in a buffer whose far plane is ten times as far away as the near one
_HIGH = 0.5  # buffers seldom have anything below it: near planes are close to the eye
_MANY = 0.4  # of the pixels above that make a picture of 16 bits worth a look
_HALF_VIEW = math.tan(math.radians(30))  # across the longer side
_REVERSED = 0.05  # of all values: where 1/z is 0 is at most so far from 0 in a buffer of reversed z


class _Levels(NamedTuple):
    """A picture's values from 0, or -1, to 1, and which pixels have a depth if it is a buffer."""

    values: NDArray[np.float64]
    known: NDArray[np.bool_]
    full: float  # the raw value that is 1

    @classmethod
    def of(cls, raw: NDArray[Any], full: float) -> _Levels:
        values = raw / full
        known = np.isfinite(values) & (values < 1) & (values != 0)
        return cls(values, known & (values > 0) if values.min(where=known, initial=0) >= 0 else known, full)

    @property
    def has_sky(self) -> bool:
        """Return whether many pixels are exactly 1, where nothing was drawn."""
        return bool(np.count_nonzero(self.values == 1) > _SKY * self.values.size)

    @property
    def lowest(self) -> float:
        """What the near plane has: 0 in windows, -1 in clip coordinates."""
        return -1.0 if self.values.min(where=self.known, initial=0) < 0 else 0.0


def full_value(raw: NDArray[Any], hints: DepthHints) -> float:
    """Return the raw value that means 1. Raises ValueError if it is not known."""
    if hints.scale is not None:
        return hints.scale
    if raw.dtype.kind == "u" and raw.dtype.itemsize <= 2:
        return float(np.iinfo(raw.dtype).max)
    most = float(np.max(raw, where=np.isfinite(raw), initial=0))
    if raw.dtype.kind == "f" and most <= 1.001:
        return 1.0
    sizes = _FULL[:3] if raw.dtype.kind == "f" else _FULL
    found = next((one for one in sizes if one >= most and (one > 255 or most == one)), None)
    if found is None:
        raise ValueError(f"depth goes up to {most:g}, expected values from 0 to 1: pass {option('depth_scale')}")
    return float(found)


def read_range(raw: NDArray[Any], name: str, hints: DepthHints, note: Note) -> Decoded:
    """Read a kind of depth between two planes that is said. Raises ValueError for values of unknown range."""
    levels = _Levels.of(raw, full_value(raw, hints))
    if hints.any_kind == "reversed":
        return _reversed(raw, levels.full, name, "as said", hints, note)
    offset = None if hints.has_range else _offset(levels, hints.known_camera)
    return _buffer(raw, levels, offset, name, "as said", hints, note)


def find_range(
    raw: NDArray[Any], counts: NDArray[np.int64] | None, name: str, hints: DepthHints, note: Note
) -> Decoded | None:
    """Recognise a depth buffer, or reversed depth, by its range and its planes; None for anything else."""
    full = _buffers_full(raw, counts)
    if full is None:
        return None
    levels = _Levels.of(raw, full)
    if not levels.known.any():
        return None
    is_buffer, offset = _recognise(levels, hints)
    if is_buffer:
        return _buffer(raw, levels, offset, name, "planes, as in a depth buffer", hints, note)
    if full != 255 and levels.lowest == 0 and direction_of(levels.values, levels.known) < 0:
        return _reversed(raw, full, name, "by its planes", hints, note)
    if full == 1 and levels.lowest == 0 and _may_be_buffer(levels):
        way_out = f"pass {option('depth_kind', 'buffer')} with {option('near')} and {option('far')} if it is one"
        note(f"the values of {name} are just below 1, as in a depth buffer of OpenGL: {way_out}")
    return None


def _may_be_buffer(levels: _Levels) -> bool:
    """Return whether values are such that only planes could show that they are metres, and these do not."""
    if not levels.has_sky and levels.values[levels.known].min() < _HIGH:
        return False
    bending = measure_bending(levels.values, levels.known, 0.0)
    return bending is None or not bending.is_surely(_NOT_BENT, _BENT)


def _recognise(levels: _Levels, hints: DepthHints) -> tuple[bool, float | None]:
    """Whether it is a buffer, and the value at which 1/z is 0 if right angles show it."""
    seen = levels.values[levels.known]
    low, high = float(seen.min()), float(seen.max())
    is_filled = low < 0.02 and high > 0.98 and not levels.has_sky
    is_straight = levels.full == 255  # too few levels to see planes
    if not is_straight:
        of_range, of_values = (measure_bending(levels.values, levels.known, zero) for zero in (None, 0.0))
        if of_range is None or of_values is None or not of_range.is_surely(-_FLAT, _FLAT):
            return False, None
        # z bends by 2. Where all values are alike, noise hides that
        is_straight = of_values.is_surely(-np.inf, _NOT_BENT)
    # networks fill their range: then only a known camera's right angles show a buffer
    camera = hints.known_camera
    offset = None if is_filled and camera is None else _offset(levels, camera)
    if offset is None:
        # nothing but a buffer has most of its values close to 1; floors lie below what stands on them
        is_high = low > _HIGH and (levels.full > 255 or _rises(levels))
        is_told = hints.has_range and not is_filled
        return is_straight and (levels.has_sky or is_high or is_told), None
    if offset > high:
        return is_straight or offset < _CLOSE, offset
    is_small = levels.lowest - _REVERSED < offset < low
    return is_straight and is_small and levels.full == 1 and not is_filled and camera is not None, offset


def _buffers_full(raw: NDArray[Any], counts: NDArray[np.int64] | None) -> float | None:
    """The raw value that is 1, if the range of values is one that a buffer may have."""
    if counts is not None:
        return 65535.0 if counts[2**15 :].sum() > _MANY * counts.sum() else None
    if raw.dtype == np.uint8:
        return 255.0 if raw.min(where=raw > 0, initial=255) > _HIGH * 255 else None  # networks fill all 8 bits
    some = missing_depth.some_values(raw)
    if raw.dtype.kind in "iu" and some.size and np.mean(some > 2**23) > _MANY:
        return full_value(raw, DepthHints())
    if raw.dtype.kind != "f" or not some.size or some.max() > 1 or some.min() < -1:
        return None
    return 1.0 if np.max(raw, where=np.isfinite(raw), initial=0) <= 1 else None


def _offset(levels: _Levels, camera: Camera | None) -> float | None:
    """The value at which 1/z is 0, as right angles show it to a camera; that of a phone if it is not known."""
    height, width = levels.values.shape
    if camera is None:
        camera = Camera.from_fov(2 * math.degrees(math.atan(_HALF_VIEW * height / max(height, width))), width, height)
    return offset_by_corners(levels.values, levels.known, camera, 1 / levels.full if levels.full > 1 else 0)


def _rises(levels: _Levels) -> bool:
    """Return whether values are larger in the upper quarter of the picture than in the lower one."""
    quarter = len(levels.values) // 4
    above, below = (levels.values[rows][levels.known[rows]] for rows in (np.s_[:quarter], np.s_[-quarter:]))
    return above.size > 0 and below.size > 0 and median(above) > median(below)


def _buffer(
    raw: NDArray[Any], levels: _Levels, offset: float | None, name: str, why: str, hints: DepthHints, note: Note
) -> Decoded:
    """The buffer, with near and far as they are given, or as its corners and its middle show them."""
    planes = _guess_planes(levels, offset, hints)
    is_said = why == "as said"
    found = "as given" if hints.has_range else "as its corners show" if offset is not None else "which is usual"
    ends = f"near {planes.near:.3g} m, far {planes.far:.3g} m ({found})"
    if not (hints.has_range and is_said):
        unit = "" if hints.has_range else ", so that its unit is a guess"
        way_out = _way_out(is_said)
        note(f"{name} is {'read' if is_said else 'taken'} as a depth buffer, {ends}{unit}: {way_out}")
    return Decoded(raw, Coding("buffer", levels.full, f"{why}; {ends}", planes=planes))


def _way_out(is_said: bool) -> str:
    none = "" if is_said else f", or {option('depth_kind', 'inverse', 'z')} if it is none"
    return f"pass {option('near')} and {option('far')}{none}"


def _guess_planes(levels: _Levels, offset: float | None, hints: DepthHints) -> NearFar:
    """The metres of the near plane's value and of 1: z is unit / |offset - value|."""
    lowest, seen = levels.lowest, levels.values[levels.known]
    if hints.near is not None and hints.far is not None:
        return NearFar(hints.near, hints.far, lowest)
    high, middle = (float(seen.max()), median(seen)) if seen.size else (1.0, 0.5)
    if offset is None:
        usual = (1 - lowest) / (_USUAL_RATIO - 1)
        offset = max(1 + usual if 1 - high > _TOO_FAR * usual else 1.0, high + 1e-9)
    if offset > middle:
        at_lowest, at_1 = offset - lowest, max(offset - 1, 0.0)
    else:  # reversed z: 1 is near
        at_lowest, at_1 = max(lowest - offset, 0.0), 1 - offset
    nearest = max(at_lowest, at_1)
    unit = nearest * 10.0 ** round(math.log10(_MIDDLE * abs(offset - middle) / nearest))
    if hints.near is not None and hints.near < np.inf:
        unit = hints.near * at_lowest
    elif hints.far is not None and hints.far < np.inf:
        unit = hints.far * at_1
    near, far = (unit / one if one > _INFINITE * nearest else np.inf for one in (at_lowest, at_1))
    return NearFar(near, far, lowest)


def read_reversed(raw: NDArray[Any], name: str, why: str, hints: DepthHints, note: Note) -> Decoded:
    """Linear depth in which white is near, as planes in it show."""
    return _reversed(raw, full_value(raw, hints), name, why, hints, note)


def _reversed(raw: NDArray[Any], full: float, name: str, why: str, hints: DepthHints, note: Note) -> Decoded:
    if hints.near is not None and hints.far is not None:
        return Decoded(raw, Coding("reversed", full, why, planes=NearFar(hints.near, hints.far, 0.0)))
    values = raw / full
    known = np.isfinite(values) & (values > 0)
    zero = offset_by_flatness(values, known) if known.any() else None
    planes, where = NearFar(NEAREST, FARTHEST, 0.0), "as nothing shows them"
    if zero is not None and zero > values[known].max():
        metres = _MIDDLE / (zero - median(values[known]))
        planes, where = NearFar(metres * (zero - 1), metres * zero, 0.0), "as its planes show"
    ends = f"from {max(planes.near, 0):.3g} m (white) to {planes.far:.3g} m ({where})"
    is_said = why == "as said"
    what = f"{name} is {'read' if is_said else 'taken'} as linear depth in which white is near"
    note(f"{what}, {ends}, so that its unit is a guess: {_way_out(is_said)}")
    return Decoded(raw, Coding("reversed", full, f"{why}; {ends}", planes=planes))


def check_range(near: float | None, far: float | None, kind: str | None, scale: float | None) -> None:
    """Raises ValueError for impossible distances of the two planes, and beside a kind or a scale that has none."""
    for name, value in (("near", near), ("far", far)):
        if value is None:
            continue
        if value != np.inf:
            check_positive(value, option(name))
        if kind not in (None, "buffer", "reversed", "inverse"):
            ways = f"pass {', '.join(option('depth_kind', one) for one in ('buffer', 'reversed'))} or inverse"
            raise ValueError(f"{option(name)} is of depth between two planes, not {option('depth_kind', kind)}: {ways}")
    if near is not None and near == far:
        raise ValueError(f"{option('near')} and {option('far')} must differ, got {near:g} m for both")
    if kind != "inverse" or near is far is None:
        return
    if scale is not None:
        raise ValueError(f"pass {option('depth_scale')} or {option('near')} and {option('far')}, not both")
    if not (near or np.inf) < (far or 0) < np.inf:
        ends = f"{option('near')} for its largest value and a larger {option('far')} for its smallest"
        raise ValueError(f"inverse depth without a scale needs both ends: pass {ends}, got {near} and {far}")
