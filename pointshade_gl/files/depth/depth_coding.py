"""Finds out what the raw numbers of a depth image mean: kind, unit, or depth without absolute distances."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import check_positive
from ...notes.notes import Note
from ...notes.words import option
from ..networks.model_options import how_to_make_depth
from . import depth_files, missing_depth
from .depth_kinds import METRIC, RANGED, Coding, Decoded, DepthHints, NearFar
from .depth_range import find_range, read_range, read_reversed
from .planes import direction_of, measure_bending

_WIDTH = 640  # a wider picture is thinned first: a large photograph is smooth from pixel to pixel
_ROUGH = 0.22  # of the pixels bend by 3 levels or more: photographs 0.27 to 0.74, depth up to 0.19 even as JPEG
_FEWEST_LEVELS, LABELS = 5, 64  # different values of a map of labels
_EVEN = 0.9  # of its neighbours are equal
_NEXT = 0.5  # of its steps lead from one value to the next: depth goes through all of them


def what_instead(image: NDArray[np.uint8]) -> str | None:
    """What a picture (h, w) of 8 bits shows instead of depth, None if it may be depth."""
    thin = _thinned(image)
    values = np.unique(thin)
    if values.size < _FEWEST_LEVELS:
        return f"a mask (different values: {values.size})"
    if is_of_labels(thin):
        return f"a map of labels (flat values: {values.size})"
    bends = np.abs(np.diff(thin.astype(np.int16), 2, axis=1))
    return "a photograph (neighbouring pixels differ too much)" if _share(bends >= 3) > _ROUGH else None


def is_of_labels(image: NDArray[Any]) -> bool:
    """Whether a picture (h, w) has few values, in flat areas, and jumps between any two of them."""
    thin = _thinned(image)
    values = np.unique(thin)
    if not _FEWEST_LEVELS <= values.size <= LABELS:
        return False
    steps = np.diff(np.searchsorted(values, thin).astype(np.int16), axis=1)
    changes = np.abs(steps[steps != 0])
    return changes.size < (1 - _EVEN) * steps.size and _share(changes == 1) < _NEXT


def _thinned(image: NDArray[Any]) -> NDArray[Any]:
    step = max(1, image.shape[1] // _WIDTH)
    return image[::step, ::step]


def _share(found: NDArray[Any]) -> float:
    return float(found.mean()) if found.size else 0.0


_DISPARITY = re.compile(r"(?:^|[^a-z])disp(?:arity|arities)?(?:[^a-z]|$)")  # in a file's name
_DEPTH_NAME = re.compile(r"depth|disp")
_MIDDLE = 2.0  # metres: where the middle of a depth without a scale is put
_KITTI = 256.0  # raw values a pixel of disparity
_GAP = 0.1  # of the range of all other values: between them and a 0 that means missing
_END, _CLOSE = 1966, 656  # codes, 3 % and 1 % of 16 bits
_FEW_AT_END, _MANY_AT_END = 0.002, 0.01  # of the pixels: more are a marker, not the end of a range
_FLAT = 0.8  # bending of inverse depth, at most


def read_colors(image: NDArray[np.uint8], name: str, hints: DepthHints, note: Note) -> Decoded:
    """Read a colour-mapped picture (h, w, 3|4). Raises ValueError if its map is not known."""
    levels, as_depth, as_color = depth_files.read_levels(image), option("depth", "FILE"), option("color", "FILE")
    if levels is None and not _DEPTH_NAME.search(Path(name).stem.lower()):
        way_out = f"{how_to_make_depth()}; or pass it as {as_color} and its depth as {as_depth}"
        raise ValueError(f"{name} is a photograph: {way_out}")
    if levels is None:
        way_out = f"pass depth (16-bit PNG, .npy or EXR) as {as_depth}, and the photograph as {as_color}"
        nor = f"nor depth colour-mapped by {', '.join(depth_files.MAPS)}"
        raise ValueError(f"{name} is a colour picture, not depth, {nor}: {way_out}")
    values, end, why = levels.values, depth_files.MAPS[levels.name], f"colours of {levels.name}"
    read = f"{name} is a colour-mapped picture of depth ({levels.name}), read back in 256 steps"
    if not hints.is_silent:
        note(f"{read}, {end} is the highest")
        return _read_levels(values, hints, (depth_files.LEVELS,))
    direction = direction_of(values, np.isfinite(values))
    if not direction:
        note(f"{read} as inverse depth: {end} is taken as near; pass {option('depth_kind', 'z')} if it is far")
        return Decoded(values, Coding("inverse", None, why, (depth_files.LEVELS,)))
    where = "far" if direction > 0 else "near"
    way_out = f"pass {option('depth_kind', 'inverse')} if it is inverse depth and {end} is near"
    note(f"{read} as depth: {end} is {where}, as the planes in it show; {way_out}")
    if direction > 0:
        return _without_scale(values, why, (depth_files.LEVELS,))
    return _without_scale(255 - values, why, (depth_files.LEVELS, depth_files.REVERSED))


def read_8_bits(raw: NDArray[Any], name: str, hints: DepthHints, note: Note) -> Decoded:
    """Read a picture (h, w) of 256 levels, or a film's. Raises ValueError for a photograph, a mask, a map of labels."""
    filed, levels = hints.filed_scale, hints.levels or 256
    if hints.scale is None and hints.any_kind in (None, *METRIC) and filed and filed < levels:  # else all is within 1 m
        if not hints.levels:
            _refuse_what_is_none(raw, name)
        return Decoded(raw, Coding(hints.any_kind or "z", filed, "the camera's file"))
    if hints.any_kind == "disparity" and hints.scale is None:
        return Decoded(raw, Coding("disparity", disparity_scale(raw, hints, note), "as said"))
    if hints.any_kind in RANGED:
        return read_range(raw, name, hints, note)
    if not hints.is_silent:
        return _read_levels(raw, hints)
    if _DISPARITY.search(Path(name).stem.lower()):
        return _read_disparity(raw, name, hints, note)
    count = (levels - 1).bit_length()
    _refuse_what_is_none(raw if count == 8 else (raw >> (count - 8)).astype(np.uint8), name)
    if buffer := find_range(raw, None, name, hints, note):
        return buffer
    bits = f"{name} has {count} bits"
    direction = direction_of(raw, raw > 0)
    if direction < 0:
        return read_reversed(raw, name, "8 bits, by its planes", hints, note)
    if direction:
        way_out = f"pass {option('depth_kind', 'inverse')} if bright is near"
        note(f"{bits}: taken as depth without a scale, bright is far, as the planes in it show; {way_out}")
        return _without_scale(raw, "8 bits, by its planes")
    way_out = f"pass {option('depth_kind', 'z')} if bright is far"
    note(f"{bits}: taken as a network's inverse depth, bright is near; {way_out}")
    return Decoded(raw, Coding("inverse", None, "8 bits"))


