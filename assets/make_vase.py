"""Makes the built-in vase: paints its surfaces and ray-traces them into a colour and a depth picture.

The source work lit a point object of about 80 000 points; vase and flowers cover as many pixels here. Colours
are pure albedo, without any light. `python -m assets.make_vase [FOLDER [WHOLE]]` writes the files: of the front to
one folder, and frames from all sides to the other.
"""

from __future__ import annotations

import json
import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from pointshade_gl.bench.scenes import HEIGHT, PROFILE, UPRIGHT, VASE_POSE, ramp, vase_scene
from pointshade_gl.bench.tracing import Array, decode, encode, trace
from pointshade_gl.scene.camera import OPENGL, Camera, orbit_pose

FOLDER, WHOLE = Path(__file__).parent / "vase", Path(__file__).parent / "vase_whole"
SIDES = (  # yaw, pitch: of ten such frames those that leave the fewest points unseen from any side, petals' insides too
    (60, 35), (90, 0), (120, 10), (120, 35), (180, 0), (180, 55), (240, 0), (240, 35), (270, 10), (300, 35),
)  # fmt: skip
BACK = 0.12  # share of the way by which these cameras stand farther off: from the front's, flowers would be cut off
STEPS = 2**17  # of depth per metre, .0076 mm: coarser ones are noise to whoever merges the frames
PACKED = {317: 3, 278: 512}  # TIFF: bytes of floats as differences, in one strip
CAMERA = Camera(650, 650, 319.5, 239.5, 640, 480)
LATTICE = np.random.default_rng(2001).random((32, 32, 32))


def noise(points: Array, *scale: float) -> Array:
    """Smooth value noise in [0, 1] with `scale` cells per unit."""
    points = points * scale
    cell = np.floor(points).astype(int)
    share = points - cell
    share = share * share * (3 - 2 * share)
    total = np.zeros(points.shape[:-1])
    for corner in np.ndindex(2, 2, 2):
        i, j, k = np.moveaxis((cell + corner) % 32, -1, 0)
        total += np.where(corner, share, 1 - share).prod(-1) * LATTICE[i, j, k]
    return total


def mix(a: Array, b: Array, share: Array) -> Array:
    """Colours between a and b, one per share."""
    return a + (b - a) * np.asarray(share)[..., None]


def rgb(code: str) -> Array:
    """Linear RGB of a web colour."""
    return decode(np.array(list(bytes.fromhex(code)), float))


def painted(p: Array, across: Array) -> Array:
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
    tone = np.where(across > 0, 1.0, 0.0) * (0.8 + 0.4 * noise(p, 180, 180, 180))
    colour = mix(rgb("e4ddcb"), rgb("d6d0c4"), noise(p, 25, 25, 25))
    colour = mix(colour, rgb("4a68b0"), np.clip(wash * tone, 0, 1))
    return mix(colour, rgb("182876"), np.clip(dark * 1.15 * tone, 0, 0.97))


def wood(p: Array) -> Array:
    warp = 0.05 * noise(p, 3, 9, 9) + 0.006 * noise(p + 1, 12, 40, 40)
    year = (75 * (np.hypot(p[..., 1] + 0.11, 0.8 * p[..., 2] + 0.04) + warp)) % 1
    late = ramp(year, 0.35, 0.92) * (1 - ramp(year, 0.92, 1))
    colour = mix(rgb("b27646"), rgb("704022"), 0.75 * late + 0.25 * noise(p, 25, 500, 500))
    return mix(colour, rgb("4e2c18"), 0.5 * ramp(noise(p + 1, 70, 900, 900), 0.72, 0.85))


def green(p: Array, x: Array, t: Array) -> Array:
    vein = 0.5 + 0.5 * np.sin(1100 * x + 3 * noise(p, 40, 40, 40))
    colour = mix(rgb("305c2e"), rgb("54843e"), 0.55 * vein + 0.45 * noise(p, 50, 50, 50))
    return mix(colour, rgb("84a65c"), 0.7 * np.exp(-((x / 0.0018) ** 2)) * (1 - 0.5 * t))


def flamed(body: Array, rim: Array, _: Array, petals: Array, edges: Array, h: Array, turn: float) -> Array:
    edge = np.where(petals[0] < petals[1], *edges)
    flame = noise(np.stack([edge, h, 0 * h + turn], -1), 7, 2.2, 1) - 0.5
    colour = mix(body, rim, ramp(edge + 0.55 * flame + 0.35 * (h - 0.6), 0.62, 1.05))
    return mix(colour, rgb("cebc5c"), 1 - ramp(h + 0.15 * flame, 0.03, 0.2))


