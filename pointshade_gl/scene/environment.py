"""Environments: light from all around, as pictures of the whole sphere, by formula, and what may hide it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import LARGEST, as_array, check_choice, is_a
from ..checks.foreign_arrays import Numbers
from ..notes.words import did_you_mean, option, shown
from .values import Value, frozen

Picture = NDArray[np.float64]
ROWS = 128
BEHIND_LEFT = 135.0  # degrees of azimuth: with y up and who looks at z, over the left shoulder, as the default light

# The clear sky of Preetham, Shirley and Smits (1999) for turbidity 3 and a sun 40 degrees high: A to E of Perez'
# distribution, and the value at the zenith.
_SUN = math.radians(40)
_LUMINANCE = (-0.9269, -0.6387, 5.2570, -2.2153, 0.1693), 6.525
_X = (-0.3171, -0.1987, 0.2113, -1.0912, 0.0353), 0.24441
_Y = (-0.3109, -0.2758, 0.1865, -1.7860, 0.0202), 0.25052
_SRGB_OF_XYZ = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
_GROUND = 0.12, 0.11, 0.09  # of the light of the sky
_HAZE = 0.1  # sine of the elevation in which sky and ground mix

# Soft boxes: azimuth and elevation of the middle, half of width and height as tangents, radiance.
_BOXES = (
    (BEHIND_LEFT, 42.0, 0.24, 0.24, 16.0),  # the key
    (25.0, 18.0, 0.12, 0.42, 7.0),  # a strip on the right
    (-70.0, 48.0, 0.42, 0.09, 12.0),  # a rim from behind the object
)
_SOFT = 0.06  # width of a box's edges, as tangents
_FLOOR, _CEILING = 0.15, 0.4  # radiance of the room


def sky() -> Picture:
    """Return a clear sky over dim ground, (128, 256, 3) linear radiance; the sun is a lamp of its own, and missing."""
    along, height = _directions()
    up = np.maximum(height, 0.01)
    towards = _direction(BEHIND_LEFT, math.degrees(_SUN))
    cosine = np.clip(along @ towards, -1, 1)
    luminance, x, y = (_perez(up, cosine, *one) for one in (_LUMINANCE, _X, _Y))
    xyz = np.stack([x / y, np.ones_like(x), (1 - x - y) / y], -1) * luminance[..., None]
    above = np.maximum(xyz @ _SRGB_OF_XYZ.T, 0)
    above /= np.sqrt(_reflected(above, height))  # a camera's white between that of the sky and that of the sun
    share = _smooth(height / _HAZE + 0.5)[..., None]
    ground = np.array(_GROUND) * _reflected(above, height).mean()
    picture = above * share + ground * (1 - share)
    return picture / _reflected(picture, height).mean()


def studio() -> Picture:
    """Return a grey room with three soft boxes, (128, 256, 3) linear radiance."""
    along, height = _directions()
    room = _FLOOR + (_CEILING - _FLOOR) * _smooth(0.5 + height / 1.2)
    for azimuth, elevation, width, tall, radiance in _BOXES:
        axis, side = _direction(azimuth, elevation), _direction(azimuth + 90, 0)
        ahead = along @ axis
        far = np.where(ahead > 0.05, ahead, np.inf)
        across, upwards = along @ side / far, along @ np.cross(side, axis) / far
        lit = _smooth((width - abs(across)) / _SOFT + 0.5) * _smooth((tall - abs(upwards)) / _SOFT + 0.5)
        room = np.where(ahead > 0.05, room + lit * (radiance - room), room)
    return np.repeat((room / _reflected(room[..., None], height))[..., None], 3, -1)


def _perez(up: Picture, cosine: Picture, numbers: tuple[float, ...], zenith: float) -> Picture:
    """Return the distribution of Perez, scaled to its value at the zenith. up, cosine: sine of the elevation, cosine of
    the angle to the sun."""
    a, b, c, d, e = numbers

    def relative(up: Picture | float, cosine: Picture | float) -> Picture:
        return (1 + a * np.exp(b / up)) * (1 + c * np.exp(d * np.arccos(cosine)) + e * np.square(cosine))

    return zenith * relative(up, cosine) / relative(1.0, math.sin(_SUN))


def _reflected(picture: Picture, height: Picture) -> Picture:
    """Return what a white surface that faces up reflects of a picture, (channels,)."""
    cosine = np.maximum(height, 0) * np.sqrt(1 - height**2)  # the second for the rows' solid angles
    return np.tensordot(cosine, picture) * math.pi / ROWS**2


def _directions() -> tuple[Picture, Picture]:
    """Return the unit directions of the pixels, (h, w, 3), and their y, (h, w)."""
    elevation = math.pi * (0.5 - (np.arange(ROWS) + 0.5) / ROWS)[:, None]
    azimuth = 2 * math.pi * ((np.arange(2 * ROWS) + 0.5) / (2 * ROWS) - 0.5)
    height = np.broadcast_to(np.sin(elevation), (ROWS, 2 * ROWS))
    return np.stack([np.cos(elevation) * np.cos(azimuth), height, np.cos(elevation) * np.sin(azimuth)], -1), height


def _direction(azimuth: float, elevation: float) -> Picture:
    """Return the unit direction (3,) of two angles in degrees."""
    around, up = math.radians(azimuth), math.radians(elevation)
    return np.array([math.cos(up) * math.cos(around), math.sin(up), math.cos(up) * math.sin(around)])


def _smooth(share: Picture) -> Picture:
    """Return 0 below 0, 1 above 1, and a smooth step between."""
    share = np.clip(share, 0, 1)
    return share * share * (3 - 2 * share)


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
    """Return an environment, or None. Raises TypeError or ValueError for anything else, also for files."""
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


FAR_AS_SEEN = math.inf
Row = tuple[float, float, float]
AS_IT_IS = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


class EnvironmentLight(NamedTuple):
    """The light from all around.

    occlusion    how far things may be that hide some of it, world units; FAR_AS_SEEN is the distance of what is seen,
                 0 is no occlusion
    environment  where it comes from; None is the scene's ambient light
    intensity    factor on the environment
    to_sky       (3, 3) rotation from world axes to the environment's
    on_ground    whether a ground is drawn below
    floor        (3,) unit, world: the normal of a floor that hides what is below; None without one
    """

    occlusion: float = 0.0
    environment: Environment | None = None
    intensity: float = 1.0
    to_sky: tuple[Row, Row, Row] = AS_IT_IS
    floor: Row | None = None
    on_ground: bool = False

    @property
    def floor_in_sky(self) -> NDArray[np.float64] | None:
        """The floor's normal in the environment's axes, rounded: turning about it changes nothing."""
        return None if self.floor is None else np.round(np.array(self.to_sky) @ self.floor, 6)

    def radius(self, distance: float) -> float:
        """Return how far things may be that hide light, world units. distance: of what is seen."""
        return distance if self.occlusion == FAR_AS_SEEN else self.occlusion


NO_ENVIRONMENT = EnvironmentLight()
