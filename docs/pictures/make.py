"""Draw pictures of conventions.md, how-it-works.md, rings.md and unusual-depth.md: python docs/pictures/make.py

They lie beside this file. The drawings are SVG on a pale card, so that they can be read on white and on black.
normal_colours.png, rings.jpg and ends.jpg come from the program; the errors of the latter two are printed.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.scene.camera import orbit_pose

HERE = Path(__file__).parent
INK, FAINT, CARD = "#1f2933", "#8a94a0", "#f6f7f9"
RED, GREEN, BLUE, GOLD = "#c0392b", "#23803a", "#2a5fc4", "#a86a00"
Place = tuple[float, float]


def text(
    at: Place, words: str, size: int = 17, color: str = INK, anchor: str = "middle", weight: str = "normal"
) -> str:
    look = f'font-size="{size}" fill="{color}" text-anchor="{anchor}" font-weight="{weight}"'
    return f'<text x="{at[0]:.1f}" y="{at[1]:.1f}" {look}>{words}</text>'


def line(start: Place, end: Place, color: str = INK, width: float = 2, dash: str = "") -> str:
    dashes = f' stroke-dasharray="{dash}"' if dash else ""
    ends = f'x1="{start[0]:.1f}" y1="{start[1]:.1f}" x2="{end[0]:.1f}" y2="{end[1]:.1f}"'
    return f'<line {ends} stroke="{color}" stroke-width="{width}"{dashes}/>'


def arrow(start: Place, end: Place, color: str = INK, width: float = 3) -> str:
    x, y = end[0] - start[0], end[1] - start[1]
    length = math.hypot(x, y)
    x, y = x / length, y / length
    base = end[0] - 11 * x, end[1] - 11 * y
    corners = [end, (base[0] - 6 * y, base[1] + 6 * x), (base[0] + 6 * y, base[1] - 6 * x)]
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in corners)
    return line(start, base, color, width) + f'<polygon points="{points}" fill="{color}"/>'


def dot(at: Place, color: str = INK, radius: float = 4) -> str:
    return f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="{radius}" fill="{color}"/>'


def box(left: float, top: float, width: float, height: float, fill: str = "none", stroke: str = FAINT) -> str:
    place = f'x="{left}" y="{top}" width="{width}" height="{height}"'
    return f'<rect {place} rx="6" fill="{fill}" stroke="{stroke}" stroke-width="1.5"/>'


def camera(at: Place, towards: Place, color: str = INK) -> str:
    """A camera seen from above or from the side: a triangle that opens to what it looks at."""
    turn = math.degrees(math.atan2(towards[1] - at[1], towards[0] - at[0]))
    shape = f'<path d="M0,0 L26,-14 L26,14 Z" fill="{color}" fill-opacity="0.2" stroke="{color}" stroke-width="2"/>'
    return f'<g transform="translate({at[0]:.1f},{at[1]:.1f}) rotate({turn:.1f})">{shape}</g>'


def save(name: str, width: int, height: int, title: str, *parts: str) -> None:
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}"'
    card = f'<rect width="{width}" height="{height}" rx="10" fill="{CARD}"/>'
    lines = [f'{head} font-family="sans-serif" role="img">', f"<title>{title}</title>", card, *parts, "</svg>"]
    (HERE / name).write_text("\n".join(lines) + "\n", encoding="utf-8")


def axes() -> None:
    right, away, towards = (70, 0), (44, -44), (-44, 44)
    up, down = (0, -70), (0, 70)
    kinds = [
        ("OpenCV", "frames, poses, .npy", {"x": right, "y": down, "z": away}),
        ("OpenGL", ".ply and .glb of frames", {"x": right, "y": up, "z": towards}),
        ("Blender", ".ply --axes blender", {"x": right, "y": away, "z": up}),
        ("DirectX", "colours of normals only", {"x": right, "y": down, "z": towards}),
    ]
    parts = []
    for k, (name, use, ways) in enumerate(kinds):
        x, y = 100 + 240 * (k % 2), 140 + 262 * (k // 2)
        for (label, way), color in zip(ways.items(), (RED, GREEN, BLUE), strict=True):
            parts.append(arrow((x, y), (x + way[0], y + way[1]), color))
            reach = 1.24 if 0 in way else 1.36
            parts.append(text((x + reach * way[0], y + reach * way[1] + 6), label, 19, color, weight="bold"))
        parts += [dot((x, y)), text((x + 20, y - 106), name, 20, weight="bold"), text((x + 20, y + 124), use, 16)]
    save("axes.svg", 480, 540, "axes: up, down and right as in the picture; oblique is away or towards you", *parts)


def pixels() -> None:
    side, left, top = 78, 84, 62
    parts = [box(left + side * u, top + side * v, side, side, "#ffffff") for u in range(4) for v in range(3)]
    for u in range(4):
        for v in range(3):
            at = left + side * (u + 0.5), top + side * (v + 0.5)
            parts += [dot(at, BLUE, 3.5), text((at[0], at[1] + 24), f"{u}, {v}", 15)]
    middle = left + 2 * side, top + 1.5 * side
    parts += [dot(middle, RED, 6), text((middle[0], middle[1] - 12), "cx, cy", 16, RED, weight="bold")]
    for u, words in ((0, "u = -0.5"), (4, "u = 3.5")):
        parts += [line((left + side * u, top - 14), (left + side * u, top), FAINT)]
        parts += [text((left + side * u, top - 22), words, 16)]
    parts += [
        text((left - 10, top + 6), "v = -0.5", 16, anchor="end"),
        text((left - 10, top + 3 * side), "v = 2.5", 16, anchor="end"),
    ]
    words = "4 x 3 pixels: a centred camera has cx = 1.5, cy = 1"
    save("pixels.svg", 480, 350, "pixel centres at integers", *parts, text((240, 332), words, 16))


def depths() -> None:
    eye, scale, slope, plane, surface = (46.0, 262.0), 70, -0.52, 1.4, 5.2

    def at(z: float, beside: float = 0.0) -> Place:
        """The point of the ray at this z, moved aside by some units of the drawing: above 0 to the upper left."""
        length = math.hypot(1, slope)
        return eye[0] + scale * z + beside * slope / length, eye[1] + slope * scale * z - beside / length

    top, below = at(surface), eye[1] + 84
    parts = [
        line(eye, (450, eye[1]), FAINT, 1.5, "5 4"),
        line(eye, top, FAINT, 1.5),
        line((eye[0] + scale * plane, 160), (eye[0] + scale * plane, 304), INK, 2.5),
        text((eye[0] + scale * plane, 324), "image plane, at 1", 16),
        line((top[0] - 20, top[1] - 46), (top[0] + 24, top[1] + 56), INK, 3),
        text((top[0] + 14, top[1] + 80), "surface", 16),
        camera(eye, (400, eye[1])),
        line(eye, (eye[0], below + 8), FAINT, 1.2, "3 4"),
        line(top, (top[0], below + 8), FAINT, 1.2, "3 4"),
        arrow((eye[0], below), (top[0], below), BLUE),
        text((300, below - 10), "z", 20, BLUE, weight="bold"),
        dot(top, INK, 5),
    ]
    for name, first, beside, color in (("ray", 0.0, 12, RED), ("plane", plane, -12, GOLD)):
        parts.append(arrow(at(first, beside), at(surface, beside), color))
        parts.append(
            text(at((first + surface) / 2, (2.2 if beside > 0 else 3.4) * beside), name, 20, color, weight="bold")
        )
    save("depths.svg", 480, 370, "three ways to measure the depth of a point", *parts)


def turns() -> None:
    distance, parts = 130.0, [line((240, 20), (240, 270), "#d5dade", 1.5)]
    for title, word, thing in (("from above", "yaw", (100.0, 90.0)), ("from the side", "pitch", (430.0, 190.0))):
        is_yaw = word == "yaw"
        x, y, z = distance * orbit_pose(None, (0, 0, 1), **{word: 30.0})[:3, 3]
        start = (thing[0], thing[1] + distance) if is_yaw else (thing[0] - distance, thing[1])
        end = (start[0] + x, start[1] - z) if is_yaw else (start[0] + z, start[1] + y)
        path = f"M{start[0]:.1f},{start[1]:.1f} A{distance},{distance} 0 0 {int(not is_yaw)} {end[0]:.1f},{end[1]:.1f}"
        parts += [dot(thing, GOLD, 15), camera(start, thing, FAINT), camera(end, thing, RED)]
        parts.append(f'<path d="{path}" fill="none" stroke="{RED}" stroke-width="2" stroke-dasharray="5 4"/>')
        parts.append(text((end[0] + 22, end[1] + 26 if is_yaw else end[1] - 14), f"{word} 30", 18, RED, weight="bold"))
        parts.append(text((120 if is_yaw else 360, 36), title, 18, weight="bold"))
    save("turns.svg", 480, 290, "where the camera goes", *parts)


def normal_colours() -> None:
    """A ball under a camera, its normals in the colours of the three conventions, beside each other."""
    size = 150
    eye = ps.Camera.from_fov(6, size, size)
    rays = eye.rays() / np.linalg.norm(eye.rays(), axis=-1, keepdims=True)
    middle = np.array([0, 0, 20.0])
    along = rays @ middle
    inside = along**2 - (middle @ middle - 1)
    depth = np.where(inside > 0, (along - np.sqrt(np.maximum(inside, 0))) * rays[..., 2], 0).astype(np.float32)
    normals = ps.estimate_normals(ps.Frame(None, depth, eye))
    balls = []
    for name in ("opengl", "directx", "opencv"):
        path = HERE / "ball.png"
        ps.save_normals(path, normals, axes=name)
        with Image.open(path) as ball:
            balls.append(np.asarray(ball))
        path.unlink()
    ps.save_image(HERE / "normal_colours.png", np.concatenate(balls, 1))


def balls_before_a_wall(eye: ps.Camera) -> tuple[np.ndarray, np.ndarray]:
    """True depth (h, w) and normals (h, w, 3) of two balls on a floor, before a slanting wall."""
    rays, depths, normals = eye.rays(), [], []
    for normal, far in (((0.35, 0.1, 1), 3), ((0, 1, 0.02), 0.9)):
        along = rays @ normal
        depths.append(np.where(along > 0, far / along, np.inf))
        normals.append(np.broadcast_to(-np.array(normal) / np.linalg.norm(normal), rays.shape))
    for middle, radius in (((-0.5, 0.2, 1.9), 0.45), ((0.6, 0.45, 2.1), 0.35)):
        along, square = rays @ middle, (rays**2).sum(-1)
        inside = along**2 - square * (np.dot(middle, middle) - radius**2)
        z = np.where(inside > 0, (along - np.sqrt(inside.clip(0))) / square, np.inf)
        depths.append(z)
        normals.append((rays * np.where(inside > 0, z, 0)[..., None] - middle) / radius)
    nearest = np.argmin(depths, axis=0)
    return np.min(depths, axis=0), np.take_along_axis(np.stack(normals), nearest[None, ..., None], 0)[0]


def rings() -> None:
    """Inverse depth of 8 bits: lit with other normals, and with other ends than the true ones."""
    eye = ps.Camera.from_fov(50, 640, 480)
    z, truth = balls_before_a_wall(eye)
    levels = np.rint(255 * (1 / z - 1 / z.max()) / (1 / z.min() - 1 / z.max())).astype(np.uint8)

    def lit(method: str, near: float, far: float) -> np.ndarray:
        given = {"near": near, "far": far, "depth_kind": "inverse"}
        frame = ps.load_frame(depth=levels, intrinsics=eye, **given)
        normals = ps.estimate_normals(frame, method)
        off = np.degrees(np.arccos((normals * truth).sum(-1).clip(-1, 1)))
        sys.stdout.write(f"{method}, {near:.3g} to {far:.3g} m: {np.nanmean(off):.3g} degrees off\n")
        return ps.render(frame, ps.Light(direction=(1, 1, 1.2)), normals=method)[..., :3]

    ends = float(z.min()), float(z.max())
    good = lit("auto", *ends)
    ps.save_image(HERE / "rings.jpg", np.concatenate([lit("central", *ends), good], 1)[::2, ::2])
    ps.save_image(HERE / "ends.jpg", np.concatenate([lit("auto", 1.0, 10.0), good], 1)[::2, ::2])


def flow() -> None:
    steps = [
        ("depth and colour", "a Frame, checked once; it becomes", "textures", FAINT),
        ("surface pass", "noise is measured; then normals,", "depth and certainty of each pixel", BLUE),
        ("splats", "each pixel's square, carried into the", "view and into each light's shadow map", BLUE),
        ("resolve", "each pixel of the view looks back into", "the frame: normal, colour, depth", BLUE),
        ("light", "Phong, shadows, environment: once a", "pixel, in linear light", BLUE),
        ("picture", "samples averaged, exposure, tone,", "sRGB: NumPy, a file, the window", FAINT),
    ]
    again = ["", "another frame", "another camera", "another camera", "another light", ""]
    parts = []
    for k, (name, first, second, color) in enumerate(steps):
        top = 16 + 104 * k
        parts += [
            box(16, top, 318, 80, "#ffffff", color),
            text((30, top + 25), name, 18, color if color == BLUE else INK, "start", "bold"),
        ]
        parts += [text((30, top + 48), first, 15, anchor="start"), text((30, top + 68), second, 15, anchor="start")]
        if k:
            parts.append(arrow((175, top - 24), (175, top - 2), INK, 2.5))
        if again[k]:
            parts += [
                arrow((372, top + 40), (338, top + 40), GOLD, 2.5),
                text((428, top + 36), again[k].split()[0], 15, GOLD),
            ]
            parts.append(text((428, top + 55), again[k].split()[1], 15, GOLD))
    save("flow.svg", 480, 640, "from depth and colour to a picture, and where each change begins anew", *parts)


if __name__ == "__main__":
    for draw in (axes, pixels, depths, turns, normal_colours, rings, flow):
        draw()
