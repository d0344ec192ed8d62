"""Draws a cloud of 2 048 points as balls, by this package and by Mitsuba: one camera, one sun, one sky.

Run it by a Python that has Mitsuba (`pip install mitsuba`) and this package, from the repository's root:

    python -m tests.truth.make_balls FOLDER

It writes FOLDER/knot.ply, balls.png and balls_mitsuba.png, and prints what each has taken.
"""

from __future__ import annotations

import math
import os
import sys
import time
from pathlib import Path

import numpy as np
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.scene.graph import scene_of

COUNT, RADIUS = 2048, 0.035
SUN, ANGLE = np.array([0.45, 0.35, -0.82]), 14.0  # which way it shines, its size in degrees
SKY = 0.3  # ambient light; the sun gives the rest of what a white ground shows
SAMPLES = 64  # of Mitsuba, a pixel


def knot() -> ps.PointCloud:
    """Points evenly on a trefoil knot, z up."""
    t = np.linspace(0, 2 * np.pi, 40_000, endpoint=False)
    line = np.stack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)], -1) / 3
    along = np.gradient(line, axis=0)
    aside = np.cross(along, (0.0, 0.0, 1.0))
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    above = np.cross(aside, along)
    above /= np.linalg.norm(above, axis=1, keepdims=True)
    rng = np.random.default_rng(11)
    turn = rng.uniform(0, 2 * np.pi, len(t))
    many = line + 0.2 * (np.cos(turn)[:, None] * aside + np.sin(turn)[:, None] * above)
    chosen, gap = [0], np.linalg.norm(many - many[0], axis=1)
    while len(chosen) < COUNT:  # the farthest from all so far
        chosen.append(int(gap.argmax()))
        gap = np.minimum(gap, np.linalg.norm(many - many[chosen[-1]], axis=1))
    share = t[chosen] / (2 * np.pi)
    hue = 0.5 + 0.5 * np.cos(2 * np.pi * (share[:, None] + np.array([0.0, 0.33, 0.67])))
    return ps.PointCloud(many[chosen].astype(np.float32), colors=np.rint(60 + 180 * hue).astype(np.uint8), up="z")


def draw(cloud: ps.PointCloud) -> np.ndarray:
    """The picture by this package: 16 samples."""
    toward = -SUN / np.linalg.norm(SUN)
    material = ps.Material(ambient=SKY, diffuse=(1 - SKY) / toward[2], specular=0)
    sun = ps.Light(direction=tuple(SUN), shadow=True, angle=ANGLE)
    return ps.render(cloud, sun, material, splat="ball", point_size=RADIUS, ground=True, background="white", samples=16)


def draw_by_mitsuba(cloud: ps.PointCloud) -> np.ndarray:
    """The same by path tracing."""
    import mitsuba as mi

    mi.set_variant(
        "llvm_ad_rgb" if "llvm_ad_rgb" in mi.variants() and os.environ.get("DRJIT_LIBLLVM_PATH") else "scalar_rgb"
    )
    scene = scene_of(cloud)
    assert scene.camera is not None
    toward = -SUN / np.linalg.norm(SUN)
    far, half = 200.0, math.radians(ANGLE / 2)
    radiance = (1 - SKY) / toward[2] / math.sin(half) ** 2
    linear = np.where(
        cloud.colors / 255 < 0.04045, cloud.colors / 255 / 12.92, ((cloud.colors / 255 + 0.055) / 1.055) ** 2.4
    )
    eye, ahead, up = scene.pose[:3, 3], scene.pose[:3, 2], -scene.pose[:3, 1]
    things = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 4},
        "sky": {"type": "constant", "radiance": SKY},
        "sun": {
            "type": "sphere", "center": list(far * toward), "radius": far * math.tan(half),
            "emitter": {"type": "area", "radiance": radiance},
        },
        "ground": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().translate([0, 0, float(cloud.positions[:, 2].min())]).scale(60),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [1, 1, 1]}},
        },
        "camera": {
            "type": "perspective", "fov": 45, "fov_axis": "y",
            "to_world": mi.ScalarTransform4f().look_at(list(eye), list(eye + ahead), list(up)),
            "film": {"type": "hdrfilm", "width": scene.camera.width, "height": scene.camera.height},
            "sampler": {"type": "independent", "sample_count": SAMPLES},
        },
    }  # fmt: skip
    for k, (at, color) in enumerate(zip(cloud.positions.tolist(), linear.tolist(), strict=True)):
        bsdf = {"type": "diffuse", "reflectance": {"type": "rgb", "value": color}}
        things[f"ball{k}"] = {"type": "sphere", "center": at, "radius": RADIUS, "bsdf": bsdf}
    image = mi.render(mi.load_dict(things))
    return np.array(mi.Bitmap(image).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, srgb_gamma=True))


def main() -> None:
    folder, cloud = Path(sys.argv[1]), knot()
    ps.save_points(folder / "knot.ply", cloud)
    for name, how in (("balls", draw), ("balls_mitsuba", draw_by_mitsuba)):
        began = time.process_time()
        picture = how(cloud)
        print(f"{name}: {time.process_time() - began:.1f} CPU s")
        Image.fromarray(picture[..., :3]).save(folder / f"{name}.png")


if __name__ == "__main__":
    main()
