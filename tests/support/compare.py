"""Compares two pictures, in all tests alike: DESIGN section 6, without options."""

from __future__ import annotations

import numpy as np

STEP, OUTLIERS, MEAN = 2, 0.001, 0.05


def compare_images(actual: np.ndarray, expected: np.ndarray) -> str:
    """'' if they agree: at most 0.1 % of the pixels differ by more than 2 steps, mean 0.05. Else the reason."""
    if actual.shape != expected.shape:
        return f"shape {actual.shape} instead of {expected.shape}"
    difference = np.abs(actual.astype(int) - expected)
    outliers = (difference.max(-1) > STEP).mean()
    if outliers > OUTLIERS or difference.mean() > MEAN:
        return (
            f"{100 * outliers:.3f} % of the pixels differ by more than {STEP}, mean difference {difference.mean():.4f}"
        )
    return ""


def difference_figures(actual: np.ndarray, expected: np.ndarray) -> dict[str, float]:
    """How two pictures differ: share of pixels by more than STEP, mean, most, and decibels (99 if they are equal)."""
    if actual.shape != expected.shape:
        return {"share": 1.0, "mean": 255.0, "most": 255, "decibels": 0.0}
    difference = np.abs(actual.astype(int) - expected)
    power = float((difference.astype(float) ** 2).mean())
    return {
        "share": float((difference.max(-1) > STEP).mean()),
        "mean": float(difference.mean()),
        "most": int(difference.max()),
        "decibels": round(min(10 * np.log10(255**2 / power), 99.0), 1) if power else 99.0,
    }


def difference_picture(actual: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """The difference, amplified 20 times, opaque."""
    if actual.shape != expected.shape:
        return np.zeros((1, 1, 3), np.uint8)
    return (
        np.minimum(np.abs(actual.astype(int) - expected).max(-1, keepdims=True) * 20, 255)
        .repeat(3, -1)
        .astype(np.uint8)
    )
