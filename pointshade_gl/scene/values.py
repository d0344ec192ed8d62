"""What plain values have in common: frozen arrays, boxes and spheres around points, colours."""

from __future__ import annotations

from dataclasses import fields
from functools import cached_property
from typing import Any, Literal, NamedTuple, TypeVar, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..checks.arguments import LARGEST, as_array
from ..notes.words import did_you_mean, shown

_Array = TypeVar("_Array", bound=NDArray[Any])


class Value:
    """A frozen dataclass that never changes: a copy of it is the value itself, a pickle holds its fields only."""

    def __copy__(self) -> Any:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Any:
        return self

    def __getstate__(self) -> dict[str, Any]:
        kept: Any = self
        return {one.name: getattr(self, one.name) for one in fields(kept)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            object.__setattr__(self, name, frozen(value) if _is_array(value) else value)


class DrawnValue(Value):
    """What a node may hold and a picture shows: a point object, a cloud or a mesh, but no light."""

    @property
    def frames(self) -> tuple[Any, ...]:
        """Return the frames whose points these are; clouds and meshes have none."""
        return ()

    @property
    def clouds(self) -> tuple[Any, ...]:
        """Return the cloud that this is; frames and meshes have none."""
        return ()

    @property
    def is_single(self) -> bool:
        """Return whether it is one thing, not several frames of it."""
        return True

    @property
    def pose_in_node(self) -> NDArray[np.float64] | None:
        """Return the (4, 4) from the axes of its points to those of the node; None if these are the same."""
        return None

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """Return the (n, 3) corners of a box around all points, in their axes."""
        raise NotImplementedError

    @cached_property
    def main_corners(self) -> NDArray[np.float64]:
        """Return the same without stray points."""
        return self.corners

    @property
    def up_direction(self) -> NDArray[np.float64] | None:
        """Return where up is, (3,) unit, if the content knows it."""
        return None


class Options(Value):
    """A value that equals another one with the same fields. Arrays are the same if all their numbers are."""

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if not isinstance(other, Options) or type(other) is not type(self):
            return NotImplemented
        return all(map(_is_same, self.__getstate__().values(), other.__getstate__().values()))

    def __hash__(self) -> int:
        values = self.__getstate__().values()
        return hash(tuple(np.shape(value) if _is_array(value) else value for value in values))


def frozen(array: _Array) -> _Array:
    """Return the array itself, read-only from now on."""
    array.flags.writeable = False
    return array


def _is_same(one: Any, other: Any) -> bool:
    if _is_array(one) or _is_array(other):
        return one is other or (_is_array(one) and _is_array(other) and np.array_equal(one, other, equal_nan=True))
    return bool(one == other)


def _is_array(value: Any) -> bool:
    return isinstance(value, np.ndarray)


def floats_of(value: Any, name: str, shape: tuple[int | None, ...], kind: Any, advice: str = "") -> NDArray[Any]:
    """The numbers as an array. Raises TypeError or ValueError for another shape, and unless all are finite."""
    wanted = _words(shape)
    array = shaped(as_array(value, f"{name} must be numbers of shape {wanted}", kind), name, shape)
    if array.size and not (array.min() >= -LARGEST and array.max() <= LARGEST):  # NaN fails, too
        raise ValueError(f"{name} must be finite and below {LARGEST:g}{advice}")
    return array


def shaped(array: NDArray[Any], name: str, shape: tuple[int | None, ...]) -> NDArray[Any]:
    """The array. Raises ValueError for another shape; None in it is any number."""
    fits = array.ndim == len(shape) and all(want in (None, got) for want, got in zip(shape, array.shape, strict=True))
    if not fits:
        raise ValueError(f"{name} must have shape {_words(shape)}, got {array.shape}")
    return array


def _words(shape: tuple[int | None, ...]) -> str:
    words = ", ".join("n" if want is None else str(want) for want in shape)
    return f"({words},)" if len(shape) == 1 else f"({words})"


def box_corners(low: NDArray[Any], high: NDArray[Any]) -> NDArray[np.float64]:
    """Return (8, 3) corners of the box between two corners (3,)."""
    return np.array([[(low, high)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)], np.float64)


def sphere_round(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Return centre (3,) and radius of a sphere around points (n, 3); without points radius 1 around the origin."""
    if not len(points):
        return np.zeros(3), 1.0
    centre = (points.min(0) + points.max(0)) / 2
    return centre, max(float(np.linalg.norm(points - centre, axis=1).max()), 1e-6)


def median(values: ArrayLike) -> float:
    """Return np.median of some numbers without its import of numpy.ma, which takes 10 ms of the first picture."""
    array = np.array(values, np.float64).reshape(-1)
    low, high = (array.size - 1) // 2, array.size // 2
    array.partition((low, high))
    return (float(array[low]) + float(array[high])) / 2


def quantile(values: NDArray[Any], share: float) -> float:
    """Return np.quantile of some floats, 0..1, without that import."""
    at = share * (values.size - 1)
    low = int(at)
    high = min(low + 1, values.size - 1)
    first, second = np.partition(values, (low, high), axis=None)[[low, high]].astype(np.float64).tolist()
    part, step = at - low, second - first
    return second - step * (1 - part) if part >= 0.5 else first + step * part


def srgb_to_linear(encoded: NDArray[np.floating[Any]] | float) -> NDArray[Any]:
    """Return the linear light of sRGB, 0 to 1."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(linear: NDArray[np.floating[Any]] | float) -> NDArray[Any]:
    """Return linear light as sRGB, 0 to 1."""
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * np.maximum(linear, 0) ** (1 / 2.4) - 0.055)


def linear_to_bytes(linear: NDArray[Any]) -> NDArray[np.uint8]:
    """Return linear light from 0 to 1 as 8-bit sRGB."""
    return np.rint(linear_to_srgb(linear) * 255).astype(np.uint8)


def linear_color(name: str) -> tuple[float, float, float]:
    """Convert a colour as Pillow and CSS write it (#fc9, #ffcc99, tomato), which is sRGB (IEC 61966-2-1), to linear
    RGB.

    Raises ValueError with what is wrong, for a sentence about what has the colour.
    """
    from PIL import ImageColor

    try:
        levels = ImageColor.getrgb(name)
        if len(levels) > 3:
            raise ValueError("a colour has no alpha here")
    except ValueError:
        near = did_you_mean(name, ImageColor.colormap)
        known = "known are three numbers, #rrggbb and the names of CSS"
        raise ValueError(f"color {shown(name)} is unknown{near}: {known}") from None
    red, green, blue = (float(srgb_to_linear(level / 255)) for level in levels)
    return red, green, blue


Show = Literal["light", "normals", "depth", "certainty"]
SHOWS: tuple[Show, ...] = get_args(Show)
MOST_DOUBT = 30.0  # degrees of expected error, from which normals are equally red
BLUE = 0.1  # of turbo, where the colours begin: before it they are nearly black, as holes are
LEFT_OUT = 0.02  # share of the pixels at either end that does not stretch the range of depths


class ColorScale(NamedTuple):
    """From blue to red along turbo (A. Mikhailov 2019); normals are their own colours, and have no range.

    show       as of OutputSettings
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
