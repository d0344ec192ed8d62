"""What the raw numbers of one depth picture mean: their kind, their unit, and bits that are no plain numbers.

What the caller says is taken as it is. What the camera's file says comes next, unless it cannot be; then the values
themselves. Every guess is a note that names the option which ends it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import check_positive
from ..notes import Note
from ..wording import option
from . import depth_bits as bits
from . import depth_units as units
from .bending import Bending, measure_bending
from .colormaps import MAPS, read_levels
from .depth_values import FAR
from .not_depth import what_instead

_METRIC = ("z", "ray", "plane")
_DISPARITY = re.compile(r"(?:^|[^a-z])disp(?:arity|arities)?(?:[^a-z]|$)")
_MIDDLE = 2.0  # metres: where the middle of a depth without a scale is put
_FEWEST = 30  # different values of an 8-bit picture that was stored in 16 bits
_KITTI = 256.0  # raw values a pixel of disparity
_FLAT, _BENT, _ROUND = 0.8, 0.5, 0.5  # bending: of inverse depth at most, of depth at least; across to along on planes
_WORTH_A_HINT = 8.0  # metres: farther middles of millimetres are often another unit


@dataclass(frozen=True)
class Said:
    """What is said about a depth picture, by the caller and by the camera's file; None = nothing."""

    kind: str | None = None
    scale: float | None = None
    filed_kind: str | None = None
    filed_scale: float | None = None
    has_baseline: bool = False

    @property
    def any_kind(self) -> str | None:
        return self.kind or self.filed_kind


@dataclass(frozen=True)
class Decoded:
    """How a depth picture is read: metres follow by `to_metres` from these values, kind and scale.

    values  (h, w), plain numbers
    scale   values per metre (see `to_metres`); None for depth or inverse depth without any
    why     how kind and scale were found, in a few words
    """

    values: NDArray[Any]
    kind: str
    scale: float | None
    why: str


def decode(raw: NDArray[Any], name: str, said: Said, note: Note) -> Decoded:
    """The meaning of raw values, (h, w) or, colour-mapped, (h, w, 3|4) uint8.

    name  of the file, as messages have it

    Raises ValueError for a colour-mapped picture whose map is not known, for an 8-bit photograph, mask or map of
    labels, and for an impossible scale.
    """
    if said.scale is not None:
        check_positive(said.scale, option("depth_scale"))
    if raw.ndim == 3:
        return _read_colors(raw, name, said, note)
    codes = bits.as_codes(raw)
    counts = None
    if codes is not None:
        codes, unpacked = _unpack(codes, name, said, note)
        counts = bits.count_codes(codes)
        if unpacked:
            return Decoded(codes, said.any_kind or "z", said.scale or 1000.0, unpacked)
        if said.any_kind == "kinect" or (not said.any_kind and not said.scale and bits.is_kinect(counts)):
            if not said.any_kind:
                note(
                    f"{name} is taken as the raw disparity of a first Kinect ({bits.KINECT_MISSING} is missing); "
                    f"pass {option('depth_kind', 'z')} if it is not"
                )
            return Decoded(codes, "kinect", 1.0, "raw disparity of a Kinect")
        if said.any_kind is None and said.scale is None and _is_8_bits(counts):
            return _read_8_bits((codes >> 8).astype(np.uint8), name, said, note)
        raw = codes
    if raw.dtype.itemsize == 1:
        return _read_8_bits(raw, name, said, note)
    if said.any_kind is None and said.scale is None:
        relative = _read_relative(raw, counts, name, said, note)
        if relative:
            return relative
    return _read_numbers(raw, counts, name, said, note)


