"""Blender's lights: a spot from its glTF files lights a plane as its own path tracer does."""

import math

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import encode

from .gltf_files import document, write_gltf

LIGHTS = "KHR_lights_punctual"
OUTER = 0.6108652353286743
# Red of every ninth pixel from the fourth on of row 120 of 240x240, linear, by Cycles of Blender 5.0.1: a matt plane of
# 0.8 below a spot of 100 W and 70 degrees, without bounces; the camera 4 m above sees 50 degrees.
CYCLES = {  # by blend
    0.0: (
        0,
        0,
        0,
        0,
        0,
        0,
        0,
        0,
        0.3603,
        0.3899,
        0.4184,
        0.4445,
        0.4669,
        0.4842,
        0.4954,
        0.4996,
        0.4967,
        0.4867,
        0.4704,
        0.4488,
        0.4233,
        0.3951,
        0.3660,
        0.3358,
        0.3066,
        0.2786,
        0.2523,
    ),
    0.15: (
        0,
        0,
        0,
        0,
        0,
        0,
        0,
        0,
        0.0125,
        0.3899,
        0.4184,
        0.4445,
        0.4669,
        0.4842,
        0.4954,
        0.4996,
        0.4967,
        0.4867,
        0.4704,
        0.4488,
        0.4233,
        0.3951,
        0.3660,
        0.3358,
        0.3066,
        0.2786,
        0.2523,
    ),
    0.4: (
        0,
        0,
        0,
        0,
        0,
        0,
        0,
        0,
        0.0019,
        0.1753,
        0.3992,
        0.4445,
        0.4669,
        0.4842,
        0.4954,
        0.4996,
        0.4967,
        0.4867,
        0.4704,
        0.4488,
        0.4233,
        0.3951,
        0.3660,
        0.3358,
        0.3066,
        0.2759,
        0.1801,
    ),
    0.7: (
        0,
        0,
        0,
        0,
        0,
        0,
        0,
        0,
        0.0006,
        0.0683,
        0.2075,
        0.3547,
        0.4545,
        0.4842,
        0.4954,
        0.4996,
        0.4967,
        0.4867,
        0.4704,
        0.4488,
        0.4233,
        0.3951,
        0.3660,
        0.3172,
        0.2410,
        0.1552,
        0.0779,
    ),
    1.0: (
        0,
        0,
        0,
        0,
        0,
        0,
        0,
        0,
        0.0003,
        0.0356,
        0.1168,
        0.2208,
        0.3238,
        0.4069,
        0.4612,
        0.4875,
        0.4929,
        0.4848,
        0.4674,
        0.4404,
        0.4016,
        0.3498,
        0.2876,
        0.2176,
        0.1492,
        0.0888,
        0.0419,
    ),
}


def spot_file(blend):
    """As Blender's exporter writes it: angles are blended."""
    spot = {"innerConeAngle": OUTER * (1 - blend), "outerConeAngle": OUTER}
    lamp = {"type": "spot", "color": [1, 1, 1], "intensity": 5435.141306588225, "spot": spot}
    place = {
        "rotation": [-0.6277874708175659, -0.04389917477965355, 0.054210975766181946, 0.7752528786659241],
        "translation": [0.30000001192092896, 2, 0.20000000298023224],
    }
    eye = {"camera": 0, "rotation": [-0.7071068286895752, 0, 0, 0.7071068286895752], "translation": [0, 4, 0]}
    data = document(
        nodes=[{"extensions": {LIGHTS: {"light": 0}}} | place, eye],
        cameras=[{"type": "perspective", "perspective": {"yfov": math.radians(50), "znear": 0.1}}],
        extensions={LIGHTS: {"lights": [lamp]}},
        extensionsUsed=[LIGHTS],
    )
    data["scenes"][0]["nodes"] = [0, 1]
    return data


def profile(renderer, folder, data):
    """The same pixels of our picture, 0 to 1, as they are encoded."""
    scene = ps.load_scene(write_gltf(folder, data), notes=lambda _: None)
    corners = [(-4, 0, 4), (4, 0, 4), (4, 0, -4), (-4, 0, -4)]
    plane = ps.Mesh(corners, [(0, 1, 2), (0, 2, 3)], color=(0.8, 0.8, 0.8), material=ps.Material(0, 1, 0))
    whole = ps.Scene((*scene.nodes, ps.Node(plane)))
    picture = renderer.render(whole, camera=ps.Camera.from_fov(50, 240, 240), pose=scene.pose)
    return picture[120, 3::9, 0] / 255


def decibels(values, truth):
    return -10 * math.log10(np.mean((values - truth) ** 2))


@pytest.mark.parametrize("blend", CYCLES)
def test_a_spot_is_as_cycles_draws_it(renderer, tmp_path, blend):
    data = spot_file(blend)
    data["asset"]["generator"] = "Khronos glTF Blender I/O v5.0.21"
    assert decibels(profile(renderer, tmp_path, data), encode(np.array(CYCLES[blend])) / 255) > 45


def test_other_files_mean_the_cone_that_they_hold(renderer, tmp_path):
    (placed,) = ps.load_scene(write_gltf(tmp_path, spot_file(0.4)), notes=lambda _: None).placed()
    assert placed.content.cone == pytest.approx(np.degrees((OUTER * 0.6, OUTER)))


@pytest.mark.parametrize(("inner", "outer"), [(0, 1.5707964), (1.5707964, 1.5707964), (0, 1e-5), (0.2, 3)])
def test_odd_cones_of_blender_open(tmp_path, inner, outer):
    data = spot_file(0)
    data["asset"]["generator"] = "Khronos glTF Blender I/O v5.0.21"
    data["extensions"][LIGHTS]["lights"][0]["spot"] = {"innerConeAngle": inner, "outerConeAngle": outer}
    (placed,) = ps.load_scene(write_gltf(tmp_path, data), notes=lambda _: None).placed()
    low, high = placed.content.cone
    assert 0 <= low <= high == pytest.approx(min(math.degrees(outer), 90))
