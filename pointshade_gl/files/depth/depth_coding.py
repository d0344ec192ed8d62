"""Finds out what the raw numbers of a depth image mean: depth kind, unit, and special bit encodings.

What the caller says is taken as it is. What the camera's file says comes next, unless it cannot be; then the values
themselves. Every guess is a note that names the option which ends it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import check_positive
from ...notes.notes import Note
from ...notes.words import option
from .depth_bits import (
    KINECT_MISSING,
    Codes,
    Counts,
    as_codes,
    count_codes,
    has_confidence,
    is_half,
    is_kinect,
    is_rotated,
    is_swapped,
)
from .depth_channels import CARLA, find_channels
from .depth_kinds import METRIC, Coding, Decoded, Said
from .depth_relative import disparity_scale, read_8_bits, read_colors, read_relative
from .depth_repairs import CHANNELS, CONFIDENCE, HALF, HIGH_BYTE, ROTATED, SWAPPED, repaired
from .depth_units import FARTHEST, NEAREST, is_plausible, is_whole, middle, scale_of_file, scale_of_values
from .missing_depth import FAR
from .not_depth import LABELS, is_of_labels

_FEWEST = 30  # different values of an 8-bit picture that was stored in 16 bits
_WORTH_A_HINT = 8.0  # metres: farther middles of millimetres are often another unit


def decode(raw: NDArray[Any], name: str, said: Said, note: Note, like: Coding | None = None) -> Decoded:
    """Find out what raw values mean, (h, w) or, colour-mapped, (h, w, 3|4) uint8; return plain numbers with that.

    name  of the file, for messages
    like  the coding of an earlier frame of the sequence: if the same is given for this one, it is read in the same way

    Raises ValueError for an unknown colour map, a photograph, a mask or labels of 8 bits, and an impossible scale.
    """
    if said.scale is not None:
        check_positive(said.scale, option("depth_scale"))
    if like is not None and like.said == said:
        return Decoded(repaired(raw, like.repairs), like)
    decoded = _decode(raw, name, said, note)
    return decoded._replace(coding=replace(decoded.coding, said=said))


def _decode(raw: NDArray[Any], name: str, said: Said, note: Note) -> Decoded:
    if raw.ndim == 3:
        channels = find_channels(raw)
        return _read_channels(raw, channels, name, said, note) if channels else read_colors(raw, name, said, note)
    codes = as_codes(raw)
    if codes is not None:
        return _read_codes(codes, name, said, note)
    if raw.dtype.itemsize == 1:
        return read_8_bits(raw, name, said, note)
    return _read_values(raw, None, name, said, note)


def _read_channels(raw: NDArray[np.uint8], channels: tuple[int, ...], name: str, said: Said, note: Note) -> Decoded:
    """Read numbers whose bytes are in several channels; those of 24 bits are CARLA's unless a scale is given."""
    colors = [("red", "green", "blue", "alpha")[channel] for channel in channels]
    repair = CHANNELS + "".join(map(str, channels))
    values = repaired(raw, [repair])
    note(f"{name} is taken as one number in {' + 256 '.join(colors)}")
    if len(channels) == 3 and said.any_kind in (None, *METRIC) and not (said.scale or said.filed_scale):
        note(f"{name}: 24 bits are taken as CARLA's 1000 m; pass {option('depth_scale')} if that is wrong")
        decoded = Decoded(values, Coding(said.any_kind or "z", CARLA, "CARLA's 24 bits"))
        far = np.uint32(0.999 * 2**24)  # the sky
        decoded = decoded._replace(values=np.where(values < far, values, 0))
    elif len(channels) == 2:
        decoded = _read_codes(values, name, said, note)
    else:
        decoded = _read_values(values, None, name, said, note)
    return decoded._replace(coding=replace(decoded.coding, repairs=(repair, *decoded.coding.repairs)))


