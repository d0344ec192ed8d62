"""Mirror of shaders/common/camera.glsl."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

F = np.float32


def pixel_ray(pixel: np.ndarray, intrinsics: np.ndarray) -> np.ndarray:
    xy = (pixel - intrinsics[2:]) / intrinsics[:2]
    return np.concatenate([xy, np.ones_like(xy[..., :1])], -1)


def project(point: np.ndarray, intrinsics: np.ndarray) -> np.ndarray:
    return intrinsics[:2] * point[..., :2] / point[..., 2:] + intrinsics[2:]


def mean_focal_length(intrinsics: Sequence[np.floating] | np.ndarray) -> np.ndarray:
    return np.asarray(F(0.5) * (np.abs(F(intrinsics[0])) + np.abs(F(intrinsics[1]))))
