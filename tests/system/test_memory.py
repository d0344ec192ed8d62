"""A GPU without memory: whichever allocation fails, the caller is told, and the next call draws the right picture."""

import sys
from contextlib import contextmanager
from pathlib import Path

import moderngl
import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.gpu.core.programs import FullscreenPass
from pointshade_gl.scene import shadow_cameras as shadow_views

from ..renderer.test_renderer import living_objects
from ..support import frames
from ..support.drivers import merging, need_compute

pytestmark = pytest.mark.system

SIDE = ps.orbit_pose(None, (0, 0, 1.5), yaw=10)
CAMERA = frames.CAMERA.fitted(40, 30)
PACKAGE = str(Path(ps.__file__).parent)
MAKERS = ("texture", "buffer", "framebuffer", "depth_texture", "depth_renderbuffer", "vertex_array")


def small(frame):
    return ps.Frame(frame.color[::4, ::4], frame.depth[::4, ::4], CAMERA)


SMOOTH, NOISY = small(frames.sphere_before_wall()), small(frames.noisy())

SMALL_DEPTH = ps.Frame(frames.noisy().color, NOISY.depth, CAMERA)


def scene(shading):
    corners = np.array([[-0.5, -0.5, 1.2], [0.5, -0.5, 1.2], [0, 0.5, 1.2]])
    mesh = ps.Mesh(corners, np.array([[0, 1, 2]]), shading=shading, material=ps.Material(specular=0))
    parts = ps.PointObject(SMOOTH), ps.PointObject(NOISY, normals="star-borrow"), mesh
    return ps.Scene(tuple(map(ps.Node, parts)), camera=CAMERA)


SUN = ps.Light(direction=(1, 1, 2), shadow=True)
CALLS = {
    "phong": lambda r: [r.render(SMOOTH, light, normals="star") for light in (None, SUN)][-1],
    "flat": lambda r: r.render(SMOOTH, shading="flat", pose=SIDE),
    "own sizes": lambda r: r.render(SMOOTH, point_size=np.full(SMOOTH.depth.shape, 1.5), splat="round"),
    "lit splats": lambda r: r.render(SMOOTH, point_size=2, shading="flat", pose=SIDE),
    "mesh": lambda r: [r.render(SMOOTH, SUN, splat="mesh", shading=shading) for shading in ("flat", "gouraud")][-1],
    "adaptive": lambda r: r.render(NOISY, normals="adaptive"),
    "small depth": lambda r: r.render(SMALL_DEPTH, shading="flat"),
    "borrow": lambda r: r.estimate_normals(NOISY, "star-borrow"),
    "scene": lambda r: r.render(
        scene("phong"), [SUN, ps.Light(direction=(0, 0, 1), cone=(20, 40), position=(0, 0, 0), shadow=True)]
    ),
    "lit corners": lambda r: r.render(scene("gouraud"), SUN),
}


@pytest.fixture(scope="module")
def context(renderer):
    context = moderngl.create_context(standalone=True, backend="egl")
    context.__exit__(None, None, None)  # not current
    yield context
    context.release()


def way():
    """The lines of the package that are being run, the innermost first: what fails, and who undoes what."""
    frame, lines = sys._getframe(1), []
    while frame is not None:
        if PACKAGE in frame.f_code.co_filename:
            lines.append((frame.f_code.co_filename, frame.f_lineno))
        frame = frame.f_back
    return tuple(lines)


@contextmanager
def noted(nth):
    """GL notes that memory ran out with the nth thing that is made. Gives the ways to all of them."""
    ways = []

    def error(_):
        ways.append(way())
        return "GL_OUT_OF_MEMORY" if len(ways) == nth else "GL_NO_ERROR"

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(moderngl.Context, "error", property(error))
        yield ways


@contextmanager
def raised(nth):
    """moderngl refuses to make the nth thing. Gives the ways to all of them."""
    ways = []

    def failing(make):
        def instead(*args, **options):
            ways.append(way())
            if len(ways) == nth:
                raise moderngl.Error("cannot create it")
            return make(*args, **options)

        return instead

    with pytest.MonkeyPatch.context() as patch:
        for name in MAKERS:
            patch.setattr(moderngl.Context, name, failing(getattr(moderngl.Context, name)))
        yield ways


@contextmanager
def interrupted(nth):
    """Ctrl+C before the nth pass. Gives the ways to all of them."""
    ways, draw = [], FullscreenPass.draw

    def instead(*args, **options):
        ways.append(way())
        if len(ways) == nth:
            raise KeyboardInterrupt
        draw(*args, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(FullscreenPass, "draw", instead)
        yield ways


@pytest.fixture(scope="module")
def failed():
    """The ways whose ends have failed: what another call does by the same lines need not fail again."""
    return set()


@pytest.mark.parametrize("failing", [noted, raised, interrupted])
@pytest.mark.parametrize(
    ("rasterizer", "name"), [*(("compute", name) for name in CALLS), ("points", "flat"), ("points", "scene")]
)
def test_each_allocation_and_each_pass_fails_once(context, renderer, monkeypatch, failed, rasterizer, failing, name):
    if rasterizer == "compute":
        need_compute(renderer)
    monkeypatch.setattr(shadow_views, "SHADOW_SIDE", 32)
    least = 8 if merging(renderer) else 6  # on GPUs passes are compute shaders, which have no vertex arrays
    with context:
        with ps.Renderer(context, rasterizer=rasterizer) as renderer, failing(0) as ways:
            expected = CALLS[name](renderer)
        assert len(ways) >= (1 if failing is interrupted else least)
        before = living_objects(context)
        for nth, one in enumerate(ways, 1):
            key = failing, rasterizer, one, ways[:nth].count(one)  # a loop's second thing fails beside the first
            if key in failed:
                continue
            failed.add(key)
            with ps.Renderer(context, rasterizer=rasterizer) as renderer:
                with pytest.raises((MemoryError, KeyboardInterrupt)) as told, failing(nth):
                    CALLS[name](renderer)
                assert failing is interrupted or "no memory left" in str(told.value)
                np.testing.assert_array_equal(CALLS[name](renderer), expected)
        after = living_objects(context)
        assert all(after[kind] <= before[kind] for kind in before)  # GL may keep the last program for a while
        assert context.error == "GL_NO_ERROR"
