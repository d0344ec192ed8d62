"""Whatever was drawn before, a picture is that of a new renderer: what is kept of the last one is still right."""

import random

import numpy as np
import pytest

import pointshade_gl as ps

from ..support import frames

SMALL = frames.CAMERA.resized(32, 24)
TRIANGLE = ps.Mesh(np.array([[-0.5, -0.5, 1.5], [0.5, -0.5, 1.5], [0, 0.5, 1.5]]), np.array([[0, 1, 2]]))
LIGHTS = [
    None, ps.Light(), ps.Light(position=(0, -1, 0)), ps.Light(direction=(0, 1, 1)), [],
    ps.Light(position=(0, -1, 0), shadow=True), ps.Light(position=(0, -1, 0), direction=(0, 1, 2), cone=(10, 40)),
    [ps.Light(), ps.Light(position=(1, 0, 0))],
]  # fmt: skip
POSES = [None, *(ps.orbit_pose(None, (0, 0, 1.5), yaw=9.0 * k) for k in range(3))]
OTHERS = {
    "shading": ["flat", "gouraud", "none"], "samples": [3], "ground": [True], "background": ["white"],
    "environment": ["sky"], "ambient_occlusion": [True, False], "exposure": [1.0, "auto"], "show": ["depth", "normals"],
}  # fmt: skip


def sources():
    first, second = (
        ps.Frame(one.color[::5, ::5], one.depth[::5, ::5], SMALL) for one in (frames.sphere(), frames.step())
    )
    turned = ps.Node(ps.PointObject(second, shading="gouraud"), transform=ps.orbit_pose(None, (0, 0, 2), yaw=20))
    scene = ps.Scene((ps.Node(ps.PointObject(first)), ps.Node(TRIANGLE), turned), camera=SMALL)
    return [first, first, second, scene, [first, second]]


def draw(renderer, source, options):
    try:
        return renderer.render(source, **options)
    except ValueError:
        return None  # a scene has looks of its own


def test_colours_of_depth_are_those_of_the_new_view(renderer):
    frame = sources()[0]
    for pose in POSES[1:]:
        with ps.Renderer() as new:
            expected = new.render(frame, pose=pose, show="depth")
        assert (renderer.render(frame, pose=pose, show="depth") == expected).all()


@pytest.mark.system
@pytest.mark.parametrize("seed", range(2))
def test_any_picture_after_any_other(seed):
    dice, known = random.Random(seed), sources()
    source, options = known[0], {}
    with ps.Renderer() as renderer:
        for _ in range(120):
            if dice.random() < 0.4:
                source, names = dice.choice(known), dice.sample([*OTHERS], dice.choice([0, 0, 1, 2]))
                options = {name: dice.choice(OTHERS[name]) for name in names}
            options = options | {"light": dice.choice(LIGHTS), "pose": dice.choice(POSES)}
            if dice.random() < 0.2:
                between = dice.choice([renderer.render_depth, renderer.estimate_normals, renderer.draw])
                between(known[0])
            found = draw(renderer, source, options)
            with ps.Renderer() as new:
                expected = draw(new, source, options)
            assert (found is None and expected is None) or np.array_equal(found, expected), (type(source), options)
