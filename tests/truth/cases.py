"""The pictures of the contact sheet: what is drawn, what is true, and which share of it may be wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

import pointshade_gl as ps
from pointshade_gl.bench.tracing import Hits, as_frame, encode, patch, plane, sphere_and_wall, trace

from ..benchmarks.traced_light import shade
from .files import MATTE
from .kept import FINE, WRONG, at_size, scene, wrong
from .measures import occluder

# % of a picture that may be wrong: unlit and lit, from the frame's own direction and from another one
SEAMS, TURNED_SEAMS, OWN, TURNED = 0.01, 0.02, 0.1, 0.2
# Pictures that fall short of that, and what may be wrong in them today, so that they get no worse: thin leaves, whose
# undersides graze the light; the thin shadow of a railing; a box's creases between samples.
FALL_SHORT = {
    "plant albedo 0, x1.37, 16 samples": 0.02,
    "plant albedo 15": 0.07,
    "table sun 0, x1.37": 0.15,
    "table sun 0, 16 samples": 0.12,
    "stairs sun 0": 0.16,
    "stairs sun 0, points": 0.16,
    "corner spot 0, gouraud, x1.1": 0.13,
    "plant sun 0": 0.55,
    "plant sun 0, x1.1, 16 samples": 0.65,
    "plant point 15": 0.7,
    "ground, 0.6 of the light, 16 samples": 0.16,
}
Drawing = Callable[[ps.Renderer], tuple[np.ndarray, np.ndarray]]  # the picture, and truth at FINE times its size
SMALL = ps.Camera(220, 220, 99.5, 74.5, 200, 150)  # of the frames that are traced here


@dataclass(frozen=True)
class Cell:
    """A picture (h, w, 4) uint8, the truth beside it, and which of its pixels are wrong (h, w)."""

    name: str
    picture: np.ndarray
    truth: np.ndarray
    wrong: np.ndarray
    bound: float  # % of the pixels

    @property
    def share(self) -> float:
        return 100 * float(self.wrong.mean())

    @property
    def passes(self) -> bool:
        return self.share <= self.bound

    @property
    def got_worse(self) -> bool:
        return self.share > max(self.bound, FALL_SHORT.get(self.name, 0.0))


@dataclass(frozen=True)
class Traced:
    """A view of a kept scene under a lamp, with shadows; the lamp "albedo" is none."""

    scene: str
    lamp: str
    yaw: int = 0
    size: float = 1.0
    samples: int = 1
    splat: str = "footprint"
    shading: str = "phong"
    rasterizer: str = "auto"
    merged: bool = False

    @property
    def name(self) -> str:
        parts = [f"{self.scene} {self.lamp} {self.yaw}", *(f"{v}" for v in (self.splat, self.shading, self.rasterizer))]
        parts += [f"x{self.size}", f"{self.samples} samples", "merged"]
        usual = ("footprint", "phong", "auto", "x1.0", "1 samples", "" if self.merged else "merged")
        return ", ".join(part for part in parts if part not in usual)

    def draw(self, renderer: ps.Renderer) -> Cell:
        kept = scene(self.scene)
        camera = kept.camera.resized(*(round(self.size * side) for side in (kept.camera.width, kept.camera.height)))
        source = [kept.frame, kept.second] if self.merged else kept.frame
        unlit = self.lamp == "albedo"
        options = {"samples": self.samples, "splat": self.splat, "shading": "none" if unlit else self.shading}
        light = None if unlit else kept.light(self.lamp)
        picture = renderer.render(source, light, MATTE, camera, kept.poses[self.yaw], **options)
        return self.judged(picture)

    def judged(self, picture: np.ndarray) -> Cell:
        """A picture of this view, wherever it comes from."""
        truth = scene(self.scene).picture(self.lamp, self.yaw)
        found = wrong(picture, truth)
        unlit, lit = (TURNED_SEAMS, TURNED) if self.yaw else (SEAMS, OWN)
        return Cell(
            self.name, picture, at_size(truth, *picture.shape[:2]), found, unlit if self.lamp == "albedo" else lit
        )


@dataclass(frozen=True)
class Made:
    """A picture whose truth has a closed form."""

    name: str
    draw_it: Drawing
    steps: float = WRONG
    bound: float = SEAMS
    rasterizer: str = "auto"

    def draw(self, renderer: ps.Renderer) -> Cell:
        picture, truth = self.draw_it(renderer)
        return Cell(
            self.name, picture, at_size(truth, *picture.shape[:2]), wrong(picture, truth, self.steps), self.bound
        )


def cases() -> Iterator[Traced | Made]:
    """Unlit, so that seams are seen; then lit, with shadows; then what has a closed form."""
    table, stairs, corner, plant = (Traced(name, "albedo") for name in ("table", "stairs", "corner", "plant"))
    yield from (replace(table, size=size) for size in (1.0, 0.7, 0.993, 1.1, 1.37))
    yield from (replace(plant, size=size, samples=samples) for size, samples in ((1.1, 1), (1.37, 16), (0.7, 16)))
    yield from (replace(table, splat="mesh", size=size) for size in (1.0, 1.1))
    yield from (replace(table, splat="round", size=1.1), replace(table, rasterizer="points", size=1.1))
    yield from (replace(stairs, yaw=5), replace(stairs, yaw=30), replace(corner, yaw=15), replace(plant, yaw=15))
    yield from (replace(stairs, yaw=30, splat=splat) for splat in ("round", "mesh"))
    table, stairs, corner, plant = (replace(one, lamp="sun") for one in (table, stairs, corner, plant))
    yield from (table, replace(table, size=1.37), replace(table, samples=16), replace(table, lamp="point"))
    yield from (replace(table, yaw=15), replace(table, yaw=15, samples=16), replace(table, yaw=15, merged=True))
    yield from (stairs, replace(stairs, rasterizer="points"), replace(stairs, yaw=5), replace(stairs, yaw=30))
    yield from (replace(stairs, lamp="spot", yaw=15), replace(corner, yaw=15), replace(corner, yaw=30, samples=16))
    yield from (replace(corner, lamp="spot"), replace(corner, lamp="spot", shading="gouraud", size=1.1))
    yield from (plant, replace(plant, samples=16, size=1.1), replace(plant, lamp="point", yaw=15))
    yield Made("waves, x0.993, 16 samples", waves)
    yield from (Made(f"ground, {share} of the light", ground(share, 1), 6) for share in (0.3, 0.6, 0.9))
    yield Made("ground, 0.6 of the light, 16 samples", ground(0.6, 16), 6)
    yield Made("soft and over-exposed, 64 samples", soft, 12)
    for name, normal in (("slanted", (0.35, 0, -1)), ("facing", (0.005, 0.003, -1))):
        yield Made(f"{name} wall, depth rounded to 1 mm", rounded_wall(normal), 2, 0.05)


def waves(renderer: ps.Renderer) -> tuple[np.ndarray, np.ndarray]:
    """A smooth texture on a ball and a wall."""
    light, material = ps.Light(position=(-1, -1, -0.5)), ps.Material(specular=0)
    frame = as_frame(trace(sphere_and_wall(), SMALL), SMALL)
    camera = SMALL.resized(199, 149)
    picture = renderer.render(frame, light, material, camera, samples=16)
    return picture, pictured(trace(sphere_and_wall(), fine(camera)), light, material)


def ground(share: float, samples: int) -> Drawing:
    """A box on the ground that only shows shadows, in two suns of one direction: one casts them."""

    def draw(renderer: ps.Renderer) -> tuple[np.ndarray, np.ndarray]:
        pose = ps.orbit_pose(None, (0, 0, 2.0), 30, 30)
        box, floor = standing_box(), plane((0, -1, 0), (0, 0.3, 0), grey)
        suns = [
            ps.Light(direction=(0.25, 1, 0.6), intensity=part, shadow=k == 0)
            for k, part in enumerate((share, 1 - share))
        ]
        frame = as_frame(trace(box, SMALL, pose), SMALL, pose)
        picture = renderer.render(frame, suns, MATTE, ground=(0, -1, 0), samples=samples)
        truth = pictured(trace(box, fine(SMALL), pose), replace(suns[0], intensity=1.0), MATTE)
        below = trace([floor], fine(SMALL), pose)
        shaded = occluder(below, suns[0], box)[0] & (truth[..., 3] == 0)
        truth[shaded] = (0, 0, 0, round(255 * share))
        return picture, truth

    return draw


def standing_box() -> list:
    """The six faces of a box whose lowest edges lie at y = 0.3."""
    middle, half = np.array([0, 0.05, 2.0]), np.diag([0.25, 0.25, 0.2])
    faces = []
    for k in range(3):
        u, v = half[(k + 1) % 3], half[(k + 2) % 3]
        faces += [patch(middle + side * half[k], u, v, grey) for side in (-1, 1)]
    return faces


def soft(renderer: ps.Renderer) -> tuple[np.ndarray, np.ndarray]:
    """A board before a wall in a ball of light, four times too bright: many small lamps' mean, then the clamp."""
    things = [patch((0.05, 0, 1.5), (0.2, 0, 0), (0, 0.15, 0), grey), plane((0, 0, -1), (0, 0, 2), grey)]
    lamp = ps.Light(position=(-0.6, -0.5, 0), intensity=8, radius=0.15, shadow=True)
    picture = renderer.render(as_frame(trace(things, SMALL), SMALL), lamp, MATTE, samples=64)
    hits, turns = trace(things, SMALL), np.random.default_rng(1).normal(size=(400, 4))
    places = lamp.position + lamp.radius * (turns / np.linalg.norm(turns, axis=-1, keepdims=True))[:, :3]
    dim = replace(lamp, intensity=1.0, radius=0.0)  # below the clamp of `shade`
    free = 1 - np.mean([occluder(hits, replace(dim, position=tuple(at)), things)[0] for at in places], axis=0)
    light = lamp.intensity * free[..., None] * shade(hits, dim, MATTE, (0, 0, 0))
    return picture, opaque(encode(np.clip(light, 0, 1))).repeat(FINE, 0).repeat(FINE, 1)


