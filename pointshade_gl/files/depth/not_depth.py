"""Recognises pictures that were passed as depth by mistake: a photograph, a mask, a map of labels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

_WIDTH = 640  # a wider picture is thinned first: a large photograph is smooth from pixel to pixel
_ROUGH = 0.22  # of the pixels bend by 3 levels or more: photographs 0.27 to 0.74, depth up to 0.19 even as JPEG
_FEWEST, LABELS = 5, 64  # different values of a map of labels
_EVEN = 0.9  # of its neighbours are equal
_NEXT = 0.5  # of its steps lead from one value to the next: depth goes through all of them


def what_instead(image: NDArray[np.uint8]) -> str | None:
    """What a picture (h, w) of 8 bits shows instead of depth, None if it may be depth."""
    thin = _thinned(image)
    values = np.unique(thin)
    if values.size < _FEWEST:
        return f"a mask (different values: {values.size})"
    if is_of_labels(thin):
        return f"a map of labels (flat values: {values.size})"
    bends = np.abs(np.diff(thin.astype(np.int16), 2, axis=1))
    return "a photograph (neighbouring pixels differ too much)" if _share(bends >= 3) > _ROUGH else None


def is_of_labels(image: NDArray[Any]) -> bool:
    """Whether a picture (h, w) has few values, in flat areas, and jumps between any two of them."""
    thin = _thinned(image)
    values = np.unique(thin)
    if not _FEWEST <= values.size <= LABELS:
        return False
    steps = np.diff(np.searchsorted(values, thin).astype(np.int16), axis=1)
    changes = np.abs(steps[steps != 0])
    return changes.size < (1 - _EVEN) * steps.size and _share(changes == 1) < _NEXT


def _thinned(image: NDArray[Any]) -> NDArray[Any]:
    step = max(1, image.shape[1] // _WIDTH)
    return image[::step, ::step]


def _share(found: NDArray[Any]) -> float:
    return float(found.mean()) if found.size else 0.0
