"""Turns raw values into plain numbers by named repairs, so that all frames of a sequence are treated alike."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .colormaps import read_levels
from .depth_bits import MILLIMETRES, as_codes, rotated_back
from .depth_channels import join_channels

SWAPPED, CONFIDENCE, ROTATED, HIGH_BYTE = "bytes swapped", "confidence dropped", "bits rotated back", "high byte taken"
HALF = "16-bit floats"
CHANNELS = "bytes of the channels "  # and their numbers, the lowest first
LEVELS, REVERSED = "colours read back", "order reversed"


def repaired(raw: NDArray[Any], repairs: Sequence[str]) -> NDArray[Any]:
    """The values after these repairs. Raises ValueError for a picture of another type than they are made for."""
    for name in repairs:
        raw = _repaired(raw, name)
    if raw.ndim != 2:
        raise ValueError(f"depth must have shape (h, w), as the first one has, got {raw.shape}")
    return raw


def _repaired(raw: NDArray[Any], name: str) -> NDArray[Any]:
    if name == REVERSED:
        return 255 - raw
    if name.startswith(CHANNELS):
        channels = tuple(int(digit) for digit in name.removeprefix(CHANNELS))
        if raw.ndim != 3 or max(channels) >= raw.shape[2]:
            raise ValueError("depth must be spread over channels, as the first one is")
        return join_channels(raw, channels)
    if name == LEVELS:
        levels = read_levels(raw) if raw.ndim == 3 else None
        if levels is None:
            raise ValueError("depth must be a colour-mapped picture, as the first one is")
        return levels.values
    codes = as_codes(raw)
    if codes is None:
        raise ValueError(f"depth must be of 16 bits, as the first one is, got {raw.dtype}")
    if name == SWAPPED:
        return codes.byteswap()
    if name == HALF:
        return codes.view(np.float16).astype(np.float32)
    if name == CONFIDENCE:
        return codes & MILLIMETRES
    return rotated_back(codes) if name == ROTATED else (codes >> 8).astype(np.uint8)