def _unpack(codes: bits.Codes, name: str, said: Said, note: Note) -> tuple[bits.Codes, str]:
    """Codes as plain numbers, and what they were if they are millimetres now."""
    if bits.is_swapped(codes):
        note(f"{name}: 16-bit values in the wrong byte order, read byte-swapped")
        codes = codes.byteswap()
    if said.any_kind not in (None, *_METRIC):
        return codes, ""
    if bits.has_confidence(codes):
        note(f"{name} is taken as Android's DEPTH16: millimetres in the low 13 bits, the confidence above is dropped")
        return bits.without_confidence(codes), "DEPTH16"
    if said.scale is None and bits.is_rotated(codes, bits.count_codes(codes)):
        note(
            f"{name} is taken as SUN RGB-D's millimetres, rotated by 3 bits: all values are multiples of 8; "
            f"pass {option('depth_scale')} to use them as they are"
        )
        return bits.rotated_back(codes), "SUN RGB-D's rotated bits"
    return codes, ""


def _read_colors(image: NDArray[np.uint8], name: str, said: Said, note: Note) -> Decoded:
    levels = read_levels(image)
    if levels is None:
        raise ValueError(
            f"{name} is a colour-mapped picture of depth (its red, green and blue differ), but its colours are of none "
            f"of {', '.join(MAPS)}: pass the raw depth (16-bit PNG, .npy or EXR)"
        )
    values, end = levels.values, MAPS[levels.name]
    read = f"{name} is a colour-mapped picture of depth ({levels.name}), read back in 256 steps"
    if said.any_kind or said.scale:
        note(f"{read}, {end} is 256")
        return _read_levels(values, said)
    bending = measure_bending(values, np.isfinite(values), None)
    if not _is_bent(bending):
        note(
            f"{read} as inverse depth without a scale: {end} is taken as near; "
            f"pass {option('depth_kind', 'z')} if it is far"
        )
        return Decoded(values, "inverse", None, f"colours of {levels.name}")
    is_rising = bending is not None and bending.along > 0
    values = values if is_rising else 257 - values
    where = "far" if is_rising else "near"
    note(
        f"{read} as depth without a scale: {end} is {where}, as planes in it bend; "
        f"pass {option('depth_kind', 'inverse')} if it is inverse depth"
    )
    return _without_scale(values, f"colours of {levels.name}")


def _read_8_bits(raw: NDArray[Any], name: str, said: Said, note: Note) -> Decoded:
    if said.scale or said.any_kind:
        if said.any_kind == "disparity":
            return _read_numbers(raw, None, name, said, note)
        return _read_levels(raw, said)
    if said.filed_scale and units.is_plausible(units.middle(raw) / said.filed_scale):
        return Decoded(raw, "z", said.filed_scale, "the camera's file")
    if _DISPARITY.search(Path(name).stem.lower()):
        return _read_disparity(raw, name, said, note)
    instead = what_instead(raw)
    if instead:
        raise ValueError(
            f"{name} looks like {instead}, expected depth: pass another file, or {option('depth_kind', 'inverse', 'z')}"
            " to use its 256 levels as they are"
        )
    bending = measure_bending(raw, raw > 0, None)
    if bending is not None and bending.along > 0 and _is_bent(bending):
        note(
            f"{name} has 8 bits: taken as depth without a scale, bright is far, as planes in it bend; "
            f"pass {option('depth_kind', 'inverse')} if bright is near"
        )
        return _without_scale(raw, "8 bits, by its planes")
    note(
        f"{name} has 8 bits: taken as a network's inverse depth, bright is near; "
        f"pass {option('depth_kind', 'z')} if bright is far"
    )
    return Decoded(raw, "inverse", None, "8 bits")


def _read_levels(values: NDArray[Any], said: Said) -> Decoded:
    """256 levels of a kind or a scale that was said."""
    kind = said.any_kind or "z"
    if said.scale is None and kind == "z":
        return _without_scale(values, "as said")
    if said.scale is None and kind != "inverse":
        raise ValueError(
            f"depth has 256 levels, too few for distances of kind {kind}: pass {option('depth_scale')} "
            f"(levels per metre), or {option('depth_kind', 'inverse')} for a network's output"
        )
    return Decoded(values, kind, said.scale, "as said")


