"""A frame: one depth image with its colour image, and the camera that took them."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import check_type
from ..checks.foreign_arrays import AnyArray
from ..notes.notes import print_note
from ..notes.words import counted
from .bounds import box_corners, median, quantile
from .camera import NEAR, Camera, check_pose
from .far_plane import far_plane
from .frame_arrays import check_colors, check_depth, cut_out, probing_step, without_background
from .preview import Preview
from .sparsity import is_sparse
from .values import Value, frozen

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
        the colours, see `Look.upsample`.
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

    def __init__(
        self,
        color: AnyArray | None,
        depth: AnyArray,
        camera: Camera,
        pose: AnyArray | None = None,
        *,
        source: Hashable = None,
    ):
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
        """Return whether few depths are known, far from one another, see scene/sparsity.py."""
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
        """Return the middle of the object, (3,) world; the median of the known points; 1 unit ahead without any.

        Its distance is the frame's scale: near plane and orbit follow it, so that any unit works.
        """
        v, u = self._probed
        if not v.size:
            return frozen(self.pose[:3, :3] @ np.array([0.0, 0.0, 1.0]) + self.pose[:3, 3])
        (x, y), z = self.camera.ray_at(u, v), self.depth[v, u].astype(np.float64)
        return frozen(self.pose[:3, :3] @ [median(x * z), median(y * z), median(z)] + self.pose[:3, 3])

    @cached_property
    def scale(self) -> float:
        """Return the median distance of the known points along the optical axis, in the frame's unit; 1 without any.

        A note tells if the near plane, which follows from it, cuts more than 1 % of them off.
        """
        if not self._probed[0].size:
            return 1.0
        depths = self.depth[self._probed]
        scale = median(depths)  # that of the pivot
        near = NEAR * scale
        cut = np.count_nonzero(depths < near) / depths.size
        if cut > 0.01:
            print_note(f"{cut:.0%} of the points lie before the near plane, at {near:.3g} m, and are not drawn")
        return scale


def _box_of(known: NDArray[Any]) -> tuple[int, int, int, int]:
    """Return left, top, right and bottom of what is not 0, the last two exclusive; all 0 without any."""
    height, width = known.shape
    if all(edge.any() for edge in (known[0], known[-1], known[:, 0], known[:, -1])):
        return 0, 0, width, height
    rows, columns = (np.flatnonzero(known.any(axis)) for axis in (1, 0))
    if not len(rows):
        return 0, 0, 0, 0
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1
