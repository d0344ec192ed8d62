"""What a network's file says about its input and output: in its metadata, and in the configuration beside it.

Hugging Face lays preprocessor_config.json and config.json beside a network, or one folder above onnx/model.onnx.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..access.content import read_text
from .families import NORMALIZATIONS, Output, Three

_OUTPUTS: dict[str, Output] = {
    "relative": "inverse", "inverse": "inverse", "inverse_depth": "inverse", "disparity": "inverse",
    "metric": "metres", "metres": "metres", "meters": "metres", "z": "z",
}  # fmt: skip
_METRIC_TYPES = ("zoedepth", "depth_pro", "glpn")
_LARGEST = 1e5  # pixels a side
_CONFIGURATIONS = "preprocessor_config.json", "config.json"


@dataclass(frozen=True)
class Facts:
    """What is written; None = nothing.

    normalization  mean and deviation of pixels from 0 to 1
    side           pixels of the input's shorter side
    step           its sides are multiples of this
    output         what the network gives
    source         where it was read, for notes
    """

    normalization: tuple[Three, Three] | None = None
    side: int | None = None
    step: int | None = None
    output: Output | None = None
    source: str = ""


def facts_of(path: Path, metadata: Mapping[str, str]) -> Facts:
    """Return what the metadata of a network say, and else the configuration beside it."""
    found, sources = dict[str, Any](), []
    for folder in (path.parent, path.parent.parent):
        for name in _CONFIGURATIONS:
            if read := _configuration(folder / name):
                found, sources = read | found, [*sources, name]
        if found:
            break
    own = {name: _value(text) for name, text in metadata.items()}
    if own := {name: value for name, value in own.items() if name in _READ}:
        found, sources = found | own, ["its metadata", *sources]
    return Facts(_normalization(found), _side(found), _number(found, "ensure_multiple_of"), _output(found),
                 " and ".join(sources))  # fmt: skip


_READ = (
    "image_mean", "mean", "image_std", "std", "pixels", "do_normalize", "do_rescale", "size", "input_size",
    "ensure_multiple_of", "depth_estimation_type", "model_type", "depth_kind", "max_depth",
)  # fmt: skip


def _configuration(path: Path) -> dict[str, Any]:
    try:
        read = json.loads(read_text(path)) if path.is_file() else {}
    except (ValueError, OSError):
        return {}
    return {name: read[name] for name in _READ if name in read} if isinstance(read, dict) else {}


def _value(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return [float(one) for one in text.split(",")] if _are_numbers(text) else text


def _are_numbers(text: str) -> bool:
    try:
        return len([float(one) for one in text.split(",")]) > 1
    except ValueError:
        return False


def _normalization(found: Mapping[str, Any]) -> tuple[Three, Three] | None:
    if (name := found.get("pixels")) in NORMALIZATIONS:
        return NORMALIZATIONS[name]
    mean, deviation = (found.get(name, found.get(f"image_{name}")) for name in ("mean", "std"))
    if found.get("do_normalize") is False:
        return NORMALIZATIONS["bytes" if found.get("do_rescale") is False else "unit"]
    values = np.array([_three(mean), _three(deviation)])
    if not np.isfinite(values).all() or (values[1] <= 0).any():
        return None
    if values.max() > 2:  # of values up to 255
        values /= 255
    return tuple(values[0].tolist()), tuple(values[1].tolist())


def _three(value: Any) -> list[float]:
    numbers = value if isinstance(value, list) else [value] * 3
    is_right = len(numbers) == 3 and all(type(one) in (int, float) for one in numbers)
    return [float(one) for one in numbers] if is_right else [math.nan] * 3


def _side(found: Mapping[str, Any]) -> int | None:
    size = found.get("size", found.get("input_size"))
    if isinstance(size, dict):
        size = [size.get(name) for name in ("height", "width", "shortest_edge")]
    sides: list[Any] = size if isinstance(size, list) else [size]
    known = [one for one in sides if type(one) in (int, float) and 1 <= one < _LARGEST]
    return int(min(known)) if known else None


def _number(found: Mapping[str, Any], name: str) -> int | None:
    value = found.get(name)
    return value if type(value) is int and 1 <= value <= 1024 else None


def _output(found: Mapping[str, Any]) -> Output | None:
    said = str(found.get("depth_kind", found.get("depth_estimation_type", ""))).lower()
    if said not in _OUTPUTS:
        return "metres" if found.get("model_type") in _METRIC_TYPES else None
    return _OUTPUTS[said]
