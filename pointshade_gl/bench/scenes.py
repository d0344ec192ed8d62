"""Scenes and shapes whose depth, normals and depth edges are known exactly."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike, NDArray

from ..scene.camera import Camera, check_pose, orbit_pose
from .tracing import NEIGHBOURS, Array, TracedSurface, moved_surface, patch, plane, sphere, trace

Vector = tuple[float, ...] | Array
Sample = tuple[Array, tuple[Any, ...]]  # of points: the signed distances, and what their paint asks for
Paint = Callable[..., Array]  # of points, and of what the shape gives beside their distances: their albedos


def grey(points: Array, *_: Any) -> Array:
    return np.full(points.shape, 0.6)


def ramp(x: Array, start: float, end: float) -> Array:
    """0 before `start`, 1 after `end`, smooth between."""
    t = np.clip((x - start) / (end - start), 0, 1)
    return t * t * (3 - 2 * t)


def ellipsoid(p: Array, radii: Vector) -> Array:
    """The approximate distance to an ellipsoid at the origin (Quilez 2008)."""
    k0, k1 = np.linalg.norm(p / radii, axis=-1), np.linalg.norm(p / np.square(radii), axis=-1)
    return k0 * (k0 - 1) / np.maximum(k1, 1e-12)


def solid(
    shape: Callable[[Array], Sample], hull: Array, margin: float, caution: float = 0.4, paint: Paint = grey
) -> TracedSurface:
    """A sphere-traced surface that stays within `margin` of the points `hull`. Each step is `caution` times the
    distance, because the distance of most shapes is only approximate."""
    centre = np.mean(hull, 0)
    radius = np.linalg.norm(hull - centre, axis=-1).max() + margin

    def meet(origin: Array, rays: Array) -> tuple[Array, Array]:
        result, normals = np.full(rays.shape[:-1], np.inf), np.zeros(rays.shape)
        a, b = (rays * rays).sum(-1), rays @ (centre - origin)
        q = b * b - a * (((centre - origin) ** 2).sum() - radius**2)
        index = np.flatnonzero(q > 0)
        a, b, q, ahead = a.flat[index], b.flat[index], q.flat[index], rays.reshape(-1, 3)[index]
        t, end = (b - np.sqrt(q)) / a, (b + np.sqrt(q)) / a
        for _ in range(400):
            d = shape(origin + t[:, None] * ahead)[0]
            result.flat[index[np.abs(d) < 1e-9]] = t[np.abs(d) < 1e-9]
            t = t + caution * d / np.sqrt(a)
            on = (np.abs(d) >= 1e-9) & (t < end)
            index, t, end, a, ahead = index[on], t[on], end[on], a[on], ahead[on]
        close = np.abs(shape(origin + t[:, None] * ahead)[0]) < 1e-6  # grazing rays never arrive
        result.flat[index[close]] = t[close]
        hit = np.isfinite(result)
        at = origin + result[hit][:, None] * rays[hit]
        gradient = np.stack([shape(at + e)[0] - shape(at - e)[0] for e in 1e-6 * np.eye(3)], -1)
        normals[hit] = gradient / np.linalg.norm(gradient, axis=-1, keepdims=True)
        return result, normals

    return TracedSurface(meet, lambda p: paint(p, *shape(p)[1]))


def nearest(curve: Array, p: Array) -> tuple[Array, Array, Array]:
    """The nearest place to p on a quadratic Bezier curve (3, 3): parameter, offset to p, tangent."""
    a, b, c = curve[0], 2 * (curve[1] - curve[0]), curve[0] - 2 * curve[1] + curve[2]
    starts = np.linspace(0, 1, 9)[:, None]
    away = p[..., None, :] - (a + starts * (b + starts * c))
    t = starts[np.argmin((away * away).sum(-1), -1)]
    for _ in range(4):  # Newton
        offset, tangent = p - (a + t * (b + t * c)), b + 2 * t * c
        bend = (tangent * tangent - 2 * offset * c).sum(-1, keepdims=True)
        t = np.clip(t + (offset * tangent).sum(-1, keepdims=True) / np.maximum(bend, 1e-3), 0, 1)
    return t[..., 0], p - (a + t * (b + t * c)), b + 2 * t * c


def axes(up: Vector, ahead: Vector) -> Array:
    """(..., 3, 3) right-handed unit axes in rows: the second is `up`, the third points roughly ahead."""
    x = np.cross(up, ahead)
    rows = np.stack([x, up + 0 * x, np.cross(x, up)], -2)
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


def around(p: Array, origin: Array, up: Array) -> tuple[Array, Array, Array]:
    """Height, radius and angle about an axis through `origin`."""
    x, y, z = axes(up, (0.1, 0.3, 1)) @ (p - origin).T
    return y, np.hypot(x, z), np.arctan2(z, x)


HALVINGS = 48  # of the interval in which a ray meets a height field: 1e-15 of a metre


def pose_at(centre: ArrayLike, yaw: float = 0.0, pitch: float = 0.0, roll: float = 0.0) -> Array:
    """A pose at `centre`, rolled about z, then turned like an orbiting camera. Angles in degrees."""
    a = np.radians(roll)
    pose = orbit_pose(None, (0, 0, 0), yaw, pitch).copy()
    pose[:2, :3] = [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]] @ pose[:2, :3]
    pose[:3, 3] = centre
    return pose


def box(half: ArrayLike, far: bool = False) -> TracedSurface:
    """A box round the origin, by its half edges. far: where rays leave it, instead of where they enter."""
    size = np.asarray(half, float)

    def meet(origin: Array, rays: Array) -> tuple[Array, Array]:
        with np.errstate(divide="ignore", invalid="ignore"):
            sides = np.sort([(-size - origin) / rays, (size - origin) / rays], axis=0)
        enter, leave = sides[0].max(-1), sides[1].min(-1)
        t = leave if far else enter
        normals = np.eye(3)[sides[1].argmin(-1) if far else sides[0].argmax(-1)]
        return np.where((enter < leave) & (t > 0), t, np.inf), normals

    return TracedSurface(meet, grey)


def sheet(half_width: float, low: float, high: float) -> TracedSurface:
    """A strip of the plane z = 0, `low` to `high` along y."""
    return patch((0, (low + high) / 2, 0), (half_width, 0, 0), (0, (high - low) / 2, 0), grey)


def rod(radius: float, half_length: float) -> TracedSurface:
    """An open cylinder along y."""

    def meet(origin: Array, rays: Array) -> tuple[Array, Array]:
        o, d = origin[[0, 2]], rays[..., [0, 2]]
        a, b = (d * d).sum(-1), -(d @ o)
        q = b * b - a * (o @ o - radius**2)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (b - np.sqrt(np.maximum(q, 0))) / a
        t = np.where((q > 0) & (t > 0) & (np.abs(origin[1] + t * rays[..., 1]) < half_length), t, np.inf)
        normals = np.zeros(rays.shape)
        normals[..., [0, 2]] = (o + np.where(np.isfinite(t), t, 0)[..., None] * d) / radius
        return t, normals

    return TracedSurface(meet, grey)


def torus(ring: float, tube: float) -> TracedSurface:
    """A ring round the y axis."""

    def shape(p: Array) -> Sample:
        across = np.hypot(p[..., 0], p[..., 2]) - ring
        return np.hypot(across, p[..., 1]) - tube, ()

    return solid(shape, np.zeros((1, 3)), ring + tube, caution=0.95)


def relief(height: Callable[[Array, Array], Array], low: float, high: float) -> TracedSurface:
    """z = height(x, y), between `low` and `high`, seen roughly along z: each ray must meet it once."""

    def meet(origin: Array, rays: Array) -> tuple[Array, Array]:
        near, far = (low - origin[2]) / rays[..., 2], (high - origin[2]) / rays[..., 2]
        for _ in range(HALVINGS):
            half = (near + far) / 2
            x, y, z = origin[:, None, None] + half * np.moveaxis(rays, -1, 0)
            above = z < height(x, y)
            near, far = np.where(above, half, near), np.where(above, far, half)
        t = (near + far) / 2
        x, y, e = origin[0] + t * rays[..., 0], origin[1] + t * rays[..., 1], 1e-6
        slopes = height(x + e, y) - height(x - e, y), height(x, y + e) - height(x, y - e)
        normals = np.stack([slopes[0] / (2 * e), slopes[1] / (2 * e), -np.ones_like(t)], -1)
        return np.where(t > 0, t, np.inf), normals / np.linalg.norm(normals, axis=-1, keepdims=True)

    return TracedSurface(meet, grey)


UPRIGHT = np.array([(1, 0, 0, 0), (0, -1, 0, 0.272), (0, 0, -1, 1), (0, 0, 0, 1.0)])  # y down, as in a camera
VASE_POSE = orbit_pose(UPRIGHT, (0, 0.272, 0), pitch=13)  # of the camera that takes it

HEIGHT, WALL = 0.33, 0.0028  # of the vase; half the thickness of its wall
HEIGHTS = (0, 0.012, 0.035, 0.08, 0.13, 0.175, 0.215, 0.25, 0.285, 0.315, HEIGHT)
RADII = (0.06, 0.058, 0.058, 0.084, 0.109, 0.105, 0.078, 0.052, 0.044, 0.055, 0.072)
PROFILE = Polynomial.fit(HEIGHTS, RADII, 9)  # a polynomial has no seam at which a highlight would break
SLOPE = PROFILE.deriv()


def vase(p: Array) -> Sample:
    """A shell around PROFILE, thicker at its lip."""
    y, r = np.clip(p[..., 1] - WALL, 0, HEIGHT), np.hypot(p[..., 0], p[..., 2])
    across = (r - PROFILE(y)) / np.sqrt(1 + SLOPE(y) ** 2)
    lip = 0.002 * np.exp(-(((y - HEIGHT) / 0.008) ** 2))
    return np.hypot(across, p[..., 1] - WALL - y) - WALL - lip, (across,)


def table(p: Array) -> Sample:
    """A wooden disc with a rounded edge, 36 cm wide, its top at y = 0."""
    x, y = np.hypot(p[..., 0], p[..., 2]) - 0.171, np.abs(p[..., 1] + 0.011) - 0.002
    return np.hypot(np.maximum(x, 0), np.maximum(y, 0)) + np.minimum(np.maximum(x, y), 0) - 0.009, ()


def leaf(curve: Array, width: float, side: Vector, paint: Paint, thick: float = 0.0019) -> TracedSurface:
    """A blade along a curve, folded along its middle; `side` points across it. Without width it is a stem."""

    def shape(p: Array) -> Sample:
        t, offset, tangent = nearest(curve, p)
        x, y, z = (axes(np.cross(tangent, side), tangent) @ offset[..., None])[..., 0].T
        half = width * (0.1 + np.sin(np.pi * t**0.9) ** 1.3) * (1 - t**6)
        lift = y - 0.35 * (np.sqrt(x * x + 1e-5) - 0.003) + 0.12 * x * np.sin(9 * t)
        return np.sqrt(np.maximum(np.abs(x) - half, 0) ** 2 + z * z + lift * lift) - thick, (x, t)

    return solid(shape, curve, width + thick, paint=paint)


def tulip(head: Array, up: Array, size: float, turn: float, paint: Paint) -> TracedSurface:
    """Two rings of three pointed petals on an egg."""

    def shape(p: Array) -> Sample:
        y, rho, phi = around(p / size, head / size, up)
        h, ring = np.clip(y, 0, 1), np.array([[0], [1]])
        f = (phi + turn + ring * np.pi / 3) % (2 * np.pi / 3) - np.pi / 3  # from the petal's middle
        half = 0.44 * (1 - h**3.2)
        egg = np.hypot(rho / (0.385 - 0.03 * ring), (y - 0.4) / np.where(y < 0.4, 0.4, 0.92)) - 1
        lift = 0.38 * egg - 0.09 * h**5 + 0.05 * f * f * (1 - ring) + 0.012 * np.exp(-((f / 0.12) ** 2))
        over = np.hypot(np.maximum(rho * np.abs(f) - half, 0), np.maximum(y - 1, 0))
        petals, edges = np.hypot(lift, over), rho * np.abs(f) / np.maximum(half, 0.02)
        return (np.minimum(*petals) - 0.018) * size, (petals, edges, h, turn)

    return solid(shape, head[None], 1.2 * size, paint=paint)


def daisy(head: Array, up: Array, size: float, turn: float, paint: Paint) -> TracedSurface:
    """Two rings of petals around a domed heart."""

    def shape(p: Array) -> Sample:
        y, rho, phi = around(p / size, head / size, up)
        place, ring = phi / (2 * np.pi) * 13, np.array([[0], [0.5]])
        f = ((place + ring) % 1 - 0.5) * 2 * np.pi / 13  # from the petal's middle
        odd = np.sin(5 * phi + turn) * np.sin(3 * phi + 2 * turn)  # no two petals rise equally
        x, z = rho * np.cos(f), rho * np.sin(f)
        lift = y - 0.25 * x * x + 0.18 * ring - 0.09 * odd * x + 0.014 * np.cos(42 * z) - 0.4 * z * z
        petals = ellipsoid(np.stack([x - 0.58, lift, z], -1), (0.42, 0.045, 0.15))
        spirals = np.sin(8 * phi + 26 * rho) * np.sin(13 * phi - 20 * rho) * ramp(rho, 0.02, 0.15)
        heart = ellipsoid(np.stack([rho, y - 0.02], -1), (0.27, 0.15)) - 0.009 * spirals
        return np.minimum(np.minimum(*petals), heart) * size, (petals, heart, ring, x, z, rho, spirals)

    return solid(shape, head[None], 1.12 * size, paint=paint)


def vase_scene(**paints: Paint) -> list[TracedSurface]:
    """All parts: the vase, the table, then the flowers. paints: by the names of what they are for; others are grey."""
    paint = defaultdict(lambda: grey, paints)
    pot = solid(vase, np.array([[0, 0.17, 0]]), 0.2, 0.8, paint["vase"])
    parts = [pot, solid(table, np.zeros((1, 3)), 0.2, 0.9, paint["table"])]
    flowers = (
        (tulip, (-0.08, 0.41, -0.02), (-0.17, 0.465, -0.03), (-9, 5.5, -1), 0.13, 0.3, "coral"),
        (tulip, (-0.03, 0.42, -0.03), (-0.06, 0.478, -0.06), (-3, 6.5, -3), 0.135, 0.9, "plum"),
        (tulip, (0.04, 0.42, -0.02), (0.085, 0.48, -0.05), (4.5, 6, -3), 0.135, 2.2, "coral"),
        (tulip, (0.09, 0.4, -0.01), (0.19, 0.445, -0.02), (10, 4.5, -1), 0.125, 0.7, "plum"),
        (daisy, (-0.05, 0.42, 0), (-0.135, 0.405, 0.05), (-0.3, 0.35, 1), 0.082, 1, "white"),
        (daisy, (0, 0.42, 0), (0.01, 0.44, 0.1), (0.02, 0.45, 1), 0.082, 2, "apricot"),
        (daisy, (0.06, 0.42, 0), (0.145, 0.38, 0.07), (0.2, 0.25, 1), 0.078, 3, "white"),
    )
    for kind, knee, head, up, size, turn, color in flowers:
        curve = np.array([(0.3 * knee[0], 0.3, knee[2]), knee, head])
        parts.append(leaf(curve, 0, (0, 0, 1), paint["leaf"], 0.0036))
        parts.append(kind(curve[2], np.array(up), size, turn, paint[color]))
    for knee, tip, width, side in (
        ((-0.1, 0.5, 0), (-0.29, 0.36, 0.02), 0.027, (0.6, 1, 0.3)),
        ((0.1, 0.5, 0), (0.29, 0.33, 0.02), 0.027, (-0.6, 1, 0.3)),
        ((0, 0.5, -0.05), (0.01, 0.605, -0.08), 0.028, (1, 0, 0.3)),
        ((-0.03, 0.45, -0.05), (-0.25, 0.53, -0.06), 0.028, (1, 0.5, 0.2)),
        ((0.04, 0.45, -0.05), (0.22, 0.56, -0.06), 0.028, (1, -0.5, 0.2)),
        ((-0.09, 0.43, 0.03), (-0.16, 0.26, 0.09), 0.022, (1, 0.4, -0.3)),
    ):
        parts.append(leaf(np.array([(0.06 * tip[0], 0.3, 0), knee, tip]), width, side, paint["leaf"]))
    return parts


MIDDLE = 1.5  # metres to the middle of the scenes
GAP = 0.01  # a surface ends where a pixel's tangent plane misses the neighbour by more than this share of depth
REACH = 2  # pixels this near to a depth edge count as its surroundings


@dataclass(frozen=True)
class KnownScene:
    """What a perfect camera would see."""

    name: str
    camera: Camera
    depth: NDArray[np.float32]  # (h, w) metres, 0 = nothing
    normals: NDArray[np.float32]  # (h, w, 3) unit, camera axes, towards the camera
    edge: NDArray[np.bool_]  # (h, w) within 2 pixels of a jump in depth; where a surface borders on nothing is none


def standard_camera(width: int, height: int) -> Camera:
    """The view that the scenes are composed for: 63 degrees wide, like most depth cameras."""
    focal = width * 525 / 640
    return Camera(focal, focal, (width - 1) / 2, (height - 1) / 2, width, height)


def wall() -> TracedSurface:
    return plane((0.15, -0.1, -1), (0, 0, 2.6), grey)


def tilted(degrees: float, roll: float, low: float, high: float) -> list[TracedSurface]:
    return [moved_surface(sheet(20, low, high), pose_at((0, 0, MIDDLE), pitch=degrees, roll=roll))]


def turned_vase(_: Camera) -> list[TracedSurface]:
    """The built-in scene, close up and in front of a wall."""
    to_camera = pose_at((0, 0.02, -0.22)) @ np.linalg.inv(VASE_POSE)
    return [moved_surface(part, to_camera) for part in vase_scene()] + [plane((0.1, 0, -1), (0, 0, 1.1), grey)]


def stairs(_: Camera) -> list[TracedSurface]:
    """Nine steps away from a camera that looks down on them, and five plates in the air: pure jumps in depth."""
    down = np.linalg.inv(pose_at((0, 0, 0), pitch=12))
    parts = [moved_surface(plane((0, 0, -1), (0, 0, 5), grey), down)]
    for k in range(9):
        parts.append(moved_surface(box((1.1, 0.08, 0.13)), down @ pose_at((0, 0.7 - 0.15 * k, 1.2 + 0.25 * k))))
    for k in range(5):
        place = pose_at((0.65 - 0.12 * k, -0.15 - 0.04 * k, 1.3 + 0.2 * k), yaw=-15)
        parts.append(moved_surface(box((0.12, 0.2, 0.02)), down @ place))
    return parts


def rods(camera: Camera) -> list[TracedSurface]:
    """Ribbons 1, 2 and 3 pixels wide in five directions, tilted along their length, and 3-pixel rods. No estimator can
    find the normal of a rod of 1 or 2 pixels from its depth: such rods would measure luck."""
    pixel = MIDDLE / camera.fx
    parts = [wall()]
    for k in range(15):
        width, direction = 1 + k % 3, (0, 90, 20, 45, 70)[k // 3]
        x, y = (k % 5 - 2) * 0.33 + 0.02, (k // 5 - 1) * 0.42
        place = pose_at((x, y, MIDDLE), pitch=35, roll=direction)
        parts.append(moved_surface(sheet(width * pixel / 2, -0.17, 0.17), place))
    for x, roll in ((-0.5, 0), (-0.17, 80), (0.16, 35), (0.49, 60)):
        parts.append(moved_surface(rod(1.5 * pixel, 0.14), pose_at((x, 0.21, MIDDLE), pitch=20, roll=roll)))
    return parts


def waves(camera: Camera) -> list[TracedSurface]:
    """Waves from a fifth of the picture's width down to 5 pixels, 37 degrees steep everywhere."""
    long, short = 0.19 * camera.width, 5.0
    rate = np.log(long / short) / camera.width
    pixel = MIDDLE / camera.fx

    def height(x: Array, y: Array) -> Array:
        u = x / pixel + camera.width / 2
        length = long * np.exp(-rate * u)
        phase = 2 * np.pi / long * np.expm1(rate * u) / rate
        return MIDDLE + 0.12 * length * pixel * np.sin(phase) * (0.6 + 0.4 * np.sin(9 * y))

    return [relief(height, MIDDLE - 0.1, MIDDLE + 0.1)]


