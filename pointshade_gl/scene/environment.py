"""An environment: the light that comes from all around, as a picture of the whole sphere. A plain value."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import LARGEST, as_array, check_choice, is_a
from ..checks.foreign_arrays import Numbers
from ..notes.words import did_you_mean, option, shown
from .environment_presets import sky, studio
from .values import Value, frozen

EnvironmentName = Literal["sky", "studio"]
NAMES: tuple[EnvironmentName, ...] = get_args(EnvironmentName)
WIDEST = 512  # columns that are kept: enough for highlights of any exponent that a picture shows


@dataclass(frozen=True, eq=False)
class Environment(Value):
    """Light from all around: a picture of the whole sphere (equirectangular), linear.

    Parameters
    ----------
    picture : (h, w, 3) float
        Radiance, linear RGB, 0 or above; 1 from everywhere lights a white surface white. In axes with y up, its middle
        column looks along x and the columns go on towards z, as in viewers of glTF and in Blender: column
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
        object.__setattr__(self, "picture", frozen(reduced(_checked(self.picture))))

    def __repr__(self) -> str:
        """`Environment(256x128 pixels, 'sky')`."""
        height, width = self.picture.shape[:2]
        return f"Environment({width}x{height} pixels{self.name and f', {self.name!r}'})"

    @staticmethod
    def of(name: EnvironmentName) -> Environment:
        """Return one that is made by formula, the same object each time.

        Parameters
        ----------
        name : str
            "sky" is a clear sky over dim ground (Preetham, Shirley and Smits 1999), brighter behind the viewer's left
            shoulder, where its sun is: that is a lamp of its own. "studio" is a grey room with three soft boxes. Under
            both a white surface that faces up is white.

        Raises
        ------
        ValueError
            For any other name.
        """
        check_choice(option("environment"), name, NAMES)
        return _made(name)


def check_environment(environment: Any) -> Environment | None:
    """Return an environment, or None. Raises TypeError or ValueError for anything else, and for files: this cannot read
    any."""
    if environment is None or isinstance(environment, Environment):
        return environment
    if not is_a(environment, str, PathLike):
        return Environment(environment)
    if environment in NAMES:
        return Environment.of(environment)
    expected = f"{option('environment')} must be {' or '.join(NAMES)}, an Environment or a picture"
    near = did_you_mean(environment, NAMES)
    raise ValueError(f"{expected}, got {shown(environment)}{near}: load_environment reads files")


@cache
def _made(name: EnvironmentName) -> Environment:
    return Environment((sky if name == "sky" else studio)(), name)


def _checked(picture: Any) -> NDArray[np.float32]:
    complaint = "environment must be a picture of the whole sphere, (h, w, 3) linear radiance of 0 or above"
    array = as_array(picture, complaint, np.float32)
    if array.ndim != 3 or array.shape[2] != 3 or 0 in array.shape:
        raise ValueError(f"{complaint}, got the shape {array.shape}")
    if not (array.min() >= 0 and array.max() <= LARGEST):  # NaN fails, too
        raise ValueError(f"{complaint}: some of its numbers are negative, not finite or above {LARGEST:g}")
    return array


def reduced(picture: NDArray[np.float32], widest: int = WIDEST) -> NDArray[np.float32]:
    """Return the picture with at most so many columns: means of whole blocks."""
    step = math.ceil(picture.shape[1] / widest)
    if step == 1:
        return picture
    return _block_means(_block_means(picture, step, 1), step, 0).astype(np.float32)


def _block_means(picture: NDArray[Any], step: int, axis: int) -> NDArray[np.float64]:
    """Return the means of about so many rows or columns each."""
    length = picture.shape[axis]
    blocks = max(length // step, 1)
    edges = np.array([k * length // blocks for k in range(blocks + 1)])
    counts = (edges[1:] - edges[:-1]).reshape((-1, 1, 1) if axis == 0 else (-1, 1))
    return np.add.reduceat(picture, edges[:-1], axis, np.float64) / counts