def _refuse_what_is_none(raw: NDArray[Any], name: str) -> None:
    """Raise ValueError for a photograph, a mask and a map of labels."""
    if instead := what_instead(raw):
        way_out = f"pass another file, or {option('depth_kind', 'inverse', 'z')} to use its 256 levels as they are"
        raise ValueError(f"{name} has 8 bits and looks like {instead}, expected depth: {way_out}")


def read_relative(
    raw: NDArray[Any], counts: depth_files.Counts | None, name: str, hints: DepthHints, note: Note
) -> Decoded | None:
    """Recognise disparity by its name, a network's depth or inverse depth by its planes; None for anything else."""
    if _DISPARITY.search(Path(name).stem.lower()):
        return _read_disparity(raw, name, hints, note)
    is_filled = _is_filled(raw, counts)
    if hints.filed_scale is None and (buffer := find_range(raw, counts, name, hints, note)):
        return buffer
    if hints.filed_scale is not None or not (raw.dtype.kind == "f" or is_filled):
        return None
    if _is_inverse(raw):
        if hints.has_baseline:
            return _read_disparity(raw, name, hints, note)
        way_out = f"pass {option('depth_kind', 'z')} if it is distances"
        if raw.dtype.kind == "f" and raw.max(where=np.isfinite(raw), initial=0) <= 1:
            way_out += f", {option('depth_kind', 'buffer')} if it is a depth buffer"
        note(f"{name} is taken as a network's inverse depth, as the planes in it show; {way_out}")
        return Decoded(raw, Coding("inverse", None, "planes bend as in inverse depth"))
    if not is_filled:
        return None
    filled = f"{name} fills its whole range, as networks write depth without a scale"
    direction = direction_of(raw, np.isfinite(raw))
    if direction > 0:
        note(f"{filled}: taken as such; pass {option('depth_scale')} if it has one")
        return _without_scale(raw, "a filled range, by its planes")
    if direction < 0:
        return read_reversed(raw, name, "a filled range, by its planes", hints, note)
    note(f"{filled}: pass {option('depth_kind', 'inverse')} if large values are near")
    return None