def _read_codes(codes: Codes, name: str, said: Said, note: Note) -> Decoded:
    """Read 16-bit values: first find out whether they are plain numbers at all."""
    repairs = []
    if is_swapped(codes):
        note(f"{name}: 16-bit values in the wrong byte order, read byte-swapped")
        repairs, codes = [SWAPPED], codes.byteswap()
    counts = count_codes(codes)
    if said.scale is None and is_half(codes, counts):
        note(
            f"{name} is taken as 16-bit floats: planes in it bend as depth only so; pass {option('depth_scale')} if not"
        )
        decoded = _read_values(repaired(codes, [HALF]), None, name, said, note)
        return decoded._replace(coding=replace(decoded.coding, repairs=(*repairs, HALF)))
    packed = _find_packing(codes, counts, name, said, note)
    if packed:
        repairs.append(packed)
        codes = repaired(codes, [packed])
    if packed == HIGH_BYTE:
        decoded = read_8_bits(codes, name, said, note)
    elif packed:
        decoded = Decoded(codes, Coding(said.any_kind or "z", said.scale or 1000.0, f"millimetres, {packed}"))
    elif said.any_kind == "kinect":
        if int(codes.max()) > KINECT_MISSING:
            note(
                f"{name} is no raw disparity of a Kinect: its values go up to {codes.max()}, beyond "
                f"{KINECT_MISSING}; leave out {option('depth_kind', 'kinect')}"
            )
        decoded = Decoded(codes, Coding("kinect", 1.0, "as said"))
    elif said.is_silent and is_kinect(counts):
        note(
            f"{name} is taken as the raw disparity of a first Kinect ({KINECT_MISSING} is missing); "
            f"pass {option('depth_kind', 'z')} if it is not"
        )
        decoded = Decoded(codes, Coding("kinect", 1.0, "raw disparity of a Kinect"))
    else:
        decoded = _read_values(codes, counts, name, said, note)
    return decoded._replace(coding=replace(decoded.coding, repairs=(*repairs, *decoded.coding.repairs)))


def _find_packing(codes: Codes, counts: Counts, name: str, said: Said, note: Note) -> str | None:
    """Return the repair that makes plain numbers of these bits, None if they are plain."""
    if said.any_kind not in (None, *METRIC):
        return None
    if has_confidence(codes):
        note(f"{name} is taken as Android's DEPTH16: millimetres in the low 13 bits, the confidence above is dropped")
        return CONFIDENCE
    if said.scale is None and is_rotated(codes, counts):
        note(
            f"{name} is taken as SUN RGB-D's millimetres, rotated by 3 bits: all values are multiples of 8; "
            f"pass {option('depth_scale')} to use them as they are"
        )
        return ROTATED
    values = np.flatnonzero(counts)
    in_high_byte = not (values % 257).any() or not (values % 256).any()
    return HIGH_BYTE if said.is_silent and values.size >= _FEWEST and in_high_byte else None


def _read_values(raw: NDArray[Any], counts: Counts | None, name: str, said: Said, note: Note) -> Decoded:
    """Read plain numbers of more than 8 bits."""
    relative = read_relative(raw, counts, name, said, note) if said.is_silent else None
    if relative:
        return relative
    kind = said.any_kind or "z"
    if (kind != "inverse" or said.scale is not None) and not (kind == "disparity" and said.has_baseline):
        _tell_negative(raw, name, note)
    if said.scale is not None:
        _check_passed(raw, name, kind, said.scale, note)
        return Decoded(raw, Coding(kind, said.scale, "as passed"))
    if kind == "inverse":
        return Decoded(raw, Coding(kind, said.filed_scale if said.filed_kind == kind else None, "as said"))
    if kind == "disparity":
        return Decoded(raw, Coding(kind, disparity_scale(raw, said, note), "as said"))
    if kind == "kinect":
        return Decoded(raw, Coding(kind, 1.0, "as said"))
    if said.filed_scale is not None:
        if said.filed_scale == 1000 and _find_scale(raw, counts):
            note(
                f"the values of {name} are spaced like TUM's: pass {option('depth_scale', 5000)} if all is too far away"
            )
        return Decoded(raw, Coding(kind, _check_filed(raw, said.filed_scale, note), "the camera's file"))
    if counts is not None and np.count_nonzero(counts) <= LABELS and is_of_labels(raw):
        note(f"{name} looks like a map of labels (few values, in flat areas), not like depth: pass another file")
    scale, why = _scale_of_floats(raw, note) if raw.dtype.kind == "f" else _scale_of_integers(raw, counts, note)
    return Decoded(raw, Coding(kind, scale, why))


