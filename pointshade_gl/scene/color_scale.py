"""What the colours of a picture stand for where they are no light."""

from __future__ import annotations

from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

Show = Literal["light", "normals", "depth", "certainty"]
SHOWS: tuple[Show, ...] = get_args(Show)
MOST_DOUBT = 30.0  # degrees of expected error, from which normals are equally red
BLUE = 0.1  # of turbo, where the colours begin: before it they are nearly black, as holes are
LEFT_OUT = 0.02  # share of the pixels at either end that does not stretch the range of depths


class ColorScale(NamedTuple):
    """From blue to red along turbo (A. Mikhailov 2019); normals are their own colours, and have no range.

    show       as of Finish
    low, high  world units along the viewer's axis, or degrees that normals may be off
    """

    show: Show
    low: float = 1.0
    high: float = 1.0

    @property
    def even(self) -> tuple[float, float]:
        """The range of what the colours are even in: -1/z of depths, as a sensor's steps are, so that what is near
        keeps its relief beside what is far; degrees themselves."""
        return (-1 / self.low, -1 / self.high) if self.show == "depth" else (self.low, self.high)

    @property
    def middle(self) -> float:
        """What the colour in the middle stands for."""
        low, high = self.even
        return -2 / (low + high) if self.show == "depth" else (low + high) / 2


CERTAINTY = ColorScale("certainty", 0.0, MOST_DOUBT)


def scale_of_depths(depth: NDArray[np.float32]) -> ColorScale:
    """Return the scale for depths (n,): nearly all of them lie in its range."""
    if not len(depth):
        return ColorScale("depth")
    low, high = np.quantile(depth, (LEFT_OUT, 1 - LEFT_OUT))
    return ColorScale("depth", float(low), float(high))
