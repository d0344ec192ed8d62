"""Known families of networks: what each wants as pixels and gives as depth. A new family is a row of FAMILIES.

Read in the sources of MiDaS (Ranftl et al. 2020), DPT (Ranftl et al. 2021), ZoeDepth (Bhat et al. 2023), Depth
Anything 1 to 3 (Yang et al. 2024, Lin et al. 2025), Metric3D (Yin et al. 2023, Hu et al. 2024), UniDepth (Piccinelli et
al. 2024, 2025), Depth Pro (Bochkovskii et al. 2024) and MoGe (Wang et al. 2025), and of their exports to ONNX.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

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
    """Networks that want and give the same.

    known_by   pattern in the names of the file and of its folders
    pixels     what their input is: see NORMALIZATIONS
    side       pixels of the input's shorter side, where the network takes any size
    step       its sides are multiples of this
    output     inverse depth without a scale; metres along the axis; metres for a focal length of CANONICAL pixels
               (Metric3D); depth without a scale (z); "": its values show it
    is_padded  a picture of another shape than the input's is bordered instead of stretched
    outputs    names of outputs by which a file of any name is known
    """

    title: str
    known_by: str
    pixels: PixelsName = "imagenet"
    side: int = 518
    step: int = 14
    output: Output = "metres"
    is_padded: bool = False
    outputs: frozenset[str] = frozenset()


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
    for name in names:  # the file's own says more than its folders'
        text = name.lower().replace("_", "-")
        if found := next((one for one in FAMILIES if re.search(one.known_by, text)), None):
            return found
    plain = {name.lower() for name in outputs}
    return next((one for one in FAMILIES if one.outputs and one.outputs <= plain), UNKNOWN)
