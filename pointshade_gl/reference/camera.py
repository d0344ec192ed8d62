"""Mirror of shaders/common/camera.glsl."""

from __future__ import annotations

import numpy as np


def pixel_ray(pixel: np.ndarray, intrinsics: np.ndarray) -> np.ndarray:
    xy = (pixel - intrinsics[2:]) / intrinsics[:2]
    return np.concatenate([xy, np.ones_like(xy[..., :1])], -1)


def project(point: np.ndarray, intrinsics: np.ndarray) -> np.ndarray:
    return intrinsics[:2] * point[..., :2] / point[..., 2:] + intrinsics[2:]
