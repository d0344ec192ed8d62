"""Keeps one noise estimate for all frames of a stream, and changes it only on evidence from several frames."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from ..scene.noise import FEW, Noise

PATIENCE = 3  # frames in a row that must say something else, unless they say it clearly
CLEARLY = 5.0  # times FEW, or a fifth of it
STREAMS = 64  # that are remembered


class Decisions:
    """Keeps, for each stream, the noise estimate in use, and how many frames in a row have contradicted it."""

    def __init__(self) -> None:
        self._kept: dict[Hashable, tuple[Noise, int]] = {}

    def settle(self, stream: Hashable, measured: Noise) -> Noise:
        """Return the noise to use for the next frame of a stream, on which `measured` was found."""
        noise, doubts = self._kept.pop(stream, (measured, 0))
        doubts = 0 if _kind(measured) == _kind(noise) else doubts + 1
        if doubts == 0 or doubts >= PATIENCE or _is_clear(measured, noise):
            noise, doubts = measured, 0
        self._kept[stream] = noise, doubts
        if len(self._kept) > STREAMS:
            del self._kept[next(iter(self._kept))]
        return noise


def _kind(noise: Noise) -> tuple[Any, ...]:
    """Return the properties of noise on which neighbouring frames of a stream must agree."""
    return noise.is_clean, noise.domain, noise.misplaced > 0, noise.is_shared, noise.bumps > 0


def _is_clear(measured: Noise, kept: Noise) -> bool:
    """Return whether a change between clean and noisy is beyond doubt: the new frame lies far on the other side."""
    if measured.is_clean == kept.is_clean:
        return False
    return measured.share < FEW / CLEARLY if measured.is_clean else measured.share > FEW * CLEARLY
