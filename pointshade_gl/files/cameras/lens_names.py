"""Finds the lens that a file describes: what programs call lens models, and the orders of their numbers."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from .lenses import PANORAMA, UNKNOWN, Lens, fisheye

Words = Mapping[str, list[float]]  # numbers by the last word of their name

_OPENCV = "k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tx ty"
_PRISM = "k1 k2 p1 p2 k3 k4 sx1 sy1"
_ARIA = "k0 k1 k2 k3 k4 k5 p0 p1 s0 s1 s2 s3"
# What a model is called, without blanks and dashes; its family; and the order of its numbers in a list.
_MODELS = tuple(
    (re.compile(pattern), family, order.split())
    for pattern, family, order in (
        (r"ocam|scaramuzza|omnidirectional|ortho|fisheye(poly|spher)|vr180|cylind|cubemap", UNKNOWN, ""),
        (r"stereograph|equisolid|mercator", UNKNOWN, ""),
        (r"equirect|latlong|spherical|panorama|^erp$", PANORAMA, ""),
        (r"radtanthinprism|fisheye62", "aria", _ARIA),
        (r"thinprismfisheye", "prism", _PRISM),
        (r"eucm|extendedunified", "eucm", "k1 k2 p1 p2"),
        (r"^ds$|doublesphere", "double sphere", "k1 k2 p1 p2"),
        (r"^(omni|omniradtan|mei|ucm)$|unified", "sphere", "k1 k2 p1 p2"),
        (r"equidist|^equi$|kannala|^kb\d?$|fisheye", "equidistant", "k1 k2 k3 k4"),
        (r"^fov|ftheta|^atan", "fov", "omega"),
        (r"division", "division", "k1"),
        (r"inversebrown", "inverse", _OPENCV),
        (r"modifiedbrown", "between", _OPENCV),
        (r"brown|plumb|rad|opencv|rational|polynomial|tangential", "brown", _OPENCV),
        (r"none|pinhole|perspective|rectified", "pinhole", _OPENCV),
    )
)
_KINDS = {  # words behind which a model is named; the first ones name nothing else
    "distortionmodel", "cameramodel", "lensmodel", "distorsion", "distortiontype", "model", "modeltype", "cameratype",
    "projection", "projectiontype", "projectionmodel", "type", "distortion", "isfisheye", "fisheye", "latlong",
    "islatlong",
}  # fmt: skip
_SURE = "distortionmodel", "cameramodel", "lensmodel", "distortiontype"
_LISTS = (
    "distortioncoefficients", "distortioncoeffs", "distortioncoeff", "distortioncoefs", "distcoeffs", "distcoeff",
    "distcoefs", "distortionparameters", "distortionparams", "distortion", "distortions", "dist", "coeffs", "kc", "d",
)  # fmt: skip
_NUMBERS = {"xi", "alpha", "beta", "omega", "mu", "fisheyemodel", *f"{_OPENCV} {_PRISM} {_ARIA}".split()}
_PAIRS = {
    "radialdistortion": ("k1", "k2", "k3", "k4", "k5", "k6"), "radial": ("k1", "k2", "k3", "k4", "k5", "k6"),
    "tangentialdistortion": ("p1", "p2"), "tangential": ("p1", "p2"),
}  # fmt: skip
KEPT = _NUMBERS | {*_LISTS, *_PAIRS, "intrinsics"}  # words whose numbers may be a lens's
OWNED = re.compile(r"(?i)dist|mirror|lens|coef|radial|tangential")  # groups within that of a camera

# COLMAP's models by their numbers, and the order of what they hold.
COLMAP = tuple(
    (name, order.split())
    for name, order in (
        ("SIMPLE_PINHOLE", "f cx cy"),
        ("PINHOLE", "fx fy cx cy"),
        ("SIMPLE_RADIAL", "f cx cy k1"),
        ("RADIAL", "f cx cy k1 k2"),
        ("OPENCV", "fx fy cx cy k1 k2 p1 p2"),
        ("OPENCV_FISHEYE", "fx fy cx cy k1 k2 k3 k4"),
        ("FULL_OPENCV", "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6"),
        ("FOV", "fx fy cx cy omega"),
        ("SIMPLE_RADIAL_FISHEYE", "f cx cy k1"),
        ("RADIAL_FISHEYE", "f cx cy k1 k2"),
        ("THIN_PRISM_FISHEYE", f"fx fy cx cy {_PRISM}"),
        ("RAD_TAN_THIN_PRISM_FISHEYE", f"fx fy cx cy {_ARIA}"),
        ("SIMPLE_DIVISION", "f cx cy k1"),
        ("DIVISION", "fx fy cx cy k1"),
        ("SIMPLE_FISHEYE", "f cx cy"),
        ("FISHEYE", "fx fy cx cy"),
        ("EUCM", "fx fy cx cy alpha beta"),
        ("EQUIRECTANGULAR", "w h"),
    )
)


def plain(text: str) -> str:
    """Return a name without anything but letters and digits, in lower case."""
    return re.sub(r"[^a-z0-9]", "", text.lower())


def names_a_model(word: str) -> bool:
    """Return whether a text behind this word may be a lens model."""
    return word in _KINDS


def find_lens(words: Words, texts: Mapping[str, str]) -> Lens | None:
    """Return the lens that a camera's numbers and texts describe, by the words before them; None for a pinhole."""
    models = [(text, _model_of(text)) for text in texts.values()]
    known = [(text, *model) for text, model in models if model]
    if words.get("fisheyemodel") == [1.0]:
        known.append(("fisheye", *_model_of("fisheye")))  # type: ignore[misc]
    best = [one for one in known if one[1] == UNKNOWN] + [one for one in known if one[1] not in ("brown", "pinhole")]
    title, family, order = (best or known or [("Brown-Conrady", "brown", _OPENCV.split())])[0]
    values = _numbers_of(words, order)
    strange = next((texts[key] for key in _SURE if key in texts and not _model_of(texts[key])), None)
    if strange and any(values.values()) and not best:
        return Lens(strange, UNKNOWN)
    lens = _lens_of("Brown-Conrady" if family == "pinhole" else title, family, values)
    return None if lens.is_pinhole else lens


