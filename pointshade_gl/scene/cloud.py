"""Point clouds: points in space with normals, colours and sizes, as immutable values; their axes and sizes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, Literal, TypedDict, get_args

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import as_given, check_choice, check_type
from ..checks.foreign_arrays import Numbers
from ..notes.words import counted, option
from .appearance import CLOUD_SPLATS, Material, check_cloud_size, parse_cloud_size
from .camera import moved
from .dense_part import STRAY, main_points
from .frame import Frame
from .gaussians import Gaussians
from .values import DrawnValue, box_corners, floats_of, frozen, linear_to_bytes, shaped

if TYPE_CHECKING:
    from typing_extensions import Unpack

Up = Literal["x", "y", "z", "-x", "-y", "-z"]
CloudShading = Literal["none", "phong", "edl", "auto"]
CloudSplat = Literal["disc", "ball", "gaussian"]
UPS: tuple[Up, ...] = get_args(Up)
CLOUD_SHADINGS: tuple[CloudShading, ...] = get_args(CloudShading)
FLOATERS = 0.01  # share of the points of trained splats on each side of an axis that bounds leave out
ARRAYS = "positions", "normals", "colors", "sizes", "confidence", "seen_from"
KEPT = (*ARRAYS, "gaussians")  # what clouds share that only look otherwise


class CloudStyle(TypedDict, total=False):
    """How a cloud is drawn."""

    material: Material
    shading: CloudShading
    splat: CloudSplat
    point_size: float | str | None


@dataclass(frozen=True, eq=False)
class PointCloud(DrawnValue):
    """Points in space, drawn as discs on the surface that they sample, or as balls.

    Parameters
    ----------
    positions : (n, 3) float32 or float64
        From `origin`; anything but float32 is kept as float64.
    normals : (n, 3) float32, optional
        Unit vectors; those of length 0 are unknown. None: they are estimated where they are needed.
    colors : (n, 3) uint8, optional
        sRGB; None is white.
    sizes : (n,) float32, optional
        Radius of each point, world units; None: from the spacing of the points.
    confidence : (n,) float32, optional
        How sure each normal is, 0 to 1.
    origin : (3,) float64
        Where the positions count from: far from zero for georeferenced clouds, of which float32 tells no millimetres.
    up : {"x", "y", "z", "-x", "-y", "-z"}
        Which axis points up.
    seen_from : (3,) or (n, 3) float64, optional
        Where the scanner stood, from `origin`: normals that are written to files point there.
    material : Material
        How the surface answers light.
    shading : {"phong", "none", "edl", "auto"}
        Light for each pixel, or the points' own colours: "edl" (eye-dome lighting) darkens them beside what is nearer,
        so that depth is seen without light. Prefer it to "none". "auto" is "none" until light is asked for: a light, an
        environment or ambient occlusion; trained splats that are read have it.
    splat : {"disc", "ball", "gaussian"}
        What is drawn of each point: discs are blended into a surface, balls stay single; a cloud with `gaussians` is
        blended as it was trained ("gaussian"), and has as discs and balls only those that are opaque.
    point_size : float or str, optional
        Radius of all points: world units, "3px" pixels of the picture, or "2x" the points' spacing; None is 2x for
        discs and 0.5x for balls, or `sizes`.
    front : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Which axis points towards the viewer, as -z does in the points of frames: alone, the cloud is seen from there.
        None: one whose up is -y is seen so, too, others from above.
    gaussians : Gaussians, optional
        What trained splats are beside their positions.

    Raises
    ------
    TypeError
        For arrays of the wrong kind.
    ValueError
        For shapes that do not fit, and for numbers that are not finite.

    Notes
    -----
    Arrays are copied and read-only.
    """

    positions: NDArray[np.floating[Any]]
    normals: NDArray[np.float32] | None = None
    colors: NDArray[np.uint8] | None = None
    sizes: NDArray[np.float32] | None = None
    confidence: NDArray[np.float32] | None = None
    origin: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    up: Up = "-y"
    seen_from: NDArray[np.float64] | None = None
    material: Material = field(default_factory=Material)
    shading: CloudShading = "phong"
    splat: CloudSplat = "disc"
    point_size: float | str | None = None
    front: Up | None = None
    gaussians: Gaussians | None = None

    if TYPE_CHECKING:  # what may be passed is more than what is kept

        def __init__(
            self, positions: Numbers, normals: Numbers | None = None, colors: Numbers | None = None,
            sizes: Numbers | None = None, confidence: Numbers | None = None, origin: Numbers = ..., up: Up = ...,
            seen_from: Numbers | None = None, material: Material = ..., shading: CloudShading = ...,
            splat: CloudSplat = ..., point_size: float | str | None = None, front: Up | None = None,
            gaussians: Gaussians | None = None,
        ) -> None: ...  # fmt: skip

    def __post_init__(self) -> None:
        points = as_given(self.positions, "positions must be numbers of shape (n, 3)")
        kind = np.float32 if points.dtype == np.float32 else np.float64
        self._set("positions", _floats(self.positions, "positions", (None, 3), kind))
        count = len(self)
        if self.normals is not None:
            self._set("normals", _floats(self.normals, "normals", (count, 3), np.float32))
        if self.colors is not None:
            colors = np.array(as_given(self.colors, "colors must be uint8 of shape (n, 3)"))
            if colors.dtype != np.uint8:
                raise TypeError(f"colors must be uint8 sRGB, got {colors.dtype}")
            self._set("colors", shaped(colors, "colors", (count, 3)))
        for name in ("sizes", "confidence"):
            if getattr(self, name) is not None:
                values = _floats(getattr(self, name), name, (count,), np.float32)
                self._set(name, values)
                if values.size and values.min() < 0:
                    raise ValueError(f"{name} must not be negative, got {values.min():g}")
        self._set("origin", _floats(self.origin, "origin", (3,), np.float64))
        if self.seen_from is not None:
            place = as_given(self.seen_from, "seen_from must be numbers of shape (3,)")
            shape = (count, 3) if place.ndim == 2 else (3,)
            self._set("seen_from", _floats(self.seen_from, "seen_from", shape, np.float64))
        check_type(self.material, Material, "cloud material")
        for name, known in (("up", UPS), ("shading", CLOUD_SHADINGS), ("splat", CLOUD_SPLATS)):
            check_choice(option(name), getattr(self, name), known)
        if self.front is not None:
            check_choice("front", self.front, UPS)
            if self.front[-1] == self.up[-1]:
                raise ValueError(f"front must be another axis than {option('up', self.up)}, got {self.front}")
        if self.gaussians is not None and len(check_type(self.gaussians, Gaussians, "gaussians")) != count:
            raise ValueError(f"gaussians must be {count}, as many as the positions, got {len(self.gaussians)}")
        object.__setattr__(self, "point_size", check_cloud_size(self.point_size))

    def _set(self, name: str, array: NDArray[Any]) -> None:
        object.__setattr__(self, name, frozen(array))

    def __len__(self) -> int:
        return len(self.positions)

    def __repr__(self) -> str:
        return f"PointCloud({counted(len(self), 'point')})"

    def styled(self, **look: Unpack[CloudStyle]) -> PointCloud:
        """Return the same points, drawn otherwise. Their arrays are not copied.

        Parameters
        ----------
        **look
            `material`, `shading`, `splat` and `point_size`, as of a new cloud.
        """
        if others := [name for name in look if name not in CloudStyle.__annotations__]:
            raise TypeError(f"a cloud is styled by {', '.join(CloudStyle.__annotations__)}, got {', '.join(others)}")
        if look.get("splat") == "gaussian" and self.gaussians is None:
            raise ValueError(f"{option('splat', 'gaussian')} is of trained splats, and this cloud has none")
        kept: CloudStyle = {name: getattr(self, name) for name in CloudStyle.__annotations__}  # type: ignore[assignment]
        made = PointCloud(np.empty((0, 3)), **(kept | look))
        for name in ("origin", "up", "front", *KEPT):
            object.__setattr__(made, name, getattr(self, name))
        if (known := vars(self).get("main_points")) is not None:
            vars(made)["main_points"] = known
        return made

    def _shaded(self, shading: str) -> PointCloud:
        return self.styled(shading=shading if shading in CLOUD_SHADINGS else "phong")

    @property
    def clouds(self) -> tuple[PointCloud, ...]:
        """Return the cloud itself."""
        return (self,)

    def is_like(self, other: PointCloud) -> bool:
        """Return whether another cloud has the same arrays and is drawn the same.

        Parameters
        ----------
        other : PointCloud
            The other cloud.
        """
        named = ("up", "front", *CloudStyle.__annotations__)
        alike = all(getattr(self, name) == getattr(other, name) for name in named)
        return alike and all(getattr(self, name) is getattr(other, name) for name in ("origin", *KEPT))

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """Return the (8, 3) corners of the box round all points, node axes; (0, 3) without any."""
        if not len(self):
            return frozen(np.zeros((0, 3)))
        columns = self.positions.T  # one by one they take a tenth of the time
        low, high = (np.array([end(column) for column in columns]) for end in (np.min, np.max))
        reach = self.reach(1.0)
        return frozen(box_corners(low - reach, high + reach) + self.origin)

    @cached_property
    def main_corners(self) -> NDArray[np.float64]:
        """The same without stray points."""
        if not len(self):
            return self.corners
        low, high = self._main_box
        margin = self.stray * (high - low) + self.reach(1 - self.stray)
        return frozen(box_corners(low - margin, high + margin) + self.origin)

    @cached_property
    def _main_box(self) -> NDArray[np.floating[Any]]:
        """Two corners, (2, 3), of the box round all but stray points."""
        return np.quantile(self.main_points, (self.stray, 1 - self.stray), axis=0) if len(self) else np.zeros((2, 3))

    @cached_property
    def main_points(self) -> NDArray[np.floating[Any]]:
        """Return a sample of the positions, (m, 3), without stray points: few, and far from all others."""
        return main_points(self.positions)

    @property
    def stray(self) -> float:
        """Return which share of the points on each side of an axis bounds leave out: trained splats have floaters."""
        return STRAY if self.gaussians is None else FLOATERS

    @property
    def is_gaussian(self) -> bool:
        """Return whether it is drawn as trained splats."""
        return self.splat == "gaussian" and self.gaussians is not None

    @cached_property
    def as_discs(self) -> PointCloud:
        """Return the cloud without what only trained splats have: those that can be drawn as opaque discs."""
        if self.gaussians is None:
            return self
        kept, normals, radii = self.gaussians.as_discs()
        colors = self.gaussians.colors[kept] if self.colors is None else self.colors[kept]
        look: CloudStyle = {"material": self.material, "point_size": self.point_size}
        look["shading"] = "none" if self.shading == "auto" else self.shading
        look["splat"] = "disc" if self.splat == "gaussian" else self.splat
        place: Any = {"origin": self.origin, "up": self.up, "front": self.front}
        return PointCloud(self.positions[kept], normals, colors, radii, **place, **look)

    @property
    def up_direction(self) -> NDArray[np.float64]:
        """Return the direction that is up, (3,) unit, node axes."""
        return direction_of(self.up)

    @property
    def arrays(self) -> tuple[Any, ...]:
        """Return all that the surface of the cloud is found from; clouds that only look otherwise share it."""
        return self.positions, self.normals, self.sizes, self.colors, self.origin

    @property
    def thins(self) -> bool:
        """Return whether fewer points may be drawn, each larger; not if they have a size in the world."""
        return self.radius_rule[1] != ""

    @property
    def points_known(self) -> int:
        """Return the number of points."""
        return len(self)

    @property
    def radius_rule(self) -> tuple[float, str]:
        """Return the radius of points, a number and its unit; "" world units, "px" pixels, "x" spacings or `sizes`."""
        if self.point_size is not None:
            return parse_cloud_size(self.point_size)
        return (1.0 if self.sizes is not None else 2.0 if self.splat == "disc" else 0.5), "x"

    def reach(self, share: float) -> float:
        """Return a radius that the points do not exceed, node units, as far as that is known before they are drawn.

        Parameters
        ----------
        share : float
            Of the points that do not exceed it.
        """
        if self.gaussians is not None:
            return 2 * self.gaussians.median_length
        number, unit = self.radius_rule
        if unit != "x" or not len(self):
            return number if unit == "" else 0.0
        if self.sizes is not None:
            return number * float(np.quantile(self.sizes, share))
        return number * self.rough_spacing

    @cached_property
    def rough_spacing(self) -> float:
        """Return how far apart the points would be on a surface as large as their box; 1 if they are in one place."""
        low, high = self._main_box
        return float(np.linalg.norm(high - low)) / math.sqrt(max(len(self), 1)) or 1.0


def direction_of(axis: Up) -> NDArray[np.float64]:
    """Return the direction of an axis, (3,)."""
    return np.eye(3)["xyz".index(axis[-1])] * (-1 if axis.startswith("-") else 1)


def _floats(value: Any, name: str, shape: tuple[int | None, ...], kind: Any) -> NDArray[Any]:
    return floats_of(value, name, shape, kind, ": leave out points that are not")


def cloud_of(found: Iterable[tuple[Frame, NDArray[np.float32], NDArray[np.float32]]]) -> PointCloud:
    """The points of frames, each row by row.

    found  each frame, with (h, w, 4) unit normal and depth, camera axes, depth 0 where there is no point; and (h, w, 4)
           linear light, cut off at 1
    """
    every = zip(*(_arrays_of(*one) for one in found), strict=True)
    positions, normals, colors = (np.concatenate(arrays) for arrays in every)
    return PointCloud(positions, normals, colors, front="-z")


def _arrays_of(
    frame: Frame, surface: NDArray[np.float32], light: NDArray[np.float32]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.uint8]]:
    """The positions, normals and colours of a frame's points, in the world."""
    v, u = np.nonzero(surface[..., 3])
    normals, z = surface[v, u, :3], surface[v, u, 3].astype(np.float64)
    x, y = frame.camera.ray_at(u, v)
    turned = normals @ frame.pose[:3, :3].T
    turned /= np.linalg.norm(turned, axis=-1, keepdims=True)  # poses of text files are rotations to 1 % only
    colors = _srgb()[np.rint(np.clip(light[v, u, :3], 0, 1) * 65535).astype(np.uint16)]
    return moved(np.stack([x * z, y * z, z], -1), frame.pose), turned, colors


