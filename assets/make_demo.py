"""The demo scene: the built-in vase on a mesh floor beside a mesh column, under a warm spot and a cool sky.

Metres, y up, as in glTF. `python -m assets.make_demo [FOLDER]` writes scene.gltf and its files.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pointshade_gl.bench.scenes import UPRIGHT, VASE_POSE
from pointshade_gl.files.access.folders import Folder
from pointshade_gl.files.gltf import save_scene
from pointshade_gl.files.gltf.cameras_and_lights import FLIP, light_place
from pointshade_gl.files.gltf.stored_points import read_frame
from pointshade_gl.scene.appearance import Material
from pointshade_gl.scene.camera import Camera, orbit_pose
from pointshade_gl.scene.graph import Scene
from pointshade_gl.scene.light import Light
from pointshade_gl.scene.node import Node
from pointshade_gl.scene.objects import Mesh, PointObject

FOLDER = Path(__file__).parent / "scene"
FLOOR = -0.022  # thickness of the wooden disc under the vase in its frame
STONE = Material(specular=0.1, shininess=12)
SQUARE = np.array([(0, 1, 2), (0, 2, 3)], np.uint32)
Array = NDArray[np.float64]
Floats = NDArray[np.float32]


def floor(side: float = 2.4, tiles: int = 12) -> Mesh:
    """A square of light and dark tiles with joints between them, in the plane y = 0."""
    chance, size = np.random.default_rng(4), 32
    tone = np.indices((tiles, tiles)).sum(0) % 2 * 0.16 + 0.56 + chance.normal(0, 0.02, (tiles, tiles))
    pixels = np.kron(tone, np.ones((size, size)))
    joint = np.arange(tiles * size) % size == 0
    pixels[joint] = pixels[:, joint] = 0.4
    texture = np.clip(pixels[..., None] * (255, 246, 232), 0, 255).astype(np.uint8)
    x = side / 2
    corners = np.array([(-x, 0, x), (x, 0, x), (x, 0, -x), (-x, 0, -x)], np.float32)
    uv = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], np.float32)
    return Mesh(corners, SQUARE, uv=uv, texture=texture, material=STONE)


def wall(width: float = 2.4, height: float = 1.3) -> Mesh:
    """A plastered wall in the plane z = 0, standing on y = 0."""
    corners = np.array([(-0.5, 0, 0), (0.5, 0, 0), (0.5, 1, 0), (-0.5, 1, 0)], np.float32) * np.array(
        (width, height, 1), np.float32
    )
    return Mesh(corners, SQUARE, color=(0.5, 0.47, 0.42), material=STONE)


def column() -> Mesh:
    """A fluted shaft between round mouldings, 62 cm high, standing on y = 0."""
    t = np.linspace(0, 1, 9)
    shaft = np.column_stack([0.062 - 0.012 * t**1.7, 0.062 + 0.47 * t])
    outlines = [  # radius and height, from below; there is an edge where one ends and the next begins
        [(0.095, 0), (0.095, 0.03)],
        [(0.095, 0.03), (0.074, 0.03)],
        bulge(0.074, 0.046, 0.016),
        [(0.074, 0.062), (0.05, 0.062)],
        shaft,
        bulge(0.05, 0.54, 0.008),
        np.column_stack([0.05 + 0.03 * (1 - np.cos(np.pi / 2 * t)), 0.548 + 0.04 * np.sin(np.pi / 2 * t)]),
        [(0.08, 0.588), (0.092, 0.588)],
        [(0.092, 0.588), (0.092, 0.62)],
        [(0.092, 0.62), (0, 0.62)],
    ]
    parts = [turned(np.array(outline, float), 16 if outline is shaft else 0) for outline in outlines]
    firsts = np.cumsum([0, *(len(positions) for positions, _, _ in parts[:-1])])
    faces = [faces + first for (_, _, faces), first in zip(parts, firsts, strict=True)]
    positions, normals = (np.concatenate(several) for several in list(zip(*parts, strict=True))[:2])
    return Mesh(positions, np.concatenate(faces), normals, color=(0.62, 0.57, 0.48), material=STONE)


def bulge(radius: float, height: float, size: float) -> Array:
    """The outline of a round moulding, a half circle outwards."""
    turn = np.linspace(-np.pi / 2, np.pi / 2, 9)
    return np.column_stack([radius + size * np.cos(turn), height + size * np.sin(turn)])


def turned(outline: Array, flutes: int, around: int = 96) -> tuple[Floats, Floats, NDArray[np.uint32]]:
    """Positions, normals and faces of an outline (radius, height), turned about the y axis with that many hollows."""
    angle = np.arange(around) * 2 * np.pi / around
    hollow = 1 - 0.05 * (1 - np.cos(flutes * angle))
    slope = -0.05 * flutes * np.sin(flutes * angle) / hollow  # of the logarithm of the radius
    out, aside = ((np.cos(angle + k), 0 * angle, np.sin(angle + k)) for k in (0, np.pi / 2))
    out, aside = np.column_stack(out), np.column_stack(aside)
    radius, height = outline.T[..., None, None]
    d_radius, d_height = np.gradient(outline, axis=0).T[..., None, None]
    up = np.array([0.0, 1.0, 0.0])
    positions = radius * hollow[:, None] * out + height * up
    normals = d_height * (out - slope[:, None] * aside) - d_radius * up
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    k, ring = np.indices((len(outline) - 1, around))
    a, b = k * around + ring, k * around + (ring + 1) % around
    faces = np.stack([a, a + around, b + around, a, b + around, b], -1)
    return (
        positions.reshape(-1, 3).astype(np.float32),
        normals.reshape(-1, 3).astype(np.float32),
        faces.reshape(-1, 3).astype(np.uint32),
    )


def scene() -> Scene:
    """The whole scene, with a camera to the right of the one that took the vase."""
    vase = PointObject(read_frame({"frame": "vase"}, Folder(FOLDER), print))
    lamp = Light(position=(0, 0, 0), direction=(0, 0, -1), color=(1, 0.72, 0.42), intensity=3.2,
                 attenuation=(0, 0, 1), cone=(20, 32), shadow=True, radius=0.04)  # fmt: skip
    sky = Light(direction=(0, 0, -1), color=(0.5, 0.68, 1), intensity=0.42, shadow=True, angle=15)
    return Scene(
        (
            Node(vase, "vase", VASE_POSE @ FLIP),
            Node(floor(), "floor", at(0.1, FLOOR, 0)),
            Node(wall(), "wall", at(0.1, FLOOR, -0.5)),
            Node(column(), "column", at(-0.34, FLOOR, 0.24) @ np.diag([0.8, 0.8, 0.8, 1])),
            Node(lamp, "lamp", aimed((-1.25, 0.95, 0.8), (0.05, 0.22, 0))),
            Node(sky, "sky", aimed((1.2, 0.9, 0.9), (0, 0.1, 0))),
        ),
        Camera.from_fov(36, 640, 480),
        orbit_pose(UPRIGHT @ at(-0.03, 0, -0.32), (-0.03, 0.24, 0), yaw=8, pitch=16),
        (0.8, 0.9, 1.1),
    )


def at(x: float, y: float, z: float) -> Array:
    """(4, 4) the place of a node."""
    place = np.eye(4)
    place[:3, 3] = x, y, z
    return place


def aimed(eye: tuple[float, float, float], target: tuple[float, float, float]) -> Array:
    """(4, 4) the place of a node whose -z axis points at the target, as glTF's lights do."""
    x, y, z = np.subtract(target, eye).tolist()
    return light_place(Light(position=eye, direction=(x, y, z)))


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    save_scene(folder / "scene.gltf", scene(), fallback=None)
