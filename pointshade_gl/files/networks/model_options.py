"""Known families of networks, and what a caller states about one."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Literal, TypeGuard, get_args

from ...checks.arguments import check_choice
from ...notes.words import option, shown
from ..access.content import FilePath

PixelsName = Literal["imagenet", "symmetric", "unit", "bytes"]
PIXELS: tuple[PixelsName, ...] = get_args(PixelsName)
Three = tuple[float, float, float]
# Mean and deviation of the pixels that a network was trained on, for values from 0 to 1.
NORMALIZATIONS: dict[str, tuple[Three, Three]] = {
    "imagenet": ((0.485, 0.456, 0.406), (0.229, 0.224, 0.225)),
    "symmetric": ((0.5, 0.5, 0.5), (0.5, 0.5, 0.5)),
    "unit": ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
    "bytes": ((0.0, 0.0, 0.0), (1 / 255, 1 / 255, 1 / 255)),
}
Output = Literal["inverse", "metres", "canonical", "z", ""]


@dataclass(frozen=True)
class Family:
    """Networks that want and give the same."""

    title: str
    known_by: str  # pattern in the names of the file and of its folders
    pixels: PixelsName = "imagenet"  # what their input is: see NORMALIZATIONS
    side: int = 518  # pixels of the input's shorter side, where the network takes any size
    step: int = 14  # its sides are multiples of this
    # inverse depth without a scale; metres along the axis; metres for a focal length of CANONICAL pixels (Metric3D);
    # depth without a scale (z); "": its values show it
    output: Output = "metres"
    is_padded: bool = False  # a picture of another shape than the input's is bordered instead of stretched
    outputs: frozenset[str] = frozenset()  # names of outputs by which a file of any name is known


CANONICAL = 1000.0  # pixels of focal length
UNKNOWN = Family("an unknown network", "", output="")
_OF_POINTS = frozenset(("points", "mask", "metric_scale"))
FAMILIES = (
    Family("Depth Pro", r"depth[-_ ]?pro", "symmetric", 1536, 1536, outputs=frozenset(("focallength_px",))),
    Family("MoGe", r"moge", "unit", outputs=_OF_POINTS),
    Family("Metric3D", r"metric[-_]?3d", "bytes", 616, 28, "canonical", is_padded=True),
    Family("UniDepth", r"unidepth", outputs=frozenset(("pts_3d", "intrinsics"))),
    Family("ZoeDepth", r"zoe", "symmetric", 384, 32),
    Family("Depth Anything 3", r"depth[-_ ]?anything[-_ ]?v?3|\bda[-_]?v?3", side=504, output="z"),
    Family(
        "Depth Anything for metres",
        r"(depth[-_ ]?anything|\bda[-_]?v?2).*(metric|indoor|outdoor|kitti|hypersim|nyu)|metric.*depth[-_ ]?anything",
    ),
    Family("Depth Anything", r"depth[-_ ]?anything|\bda[-_]?v?[12]\b", output="inverse"),
    Family("DPT", r"\bdpt|swin2|beit", "symmetric", 384, 32, "inverse"),
    Family("MiDaS small", r"midas.*small|model-small|midas.*256", side=256, step=32, output="inverse"),
    Family("MiDaS", r"midas|model-f6b98070", side=384, step=32, output="inverse"),
)
_FOLDERS = 3  # of a path, by which a network is known: .../depth-anything-v2-small/onnx/model.onnx


def family_of(path: Path, outputs: Collection[str]) -> Family:
    """Return the family of a network by the names of its file, its folders and its outputs; else UNKNOWN."""
    names = [path.name, *(one.name for one in list(path.parents)[: _FOLDERS - 1])]
    for name in names:  # the file's own means more than its folders'
        text = name.lower().replace("_", "-")
        if found := next((one for one in FAMILIES if re.search(one.known_by, text)), None):
            return found
    plain = {name.lower() for name in outputs}
    return next((one for one in FAMILIES if one.outputs and one.outputs <= plain), UNKNOWN)


SUFFIX = ".onnx"
Model = FilePath | Callable[[Any], Any]
_SIZE = re.compile(r"(\d{1,5})(?:x(\d{1,5}))?")
_LARGEST = 16_384  # pixels a side


@dataclass(frozen=True)
class ModelOptions:
    """A network and its input."""

    model: Model  # an .onnx file, or a function of a photograph (h, w, 3) uint8
    # (width, height), or the shorter side alone with None; None: as the file has it
    size: tuple[int, int | None] | None = None
    pixels: PixelsName | None = None  # what the input is; None: as the file has it
    cache: bool = False  # whether depth is kept beside the photograph

    @property
    def path(self) -> Path | None:
        """The file; None for a function."""
        return None if callable(self.model) else Path(self.model)

    @property
    def title(self) -> str:
        name = getattr(self.model, "__name__", type(self.model).__name__)
        return f"the function {name}" if self.path is None else self.path.name


def how_to_make_depth() -> str:
    """Return what to do with a photograph alone, to end a sentence."""
    return (
        "a network makes its depth: download model.onnx of onnx-community/depth-anything-v2-small from "
        f"huggingface.co, pip install '.[onnx]' in the clone, and pass {option('depth_model', 'model.onnx')}"
    )


def is_model(value: Any) -> TypeGuard[Model]:
    """Return whether it is a network: a function, or the name of an .onnx file."""
    return callable(value) or (isinstance(value, str | PathLike) and str(value).lower().endswith(SUFFIX))


def checked_options(model: Any, size: Any, pixels: Any, cache: bool) -> ModelOptions:
    """Return the options as a value. Raises TypeError or ValueError for what is none."""
    if not is_model(model):
        expected = f"an {SUFFIX} file or, in Python, a function of a photograph (h, w, 3)"
        raise TypeError(f"{option('depth_model')} must be {expected}, got {shown(model)}")
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
        expected = "WIDTHxHEIGHT in pixels, such as 686x518, or the shorter side alone"
        raise ValueError(f"{option('model_size')} must be {expected}, got {shown(value)}")
    return width, height
