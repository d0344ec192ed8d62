"""A frame: one depth image with its colour image, and the camera that took them; and the checks of its arrays."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import LARGEST, as_given, check_direction, check_point, check_type, depth_as_given
from ..checks.foreign_arrays import AnyArray, way_to
from ..notes.errors import ContextError
from ..notes.notes import print_note
from ..notes.words import counted, shown
from .camera import NEAR, Camera, check_pose
from .values import Value, box_corners, frozen, median, quantile

LEAST_POINTS = 1000  # of fewer none is told
LEAST_SHARE = 0.02  # of the points: below it are a few outliers
MOST_SHARE = 0.999  # beyond it the others are, and this is the surface


class FarPlane(NamedTuple):
    """A far plane, and the depth beyond which there is nothing but it and its edges, mixed of it and what is near."""

    depth: float
    limit: float


def far_plane(depths: NDArray[Any], times: float) -> FarPlane | None:
    """Return the largest depth, if many points have exactly this one and it is far beyond the others; else None.

    depths  those of some points, all known
    times   as far as the middle of the others is the limit
    """
    if depths.size < LEAST_POINTS:
        return None
    farthest = depths.max()
    others = depths[depths < farthest]
    if not LEAST_SHARE <= 1 - others.size / depths.size < MOST_SHARE:
        return None
    limit = times * median(others)
    return FarPlane(float(farthest), limit) if farthest > limit else None


BACKGROUND = 100  # times as far as all else: one value there is that of a sky without a depth
LEAST = 1 / LARGEST  # of a depth: shaders square lengths, and drivers take the squares of smaller ones for 0
NEUTRAL = 204  # light grey, sRGB: the colour of a frame without colours
PROBE = 10_000  # pixels looked at for the pivot and the range: enough for a median, quick for any size


def check_colors(color: Any) -> NDArray[np.uint8]:
    """The colours, read-only. Raises TypeError or ValueError for anything but (h, w, 3|4) uint8."""
    expected = "color must have shape (h, w, 3) or (h, w, 4)"
    array = as_given(color, expected)
    if array.ndim != 3 or array.shape[2] not in (3, 4) or 0 in array.shape:
        raise ValueError(f"{expected}, got {array.shape}{way_to(array.shape, 'color', color, (3, 4))}")
    if array.dtype != np.uint8:
        hint = "multiply by 255 and round" if array.dtype.kind == "f" else "convert it to 8 bits"
        raise TypeError(f"color must be uint8 sRGB, got {array.dtype}: {hint}")
    array = array if _is_frozen(array) else np.array(array, order="C")
    return frozen(array)


def check_depth(depth: Any, camera: Camera) -> NDArray[np.float32]:
    """The depth, 0 where it is missing. Raises TypeError or ValueError unless it is metres of the camera's size."""
    array = depth_as_given(depth)
    if array.dtype.kind not in "fiub":
        got = shown(depth) if array.ndim == 0 else array.dtype
        raise TypeError(f"depth must be floating point metres, got {got}")
    if array.ndim != 2 or 0 in array.shape:
        raise ValueError(f"depth must have shape (h, w), got {array.shape}{way_to(array.shape, 'depth', depth)}")
    if array.dtype.kind in "iu":
        raise TypeError(f"depth is {array.dtype}: divide it by its depth_scale (1000 for millimetres) to get metres")
    if array.dtype.kind != "f":
        raise TypeError(f"depth must be floating point metres, got {array.dtype}")
    if array.shape != (camera.height, camera.width):
        height, width = array.shape
        sizes = f"camera is for {camera.width}x{camera.height} pixels, depth is {width}x{height}"
        raise ValueError(f"{sizes}: use camera.resized({width}, {height}) if it shows the same view")
    with np.errstate(over="ignore", invalid="ignore"):
        result = array if _is_frozen(array) and array.dtype == np.float32 else array.astype(np.float32, order="C")
        # one test for everything that is missing: NaN compares false, and what overflows float32 is infinite by now
        if not (result.min() >= LEAST and result.max() <= LARGEST):  # most pictures that miss nothing end here
            result = result if result.flags.writeable else result.copy()
            result[~((result >= LEAST) & (result <= LARGEST))] = 0
    return result


