"""The other way round: values -> the words of the command line that give them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..scene.light import Light

if TYPE_CHECKING:
    from ..scene.appearance import Look

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
    from .look_options import LookOptions

    material = look.material
    return words_of(
        LookOptions(
            normals=str(look.normals),
            max_depth_step=None if look.max_depth_step is None else text_of(look.max_depth_step),
            noise=None if look.noise is None else text_of(look.noise),
            flying=look.flying,
            shading=look.shading,
            ambient=material.ambient,
            diffuse=material.diffuse,
            specular=material.specular,
            shininess=material.shininess,
            splat=look.splat,
            point_size=None if look.size is None else text_of(look.size),
            upsample=look.upsample,
            normals_at=look.normals_at,
            unlight=look.unlight,
            remove_highlights=look.remove_highlights,
        )
    )


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


def quaternion_of(turn: NDArray[np.float64]) -> list[float]:
    """qx, qy, qz, qw of a rotation, (3, 3), with qw >= 0 (Shepperd 1978: from the largest, which loses no digits)."""
    diagonal = np.diag(turn)
    squares = np.array([*(1 + 2 * diagonal - diagonal.sum()), 1 + diagonal.sum()])  # four times qx^2 .. qw^2
    k = int(squares.argmax())
    own = math.sqrt(squares[k]) / 2
    (a, b, c), found = {0: (0, 1, 2), 1: (1, 2, 0), 2: (2, 0, 1), 3: (0, 1, 2)}[k], [0.0] * 4
    found[k] = own
    if k == 3:
        for i, (p, q) in enumerate(((2, 1), (0, 2), (1, 0))):
            found[i] = float(turn[p, q] - turn[q, p]) / (4 * own)
    else:
        found[b] = float(turn[b, a] + turn[a, b]) / (4 * own)
        found[c] = float(turn[c, a] + turn[a, c]) / (4 * own)
        found[3] = float(turn[c, b] - turn[b, c]) / (4 * own)
    return [-q for q in found] if found[3] < 0 else found