def _model_of(text: str) -> tuple[str, list[str]] | None:
    found = plain(text).removeprefix("distortion")  # pyrealsense2 prints distortion.brown_conrady
    return next(((family, order) for pattern, family, order in _MODELS if pattern.search(found)), None)


def _numbers_of(words: Words, order: Sequence[str]) -> dict[str, float]:
    """The numbers of a lens by their own names, from names or from a list."""
    found = {name: words[name][0] for name in _NUMBERS if len(words.get(name, ())) == 1}
    for key, names in _PAIRS.items():
        found |= dict(zip(names, words.get(key, ()), strict=False))
    for key in _LISTS:
        if len(words.get(key, ())) >= (4 if key in ("d", "dist") else 1):
            return found | dict(zip(order, words[key], strict=False))
    return found


def _lens_of(title: str, family: str, values: Mapping[str, float]) -> Lens:
    def some(names: str) -> tuple[Any, ...]:
        return tuple(values.get(name, 0.0) for name in names.split())

    first = some("k1 k2 k3 k4") if "p1" not in values else some("k1 k2 p1 p2")
    if family in (UNKNOWN, PANORAMA):
        return Lens(title, family)
    if any(some("tx ty")):
        return Lens("a tilted sensor", UNKNOWN)
    if family == "equidistant":
        return fisheye(some("k2 k3 k4 k5" if "mu" in values else "k1 k2 k3 k4"))  # camodocal counts from 2
    if family == "aria":
        radial, (p0, p1) = some("k0 k1 k2 k3 k4 k5"), some("p0 p1")
        return Lens(title, "equidistant", (), radial, (), (p1, p0), some("s0 s1 s2 s3"), "after")
    if family == "prism":
        x, y = some("sx1 sy1")
        return Lens(title, "equidistant", (), some("k1 k2 k3 k4"), (), some("p1 p2"), (x, 0.0, y, 0.0))
    if family == "division":
        (k,) = some("k1")
        return Lens(title, "division" if k else "pinhole", (k,))
    if family == "fov":
        omega = values.get("omega", values.get("k1", 0.0))
        return Lens(title, "fov" if abs(omega) > 1e-9 else "pinhole", (omega,))
    shape = {"eucm": "alpha beta", "double sphere": "xi alpha", "sphere": "xi"}.get(family)
    if family == "sphere" and "xi" not in values and "alpha" in values:
        family, shape, values = "eucm", "alpha beta", {**values, "beta": 1.0}  # Usenko's unified model
    order = family if family in ("inverse", "between") else "before"
    numbers = some("k1 k2 k3"), some("k4 k5 k6"), some("p1 p2"), some("s1 s2 s3 s4"), order, first
    return Lens(title, family if shape else "pinhole", some(shape or ""), *numbers)  # type: ignore[arg-type]


def kalibr_words(words: Words, texts: Mapping[str, str]) -> Words:
    """Return the words with Kalibr's `intrinsics` divided, where numbers of a model stand before fx, fy, cx, cy."""
    names = {"omni": ["xi"], "ds": ["xi", "alpha"], "eucm": ["alpha", "beta"]}.get(texts.get("cameramodel", ""))
    numbers = words.get("intrinsics", [])
    if names is None or len(numbers) != len(names) + 4:
        return words
    return {**words, "intrinsics": numbers[-4:], **{name: [one] for name, one in zip(names, numbers, strict=False)}}
