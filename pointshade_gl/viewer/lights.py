"""The lights of the window: which one the mouse holds, what they are called, and what kind they are of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain, repeat

import numpy as np
from numpy.typing import NDArray

from ..scene.light import Light
from .history import Moment

KINDS = ("point", "spot", "directional", "area")
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
    every = now.state.light(now.stage, pose, now.held), *now.lights
    steps = (number - now.number) % len(every)
    held, *others = every[steps:] + every[:steps]
    return Moment(now.state.with_light(held, now.stage, pose), now.stage, held, tuple(others), number)


def titles(names: Sequence[str], now: Moment) -> list[str]:
    """How lists call lights, by their numbers: 'lamp (spot)', or without a name 'light 2 (spot)'."""
    every = now.held, *now.lights
    first = -now.number % len(every)
    lights = zip((*every[first:], *every[:first]), chain(names, repeat("")), strict=False)
    return [f"{name or f'light {number}'} ({kind_of(light)})" for number, (light, name) in enumerate(lights, 1)]