def without_background(depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return depth without its far plane, if that is a background; a note tells it."""
    step = probing_step(depth)
    probed = depth[::step, ::step]
    found = far_plane(probed[probed > 0], BACKGROUND)
    if found is None:
        return depth
    is_background = depth > found.limit
    share = np.count_nonzero(is_background) / np.count_nonzero(depth)
    apart = f"over {BACKGROUND} times as far as the others"
    print_note(f"the depth {found.depth:g} of {share:.0%} of the points, {apart}, is taken as background: missing")
    return np.where(is_background, np.float32(0), depth)


def probing_step(depth: NDArray[Any]) -> int:
    """Return the step between the rows and columns of about PROBE pixels."""
    return max(1, round((depth.size / PROBE) ** 0.5))


def _is_frozen(array: NDArray[Any]) -> bool:
    """Return whether nobody is expected to write into an array: it is kept as it is, all others are copied."""
    return array.base is None and not array.flags.writeable and array.flags.c_contiguous


def cut_out(depth: NDArray[np.float32], color: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return depth without the pixels whose colour is fully transparent."""
    h, w = depth.shape
    rows = [(2 * i + 1) * color.shape[0] // (2 * h) for i in range(h)]
    columns = [(2 * i + 1) * color.shape[1] // (2 * w) for i in range(w)]
    return np.where(color[rows][:, columns, 3] > 0, depth, np.float32(0))


LINES = 16  # rows and columns that are looked at first: next to nothing to pay where depth is dense
GOLDEN = 0.6180339887  # places them in no rhythm, as scan lines have one
ALONE = 0.6  # share of the known pixels whose next one is missing; half of the pixels at random leave 0.5
KNOWN = 0.45  # share that may be known between the first and the last of a line
ENOUGH = 100  # known pixels that prove anything
RING = 16  # part of the picture's shorter side that sensors may lose along its border
LEVEL = 1.08  # times another depth of its row: beyond, what lies between them is not one surface,
STEEP = 2.0  # unless it is as steep as this, in metres of depth for one across
ROUND = 0.5  # share without depth of what runs round the picture there, beyond which an object was cut out


def is_sparse(depth: NDArray[np.float32]) -> bool:
    """Return whether known pixels (h, w; 0 is missing) stand alone along rows or along columns, with others further on.

    Holes of up to half of the pixels do not make a picture sparse, nor does an empty background behind objects.
    """
    shares = (np.arange(1, LINES + 1) * GOLDEN) % 1
    return any(_stand_alone(z[(shares * len(z)).astype(np.intp)] > 0) and _are_sparse(z > 0) for z in (depth, depth.T))


def is_cut_out(depth: NDArray[np.float32]) -> bool:
    """Return whether depth (h, w) shows an object that was cut out: there is nothing round it."""
    inset = min(depth.shape) // RING
    inner = depth[inset : depth.shape[0] - inset, inset : depth.shape[1] - inset]
    ring: NDArray[np.float32] = np.concatenate([inner[0], inner[-1], inner[:, 0], inner[:, -1]])
    return bool(np.count_nonzero(ring) < (1 - ROUND) * ring.size)


def _across_gaps(depth: NDArray[np.float32], step: int, focal: float) -> NDArray[np.float32]:
    """Return every step-th row and column of depth without its gaps: between two depths of a row 1/z is a line.

    Across a larger step the farther one goes on, and at the border of the picture the only one. Empty rows stay 0.
    focal: in pixels of depth.
    """
    rows = depth[::step]
    columns = np.arange(rows.shape[1], dtype=np.int32)
    before = np.maximum.accumulate(np.where(rows > 0, columns, 0), 1)[:, ::step]
    after = np.minimum.accumulate(np.where(rows > 0, columns, columns[-1])[:, ::-1], 1)[:, ::-1][:, ::step]
    left, right = (np.take_along_axis(rows, side, 1) for side in (before, after))
    width = np.maximum(after - before, 1)
    share = (columns[::step] - before) / width
    line = left * right / np.maximum(right + share * (left - right), 1e-30)
    farther = np.maximum(left, right)
    is_step = farther > (LEVEL + STEEP * width / focal) * np.minimum(left, right)
    return np.where(is_step, farther, line).astype(np.float32)


def _stand_alone(known: NDArray[np.bool_]) -> bool:
    """Return whether most pixels of some lines (n, length) are not followed by another."""
    followed = np.count_nonzero(known[:, :-1] & known[:, 1:])
    return bool(followed < (1 - ALONE) * np.count_nonzero(known))


def _are_sparse(known: NDArray[np.bool_]) -> bool:
    line, place = np.nonzero(known)
    gaps = np.diff(place)[np.diff(line) == 0]
    return bool(gaps.size > ENOUGH and (gaps > 1).mean() > ALONE and gaps.size < KNOWN * gaps.sum())


_draw: Callable[[Any], bytes] | None = None


class Preview:
    """A value that a notebook shows as a picture, as soon as there is something that draws it."""

    def _repr_png_(self) -> bytes | None:
        try:
            return None if _draw is None else _draw(self)
        except ContextError:  # the notebook shows the text instead
            return None


def draw_previews_by(draw: Callable[[Any], bytes]) -> None:
    """Set the function that makes the PNG of a frame or scene, from now on."""
    global _draw
    _draw = draw


def _unit(up: AnyArray) -> tuple[float, float, float]:
    x, y, z = check_direction(up, "frame up")
    length = math.hypot(x, y, z)
    return x / length, y / length, z / length


Direction = tuple[float, float, float]
_OF_POSE = "pose", "pivot"  # what a frame keeps that depends on its pose
STRAY = 1.0  # see Frame.main_corners
BEHIND = 10  # times: one value there is drawn, but it is not what is looked at


@dataclass(frozen=True, eq=False)
class Frame(Value, Preview):
    """A frame: a depth picture with its colours, camera and pose, checked once and never changed afterwards.

    A frame equals only itself, and a copy of it is the frame itself: other depth takes another frame.

    Parameters
    ----------
    color : (h, w, 3|4) uint8 or None
        sRGB, of any size: colours are sampled at the positions of the depth pixels. None is light grey. Where alpha is
        0, the depth counts as missing. If both sides are larger than the depth's, rendered pictures have the size of
        the colours, see `Appearance.upsample`.
    depth : (h, w) float
        z along the optical axis, metres. Missing values become 0: zero, negative, NaN, infinite, masked, or outside
        1e-18 to 1e18. So does a far plane, with a note: of 1000 points or more, one value of at least 2 % of them, over
        100 times as far as the middle of the others, such as 1e10 or 65504 for a sky. Kept as read-only float32. What
        else means "missing" in files: files/depth/missing_depth.py.
    camera : Camera
        Camera of the depth picture.
    pose : (4, 4) float, optional
        Camera-to-world; None is the identity.
    source : hashable, optional
        Identifies the stream that the frame comes from. Frames of one stream share one decision about their noise.
        None: the frame is judged alone.
    up : (3,) float, optional
        Which way is up, camera axes; kept with length 1. None: nothing says so. `with_up` takes world axes.
    about : (3,) float, optional
        The point that cameras turn around, camera axes. None: the middle of what it shows. `with_up` takes world axes.

    Raises
    ------
    TypeError
        For arrays of the wrong kind.
    ValueError
        For shapes that do not fit.

    Notes
    -----
    Arrays may be of any library: tensors on the CPU, pictures of Pillow, buffers, what has DLPack. They are copied,
    once, unless they own their memory, are read-only, and have the dtype that is kept.
    """

    color: NDArray[np.uint8] | None
    depth: NDArray[np.float32]
    camera: Camera
    pose: NDArray[np.float64] = field(default_factory=lambda: check_pose(None))
    source: Hashable = None
    up: tuple[float, float, float] | None = None
    about: Direction | None = None

    def __init__(
        self, color: AnyArray | None, depth: AnyArray, camera: Camera, pose: AnyArray | None = None, *,
        source: Hashable = None, up: AnyArray | None = None, about: AnyArray | None = None,
    ):  # fmt: skip
        object.__setattr__(self, "up", None if up is None else _unit(up))
        point = () if about is None else check_point(about, "frame about")
        object.__setattr__(self, "about", tuple(map(float, point)) or None)
        object.__setattr__(self, "source", source)
        object.__setattr__(self, "camera", check_type(camera, Camera, "camera"))
        object.__setattr__(self, "pose", check_pose(pose))
        object.__setattr__(self, "color", None if color is None else check_colors(color))
        object.__setattr__(self, "depth", without_background(check_depth(depth, camera)))
        if self.color is not None and self.color.shape[2] == 4:
            object.__setattr__(self, "depth", cut_out(self.depth, self.color))
        frozen(self.depth)

    def __repr__(self) -> str:
        """`Frame(640x480, 93 207 points, 0.9 to 6.3 m, color 640x480)`: short, where arrays would fill the screen."""
        h, w = self.depth.shape
        near, far = self.depth_range
        span = f", {near:.3g} to {far:.3g} m" if far else ""
        color = "no color" if self.color is None else f"color {self.color.shape[1]}x{self.color.shape[0]}"
        return f"Frame({w}x{h}, {counted(self.points_known, 'point')}{span}, {color})"

    def at(self, pose: AnyArray) -> Frame:
        """Return the frame at another pose; both share their arrays.

        Parameters
        ----------
        pose : (4, 4) float
            Camera-to-world.

        Raises
        ------
        TypeError, ValueError
            As for the pose of a new frame.
        """
        moved = object.__new__(Frame)
        for name, value in self.__dict__.items():
            if name not in _OF_POSE:
                object.__setattr__(moved, name, value)
        object.__setattr__(moved, "pose", check_pose(pose))
        return moved

    def with_up(self, up: AnyArray | None, about: AnyArray | None = None) -> Frame:
        """Return the frame that knows which way is up, so that yaw turns about it; both share their arrays.

        Parameters
        ----------
        up : (3,) float or None
            World axes, of any length. None: nothing says so, and yaw turns about the picture's vertical.
        about : (3,) float, optional
            The point, world axes, that the camera turns around, such as the middle of a turntable. None: the middle of
            what the frame shows.

        Raises
        ------
        TypeError, ValueError
            For anything but three finite numbers; of `up` not all of them 0.
        """
        axes, place = self.pose[:3, :3], None
        if about is not None:
            x, y, z = axes.T @ (check_point(about, "frame about") - self.pose[:3, 3])
            place = float(x), float(y), float(z)
        return self._turning(None if up is None else _unit(_unit(up) @ axes), place)

    def _turning(self, up: Direction | None, about: Direction | None) -> Frame:
        """Return the frame that turns about this axis, camera axes."""
        turning = self.at(self.pose)
        object.__setattr__(turning, "up", up)
        object.__setattr__(turning, "about", about)
        return turning

    def turning_as(self, other: Frame) -> Frame:
        """Return the frame that turns about the same axis as another.

        Parameters
        ----------
        other : Frame
            Of the same camera axes.
        """
        return self._turning(other.up, other.about)

    @property
    def frames(self) -> tuple[Frame, ...]:
        """Return the frame itself, alone; a scene is not drawn as frames."""
        return (self,)

    def framed(self) -> Frame:
        """Return the frame itself: unlike a scene it always has a camera."""
        return self

    @property
    def upright(self) -> NDArray[np.float64] | None:
        """Return the axis that yaw turns about, (3,) unit, world, as of a scene; None: nothing says where up is."""
        return None if self.up is None else self.pose[:3, :3] @ self.up

    @cached_property
    def picture_camera(self) -> Camera:
        """Return the default camera for rendering; the frame's own, at the colours' size if both sides are larger."""
        height, width = self.depth.shape if self.color is None else self.color.shape[:2]
        is_larger = width > self.camera.width and height > self.camera.height
        return self.camera.resized(width, height) if is_larger else self.camera

    @cached_property
    def points_known(self) -> int:
        """Return the number of pixels that have a depth."""
        return int(np.count_nonzero(self.depth))

    @cached_property
    def is_sparse(self) -> bool:
        """Return whether few depths are known, far from one another, see scene/frame.py."""
        return is_sparse(self.depth)

    @cached_property
    def box(self) -> tuple[int, int, int, int]:
        """Return left, top, right and bottom of the pixels that have a depth; all 0 without any.

        Right and bottom are exclusive.
        """
        return _box_of(self.depth)

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """Return the (8, 3) corners of a box that holds all points, camera axes; (0, 3) without a point.

        The box of the pixels with a point, from the nearest depth to the farthest: larger than the object.
        """
        return self.splat_corners(0.5)

    def splat_corners(self, reach: float) -> NDArray[np.float64]:
        """Return the corners of the box around all splats.

        Parameters
        ----------
        reach : float
            How far each splat reaches from its middle, pixels.

        Returns
        -------
        (8, 3) float64
            Camera axes; (0, 3) without a point.
        """
        return self._corners(self.box, self.depth_range, reach)

    @cached_property
    def main_corners(self) -> NDArray[np.float64]:
        """Return the corners like `corners`, without stray points; depths far beyond those of nearly all points.

        Shadows and near planes are fitted to these corners: one wrong pixel at 3 km must not decide about them.
        """
        (least, most), (low, high) = self.depth_range, self._usual_range
        if low <= least and most <= high:
            return self.corners
        usual = (self.depth >= low) & (self.depth <= high)
        depths = self.depth[usual]
        return self._corners(_box_of(usual), (float(depths.min()), float(depths.max())))

    @cached_property
    def _probed(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return rows and columns of what is known among about PROBE pixels, or of all that is if these have none.

        A far plane is left out: pivot, near plane and shadows are those of what stands before it.
        """
        step = probing_step(self.depth)
        v, u = np.nonzero(self.depth[::step, ::step])
        if not v.size:
            step, (v, u) = 1, np.nonzero(self.depth)
        v, u = step * v, step * u
        depths = self.depth[v, u]
        found = far_plane(depths, BEHIND)
        return (v, u) if found is None else (v[depths <= found.limit], u[depths <= found.limit])

    @cached_property
    def _usual_range(self) -> tuple[float, float]:
        """Return the range of nearly all depths: from the 1st to the 99th percentile, and as much on both sides."""
        if not self._probed[0].size:
            return 0.0, np.inf
        depths = self.depth[self._probed]
        low, high = quantile(depths, 0.01), quantile(depths, 0.99)
        reach = STRAY * (high - low) + 0.1 * high
        return max(low - reach, low / 4), high + reach

    def _corners(
        self, box: tuple[int, int, int, int], depths: tuple[float, float], reach: float = 0.5
    ) -> NDArray[np.float64]:
        """Of the box round the part of the view that these pixels and depths limit; none where there are no pixels."""
        left, top, right, bottom = box
        if not right:
            return frozen(np.zeros((0, 3)))
        x, y = self.camera.ray_at(*np.array([[left - reach, right - 1 + reach], [top - reach, bottom - 1 + reach]]))
        at = np.array([[x_ * z, y_ * z, z] for z in depths for x_ in x for y_ in y])
        return frozen(box_corners(at.min(0), at.max(0)))

    @cached_property
    def depth_range(self) -> tuple[float, float]:
        """Return the nearest and the farthest depth; 0 and 0 without any."""
        farthest = float(self.depth.max())
        return float(self.depth.min(where=self.depth > 0, initial=farthest)), farthest

    @cached_property
    def pivot(self) -> NDArray[np.float64]:
        """Return the middle of the object, (3,) world; the median of the points; 1 unit ahead without any.

        Of points without depth, too, as far away as the surface of those beside them in their row, or the farther one:
        a frame turns around the same point whatever its sensor has lost. Of an object that was cut out only known ones.
        The point that `with_up` was told takes their place.
        """
        if self.about is not None:
            return frozen(self.pose[:3, :3] @ self.about + self.pose[:3, 3])
        v, u = self._probed
        if not v.size:
            return frozen(self.pose[:3, :3] @ np.array([0.0, 0.0, 1.0]) + self.pose[:3, 3])
        z = self.depth[v, u]
        step = probing_step(self.depth)
        grid = self.depth[::step, ::step]
        if z.size < grid.size and grid.any() and not is_cut_out(self.depth):
            whole = _across_gaps(self.depth, step, abs(self.camera.fx))
            v, u = np.nonzero((whole > 0) & (whole <= z.max()))  # a far plane stays out
            v, u, z = step * v, step * u, whole[v, u]
        (x, y), z = self.camera.ray_at(u, v), z.astype(np.float64)
        return frozen(self.pose[:3, :3] @ [median(x * z), median(y * z), median(z)] + self.pose[:3, 3])

    @cached_property
    def scale(self) -> float:
        """Return the median distance of the known points along the optical axis, in the frame's unit; 1 without any.

        A note tells if the near plane, which follows from it, cuts more than 1 % of them off.
        """
        if not self._probed[0].size:
            return 1.0
        depths = self.depth[self._probed]
        scale = median(depths)
        near = NEAR * scale
        cut = np.count_nonzero(depths < near) / depths.size
        if cut > 0.01:
            print_note(f"{cut:.0%} of the points lie before the near plane, at {near:.3g} m, and are not drawn")
        return scale


def _box_of(known: NDArray[Any]) -> tuple[int, int, int, int]:
    """Return left, top, right and bottom of what is not 0, the last two exclusive; all 0 without any."""
    height, width = known.shape
    if known[0].any() and known[-1].any() and known[:, 0].any() and known[:, -1].any():
        return 0, 0, width, height
    rows, columns = (np.flatnonzero(known.any(axis)) for axis in (1, 0))
    if not len(rows):
        return 0, 0, 0, 0
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1
