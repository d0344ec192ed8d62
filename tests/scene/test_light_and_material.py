"""Lights, materials, sizes: checked once, with clear errors."""

import math

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.appearance import check_sizes
from pointshade_gl.scene.normal_methods import check_method, check_normals, parse_max_depth_step


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({"position": (0, 0)}, "light position must be three finite numbers"),
        ({"position": (0, 0, math.nan)}, "three finite numbers"),
        ({"direction": (0, 0, 0)}, r"direction must not be \(0, 0, 0\)"),
        ({"color": (1, -1, 1)}, r"color must be three numbers from 0 to 1e\+18, got \(1, -1, 1\)"),
        ({"intensity": -1}, "intensity must be a number from 0"),
        ({"intensity": math.nan}, "got nan"),
        ({"attenuation": (0, 0, 0)}, "not all 0"),
        ({"cone": (30, 20)}, r"cone must be two half angles, .* got \(30, 20\)"),
        ({"cone": (-1, 20)}, "cone must be"),
        ({"cone": (0, 91)}, "cone must be"),
        ({"cone": (0, 0)}, "cone must be"),
        ({"cone": (0, math.nan)}, "cone must be"),
        ({"cone": 30}, "cone must be"),
        ({"cone": (1, 2, 3)}, "cone must be"),
    ],
)
def test_impossible_lights_are_named(values, complaint):
    with pytest.raises(ValueError, match=complaint):
        ps.Light(**values)


def test_a_light_with_a_position_and_a_direction_is_a_spot():
    assert ps.Light(position=(0, 0, 1), direction=(0, 0, 1)).is_spot
    assert not ps.Light(position=(0, 0, 1)).is_spot and not ps.Light(direction=(0, 0, 1)).is_spot


@pytest.mark.parametrize("values", [{"ambient": -0.1}, {"diffuse": math.inf}, {"specular": math.nan}, {"shininess": 0}])
def test_impossible_materials_are_named(values):
    with pytest.raises(ValueError, match=f"material {next(iter(values))} must be"):
        ps.Material(**values)


@pytest.mark.parametrize("size", [-1, math.nan, np.ones((3, 4)), (640, 480)])
def test_impossible_splat_sizes_are_named(size):
    with pytest.raises(ValueError, match="size"):
        check_sizes(size, (6, 8))


@pytest.mark.parametrize(("value", "step"), [(0.05, (0.05, 0)), ("0.05", (0.05, 0)), ("2%", (0, 0.02))])
def test_max_depth_step_is_metres_or_a_share(value, step):
    assert parse_max_depth_step(value) == pytest.approx(step)


@pytest.mark.parametrize("value", [0, -1, "wide", "%", math.nan, math.inf])
def test_impossible_depth_steps_are_named(value):
    with pytest.raises(ValueError, match="max_depth_step must be"):
        parse_max_depth_step(value)


def test_unknown_methods_are_answered_with_the_known_ones():
    with pytest.raises(ValueError, match=r"unknown normals method 'magic': known are auto, .*triangles-8"):
        check_method("magic")


def test_normals_of_the_caller_are_made_unit_and_nan_becomes_missing():
    normals = np.full((2, 2, 3), np.nan)
    normals[0, 0] = (0, 0, -2)
    checked = check_normals(normals, (2, 2))
    assert checked[0, 0].tolist() == [0, 0, -1] and not checked[1].any()
    with pytest.raises(ValueError, match=r"have shape \(2, 3, 3\)"):
        check_normals(normals, (2, 3))
