"""A window in which nothing moves shows ever more samples, and only one while something does."""

import time
from dataclasses import replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.viewer import screen as redrawing
from pointshade_gl.viewer.events import Event
from pointshade_gl.viewer.viewer import SAMPLES, Viewer

from ..support import frames
from ..support.viewing import drag, move, press, quiet, shown


def rested(viewer):
    """The window after nothing has moved for long; how many turns it took."""
    turns = 0
    while viewer.patience(time.perf_counter()) is not None:
        viewer.step()
        turns += 1
    return turns


def refined(open_viewer, monkeypatch, *arguments, **options):
    monkeypatch.setattr(redrawing, "REST", 0.0)
    viewer = quiet(open_viewer(*arguments, **options))
    viewer.samples = SAMPLES
    return viewer


def test_at_rest_it_is_refined_in_short_turns_and_then_sleeps(open_viewer, monkeypatch):
    viewer = refined(open_viewer, monkeypatch)
    drag(viewer, (100, 100), (140, 110))
    viewer.step(wait=False)
    assert viewer.redrawing.samples == 1
    first, before = shown(viewer).astype(float), viewer.renderer.steps.counts["splats"]
    turns = rested(viewer)
    assert viewer.redrawing.samples == 64 and turns >= 60 / redrawing.MOST_ADDED
    assert viewer.renderer.steps.counts["splats"] - before <= 64 + 1
    last = shown(viewer).astype(float)
    assert abs(last.mean() - first.mean()) < 0.5  # no jump in brightness
    assert np.abs(last - first).max() > 1


@pytest.mark.system
def test_whatever_moves_starts_again_and_texts_do_not(open_viewer, monkeypatch):
    viewer = refined(open_viewer, monkeypatch)
    rested(viewer)
    for act in (lambda: move(viewer, (10, 10), (60, 60)), lambda: press(viewer, "4", "3"), lambda: press(viewer, "R")):
        act()
        viewer.step(wait=False)
        assert viewer.redrawing.samples == 1
        rested(quiet(viewer))
        assert viewer.redrawing.samples == 64
    viewer.held = replace(viewer.held, radius=0.2)
    viewer.step(wait=False)
    assert viewer.redrawing.samples == 1
    rested(viewer)
    viewer.say("text")
    press(viewer, "H")
    viewer.handle(Event("refresh"))
    viewer.step(wait=False)
    assert viewer.redrawing.samples == 64


def test_it_waits_until_things_rest(open_viewer):
    viewer = quiet(open_viewer())
    viewer.samples = SAMPLES
    viewer.handle(Event("move", x=5, y=5))
    move(viewer, (5, 5), (50, 50))
    viewer.step(wait=False)
    assert 0 < viewer.patience(time.perf_counter()) <= redrawing.REST
    viewer.step(wait=False)
    assert viewer.redrawing.samples == 1


def test_what_is_slow_is_coarser_while_it_moves_and_fine_as_soon_as_it_rests(open_viewer, monkeypatch):
    viewer = quiet(open_viewer(frames.sphere_before_wall()))
    fine = shown(viewer).astype(float)
    monkeypatch.setattr(redrawing, "SLOW", 0.0)  # everything is
    monkeypatch.setattr(redrawing, "MOVING_SECONDS", 1e-9)
    viewer.samples = SAMPLES
    for x in (10, 12, 10, 12, 160):
        viewer.handle(Event("move", x=x, y=120))
        viewer.step(wait=False)
    assert viewer.redrawing.coarse == redrawing.MOST_COARSE
    drawn = viewer.screen._drawn.size
    assert drawn == tuple(round(side / redrawing.MOST_COARSE) for side in viewer.window.picture_size)
    assert shown(viewer).shape == fine.shape and viewer.redrawing.coarse == redrawing.MOST_COARSE
    blurred = shown(viewer).astype(float)
    monkeypatch.setattr(redrawing, "REST", 0.0)
    viewer.step(wait=False)
    assert (viewer.redrawing.coarse, viewer.redrawing.samples) == (1, 1)
    assert 0.2 < np.abs(shown(viewer) - blurred).mean() < 12


