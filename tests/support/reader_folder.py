"""What the tests of README and docs/ read and need: blocks, commands, and a folder with what the examples name."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.files.access.known_names import asset

from .cloud_ball import ball
from .cloud_files import las
from .places import README, ROOT
from .posed_views import CAMERA, corner, view_from
from .radiance_files import radiance_file
from .trained_splats import ball_over_floor
from .view_sets import write_views

PAGES = [README, ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]


class Block(NamedTuple):
    """A block of code of a page, such as README.md:12."""

    place: str
    language: str
    text: str


def blocks(language: str) -> list[Block]:
    """All blocks of a language, those in lists without their indent."""
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for match in re.finditer(rf"^([ \t]*)```{language}\n(.*?)^\1```$", text, re.DOTALL | re.MULTILINE):
            line = text.count("\n", 0, match.start()) + 1
            body = re.sub(rf"^{match[1]}", "", match[2], flags=re.MULTILINE)
            found.append(Block(f"{page.name}:{line}", language, body))
    return found


def commands(text: str) -> Iterator[list[str]]:
    """The words of each command of a block for the shell, without comments."""
    for line in text.replace("\\\n", " ").splitlines():
        lexer = shlex.shlex(line, posix=True, punctuation_chars=";&|")
        lexer.whitespace_split = True
        words: list[str] = []
        for word in lexer:
            if set(word) <= set(";&|"):
                yield words
                words = []
            else:
                words.append(word)
        if words:
            yield words


def make_folder(folder: Path) -> None:
    """Write what README and docs/ call by these names. Add here what a new page needs."""
    vase = ps.load_frame("vase")
    half = ps.Frame(vase.color[::2, ::2], vase.depth[::2, ::2], vase.camera.resized(320, 240))
    _write_frame(folder / "my_frame", half)
    shutil.copytree(asset("vase"), folder / "assets/vase")
    (folder / "assets/readme").mkdir()
    scene, rng, middle = corner(), np.random.default_rng(0), (0.0, 0.1, 2.0)

    def view(yaw: float, noise: float = 0.0) -> ps.Frame:
        return view_from(scene, ps.orbit_pose(None, middle, yaw, yaw / 4), noise, rng)

    views = [view(yaw) for yaw in np.linspace(-15, 15, 8)]
    for name in ("my_sequence", "my_room"):
        write_views(folder / name, views)
    np.savetxt(folder / "pose.txt", ps.orbit_pose(None, middle, 5, 2))
    for name, yaw in (("left", -15), ("middle", 0), ("right", 15)):  # cameras that stand still, without poses
        write_views(folder / name, [view(yaw)] * 2, lost=(0, 1))
        shutil.rmtree(folder / name / "pose")
    known = [ps.orbit_pose(None, middle, yaw, yaw / 4)[:3].ravel() for yaw in (-15, 0, 15)]
    np.savetxt(folder / "known.txt", known)  # and here they are
    for name, frame in (("scans/desk", views[0]), ("scans/chair", views[7]), ("my_kinect", view(0, noise=0.003))):
        _write_frame(folder / name, frame)
    shutil.copytree(folder / "my_kinect", folder / "my_recording")
    sparse = np.where(rng.random(views[0].depth.shape) < 0.1, views[0].depth, 0)
    _write_frame(folder / "my_lidar", ps.Frame(views[0].color, sparse, CAMERA))
    _write_photographs(folder / "my_photos", views[3])

    Image.fromarray(views[3].color).save(folder / "photo.jpg")
    _save_millimetres(folder / "photo_depth.png", views[3].depth)
    (folder / "photos").mkdir()
    for k in range(3):
        shutil.copy(folder / "photo.jpg", folder / f"photos/{k}.jpg")
    with ps.Film(folder / "clip.mp4") as film:
        film.add(views[3].color)
        film.add(views[4].color)
    from .networks import save_mean

    save_mean(folder / "model.onnx")

    cloud = ball(1000)
    for name in ("scan.ply", "scan.xyz", "knot.ply"):
        ps.save_points(folder / name, cloud) if name.endswith(".ply") else np.savetxt(folder / name, cloud.positions)
    ps.save_points(folder / "splats.ply", ball_over_floor(300))
    roof = ps.Mesh(
        [(-0.1, 0, -0.1), (0.1, 0, -0.1), (0.1, 0, 0.1), (-0.1, 0, 0.1), (0, 0.25, 0)],
        [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)],
    )
    ps.save_scene(folder / "chair.glb", ps.Scene((ps.Node(roof, "roof"),)))
    las(folder / "scan.laz", np.round(cloud.positions, 3).astype(np.float64))
    sky = np.full((16, 32, 4), (120, 140, 160, 128), np.uint8)
    (folder / "studio.hdr").write_bytes(radiance_file(sky))


def _write_frame(folder: Path, frame: ps.Frame) -> None:
    folder.mkdir(parents=True)
    Image.fromarray(frame.color).save(folder / "color.png")
    _save_millimetres(folder / "depth.png", frame.depth)
    (folder / "intrinsics.json").write_text(_intrinsics(frame.camera))


def _write_photographs(folder: Path, frame: ps.Frame) -> None:
    """Three photographs of one view, each under its own light."""
    for name in ("color", "depth"):
        (folder / name).mkdir(parents=True)
    (folder / "intrinsics.json").write_text(_intrinsics(CAMERA))
    for k, x in enumerate((-1, 0, 1)):
        light = ps.Light(direction=(x, 1, 1))
        lit = ps.render(ps.Frame(frame.color, frame.depth, CAMERA), light=light)
        ps.save_image(folder / f"color/{k}.png", lit[..., :3])
        _save_millimetres(folder / f"depth/{k}.png", frame.depth)


def _intrinsics(camera: ps.Camera) -> str:
    return json.dumps({name: getattr(camera, name) for name in ("fx", "fy", "cx", "cy", "width", "height")})


def _save_millimetres(path: Path, depth: np.ndarray) -> None:
    Image.fromarray(np.round(depth * 1000).astype(np.uint16)).save(path)
