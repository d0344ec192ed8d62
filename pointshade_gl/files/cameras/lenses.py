"""Lenses that are no pinholes: where they show a ray, and pictures brought to the pinhole that shows the same."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import option
from ...scene.camera import Camera
from ...scene.values import median

Projection = Literal["pinhole", "lens", "fisheye", "equirectangular"]
PROJECTIONS: tuple[Projection, ...] = get_args(Projection)
PANORAMA, UNKNOWN = "equirectangular", "unknown"  # curves without a formula: six pinholes take one, nothing the other
WIDEST = 120.0  # degrees that a pinhole keeps across and down: at its edge a pixel is four times as fine already
_ANGLES = 8192  # of the table by which a radius becomes an angle: it is right to 1e-7
_SOLVED = 1e-9  # of the focal length
_BORDER = 65  # places along each side of a picture
_ROWS = 256  # of a picture that is resampled at once

Array = NDArray[np.float64]


def _division(a: Array, z: Array, k: float) -> Array:
    r = a / z  # of r = d / (1 + k d^2) the smaller d
    return 2 * r / (1 + np.sqrt(1 - 4 * k * r * r))


# How far from the middle a ray lands, by the sine and the cosine of its angle with the axis, and the model's numbers.
_CURVES: dict[str, Any] = {
    "pinhole": lambda a, z: a / z,
    "equidistant": lambda a, z: np.arctan2(a, z),
    "fov": lambda a, z, w: np.arctan(2 * a / z * math.tan(w / 2)) / w,
    "division": _division,
    "sphere": lambda a, z, xi: a / (z + xi),
    "eucm": lambda a, z, alpha, beta: a / (alpha * np.sqrt(beta * a * a + z * z) + (1 - alpha) * z),
    "double sphere": lambda a, z, xi, alpha: a / (alpha * np.sqrt(a * a + (xi + z) ** 2) + (1 - alpha) * (xi + z)),
}
_IN_FRONT = "pinhole", "fov", "division"  # these show nothing beyond 90 degrees


@dataclass(frozen=True)
class Lens:
    """How a lens bends rays: by a curve from angles to radii, then by a polynomial.

    A radius r is multiplied by (1 + k1 r^2 + k2 r^4 + ...) / (1 + k4 r^2 + ...), then come two tangential numbers and
    four of a thin prism, all as in OpenCV.
    """

    title: str  # for messages
    curve: str = "pinhole"  # one of _CURVES, PANORAMA or UNKNOWN
    shape: tuple[float, ...] = ()  # the numbers of the curve
    radial: tuple[float, ...] = ()
    divisor: tuple[float, ...] = ()
    tangential: tuple[float, float] = (0.0, 0.0)
    prism: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    # what the tangential numbers and the prism act on: the point "before" the radial ones, the point "after" them, or
    # that with the radius from before ("between"); "inverse": the polynomial leads from the picture to the ray
    order: Literal["before", "after", "between", "inverse"] = "before"
    first: tuple[float, ...] = ()  # the first numbers as the file lists them: a fisheye's, if the caller says so

    @property
    def is_pinhole(self) -> bool:
        return self.curve == "pinhole" and not any((*self.radial, *self.divisor, *self.tangential, *self.prism))

    @property
    def reach(self) -> float:
        """Return the largest angle with the axis, in radians, up to which no two rays land on one place."""
        return float(self._table[0][-1])

    @cached_property
    def _table(self) -> tuple[Array, Array]:
        """Angles, and the radii at which they land without the parts that are not radial."""
        angles = np.linspace(0, np.pi, _ANGLES + 1)
        radial = replace(self, tangential=(0.0, 0.0), prism=(0.0, 0.0, 0.0, 0.0))
        radii = radial._polynomial(self._radius(angles), np.zeros_like(angles))[0]
        falls = ~(np.diff(radii) > 0)  # also where it is not a number
        end = 1 + (int(falls.argmax()) if falls.any() else len(falls))
        return angles[:end], radii[:end]

    @np.errstate(all="ignore")
    def _radius(self, angles: Array) -> Array:
        radius = _CURVES[self.curve](np.sin(angles), np.cos(angles), *self.shape)
        return np.where(angles < np.pi / 2, radius, np.nan) if self.curve in _IN_FRONT else radius

    @np.errstate(all="ignore")
    def bent(self, x: Any, y: Any, z: Any) -> tuple[Array, Array]:
        """Return where rays land, at a focal length of 1; NaN for those that the lens does not show."""
        away = np.hypot(x, y)
        angles = np.arctan2(away, z)
        share = np.where(away > 0, self._radius(angles) / away, 0)
        share = np.where(angles <= self.reach, share, np.nan)
        return self._polynomial(x * share, y * share)

    @np.errstate(all="ignore")
    def _polynomial(self, x: Array, y: Array) -> tuple[Array, Array]:
        if self.order != "inverse":
            return self._forth(x, y)
        u, v = x, y
        for _ in range(50):  # Newton's steps, by the radial part alone
            a, b = self._forth(u, v)
            a, b, r2 = x - a, y - b, u * u + v * v
            factor = self._factor(r2)
            slope = 2e6 * (self._factor(r2 + 1e-6) - factor)
            along = slope * (u * a + v * b) / (factor + slope * r2)
            u, v = u + (a - along * u) / factor, v + (b - along * v) / factor
            if not (np.fmax(abs(a), abs(b)) > _SOLVED).any():
                break
        a, b = self._forth(u, v)
        good = (abs(a - x) <= _SOLVED) & (abs(b - y) <= _SOLVED)
        return np.where(good, u, np.nan), np.where(good, v, np.nan)

    def _factor(self, r2: Array) -> Array:
        return _series(self.radial, r2) / _series(self.divisor, r2)

    def _forth(self, x: Array, y: Array) -> tuple[Array, Array]:
        r2 = x * x + y * y
        factor = self._factor(r2)
        far_x, far_y = x * factor, y * factor
        if self.order in ("after", "between"):
            x, y = far_x, far_y
            r2 = x * x + y * y if self.order == "after" else r2
        (p1, p2), (s1, s2, s3, s4) = self.tangential, self.prism
        if any((p1, p2, *self.prism)):
            far_x = far_x + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + (s1 + s2 * r2) * r2
            far_y = far_y + 2 * p2 * x * y + p1 * (r2 + 2 * y * y) + (s3 + s4 * r2) * r2
        return far_x, far_y

    @np.errstate(all="ignore")
    def ray_of(self, u: Any, v: Any) -> tuple[Array, Array, Array]:
        """Return the unit rays that land at places, at a focal length of 1; NaN where none does."""
        angles, radii = self._table
        u, v = np.broadcast_arrays(np.asarray(u, float), np.asarray(v, float))
        if self.order == "inverse":
            x, y = self._forth(u, v)
            z = np.where(np.hypot(u, v) <= radii[-1], 1 / np.sqrt(1 + x * x + y * y), np.nan)
            return x * z, y * z, z

        def radial(a: Array, b: Array) -> tuple[Array, Array, Array]:
            radius = np.hypot(a, b)
            angle = np.interp(radius, radii, angles, right=np.nan)
            share = np.where(radius > 0, np.sin(angle) / radius, 0)
            return a * share, b * share, np.cos(angle)

        found, a, b = radial(u, v), u, v
        for _ in range(30 if any((*self.tangential, *self.prism)) else 0):
            again = self.bent(*found)
            a, b = a + u - again[0], b + v - again[1]
            found = radial(a, b)
            if not (np.fmax(abs(u - again[0]), abs(v - again[1])) > _SOLVED).any():
                break
        return found

    def check_known(self, name: str) -> None:
        """Raise ValueError, with the name of its file, for a model whose rays are not known."""
        if self.curve == PANORAMA:
            raise ValueError(f"{name} is a panorama's camera, whose pictures must be twice as wide as high")
        if self.curve == UNKNOWN:
            way_out = f"{option('projection', 'pinhole')}, with {option('intrinsics', 'fx,fy,cx,cy')}"
            fix = f"bring the pictures to a pinhole with the program that made them, then pass {way_out}"
            raise ValueError(f"{name} has a camera model that is not known here, {self.title}: {fix}")

    def turned(self, clockwise: bool) -> Lens:
        """Return the lens of a picture that was turned by 90 degrees."""
        (p1, p2), (s1, s2, s3, s4) = self.tangential, self.prism
        if clockwise:  # x becomes y, y becomes -x
            return replace(self, tangential=(p2, -p1), prism=(-s3, -s4, s1, s2))
        return replace(self, tangential=(-p2, p1), prism=(s3, s4, -s1, -s2))

    def as_fisheye(self) -> Lens:
        """Return what its numbers mean of a fisheye, as OpenCV's: Kannala and Brandt's four."""
        return self if self.curve == "equidistant" else fisheye(self.first[:4])


def fisheye(numbers: Sequence[float]) -> Lens:
    """Return Kannala and Brandt's lens: angle times (1 + k1 angle^2 + k2 angle^4 ...)."""
    return Lens("Kannala-Brandt fisheye", "equidistant", radial=tuple(numbers), first=tuple(numbers))