@cache
def _srgb() -> NDArray[np.uint8]:
    """Return the sRGB, (65536,), of linear light over 65535."""
    return linear_to_bytes(np.arange(65536) / 65535)


CloudAxes = Literal["opencv", "opengl", "blender"]
# what is up, and what points towards the viewer
CLOUD_AXES: dict[CloudAxes, tuple[Up, Up]] = {"opencv": ("-y", "-z"), "opengl": ("y", "z"), "blender": ("z", "-y")}
USUAL_FRONT: dict[Up, Up] = {"-y": "-z", "y": "z", "z": "-y", "-z": "-y", "x": "-y", "-x": "-y"}  # by what is up
_VIEWER = re.compile(r"\b([xyz]) (towards|away from) the viewer\b")


def turned(cloud: PointCloud, axes: CloudAxes) -> PointCloud:
    """Return a cloud in other axes, with all that lies or points somewhere; numbers change places and signs only."""
    up, front = CLOUD_AXES[axes]
    turn = _axes_of(up, front) @ _axes_of(cloud.up, cloud.front or USUAL_FRONT[cloud.up]).T
    names = "positions", "normals", "seen_from", "origin"
    changed: dict[str, Any] = {name: _turned(getattr(cloud, name), turn) for name in names}
    if cloud.gaussians is not None:
        changed["gaussians"] = cloud.gaussians.turned(turn)
    return replace(cloud, **changed, up=up, front=front if cloud.front else None)