def _without_scale(values: NDArray[Any], why: str) -> Decoded:
    """Depth z in unknown steps. A smallest value far below all others says missing, and where zero is."""
    known = values[np.isfinite(values)]
    low = known.min(initial=np.inf)
    rest = known[known > low]
    if rest.size and rest.min() - low > 0.1 * np.ptp(rest):
        values = values.astype(np.float32) - low
        return Decoded(values, "z", units.middle(values) / _MIDDLE, why)
    return Decoded(values, "z", None, why)


def _read_relative(raw: NDArray[Any], counts: bits.Counts | None, name: str, said: Said, note: Note) -> Decoded | None:
    """Disparity by its name, and a network's inverse depth by its planes; None for anything else."""
    if _DISPARITY.search(Path(name).stem.lower()):
        return _read_disparity(raw, name, said, note)
    if said.filed_scale is not None or not (raw.dtype.kind == "f" or (counts is not None and _is_stretched(counts))):
        return None
    known = np.isfinite(raw)
    has_negative = raw.dtype.kind == "f" and bool((raw[known] < 0).any())
    is_stretched = raw.dtype.kind != "f"
    zero = None if has_negative or is_stretched else 0.0
    bending = measure_bending(raw, known if zero is None else known & (raw > 0), zero)
    if bending is not None and bending.is_surely(-_FLAT, _FLAT):
        note(
            f"{name} is taken as a network's inverse depth: planes in it are flat in the values themselves; "
            f"pass {option('depth_kind', 'z')} if it is distances"
        )
        return Decoded(raw, "inverse", None, "planes bend as in inverse depth")
    if is_stretched and _is_bent(bending) and bending is not None and bending.along > 0:
        note(f"{name} fills all 16 bits: taken as depth without a scale; pass {option('depth_scale')} if it has one")
        return _without_scale(raw, "16 bits filled, by its planes")
    if is_stretched:
        note(
            f"{name} fills all 16 bits, as networks write depth without a scale: "
            f"pass {option('depth_kind', 'inverse')} if near is bright"
        )
    return None


def _read_disparity(raw: NDArray[Any], name: str, said: Said, note: Note) -> Decoded:
    """A picture with disparity in its name: with a baseline in pixels, else true in shape only."""
    if said.has_baseline:
        note(f"{name} is taken as disparity, by its name; pass {option('depth_kind', 'z')} if it is distances")
        scale = _disparity_scale(raw, said, note)
        return Decoded(raw, "disparity", scale, "its name, and the baseline")
    note(
        f"{name} is taken as disparity, by its name: without {option('baseline')} (metres between the cameras) its "
        f"size is unknown, its middle is put at {_MIDDLE:g} m"
    )
    return Decoded(raw, "inverse", _MIDDLE * units.middle(raw), "its name")


def _disparity_scale(raw: NDArray[Any], said: Said, note: Note) -> float:
    if said.filed_scale is not None and said.filed_kind == "disparity":
        return said.filed_scale
    if raw.dtype.kind == "f":
        return 1.0
    if units.middle(raw) > raw.shape[1]:
        note(f"disparity is larger than the picture is wide: divided by {_KITTI:g}, as in KITTI")
        return _KITTI
    note(f"disparity is of integers, without {option('depth_scale')}: taken as pixels")
    return 1.0


def _read_numbers(raw: NDArray[Any], counts: bits.Counts | None, name: str, said: Said, note: Note) -> Decoded:
    kind = said.any_kind or "z"
    if kind != "inverse" or said.scale is not None:
        _tell_negative(raw, name, note)
    if said.scale is not None:
        return Decoded(raw, kind, said.scale, "as passed")
    if kind == "kinect":
        return Decoded(raw, kind, 1.0, "as said")
    if kind == "inverse":
        scale = said.filed_scale if said.filed_kind == kind else None
        return Decoded(raw, kind, scale, "as said")
    if kind == "disparity":
        return Decoded(raw, kind, _disparity_scale(raw, said, note), "as said")
    if said.filed_scale is not None:
        return Decoded(raw, kind, _check_filed(raw, said.filed_scale, note), "the camera's file")
    scale, why = _scale_of_floats(raw, note) if raw.dtype.kind == "f" else _scale_of_integers(raw, counts, note)
    return Decoded(raw, kind, scale, why)


