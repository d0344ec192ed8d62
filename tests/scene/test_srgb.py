"""sRGB and linear light, against the numbers of the standard."""

import numpy as np
import pytest

from pointshade_gl.scene.values import linear_to_bytes, linear_to_srgb, srgb_to_linear


@pytest.mark.parametrize(
    ("encoded", "linear"),
    [(0, 0), (0.04045, 0.0031308), (0.5, 0.21404114), (188 / 255, 0.50288646), (1, 1)],
)
def test_known_values(encoded, linear):
    assert srgb_to_linear(encoded) == pytest.approx(linear, abs=5e-8)
    assert linear_to_srgb(linear) == pytest.approx(encoded, abs=5e-7)


def test_all_bytes_come_back():
    levels = np.arange(256, dtype=np.uint8)
    np.testing.assert_array_equal(linear_to_bytes(srgb_to_linear(levels / 255)), levels)


def test_light_above_1_and_below_0_is_not_cut_off():
    assert linear_to_srgb(2.0) == pytest.approx(1.055 * 2 ** (1 / 2.4) - 0.055)
    assert linear_to_srgb(-0.5) == pytest.approx(-6.46)
