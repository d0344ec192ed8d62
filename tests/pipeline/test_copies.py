"""Many copies of one mesh: drawn at once, as if each was drawn by itself, and cheap to see again."""

from dataclasses import replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.gpu.meshes.mesh_objects import MeshObjects

from ..support import frames

CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.06
SIDES = [(0, 1, 3), (0, 3, 2), (4, 7, 6), (4, 5, 7), (0, 5, 4), (0, 1, 5), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4)]
LIGHTS = ps.Light(), ps.Light(direction=(1, 1, 2), shadow=True), ps.Light(position=(1, 0, 0))


def box(shading="phong"):
    return ps.Mesh(CORNERS, SIDES, color=(0.7, 0.4, 0.2), shading=shading)


def at_random_places(meshes, sees=160):
    """A node for each mesh, turned and stretched, three of them twice. Some are out of view, some touch others."""
    random, nodes = np.random.default_rng(3), []
    for mesh in meshes:
        place = np.eye(4)
        place[:3, :3] = np.linalg.qr(random.normal(size=(3, 3)))[0] * random.uniform(0.5, 1.5, 3)
        place[:3, 3] = random.uniform((-1, -1, 1.5), (1, 1, 3.5))
        nodes.append(ps.Node(mesh, transform=place))
    return ps.Scene((*nodes, *nodes[:3]), camera=frames.CAMERA.fitted(sees, sees * 3 // 4))


@pytest.fixture
def draws(monkeypatch):
    """How many copies each draw has drawn."""
    counts, draw = [], MeshObjects._draw

    def counted(self, target, array, inputs, placed, eye):
        counts.append(len(placed.worlds))
        draw(self, target, array, inputs, placed, eye)

    monkeypatch.setattr(MeshObjects, "_draw", counted)
    return counts


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("shading", ["none", "flat", "gouraud", "phong", "edl"])
def test_copies_are_drawn_at_once_and_look_as_if_drawn_one_by_one(renderer, draws, shading, light):
    mesh, others = box(shading), [box(shading) for _ in range(60)]
    one_by_one = renderer.render(at_random_places(others), light)
    assert max(draws) == 1
    draws.clear()
    assert (renderer.render(at_random_places([mesh] * 60), light) == one_by_one).all()
    assert len(draws) == 1 + light.shadow and min(draws) > 30


def test_other_things_between_copies_keep_their_turn(renderer, draws):
    mesh, other = box(), replace(box(), color=(0.1, 0.9, 0.1))
    meshes = [mesh] * 20 + [other] * 20 + [mesh] * 20
    between = renderer.render(at_random_places(meshes))
    assert len(draws) == 3
    apart = [replace(one) for one in meshes]
    assert (renderer.render(at_random_places(apart)) == between).all()


def test_a_scene_without_a_camera_is_framed_once(renderer):
    scene = replace(at_random_places([box()] * 3), camera=None)
    assert scene.framed() is scene.framed() and scene.framed().camera is not None
