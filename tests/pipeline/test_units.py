"""Lamps in the units of Blender, against the light that Cycles gives them: made by tests/truth/make_units.py."""

import json
from pathlib import Path

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import decode
from pointshade_gl.scene import shadow_cameras
from pointshade_gl.scene.shadow_cameras import SHADOW_SIDE

from ..truth.files import MATTE

TRUTH = np.load(Path(__file__).parents[1] / "truth" / "kept" / "units.npz")
ABOUT = json.loads(str(TRUTH["about"]))
ASKED = 0.05, 0.95  # light that 8 bits tell well


def light_of(renderer, lamp, samples):
    """(h, w) linear light of the truth's ball on a floor, whose normals are known."""
    *intrinsics, width, height = ABOUT["camera"]
    camera, depth = ps.Camera(*intrinsics, int(width), int(height)), TRUTH["depth"]
    frame = ps.Frame(np.full((*depth.shape, 3), ABOUT["grey"], np.uint8), depth, camera)
    picture = renderer.render(frame, lamp, MATTE, normals=TRUTH["normals"].astype(float), samples=samples)
    return decode(picture[..., 0].astype(float))


@pytest.mark.parametrize(
    ("name", "samples", "side"),  # of shadow maps, pixels; the truth has 64x48
    [
        *((name, 1, SHADOW_SIDE) for name in ("sun", "point", "spot")),
        ("area", 32, 128),
        pytest.param("area", 64, SHADOW_SIDE, marks=pytest.mark.system),
    ],
)
def test_lamps_are_as_bright_as_in_cycles(renderer, monkeypatch, name, samples, side):
    monkeypatch.setattr(shadow_cameras, "SHADOW_SIDE", side)
    truth, lamp = TRUTH[name].astype(float), ps.Light(**ABOUT["lamps"][name], shadow=True)
    light = light_of(renderer, lamp, samples)
    asked = (truth > ASKED[0]) & (truth < ASKED[1]) & (light > 0)
    ratio = light[asked] / truth[asked]
    assert asked.mean() > 0.35 and np.median(ratio) == pytest.approx(1, abs=0.01)
    assert (np.abs(ratio - 1) < 0.05).mean() > 0.8
    turned = ABOUT["lamps"][name] | {"size": ABOUT["lamps"][name].get("size", ())[::-1]}
    if name == "area":  # its width is level
        other = light_of(renderer, ps.Light(**turned, shadow=True), samples)
        assert np.square(other - truth)[asked].mean() > 4 * np.square(light - truth)[asked].mean()