def rounded_wall(normal: tuple[float, float, float]) -> Drawing:
    """A smooth wall, seen by a long lens, whose depth a sensor rounds to millimetres."""

    def draw(renderer: ps.Renderer) -> tuple[np.ndarray, np.ndarray]:
        camera = replace(SMALL, fx=480, fy=480)
        wall, light = [plane(normal, (0, 0, 2.6), grey)], ps.Light(position=(-0.8, -0.6, 1.8))
        frame = as_frame(trace(wall, camera), camera)
        picture = renderer.render(ps.Frame(frame.color, np.round(frame.depth, 3), camera), light, MATTE)
        return picture, pictured(trace(wall, fine(camera)), light, MATTE)

    return draw


def grey(points: np.ndarray) -> np.ndarray:
    return np.full(points.shape, 0.5)


def fine(camera: ps.Camera) -> ps.Camera:
    return camera.resized(FINE * camera.width, FINE * camera.height)


def pictured(hits: Hits, light: ps.Light, material: ps.Material) -> np.ndarray:
    """(h, w, 4) uint8 of what was traced without shadows; alpha 0 where nothing is."""
    return opaque(encode(shade(hits, light, material, (0, 0, 0))), hits.surface >= 0)


def opaque(colour: np.ndarray, where: np.ndarray | bool = True) -> np.ndarray:
    alpha = np.broadcast_to(np.where(where, 255, 0), colour.shape[:2])
    return np.dstack([np.rint(colour), alpha]).astype(np.uint8)
