"""What is said about a network: its file, and what its input is where a guess would be wrong."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeGuard

from ...checks.arguments import check_choice
from ...notes.words import option, shown
from ..access.content import FilePath
from .families import PIXELS, PixelsName

SUFFIX = ".onnx"
Model = FilePath | Callable[[Any], Any]
_SIZE = re.compile(r"(\d{1,5})(?:x(\d{1,5}))?")
_LARGEST = 16_384  # pixels a side


@dataclass(frozen=True)
class ModelOptions:
    """A network and its input.

    model   an .onnx file, or a function of a photograph (h, w, 3) uint8
    size    (width, height), or the shorter side alone with None; None: as the file says
    pixels  what the input is; None: as the file says
    cache   whether depth is kept beside the photograph
    """

    model: Model
    size: tuple[int, int | None] | None = None
    pixels: PixelsName | None = None
    cache: bool = False

    @property
    def path(self) -> Path | None:
        """The file; None for a function."""
        return None if callable(self.model) else Path(self.model)

    @property
    def title(self) -> str:
        """How messages name it."""
        name = getattr(self.model, "__name__", type(self.model).__name__)
        return f"the function {name}" if self.path is None else self.path.name


def how_to_make_depth() -> str:
    """Return what to do with a photograph alone, to end a sentence."""
    return (
        "a network makes its depth: download model.onnx of onnx-community/depth-anything-v2-small from "
        f"huggingface.co, pip install 'pointshade-gl[onnx]', and pass {option('depth_model', 'model.onnx')}"
    )


def is_model(value: Any) -> TypeGuard[Model]:
    """Return whether it is a network: a function, or the name of an .onnx file."""
    return callable(value) or ((hasattr(value, "__fspath__") or isinstance(value, str)) and _is_named_so(value))


def _is_named_so(value: FilePath) -> bool:
    return str(value).lower().endswith(SUFFIX)


def checked_options(model: Any, size: Any, pixels: Any, cache: bool) -> ModelOptions:
    """Return the options as a value. Raises TypeError or ValueError for what is none."""
    if not is_model(model):
        raise TypeError(
            f"{option('depth_model')} must be an {SUFFIX} file"
            f" or, in Python, a function of a photograph (h, w, 3), got {shown(model)}"
        )
    if pixels is not None:
        check_choice(option("model_pixels"), pixels, PIXELS)
    return ModelOptions(model, None if size is None else size_of(size), pixels, cache)


def size_of(value: Any) -> tuple[int, int | None]:
    """Return (width, height), or (shorter side, None), of such a pair, a number, or a text such as 686x518 or 518."""
    found = _SIZE.fullmatch(str(value)) if isinstance(value, str | int) else None
    sides: Any = (found[1], found[2]) if found else value
    try:
        width, height = (None if one is None else int(one) for one in sides)
    except (TypeError, ValueError):
        width, height = 0, None
    if not width or not 1 <= width <= _LARGEST or (height is not None and not 1 <= height <= _LARGEST):
        raise ValueError(
            f"{option('model_size')} must be WIDTHxHEIGHT in pixels, such as 686x518, or the shorter side alone, "
            f"got {shown(value)}"
        )
    return width, height
