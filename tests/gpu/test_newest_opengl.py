"""The OpenGL that is asked for: drivers are played by what they give."""

import sys

import moderngl
import pytest

import pointshade_gl as ps
from pointshade_gl.gpu.context.context import _create

from ..support import frames
from ..support.drivers import need_compute

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="EGL opens contexts on Linux")
REFUSED = "eglCreateContext failed (0x3009)"


@pytest.fixture
def driver(renderer, monkeypatch):
    """driver(newest) plays one that gives what it is asked for, and nothing above `newest`.

    It returns the versions that are asked for from then on.
    """
    from glcontext import egl

    create = egl.create_context

    def play(newest):
        asked = []

        def answer(*, glversion, **how):
            asked.append(glversion)
            if glversion > newest:
                raise Exception(REFUSED)
            return create(glversion=330, **how)  # as new as this machine's driver has

        monkeypatch.setattr(egl, "create_context", answer)
        return asked

    return play


@pytest.mark.parametrize(
    ("newest", "asked"),
    [(460, [460]), (450, [460, 450]), (430, [460, 450, 430]), (420, [460, 450, 430, 330]), (330, [460, 450, 430, 330])],
)
def test_a_driver_that_gives_what_it_is_asked_for_gives_its_newest(renderer, driver, capfd, newest, asked):
    seen, frame = driver(newest), frames.sphere()
    with ps.Renderer() as made:
        assert (made.render(frame) == renderer.render(frame)).all()
    assert seen == asked
    assert capfd.readouterr() == ("", "")  # a refusal is no news


def test_a_driver_without_opengl_is_one_sentence_with_its_last_word(driver):
    asked = driver(0)
    with pytest.raises(ps.ContextError, match=r"no OpenGL 3\.3 context \(eglCreateContext failed .*\); .*install"):
        ps.Renderer()
    assert asked == [460, 450, 430, 330]


@pytest.mark.parametrize(("system", "asked"), [("win32", [460, 450, 430]), ("darwin", [330])])
def test_other_systems_are_asked_in_the_same_order_and_macos_for_what_it_has(monkeypatch, system, asked):
    seen = []

    def create(*, standalone, require):
        seen.append(require)
        if require > 430:
            raise ValueError("Requested OpenGL version 460, got version 430")
        return "a context"

    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setattr(moderngl, "create_context", create)
    assert _create(0) == "a context" and seen == asked


def test_what_draws_is_told_with_the_driver(renderer, monkeypatch):
    need_compute(renderer)
    monkeypatch.setenv("POINTSHADE_PROGRAMS", "hardware")
    limits = renderer.context.limits()
    assert (limits["rasterizer"], limits["programs"]) == ("compute", "hardware")
    monkeypatch.setenv("POINTSHADE_PROGRAMS", "software")
    monkeypatch.setattr(renderer.context.gl, "version_code", 330)
    limits = renderer.context.limits()
    assert (limits["rasterizer"], limits["programs"]) == ("points", "software")