def _series(numbers: Sequence[float], r2: Array) -> Array:
    """1 + a r^2 + b r^4 + ..."""
    total = np.zeros_like(r2)
    for number in reversed(numbers):
        total = (total + number) * r2
    return 1 + total


@lru_cache(16)
def pinhole_of(lens: Lens, camera: Camera) -> Camera:
    """Return the pinhole that has the lens's scale in the middle and holds what it shows, up to WIDEST.

    camera  focal lengths, principal point and size of the lens's picture

    Raises ValueError for a lens that shows nothing of its picture.
    """
    scale = lens.bent(1e-5, 0.0, 1.0)[0] - lens.bent(0.0, 0.0, 1.0)[0]
    fx, fy = (float(focal * scale / 1e-5) for focal in (camera.fx, camera.fy))
    x, y, z = _outline(lens, camera)
    if not np.isfinite(x).any() or not fx > 0:
        raise ValueError(f"the lens ({lens.title}) shows no part of its picture: are its numbers right?")
    limit = math.tan(math.radians(WIDEST) / 2)
    front = np.maximum(z, 1e-9)
    sides = [(max(-limit, np.nanmin(part / front)), min(limit, np.nanmax(part / front))) for part in (x, y)]
    (left, right), rows = (np.multiply(focal, ends) for focal, ends in zip((fx, fy), sides, strict=True))
    top, bottom = min(rows), max(rows)  # fy may be negative
    width, height = (max(1, math.floor(size + 0.25)) for size in (right - left, bottom - top))
    return Camera(fx, fy, float(-0.5 - left), float(-0.5 - top), width, height)