def disparity_scale(raw: NDArray[Any], hints: DepthHints, note: Note) -> float:
    """Return the values per pixel of disparity, where the caller does not give it."""
    if hints.filed_scale is not None and hints.filed_kind == "disparity":
        return hints.filed_scale
    if raw.dtype.kind == "f":
        return 1.0
    if missing_depth.middle(raw) > raw.shape[1]:
        note(f"disparity is larger than the picture is wide: divided by {_KITTI:g}, as in KITTI")
        return _KITTI
    note(f"disparity is of integers, without {option('depth_scale')}: taken as pixels")
    return 1.0


def _read_disparity(raw: NDArray[Any], name: str, hints: DepthHints, note: Note) -> Decoded:
    """Disparity: in pixels if there is a baseline, else true in shape only."""
    if hints.has_baseline:
        note(f"{name} is taken as disparity; pass {option('depth_kind', 'z')} if it is distances")
        scale = disparity_scale(raw, hints, note)
        return Decoded(raw, Coding("disparity", scale, "its name or its planes, and the baseline"))
    why = f"without {option('baseline')} (metres between the cameras) its size is unknown"
    note(f"{name} is taken as disparity, by its name: {why}, its middle is put at {_MIDDLE:g} m")
    return Decoded(raw, Coding("inverse", _MIDDLE * missing_depth.middle(raw), "its name"))


def _read_levels(values: NDArray[Any], hints: DepthHints, repairs: tuple[str, ...] = ()) -> Decoded:
    """Return 256 levels whose kind or scale is given."""
    kind = hints.any_kind or "z"
    if hints.scale is None and kind == "z":
        return _without_scale(values, "as said", repairs)
    if hints.scale is None and kind != "inverse":
        way_out = f"(levels per metre), or {option('depth_kind', 'inverse')} for a network's output"
        fact = f"depth has 256 levels, too few for distances of kind {kind}"
        raise ValueError(f"{fact}: pass {option('depth_scale')} {way_out}")
    return Decoded(values, Coding(kind, hints.scale, "as said", repairs))


def _without_scale(values: NDArray[Any], why: str, repairs: tuple[str, ...] = ()) -> Decoded:
    """Return depth z of unknown unit. If 0 is far from all other values it means missing, and is no distance at all."""
    known = missing_depth.some_values(values)
    rest = known[known > 0]
    has_zero = known.min(initial=1) == 0 and rest.size > 0 and rest.min() > _GAP * np.ptp(rest)
    return Decoded(values, Coding("z", missing_depth.middle(values) / _MIDDLE if has_zero else None, why, repairs))


def _is_inverse(raw: NDArray[Any]) -> bool:
    """Return whether planes are so flat in the values that these cannot be depth, even with an unknown offset."""
    known = np.isfinite(raw)
    has_negative = bool(raw.min(where=known, initial=0) < 0)
    for zero in (None,) if has_negative else (0.0, None):
        bending = measure_bending(raw, known if has_negative else known & (raw > 0), zero)
        if bending is None or not bending.is_surely(-_FLAT, _FLAT):
            return False
    return True


def _is_filled(raw: NDArray[Any], counts: depth_files.Counts | None) -> bool:
    """Return whether values were stretched to 0..65535 or to 0..1. A marker would stand alone at the end."""
    if counts is not None:
        next_to_end = np.count_nonzero(counts[-_END:-1])
        most = _MANY_AT_END if counts[-_CLOSE:-1].any() else _FEW_AT_END
        return bool(next_to_end >= 3 and 0 < counts[-1] < most * counts.sum() and counts[:_END].any())
    values = missing_depth.some_values(raw)
    return raw.dtype.kind == "f" and bool(values.size and 0 <= values.min() < 0.02 and 0.98 < values.max() <= 1)


_FEWEST_STORED = 30  # different values of an 8-bit picture that was stored in 16 bits
_WORTH_A_HINT = 8.0  # metres: farther middles of millimetres are often another unit


_NEGATIVE = 0.98  # of all values but 0


