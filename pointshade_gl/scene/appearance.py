"""How a point object looks: its material, and how its normals, splats and shading are made. Plain frozen values."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..messages.formatting import option, shown
from ..messages.validation import LARGEST, as_array, check_choice, check_flag, check_float, check_number, check_type
from .noise import check_noise, check_noise_text, parse_noise
from .normal_methods import check_method, check_normals, parse_max_depth_step

SHADINGS = ("none", "flat", "gouraud", "phong")
LIT_EARLY = ("flat", "gouraud")  # of these: light points or corners, and mix that light
SPLATS = ("footprint", "round", "mesh")
UPSAMPLINGS = ("vote", "none")
NORMALS_AT = ("source", "target")
FLYING = ("keep", "snap")
SWITCHES = ("temporal", "unlight", "remove_highlights")  # the options that are True or False


@dataclass(frozen=True)
class Material:
    """How the surface answers light (Phong 1975): strengths of the three terms and the highlight's exponent.

    Where "auto" or "adaptive" finds noise that neighbouring depths share, normals are uncertain: highlights are wider
    and dimmer there (Toksvig 2005). Not so where the noise is given, of the triangles of a mesh with flat shading, and
    of normals that are estimated in the view (normals_at).
    """

    ambient: float = 0.1
    diffuse: float = 0.9
    specular: float = 0.3
    shininess: float = 32.0

    def __post_init__(self) -> None:
        for name in ("ambient", "diffuse", "specular"):
            strength = check_number(getattr(self, name), option(name, of="material"), 0)
            object.__setattr__(self, name, strength)
        shininess = check_number(self.shininess, option("shininess", of="material"), 0.001, 10_000)
        object.__setattr__(self, "shininess", shininess)

    @property
    def strengths(self) -> tuple[float, float, float, float]:
        """(ambient, diffuse, specular, shininess), as the shaders take them."""
        return self.ambient, self.diffuse, self.specular, self.shininess


@dataclass(frozen=True)
class Look:
    """All choices about how one point object is drawn, except its place and the light.

    material  how its surface answers light
    normals   a method (see `Renderer.estimate_normals`), or (h, w, 3) floats in the frame's camera axes
    shading   "none", "flat", "gouraud" or "phong"
    size      splat size in source pixels: a number, or (h, w); 1 = the point's own pixel, 0 hides it; None is 1. "fill"
              is 1 too, but gaps between points of one surface are filled: with planes through the points around them,
              and with the picture's colours. Where depth is sparse, as of LiDAR in a picture, these points may be 32
              pixels away, elsewhere 8. Outlines stay where they are. A mesh is filled too; several frames of one thing
              are not, as they fill each other.
    splat     "footprint" carries the pixel's square into the view; where a surface ends, footprints of size 1 bend with
              it and end at its outline. "round" carries the circle round the square. "mesh" draws the triangles between
              neighbouring pixels instead, which have no size. The mesh ends at the middle of the last pixels: from the
              frame's own camera its colours are exact, but the outer half pixel is missing. It also ends where
              max_depth_step says, or without it where neither of two neighbours lies on the other's tangent plane, to
              2 % of 1/z.
    max_depth_step, noise  as for `Renderer.estimate_normals`
    upsample  where the colours are larger than the depth: "vote" brings the depth to their size, and lets them decide
              where surfaces end; "none" draws the depth's own points. Points of another size than 1 are never enlarged.
    normals_at  of several frames of one thing: "source" estimates normals in each frame and mixes them in the view;
              "target" estimates them in the view, on the depth that the frames give together, in every new view. Only
              phong shading shows the difference, and of a single frame there is none.
    flying    pixels that hang between two surfaces because the sensor mixed them: "keep" draws them there, "snap" puts
              them onto the nearer of the two (Sabov, Krueger 2008). Only "auto" and "adaptive" look for them, in noisy
              depth; clean depth does not change.
    temporal  True averages the depth and the normals of a stream over time: of the frames that are drawn one after
              another at the same place among a scene's point objects. Each pixel rests on up to 16 frames, as far as
              they agree within the measured noise; poses tell how the camera has moved. What moves or has just
              appeared is drawn as without it, and so is the first frame: a single picture does not change. The stream
              begins anew where the size or the camera's intrinsics change, and where the same frame is estimated
              again, otherwise. Only "auto" and "adaptive" filter, in noisy depth. It takes 64 bytes a pixel on the
              GPU, of several streams 40 for each more.
    unlight   True estimates the light in the picture, one direction and ambient light, and divides it out of the
              colours, so that surfaces are not shaded twice. Where the picture does not tell, they stay as they are.
    remove_highlights  True takes the highlights that the light in the picture makes out of its colours. Where the
              picture does not tell them from white paint, they stay.

    Raises ValueError for unknown names and for impossible numbers, TypeError for values of another kind. Arrays are
    checked by `for_frame`, which knows their shape.
    """

    material: Material = Material()
    normals: str | ArrayLike = "auto"
    shading: str = "phong"
    size: float | ArrayLike | str | None = None
    splat: str = "footprint"
    max_depth_step: float | str | None = None
    noise: float | ArrayLike | str | None = None
    upsample: str = "vote"
    normals_at: str = "source"
    flying: str = "keep"
    temporal: bool = False
    unlight: bool = False
    remove_highlights: bool = False

    def __post_init__(self) -> None:
        check_type(self.material, Material, "material")
        check_choice(option("shading"), self.shading, SHADINGS)
        check_choice(option("splat"), self.splat, SPLATS)
        check_choice(option("upsample"), self.upsample, UPSAMPLINGS)
        check_choice(option("normals_at"), self.normals_at, NORMALS_AT)
        check_choice(option("flying"), self.flying, FLYING)
        for name in SWITCHES:
            object.__setattr__(self, name, check_flag(getattr(self, name), option(name)))
        if isinstance(self.normals, str):
            check_method(self.normals)
        elif _is_single(self.normals):
            raise TypeError(f"normals must be a method's name or have shape (h, w, 3), got {shown(self.normals)}")
        object.__setattr__(self, "size", _checked_size(self.size, self.splat))
        if isinstance(self.noise, str):
            check_noise_text(self.noise)
        elif self.noise is not None and _is_single(self.noise):
            object.__setattr__(self, "noise", check_noise(self.noise))
        parse_max_depth_step(self.max_depth_step)

    def for_frame(self, depth: NDArray[np.float32]) -> Look:
        """The look with its arrays checked against a depth picture (h, w) and copied, read-only.

        Raises ValueError for arrays of another shape, and for sizes or noise that make no sense.
        """
        changes: dict[str, Any] = {}
        if not isinstance(self.normals, str):
            changes["normals"] = _frozen(check_normals(self.normals, depth.shape))
        sizes = check_sizes(self.size, depth.shape)
        if sizes.size > 1:
            changes["size"] = _frozen(sizes.reshape(depth.shape))
        if self.noise is not None and not isinstance(self.noise, str):
            noise = parse_noise(self.noise, depth)
            if np.ndim(self.noise):
                changes["noise"] = _frozen(noise)
        return replace(self, **changes) if changes else self

    @property
    def is_uniform(self) -> bool:
        """No option is an array: each holds for every pixel."""
        return all(isinstance(value, str | int | float | None) for value in (self.normals, self.size, self.noise))

    @property
    def fills(self) -> bool:
        """Gaps between points are filled."""
        return isinstance(self.size, str)

    @property
    def farthest_reach(self) -> float:
        """Source pixels that the largest splat reaches from its middle."""
        size = 1.0 if self.size is None or self.fills else float(np.max(np.asarray(self.size)))
        return size * (0.5**0.5 if self.splat == "round" else 0.5)

    @property
    def options(self) -> dict[str, Any]:
        """By name, as arguments of `Renderer.render`."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def check_sizes(size: float | ArrayLike | str | None, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Splat sizes in source pixels as (1,) or (h*w,) float32; None and "fill" are 1.

    Raises ValueError for an impossible size.
    """
    complaint = f"size is the splats' size in source pixels, one number or an array of {shape}"
    sizes = np.atleast_1d(as_array(1.0 if size is None or isinstance(size, str) else size, complaint, np.float32))
    if sizes.shape not in ((1,), shape):
        raise ValueError(f"{complaint}, got {sizes.shape}")
    if not ((sizes >= 0) & (sizes <= LARGEST)).all():
        raise ValueError("size must be finite and not negative everywhere")
    return sizes.ravel()


def _checked_size(size: Any, splat: str) -> Any:
    """The size, a single number as a float. Raises ValueError for one that cannot be drawn."""
    if isinstance(size, str):
        if size != "fill":
            raise ValueError(f"size must be a number of source pixels, or 'fill', got {shown(size)}")
    elif size is not None and _is_single(size):
        size = check_float(size, "size must be a number of source pixels, 0 or above", 0)
    if splat == "mesh" and not (size is None or (np.ndim(size) == 0 and size in (1, "fill"))):
        others = option("splat", *SPLATS[:-1])
        raise ValueError(f"size is that of splats, and a mesh has none: leave it out, or use {others}")
    return size


def _is_single(value: Any) -> bool:
    """Whether a value is no array."""
    return type(value) in (int, float) or not (isinstance(value, list | tuple) or np.ndim(value))


def _frozen(array: Any) -> NDArray[Any]:
    copy = np.array(array)
    copy.flags.writeable = False
    return copy
