"""Mirror of shaders/common/tone.glsl."""

from __future__ import annotations

import numpy as np

F = np.float32
COLORLESS, BENDS_AT, FADES, BLINDING = F(0.04), F(0.76), F(0.15), F(65504)


def neutral_tone(light: np.ndarray) -> np.ndarray:
    light = np.minimum(light, BLINDING)
    least = light.min(-1, keepdims=True)
    color = light - np.where(least < F(2) * COLORLESS, least - least * least / (F(4) * COLORLESS), COLORLESS)
    peak = np.maximum(color.max(-1, keepdims=True), BENDS_AT)
    rest = F(1) - BENDS_AT
    shown = F(1) - rest * rest / (peak + rest - BENDS_AT)
    keeps = F(1) / (FADES * (peak - shown) + F(1))
    return np.where(color.max(-1, keepdims=True) <= BENDS_AT, color, shown + (color * (shown / peak) - shown) * keeps)