def decode(raw: NDArray[Any], name: str, hints: DepthHints, note: Note, like: Coding | None = None) -> Decoded:
    """Find out what raw values mean, (h, w) or, colour-mapped, (h, w, 3|4) uint8; return plain numbers with that.

    If the same is given as for an earlier frame of the sequence, whose coding is `like`, it is read in the same way.

    Raises ValueError for an unknown colour map, a photograph, a mask or labels of 8 bits, and an impossible scale.
    """
    if hints.scale is not None:
        check_positive(hints.scale, option("depth_scale"))
    if like is not None and like.hints == hints:
        return Decoded(depth_files.repaired(raw, like.repairs), like)
    if raw.ndim == 3:
        channels = depth_files.find_channels(raw)
        read = partial(_read_channels, channels=channels) if channels else read_colors
    elif 0 < hints.levels < 2**16:
        read = read_8_bits
    elif depth_files.as_codes(raw) is not None:
        raw, read = raw.astype(np.uint16, copy=False), _read_codes
    else:
        read = read_8_bits if raw.dtype.itemsize == 1 else _read_values
    decoded = read(raw, name, hints, note)
    coding, near, far = decoded.coding, hints.near or np.inf, hints.far or 0.0
    if coding.kind == "inverse" and coding.scale is None and near < far < np.inf:
        coding = replace(coding, planes=NearFar(near, far, 0.0))
    return decoded._replace(coding=replace(coding, hints=hints))


def _read_channels(
    raw: NDArray[np.uint8], name: str, hints: DepthHints, note: Note, channels: tuple[int, ...]
) -> Decoded:
    """Read numbers whose bytes are in several channels; those of 24 bits are CARLA's unless a scale is given."""
    colors = [("red", "green", "blue", "alpha")[channel] for channel in channels]
    repair = depth_files.CHANNELS + "".join(map(str, channels))
    values = depth_files.repaired(raw, [repair])
    note(f"{name} is taken as one number in {' + 256 '.join(colors)}")
    if len(channels) == 3 and hints.any_kind in (None, *METRIC) and not (hints.scale or hints.filed_scale):
        note(f"{name}: 24 bits are taken as CARLA's 1000 m; pass {option('depth_scale')} if that is wrong")
        coding = Coding(hints.any_kind or "z", depth_files.CARLA, "CARLA's 24 bits")
        far = np.uint32(0.999 * 2**24)  # the sky
        return _after(Decoded(np.where(values < far, values, 0), coding), repair)
    read = _read_codes if len(channels) == 2 else _read_values
    return _after(read(values, name, hints, note), repair)


def _after(decoded: Decoded, *repairs: str) -> Decoded:
    """Return what was decoded, with the repairs that came before."""
    return decoded._replace(coding=replace(decoded.coding, repairs=(*repairs, *decoded.coding.repairs)))


def _read_codes(codes: depth_files.Codes, name: str, hints: DepthHints, note: Note) -> Decoded:
    """Read 16-bit values: first find out whether they are plain numbers at all."""
    repairs = []
    if depth_files.is_swapped(codes):
        note(f"{name}: 16-bit values in the wrong byte order, read byte-swapped")
        repairs, codes = [depth_files.SWAPPED], codes.byteswap()
    counts = depth_files.count_codes(codes)
    if hints.scale is None and hints.any_kind not in RANGED and depth_files.is_half(codes, counts):
        way_out = f"pass {option('depth_scale')} if not"
        note(f"{name} is taken as 16-bit floats: planes in it bend as depth only so; {way_out}")
        halves = depth_files.repaired(codes, [depth_files.HALF])
        return _after(_read_values(halves, name, hints, note), *repairs, depth_files.HALF)
    packed = _find_packing(codes, counts, name, hints, note)
    if packed:
        repairs.append(packed)
        codes = depth_files.repaired(codes, [packed])
    if packed == depth_files.HIGH_BYTE:
        decoded = read_8_bits(codes, name, hints, note)
    elif packed:
        decoded = Decoded(codes, Coding(hints.any_kind or "z", hints.scale or 1000.0, f"millimetres, {packed}"))
    elif hints.any_kind == "kinect":
        if int(codes.max()) > depth_files.KINECT_MISSING:
            why = f"its values go up to {codes.max()}, beyond {depth_files.KINECT_MISSING}"
            note(f"{name} is no raw disparity of a Kinect: {why}; leave out {option('depth_kind', 'kinect')}")
        decoded = Decoded(codes, Coding("kinect", 1.0, "as said"))
    elif hints.is_silent and depth_files.is_kinect(counts):
        taken = f"the raw disparity of a first Kinect ({depth_files.KINECT_MISSING} is missing)"
        note(f"{name} is taken as {taken}; pass {option('depth_kind', 'z')} if it is not")
        decoded = Decoded(codes, Coding("kinect", 1.0, "raw disparity of a Kinect"))
    else:
        decoded = _read_values(codes, name, hints, note, counts)
    return _after(decoded, *repairs)


