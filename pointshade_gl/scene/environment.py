"""An environment: the light that comes from all around, as a picture of the whole sphere. A plain value."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..messages.validation import Numbers, as_array
from .values import Value, frozen

WIDEST = 512  # columns that are kept: enough for highlights of any exponent that a picture shows


@dataclass(frozen=True, eq=False)
class Environment(Value):
    """Light from all around: a picture of the whole sphere (equirectangular), linear.

    Parameters
    ----------
    picture : (h, w, 3) float
        Radiance, linear RGB, 0 or above; 1 from everywhere lights a white surface white. In axes with y up, its middle
        column looks along x and the columns go on towards z, as in three.js, glTF viewers and Blender: column
        w * (1/2 + atan2(z, x) / 2 pi); the first row is the zenith. Pictures wider than 512 are reduced.
    name : str
        How it is called on the command line: a name, or a file.

    Raises
    ------
    ValueError
        For another shape, and for numbers that no light has.
    TypeError
        For anything but numbers.
    """

    picture: NDArray[np.float32]
    name: str = ""

    if TYPE_CHECKING:  # what may be passed is more than what is kept

        def __init__(self, picture: Numbers, name: str = "") -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "picture", frozen(_reduced(_checked(self.picture))))


def _checked(picture: Any) -> NDArray[np.float32]:
    complaint = "environment must be a picture of the whole sphere, (h, w, 3) linear radiance of 0 or above"
    array = as_array(picture, complaint, np.float32)
    if array.ndim != 3 or array.shape[2] != 3 or 0 in array.shape:
        raise ValueError(f"{complaint}, got the shape {array.shape}")
    if not (np.isfinite(array).all() and array.min() >= 0):
        raise ValueError(f"{complaint}: some of its numbers are negative or not finite")
    return array


def _reduced(picture: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the picture at most WIDEST columns wide: means of whole blocks."""
    step = math.ceil(picture.shape[1] / WIDEST)
    if step == 1:
        return picture
    rows, columns = (max(side // step, 1) for side in picture.shape[:2])
    heights = np.array_split(np.arange(picture.shape[0]), rows)
    widths = np.array_split(np.arange(picture.shape[1]), columns)
    slim = np.stack([picture[:, one].mean(1, dtype=np.float64) for one in widths], 1)
    return np.stack([slim[one].mean(0) for one in heights]).astype(np.float32)
