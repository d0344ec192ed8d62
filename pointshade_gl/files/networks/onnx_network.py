"""Runs the network of an .onnx file, and knows what its input and output are."""

from __future__ import annotations

import json
import math
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...notes.words import cut, option
from ..access.content import import_extra, note_read, read_head, read_text
from .model_options import NORMALIZATIONS, Family, ModelOptions, Output, Three, family_of

_OUTPUTS: dict[str, Output] = {
    "relative": "inverse", "inverse": "inverse", "inverse_depth": "inverse", "disparity": "inverse",
    "metric": "metres", "metres": "metres", "meters": "metres", "z": "z",
}  # fmt: skip
_METRIC_TYPES = ("zoedepth", "depth_pro", "glpn")
_LARGEST = 1e5  # pixels a side
_CONFIGURATIONS = "preprocessor_config.json", "config.json"


@dataclass(frozen=True)
class ModelFacts:
    """What is written; None = nothing."""

    normalization: tuple[Three, Three] | None = None  # mean and deviation of pixels from 0 to 1
    side: int | None = None  # pixels of the input's shorter side
    step: int | None = None  # its sides are multiples of this
    output: Output | None = None  # what the network gives
    source: str = ""  # where it was read, for notes


def facts_of(path: Path, metadata: Mapping[str, str]) -> ModelFacts:
    """Return what the metadata of a network state, and else the configuration beside it."""
    found, sources = dict[str, Any](), []
    for folder in (path.parent, path.parent.parent):
        for name in _CONFIGURATIONS:
            if read := _configuration(folder / name):
                found, sources = read | found, [*sources, name]
        if found:
            break
    if own := {name: _value(text) for name, text in metadata.items() if name in _READ}:
        found, sources = found | own, ["its metadata", *sources]
    step, kind = found.get("ensure_multiple_of"), str(found.get("depth_kind", found.get("depth_estimation_type", "")))
    step = step if type(step) is int and 1 <= step <= 1024 else None
    output: Any = _OUTPUTS.get(kind.lower(), "metres" if found.get("model_type") in _METRIC_TYPES else None)
    return ModelFacts(_normalization(found), _side(found), step, output, " and ".join(sources))


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
    """JSON, numbers with commas between them, or the text itself."""
    try:
        return json.loads(text)
    except ValueError:
        pass
    try:
        return [float(one) for one in text.split(",")] if "," in text else text
    except ValueError:
        return text


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


# The quickest of those that there are; TensorRT is left out, as it compiles for minutes.
_PROVIDERS = tuple(f"{name}ExecutionProvider" for name in ("CUDA", "ROCM", "Dml", "CoreML", "OpenVINO", "CPU"))
_TYPES = {"tensor(float)": np.float32, "tensor(float16)": np.float16, "tensor(uint8)": np.uint8,
          "tensor(double)": np.float64}  # fmt: skip
_TOKENS, _TOKEN_NAMES = 1800, ("num_tokens", "num_token")  # MoGe: how finely it looks
_LONGEST = 4  # times as long as wide is an input at most
_BORDER = 124, 116, 104  # the mean of ImageNet
_UNREADABLE = "is no network that ONNX Runtime can read"


class InputShape(NamedTuple):
    """Of the input: where its axes are, and its sides; None where the network takes any."""

    rank: int  # (n, 3, h, w) has 4; Depth Anything 3 has a 5th for several views
    is_channels_last: bool
    height: int | None
    width: int | None