def _tell_negative(raw: NDArray[Any], name: str, note: Note) -> None:
    if raw.dtype.kind == "u":
        return
    share = np.count_nonzero((raw < 0) & (raw > -np.inf)) / raw.size
    if share:
        note(
            f"{share:.1%} of {name} is negative, and taken as missing; "
            f"pass {option('depth_kind', 'inverse')} if it is a network's output"
        )


def _check_passed(raw: NDArray[Any], name: str, kind: str, scale: float, note: Note) -> None:
    """Print a note, with the likely scale, if the scale that the caller passed gives impossible distances."""
    median = middle(raw)
    if kind in METRIC and median > 0 and not is_plausible(median / scale):
        meant = scale_of_file(scale, median)
        way_out = f"pass {option('depth_scale', round(meant))}" if meant else "is that right?"
        note(
            f"{option('depth_scale', scale)} (values per metre) puts the middle of {name} at "
            f"{median / scale:.3g} m: {way_out}"
        )


def _check_filed(raw: NDArray[Any], filed: float, note: Note) -> float:
    """Return the scale in the camera's file, or what it must mean if its distances are impossible."""
    median = middle(raw)
    is_float = raw.dtype.kind == "f"
    if not is_plausible(median / filed) and median > 0:
        scale = (1.0 if is_plausible(median) else 1000.0) if is_float else scale_of_file(filed, median)
        impossible = f"the camera's file has depth_scale {filed:g}, which puts the middle at {median / filed:.3g} m"
        if scale and is_plausible(median / scale):
            note(f"{impossible}: taken as {scale:g} a metre; pass {option('depth_scale')} if that is wrong")
            return scale
        note(f"{impossible}: pass {option('depth_scale')} (raw values per metre) if that is wrong")
    elif is_float and filed != 1:
        note(
            f"floating point depth is divided by {filed:g}, as the intrinsics file says; "
            f"pass {option('depth_scale', 1)} if it is in metres"
        )
    return filed


def _scale_of_floats(raw: NDArray[Any], note: Note) -> tuple[float, str]:
    median = middle(raw)
    network = f"{option('depth_kind', 'inverse')} for a network's output"
    if median > FARTHEST or (median > 1000 * NEAREST and is_whole(raw)):
        note(
            f"floating point depth has its middle at {median:.4g}: taken as millimetres; "
            f"pass {option('depth_scale', 1)} if it is in metres, {network}"
        )
        return 1000.0, "millimetres, by their size"
    if median < NEAREST:
        note(
            f"floating point depth has its middle at {median:.3g} m; "
            f"pass {option('depth_scale')} if it is not in metres, {network}"
        )
    return 1.0, "floating point metres"


def _scale_of_integers(raw: NDArray[Any], counts: Counts | None, note: Note) -> tuple[float, str]:
    scale = _find_scale(raw, counts)
    if scale:
        note(
            f"depth is of integers, taken as {scale:g} a metre (TUM's), as its values are spaced; "
            f"pass {option('depth_scale', 1000)} if it is in millimetres"
        )
        return scale, "TUM's, by the spacing of its values"
    median = middle(raw)
    told = f"depth is of integers, without {option('depth_scale')}: taken as millimetres (1000 per metre)"
    if not is_plausible(median / 1000) or median / 1000 > _WORTH_A_HINT:
        told += (
            f", its middle is at {median / 1000:.3g} m; if that is wrong, pass {option('depth_scale')} (TUM has 5000), "
            f"or {option('depth_kind', 'inverse')} for a network's output"
        )
    note(told)
    return 1000.0, "integer millimetres"


def _find_scale(raw: NDArray[Any], counts: Counts | None) -> float | None:
    """Return the scale that the spacing of 16-bit values shows."""
    if counts is None:
        return None
    values = np.flatnonzero(counts[1:FAR]) + 1
    return scale_of_values(values, counts[values], middle(raw), raw.size)