def _find_packing(
    codes: depth_files.Codes, counts: depth_files.Counts, name: str, hints: DepthHints, note: Note
) -> str | None:
    """Return the repair that makes plain numbers of these bits, None if they are plain."""
    if hints.any_kind not in (None, *METRIC):
        return None
    if depth_files.has_confidence(codes):
        note(f"{name} is taken as Android's DEPTH16: millimetres in the low 13 bits, the confidence above is dropped")
        return depth_files.CONFIDENCE
    if hints.scale is None and depth_files.is_rotated(codes, counts):
        way_out = f"pass {option('depth_scale')} to use them as they are"
        note(f"{name} is taken as SUN RGB-D's millimetres, rotated by 3 bits: all values are multiples of 8; {way_out}")
        return depth_files.ROTATED
    values = np.flatnonzero(counts)
    in_high_byte = not (values % 257).any() or not (values % 256).any()
    return depth_files.HIGH_BYTE if hints.is_silent and values.size >= _FEWEST_STORED and in_high_byte else None


def _read_values(
    raw: NDArray[Any], name: str, hints: DepthHints, note: Note, counts: depth_files.Counts | None = None
) -> Decoded:
    """Read plain numbers of more than 8 bits, of 16 bits with the counts of their codes."""
    if hints.any_kind in RANGED:
        return read_range(raw, name, hints, note)
    if hints.any_kind in (None, "z", "ray") and _is_negative(raw):
        note(f"{name} is negative, as z in OpenGL's axes is: its sign is turned")
        return _after(_read_values(-raw, name, hints, note, counts), depth_files.NEGATED)
    if hints.is_silent and (relative := read_relative(raw, counts, name, hints, note)):
        return relative
    kind = hints.any_kind or "z"
    if (kind != "inverse" or hints.scale is not None) and not (kind == "disparity" and hints.has_baseline):
        share = 0 if raw.dtype.kind == "u" else np.count_nonzero((raw < 0) & (raw > -np.inf)) / raw.size
        if share:
            way_out = f"pass {option('depth_kind', 'inverse')} if it is a network's output"
            note(f"{share:.1%} of {name} is negative, and taken as missing; {way_out}")
    if hints.scale is not None:
        _check_passed(raw, name, kind, hints.scale, note)
        return Decoded(raw, Coding(kind, hints.scale, "as passed"))
    if kind == "inverse":
        return Decoded(raw, Coding(kind, hints.filed_scale if hints.filed_kind == kind else None, "as said"))
    if kind == "disparity":
        return Decoded(raw, Coding(kind, disparity_scale(raw, hints, note), "as said"))
    if kind == "kinect":
        return Decoded(raw, Coding(kind, 1.0, "as said"))
    if hints.filed_scale is not None:
        if hints.filed_scale == 1000 and _find_scale(raw, counts):
            way_out = f"pass {option('depth_scale', 5000)} if all is too far away"
            note(f"the values of {name} are spaced like TUM's: {way_out}")
        return Decoded(raw, Coding(kind, _check_filed(raw, hints.filed_scale, note), "the camera's file"))
    if counts is not None and np.count_nonzero(counts) <= LABELS and is_of_labels(raw):
        note(f"{name} looks like a map of labels (few values, in flat areas), not like depth: pass another file")
    scale, why = _scale_of_floats(raw, note) if raw.dtype.kind == "f" else _scale_of_integers(raw, counts, note)
    return Decoded(raw, Coding(kind, scale, why))


