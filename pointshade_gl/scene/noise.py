"""The noise of a depth image, given or measured, as a value and as text; and the names of normal estimators."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import ABOVE_0, LARGEST, as_array, check_choice, check_float
from ..checks.foreign_arrays import AnyArray, way_to
from ..notes.words import did_you_mean, option, shown

CLEAN = "clean"
GRAMMAR = (
    "'clean', or 1.5mm or 0.2%, and after it shared=2, steps=1mm or steps=0.0029/m, repeated=0.4, bumps=0.003/m, "
    "by commas"
)
_UNITS = {"mm": 1e-3, "m": 1.0, "%": 1e-2, "/m": 1.0, "": 1.0}
_ALLOWED = {"noise": ("mm", "m", "%"), "shared": ("",), "steps": ("mm", "m", "/m"), "repeated": ("",), "bumps": ("/m",)}


@dataclass(frozen=True)
class NoiseWords:
    """Noise that is the same for all of a frame. All zero: the depth is clean.

    level, is_share  standard deviation of depth: in metres, or as a share of the depth
    shared           noise that neighbours share, divided by noise that they do not share
    step, domain     rounding step, of depth in domain "z", of 1/depth in domain "1/z"; 0 and "" without one
    repeated         pixels (standard deviation) by which depths are displaced, as lines are repeated
    bumps            standard deviation of 1/depth about planes, where neighbours share noise over many pixels
    """

    level: float = 0.0
    is_share: bool = False
    shared: float = 0.0
    step: float = 0.0
    domain: str = ""
    repeated: float = 0.0
    bumps: float = 0.0

    def __str__(self) -> str:
        if not self.level:
            return CLEAN
        words = [f"{_short(100 * self.level)}%" if self.is_share else _length(self.level)]
        words += [f"shared={_short(self.shared)}"] if self.shared else []
        steps = _length(self.step) if self.domain == "z" else f"{_short(self.step)}/m"
        words += [f"steps={steps}"] if self.step else []
        words += [f"repeated={_short(self.repeated)}"] if self.repeated else []
        words += [f"bumps={_short(self.bumps)}/m"] if self.bumps else []
        return ",".join(words)


def noise_words(text: str) -> NoiseWords | None:
    """Parse a text; None if it does not describe noise. `noise_words(str(words))` is `words`, to three digits."""
    if text.strip() == CLEAN:
        return NoiseWords()
    found: dict[str, tuple[float, str]] = {}
    for k, word in enumerate(text.split(",")):
        match = re.fullmatch(r"\s*(?:(\w+)=)?((?:\d+(?:\.\d*)?|\.\d+)(?:e[-+]?\d+)?)(mm|m|%|/m|)\s*", word)
        if match is None or (k == 0) != (match[1] is None):
            return None
        name, unit = match[1] or "noise", match[3]
        if name in found or unit not in _ALLOWED.get(name, ()):
            return None
        number = float(match[2])
        if not 0 < number < math.inf:
            return None
        found[name] = number * _UNITS[unit], unit
    level, unit = found["noise"]
    step, step_unit = found.get("steps", (0.0, ""))
    domain = "" if not step else "1/z" if step_unit == "/m" else "z"
    shared, repeated, bumps = (found.get(name, (0.0, ""))[0] for name in ("shared", "repeated", "bumps"))
    return NoiseWords(level, unit == "%", shared, step, domain, repeated, bumps)


def _short(number: float) -> str:
    return f"{number:.3g}"


def _length(length: float) -> str:
    return f"{_short(length * 1e3)}mm" if length < 1 else f"{_short(length)}m"


# Standard deviation of depth by distance, metres. Kinect: Nguyen, Izadi, Lovell 2012.
SENSORS: dict[str, Callable[[NDArray[np.float32]], NDArray[np.float32]]] = {
    "kinect": lambda z: 0.0012 + 0.0019 * (z - 0.4) ** 2,
}
SHARED = 0.05  # correlation from which noise counts as shared
SMOOTHED = 0.6  # beyond it a sensor has smoothed its depth: rounding alone stays below .43, sensors are above 1
MOSTLY_STEP = 1.5  # noise in steps up to which rounding is most of it: 0.4 where errors are random, 1 on plateaus
FEW = 0.01  # share of noisy blocks up to which a frame counts as clean


@dataclass(frozen=True)
class Noise:
    """The noise that was measured on a frame; lengths in the unit of the depth.

    sigma, relative  median standard deviation of depth, and over depth
    step, domain     rounding step, of depth in domain "z", of 1/depth in domain "1/z"; 0 and "" if none was found
    correlation      noise that neighbours share, divided by noise that they do not share; median of the blocks
    misplaced        pixels (standard deviation) by which depths are displaced, because the picture was enlarged or
                     moved to another camera's pixels; 0 if it was not
    share            share of the blocks with so much noise that it tilts normals visibly
    grid, powers     per block sigma / z = max(grid[..., 0] * z**powers[0], grid[..., 1] * z**powers[1]), noise and
                     rounding; grid[..., 2] is the block's own correlation
    bumps            standard deviation of 1/z about wide planes, where the noise that neighbours share is wider than
                     fits of normals; 0 if planes show none
    """

    sigma: float
    relative: float
    step: float
    domain: str
    correlation: float
    misplaced: float
    share: float
    grid: NDArray[np.float32] | None
    powers: tuple[float, float]
    bumps: float = 0.0

    @property
    def is_clean(self) -> bool:
        """Return whether so few blocks are noisy that the edge-exact estimator serves the whole frame."""
        return self.share < FEW

    @property
    def is_shared(self) -> bool:
        """Return whether neighbours share some of the noise: then fits over neighbours do not remove it."""
        return self.grid is not None and bool(self.grid[..., 2].any())

    @property
    def is_rounded(self) -> bool:
        """Return whether rounding may be most of the noise. In more noise no surface lies within half a step of a
        plane.

        Where neighbours share noise, patches lie on planes of their own by chance: a sensor has smoothed it.
        """
        if self.correlation > SMOOTHED:
            return False
        if self.domain == "1/z" and self.sigma and self.relative:
            return self.relative**2 < MOSTLY_STEP * self.step * self.sigma
        return self.step > 0 and (self.domain == "1/z" or self.sigma < MOSTLY_STEP * self.step)

    @property
    def may_be_bumpy(self) -> bool:
        """Return whether the noise is a sensor's that smooths its depth or matches windows: it may leave bumps."""
        return self.step > 0 and (self.correlation > SMOOTHED or self.domain == "1/z")

    @property
    def rounding(self) -> tuple[float, float]:
        """Return the steps of depth and of 1 / depth: 0 where it is not rounded."""
        return (0.0, self.step) if self.domain == "1/z" else (self.step, 0.0)

    @property
    def words(self) -> NoiseWords:
        """Return the noise in words, one description for all of the frame."""
        if self.is_clean:
            return NoiseWords()
        is_share = self.powers[0] > -0.5 and self.domain != "z"
        level = self.relative if is_share else self.sigma
        shared = self.correlation if self.correlation >= SHARED else 0.0
        return NoiseWords(level, is_share, shared, self.step, self.domain, self.misplaced, self.bumps)