def test_shadows_become_coarse_before_pixels_do_and_fine_as_soon_as_things_rest(open_viewer, monkeypatch):
    viewer = quiet(open_viewer(frames.sphere_before_wall()))
    viewer.samples = 4
    press(viewer, "S")
    asked, draw = [], viewer.screen.renderer.draw
    monkeypatch.setattr(viewer.screen.renderer, "draw", lambda request: asked.append(request) or draw(request))
    monkeypatch.setattr(redrawing, "SLOW", 0.0)  # everything is, but by little
    monkeypatch.setattr(redrawing, "MOVING_SECONDS", 1e9)
    for x in (10, 12, 10):
        viewer.handle(Event("move", x=x, y=120))
        viewer.step(wait=False)
    assert [request.coarse for request in asked[-2:]] == [redrawing.MOST_COARSE] * 2
    assert viewer.screen._drawn.size == tuple(viewer.window.picture_size)
    monkeypatch.setattr(redrawing, "REST", 0.0)
    rested(viewer)
    assert (asked[-1].coarse, viewer.redrawing.samples) == (1, 4)
    with viewer.renderer.context.in_use():
        drawn = viewer.screen._drawn.read()
    with ps.Renderer() as renderer:
        assert drawn == renderer.render(asked[-1]).tobytes()


def test_values_under_the_mouse_are_those_of_all_pixels(open_viewer, monkeypatch):
    monkeypatch.setattr(redrawing, "SLOW", 0.0)
    viewer = quiet(open_viewer())
    viewer.samples = SAMPLES
    press(viewer, "D")
    for x in range(100, 160, 10):
        viewer.handle(Event("move", x=x, y=120))
        viewer.step(wait=False)
        assert viewer.redrawing.coarse == 1


def test_a_photograph_as_it_was_taken_stays_sharp(open_viewer, monkeypatch):
    """At the size of the frame, unlit."""
    viewer = refined(open_viewer, monkeypatch, window_size=(160, 120))
    press(viewer, "B")
    rested(quiet(viewer))
    own = (viewer.camera.width, viewer.camera.height) == (160, 120)
    assert viewer.redrawing.samples == (1 if own else 64)


def test_a_saved_picture_has_the_samples_of_a_still_or_those_that_there_are(open_viewer, monkeypatch, tmp_path):
    from PIL import Image

    monkeypatch.chdir(tmp_path)
    viewer = refined(open_viewer, monkeypatch)
    for samples in (16, 64):
        with Image.open(viewer.save_picture()) as saved:
            assert (np.asarray(saved) == viewer.screen.read(viewer.picture, samples)).all()
        assert viewer.redrawing.samples == samples
        rested(viewer)


def test_the_panel_makes_the_light_larger(open_viewer):
    lights = [ps.Light(position=(-0.8, -0.9, 0.2), radius=0.1, shadow=True)]
    viewer = open_viewer(lights=lights, panel=True, window_size=(640, 480))
    for _ in range(4):
        viewer.step(wait=False)
    assert viewer.held.radius == 0.1
    slide = viewer.screen.panel._widgets.slide
    sizes = {"radius": 0.15, "angle": 3.0}

    def slid(name, value, *others, **options):
        return sizes[name] if name in sizes else slide(name, value, *others, **options)

    viewer.screen.panel._widgets.slide = slid
    shown(viewer)
    assert viewer.held.radius == 0.15
    viewer.held = ps.Light(direction=(0, 0, 1), angle=2)
    shown(viewer)
    assert viewer.held.angle == 3


def test_a_stream_is_shown_with_one_sample_a_frame(display):
    viewer = Viewer([frames.sphere(), frames.step()], window_size=(160, 120), fps=200)
    try:
        for _ in range(20):
            viewer.step()
            assert viewer.redrawing.samples == 1
    finally:
        viewer.release()
