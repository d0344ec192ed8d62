"""The passes of a picture: the layers that a compositor takes, by their names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import check_choice, is_a
from ..notes.words import option, shown
from .camera import Camera

ALL = "all"
EACH_LIGHT = "light", "unshadowed", "shadow"  # a layer for each light: light_1, light_2 ...
AROUND = "ambient", "environment", "unlit"
OF_LIGHT = "beauty", *AROUND, "ground", *EACH_LIGHT
OF_SURFACES = "normal", "normal_world", "depth", "position", "certainty", "ao", "object_id"
PASSES = (*OF_LIGHT, "albedo", *OF_SURFACES)
LIT = 1e-6  # light below which there is no saying how much of it a shadow takes

Layer = NDArray[np.float32]


class Passes(dict[str, Layer]):
    """The layers of a picture by their names, and who sees it.

    camera   of the picture
    pose     (4, 4) its camera-to-world
    objects  the names of what `object_id` counts, from 1
    """

    def __init__(self, layers: Mapping[str, Layer], camera: Camera, pose: NDArray[np.float64], objects: Iterable[str]):
        super().__init__(layers)
        self.camera, self.pose, self.objects = camera, pose, tuple(objects)


def check_passes(passes: str | Sequence[str]) -> tuple[str, ...]:
    """Return the names of passes, in the order of PASSES. Raises ValueError or TypeError for anything else."""
    if isinstance(passes, str):
        passes = [one.strip() for one in passes.split(",")]
    if not is_a(passes, Sequence) or not passes:
        raise TypeError(f"{option('passes')} must be {ALL!r} or names of passes, got {shown(passes)}")
    for one in passes:
        check_choice(option("passes"), one, (ALL, *PASSES))
    return tuple(name for name in PASSES if ALL in passes or name in passes)


def kind_of(layer: str) -> str:
    """Return the pass that a layer is of: light for light_2."""
    name, _, number = layer.rpartition("_")
    return name if number.isdigit() else layer


def surface_layers(
    names: Sequence[str], surfaces: Layer, open_share: Layer, objects: NDArray[np.integer], camera: Camera,
    pose: NDArray[np.float64],
) -> dict[str, Layer]:  # fmt: skip
    """Return the layers of OF_SURFACES that have these names.

    surfaces    (h, w, 4) normal, as long as it is certain, and z, the camera's axes; z is 0 where nothing is
    open_share  (h, w) of the light from all around that arrives
    objects     (h, w) numbers from 1
    """
    depth = np.abs(surfaces[..., 3])
    is_seen = depth > 0
    certainty = np.linalg.norm(surfaces[..., :3], axis=-1)
    has_normal = (is_seen & (certainty > 0))[..., None]
    normal = np.where(has_normal, surfaces[..., :3] / np.maximum(certainty, LIT)[..., None], np.float32(np.nan))
    found = {
        "normal": normal,
        "normal_world": normal @ pose[:3, :3].T,
        "depth": depth,
        "position": np.where(is_seen[..., None], camera.unproject(depth, pose=pose), np.nan),
        "certainty": np.where(is_seen, np.minimum(certainty, 1), 0),
        "ao": np.where(is_seen & (open_share >= 0), open_share, 1),
        "object_id": np.where(is_seen, objects, 0),
    }
    return {name: np.ascontiguousarray(found[name], np.float32) for name in names if name in found}


def shadow_of(lit: Layer, unshadowed: Layer) -> Layer:
    """Return (h, w) the share of a light that shadows take, of its light (h, w, 3) with them and without."""
    whole = unshadowed.sum(-1)
    share = 1 - lit.sum(-1) / np.maximum(whole, LIT)
    return np.where(whole > LIT, np.clip(share, 0, 1), np.float32(0)).astype(np.float32)
