"""Keeps one noise estimate for all frames of a stream, and changes it only on evidence from several frames."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from ..scene.noise import FEW, Noise

PATIENCE = 3  # frames in a row that must say something else, unless they say it clearly
CLEARLY = 5.0  # times FEW, or a fifth of it
STREAMS = 64  # that are remembered


class Decisions:
    """Keeps, for each stream, the noise that is in use, and how many frames in a row have said something else."""

    def __init__(self) -> None:
        self._kept: dict[Hashable, tuple[Noise, int]] = {}

    def settle(self, stream: Hashable, measured: Noise) -> Noise:
        """The noise to use for a frame on which `measured` was found."""
        noise, doubts = self._kept.pop(stream, (measured, 0))
        doubts = 0 if _kind(measured) == _kind(noise) else doubts + 1
        if doubts == 0 or doubts >= PATIENCE or _is_clear(measured, noise):
            noise, doubts = measured, 0
        self._kept[stream] = noise, doubts
        if len(self._kept) > STREAMS:
            del self._kept[next(iter(self._kept))]
        return noise


def _kind(noise: Noise) -> tuple[Any, ...]:
    """What neighbouring frames of a stream must agree on."""
    return noise.is_clean, noise.domain, noise.misplaced > 0, noise.is_shared


def _is_clear(measured: Noise, kept: Noise) -> bool:
    """Whether one of the two is far from being clean, or the other from being noisy."""
    if measured.is_clean == kept.is_clean:
        return False
    return measured.share < FEW / CLEARLY if measured.is_clean else measured.share > FEW * CLEARLY
