"""Recognises depth without absolute distances: 8-bit and colour-mapped pictures, network output, and disparity."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import option
from ..depth_models.model_options import how_to_make_depth
from .colormaps import MAPS, read_levels
from .depth_bits import Counts
from .depth_kinds import METRIC, Coding, Decoded, Said
from .depth_repairs import LEVELS, REVERSED
from .depth_units import middle, some_values
from .not_depth import what_instead
from .plane_curvature import measure_bending

_DISPARITY = re.compile(r"(?:^|[^a-z])disp(?:arity|arities)?(?:[^a-z]|$)")  # in a file's name
_DEPTH_NAME = re.compile(r"depth|disp")
_MIDDLE = 2.0  # metres: where the middle of a depth without a scale is put
_KITTI = 256.0  # raw values a pixel of disparity
_GAP = 0.1  # of the range of all other values: between them and a 0 that says missing
_END = 1966  # codes, 3 % of 16 bits
_FLAT, _BENT, _ROUND = 0.8, 0.5, 0.5  # bending: of inverse depth at most, of depth at least; across to along on planes


def read_colors(image: NDArray[np.uint8], name: str, said: Said, note: Note) -> Decoded:
    """Read a colour-mapped picture (h, w, 3|4). Raises ValueError if its map is not known."""
    levels = read_levels(image)
    if levels is None and not _DEPTH_NAME.search(Path(name).stem.lower()):
        raise ValueError(
            f"{name} is a photograph: {how_to_make_depth()}; or pass it as {option('color', 'FILE')} and its depth as "
            f"{option('depth', 'FILE')}"
        )
    if levels is None:
        raise ValueError(
            f"{name} is a colour picture, not depth, nor depth colour-mapped by {', '.join(MAPS)}: pass depth (16-bit "
            f"PNG, .npy or EXR) as {option('depth', 'FILE')}, and the photograph as {option('color', 'FILE')}"
        )
    values, end = levels.values, MAPS[levels.name]
    read = f"{name} is a colour-mapped picture of depth ({levels.name}), read back in 256 steps"
    if not said.is_silent:
        note(f"{read}, {end} is the highest")
        return _read_levels(values, said, (LEVELS,))
    direction = _direction(values, np.isfinite(values))
    if not direction:
        note(f"{read} as inverse depth: {end} is taken as near; pass {option('depth_kind', 'z')} if it is far")
        return Decoded(values, Coding("inverse", None, f"colours of {levels.name}", (LEVELS,)))
    where = "far" if direction > 0 else "near"
    note(
        f"{read} as depth: {end} is {where}, as the planes in it show; "
        f"pass {option('depth_kind', 'inverse')} if it is inverse depth and {end} is near"
    )
    if direction > 0:
        return _without_scale(values, f"colours of {levels.name}", (LEVELS,))
    return _without_scale(255 - values, f"colours of {levels.name}", (LEVELS, REVERSED))


def read_8_bits(raw: NDArray[Any], name: str, said: Said, note: Note) -> Decoded:
    """Read a grey picture (h, w) of 256 levels. Raises ValueError for a photograph, a mask and a map of labels."""
    filed = said.filed_scale
    if said.scale is None and said.any_kind in (None, *METRIC) and filed and filed < 256:  # else all is within 1 m
        _refuse_what_is_none(raw, name)
        return Decoded(raw, Coding(said.any_kind or "z", filed, "the camera's file"))
    if said.any_kind == "disparity" and said.scale is None:
        return Decoded(raw, Coding("disparity", disparity_scale(raw, said, note), "as said"))
    if not said.is_silent:
        return _read_levels(raw, said)
    if _DISPARITY.search(Path(name).stem.lower()):
        return _read_disparity(raw, name, said, note)
    _refuse_what_is_none(raw, name)
    if _direction(raw, raw > 0) > 0:
        note(
            f"{name} has 8 bits: taken as depth without a scale, bright is far, as the planes in it show; "
            f"pass {option('depth_kind', 'inverse')} if bright is near"
        )
        return _without_scale(raw, "8 bits, by its planes")
    note(
        f"{name} has 8 bits: taken as a network's inverse depth, bright is near; "
        f"pass {option('depth_kind', 'z')} if bright is far"
    )
    return Decoded(raw, Coding("inverse", None, "8 bits"))


def _refuse_what_is_none(raw: NDArray[Any], name: str) -> None:
    """Raise ValueError for a photograph, a mask and a map of labels."""
    instead = what_instead(raw)
    if instead:
        raise ValueError(
            f"{name} has 8 bits and looks like {instead}, expected depth: pass another file, "
            f"or {option('depth_kind', 'inverse', 'z')} to use its 256 levels as they are"
        )


def read_relative(raw: NDArray[Any], counts: Counts | None, name: str, said: Said, note: Note) -> Decoded | None:
    """Recognise disparity by its name, a network's depth or inverse depth by its planes; return None for anything else.

    counts  of the codes, for 16 bits
    """
    if _DISPARITY.search(Path(name).stem.lower()):
        return _read_disparity(raw, name, said, note)
    is_filled = _is_filled(raw, counts)
    if said.filed_scale is not None or not (raw.dtype.kind == "f" or is_filled):
        return None
    if _is_inverse(raw):
        if said.has_baseline:
            return _read_disparity(raw, name, said, note)
        note(
            f"{name} is taken as a network's inverse depth, as the planes in it show; "
            f"pass {option('depth_kind', 'z')} if it is distances"
        )
        return Decoded(raw, Coding("inverse", None, "planes bend as in inverse depth"))
    if not is_filled:
        return None
    filled = f"{name} fills its whole range, as networks write depth without a scale"
    if _direction(raw, np.isfinite(raw)) > 0:
        note(f"{filled}: taken as such; pass {option('depth_scale')} if it has one")
        return _without_scale(raw, "a filled range, by its planes")
    note(f"{filled}: pass {option('depth_kind', 'inverse')} if large values are near")
    return None


def disparity_scale(raw: NDArray[Any], said: Said, note: Note) -> float:
    """Return the values per pixel of disparity, where the caller does not give it."""
    if said.filed_scale is not None and said.filed_kind == "disparity":
        return said.filed_scale
    if raw.dtype.kind == "f":
        return 1.0
    if middle(raw) > raw.shape[1]:
        note(f"disparity is larger than the picture is wide: divided by {_KITTI:g}, as in KITTI")
        return _KITTI
    note(f"disparity is of integers, without {option('depth_scale')}: taken as pixels")
    return 1.0


def _read_disparity(raw: NDArray[Any], name: str, said: Said, note: Note) -> Decoded:
    """Disparity: in pixels if there is a baseline, else true in shape only."""
    if said.has_baseline:
        note(f"{name} is taken as disparity; pass {option('depth_kind', 'z')} if it is distances")
        scale = disparity_scale(raw, said, note)
        return Decoded(raw, Coding("disparity", scale, "its name or its planes, and the baseline"))
    note(
        f"{name} is taken as disparity, by its name: without {option('baseline')} (metres between the cameras) its "
        f"size is unknown, its middle is put at {_MIDDLE:g} m"
    )
    return Decoded(raw, Coding("inverse", _MIDDLE * middle(raw), "its name"))


def _read_levels(values: NDArray[Any], said: Said, repairs: tuple[str, ...] = ()) -> Decoded:
    """Return 256 levels whose kind or scale is given."""
    kind = said.any_kind or "z"
    if said.scale is None and kind == "z":
        return _without_scale(values, "as said", repairs)
    if said.scale is None and kind != "inverse":
        raise ValueError(
            f"depth has 256 levels, too few for distances of kind {kind}: pass {option('depth_scale')} "
            f"(levels per metre), or {option('depth_kind', 'inverse')} for a network's output"
        )
    return Decoded(values, Coding(kind, said.scale, "as said", repairs))


def _without_scale(values: NDArray[Any], why: str, repairs: tuple[str, ...] = ()) -> Decoded:
    """Return depth z of unknown unit. If 0 is far from all other values it means missing, and is no distance at all."""
    known = some_values(values)
    rest = known[known > 0]
    has_zero = known.min(initial=1) == 0 and rest.size > 0 and rest.min() > _GAP * np.ptp(rest)
    return Decoded(values, Coding("z", middle(values) / _MIDDLE if has_zero else None, why, repairs))


def _direction(values: NDArray[Any], known: NDArray[np.bool_]) -> int:
    """Return 1 if planes bend as in depth with any offset, -1 if as in its reverse; 0 for inverse or unknown depth."""
    bending = measure_bending(values, known, None)
    if bending is None:
        return 0
    is_plane = abs(bending.across) < _ROUND * abs(bending.along)  # objects are not just round
    is_bent = is_plane and abs(bending.along) - 2 * bending.error > _BENT
    return int(np.sign(bending.along)) if is_bent else 0


def _is_inverse(raw: NDArray[Any]) -> bool:
    """Return whether planes are so flat in the values that these cannot be depth, even with an unknown offset."""
    known = np.isfinite(raw)
    has_negative = bool(raw.min(where=known, initial=0) < 0)
    for zero in (None,) if has_negative else (0.0, None):
        bending = measure_bending(raw, known if has_negative else known & (raw > 0), zero)
        if bending is None or not bending.is_surely(-_FLAT, _FLAT):
            return False
    return True


def _is_filled(raw: NDArray[Any], counts: Counts | None) -> bool:
    """Return whether values were stretched to 0..65535 or to 0..1. A marker would stand alone at the end."""
    if counts is not None:
        next_to_end = np.count_nonzero(counts[-_END:-1])
        return bool(next_to_end >= 3 and 0 < counts[-1] < 0.002 * counts.sum() and counts[:_END].any())
    values = some_values(raw)
    return raw.dtype.kind == "f" and bool(values.size and 0 <= values.min() < 0.02 and 0.98 < values.max() <= 1)
