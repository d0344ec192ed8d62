"""The built-in scene: what is in it and where; its files are those that its program writes."""

import numpy as np
import pytest

import pointshade_gl as ps
from assets import make_demo
from pointshade_gl.bench.scenes import VASE_POSE

from ...support.compare import compare_images


def test_the_demo_has_the_vase_two_lights_and_shadows_and_fits_on_a_screen():
    scene = ps.load_scene("demo")
    kinds = {p.node.name: type(p.content).__name__ for p in scene.placed()}
    assert kinds == {
        "vase": "PointObject", "floor": "Mesh", "wall": "Mesh", "column": "Mesh", "lamp": "Light", "sky": "Light",
    }  # fmt: skip
    assert all(p.content.shadow for p in scene.placed() if isinstance(p.content, ps.Light))
    assert len((make_demo.FOLDER / "scene.gltf").read_text().splitlines()) < 65


def test_the_vase_stands_on_the_floor_where_it_was_photographed():
    placed = {p.node.name: p for p in ps.load_scene("demo").placed()}
    frame, world = placed["vase"].content.frame, placed["vase"].world
    np.testing.assert_allclose(world @ frame.pose, VASE_POSE, atol=1e-12)
    v, u = np.nonzero(frame.depth)
    z, c = frame.depth[v, u].astype(float), frame.camera
    points = VASE_POSE @ np.stack([(u - c.cx) / c.fx * z, (v - c.cy) / c.fy * z, z, np.ones_like(z)])
    floor = placed["floor"].world[1, 3]
    assert floor < points[1].min() < floor + 0.003  # metres


def test_the_files_are_what_the_program_writes(tmp_path):
    ps.save_scene(tmp_path / "scene.gltf", make_demo.scene(), fallback=None)
    names = sorted(path.name for path in make_demo.FOLDER.iterdir())
    assert names == sorted(path.name for path in tmp_path.iterdir())
    stored, made = ps.load_scene("demo"), ps.load_scene(tmp_path / "scene.gltf")
    for a, b in zip(stored.placed(), made.placed(), strict=True):
        np.testing.assert_allclose(a.world, b.world, atol=1e-9)
        if isinstance(a.content, ps.Mesh):
            np.testing.assert_allclose(a.content.positions, b.content.positions, atol=1e-6)


@pytest.mark.parametrize("name", ["copy.gltf", "copy.glb"])
def test_the_demo_looks_the_same_after_saving_and_opening(renderer, tmp_path, name):
    scene = ps.load_scene("demo")
    ps.save_scene(tmp_path / name, scene)
    small = scene.camera.resized(160, 120)
    pictures = [renderer.render(one, camera=small) for one in (scene, ps.load_scene(tmp_path / name))]
    assert pictures[0].std() > 30
    assert compare_images(pictures[1], pictures[0]) == ""
