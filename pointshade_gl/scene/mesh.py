"""Triangle meshes with normals, texture and material, as immutable values."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import LARGEST, as_array, as_given, check_choice, check_color, check_type
from ..checks.foreign_arrays import Numbers, way_to
from ..notes.words import counted
from .appearance import SHADINGS, Material, Shading
from .bounds import box_corners
from .values import Value, frozen


@dataclass(frozen=True, eq=False)
class Mesh(Value):
    """A triangle mesh with normals, texture and material.

    Parameters
    ----------
    positions : (n, 3) float
        Vertices, node axes.
    faces : (m, 3) int
        Vertices of each triangle, counter-clockwise seen from the front; both sides are drawn.
    normals : (n, 3) float, optional
        One for each vertex; None gives every triangle its own (flat facets).
    uv : (n, 2) float, optional
        Texture coordinates, needed with a texture; (0, 0) is the texture's upper left corner, as in glTF.
    color : (3,) float
        Linear RGB, multiplied with the texture.
    texture : (h, w, 3|4) uint8, optional
        sRGB; None is white.
    material : Material
        How the surface answers light.
    shading : {"phong", "gouraud", "flat", "none", "edl"}
        Light for each pixel, for each vertex, for each triangle, or none; "edl" (eye-dome lighting) is none, and darker
        beside what is nearer.

    Raises
    ------
    ValueError
        For shapes and numbers that do not fit.
    TypeError
        For values of another kind.

    Notes
    -----
    All arrays are copied and read-only.
    """

    positions: NDArray[np.float32]
    faces: NDArray[np.uint32]
    normals: NDArray[np.float32] | None = None
    uv: NDArray[np.float32] | None = None
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    texture: NDArray[np.uint8] | None = None
    material: Material = field(default_factory=Material)
    shading: Shading = "phong"

    if TYPE_CHECKING:  # what may be passed is more than what is kept

        def __init__(
            self,
            positions: Numbers,
            faces: Numbers,
            normals: Numbers | None = None,
            uv: Numbers | None = None,
            color: Numbers = ...,
            texture: Numbers | None = None,
            material: Material = ...,
            shading: Shading = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        points = _floats(self.positions, "mesh positions", (None, 3))
        faces = as_given(self.faces, "mesh faces must have shape (m, 3) and whole numbers")
        if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
            raise ValueError(f"mesh faces must have shape (m, 3) and whole numbers, got {faces.shape} {faces.dtype}")
        if faces.size and (faces.min() < 0 or faces.max() >= len(points)):
            raise ValueError(
                f"mesh faces must name one of the {len(points)} positions, got {faces.min()} to {faces.max()}"
            )
        object.__setattr__(self, "positions", points)
        object.__setattr__(self, "faces", frozen(np.array(faces, dtype=np.uint32, order="C")))
        for name, width in (("normals", 3), ("uv", 2)):
            if getattr(self, name) is not None:
                values = _floats(getattr(self, name), f"mesh {name}", (len(points), width))
                object.__setattr__(self, name, values)
        if self.texture is not None:
            texture = as_given(self.texture, "mesh texture must be (h, w, 3|4) uint8")
            if texture.ndim != 3 or texture.shape[2] not in (3, 4) or texture.dtype != np.uint8 or 0 in texture.shape:
                way = way_to(texture.shape, "texture", self.texture, (3, 4))
                raise ValueError(f"mesh texture must be (h, w, 3|4) uint8, got {texture.shape} {texture.dtype}{way}")
            if self.uv is None:
                raise ValueError("a mesh with a texture needs uv, one (u, v) for each position")
            object.__setattr__(self, "texture", frozen(np.array(texture, order="C")))
        object.__setattr__(self, "color", check_color(self.color, "mesh color"))
        check_type(self.material, Material, "mesh material")
        check_choice("shading", self.shading, SHADINGS)

    def __repr__(self) -> str:
        """`Mesh(24 positions, 12 triangles, texture 512x512)`."""
        texture = "" if self.texture is None else f", texture {self.texture.shape[1]}x{self.texture.shape[0]}"
        return f"Mesh({counted(len(self.positions), 'position')}, {counted(len(self.faces), 'triangle')}{texture})"

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """Return the (8, 3) corners of the box around all triangles, node axes; (0, 3) without a triangle."""
        points = self.positions[np.unique(self.faces)]
        return frozen(box_corners(points.min(0), points.max(0)) if len(points) else np.zeros((0, 3)))


def _floats(value: Any, name: str, shape: tuple[int | None, int]) -> NDArray[np.float32]:
    wanted = ", ".join("n" if want is None else str(want) for want in shape)
    array = as_array(value, f"{name} must be numbers of shape ({wanted})", np.float32)
    if array.ndim != 2 or any(want not in (None, got) for want, got in zip(shape, array.shape, strict=True)):
        raise ValueError(f"{name} must have shape ({wanted}), got {array.shape}")
    if not (np.abs(array) <= LARGEST).all():
        raise ValueError(f"{name} must be finite and below {LARGEST:g}")
    return frozen(array)
