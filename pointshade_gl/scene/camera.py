"""Pinhole cameras and their poses, and the conventions of the whole project, stated here once; rotations."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple
from weakref import ref

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import ABOVE_0, LARGEST, as_array, check_count, check_float, check_point, depth_as_given
from ..checks.foreign_arrays import AnyArray
from ..notes.words import option
from .values import frozen

Matrix = NDArray[np.float64]


def rotation_of(quaternions: Matrix) -> Matrix:
    """Return the rotations, (..., 3, 3), of unit quaternions x, y, z, w, (..., 4)."""
    x, y, z, w = np.moveaxis(quaternions, -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, -1) for row in rows], -2)


def quaternion_of(rotation: Matrix) -> Matrix:
    """Return the unit quaternion x, y, z, w of a rotation (3, 3), w >= 0.

    It is found from the largest of the four, which loses no digits (Shepperd 1978).
    """
    (a, b, c), (d, e, f), (g, h, i) = rotation
    squares = np.array([1 + a - e - i, 1 - a + e - i, 1 - a - e + i, 1 + a + e + i])
    rows = np.array([
        (squares[0], b + d, c + g, h - f),
        (b + d, squares[1], f + h, c - g),
        (c + g, f + h, squares[2], d - b),
        (h - f, c - g, d - b, squares[3]),
    ])  # fmt: skip
    row = rows[int(np.argmax(squares))]
    return (row if row[3] >= 0 else -row) / np.linalg.norm(row)


def shortest_turn(start: Matrix, end: Matrix) -> Matrix:
    """The rotation, (3, 3), of one unit vector, (3,), to another by the smallest angle."""
    axis, cosine = np.cross(start, end), float(start @ end)
    if cosine < 1e-9 - 1:  # half a turn, about any axis across
        across = np.eye(3)[np.argmin(np.abs(start))]
        across = across - (across @ start) * start
        return 2 * np.outer(across, across) / (across @ across) - np.eye(3)
    x, y, z = axis
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + skew + skew @ skew / (1 + cosine)


def is_rotation(matrix: Matrix, tolerance: float) -> bool:
    """Return whether a (3, 3) matrix neither stretches, shears nor mirrors."""
    return is_orthogonal(matrix, tolerance) and np.linalg.det(matrix) > 0


def is_orthogonal(matrix: Matrix, tolerance: float) -> bool:
    """Return whether a (3, 3) matrix is a rotation or mirrors one: its columns have length 1 and right angles."""
    return bool(np.abs(matrix.T @ matrix - np.eye(3)).max() <= tolerance)


def check_matrix(value: Any, name: str) -> Matrix:
    """Return the value as a new (4, 4) float64 array.

    Raises TypeError for anything but numbers, ValueError for another shape and for numbers that are not finite.
    """
    matrix = as_array(value, f"{name} must be numbers of shape (4, 4)")
    if matrix.shape != (4, 4):
        raise ValueError(f"{name} must have shape (4, 4), got {matrix.shape}")
    if unknown := np.count_nonzero(~np.isfinite(matrix)):
        raise ValueError(f"{name} must be finite, got {unknown} NaN or infinite entries")
    if np.abs(matrix).max() > LARGEST:
        raise ValueError(f"{name} must be finite, its translation below {LARGEST:g}, got {np.abs(matrix).max():g}")
    return matrix


def moved(points: Matrix, matrix: NDArray[Any]) -> Matrix:
    """Return points (..., 3) after a (4, 4) matrix."""
    return points @ matrix[:3, :3].T + matrix[:3, 3]


NEAR = 0.001  # share of the distance to what is looked at
SMALLEST_FOV = 1e-6  # degrees; a smaller one needs an almost infinite focal length
SMALLEST = 1e-6  # pixels of a focal length, either way along its axis


@dataclass(frozen=True)
class Camera:
    """A pinhole camera: focal lengths, principal point and size, all in pixels.

    Parameters
    ----------
    fx, fy : float
        Focal lengths. `fy` may be negative: a picture whose rows run upwards, as in ICL-NUIM.
    cx, cy : float
        Principal point; pixel centres are at integers.
    width, height : int
        Size of the picture.

    Raises
    ------
    TypeError
        For anything but numbers.
    ValueError
        For impossible focal lengths and sizes.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    def __post_init__(self) -> None:
        for name in ("fx", "fy", "cx", "cy"):
            value = check_float(getattr(self, name), f"camera {name} must be a finite number of pixels")
            object.__setattr__(self, name, value)
        if self.fx < SMALLEST:
            raise ValueError(f"camera fx must be above 0 pixels, got {self.fx:g}")
        if abs(self.fy) < SMALLEST:
            raise ValueError(f"camera fy must not be 0 pixels, got {self.fy:g}")
        for name in ("width", "height"):
            object.__setattr__(self, name, _check_side(getattr(self, name), name))

    @classmethod
    def from_fov(cls, fov_y_degrees: float, width: int, height: int) -> Camera:
        """Return a camera with square pixels and a centred principal point.

        Parameters
        ----------
        fov_y_degrees : float
            Vertical field of view, from top to bottom.
        width, height : int
            Size of the picture, pixels.

        Raises
        ------
        ValueError, TypeError
            For an impossible field of view or size.
        """
        complaint = f"{option('fov')} must lie between 0 and 180 degrees (vertical: from top to bottom)"
        fov = check_float(fov_y_degrees, complaint, ABOVE_0, math.nextafter(180, 0))
        if fov < SMALLEST_FOV:
            raise ValueError(f"{option('fov')} must be at least {SMALLEST_FOV:g} degrees, got {fov:g}")
        width, height = _check_side(width, "width"), _check_side(height, "height")
        focal = height / 2 / math.tan(math.radians(fov) / 2)
        return cls(focal, focal, (width - 1) / 2, (height - 1) / 2, width, height)

    def rays(self) -> NDArray[np.float64]:
        """Return the ray through the centre of every pixel.

        Returns
        -------
        ndarray of shape (h, w, 3), float64
            Camera axes (x right, y down, z forward). z is 1, so that `rays() * depth[..., None]` are points.
        """
        return self.unproject(np.ones((self.height, self.width)))

    def unproject(
        self, depth: AnyArray, pixels: AnyArray | None = None, pose: AnyArray | None = None
    ) -> NDArray[np.float64]:
        """Return the points that pixels show.

        Parameters
        ----------
        depth : array of shape (h, w), or (...) with `pixels`
            z along the optical axis, in any unit. Where it is 0 or masked, as where depth is missing, the point is the
            camera's own place.
        pixels : array of shape (..., 2), optional
            Columns and rows (u, v) to which the depths belong, whole or between two pixels; pixel centres are at
            integers. Without them the depths are those of the whole picture.
        pose : array of shape (4, 4), optional
            Camera-to-world; the points are in the world. Without it they are in camera axes.

        Returns
        -------
        ndarray of shape (h, w, 3) or (..., 3), float64
            Points x, y, z in the unit of the depth.

        Raises
        ------
        TypeError
            For anything but real numbers.
        ValueError
            For other shapes, and for a pose that is not a rotation and a translation.
        """
        complaint = "depth must be numbers of shape (h, w)"
        z = as_array(depth_as_given(depth, complaint=complaint), complaint)
        if pixels is None:
            v, u = np.ogrid[0 : self.height, 0 : self.width]
        else:
            u, v = np.moveaxis(_check_last(pixels, "pixels", 2), -1, 0)
        shape = np.broadcast_shapes(u.shape, v.shape)
        if z.shape != shape:
            raise ValueError(f"depth must have shape {shape}, a value for each pixel, got {z.shape}")
        x, y = self.ray_at(u, v)
        points = np.stack([x * z, y * z, z], -1)
        return points if pose is None else moved(points, check_pose(pose))

    def project(self, points: AnyArray, pose: AnyArray | None = None) -> NDArray[np.float64]:
        """Return where points appear in the picture.

        Parameters
        ----------
        points : array of shape (..., 3)
            x, y, z in camera axes, or in the world with `pose`; any unit.
        pose : array of shape (4, 4), optional
            Camera-to-world.

        Returns
        -------
        ndarray of shape (..., 2), float64
            Columns and rows (u, v) in pixels, pixel centres at integers; outside the picture as well. NaN for points
            that are not in front of the camera.

        Raises
        ------
        TypeError
            For anything but real numbers.
        ValueError
            For other shapes, and for a pose that is not a rotation and a translation.
        """
        places = _check_last(points, "points", 3)
        if pose is not None:
            places = moved(places, np.linalg.inv(check_pose(pose)))
        x, y, z = np.moveaxis(places, -1, 0)
        with np.errstate(over="ignore", invalid="ignore"):
            return np.stack(self.pixel_at(x, y, np.where(z > 0, z, np.nan)), -1)

    def ray_at(self, u: Any, v: Any) -> tuple[Any, Any]:
        """Return x and y, where z is 1, of the ray through a place in the picture.

        Parameters
        ----------
        u, v : float or array
            Column and row, pixels.
        """
        return (u - self.cx) / self.fx, (v - self.cy) / self.fy

    def pixel_at(self, x: Any, y: Any, z: Any) -> tuple[Any, Any]:
        """Return the column and the row at which a point in front of the camera appears.

        Parameters
        ----------
        x, y, z : float or array
            The point, camera axes.
        """
        return self.fx * x / z + self.cx, self.fy * y / z + self.cy

    @property
    def intrinsics(self) -> tuple[float, float, float, float]:
        """Return (fx, fy, cx, cy), pixels."""
        return self.fx, self.fy, self.cx, self.cy

    def resized(self, width: int, height: int) -> Camera:
        """Return the camera of the same view on another grid of pixels; the picture's outer edges stay where they are.

        Parameters
        ----------
        width, height : int
            New size, pixels.
        """
        width, height = _check_side(width, "width"), _check_side(height, "height")
        sx, sy = width / self.width, height / self.height
        cx, cy = (self.cx + 0.5) * sx - 0.5, (self.cy + 0.5) * sy - 0.5
        return Camera(self.fx * sx, self.fy * sy, cx, cy, width, height)

    def fitted(self, width: int, height: int) -> Camera:
        """Return a camera that shows the whole view, undistorted, in the middle of a picture of another size and shape.

        Parameters
        ----------
        width, height : int
            New size, pixels.
        """
        width, height = _check_side(width, "width"), _check_side(height, "height")
        scale = min(width / self.width, height / self.height)
        cx = (self.cx - (self.width - 1) / 2) * scale + (width - 1) / 2
        cy = (self.cy - (self.height - 1) / 2) * scale + (height - 1) / 2
        return Camera(self.fx * scale, self.fy * scale, cx, cy, width, height)


