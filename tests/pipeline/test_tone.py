"""Light above white: cut off, or rolled off by Khronos PBR Neutral."""

import colorsys

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import decode
from pointshade_gl.scene.settings import TONES

from ..support import frames
from ..truth.files import MATTE

BRIGHT = ps.Light(direction=(0, 0, 1), intensity=6)
DIM = ps.Light(direction=(0.3, 0.3, 1), intensity=0.8)
SHADINGS = "phong", "gouraud", "flat"


def board(*colors):
    """A board that faces the camera, in stripes of 8 pixels of linear colours."""
    row = np.repeat(255 * np.clip(colors, 0, 1) ** (1 / 2.2), 8, 0)
    color = np.broadcast_to(np.rint(row).astype(np.uint8), (8, len(row), 3))
    return ps.Frame(color, np.ones(color.shape[:2]), ps.Camera(50, 50, 3.5 * len(colors), 3.5, len(row), 8))


def stripes(picture):
    """(n, 3) linear light in the middle of each stripe."""
    return decode(picture[4, 4::8, :3].astype(float))


def spec(light):
    """The formulas of the README of KhronosGroup/ToneMapping, PBR_Neutral, of one colour (3,)."""
    x = min(light)
    f = x - x**2 / 0.16 if x <= 0.08 else 0.04
    p = max(light) - f
    if p <= 0.76:
        return light - f
    n = 1 - 0.24**2 / (p + 1 - 2 * 0.76)
    g = 1 / (0.15 * (p - n) + 1)
    return (light - f) * n / p * g + n * (1 - g)


@pytest.mark.parametrize("shading", SHADINGS)
@pytest.mark.parametrize("samples", [1, 4])
def test_light_is_shown_as_the_source_says(renderer, shading, samples):
    frame = board((0.9, 0.5, 0.2), (0.5, 0.5, 0.5), (0.1, 0.3, 0.8), (0.02, 0.01, 0.03), (0, 0, 0), (0.7, 0.1, 0))
    albedo = stripes(renderer.render(frame, shading="none"))
    for intensity in (0.8, 6, 300):
        light = ps.Light(direction=(0, 0, 1), intensity=intensity)
        picture = renderer.render(frame, light, MATTE, shading=shading, samples=samples, tone="neutral")
        expected = [spec(intensity * one) for one in albedo]
        np.testing.assert_allclose(stripes(picture), expected, atol=0.006)
    assert (picture[..., 3] == 255).all()


def test_what_is_far_above_white_keeps_its_hue_and_order(renderer):
    orange = np.array((1, 0.5, 0.1))
    frame = board(*(share * orange for share in (0.2, 0.35, 0.6, 1)))
    cut, rolled = (stripes(renderer.render(frame, BRIGHT, MATTE, tone=tone)) for tone in TONES)
    hues = [[colorsys.rgb_to_hsv(*one)[0] for one in found] for found in (cut, rolled)]
    assert np.ptp(hues[1]) < 0.025 < np.ptp(hues[0])
    assert (np.diff(rolled.max(-1)) > 0).all() and (np.diff(cut.max(-1)) == 0).any()


def test_without_a_tone_nothing_changes_and_nothing_more_runs():
    frame = frames.sphere_before_wall()
    with ps.Renderer() as one, ps.Renderer() as other:
        for light in (BRIGHT, DIM):
            assert (one.render(frame, light) == other.render(frame, light, tone="none")).all()
        assert dict(one.steps.counts) == dict(other.steps.counts)


def test_backgrounds_grounds_and_unlit_pictures_stay(renderer):
    frame = frames.sphere()
    for options in ({"background": "white"}, {"background": (0.9, 0.2, 0.1)}, {"ground": True}):
        plain, rolled = (renderer.render(frame, BRIGHT, tone=tone, samples=4, **options) for tone in TONES)
        empty = renderer.render(frame, shading="none", samples=4)[..., 3] == 0
        assert (plain[empty] == rolled[empty]).all() and (plain != rolled).any(-1)[~empty].mean() > 0.5
        assert (plain[..., 3] == rolled[..., 3]).all()
    for shading in ("none", "edl"):
        plain, rolled = (renderer.render(frame, shading=shading, tone=tone) for tone in TONES)
        assert (plain == rolled).all()


def test_more_samples_and_another_tone_use_what_is_there():
    frame = frames.sphere()
    with ps.Renderer() as one, ps.Renderer() as other:
        expected = other.render(frame, BRIGHT, samples=3, tone="neutral")
        one.render(frame, BRIGHT, samples=2)
        assert (one.render(frame, BRIGHT, samples=3, tone="neutral") == expected).all()
        assert (one.render(frame, BRIGHT, samples=3) != expected).any()


@pytest.mark.parametrize("wrong", ["filmic", "", None, 1])
def test_other_tones_are_refused(wrong):
    with pytest.raises(ValueError, match=r"unknown tone .*: known are none, neutral"):
        ps.OutputSettings(tone=wrong)


def test_it_is_typed(typed, renderer):
    from PIL import Image

    line = "render vase --samples 1 --light '-.5,-.6,.1 intensity=4' -o"
    assert typed(f"{line} a.png --tone neutral")[0] == 0
    with Image.open("a.png") as found:
        light = ps.Light((-0.5, -0.6, 0.1), intensity=4)
        assert (np.asarray(found) == renderer.render(ps.load_frame("vase"), light, tone="neutral")).all()
    code, _, errors = typed(f"{line} a.png --tone neutrel")
    assert code == 2 and "unknown --tone 'neutrel' (did you mean neutral?): known are none, neutral" in errors
