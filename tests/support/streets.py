"""A street as a spinning scanner sees it: ground, house fronts, parked cars, poles and a wall across its end."""

from __future__ import annotations

import numpy as np

BEAMS = {16: (-15.0, 15.0), 32: (-30.67, 10.67), 64: (-24.9, 2.0)}  # degrees: VLP-16, HDL-32E, HDL-64E
STEPS = 1800  # of a turn
HEIGHT = 1.73  # of the scanner
FARTHEST = 90.0
CAR = np.array([2.1, 0.85])  # half its sides
POLE = np.array([4.5, 0.8])  # from the middle of a car
EYES = np.array([[0.0, 0.0, HEIGHT], [18.0, 2.0, HEIGHT]])  # of scanners, on the ground's height 0


def street(
    beams: int = 32, seed: int = 0, eye: np.ndarray = EYES[0], noise: float = 0.01, grid: bool = False
) -> np.ndarray:
    """Return (n, 3): what a scanner at `eye` sees, in the axes of the street.

    grid  as a scanner on a tripod does, up and down by 60 degrees
    """
    low, high = (-60.0, 60.0) if grid else BEAMS[beams]
    turn = np.linspace(-np.pi, np.pi, STEPS // (4 if grid else 1), endpoint=False)
    up = np.radians(np.linspace(low, high, STEPS // 12 if grid else beams))
    turn, up = np.meshgrid(turn, up)
    ways = np.stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)], -1).reshape(-1, 3)
    far = _distances(eye, ways, np.random.default_rng(seed))
    far = far + np.random.default_rng(seed + 1).normal(0, noise, len(far))
    seen = far < FARTHEST
    return eye + ways[seen] * far[seen, None]


def _distances(eye: np.ndarray, ways: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    width = rng.uniform(6, 9, 2)
    far = _to_plane(eye, ways, 2, 0.0)
    for side, away in zip((-1, 1), width, strict=True):
        x = -70.0
        while x < 70:  # houses, with gaps between some
            long, high, back = rng.uniform(8, 16), rng.uniform(5, 12), rng.uniform(0, 2)
            front = side * (away + back)
            low, top = sorted((front, front + side * 9))
            far = np.minimum(far, _to_box(eye, ways, (x, low, 0), (x + long, top, high)))
            x += long + rng.choice([0.0, 0.0, 5.0])
        for x in np.arange(-40, 41, 9) + rng.uniform(-2, 2):  # cars, and poles between them
            middle = np.array([x, side * (away - 1.6)])
            if np.hypot(*(middle - eye[:2])) > 4:
                low, high = middle - CAR, middle + CAR
                far = np.minimum(far, _to_box(eye, ways, (*low, 0.2), (*high, 1.5)))
            far = np.minimum(far, _to_pole(eye, ways, middle + POLE * (1, side), 0.12, 6.0))
    return np.minimum(far, _to_plane(eye, ways, 0, 75.0))


def _to_plane(eye: np.ndarray, ways: np.ndarray, axis: int, at: float) -> np.ndarray:
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (at - eye[axis]) / ways[:, axis]
    return np.where(far > 0, far, np.inf)


def _to_box(eye: np.ndarray, ways: np.ndarray, low: tuple[float, ...], high: tuple[float, ...]) -> np.ndarray:
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (np.array(low) - eye) / ways, (np.array(high) - eye) / ways
    near, far = np.minimum(a, b).max(1), np.maximum(a, b).min(1)
    return np.where((near < far) & (near > 0), near, np.inf)


def _to_pole(eye: np.ndarray, ways: np.ndarray, middle: np.ndarray, radius: float, high: float) -> np.ndarray:
    level = np.linalg.norm(ways[:, :2], axis=1)
    to = middle - eye[:2]
    along = ways[:, :2] @ to / level
    half = radius**2 - (to @ to - along**2)
    far = (along - np.sqrt(np.maximum(half, 0))) / level
    top = eye[2] + far * ways[:, 2]
    return np.where((half > 0) & (far > 0) & (top < high), far, np.inf)