def _outline(lens: Lens, camera: Camera) -> tuple[Array, Array, Array]:
    """The unit rays along the border of what a lens shows: of its picture, and where it ends inside of that."""
    across, down = (np.linspace(-0.5, size - 0.5, _BORDER) for size in (camera.width, camera.height))
    u = np.concatenate([across, across, np.full(_BORDER, across[0]), np.full(_BORDER, across[-1])])
    v = np.concatenate([np.full(_BORDER, down[0]), np.full(_BORDER, down[-1]), down, down])
    found = lens.ray_of(*camera.ray_at(u, v))
    turn, reach = np.linspace(0, 2 * np.pi, 4 * _BORDER), lens.reach * (1 - 1e-9)
    ends = np.stack([np.sin(reach) * np.cos(turn), np.sin(reach) * np.sin(turn), np.full(turn.size, np.cos(reach))])
    column, row = camera.pixel_at(*lens.bent(*ends), 1)
    shown = (abs(column - across.mean()) <= camera.width / 2) & (abs(row - down.mean()) <= camera.height / 2)
    x, y, z = np.concatenate([found, ends[:, shown]], axis=1)
    return x, y, z


def field_of(lens: Lens, camera: Camera) -> tuple[float, float]:
    """Return how many degrees a lens's picture shows across and down, through its middle."""
    ends = np.array([-0.5, camera.width - 0.5]), np.array([-0.5, camera.height - 0.5])
    x, y = camera.ray_at(*ends)
    rays = lens.ray_of(x, np.zeros(2)), lens.ray_of(np.zeros(2), y)
    across, down = (np.degrees(np.nan_to_num(np.arctan2(np.hypot(a, b), z), nan=lens.reach)).sum() for a, b, z in rays)
    return float(across), float(down)


