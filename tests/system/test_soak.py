"""A soak: thousands of random calls on tiny frames leave nothing behind, in GL, in Python and in the process."""

import gc
import sys

import moderngl
import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene import shadow_cameras as shadow_views

from ..renderer.test_lifetime import STATM, alive, megabytes, small

pytestmark = pytest.mark.system

CALLS = 700


class Soak:
    """Random calls on tiny frames."""

    METHODS = "auto", "star", "star-borrow", "adaptive", "triangles-4", "central", "plane-fit-3"

    def __init__(self):
        self.random = np.random.default_rng(5)
        self.last = self.frame()

    def pick(self, *choices):
        return choices[self.random.integers(len(choices))]

    def frame(self):
        return small(self.random.integers(1 << 30), *map(int, self.random.integers(3, 24, 2)))

    def look(self, frame):
        sizes = self.pick(None, None, None, 1.5, self.random.uniform(0, 2, frame.depth.shape))
        return {
            "normals": self.pick(*self.METHODS), "shading": self.pick("none", "flat", "gouraud", "phong", "edl"),
            "point_size": sizes, "splat": self.pick("footprint", "round", "footprint" if sizes is not None else "mesh"),
        }  # fmt: skip

    def lights(self):
        shadow = bool(self.random.integers(2))
        some = ps.Light(), ps.Light(direction=(1, 1, 2), shadow=shadow), ps.Light(position=(1, 0, 0))
        return list(some[: self.random.integers(4)])

    def finish(self):
        options = {"samples": 3}, {"background": "white"}, {"ground": True}
        return self.pick({}, {}, {}, *options)

    def pose(self):
        return ps.orbit_pose(None, (0, 0, 1.5), yaw=self.random.uniform(-30, 30))

    def scene(self):
        objects = [self.frame() for _ in range(self.random.integers(1, 5))]
        objects += [objects[0]] * self.random.integers(3)
        content = [ps.PointObject(frame, **self.look(frame)) for frame in objects]
        if self.random.integers(2):
            corners = self.random.uniform(-1, 1, (9, 3)) + np.array((0, 0, 1.5))
            shading = self.pick("flat", "gouraud", "phong")
            content.append(ps.Mesh(corners, np.arange(9).reshape(3, 3), shading=shading))
        return ps.Scene(tuple(map(ps.Node, content)), camera=self.frame().camera)

    def together(self):
        """Several frames of one thing; of a live set, one of them is new."""
        size = map(int, self.random.integers(8, 16, 2))
        made = [small(self.random.integers(1 << 30), *size)]
        return [*made, self.last]

    def stream(self, renderer):
        """Frames of one camera that follow each other, filtered over time."""
        seeds, (width, height) = self.random.integers(1 << 30, size=3), map(int, self.random.integers(8, 20, 2))
        for seed in seeds:
            renderer.render(small(seed, width, height), self.lights(), temporal=True, normals="adaptive")

    def with_large_colors(self):
        frame = self.frame()
        large = frame.color.repeat(2, 0).repeat(2, 1)
        return ps.Frame(large, frame.depth, frame.camera)

    def call(self, renderer):
        frame = self.frame()
        match self.random.integers(12):
            case 0:
                renderer.estimate_normals(frame, self.pick(*self.METHODS))
            case 1:
                renderer.render(self.scene(), self.lights(), **self.finish())
            case 2:
                with pytest.raises(ValueError, match="larger than this GPU's textures"):
                    renderer.draw(frame, camera=ps.Camera(9, 9, 9, 9, 10**6, 4))
            case 3:
                renderer.draw(frame, self.lights(), camera=self.frame().camera, **self.look(frame))
            case 4:
                at = self.pick("source", "target")
                renderer.render(self.together(), self.lights(), pose=self.pose(), normals_at=at)
                self.last = frame
            case 5:
                self.stream(renderer)
            case 6:
                renderer.render(self.with_large_colors(), self.lights(), upsample=self.pick("vote", "none"))
            case 7:
                options = {"point_size": "fill"}, {"flying": "snap"}, {"unlight": True}, {"remove_highlights": True}
                renderer.render(frame, pose=self.pose(), **self.pick(*options))
            case 8:
                self.pick(renderer.render_depth, renderer.render_points)(frame, normals=self.pick("auto", "star"))
            case _:
                renderer.render(frame, self.lights(), pose=self.pose(), **self.look(frame), **self.finish())


def held(renderers):
    """What renderers and the process hold: objects of GL and of Python, bookkeeping."""
    found = {}
    for k, renderer in enumerate(renderers):
        renderer.render(small())
        found |= {f"{name}{k}": count for name, count in alive(renderer).items()}
        found[f"steps{k}"] = len(renderer.steps._done)
    gc.collect()
    found["python"], found["blocks"] = len(gc.get_objects()), sys.getallocatedblocks()
    return found | {"MB": megabytes() if STATM.exists() else 0}


def test_two_thousand_random_calls_leave_nothing_behind(renderer, monkeypatch):
    """On a context of our own, and on one of a caller who has a framebuffer bound.

    Each round repeats the first: the second fills the caches (what is kept of a call depends on those before it), the
    third needs nothing that was not built.
    """
    monkeypatch.setattr(shadow_views, "SHADOW_SIDE", 32)
    context = moderngl.create_context(standalone=True, backend="egl")
    context.simple_framebuffer((4, 4)).use()
    states = []
    with ps.Renderer() as own, ps.Renderer(context) as borrowed:
        for soak in (Soak(), Soak(), Soak()):
            for _ in range(CALLS):
                soak.call(soak.pick(own, borrowed))
            states.append(held((own, borrowed)))
    context.release()
    _, before, after = states
    limits = {"python": 200, "blocks": 1000, "MB": 20}
    grown = {name: after[name] - before[name] for name in before}
    assert {name: growth for name, growth in grown.items() if growth > limits.get(name, 0)} == {}
