"""Blender's lights: a spot from its glTF files lights a plane as its own path tracer does."""

import math

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import encode

from ...support.gltf_files import document, write_gltf

LIGHTS = "KHR_lights_punctual"
OUTER = 0.6108652353286743
# Every ninth pixel of row 120 of 240x240, from 66 on, linear, times 10000, by Cycles of Blender 5.0.1: a matt plane of
# 0.8 below a spot of 100 W and 70 degrees, without bounces; the camera 4 m above it sees 50 degrees.
CYCLES = {  # by blend
    0.0: "0 3603 3899 4184 4445 4669 4842 4954 4996 4967 4867 4704 4488 4233 3951 3660 3358 3066 2786 2523",
    0.15: "0 125 3899 4184 4445 4669 4842 4954 4996 4967 4867 4704 4488 4233 3951 3660 3358 3066 2786 2523",
    0.4: "0 19 1753 3992 4445 4669 4842 4954 4996 4967 4867 4704 4488 4233 3951 3660 3358 3066 2759 1801",
    0.7: "0 6 683 2075 3547 4545 4842 4954 4996 4967 4867 4704 4488 4233 3951 3660 3172 2410 1552 779",
    1.0: "0 3 356 1168 2208 3238 4069 4612 4875 4929 4848 4674 4404 4016 3498 2876 2176 1492 888 419",
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
    return picture[120, 66::9, 0] / 255


def decibels(values, truth):
    return -10 * math.log10(np.mean((values - truth) ** 2))


@pytest.mark.parametrize("blend", CYCLES)
def test_a_spot_is_as_cycles_draws_it(renderer, tmp_path, blend):
    data = spot_file(blend)
    data["asset"]["generator"] = "Khronos glTF Blender I/O v5.0.21"
    assert decibels(profile(renderer, tmp_path, data), encode(np.array(CYCLES[blend].split(), float) / 1e4) / 255) > 45


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
