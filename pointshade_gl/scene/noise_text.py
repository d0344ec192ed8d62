"""Describes the noise of a depth image in a short text that can be stored, and parses such a text."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

CLEAN = "clean"
GRAMMAR = (
    "'clean', or 1.5mm or 0.2%, and after it shared=2, steps=1mm or steps=0.0029/m, repeated=0.4, bumps=0.003/m, "
    "by commas"
)
_UNITS = {"mm": 1e-3, "m": 1.0, "%": 1e-2, "/m": 1.0, "": 1.0}
_ALLOWED = {"noise": ("mm", "m", "%"), "shared": ("",), "steps": ("mm", "m", "/m"), "repeated": ("",), "bumps": ("/m",)}


@dataclass(frozen=True)
class NoiseWords:
    """Noise that is the same for all of a frame. All zero: the depth is clean.

    level, is_share  standard deviation of depth: in metres, or as a share of the depth
    shared           noise that neighbours share, divided by noise that they do not share
    step, domain     rounding step, of depth in domain "z", of 1/depth in domain "1/z"; 0 and "" without one
    repeated         pixels (standard deviation) by which depths are displaced, as lines are repeated
    bumps            standard deviation of 1/depth about planes, where neighbours share noise over many pixels
    """

    level: float = 0.0
    is_share: bool = False
    shared: float = 0.0
    step: float = 0.0
    domain: str = ""
    repeated: float = 0.0
    bumps: float = 0.0

    def __str__(self) -> str:
        if not self.level:
            return CLEAN
        words = [f"{_short(100 * self.level)}%" if self.is_share else _length(self.level)]
        words += [f"shared={_short(self.shared)}"] if self.shared else []
        steps = _length(self.step) if self.domain == "z" else f"{_short(self.step)}/m"
        words += [f"steps={steps}"] if self.step else []
        words += [f"repeated={_short(self.repeated)}"] if self.repeated else []
        words += [f"bumps={_short(self.bumps)}/m"] if self.bumps else []
        return ",".join(words)


def noise_words(text: str) -> NoiseWords | None:
    """Parse a text; None if it does not describe noise. `noise_words(str(words))` is `words`, to three digits."""
    if text.strip() == CLEAN:
        return NoiseWords()
    found: dict[str, tuple[float, str]] = {}
    for k, word in enumerate(text.split(",")):
        match = re.fullmatch(r"\s*(?:(\w+)=)?((?:\d+(?:\.\d*)?|\.\d+)(?:e[-+]?\d+)?)(mm|m|%|/m|)\s*", word)
        if match is None or (k == 0) != (match[1] is None):
            return None
        name, unit = match[1] or "noise", match[3]
        if name in found or unit not in _ALLOWED.get(name, ()):
            return None
        number = float(match[2])
        if not 0 < number < math.inf:
            return None
        found[name] = number * _UNITS[unit], unit
    level, unit = found["noise"]
    step, step_unit = found.get("steps", (0.0, ""))
    domain = "" if not step else "1/z" if step_unit == "/m" else "z"
    shared, repeated, bumps = (found.get(name, (0.0, ""))[0] for name in ("shared", "repeated", "bumps"))
    return NoiseWords(level, unit == "%", shared, step, domain, repeated, bumps)


def _short(number: float) -> str:
    return f"{number:.3g}"


def _length(length: float) -> str:
    return f"{_short(length * 1e3)}mm" if length < 1 else f"{_short(length)}m"
