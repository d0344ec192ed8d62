"""The lights of the window: what they are called, and what kind they are of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..light import Light

KINDS = ("point", "spot", "directional")
_SOMEWHERE, _FORWARD = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)  # the State knows where the light is


def kind_of(light: Light) -> str:
    """One of KINDS."""
    return "spot" if light.is_spot else "directional" if light.position is None else "point"


def as_kind(light: Light, kind: str) -> Light:
    """A light of another kind, as the mouse holds it: its place and direction come from the State."""
    if kind == "directional":
        return replace(light, position=None, direction=_FORWARD, radius=0.0)
    return replace(light, position=_SOMEWHERE, direction=_FORWARD if kind == "spot" else None, angle=0.0)


def titles(names: Sequence[str], lights: Sequence[Light]) -> list[str]:
    """How lists call lights: 'lamp (spot)', or without a name 'light 2 (spot)'."""
    named = [names[k] if k < len(names) else "" for k in range(len(lights))]
    return [
        f"{name or f'light {k + 1}'} ({kind_of(light)})"
        for k, (name, light) in enumerate(zip(named, lights, strict=True))
    ]