def _check_last(value: AnyArray, name: str, count: int) -> NDArray[np.float64]:
    array = as_array(value, f"{name} must be numbers of shape (..., {count})")
    if array.shape[-1:] != (count,):
        raise ValueError(f"{name} must have shape (..., {count}), got {array.shape}")
    return array


def _check_side(value: int, name: str) -> int:
    return check_count(value, f"camera {name}", 1, "of pixels ")


class Eye(NamedTuple):
    """A viewing camera with its pose, and its near plane."""

    camera: Camera
    pose: NDArray[np.float64]  # (4, 4) camera-to-world
    near: float  # the near plane: z along the axis, world units; what comes closer is cut away

    @classmethod
    def at_distance(cls, camera: Camera, pose: NDArray[np.float64], distance: float) -> Eye:
        """Return the eye of a viewer who looks at objects at this distance: the near plane is at a thousandth of it."""
        return cls(camera, pose, NEAR * distance)


IDENTITY = frozen(np.eye(4))
_proved: dict[int, ref[NDArray[np.float64]]] = {}  # poses that were found right, by their ids


def check_pose(pose: AnyArray | None, name: str = "pose") -> NDArray[np.float64]:
    """A camera-to-world matrix as float64 (4, 4), read-only; None is the identity.

    Raises ValueError unless it is a rotation and a translation (to 1 %, so that rounded text files pass), TypeError for
    anything but numbers.
    """
    if pose is None:
        return IDENTITY
    key = id(pose)
    known = _proved[key]() if key in _proved else None
    if known is not None and known is pose:
        return known
    matrix = _surely_pose(pose) if type(pose) is np.ndarray else None
    if matrix is None:
        matrix = check_matrix(pose, name)
        rotation = matrix[:3, :3]
        if np.abs(matrix[3] - (0, 0, 0, 1)).max() > 1e-6 or not is_orthogonal(rotation, 0.01):
            raise ValueError(f"{name} must be camera-to-world: a rotation and a translation above the row (0, 0, 0, 1)")
        if np.linalg.det(rotation) < 0:
            axes = "OpenCV axes are x right, y down, z forward"
            raise ValueError(f"{name} mirrors: its rotation has determinant -1; {axes}")
    key = id(matrix)
    _proved[key] = ref(matrix, lambda _: _proved.pop(key, None))
    return frozen(matrix)


