"""What stands out of a surface by less than a pixel's width touches it: it casts no shadow on it. More does."""

from dataclasses import replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.scenes import VASE_POSE, vase_scene
from pointshade_gl.scene.orbit import UPPER_LEFT, OrbitStage, State

from ..support import frames
from ..support.drivers import need_compute
from ..truth.files import MATTE

CAMERA, Z = frames.CAMERA, 1.5
PIXEL = Z / CAMERA.fx  # metres
V, U = np.mgrid[: CAMERA.height, : CAMERA.width]


@pytest.fixture(scope="module", params=["compute", "points"])
def made(request, renderer):
    if request.param == "compute":
        need_compute(renderer)
    with ps.Renderer(rasterizer=request.param) as one:
        yield one


def shadow_on(made, height, direction):
    """(h, w) by how much a shadow darkens a wall that stands out by so many pixels' widths, (h, w), in 8-bit steps."""
    frame = ps.Frame(None, (Z - height * PIXEL).astype(np.float32), CAMERA)
    lit, shaded = (made.render(frame, light=ps.Light(direction=direction, shadow=on))[..., 0] for on in (False, True))
    return lit.astype(int) - shaded


@pytest.mark.parametrize("direction", [(-1, 0.1, 0.2), (-1, 0, 0.1), (-0.6, -0.6, 0.15)])
@pytest.mark.parametrize("slant", [0, 0.3, 1])
def test_grazing_light_over_a_step_of_a_pixel_casts_no_teeth(made, direction, slant):
    is_near = slant * (V - 60) < U - 90
    assert shadow_on(made, is_near * 1.0, direction).max() <= 2


@pytest.mark.parametrize("slope", [1, 2, 4])
def test_a_bump_of_five_pixels_keeps_its_shadow(made, slope):
    """Light from the right: its shadow on the wall is as long as it is high, times the slope of the light."""
    bump = (abs(U - 90) <= 12) & (abs(V - 60) <= 6)
    dark = shadow_on(made, bump * 5.0, (-slope, 0, 1))
    row, start = dark[56:65], 77
    assert (row[:, start - 5 * slope + 2 : start - 1] > 40).all()
    assert not row[:, : start - 5 * slope - 2].any() and not dark[:50].any() and not dark[70:].any()


def test_a_far_wall_with_more_noise_than_what_is_near_casts_no_flecks_on_itself(renderer):
    rng = np.random.default_rng(4)
    z = np.where(U < 100, 1.0, 5.0)
    z += rng.normal(0, 0.003, z.shape) * z * z
    color = rng.integers(100, 130, (*z.shape, 3)).astype(np.uint8)
    frame = ps.Frame(color, z.astype(np.float32), frames.CAMERA)
    sun = ps.Light(direction=(-1.2, 0.3, 1))
    lit, shaded = (renderer.render(frame, replace(sun, shadow=on))[..., 1].astype(int) for on in (False, True))
    assert (lit - shaded > 8)[:, 125:].mean() < 0.005  # 0.09 where both keep the same distance


@pytest.mark.system
@pytest.mark.parametrize(("light_at", "least"), [(UPPER_LEFT, 0.97), ((-0.714, -0.535), 0.94)])
def test_the_vase_casts_the_shadow_of_the_whole_vase_on_its_table(renderer, light_at, least):
    """The window's first light, and one from the side, which shines through a frame that has no back."""
    frame = ps.load_frame("vase")
    light = replace(State(light_at=light_at).light(OrbitStage.of(frame), frame.pose), shadow=True)
    points = frame.camera.unproject(frame.depth) @ VASE_POSE[:3, :3].T + VASE_POSE[:3, 3]
    lamp, on_table = VASE_POSE[:3, :3] @ light.position + VASE_POSE[:3, 3], np.abs(points[..., 1]) < 1e-4
    rays = points[on_table] - lamp
    is_shaded = np.min([part.meet(lamp, rays)[0] for part in vase_scene()], 0) < 1 - 1e-3
    plain = ps.Frame(None, frame.depth, frame.camera)
    lights = light, replace(light, shadow=False)
    shaded, lit = (np.asarray(renderer.render(plain, light=one, material=MATTE))[on_table, 0] for one in lights)
    found = shaded < 0.73 * lit  # half of it, in sRGB
    assert is_shaded.sum() > 2000 and (found & is_shaded).sum() > least * (found | is_shaded).sum()
