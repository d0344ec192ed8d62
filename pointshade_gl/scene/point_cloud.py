"""Point clouds in world space with normals and lit colours, for export to other programs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..messages.validation import as_array, as_given
from .frame import Frame
from .rotation import moved
from .srgb import linear_to_bytes
from .values import Value, frozen


@dataclass(frozen=True, eq=False)
class PointCloud(Value):
    """Points in the world with normals and colours, checked once, copied and read-only.

    Parameters
    ----------
    positions : (n, 3) float64
        World, metres.
    normals : (n, 3) float32
        Unit vectors, world axes, towards the camera that took the point.
    colors : (n, 3) uint8
        sRGB.

    Raises
    ------
    TypeError
        For arrays of the wrong kind.
    ValueError
        For shapes that do not fit.
    """

    positions: NDArray[np.float64]
    normals: NDArray[np.float32]
    colors: NDArray[np.uint8]

    def __init__(self, positions: ArrayLike, normals: ArrayLike, colors: ArrayLike):
        object.__setattr__(self, "positions", as_array(positions, "positions must be numbers of shape (n, 3)"))
        object.__setattr__(self, "normals", as_array(normals, "normals must be numbers of shape (n, 3)", np.float32))
        object.__setattr__(self, "colors", np.array(as_given(colors, "colors must be uint8 of shape (n, 3)")))
        if self.colors.dtype != np.uint8:
            raise TypeError(f"colors must be uint8 sRGB, got {self.colors.dtype}")
        for name, array in vars(self).items():
            if array.shape != (len(self), 3):
                raise ValueError(f"{name} must have shape ({len(self)}, 3), as many as positions, got {array.shape}")
            frozen(array)

    def __len__(self) -> int:
        return self.positions.shape[0] if self.positions.ndim else 0

    def __repr__(self) -> str:
        return f"PointCloud({len(self)} points)"


def cloud_of(frame: Frame, surface: NDArray[np.float32], light: NDArray[np.float32]) -> PointCloud:
    """The points of a frame, row by row.

    surface  (h, w, 4) unit normal and depth, camera axes; depth 0 where there is no point
    light    (h, w, 4) linear light, cut off at 1
    """
    v, u = np.nonzero(surface[..., 3])
    normals, z = surface[v, u, :3], surface[v, u, 3].astype(np.float64)
    x, y = frame.camera.ray_at(u, v)
    turned = normals @ frame.pose[:3, :3].T
    turned /= np.linalg.norm(turned, axis=-1, keepdims=True)  # poses of text files are rotations to 1 % only
    return PointCloud(
        moved(np.stack([x * z, y * z, z], -1), frame.pose),
        turned,
        _srgb()[np.rint(np.clip(light[v, u, :3], 0, 1) * 65535).astype(np.uint16)],
    )


@cache
def _srgb() -> NDArray[np.uint8]:
    """Return the sRGB, (65536,), of linear light over 65535."""
    return linear_to_bytes(np.arange(65536) / 65535)