@dataclass(frozen=True)
class Choice:
    """Which method estimated the normals; for "auto" and "adaptive" the noise, and whether the caller has given it.

    missing    share of the depth that is missing, where that is why "auto" chose it
    completed  share of the frame's pixels that got a surface without a depth
    calm       are normals averaged with those around, for light?
    wrong      share of the frame whose depth is wrong over wide areas, where calm normals looked for it
    """

    method: str
    noise: Noise | None = None
    told: bool = False
    missing: float = 0.0
    completed: float = 0.0
    calm: bool = False
    wrong: float = 0.0


def describe(choice: Choice) -> str:
    """Describe in one sentence which method ran, and why, and how much was completed."""
    completed = f"; {100 * choice.completed:.2g} % of the pixels are completed" if choice.completed else ""
    calm = f"; for light, normals are averaged with those around: not so with {option('normals', 'adaptive')}"
    wrong = (
        f"; {describe_wrong(choice.wrong)}, which is lit like what surrounds it" if choice.wrong >= MUCH_WRONG else ""
    )
    return _describe_method(choice) + completed + (calm if choice.calm else "") + wrong


MUCH_WRONG = 0.01  # share of wrong depth that is worth a word


def describe_wrong(share: float) -> str:
    """Describe how much depth is wrong; whether that is worth a word is for the caller to say."""
    return f"depth seems wrong over {100 * share:.0f} % of the picture"


def _describe_method(choice: Choice) -> str:
    noise = choice.noise
    if choice.missing:
        found = f"{100 * choice.missing:.0f} % of the depth is missing, known pixels lie apart"
        return f"{choice.method}: {found}; no noise was measured"
    if noise is None:
        return f"{choice.method}: as requested"
    if choice.told:
        found = f"{option('noise')} was given"
    elif noise.is_clean:
        found = f"the depth is clean (noise below {max(noise.relative, 1e-7):.0e} of the depth)"
    else:
        found = f"noise of {_metres(noise.sigma)} ({100 * noise.relative:.2g} % of the depth)"
        found += f" on {100 * noise.share:.0f} % of the picture"
    if noise.step:
        unit = _metres(noise.step) if noise.domain == "z" else f"{noise.step:.3g} in 1/z"
        found += f", depth rounded to steps of {unit}"
    if noise.misplaced:
        found += ", lines are repeated"
    if noise.correlation:
        found += ", neighbours share part of the noise"
    if noise.bumps:
        found += f", bumps of {noise.bumps:.3g} in 1/z on planes"
    return f"{choice.method}: {found}" + ("" if choice.told else f" ({option('noise', str(noise.words))})")