def _surely_pose(pose: NDArray[Any]) -> NDArray[np.float64] | None:
    """Return a copy of what is a pose beyond doubt, else None: each new view pays for this, and NumPy takes longer."""
    if pose.shape != (4, 4) or pose.dtype != np.float64:
        return None
    (a, b, c, x), (d, e, f, y), (g, h, i, z), last = pose.tolist()
    lengths = a * a + d * d + g * g, b * b + e * e + h * h, c * c + f * f + i * i
    angles = a * b + d * e + g * h, a * c + d * f + g * i, b * c + e * f + h * i
    volume = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    is_sure = last == [0, 0, 0, 1] and volume > 0.9
    for length, angle, place in zip(lengths, angles, (x, y, z), strict=True):
        is_sure = is_sure and 0.995 < length < 1.005 and -0.005 < angle < 0.005 and -LARGEST < place < LARGEST
    return pose.copy() if is_sure else None


def view_matrix(source_pose: NDArray[np.float64], target_pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """The matrix that takes points from the source camera's axes into the target camera's."""
    return np.linalg.inv(target_pose) @ source_pose


def orbit_pose(
    pose: AnyArray | None, pivot: AnyArray, yaw: float = 0.0, pitch: float = 0.0, dolly: float = 0.0,
    upright: AnyArray | None = None,
) -> NDArray[np.float64]:  # fmt: skip
    """Return the pose after the camera moved round a point of the world, which stays where it is in the picture.

    Parameters
    ----------
    pose : (4, 4) float or None
        Camera-to-world before; None is the identity.
    pivot : (3,) float
        World point.
    yaw : float
        Degrees; above 0 the camera moves to its right and sees more of the object's right side.
    pitch : float
        Degrees; above 0 the camera moves up and looks down.
    dolly : float
        Share of the way to the pivot, below 1: 0.5 moves half the way, a negative one moves away.
    upright : (3,) float, optional
        World axis that yaw turns about, in either direction; None is the camera's own vertical.

    Returns
    -------
    (4, 4) float64
        Camera-to-world.

    Raises
    ------
    ValueError, TypeError
        For anything else.
    """
    yaw, pitch, dolly = check_turns(yaw, pitch, dolly)
    start = check_pose(pose)
    a, b = math.radians(yaw), math.radians(pitch)
    x, y, z = axis = down_axis(start, upright)
    across = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
    turn_y = math.cos(a) * np.eye(3) + (1 - math.cos(a)) * np.outer(axis, axis) + math.sin(a) * across
    turn_x = np.array([[1, 0, 0], [0, math.cos(b), math.sin(b)], [0, -math.sin(b), math.cos(b)]])
    target = np.array(check_point(pivot, "pivot"))
    seen = start[:3, :3].T @ (target - start[:3, 3])  # the pivot in the camera's own axes
    turn = turn_y @ turn_x
    result = np.eye(4)
    result[:3, :3] = start[:3, :3] @ turn
    result[:3, 3] = start[:3, 3] + start[:3, :3] @ (seen - (1 - dolly) * (turn @ seen))
    return result


def check_turns(yaw: float, pitch: float, dolly: float) -> tuple[float, float, float]:
    """The three as floats. Raises ValueError unless they are finite and dolly below 1, TypeError without numbers."""
    if type(yaw) is type(pitch) is type(dolly) is float and yaw == pitch == dolly == 0:
        return yaw, pitch, dolly
    complaint = f"{option('yaw')} and {option('pitch')} must be finite and {option('dolly')} below 1"
    dolly = check_float(dolly, complaint, high=math.nextafter(1, 0))
    return check_float(yaw, complaint), check_float(pitch, complaint), dolly


def down_axis(pose: NDArray[np.float64], upright: AnyArray | None) -> NDArray[np.float64]:
    """The vertical as a camera sees it, (3,) in its axes, pointing down its picture."""
    if upright is None:
        return np.array([0.0, 1.0, 0.0])
    vertical = np.array(check_point(upright, "upright"))
    if not vertical.any():
        raise ValueError("upright must not be (0, 0, 0): it is the axis that yaw turns round")
    axis = pose[:3, :3].T @ (vertical / np.abs(vertical).max())
    return axis / (np.linalg.norm(axis) * (1 if axis[1] >= 0 else -1))


Matrices = NDArray[np.float64]  # (n, 4, 4)

OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])  # y up and z backwards, to ours and back
# What others call right, down and ahead: matrices from OpenCV's axes to theirs.
AXES = {
    "opencv": np.eye(4),
    "opengl": OPENGL,
    "north, east, down": np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]),  # AirSim, TartanAir
    "forward, left, up": np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]]),  # ROS bodies
}


