"""What stands out of a surface by less than a pixel's width touches it: it casts no shadow on it. More does."""

import numpy as np
import pytest

import pointshade_gl as ps

from ..support import frames
from ..support.drivers import need_compute

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
