"""The built-in scene: tulips and daisies in a painted vase, ray-traced into a colour and a depth picture.

The source work lit a point object of about 80 000 points; vase and flowers cover as many pixels here. Colours
are pure albedo, without any light. World: metres, y up, origin where the vase stands.
`python -m pointshade_gl.bench.vase [FOLDER]` writes the files.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from numpy.polynomial import Polynomial
from PIL import Image

from ..scene.camera import Camera, orbit_pose
from .solids import Sample, Vector, around, axes, ellipsoid, mix, nearest, noise, ramp, rgb, solid
from .tracing import Array, Surface, encode, trace

FOLDER = Path(__file__).parents[2] / "assets" / "vase"
CAMERA = Camera(650, 650, 319.5, 239.5, 640, 480)
UPRIGHT = np.array([(1, 0, 0, 0), (0, -1, 0, 0.272), (0, 0, -1, 1), (0, 0, 0, 1.0)])  # y down, as in a camera
POSE = orbit_pose(UPRIGHT, (0, 0.272, 0), pitch=13)

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
    outside = np.where(across > 0, 1.0, 0.0)
    return np.hypot(across, p[..., 1] - WALL - y) - WALL - lip, lambda: painted(p, outside)


def painted(p: Array, outside: Array) -> Array:
    """Cobalt on a cream glaze: a vine with blossoms around the belly, rows of petals, and bands between."""
    p = p + 0.0016 * (np.stack([noise(p + k, 60, 60, 60) for k in (0, 1, 2)], -1) - 0.5)  # as if painted by hand
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
    for mm, angle, size in ((31, 1.0, 22), (35, -1.5, 32), (48, 2.4, 26), (50, 0.1, 26), (56, -1.9, 28)):
        for side in (-1, 1):  # the vine looks the same upside down
            root = mm / 1000 + 1j * vine(mm / 1000)
            leaf = (side * (x + 1j * h) - root) * np.exp(-1j * angle) / size * 1000
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


def table(p: Array) -> Sample:
    """A wooden disc with a rounded edge, 36 cm wide, its top at y = 0."""
    x, y = np.hypot(p[..., 0], p[..., 2]) - 0.171, np.abs(p[..., 1] + 0.011) - 0.002

    def wood() -> Array:
        warp = 0.05 * noise(p, 3, 9, 9) + 0.006 * noise(p + 1, 12, 40, 40)
        year = (75 * (np.hypot(p[..., 1] + 0.11, 0.8 * p[..., 2] + 0.04) + warp)) % 1
        late = ramp(year, 0.35, 0.92) * (1 - ramp(year, 0.92, 1))
        colour = mix(rgb("b27646"), rgb("704022"), 0.75 * late + 0.25 * noise(p, 25, 500, 500))
        return mix(colour, rgb("4e2c18"), 0.5 * ramp(noise(p + 1, 70, 900, 900), 0.72, 0.85))

    return np.hypot(np.maximum(x, 0), np.maximum(y, 0)) + np.minimum(np.maximum(x, y), 0) - 0.009, wood


def leaf(curve: Array, width: float, side: Vector, thick: float = 0.0019) -> Surface:
    """A blade along a curve, folded along its middle; `side` points across it. Without width it is a stem."""

    def shape(p: Array) -> Sample:
        t, offset, tangent = nearest(curve, p)
        x, y, z = (axes(np.cross(tangent, side), tangent) @ offset[..., None])[..., 0].T
        half = width * (0.1 + np.sin(np.pi * t**0.9) ** 1.3) * (1 - t**6)
        lift = y - 0.35 * (np.sqrt(x * x + 1e-5) - 0.003) + 0.12 * x * np.sin(9 * t)

        def green() -> Array:
            vein = 0.5 + 0.5 * np.sin(1100 * x + 3 * noise(p, 40, 40, 40))
            colour = mix(rgb("305c2e"), rgb("54843e"), 0.55 * vein + 0.45 * noise(p, 50, 50, 50))
            return mix(colour, rgb("84a65c"), 0.7 * np.exp(-((x / 0.0018) ** 2)) * (1 - 0.5 * t))

        return np.sqrt(np.maximum(np.abs(x) - half, 0) ** 2 + z * z + lift * lift) - thick, green

    return solid(shape, curve, width + thick)


def tulip(head: Array, up: Array, size: float, turn: float, body: Array, rim: Array) -> Surface:
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

        def flamed() -> Array:
            edge = np.where(petals[0] < petals[1], *edges)
            flame = noise(np.stack([edge, h, 0 * h + turn], -1), 7, 2.2, 1) - 0.5
            colour = mix(body, rim, ramp(edge + 0.55 * flame + 0.35 * (h - 0.6), 0.62, 1.05))
            return mix(colour, rgb("cebc5c"), 1 - ramp(h + 0.15 * flame, 0.03, 0.2))

        return (np.minimum(*petals) - 0.018) * size, flamed

    return solid(shape, head[None], 1.2 * size)


def daisy(head: Array, up: Array, size: float, turn: float, petal: Array, gold: Array) -> Surface:
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

        def colour() -> Array:
            tones = (1 - 0.25 * ring) * (1 - 0.25 * ramp(np.hypot((x - 0.58) / 0.42, z / 0.15), 0.7, 1.05))
            tone = np.where(petals[0] < petals[1], *tones)[:, None]
            blade = tone * mix(petal * (0.7, 0.75, 0.35), petal, ramp(rho, 0.22, 0.55))
            middle = mix(gold * (0.7, 0.35, 0.25), gold, ramp(rho + 0.06 * spirals, 0.08, 0.28))
            return np.where((heart < np.minimum(*petals))[:, None], middle, blade)

        return np.minimum(np.minimum(*petals), heart) * size, colour

    return solid(shape, head[None], 1.12 * size)


def scene() -> list[Surface]:
    """All parts: the vase, the table, then the flowers."""
    coral, blush, plum, lilac = rgb("c42c28"), rgb("e8a878"), rgb("8e2458"), rgb("dea0bc")
    white, apricot, gold = rgb("e8e2d6"), rgb("e8964a"), rgb("e2b034")
    parts = [solid(vase, np.array([[0, 0.17, 0]]), 0.2, 0.8), solid(table, np.zeros((1, 3)), 0.2, 0.9)]
    flowers = (
        (tulip, (-0.08, 0.41, -0.02), (-0.17, 0.465, -0.03), (-9, 5.5, -1), 0.13, 0.3, coral, blush),
        (tulip, (-0.03, 0.42, -0.03), (-0.06, 0.478, -0.06), (-3, 6.5, -3), 0.135, 0.9, plum, lilac),
        (tulip, (0.04, 0.42, -0.02), (0.085, 0.48, -0.05), (4.5, 6, -3), 0.135, 2.2, coral, blush),
        (tulip, (0.09, 0.4, -0.01), (0.19, 0.445, -0.02), (10, 4.5, -1), 0.125, 0.7, plum, lilac),
        (daisy, (-0.05, 0.42, 0), (-0.135, 0.405, 0.05), (-0.3, 0.35, 1), 0.082, 1, white, gold),
        (daisy, (0, 0.42, 0), (0.01, 0.44, 0.1), (0.02, 0.45, 1), 0.082, 2, apricot, gold),
        (daisy, (0.06, 0.42, 0), (0.145, 0.38, 0.07), (0.2, 0.25, 1), 0.078, 3, white, gold),
    )
    for kind, knee, head, up, size, turn, inner, outer in flowers:
        curve = np.array([(0.3 * knee[0], 0.3, knee[2]), knee, head])
        parts += [leaf(curve, 0, (0, 0, 1), 0.0036), kind(curve[2], np.array(up), size, turn, inner, outer)]
    for knee, tip, width, side in (
        ((-0.1, 0.5, 0), (-0.29, 0.36, 0.02), 0.027, (0.6, 1, 0.3)),
        ((0.1, 0.5, 0), (0.29, 0.33, 0.02), 0.027, (-0.6, 1, 0.3)),
        ((0, 0.5, -0.05), (0.01, 0.605, -0.08), 0.028, (1, 0, 0.3)),
        ((-0.03, 0.45, -0.05), (-0.25, 0.53, -0.06), 0.028, (1, 0.5, 0.2)),
        ((0.04, 0.45, -0.05), (0.22, 0.56, -0.06), 0.028, (1, -0.5, 0.2)),
        ((-0.09, 0.43, 0.03), (-0.16, 0.26, 0.09), 0.022, (1, 0.4, -0.3)),
    ):
        parts.append(leaf(np.array([(0.06 * tip[0], 0.3, 0), knee, tip]), width, side))
    return parts


def picture() -> tuple[Array, Array]:
    """Linear albedo (h, w, 3) and depth (h, w), metres, 0 = nothing.

    Depth is that of the pixels' centres; each albedo is the mean of 4x4 rays that meet the tangent plane
    of the pixel's own surface, so that the paint is smooth and the outlines stay hard.
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
            t = z + np.clip(t - z, -0.004, 0.004)  # the plane of a surface seen edge-on runs far away
            albedo[mine] += part.albedo(eye + t * ray) / 16
    return albedo, hits.depth


def main(folder: Path = FOLDER) -> None:
    """Write color.png, depth.tif and intrinsics.json."""
    albedo, depth = picture()
    mantissa, exponent = np.frexp(depth)
    depth = np.ldexp(np.round(mantissa * 2**20) / 2**20, exponent)  # 20 bits: 1e-6, and they pack well
    folder.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.round(encode(albedo)).astype(np.uint8)).save(folder / "color.png", optimize=True)
    Image.fromarray(depth.astype(np.float32)).save(folder / "depth.tif", compression="tiff_adobe_deflate")
    values = {name: getattr(CAMERA, name) for name in ("width", "height", "fx", "fy", "cx", "cy")}
    (folder / "intrinsics.json").write_text(json.dumps(values | {"depth_scale": 1.0}, indent=2) + "\n")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