def axes_in_words(up: Up, front: Up) -> str:
    """Return such as "x right, y up, z towards the viewer"."""
    ends = ("up", "down"), ("towards the viewer", "away from the viewer"), ("right", "left")
    axes = zip((up, front, _right_of(up, front)), ends, strict=True)
    words = {axis[-1]: both[axis.startswith("-")] for axis, both in axes}
    return ", ".join(f"{axis} {words[axis]}" for axis in "xyz")


def front_in_words(text: str) -> Up | None:
    """Return which axis points towards the viewer, from what `axes_in_words` says; None where it says nothing."""
    found = _VIEWER.search(text)
    axis = found and f"{'-' if found[2] == 'away from' else ''}{found[1]}"
    return next((up for up in UPS if up == axis), None)


def _axes_of(up: Up, front: Up) -> NDArray[np.float64]:
    """Return (3, 3) columns: what is right, up and towards the viewer."""
    return np.stack([direction_of(_right_of(up, front)), direction_of(up), direction_of(front)], -1)


def _right_of(up: Up, front: Up) -> Up:
    right = np.cross(direction_of(up), direction_of(front))
    return next(axis for axis in UPS if np.array_equal(direction_of(axis), right))


def _turned(vectors: NDArray[Any] | None, turn: NDArray[np.float64]) -> NDArray[Any] | None:
    return None if vectors is None else vectors @ turn.T.astype(vectors.dtype)