def daisy(petal: Array, gold: Array, _: Array, *at: Array) -> Array:
    petals, heart, ring, x, z, rho, spirals = at
    tones = (1 - 0.25 * ring) * (1 - 0.25 * ramp(np.hypot((x - 0.58) / 0.42, z / 0.15), 0.7, 1.05))
    tone = np.where(petals[0] < petals[1], *tones)[:, None]
    blade = tone * mix(petal * (0.7, 0.75, 0.35), petal, ramp(rho, 0.22, 0.55))
    middle = mix(gold * (0.7, 0.35, 0.25), gold, ramp(rho + 0.06 * spirals, 0.08, 0.28))
    return np.where((heart < np.minimum(*petals))[:, None], middle, blade)


def picture(pose: Array) -> tuple[Array, Array]:
    """Linear albedo (h, w, 3) and depth (h, w), metres, 0 = nothing, that a camera with this pose sees.

    Depth is that of the pixels' centres; each albedo is the mean of 4x4 rays that meet the tangent plane
    of the pixel's own surface, so that the paint is smooth and the outlines stay hard.
    """
    white, gold = rgb("e8e2d6"), rgb("e2b034")
    parts = vase_scene(
        vase=painted,
        table=wood,
        leaf=green,
        coral=partial(flamed, rgb("c42c28"), rgb("e8a878")),
        plum=partial(flamed, rgb("8e2458"), rgb("dea0bc")),
        white=partial(daisy, white, gold),
        apricot=partial(daisy, rgb("e8964a"), gold),
    )
    hits = trace(parts, CAMERA, pose)
    eye, right, down = pose[:3, 3], pose[:3, 0] / CAMERA.fx, pose[:3, 1] / CAMERA.fy
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


def side_pose(yaw: float, pitch: float) -> Array:
    """Of the camera that has gone round the vase, from where the front was taken, and a little back."""
    return orbit_pose(UPRIGHT, (0, 0.272, 0), yaw=yaw, pitch=13 + pitch, dolly=-BACK)


def save_front(folder: Path, color: Array, depth: Array) -> None:
    """Write color.png, depth.tif and intrinsics.json."""
    mantissa, exponent = np.frexp(depth)
    depth = np.ldexp(np.round(mantissa * 2**20) / 2**20, exponent)  # 20 bits: 1e-6, and they pack well
    folder.mkdir(parents=True, exist_ok=True)
    Image.fromarray(color).save(folder / "color.png", optimize=True)
    Image.fromarray(depth.astype(np.float32)).save(folder / "depth.tif", compression="tiff_adobe_deflate")
    values = {name: getattr(CAMERA, name) for name in ("width", "height", "fx", "fy", "cx", "cy")}
    (folder / "intrinsics.json").write_text(json.dumps(values | {"depth_scale": 1.0}, indent=2) + "\n")


def save_side(folder: Path, number: int, color: Array, depth: Array, pose: Array) -> dict[str, Any]:
    """Write what a side shows, and return its entry in transforms.json. pose: in the world of the front's camera.

    The empty surroundings stay: where a frame sees nothing, the others' splats end.
    """
    names = f"color/{number}.webp", f"depth/{number}.tif"
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
    coarse = np.round(color / 3).astype(np.uint8) * 3 if number else color  # a third less bytes, 1 of 255 off
    Image.fromarray(coarse).save(folder / names[0], lossless=True, quality=100, method=6)
    depth_map = Image.fromarray(np.round(depth.astype(np.float32) * STEPS) / np.float32(STEPS))
    depth_map.save(folder / names[1], compression="tiff_adobe_deflate", tiffinfo=PACKED)
    matrix = (np.round(pose @ OPENGL, 12) + 0.0).tolist()
    return {"file_path": names[0], "depth_file_path": names[1], "transform_matrix": matrix}


def main(folder: Path = FOLDER, whole: Path = WHOLE) -> None:
    """Write the front, and all sides as the frames of one folder."""
    frames = []
    for number, pose in enumerate((VASE_POSE, *(side_pose(*side) for side in SIDES))):
        albedo, depth = picture(pose)
        color = np.round(encode(albedo)).astype(np.uint8)
        if number == 0:
            save_front(folder, color, depth)
        frames.append(save_side(whole, number, color, depth, np.linalg.inv(VASE_POSE) @ pose))
    camera = {"w": CAMERA.width, "h": CAMERA.height, "fl_x": CAMERA.fx, "fl_y": CAMERA.fy}
    middle = {"cx": CAMERA.cx + 0.5, "cy": CAMERA.cy + 0.5}  # counted from the picture's corner, as NeRFs do
    head = json.dumps(camera | middle | {"depth_scale": 1.0})
    lines = ",\n".join(map(json.dumps, frames))
    (whole / "transforms.json").write_text(f'{head[:-1]}, "frames": [\n{lines}\n]}}\n')


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:3]))