class Prepared(NamedTuple):
    """The pixels of an input, its (width, height), and the part of it that is the photograph's."""

    pixels: NDArray[Any]
    whole: tuple[int, int]
    rows: slice
    columns: slice

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of that part."""
        return self.columns.stop - self.columns.start, self.rows.stop - self.rows.start


@dataclass(frozen=True, eq=False)
class Network:
    """A network that was opened: what it wants, and what it gives."""

    path: Path
    session: Any
    family: Family
    facts: ModelFacts
    input: str
    shape: InputShape
    dtype: Any
    others: Mapping[str, NDArray[Any]]  # inputs that are always the same
    remark: str  # what was not as expected
    lock: threading.Lock

    @property
    def output(self) -> Output:
        return self.facts.output or self.family.output

    def normalization(self, options: ModelOptions) -> tuple[Three, Three]:
        """Return mean and deviation of the pixels, for values from 0 to 1."""
        if options.pixels:
            return NORMALIZATIONS[options.pixels]
        if self.dtype is np.uint8:
            return NORMALIZATIONS["bytes"]
        return self.facts.normalization or NORMALIZATIONS[self.family.pixels]

    def size(self, options: ModelOptions, width: int, height: int) -> tuple[int, int]:
        """Return (width, height) of the input for a photograph of this size. Raises ValueError for a wrong wish."""
        fixed = self.shape.width, self.shape.height
        wished = options.size or (self.facts.side or self.family.side, None)
        if wished[1] is None:
            wished = _like(wished[0], self.facts.step or self.family.step, width, height)
        if options.size is not None and any(own and own != wish for own, wish in zip(fixed, wished, strict=True)):
            own = "x".join(str(side or "any") for side in fixed)
            raise ValueError(f"{self.path.name} takes pictures of {own} pixels: leave out {option('model_size')}")
        return fixed[0] or wished[0], fixed[1] or wished[1]  # type: ignore[return-value]

    def prepare(self, photo: NDArray[np.uint8], options: ModelOptions) -> Prepared:
        """Return a photograph (h, w, 3) as the input has it."""
        from PIL import Image

        width, height = wide, high = self.size(options, photo.shape[1], photo.shape[0])
        if self.family.is_padded:  # the photograph keeps its shape
            scale = min(width / photo.shape[1], height / photo.shape[0])
            wide, high = max(1, round(photo.shape[1] * scale)), max(1, round(photo.shape[0] * scale))
        left, top = (width - wide) // 2, (height - high) // 2
        canvas = Image.new("RGB", (width, height), _BORDER)
        canvas.paste(Image.fromarray(photo).resize((wide, high), Image.Resampling.BICUBIC), (left, top))
        mean, deviation = (np.array(one, np.float32) for one in self.normalization(options))
        pixels = (np.asarray(canvas, np.float32) / 255 - mean) / deviation
        pixels = (np.rint(pixels) if self.dtype is np.uint8 else pixels).astype(self.dtype)
        pixels = pixels if self.shape.is_channels_last else np.moveaxis(pixels, 2, 0)
        pixels = np.ascontiguousarray(pixels[(None,) * (self.shape.rank - 3)])
        return Prepared(pixels, (width, height), slice(top, top + high), slice(left, left + wide))

    def run(self, prepared: Prepared) -> dict[str, NDArray[Any]]:
        """Return its outputs by name. Raises ValueError if it cannot take the input."""
        names = [one.name for one in self.session.get_outputs()]
        try:
            with self.lock:
                found = self.session.run(None, {self.input: prepared.pixels, **self.others})
        except Exception as error:  # its own exceptions have no common parent but this
            size = "x".join(map(str, prepared.pixels.shape[1:]))
            way_out = f"pass {option('model_size', 'WxH')} ({_reason(error)})"
            raise ValueError(f"{self.path} cannot take an input of {size}: {way_out}") from None
        return {name: np.asarray(one) for name, one in zip(names, found, strict=True) if isinstance(one, np.ndarray)}


def open_network(path: Path) -> Network:
    """Open a network once. Raises ValueError for a damaged one, one that wants more than a picture, and no runtime."""
    read_head(path)
    note_read([path])
    status = path.stat()
    return _opened(path, status.st_mtime_ns, status.st_size)


@lru_cache(2)
def _opened(path: Path, _time: int, _size: int) -> Network:
    session, remark = _session(import_extra("onnxruntime", "onnx", f"{path} is a network"), path)
    outputs = [one.name for one in session.get_outputs()]
    try:
        metadata = session.get_modelmeta().custom_metadata_map
    except Exception:  # texts that are none
        metadata = {}
    inputs = {one.name: one for one in session.get_inputs()}
    name, shape = _picture_input(path, inputs)
    others = {other: _constant(path, inputs[other], list(inputs)) for other in inputs if other != name}
    family = family_of(path.absolute(), outputs)
    dtype = _TYPES[inputs[name].type]
    return Network(path, session, family, facts_of(path.absolute(), metadata), name, shape, dtype, others,
                   remark, threading.Lock())  # fmt: skip


def _session(runtime: Any, path: Path) -> tuple[Any, str]:
    """Return a session on the quickest device that takes the network, and a sentence if that is not the first."""
    options = runtime.SessionOptions()
    options.log_severity_level = 4  # what goes wrong is in its exceptions
    offered = [name for name in _PROVIDERS if name in runtime.get_available_providers()]
    try:
        return runtime.InferenceSession(str(path), options, providers=offered), ""
    except Exception as error:  # its own exceptions have no common parent but this
        first, reason = offered[0], _reason(error)
    try:
        session = runtime.InferenceSession(str(path), options, providers=offered[-1:])
    except Exception:
        raise ValueError(f"{path} {_UNREADABLE}: {reason}") from None
    return session, f"{path.name} does not run on {first.removesuffix('ExecutionProvider')}, the CPU is taken: {reason}"


def _picture_input(path: Path, inputs: Mapping[str, Any]) -> tuple[str, InputShape]:
    """Return the input that is a picture. Raises ValueError if none is, or several may be."""
    found = {name: shape for name, one in inputs.items() if one.type in _TYPES and (shape := _shape(one.shape))}
    if len(found) != 1:
        listed = ", ".join(f"{name} {one.type.removeprefix('tensor')} {one.shape}" for name, one in inputs.items())
        expected = "expected one picture, (1, 3, h, w) or (1, h, w, 3)"
        raise ValueError(f"{path} has the inputs {cut(listed) or 'none'}: {expected}")
    return next(iter(found.items()))


def _shape(sides: Any) -> InputShape | None:
    """Return the shape of an input that may be a picture; sides that are names are open."""
    known = [side if isinstance(side, int) and side > 0 else None for side in sides or ()]
    if len(known) not in (4, 5) or any(side not in (1, None) for side in known[:-3]):
        return None
    first, second, third = known[-3:]
    if third == 3 and first != 3:
        return InputShape(len(known), True, first, second)
    return InputShape(len(known), False, second, third) if first in (3, None) else None


def _constant(path: Path, wanted: Any, names: list[str]) -> NDArray[Any]:
    """Return the value of an input that is no picture. Raises ValueError if nothing is known to put there."""
    if wanted.name.lower() in _TOKEN_NAMES:
        rank = len(wanted.shape or ())
        return np.array(_TOKENS, np.int32 if "int32" in wanted.type else np.int64).reshape((1,) * rank)
    wants = f"{path} wants {wanted.name} beside the picture (its inputs: {', '.join(names)})"
    way_out = "take an export of the network with a picture as its only input"
    raise ValueError(f"{wants}, which a photograph has not: {way_out}")


def _like(side: int, step: int, width: int, height: int) -> tuple[int, int]:
    """Return sides in the ratio of the photograph's, multiples of a step; the shorter one is given."""
    scale = max(side / min(width, height), 1e-9)
    lengths = (min(length * scale, _LONGEST * side) for length in (width, height))
    columns, rows = (max(step, round(length / step) * step) for length in lengths)
    return columns, rows


def _reason(error: Exception) -> str:
    """Return the message of ONNX Runtime, without its codes."""
    return cut(str(error).rpartition(" : ")[2] or type(error).__name__, 160)
