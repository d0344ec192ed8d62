"""Trained Gaussian splats: what each point of a cloud is beside its place, as immutable values."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import check_flag
from ..checks.foreign_arrays import Numbers
from ..notes.words import counted
from .values import Value, floats_of, frozen

FAINT = 1 / 255  # opacity below which one shows nothing
CONSTANT = 0.28209479177387814  # the harmonic of degree 0
DEGREES = {3: 1, 8: 2, 15: 3}  # by the number of harmonics above degree 0
AT_A_TIME = 1 << 16  # rows: parts of arrays that stay in the processor's memory
_OPAQUE = 0.4  # opacity from which one may be drawn as a disc
_RADIUS = 2.0  # deviations: a disc that fades as (1 - r^2)^2 is nearest to a Gaussian of half its radius
_FLAT = 0.4  # of the middle axis is the shortest one of a disc
_GIANT = 0.99, 4.0  # quantile of the radii, and how many times that is too large: fog
_SEED = 60


@dataclass(frozen=True, eq=False)
class Gaussians(Value):
    """What trained splats are beside their positions, one row for each point of a `PointCloud` (Kerbl et al. 2023).

    Parameters
    ----------
    scales : (n, 3) float32
        Standard deviations along the three axes, world units.
    rotations : (n, 4) float32
        Quaternions x, y, z, w of the axes, of any length.
    opacities : (n,) float32
        0 to 1, in the middle of each.
    base : (n, 3) float32
        Colour of degree 0, sRGB from 0 to 1, or beyond where higher degrees lead back.
    harmonics : (n, 3 | 8 | 15, 3) float32, optional
        Spherical harmonics of degree 1 to 1, 2 or 3, by which the colour changes with the direction of view.
    antialiased : bool
        Whether the training kept the light of a splat that is smaller than a pixel (Mip-Splatting: Yu et al. 2024).

    Raises
    ------
    TypeError, ValueError
        For arrays of the wrong kind or shape, and for numbers that are not finite or out of range.
    """

    scales: NDArray[np.float32]
    rotations: NDArray[np.float32]
    opacities: NDArray[np.float32]
    base: NDArray[np.float32]
    harmonics: NDArray[np.floating[Any]] | None = None
    antialiased: bool = False

    if TYPE_CHECKING:  # what may be passed is more than what is kept

        def __init__(
            self, scales: Numbers, rotations: Numbers, opacities: Numbers, base: Numbers,
            harmonics: Numbers | None = None, antialiased: bool = False,
        ) -> None: ...  # fmt: skip

    def __post_init__(self) -> None:
        self._set("opacities", floats_of(self.opacities, "opacities", (None,), np.float32))
        for name, width in (("scales", 3), ("rotations", 4), ("base", 3)):
            self._set(name, floats_of(getattr(self, name), name, (len(self), width), np.float32))
        for name, most in (("opacities", 1.0), ("scales", np.inf)):
            values = getattr(self, name)
            if values.size and not (values.min() >= 0 and values.max() <= most):
                least, largest = values.min(), values.max()
                limits = "from 0 to 1" if most == 1 else "at least 0"
                raise ValueError(f"{name} must be {limits}, got {least:g} to {largest:g}")
        if self.harmonics is not None:
            given = np.asarray(self.harmonics)
            kind = np.float16 if given.dtype == np.float16 else np.float32
            values = floats_of(self.harmonics, "harmonics", (len(self), None, 3), kind)
            if values.shape[1] not in DEGREES:
                raise ValueError(f"harmonics must be 3, 8 or 15 for each point, got {values.shape[1]}")
            self._set("harmonics", values)
        check_flag(self.antialiased, "antialiased")

    def _set(self, name: str, array: NDArray[Any]) -> None:
        object.__setattr__(self, name, frozen(array))

    def __len__(self) -> int:
        return len(self.opacities)

    def __repr__(self) -> str:
        return f"Gaussians({counted(len(self), 'splat')}, degree {self.degree})"

    @property
    def degree(self) -> int:
        """Return the degree of the harmonics, 0 to 3."""
        return 0 if self.harmonics is None else DEGREES[self.harmonics.shape[1]]

    def select(self, rows: NDArray[Any]) -> Gaussians:
        """Return these rows only.

        Parameters
        ----------
        rows : (m,) int or (n,) bool
            Their numbers, or a mask.
        """
        arrays = {one.name: getattr(self, one.name) for one in fields(self)}
        return replace(self, **{k: v[rows] for k, v in arrays.items() if isinstance(v, np.ndarray)})

    @cached_property
    def covariances(self) -> NDArray[np.float32]:
        """Return (6, n): xx, xy, xz, yy, yz, zz, node axes squared."""
        found = np.empty((6, len(self)), np.float32)
        for first in range(0, len(self), AT_A_TIME):
            part = slice(first, first + AT_A_TIME)
            scales = np.ascontiguousarray(self.scales[part].T)
            arms = [[own * scale for own, scale in zip(row, scales, strict=True)] for row in self._rows(part)]
            pairs = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
            for k, (i, j) in enumerate(pairs):
                (a, b, c), (d, e, f) = arms[i], arms[j]
                found[k, part] = a * d + b * e + c * f
        return frozen(found)

    def _rows(self, rows: Any) -> list[list[NDArray[Any]]]:
        """Return the three rows of the rotations, of three (m,) each; a turn of length 0 is none."""
        x, y, z, w = np.ascontiguousarray(self.rotations[rows].T)
        square = x * x + y * y + z * z + w * w
        two = 2 / np.where(square > 0, square, np.float32(1))
        xx, yy, zz, xy, xz, yz = (two * one * other for one, other in ((x, x), (y, y), (z, z), (x, y), (x, z), (y, z)))
        wx, wy, wz = (two * w * one for one in (x, y, z))
        return [[1 - yy - zz, xy - wz, xz + wy], [xy + wz, 1 - xx - zz, yz - wx], [xz - wy, yz + wx, 1 - xx - yy]]

    def _axes(self, rows: Any) -> NDArray[Any]:
        """Return (m, 3, 3), an axis a column."""
        return np.stack([np.stack(row, -1) for row in self._rows(rows)], -2)

    @property
    def colors(self) -> NDArray[np.uint8]:
        """Return (n, 3) sRGB of degree 0."""
        return np.rint(255 * self.base.clip(0, 1)).astype(np.uint8)

    @cached_property
    def median_length(self) -> float:
        """Return the median of the longest deviations, node units."""
        some = self.scales[:: -(-len(self) // AT_A_TIME) or 1]
        return float(np.median(some.max(1))) if len(some) else 0.0

    def as_discs(self) -> tuple[NDArray[np.integer], NDArray[np.float32], NDArray[np.float32]]:
        """Return which rows can be drawn as opaque discs, and their normals and radii.

        Faint ones are left out, and giants, which are fog. Normals of those that are not flat are 0.
        """
        kept = np.flatnonzero(self.opacities >= _OPAQUE)
        radii = _RADIUS * np.sort(self.scales[kept], 1)[:, 1]
        if len(kept):
            quantile, times = _GIANT
            is_small = radii <= times * np.quantile(radii, quantile)
            kept, radii = kept[is_small], radii[is_small]
        ordered = np.sort(self.scales[kept], 1)
        shortest = self._axes(kept)[np.arange(len(kept)), :, self.scales[kept].argmin(1)]
        is_flat = ordered[:, 0] < _FLAT * ordered[:, 1]
        return kept, np.where(is_flat[:, None], shortest, 0).astype(np.float32), radii

    def turned(self, turn: NDArray[np.float64]) -> Gaussians:
        """Return the same in other axes.

        Parameters
        ----------
        turn : (3, 3) float
            The rotation from these axes to the others.
        """
        from .camera import quaternion_of  # only here

        x, y, z, w = quaternion_of(turn)
        by = np.array([[w, -z, y, x], [z, w, -x, y], [-y, x, w, z], [-x, -y, -z, w]])  # a product of quaternions
        changed: dict[str, Any] = {"rotations": self.rotations @ by.T.astype(np.float32)}
        if self.harmonics is not None:
            ways = np.random.default_rng(_SEED).normal(size=(3, 64))
            ways /= np.linalg.norm(ways, axis=0)
            before, after = (harmonics_at(self.degree, one).T for one in (turn.T @ ways, ways))
            mix = np.linalg.lstsq(after, before, rcond=None)[0].astype(np.float32)
            changed["harmonics"] = np.einsum("ij,njc->nic", mix, self.harmonics.astype(np.float32))
        return replace(self, **changed)


def harmonics_at(degree: int, way: NDArray[Any]) -> NDArray[Any]:
    """Return (3 | 8 | 15, n): the real spherical harmonics above degree 0 at unit directions (3, n)."""
    x, y, z = way
    found = [-0.4886025119 * y, 0.4886025119 * z, -0.4886025119 * x]
    if degree > 1:
        xx, yy, zz = x * x, y * y, z * z
        found += [
            1.0925484306 * x * y, -1.0925484306 * y * z, 0.3153915653 * (2 * zz - xx - yy), -1.0925484306 * x * z,
            0.5462742153 * (xx - yy),
        ]  # fmt: skip
        if degree > 2:
            found += [
                -0.5900435899 * y * (3 * xx - yy), 2.8906114426 * x * y * z, -0.4570457995 * y * (4 * zz - xx - yy),
                0.3731763326 * z * (2 * zz - 3 * xx - 3 * yy), -0.4570457995 * x * (4 * zz - xx - yy),
                1.4453057213 * z * (xx - yy), -0.5900435899 * x * (xx - 3 * yy),
            ]  # fmt: skip
    return np.stack(found)


MOST_ENTRIES = 65_535  # of a palette: labels have two bytes
EACH = 8  # splats for an entry, where it stands for those that are like it
LEAST_SIDE, MOST_SIDE, ROUNDS, TRIED = 32, 128, 4, 1 << 16


def palette_of(codes: NDArray[np.int64], is_exact: bool) -> tuple[NDArray[Any], NDArray[np.int64]]:
    """Return rows that stand for all, and which of them is each one's: all that differ if they are few, as in .sog
    files, else the middles of groups of groups (Lloyd 1982).

    is_exact: few are as many as two bytes count, else as many as the groups
    """
    rng = np.random.default_rng(1)
    keys = codes @ rng.integers(1, 1 << 62, len(codes.T))
    first, labels = np.unique(keys, return_index=True, return_inverse=True)[1:]
    side = int(np.clip(np.sqrt(len(codes) / EACH), LEAST_SIDE, MOST_SIDE))
    if len(first) <= (MOST_ENTRIES if is_exact else side * side):
        return codes[first], labels
    rows = codes.astype(np.float32)
    found: list[NDArray[Any]] = []
    group = _nearest(rows, _middles(rows, side, rng))
    for k in range(side):
        own = np.flatnonzero(group == k)
        middles = _middles(rows[own], side, rng)
        labels[own] = sum(map(len, found)) + _nearest(rows[own], middles)
        found.append(middles)
    return np.rint(np.concatenate(found)), labels


def _middles(rows: NDArray[np.float32], count: int, rng: np.random.Generator) -> NDArray[np.float32]:
    some = rows[rng.permutation(len(rows))[:TRIED]]
    middles = some[:count]
    for _ in range(ROUNDS):
        near = _nearest(some, middles)
        sums = np.stack([np.bincount(near, column, len(middles)) for column in some.T], 1)
        counts = np.bincount(near, minlength=len(middles))[:, None]
        middles = np.where(counts > 0, sums / np.maximum(counts, 1), middles).astype(np.float32)
    return middles


def _nearest(rows: NDArray[np.float32], middles: NDArray[np.float32]) -> NDArray[np.int64]:
    squares = (middles**2).sum(1) / 2
    parts = [rows[k : k + 4096] for k in range(0, len(rows), 4096)]
    return np.concatenate([np.zeros(0, np.int64), *((squares - part @ middles.T).argmin(1) for part in parts)])
