"""The same call gives the same picture, to the bit, whatever a Renderer drew before."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene import shadow_cameras

from ..support import frames
from ..support.drivers import need_compute

SHADINGS = "phong", "flat", "gouraud", "none", "edl"
TWO = [ps.Light(), ps.Light(position=(1, 0, 0))]
SHADOW = ps.Light(direction=(1, 1, 2), shadow=True)
VIEWS = [(0, None, 1), (12, None, 1), (7, TWO, 1), (3, SHADOW, 1), (9, None, 3)]  # yaw, light, samples: each is new
BEFORE = {  # what is drawn before a call is repeated; some of it leaves steps done, some undoes them
    "nothing": lambda draw, call: None,
    "another light": lambda draw, call: draw(**(call | {"light": ps.Light(position=(0.3, -1, 0))})),
    "another view": lambda draw, call: draw(**(call | {"yaw": call["yaw"] + 4})),
    "another shading": lambda draw, call: draw(**(call | {"shading": SHADINGS[SHADINGS.index(call["shading"]) - 1]})),
    "another frame": lambda draw, call: draw(small(frames.step), yaw=5),
    "more samples": lambda draw, call: draw(**(call | {"samples": call["samples"] + 1})),
}
NAMES = "tum_fr3_kinect1", "realsense_box_2", "iphone_lidar_promptda", "stereo_metal_floor", "d435_table_exr_halffloat"


def differing(source, rasterizer, shadings, views=VIEWS):
    """The pictures that differ from the first one of their view: what was drawn before, and by how many pixels."""
    found = {}
    for shading in shadings:
        with ps.Renderer(rasterizer=rasterizer) as renderer:
            for yaw, light, samples in views:
                call = {"yaw": yaw, "pitch": yaw / 2, "light": light, "samples": samples, "shading": shading}
                first = renderer.render(source, **call)
                for before, work in BEFORE.items():
                    work(lambda frame=source, **other: renderer.render(frame, **other), call)
                    if count := np.count_nonzero((renderer.render(source, **call) != first).any(-1)):
                        found[shading, yaw, before] = count
    return found


def small(make=frames.noisy):
    """A frame of 80x60."""
    frame = make()
    return ps.Frame(frame.color[::2, ::2], frame.depth[::2, ::2], frame.camera.resized(80, 60))


def together():
    """Two frames of one thing."""
    frame = small()
    return [frame, ps.Frame(frame.color, frame.depth, frame.camera, ps.orbit_pose(None, frame.pivot, yaw=2))]


@pytest.mark.parametrize(
    ("shading", "source", "rasterizer"),
    [
        *((shading, small, "points") for shading in SHADINGS),
        *((shading, together, "compute") for shading in SHADINGS),
        *(("phong", small, "compute"), ("phong", together, "points"), ("flat", together, "points")),
    ],
)
def test_a_picture_does_not_depend_on_what_was_drawn_before(renderer, monkeypatch, shading, source, rasterizer):
    monkeypatch.setattr(shadow_cameras, "SHADOW_SIDE", 64)  # drawn by the same passes at any size
    if rasterizer == "compute":
        need_compute(renderer)
    assert differing(source(), rasterizer, [shading]) == {}


@pytest.mark.system
@pytest.mark.data
@pytest.mark.parametrize("rasterizer", ["auto", "points"])
@pytest.mark.parametrize("name", ["vase", *NAMES])
def test_nor_does_that_of_a_real_frame(renderer, request, name, rasterizer):
    path = name if name == "vase" else request.getfixturevalue("shared_data") / name
    assert differing(ps.load_frame(path, notes=lambda _: None), rasterizer, ["phong"], VIEWS[1:4:2]) == {}