def overlap(_: Camera) -> list[TracedSurface]:
    """A box and two balls, one in front of the other, in front of a wall."""
    cube = moved_surface(box((0.3, 0.3, 0.3)), pose_at((0.25, 0.08, 1.75), 40, 25))
    return [wall(), cube, sphere((-0.2, 0.05, 1.15), 0.25, grey), sphere((0.03, -0.2, 1.3), 0.12, grey)]


SCENES: dict[str, Callable[[Camera], list[TracedSurface]]] = {
    "plane": lambda _: [plane((0, 0, -1), (0, 0, MIDDLE), grey)],
    "tilted-60": lambda _: tilted(60, 30, -1.5, 5),
    "grazing-85": lambda _: tilted(85, 70, -1.2, 4),
    "sphere": lambda _: [wall(), sphere((0.05, 0.02, MIDDLE), 0.45, grey)],
    "torus": lambda _: [wall(), moved_surface(torus(0.36, 0.13), pose_at((0, 0, 1.4), 25, 50))],
    "vase": turned_vase,
    "stairs": stairs,
    "rods": rods,
    "waves": waves,
    "overlap": overlap,
}


def make_scene(name: str, standard: Camera, camera: Camera | None = None, pose: ArrayLike | None = None) -> KnownScene:
    """The scene composed for the `standard` camera, seen by any camera (None: the standard one) at any pose."""
    camera = camera or standard
    hits = trace(SCENES[name](standard), camera, pose)
    normals = hits.normals @ check_pose(pose)[:3, :3]
    edge = near_depth_edge(hits.depth, normals, camera)
    return KnownScene(name, camera, hits.depth.astype(np.float32), normals.astype(np.float32), edge)


def near_depth_edge(depth: Array, normals: Array, camera: Camera, reach: int = REACH) -> NDArray[np.bool_]:
    """Pixels within `reach` of a jump in depth: two neighbours, each off the other's tangent plane. Creases and grazing
    planes, where depth only changes fast, do not count."""
    rays = camera.rays()
    jump = np.zeros(depth.shape, bool)
    off = (normals * rays).sum(-1) * depth  # distance of the tangent plane from the eye
    for a, b in NEIGHBOURS:
        with np.errstate(divide="ignore", invalid="ignore"):
            there = [off[i] / (normals[i] * rays[j]).sum(-1) / depth[j] - 1 for i, j in ((a, b), (b, a))]
            apart = (np.abs(there[0]) > GAP) & (np.abs(there[1]) > GAP) & (depth[a] > 0) & (depth[b] > 0)
        jump[a] |= apart
        jump[b] |= apart
    grown = np.pad(jump, reach)  # both sides of the jump are marked already
    for _ in range(reach - 1):
        grown[1:-1] |= grown[:-2] | grown[2:]
        grown[:, 1:-1] |= grown[:, :-2] | grown[:, 2:]
    return grown[reach:-reach, reach:-reach] & (depth > 0)