def _metres(length: float) -> str:
    return f"{length * 1e3:.3g} mm" if length < 1 else f"{length:.3g} m"


def check_sensor(name: str) -> str:
    """The sensor's name. Raises ValueError, listing the known ones, for any other."""
    if name not in SENSORS:
        known, near = ", ".join(SENSORS), did_you_mean(name, SENSORS)
        unknown = f"unknown sensor {shown(name)} for {option('noise')}{near}"
        raise ValueError(f"{unknown}: known are {known}; or pass metres, or {GRAMMAR}")
    return name


def check_noise_text(text: str) -> str:
    """A sensor's name, or noise in words. Raises ValueError for anything else."""
    return text if noise_words(text) else check_sensor(text)


def check_noise(noise: Any) -> float:
    """Return one standard deviation for all of a frame. Raises ValueError unless it is metres above 0."""
    return check_float(noise, f"{option('noise')} must be metres above 0", ABOVE_0)


def parse_noise(
    noise: float | AnyArray | str | None, depth: NDArray[np.float32]
) -> NDArray[np.float32] | NoiseWords | None:
    """Return the caller's standard deviation of depth, (1, 1) or (h, w) float32 metres; or in words; None if there is
    none.

    noise  a number or (h, w) in metres, the name of a sensor, or words. Raises ValueError for impossible noise.
    """
    if noise is None:
        return None
    if isinstance(noise, str):
        words = noise_words(noise)
        return SENSORS[check_sensor(noise)](depth).astype(np.float32) if words is None else words
    complaint = f"noise must be one number or have the depth's shape {depth.shape}"
    array = as_array(noise, complaint, np.float32)
    if array.shape not in ((), depth.shape):
        raise ValueError(f"{complaint}, got {array.shape}")
    array = array.reshape(array.shape or (1, 1))
    wrong = ~((array > 0) & (array < np.inf))
    if array.shape == depth.shape:
        wrong &= depth > 0  # missing depth has no noise
    if wrong.any():
        raise ValueError(f"{option('noise')} must be metres above 0 wherever depth is known, got {array[wrong][0]:g}")
    return np.where(array > 0, array, 1).astype(np.float32)


TRIANGLES = {"triangles-1": 1, "triangles-2": 2, "triangles-4": 4, "triangles-8": 8}
PLANE_FITS = {f"plane-fit-{window}": window for window in range(3, 14, 2)}
SPARSE_LEVELS = 6  # "sparse" looks at cells of up to 2**6 pixels
SPARSE_TILTS = (0.02, 0.08, 0.32)  # radians of error: the first that some cells reach is good enough
Method = Literal[
    "auto", "adaptive", "star", "star-borrow", "sparse", "triangles-1", "triangles-2", "triangles-4", "triangles-8",
    "central", "one-sided", "plane-fit-3", "plane-fit-5", "plane-fit-7", "plane-fit-9", "plane-fit-11", "plane-fit-13",
]  # fmt: skip
METHODS: tuple[Method, ...] = get_args(Method)
Step = tuple[float, float]
NO_LIMIT: Step = (3.0e38, 0.0)


def check_method(method: str) -> Method:
    """The method's name, or a ValueError that lists the known ones."""
    check_choice(f"{option('normals')} method", method, METHODS)
    return cast("Method", method)


def parse_max_depth_step(value: float | str | None) -> Step:
    """Return (metres, share of the depth) beyond which a neighbour belongs to another surface.

    A number is metres, "3%" a share of the pixel's own depth, None no limit.
    """
    if value is None:
        return NO_LIMIT
    try:
        text = str(value).strip()
        number = float(text.removesuffix("%"))
    except ValueError:
        text, number = "", math.nan
    if not 0 < number <= LARGEST:
        name = option("max_depth_step")
        raise ValueError(f"{name} must be metres above 0 or a share such as '3%', got {shown(value)}")
    return (0.0, number / 100) if text.endswith("%") else (number, 0.0)


def check_normals(normals: AnyArray, shape: tuple[int, int]) -> NDArray[np.float32]:
    """The caller's own normals: (h, w, 3) float32, unit length, (0, 0, 0) where they are NaN or zero.

    Raises ValueError for another shape and for components that are infinite or above 1e18, TypeError without numbers.
    """
    complaint = f"normals must be a method's name or have shape {(*shape, 3)}"
    array = as_array(normals, complaint, np.float32)
    if array.shape != (*shape, 3):
        raise ValueError(f"{complaint}, got {array.shape}{way_to(array.shape, 'normals', normals, (3,))}")
    if (np.abs(array) > 1.01 * LARGEST).any():  # NaN passes
        longest = np.nanmax(np.abs(array))
        raise ValueError(f"normals must be finite and below {LARGEST:g}, NaN where missing, got {longest:g}")
    length = np.linalg.norm(array, axis=-1, keepdims=True)
    return np.where(length > 0, array / np.where(length > 0, length, 1), 0).astype(np.float32)
