"""The lights of the window: which one the mouse holds, what they are called, and what kind they are of."""

from __future__ import annotations

import cmath
import math
from dataclasses import replace
from itertools import chain, repeat

import numpy as np
from numpy.typing import NDArray

from ..scene.light import Light, Vector
from ..scene.orbit import OWN_LIGHT, State
from .history import Moment

KINDS = ("point", "spot", "directional", "area")
GOLDEN = cmath.rect(1, math.pi * (3 - 5**0.5))  # around the object: no two of many lights come to the same place
NEAR = 0.4  # rims of the first one beside a light that comes from the viewer
_SOMEWHERE, _FORWARD = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)  # the State knows where the light is


def kind_of(light: Light) -> str:
    """One of KINDS."""
    if light.is_area:
        return "area"
    return "spot" if light.is_spot else "directional" if light.position is None else "point"


def as_kind(light: Light, kind: str, side: float) -> Light:
    """A light of another kind, as the mouse holds it: its place and direction come from the State.

    side  width and height of a new area light, world units
    """
    if kind == "directional":
        return replace(light, position=None, direction=_FORWARD, radius=0.0, size=None)
    made = replace(light, position=_SOMEWHERE, direction=None if kind == "point" else _FORWARD, angle=0.0, size=None)
    return replace(made, radius=0.0, size=(side, side)) if kind == "area" else made


def taking(number: int, now: Moment, pose: NDArray[np.float64]) -> Moment:
    """The mouse takes the light with this number; the one that it held stays where it is. pose: of the own camera."""
    every = _by_number(now, now.state.light(now.stage, pose, now.held))
    held, *others = every[number:] + every[:number]
    state = now.state.with_light(held, now.stage, pose)
    return now._replace(state=state, held=held, lights=tuple(others), number=number)


def added(now: Moment, pose: NDArray[np.float64]) -> Moment:
    """One more light, beside the one that the mouse held, which stays where it is; the mouse holds the new one."""
    lights = _by_number(now, now.state.light(now.stage, pose, now.held))
    at = complex(*now.state.light_at)
    at = at * GOLDEN if abs(at) > 0.2 * NEAR else complex(NEAR)
    plain = State()
    state = replace(
        now.state,
        light_at=(at.real, at.imag),
        light_color=plain.light_color,
        light_intensity=plain.light_intensity,
    )
    names = (*now.names, *[""] * (len(lights) + 1 - len(now.names)))
    return now._replace(state=state, held=OWN_LIGHT, lights=tuple(lights), number=len(lights), names=names)


def removed(number: int, now: Moment, pose: NDArray[np.float64]) -> Moment:
    """Without the light with this number. If the mouse held it, it takes the one before. One light always stays."""
    if not now.lights:
        return now
    names = tuple(name for k, name in enumerate(now.names) if k != number)
    if number == now.number:
        now = taking(max(number - 1, 0) if number else 1, now, pose)
    every = _by_number(now, now.held)
    del every[number]
    held = now.number - (number < now.number)
    return now._replace(lights=tuple((every[held:] + every[:held])[1:]), number=held, names=names)


def placed(now: Moment, place: Vector, pose: NDArray[np.float64]) -> Moment:
    """The light that the mouse holds goes to a place in the world, and stays there; a directional one shines along it,
    which is no place then but a direction. It stays if there is none."""
    light = now.state.light(now.stage, pose, now.held)
    if light.position is not None:
        light = replace(light, position=place)
    elif any(place):
        light = replace(light, direction=place)
    state = replace(now.state.with_light(light, now.stage, pose), light_mode=False)
    return now._replace(state=state)


def _by_number(now: Moment, held: Light) -> list[Light]:
    """All lights; held: the one that the mouse holds, where it is."""
    every = [held, *now.lights]
    first = -now.number % len(every)
    return every[first:] + every[:first]


def titles(now: Moment) -> list[str]:
    """How lists call lights, by their numbers: 'lamp (spot)', or without a name 'light 2 (spot)'."""
    lights = zip(_by_number(now, now.held), chain(now.names, repeat("")), strict=False)
    return [f"{name or f'light {number}'} ({kind_of(light)})" for number, (light, name) in enumerate(lights, 1)]