_ACROSS, _POINTS = 5, 12  # windows along the shorter side, and points of one along its side
_FLAT = 0.003  # of 1/z: no plane is farther off
_CLEARLY = 1.4  # times as flat is the better reading
_FEWEST, _SHARE = 12, 0.8  # windows that tell the two apart, and how many of them must agree


@np.errstate(all="ignore")
def is_straight(depth: NDArray[Any], lens: Lens, camera: Camera, kinds: Sequence[str]) -> bool:
    """Return whether the planes in depth (h, w), 0 where unknown, are flat only without the lens. kinds: what the depth
    may be: "z", "ray" or both."""
    step = max(1, min(depth.shape) // _ACROSS // _POINTS)
    v, u = np.mgrid[0 : depth.shape[0] : step, 0 : depth.shape[1] : step]
    if min(u.shape) < _POINTS:
        return False
    inverse, places = np.where(depth > 0, 1 / depth, np.nan)[::step, ::step], camera.ray_at(u, v)
    rays = [(*places, np.sqrt(1 + places[0] ** 2 + places[1] ** 2))]
    x, y, z = lens.ray_of(*places)
    rays.append((x / z, y / z, 1 / z))
    as_it_is, through_lens = (
        min((_off_plane(inverse * (far if kind == "ray" else 1), x, y) for kind in kinds), key=_middle)
        for x, y, far in rays
    )
    flat = np.fmin(as_it_is, through_lens) < _FLAT
    straight = int(np.count_nonzero(flat & (through_lens > _CLEARLY * as_it_is)))
    bent = int(np.count_nonzero(flat & (as_it_is > _CLEARLY * through_lens)))
    return straight >= _FEWEST and straight > _SHARE * (straight + bent)


def _middle(values: Array) -> float:
    known = values[np.isfinite(values)]
    return median(known) if known.size else math.inf


def _off_plane(values: Array, x: Array, y: Array) -> Array:
    """How far values (h, w) lie off a linear function of their places in each window, over their mean; or NaN."""
    windows = (np.lib.stride_tricks.sliding_window_view(one, (_POINTS, _POINTS)) for one in (values, x, y))
    values, x, y = (one[:: _POINTS // 4, :: _POINTS // 4].reshape(-1, _POINTS**2) for one in windows)
    rest, x, y = (one - one.mean(1, keepdims=True) for one in (values, x, y))
    y = y - x * ((x * y).sum(1) / (x * x).sum(1))[:, None]
    for axis in (x, y):
        rest = rest - axis * ((axis * rest).sum(1) / (axis * axis).sum(1))[:, None]
    return np.sqrt(np.square(rest).mean(1)) / abs(values.mean(1))


def straighten(
    lens: Lens, depth: NDArray[Any], colors: NDArray[Any] | None, camera: Camera, name: str, note: Note
) -> tuple[NDArray[np.float32], NDArray[Any] | None, Camera]:
    """Return depth, colours and camera of the pinhole that shows what a lens showed, and note how much of it. camera:
    of the depth as the lens shows it."""
    try:
        pinhole = pinhole_of(lens, camera)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    whole, held = field_of(lens, camera), field_of(Lens(""), pinhole)
    kept, whole = (" x ".join(f"{part:.0f}" for part in field) for field in (map(min, whole, held), whole))
    kept = f"all {whole} degrees" if kept == whole else f"{kept} of {whole} degrees"
    what = f"the pictures become those of a pinhole, {pinhole.width}x{pinhole.height}, and keep {kept}"
    way_out = option("projection", "pinhole")
    note(f"{name} has a lens ({lens.title}): {what}; pass {way_out} if they are straight already")
    if colors is not None:
        height, width = colors.shape[:2]
        larger = width / camera.width, height / camera.height
        width_kept, height_kept = (
            max(1, round(side * times)) for side, times in zip((pinhole.width, pinhole.height), larger, strict=True)
        )
        places = places_of_rays(lens, camera.resized(width, height), pinhole.resized(width_kept, height_kept))
        colors = colors_at(colors, *places)
    return depth_at(depth, *places_of_rays(lens, camera, pinhole)), colors, pinhole


@lru_cache(4)
def places_of_rays(lens: Lens, camera: Camera, pinhole: Camera) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the column and the row, (h, w), at which a lens shows each pixel of a pinhole; NaN where it does not."""
    columns, rows = (np.empty((pinhole.height, pinhole.width), np.float32) for _ in range(2))
    for first in range(0, pinhole.height, _ROWS):
        band = np.s_[first : first + _ROWS]
        x, y = pinhole.ray_at(*np.meshgrid(np.arange(pinhole.width), np.arange(pinhole.height)[band]))
        columns[band], rows[band] = camera.pixel_at(*lens.bent(x, y, 1.0), 1)
    lost = ~(abs(columns - (camera.width - 1) / 2) <= camera.width / 2)
    lost |= ~(abs(rows - (camera.height - 1) / 2) <= camera.height / 2)
    columns[lost] = rows[lost] = np.nan
    return columns, rows


def colors_at(color: NDArray[np.uint8], columns: NDArray[Any], rows: NDArray[Any]) -> NDArray[np.uint8]:
    """Return the colours at places between pixels, interpolated; 0 where a place is NaN."""
    height, width = color.shape[:2]
    found = np.zeros((*columns.shape, color.shape[2]), np.uint8)
    for first in range(0, len(columns), _ROWS):
        band = np.s_[first : first + _ROWS]
        known = np.isfinite(columns[band])
        u, v = (np.where(known, part[band], 0).clip(0, most - 1) for part, most in ((columns, width), (rows, height)))
        left, top = u.astype(np.intp).clip(max=max(0, width - 2)), v.astype(np.intp).clip(max=max(0, height - 2))
        right, under = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
        a, b = (u - left)[..., None].astype(np.float32), (v - top)[..., None].astype(np.float32)
        upper = color[top, left] * (1 - a) + color[top, right] * a
        lower = color[under, left] * (1 - a) + color[under, right] * a
        found[band] = np.where(known[..., None], np.rint(upper * (1 - b) + lower * b), 0)
    return found


@np.errstate(all="ignore")
def depth_at(depth: NDArray[Any], columns: NDArray[Any], rows: NDArray[Any]) -> NDArray[np.float32]:
    """Return the depth at places between pixels: of the nearest pixel, carried on along its own surface.

    Depths of two surfaces are never mixed: 1/z of a pixel is continued by the slope that its neighbours on one side
    agree on. 0 is missing, as where a place is NaN.
    """
    inverse = np.where(depth > 0, 1 / depth, np.nan)
    across, down = _slopes(inverse.T).T, _slopes(inverse)
    known = np.isfinite(columns)
    u, v = (np.where(known, part, 0) for part in (columns, rows))
    at = np.rint(v).astype(np.intp).clip(0, len(depth) - 1), np.rint(u).astype(np.intp).clip(0, depth.shape[1] - 1)
    carried = inverse[at] + across[at] * (u - at[1]) + down[at] * (v - at[0])
    near = np.where(carried > 0, carried, inverse[at])
    return np.where(known & np.isfinite(near), 1 / near, 0).astype(np.float32)


def _slopes(values: NDArray[Any]) -> NDArray[Any]:
    """How values change from row to row along the surface that each lies on; 0 where neighbours do not show it."""
    count = len(values)
    steps = np.pad(np.diff(values, axis=0), ((2, 2), (0, 0)), constant_values=np.nan)
    before, after = steps[1 : count + 1], steps[2 : count + 2]
    bend_before, bend_after = abs(before - steps[:count]), abs(after - steps[3 : count + 3])
    is_before, is_after = 2 * bend_before <= abs(before), 2 * bend_after <= abs(after)  # false where not a number
    smaller = np.where(abs(before) < abs(after), before, after)
    either = np.where(before * after > 0, smaller, 0)
    both = np.where(3 * bend_before < bend_after, before, np.where(3 * bend_after < bend_before, after, either))
    found = np.where(is_before & is_after, both, np.where(is_before, before, np.where(is_after, after, either)))
    return np.nan_to_num(found, nan=0.0)
