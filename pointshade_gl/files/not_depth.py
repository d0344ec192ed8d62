"""8-bit pictures that are handed in as depth: a photograph, a mask and a map of labels are none."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

_WIDTH = 640  # a wider picture is thinned first: a large photograph is smooth from pixel to pixel
_ROUGH = 0.22  # of the pixels bend by 3 levels or more: photographs 0.27 to 0.74, depth up to 0.19 even as JPEG
_FEWEST, _LABELS = 5, 64  # different values of a map of labels
_EVEN = 0.9  # of its neighbours are equal
_NEXT = 0.5  # of its steps lead from one value to the next: depth goes through all of them


def what_instead(image: NDArray[np.uint8]) -> str | None:
    """What a picture (h, w) shows instead of depth, None if it may be depth."""
    step = max(1, image.shape[1] // _WIDTH)
    thin = image[::step, ::step]
    values = np.unique(thin)
    if values.size < _FEWEST:
        return f"a mask (different values: {values.size})"
    steps = np.diff(np.searchsorted(values, thin).astype(np.int16), axis=1)
    changes = np.abs(steps[steps != 0])
    if values.size <= _LABELS and changes.size < (1 - _EVEN) * steps.size and (changes == 1).mean() < _NEXT:
        return f"a map of labels (flat values: {values.size})"
    bends = np.abs(np.diff(thin.astype(np.int16), 2, axis=1))
    return "a photograph (neighbouring pixels differ too much)" if _share(bends >= 3) > _ROUGH else None


def _share(found: NDArray[Any]) -> float:
    return float(found.mean()) if found.size else 0.0
