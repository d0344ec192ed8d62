"""The built-in scene: tulips and daisies in a painted vase, ray-traced into a colour and a depth picture.

The source work lit a point object of about 80 000 points; vase and flowers are as many pixels here. Colours
are pure albedo: all light is left to whoever renders them. `python -m pointshade_gl.bench.vase [FOLDER]`
World: metres, y up, origin where the vase stands.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike
from PIL import Image

from ..camera import Camera, orbit_pose
from .tracing import Array, Surface, decode, encode, trace

FOLDER = Path(__file__).parents[2] / "assets" / "vase"
CAMERA = Camera(650, 650, 319.5, 239.5, 640, 480)
UPRIGHT = np.array([(1, 0, 0, 0), (0, -1, 0, 0.272), (0, 0, -1, 1), (0, 0, 0, 1.0)])  # the camera's y points down
POSE = orbit_pose(UPRIGHT, (0, 0.272, 0), pitch=13)
LATTICE = np.random.default_rng(2001).random((32, 32, 32))

HEIGHT, WALL = 0.33, 0.0028  # of the vase; half the thickness of its wall
HEIGHTS = (0, 0.012, 0.035, 0.08, 0.13, 0.175, 0.215, 0.25, 0.285, 0.315, HEIGHT)
RADII = (0.06, 0.058, 0.058, 0.084, 0.109, 0.105, 0.078, 0.052, 0.044, 0.055, 0.072)
PROFILE = Polynomial.fit(HEIGHTS, RADII, 9)  # a polynomial: no seam for a highlight to break at
SLOPE = PROFILE.deriv()

Look = tuple[Array, Callable[[], Array]]  # of points: the signed distances, and what finds the albedos


def noise(points: Array, *scale: float) -> Array:
    """Smooth value noise in [0, 1] with `scale` cells per metre."""
    points = points * scale
    cell = np.floor(points).astype(int)
    share = points - cell
    share = share * share * (3 - 2 * share)
    total = np.zeros(points.shape[:-1])
    for corner in np.ndindex(2, 2, 2):
        total += np.where(corner, share, 1 - share).prod(-1) * LATTICE[tuple(np.moveaxis((cell + corner) % 32, -1, 0))]
    return total


def ramp(x: Array, start: float, end: float) -> Array:
    t = np.clip((x - start) / (end - start), 0, 1)
    return t * t * (3 - 2 * t)


def mix(a: Array, b: Array, share: Array) -> Array:
    return a + (b - a) * np.asarray(share)[..., None]


def rgb(code: str) -> Array:
    """Linear RGB of a web colour."""
    return decode(np.array(list(bytes.fromhex(code)), float))


def ellipsoid(p: Array, radii: ArrayLike) -> Array:
    """About the distance to an ellipsoid at the origin (Quilez 2008)."""
    k0, k1 = np.linalg.norm(p / radii, axis=-1), np.linalg.norm(p / np.square(radii), axis=-1)
    return k0 * (k0 - 1) / np.maximum(k1, 1e-12)


def solid(shape: Callable[[Array], Look], hull: ArrayLike, margin: float, caution: float = 0.5) -> Surface:
    """A sphere-traced surface that stays within `margin` of the points `hull`.

    Each step is `caution` times the distance, for most shapes only come near their true distance.
    """
    centre = np.mean(hull, 0)
    radius = np.linalg.norm(np.asarray(hull) - centre, axis=-1).max() + margin

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
        hit = np.isfinite(result)
        at = origin + result[hit][:, None] * rays[hit]
        gradient = np.stack([shape(at + e)[0] - shape(at - e)[0] for e in 1e-6 * np.eye(3)], -1)
        normals[hit] = gradient / np.linalg.norm(gradient, axis=-1, keepdims=True)
        return result, normals

    return Surface(meet, lambda p: shape(p)[1]())


def vase(p: Array) -> Look:
    """A shell around PROFILE, thicker at its lip."""
    y, r = np.clip(p[..., 1] - WALL, 0, HEIGHT), np.hypot(p[..., 0], p[..., 2])
    across = (r - PROFILE(y)) / np.sqrt(1 + SLOPE(y) ** 2)
    lip = 0.002 * np.exp(-(((y - HEIGHT) / 0.008) ** 2))
    return np.hypot(across, p[..., 1] - WALL - y) - WALL - lip, lambda: painted(p, across > 0)


def painted(p: Array, outside: Array) -> Array:
    """Cobalt on a cream glaze: a vine with blossoms around the belly, rows of petals, and bands between."""
    p = p + 0.0016 * (np.stack([noise(p + k, 60, 60, 60) for k in (0, 1, 2)], -1) - 0.5)  # a hand, no machine
    y, turn = p[..., 1], np.arctan2(p[..., 0], p[..., 2]) / (2 * np.pi)
    dark, wash = np.zeros(y.shape, bool), np.zeros(y.shape)
    for low, high in (
        (0, 0.012), (0.0147, 0.0163), (0.07, 0.0718), (0.073, 0.0759), (0.1717, 0.1733), (0.1746, 0.1774),
        (0.2243, 0.2267), (0.2285, 0.2345), (0.2357, 0.2373), (0.3027, 0.3043), (0.3056, 0.3084), (0.3225, 0.327),
    ):  # fmt: skip
        dark |= (y > low) & (y < high)
    for count, shift, base, tip in ((14, 0, 0.018, 0.066), (12, 0.5, 0.222, 0.178), (12, 0, 0.239, 0.3)):
        s, x = (y - base) / (tip - base), np.abs((turn * count + shift) % 1 - 0.5) * 2
        x = np.where((s > 0) & (s < 1), x / np.sqrt(np.clip(1 - s * s, 1e-9, 1)), 1)
        dark |= (x > 0.76) & (x < 0.94)
        wash = np.where(x < 0.55, 0.55 + 0.4 * s, wash)
    repeat = 2 * np.pi / 5 * PROFILE(np.clip(y, 0, HEIGHT))
    x, h = ((turn * 5 + 0.5) % 1 - 0.5) * repeat, y - 0.122

    def vine(at: float | Array) -> Array:
        return 0.027 * np.sin(2 * np.pi * at / repeat)

    dark |= (np.abs(h) < 0.046) & (np.abs(h - vine(x)) < 0.0015)
    for at, angle, size in ((31, 1.0, 22), (35, -1.5, 32), (48, 2.4, 26), (50, 0.1, 26), (56, -1.9, 28)):
        for side in (-1, 1):  # the vine looks the same upside down
            leaf = np.exp(-1j * angle) * (side * x - at / 1000 + 1j * (side * h - vine(at / 1000))) / size * 1000
            s, over = np.clip(leaf.real, 0, 1), leaf.imag
            blade = np.abs(over) < 0.9 * s * (1 - s) ** 0.8
            wash = np.where(blade, np.where(over > 0, 0.95, 0.6), wash)
            dark |= blade & (np.abs(over) < 0.02)
    rho, theta = np.hypot(x, h), np.arctan2(h, x) + 0.5
    edge = 0.02 + 0.012 * np.sqrt(np.abs(np.cos(3 * theta)))
    bloom = 0.25 + 0.6 * ramp(np.abs(np.sin(3 * theta)), 0.2, 1) + 0.3 * (1 - rho / 0.032)
    wash = np.where(rho < edge + 0.003, np.where((rho < edge) & (rho > 0.0082), bloom, 0), wash)
    lines = (rho > edge - 0.0016) | (np.abs(rho - 0.0092) < 0.0011) | (rho < 0.0035)
    dark = np.where(rho < edge + 0.003, lines & (rho < edge), dark)
    tone = outside * (0.8 + 0.4 * noise(p, 180, 180, 180))
    colour = mix(rgb("e4ddcb"), rgb("d6d0c4"), noise(p, 25, 25, 25))
    colour = mix(colour, rgb("4a68b0"), np.clip(wash * tone, 0, 1))
    return mix(colour, rgb("182876"), np.clip(dark * 1.15 * tone, 0, 0.97))


def table(p: Array) -> Look:
    """A wooden disc with a rounded edge, 36 cm wide, its top at y = 0."""
    x, y = np.hypot(p[..., 0], p[..., 2]) - 0.171, np.abs(p[..., 1] + 0.011) - 0.002

    def wood() -> Array:
        warp = 0.05 * noise(p, 3, 9, 9) + 0.006 * noise(p + 1, 12, 40, 40)
        year = (75 * (np.hypot(p[..., 1] + 0.11, 0.8 * p[..., 2] + 0.04) + warp)) % 1
        late = ramp(year, 0.35, 0.92) * (1 - ramp(year, 0.92, 1))
        colour = mix(rgb("b27646"), rgb("704022"), 0.75 * late + 0.25 * noise(p, 25, 500, 500))
        return mix(colour, rgb("4e2c18"), 0.5 * ramp(noise(p + 1, 70, 900, 900), 0.72, 0.85))

    return np.hypot(np.maximum(x, 0), np.maximum(y, 0)) + np.minimum(np.maximum(x, y), 0) - 0.009, wood


def nearest(curve: Array, p: Array) -> tuple[Array, Array, Array]:
    """Where a quadratic Bezier curve, control points (3, 3), comes nearest: parameter, offset to p, tangent."""
    a, b, c = curve[0], 2 * (curve[1] - curve[0]), curve[0] - 2 * curve[1] + curve[2]
    starts = np.linspace(0, 1, 9)[:, None]
    away = p[..., None, :] - (a + starts * (b + starts * c))
    t = starts[np.argmin((away * away).sum(-1), -1)]
    for _ in range(4):  # Newton
        offset, tangent = p - (a + t * (b + t * c)), b + 2 * t * c
        bend = (tangent * tangent - 2 * offset * c).sum(-1, keepdims=True)
        t = np.clip(t + (offset * tangent).sum(-1, keepdims=True) / np.maximum(bend, 1e-3), 0, 1)
    return t[..., 0], p - (a + t * (b + t * c)), b + 2 * t * c


def axes(up: ArrayLike, ahead: ArrayLike) -> Array:
    """(..., 3, 3) right-handed unit axes in rows: the second is `up`, the third points roughly ahead."""
    x = np.cross(up, ahead)
    rows = np.stack([x, up + 0 * x, np.cross(x, up)], -2)
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


def leaf(curve: Array, width: float, side: ArrayLike, thick: float = 0.0019) -> Surface:
    """A blade along a curve, folded along its middle; `side` points across it. Without width it is a stem."""

    def shape(p: Array) -> Look:
        t, offset, tangent = nearest(curve, p)
        x, y, z = (axes(np.cross(tangent, side), tangent) @ offset[..., None])[..., 0].T
        half = width * (0.3 + 0.7 * np.sin(np.pi * t**0.8) + 0.1 * t) * (1 - t**4)
        lift = y - 0.35 * (np.sqrt(x * x + 1e-5) - 0.003) + 0.12 * x * np.sin(9 * t)

        def green() -> Array:
            vein = 0.5 + 0.5 * np.sin(1100 * x + 3 * noise(p, 40, 40, 40))
            colour = mix(rgb("305c2e"), rgb("54843e"), 0.55 * vein + 0.45 * noise(p, 50, 50, 50))
            return mix(colour, rgb("84a65c"), 0.7 * np.exp(-((x / 0.0018) ** 2)) * (1 - 0.5 * t))

        return np.sqrt(np.maximum(np.abs(x) - half, 0) ** 2 + z * z + lift * lift) - thick, green

    return solid(shape, curve, width + thick)


def around(p: Array, origin: ArrayLike, up: ArrayLike) -> tuple[Array, Array, Array]:
    """Height, radius and angle about an axis through `origin`."""
    x, y, z = axes(up, (0.1, 0.3, 1)) @ (p - origin).T
    return y, np.hypot(x, z), np.arctan2(z, x)


def tulip(head: Array, up: Array, size: float, turn: float, body: Array, rim: Array) -> Surface:
    """Two rings of three pointed petals on an egg."""

    def shape(p: Array) -> Look:
        y, rho, phi = around(p / size, head / size, up)
        h, ring = np.clip(y, 0, 1), np.array([[0], [1]])
        f = (phi + turn + ring * np.pi / 3) % (2 * np.pi / 3) - np.pi / 3  # from the petal's middle
        half = 0.43 * (1 - h**2.6) ** 0.8
        egg = np.hypot(rho / (0.385 - 0.03 * ring), (y - 0.4) / np.where(y < 0.4, 0.4, 0.92)) - 1
        lift = 0.38 * egg - 0.09 * h**5 + 0.05 * f * f * (1 - ring) + 0.012 * np.exp(-((f / 0.12) ** 2))
        over = np.hypot(np.maximum(rho * np.abs(f) - half, 0), np.maximum(y - 1, 0))
        petals, edges = np.hypot(lift, over), rho * np.abs(f) / np.maximum(half, 0.02)

        def flamed() -> Array:
            edge = np.where(petals[0] < petals[1], *edges)
            flame = noise(np.stack([edge, h, 0 * h + turn], -1), 7, 2.2, 1) - 0.5
            colour = mix(body, rim, ramp(edge + 0.55 * flame + 0.35 * (h - 0.6), 0.62, 1.05))
            return mix(colour, rgb("cebc5c"), 1 - ramp(h + 0.15 * flame, 0.03, 0.2))

        return (np.minimum(*petals) - 0.018) * size, flamed

    return solid(shape, [head], 1.2 * size)


def daisy(head: Array, up: Array, size: float, turn: float, petal: Array) -> Surface:
    """Two rings of petals around a domed heart."""

    def shape(p: Array) -> Look:
        y, rho, phi = around(p / size, head / size, up)
        place, ring = phi / (2 * np.pi) * 13, np.array([[0], [0.5]])
        f = ((place + ring) % 1 - 0.5) * 2 * np.pi / 13  # from the petal's middle
        odd = np.sin(5 * phi + turn) * np.sin(3 * phi + 2 * turn)  # no two petals rise alike
        x, z = rho * np.cos(f), rho * np.sin(f)
        lift = y - 0.25 * x * x + 0.18 * ring - 0.09 * odd * x + 0.014 * np.cos(42 * z) - 0.4 * z * z
        petals = ellipsoid(np.stack([x - 0.58, lift, z], -1), (0.42, 0.045, 0.15))
        spirals = np.sin(8 * phi + 26 * rho) * np.sin(13 * phi - 20 * rho) * ramp(rho, 0.02, 0.15)
        heart = ellipsoid(np.stack([rho, y - 0.02], -1), (0.27, 0.15)) - 0.009 * spirals

        def colour() -> Array:
            tones = (1 - 0.25 * ring) * (1 - 0.3 * ramp(np.hypot((x - 0.58) / 0.42, z / 0.15), 0.7, 1.05))
            tone = np.where(petals[0] < petals[1], *tones) * (0.6 + 0.4 * ramp(rho, 0.25, 0.6))
            gold = mix(rgb("bc6c18"), rgb("e2b034"), ramp(rho + 0.06 * spirals, 0.08, 0.28))
            return np.where((heart < np.minimum(*petals))[:, None], gold, petal * tone[:, None])

        return np.minimum(np.minimum(*petals), heart) * size, colour

    return solid(shape, [head], 1.12 * size)


def scene() -> list[Surface]:
    """All parts: the vase, the table, then the flowers."""
    coral, blush, plum, lilac = rgb("c42c28"), rgb("e8a878"), rgb("8e2458"), rgb("dea0bc")
    white, apricot = rgb("e8e2d6"), rgb("e8964a")
    parts = [solid(vase, [(0, 0.17, 0)], 0.2), solid(table, [(0, 0, 0)], 0.2, 0.9)]
    flowers = (
        (tulip, (-0.08, 0.41, -0.02), (-0.17, 0.465, -0.03), (-9, 5.5, -1), 0.13, 0.3, coral, blush),
        (tulip, (-0.03, 0.42, -0.03), (-0.06, 0.478, -0.06), (-3, 6.5, -3), 0.135, 0.9, plum, lilac),
        (tulip, (0.04, 0.42, -0.02), (0.085, 0.48, -0.05), (4.5, 6, -3), 0.135, 2.2, coral, blush),
        (tulip, (0.09, 0.4, -0.01), (0.19, 0.445, -0.02), (10, 4.5, -1), 0.125, 0.7, plum, lilac),
        (daisy, (-0.05, 0.42, 0), (-0.135, 0.405, 0.05), (-0.3, 0.35, 1), 0.082, 1, white),
        (daisy, (0, 0.42, 0), (0.01, 0.44, 0.1), (0.02, 0.45, 1), 0.082, 2, apricot),
        (daisy, (0.06, 0.42, 0), (0.145, 0.38, 0.07), (0.2, 0.25, 1), 0.078, 3, white),
    )
    for kind, knee, head, up, *rest in flowers:
        curve = np.array([(0.3 * knee[0], 0.24, knee[2]), knee, head])
        parts += [leaf(curve, 0, (0, 0, 1), 0.0036), kind(curve[2], np.array(up), *rest)]
    for knee, tip, width, side in (
        ((-0.1, 0.5, 0), (-0.29, 0.36, 0.02), 0.027, (0.6, 1, 0.3)),
        ((0.1, 0.5, 0), (0.29, 0.33, 0.02), 0.027, (-0.6, 1, 0.3)),
        ((0, 0.5, -0.05), (0.01, 0.605, -0.08), 0.028, (1, 0, 0.3)),
        ((-0.03, 0.45, -0.05), (-0.25, 0.53, -0.06), 0.028, (1, 1, 0.2)),
        ((0.04, 0.45, -0.05), (0.22, 0.56, -0.06), 0.028, (1, -1, 0.2)),
        ((-0.09, 0.43, 0.03), (-0.16, 0.26, 0.09), 0.022, (1, 0.4, -0.3)),
    ):
        parts.append(leaf(np.array([(0.06 * tip[0], 0.29, 0), knee, tip]), width, side))
    return parts


def picture() -> tuple[Array, Array]:
    """Linear albedo (h, w, 3) and depth (h, w), metres, 0 = nothing.

    Depth is that of the pixels' centres; each albedo is the mean of 4x4 rays that meet the tangent plane of the
    pixel's own surface, so that the paint is smooth and the outlines stay hard.
    """
    parts = scene()
    hits = trace(parts, CAMERA, POSE)
    eye, right, down = POSE[:3, 3], POSE[:3, 0] / CAMERA.fx, POSE[:3, 1] / CAMERA.fy
    albedo = np.zeros(hits.points.shape)
    for k, part in enumerate(parts):
        mine = hits.surface == k
        away, n, z = hits.points[mine] - eye, hits.normals[mine], hits.depth[mine][:, None]
        for i, j in np.ndindex(4, 4):
            ray = away / z + right * (i - 1.5) / 4 + down * (j - 1.5) / 4
            t = (away * n).sum(-1, keepdims=True) / (ray * n).sum(-1, keepdims=True)
            t = z + np.clip(t - z, -0.004, 0.004)  # a plane seen edge-on runs away
            albedo[mine] += part.albedo(eye + t * ray) / 16
    return albedo, hits.depth


def main(folder: Path = FOLDER) -> None:
    """Write color.png, depth.tif and intrinsics.json."""
    albedo, depth = picture()
    mantissa, exponent = np.frexp(depth)
    depth = np.ldexp(np.round(mantissa * 2**20) / 2**20, exponent)  # 20 bits: precise to 1e-6, and they pack well
    folder.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.round(encode(albedo)).astype(np.uint8)).save(folder / "color.png", optimize=True)
    Image.fromarray(depth.astype(np.float32)).save(folder / "depth.tif", compression="tiff_adobe_deflate")
    values = {name: getattr(CAMERA, name) for name in ("width", "height", "fx", "fy", "cx", "cy")}
    (folder / "intrinsics.json").write_text(json.dumps(values | {"depth_scale": 1.0}, indent=2) + "\n")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
