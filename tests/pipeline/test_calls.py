"""What a picture costs in calls of Python and C: of small frames on a GPU that is all of its time."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.speed import calls_of

from ..support.drivers import merging


def frame(k):
    random = np.random.default_rng(k)
    v, u = np.mgrid[0:24, 0:32]
    depth = (2 + 0.3 * np.sin(u / 5 + k) + 0.2 * np.cos(v / 4)).astype(np.float32)
    return ps.Frame(random.integers(0, 255, (24, 32, 3), np.uint8), depth, ps.Camera.from_fov(60, 32, 24))


LIGHTS = [ps.Light(position=(0.1 * k, -1, 0)) for k in range(4)]
POSES = [ps.orbit_pose(None, (0, 0, 2), yaw=k) for k in range(4)]
MOST = {"same": 60, "light": 160, "view": 260, "new": 750}
ON_GPU = {"same": 70, "light": 160, "view": 275, "new": 800}  # there each pass sets its window and its images


@pytest.mark.parametrize("change", MOST)
def test_a_picture_takes_few_calls(renderer, change):
    most = MOST[change] if merging(renderer) else ON_GPU[change]
    if renderer.context.gl.version_code < 430:
        pytest.skip("counted where the compute rasteriser draws")
    frames = [frame(k) for k in range(4)]
    for k in range(4):

        def work(k=k):
            pose = POSES[k] if change == "view" else None
            light = LIGHTS[k if change == "light" else 0]
            renderer.render(frames[k if change == "new" else 0], light=light, pose=pose)

        found = calls_of(work)
    assert found - 1 <= most, found - 1  # less the function above
