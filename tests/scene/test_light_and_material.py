"""Lights, materials, sizes: checked once, with clear errors."""

import math
from dataclasses import replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.appearance import check_sizes
from pointshade_gl.scene.noise import check_method, check_normals, parse_max_depth_step

PLACED = {"position": (0, 0, 1), "direction": (0, 0, 1)}
FALLS = "inverse-square"


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
        ({"watts": -1, "position": (0, 0, 1)}, "light watts must be a number from 0"),
        ({"watts": 5}, "light watts is of a light with a position: a directional light has lux"),
        ({"candela": 5, "direction": (0, 0, 1)}, "light candela is of a light with a position"),
        ({"lux": 5, "position": (0, 0, 1)}, "light lux is of a directional light: .* has watts or candela"),
        ({"lux": 5, "intensity": 1}, "light takes one of intensity, watts, candela, lux, got intensity and lux"),
        ({"falloff": "linear"}, "unknown light falloff 'linear': known are none, inverse-square"),
        ({"falloff": "none", "attenuation": (1, 0, 0)}, "falloff is a word for attenuation: leave out one"),
        ({"size": (1, 1), "position": (0, 0, 1)}, "size is of a light with a position and a direction"),
        ({"size": (1, 0), **PLACED}, r"size must be a width and a height above 0, got \(1, 0\)"),
        ({"size": (1, 1, 1), **PLACED}, "size must be a width and a height"),
        ({"size": (1, 1), "radius": 1, **PLACED}, "size is of a rectangle, radius of a ball: leave out one"),
    ],
)
def test_impossible_lights_are_named(values, complaint):
    with pytest.raises(ValueError, match=complaint):
        ps.Light(**values)


@pytest.mark.parametrize(
    ("values", "intensity", "attenuation"),
    [  # as Blender's manual and KHR_lights_punctual have them, over the intensity of a white matt surface
        ({"position": (0, 0, 1), "watts": 4 * math.pi**2}, 1, (0, 0, 1)),
        ({**PLACED, "watts": 4 * math.pi**2}, 1, (0, 0, 1)),
        ({**PLACED, "watts": math.pi**2, "size": (2, 0.1)}, 1, (0, 0, 1)),
        ({**PLACED, "candela": math.pi, "size": (2, 0.1)}, 1, (0, 0, 1)),
        ({"position": (0, 0, 1), "candela": 2 * math.pi}, 2, (0, 0, 1)),
        ({"position": (0, 0, 1), "candela": math.pi, "falloff": "none"}, 1, (1, 0, 0)),
        ({"position": (0, 0, 1), "watts": 4 * math.pi**2, "attenuation": (1, 0, 0)}, 1, (1, 0, 0)),
        ({"position": (0, 0, 1), "falloff": "inverse-square"}, 1, (0, 0, 1)),
        ({"direction": (0, 0, 1), "lux": math.pi}, 1, (1, 0, 0)),
        ({"lux": math.pi}, 1, (1, 0, 0)),
        ({}, 1, (1, 0, 0)),
    ],
)
def test_units_and_words_say_intensity_and_attenuation(values, intensity, attenuation):
    light = ps.Light(**values)
    assert light.intensity == pytest.approx(intensity, rel=1e-12) and light.attenuation == attenuation
    assert eval(repr(light), {"Light": ps.Light}) == light == replace(light)


def test_a_light_in_units_is_changed_as_any_other():
    lamp = ps.Light(**PLACED, watts=100, size=(1, 2), color=(1, 0.5, 0))
    assert replace(lamp, size=None) == ps.Light(**PLACED, intensity=lamp.intensity, color=(1, 0.5, 0), falloff=FALLS)
    assert replace(lamp, intensity=None, watts=200).intensity == 2 * lamp.intensity
    with pytest.raises(ValueError, match="got intensity and watts: pass None for the others"):
        replace(lamp, watts=200)


def test_a_light_with_a_position_and_a_direction_is_a_spot_or_with_a_size_an_area():
    assert ps.Light(position=(0, 0, 1), direction=(0, 0, 1)).is_spot
    area = ps.Light(**PLACED, size=[1, 2])
    assert area.is_area and area.is_soft and not area.is_spot and area.size == (1, 2)
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
