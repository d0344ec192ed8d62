"""Environments by formula: a clear sky without its sun, and a studio with soft boxes. White surfaces that face up are
white under them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

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
