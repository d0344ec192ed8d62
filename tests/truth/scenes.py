"""Six things to look at, each drawn anew from a seed: shapes, colours, who looks, lamps. NumPy only."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from . import shapes
from .shapes import Shape

Rng = np.random.Generator


class Part(NamedTuple):
    shape: Shape
    color: tuple[int, int, int]  # 8-bit sRGB, so that a picture holds it exactly


class Setting(NamedTuple):
    """What stands there; the eye looks from `around` and `above` degrees, at `distance`, to `target`, z up."""

    parts: list[Part]
    target: tuple[float, float, float]
    distance: float
    around: float
    above: float
    fov: float  # degrees, horizontal


def color(rng: Rng, low: int = 90, high: int = 235) -> tuple[int, int, int]:
    red, green, blue = rng.integers(low, high, 3)
    return int(red), int(green), int(blue)


def floor(rng: Rng, radius: float) -> Part:
    grey = int(rng.integers(150, 215))
    return Part(shapes.disc(radius), (grey, grey - 8, grey - 20))


def table(rng: Rng) -> Setting:
    wide, deep, high = rng.uniform(1.0, 1.4), rng.uniform(0.7, 0.9), rng.uniform(0.62, 0.76)
    wood = color(rng, 110, 210)
    parts = [floor(rng, 2.6), Part(shapes.box((wide, deep, 0.04), (0, 0, high - 0.02)), wood)]
    leg = rng.uniform(0.05, 0.08)
    for x in (-1, 1):
        for y in (-1, 1):
            middle = (x * (wide / 2 - 0.08), y * (deep / 2 - 0.08), (high - 0.04) / 2)
            parts.append(Part(shapes.box((leg, leg, high - 0.04), middle), wood))
    skull = shapes.head(rng.uniform(0.36, 0.46), rng.uniform(0.2, 0.34))
    place = (rng.uniform(-0.05, 0.1), rng.uniform(0, 0.12), high)
    parts.append(Part(skull.moved(place, rng.uniform(-35, 35)), color(rng, 150)))
    size, thick = rng.uniform(0.1, 0.14), rng.uniform(0.018, 0.03)
    lean = rng.uniform(55, 80)
    lowest = size * np.sin(np.radians(lean)) + thick
    parts.append(Part(shapes.ring(size, thick, (-0.36, -0.08, high + lowest), lean), color(rng)))
    mug = shapes.cup(rng.uniform(0.055, 0.08), rng.uniform(0.1, 0.15), 0.008)
    parts.append(Part(mug.moved((0.38, -0.12, high), rng.uniform(-100, 30)), color(rng)))
    return Setting(parts, (0, 0, high - 0.05), rng.uniform(2.2, 2.6), rng.uniform(-20, 20), rng.uniform(20, 32), 45)


def stairs(rng: Rng) -> Setting:
    count, rise, run, wide = int(rng.integers(4, 7)), rng.uniform(0.14, 0.19), rng.uniform(0.2, 0.3), 1.1
    stone = color(rng, 140, 215)
    parts = [floor(rng, 3.2)]
    for k in range(count):
        high = (k + 1) * rise
        parts.append(Part(shapes.box((wide, run, high), (0, k * run, high / 2)), stone))
    side, metal, up = wide / 2 - 0.06, color(rng), 0.55
    for k in range(count):
        parts.append(
            Part(shapes.rod((side, k * run, (k + 1) * rise), (side, k * run, (k + 1) * rise + up), 0.014), metal)
        )
    start, end = (side, -0.1, rise + up - 0.05), (side, (count - 1) * run + 0.1, count * rise + up + 0.05)
    parts.append(Part(shapes.rod(start, end, 0.022), metal))
    size, thick = rng.uniform(0.16, 0.22), rng.uniform(0.028, 0.042)
    step = int(rng.integers(1, count - 1))
    place = (rng.uniform(-0.3, -0.05), step * run, (step + 1) * rise + size + thick)
    turns = ((2, 3), (3, 2), (2, 5))[int(rng.integers(3))]
    parts.append(Part(shapes.knot(size, thick, turns=turns).moved(place, rng.uniform(-40, 40)), color(rng)))
    target = (0, (count - 1) * run / 2, count * rise / 2 + 0.15)
    return Setting(parts, target, rng.uniform(2.5, 3.0), rng.uniform(-30, 15), rng.uniform(18, 30), 45)


def corner(rng: Rng) -> Setting:
    wall = color(rng, 170, 225)
    parts = [
        Part(shapes.box((3.2, 3.2, 0.1), (0, 0, -0.05)), color(rng, 150, 200)),
        Part(shapes.box((3.2, 0.1, 2.2), (0, 1.65, 1.1)), wall),
        Part(shapes.box((0.1, 3.2, 2.2), (-1.65, 0, 1.1)), color(rng, 170, 225)),
    ]
    for _ in range(int(rng.integers(5, 8))):
        size = rng.uniform(0.18, 0.6, 3)
        place = (rng.uniform(-1.1, 0.7), rng.uniform(-0.5, 1.1), size[2] / 2)
        parts.append(Part(shapes.box(size, place, rng.uniform(0, 90)), color(rng)))
    size = rng.uniform(0.25, 0.4, 3)
    shelf = (rng.uniform(-0.9, 0.3), 1.6 - 0.15, rng.uniform(0.9, 1.3))
    parts.append(Part(shapes.box((rng.uniform(0.6, 0.9), 0.3, 0.04), shelf), wall))
    parts.append(Part(shapes.box(size * 0.6, (shelf[0], shelf[1], shelf[2] + 0.02 + size[2] * 0.3), 20), color(rng)))
    return Setting(parts, (-0.2, 0.5, 0.55), rng.uniform(3.2, 3.6), rng.uniform(15, 35), rng.uniform(20, 32), 50)


def rods(rng: Rng) -> Setting:
    parts = [floor(rng, 2.4)]
    wide, seat, back, r = (
        rng.uniform(0.4, 0.5),
        rng.uniform(0.42, 0.5),
        rng.uniform(0.9, 1.05),
        rng.uniform(0.014, 0.02),
    )
    h, wood, chair = wide / 2, color(rng), []
    for x in (-h, h):
        chair += [shapes.rod((x, -h, 0), (x, -h, seat), r), shapes.rod((x, h, 0), (x, h + 0.06, back), r)]
        chair.append(shapes.rod((x, -h, 0.2), (x, h, 0.2), 0.7 * r))
    for z in np.linspace(seat + 0.12, back - 0.04, int(rng.integers(3, 6))):
        chair.append(shapes.rod((-h, h + 0.06 * z / back, z), (h, h + 0.06 * z / back, z), 0.8 * r))
    for x in np.linspace(-h, h, int(rng.integers(6, 10))):
        chair.append(shapes.rod((x, -h, seat), (x, h, seat), 0.8 * r))
    for y in (-h, h):
        chair.append(shapes.rod((-h, y, seat), (h, y, seat), r))
    place = (rng.uniform(-0.45, -0.3), rng.uniform(-0.15, 0.1), 0)
    parts.append(Part(shapes.joined(*chair).moved(place, rng.uniform(-60, 60)), wood))
    high, lean, metal, ladder = rng.uniform(1.2, 1.5), rng.uniform(0.2, 0.4), color(rng), []
    for x in (-0.2, 0.2):
        ladder += [
            shapes.rod((x, 0, 0), (0.8 * x, lean, high), 0.02),
            shapes.rod((x, 2 * lean, 0), (0.8 * x, lean, high), 0.016),
        ]
    for s in np.linspace(0.14, 0.92, int(rng.integers(5, 8))):
        ladder.append(shapes.rod((-0.2 + 0.04 * s, lean * s, high * s), (0.2 - 0.04 * s, lean * s, high * s), 0.014))
    ladder = shapes.joined(*ladder).moved((rng.uniform(0.35, 0.5), rng.uniform(-0.2, 0.1), 0), rng.uniform(-30, 30))
    parts.append(Part(ladder, metal))
    return Setting(parts, (0.05, 0.1, 0.5), rng.uniform(2.4, 2.8), rng.uniform(-25, 25), rng.uniform(18, 30), 45)


def plant(rng: Rng) -> Setting:
    high = rng.uniform(0.26, 0.34)
    pot = [
        (0, 0),
        (0.12, 0),
        (0.17, high),
        (0.185, high),
        (0.185, high + 0.03),
        (0.16, high + 0.03),
        (0.15, high - 0.03),
    ]
    soil = shapes.disc(0.152, high - 0.03)
    parts = [floor(rng, 1.8), Part(shapes.lathe(pot), color(rng, 130)), Part(soil, (92, 70, 55))]
    for k in range(int(rng.integers(11, 17))):
        up = rng.uniform(0.06, 0.42)
        blade = shapes.leaf(
            rng.uniform(0.28, 0.48), rng.uniform(0.08, 0.15), rng.uniform(0.4, 1.1), rng.uniform(0.3, 1.0)
        )
        around = 137.5 * k + rng.uniform(-15, 15)
        green = (int(rng.integers(70, 140)), int(rng.integers(150, 220)), int(rng.integers(60, 120)))
        parts.append(Part(blade.moved((0, 0, high + up - 0.02), around), green))
    stem = np.array([(0, 0, high - 0.03), (0.01, 0.01, high + 0.2), (0, 0, high + 0.44)])
    parts.append(Part(shapes.tube(stem, (0.02, 0.016, 0.01)), (120, 150, 80)))
    return Setting(parts, (0, 0, high + 0.1), rng.uniform(1.7, 2.0), rng.uniform(-40, 40), rng.uniform(18, 30), 45)


def spheres(rng: Rng) -> Setting:
    """A pile that rolled together: each ball is dropped onto the others, and lies as low as it can among some tries."""
    placed: list[tuple[np.ndarray, float]] = []
    for _ in range(int(rng.integers(9, 14))):
        r = rng.uniform(0.09, 0.24)
        tries = [_resting(placed, rng.normal(0, 0.2, 2), r) for _ in range(30)]
        placed.append((min(tries, key=lambda p: p[2] + 0.5 * np.hypot(p[0], p[1])), r))
    parts = [floor(rng, 2.2), *(Part(shapes.ball(r, at), color(rng)) for at, r in placed)]
    return Setting(parts, (0, 0, 0.25), rng.uniform(1.9, 2.3), rng.uniform(-40, 40), rng.uniform(20, 32), 45)


def _resting(placed: list[tuple[np.ndarray, float]], at: np.ndarray, r: float) -> np.ndarray:
    """(3,) where a ball of radius r stops that falls straight down at (2,)."""
    z = r
    for middle, other in placed:
        gap = (r + other) ** 2 - ((middle[:2] - at) ** 2).sum()
        if gap > 0:
            z = max(z, middle[2] + np.sqrt(gap))
    return np.array([*at, z])


SCENES = {"table": table, "stairs": stairs, "corner": corner, "rods": rods, "plant": plant, "spheres": spheres}


def setting(name: str, seed: int) -> Setting:
    return SCENES[name](np.random.default_rng([seed, list(SCENES).index(name)]))