def from_matrices(rows: NDArray[np.float64]) -> Matrices:
    """(n, 4, 4) from rows of 12 or 16 numbers."""
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, : rows.shape[1] // 4] = rows.reshape(len(rows), -1, 4)
    return poses


@np.errstate(invalid="ignore", over="ignore", divide="ignore")  # (0, 0, 0, 0) becomes NaN, which the check refuses
def from_quaternions(places: NDArray[np.float64], turns: NDArray[np.float64]) -> Matrices:
    """(n, 4, 4) from (n, 3) x y z and (n, 4) qx qy qz qw of any length."""
    poses = np.tile(np.eye(4), (len(places), 1, 1))
    poses[:, :3, :3] = rotation_of(turns / np.linalg.norm(turns, axis=1, keepdims=True))
    poses[:, :3, 3] = places
    return poses


@np.errstate(invalid="ignore", over="ignore")
def inverted(poses: Matrices) -> Matrices:
    """(n, 4, 4) of rigid poses the other way round; those that are not finite become NaN."""
    turns = poses[:, :3, :3].transpose(0, 2, 1)
    result = np.tile(np.eye(4), (len(poses), 1, 1))
    result[:, :3, :3] = turns
    result[:, :3, 3] = -np.einsum("nij,nj->ni", turns, poses[:, :3, 3])
    return result