def _is_negative(raw: NDArray[Any]) -> bool:
    """Return whether nearly all that is known lies behind the viewer, and is no inverse depth of any offset."""
    if raw.dtype.kind == "u":
        return False
    some = missing_depth.some_values(raw)
    if not np.count_nonzero(some < 0) > _NEGATIVE * np.count_nonzero(some) > 0:
        return False
    bending = measure_bending(-raw, np.isfinite(raw) & (raw < 0), 0.0)
    return bending is None or not bending.is_surely(-_FLAT, _FLAT)


def _check_passed(raw: NDArray[Any], name: str, kind: str, scale: float, note: Note) -> None:
    """Print a note, with the likely scale, if the scale that the caller passed gives impossible distances."""
    median = missing_depth.middle(raw)
    if kind in METRIC and median > 0 and not missing_depth.is_plausible(median / scale):
        meant = missing_depth.scale_of_file(scale, median)
        way_out = f"pass {option('depth_scale', round(meant))}" if meant else "is that right?"
        given = f"{option('depth_scale', scale)} (values per metre)"
        note(f"{given} puts the middle of {name} at {median / scale:.3g} m: {way_out}")


def _check_filed(raw: NDArray[Any], filed: float, note: Note) -> float:
    """Return the scale in the camera's file, or what it must mean if its distances are impossible."""
    median = missing_depth.middle(raw)
    is_float = raw.dtype.kind == "f"
    if not missing_depth.is_plausible(median / filed) and median > 0:
        scale = (
            (1.0 if missing_depth.is_plausible(median) else 1000.0)
            if is_float
            else missing_depth.scale_of_file(filed, median)
        )
        impossible = f"the camera's file has depth_scale {filed:g}, which puts the middle at {median / filed:.3g} m"
        if scale and missing_depth.is_plausible(median / scale):
            note(f"{impossible}: taken as {scale:g} a metre; pass {option('depth_scale')} if that is wrong")
            return scale
        note(f"{impossible}: pass {option('depth_scale')} (raw values per metre) if that is wrong")
    elif is_float and filed != 1:
        way_out = f"pass {option('depth_scale', 1)} if it is in metres"
        note(f"floating point depth is divided by {filed:g}, as its file or the camera's says; {way_out}")
    return filed


def _scale_of_floats(raw: NDArray[Any], note: Note) -> tuple[float, str]:
    median = missing_depth.middle(raw)
    network = f"{option('depth_kind', 'inverse')} for a network's output"
    if median > missing_depth.FARTHEST or (median > 1000 * missing_depth.NEAREST and missing_depth.is_whole(raw)):
        centimetres = f"{option('depth_scale', 100)} in centimetres"
        way_out = f"pass {option('depth_scale', 1)} if it is in metres, {centimetres}, {network}"
        note(f"floating point depth has its middle at {median:.4g}: taken as millimetres; {way_out}")
        return 1000.0, "millimetres, by their size"
    if median < missing_depth.NEAREST:
        way_out = f"pass {option('depth_scale')} if it is not in metres, {network}"
        note(f"floating point depth has its middle at {median:.3g} m; {way_out}")
    return 1.0, "floating point metres"


def _scale_of_integers(raw: NDArray[Any], counts: depth_files.Counts | None, note: Note) -> tuple[float, str]:
    scale = _find_scale(raw, counts)
    if scale:
        way_out = f"pass {option('depth_scale', 1000)} if it is in millimetres"
        note(f"depth is of integers, taken as {scale:g} a metre (TUM's), as its values are spaced; {way_out}")
        return scale, "TUM's, by the spacing of its values"
    median = missing_depth.middle(raw)
    text = f"depth is of integers, without {option('depth_scale')}: taken as millimetres (1000 per metre)"
    if not missing_depth.is_plausible(median / 1000) or median / 1000 > _WORTH_A_HINT:
        buffer = option("depth_kind", "buffer")
        kinds = f"{option('depth_kind', 'inverse')} for a network's output, or {buffer} for OpenGL's"
        text += (
            f", its middle is at {median / 1000:.3g} m; if that is wrong, pass {option('depth_scale')} (TUM has 5000), "
        )
        text += kinds
    note(text)
    return 1000.0, "integer millimetres"


def _find_scale(raw: NDArray[Any], counts: depth_files.Counts | None) -> float | None:
    """Return the scale that the spacing of 16-bit values shows."""
    if counts is None:
        return None
    values = np.flatnonzero(counts[1 : missing_depth.FAR]) + 1
    return missing_depth.scale_of_values(values, counts[values], missing_depth.middle(raw), raw.size)
