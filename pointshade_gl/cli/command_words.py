"""The other way round: values -> the words of the command line that give them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene.appearance import Look
from ..scene.camera import quaternion_of
from ..scene.light import Light
from .look_options import LookOptions

DIGITS = 12  # of a number: far more than pictures show, so that the line makes the same one


def words_of(options: Any) -> list[str]:
    """The words for a group of options (see cli/options.py), without those that have their default."""
    words = []
    for field in fields(options):
        value = getattr(options, field.name)
        if value == field.default or value is None:
            continue
        name = f"--{field.name.replace('_', '-')}"
        for one in value if isinstance(value, list) else [value]:
            words += [name] if one is True else [text_of(one)] if field.name == "input" else [name, text_of(one)]
    return words


def text_of(value: Any) -> str:
    """A number, several with commas between them, or a text as it is."""
    if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str):
        return ",".join(map(text_of, value))
    return f"{value + 0.0:.{DIGITS}g}" if isinstance(value, float | np.floating) else str(value)


def look_words(look: Look) -> list[str]:
    """How objects look. A filter over time is left out: a single picture has nothing before it."""
    return words_of(LookOptions.of(look.alone))


def light_words(light: Light, in_scene: bool) -> list[str]:
    """`--light` and its words. In a scene lights cast shadows unless they say no."""
    words, plain = [], Light(shadow=in_scene)
    for field in fields(Light):
        value = getattr(light, field.name)
        if value != getattr(plain, field.name):
            is_switch = isinstance(value, bool)
            words.append(f"{field.name}={'yes' if value else 'no'}" if is_switch else f"{field.name}={text_of(value)}")
    return ["--light", " ".join(words)]


def pose_words(pose: NDArray[np.float64]) -> list[str]:
    """`--pose` with tx,ty,tz,qx,qy,qz,qw."""
    return ["--pose", text_of([*pose[:3, 3], *quaternion_of(pose[:3, :3])])]