def _tell_negative(raw: NDArray[Any], name: str, note: Note) -> None:
    if raw.dtype.kind == "u":
        return
    share = np.count_nonzero((raw < 0) & (raw > -np.inf)) / raw.size
    if share:
        note(
            f"{share:.1%} of {name} is negative, and taken as missing; "
            f"pass {option('depth_kind', 'inverse')} if it is a network's output"
        )


def _check_filed(raw: NDArray[Any], filed: float, note: Note) -> float:
    """The scale of the camera's file, or what it means if its distances cannot be."""
    median = units.middle(raw)
    is_float = raw.dtype.kind == "f"
    if not units.is_plausible(median / filed) and median > 0:
        scale = (1.0 if units.is_plausible(median) else 1000.0) if is_float else units.scale_of_file(filed, median)
        impossible = f"the camera's file has depth_scale {filed:g}, which puts the middle at {median / filed:.3g} m"
        if scale and units.is_plausible(median / scale):
            note(f"{impossible}: taken as {scale:g} values a metre; pass {option('depth_scale')} if that is wrong")
            return scale
        note(f"{impossible}: pass {option('depth_scale')} (raw values per metre) if that is wrong")
    elif is_float and filed != 1:
        note(
            f"floating point depth is divided by {filed:g}, as the intrinsics file says; "
            f"pass {option('depth_scale', 1)} if it is in metres"
        )
    return filed


def _scale_of_floats(raw: NDArray[Any], note: Note) -> tuple[float, str]:
    median = units.middle(raw)
    if median > units.FARTHEST or (median > 1000 * units.NEAREST and units.is_whole(raw)):
        note(
            f"floating point depth has its middle at {median:.4g}: taken as millimetres; "
            f"pass {option('depth_scale', 1)} if it is in metres"
        )
        return 1000.0, "millimetres, by their size"
    if median < units.NEAREST:
        note(f"floating point depth has its middle at {median:.3g} m: pass {option('depth_scale')} if it is not metres")
    return 1.0, "floating point metres"


def _scale_of_integers(raw: NDArray[Any], counts: bits.Counts | None, note: Note) -> tuple[float, str]:
    median = units.middle(raw)
    if counts is not None:
        values = np.flatnonzero(counts[1:FAR]) + 1
        scale = units.scale_of_values(values, counts[values], median, raw.size)
        if scale:
            note(
                f"depth is of integers, taken as {scale:g} a metre (TUM's), as its values are spaced; "
                f"pass {option('depth_scale', 1000)} if it is in millimetres"
            )
            return scale, "TUM's, by the spacing of its values"
    told = f"depth is of integers, without {option('depth_scale')}: taken as millimetres (1000 per metre)"
    if not units.is_plausible(median / 1000) or median / 1000 > _WORTH_A_HINT:
        told += (
            f", its middle is at {median / 1000:.3g} m; pass {option('depth_scale')} if that is wrong (TUM has 5000)"
        )
    note(told)
    return 1000.0, "integer millimetres"


def _is_bent(bending: Bending | None) -> bool:
    """Whether planes bend as they do in depth, either way, and things are not just round."""
    if bending is None or abs(bending.across) > _ROUND * abs(bending.along):
        return False
    return abs(bending.along) - 2 * bending.error > _BENT


def _is_8_bits(counts: bits.Counts) -> bool:
    """Whether 8 bits were stored in 16: all values are multiples of 257, or all of 256."""
    values = np.flatnonzero(counts)
    return values.size >= _FEWEST and (not (values % 257).any() or not (values % 256).any())


def _is_stretched(counts: bits.Counts) -> bool:
    """Whether values were stretched to 0..65535 and go right up to the end, where markers would stand alone."""
    goes_on = np.count_nonzero(counts[FAR - 500 : -1]) > 20
    return bool(goes_on and 0 < counts[-1] < 0.002 * counts.sum() and counts[:656].any())
