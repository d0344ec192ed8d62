"""Only what changed runs: counts the steps of the pipeline after each kind of change."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.gpu.core.steps import Steps, Versioned

from ..support import frames

SIDE = ps.orbit_pose(None, (0, 0, 1.5), yaw=10)
LIGHT = {"light"}
VIEW = {"splats", "resolve"}
NORMALS = {"surface", *VIEW}
ALL = {"upload", *NORMALS}


def ran(renderer, frame, **options):
    """The steps that run for one more picture, and the picture."""
    before = renderer.steps.counts.copy()
    image = renderer.render(frame, **options)
    return {name for name, count in (renderer.steps.counts - before).items() if count}, image


@pytest.fixture
def frame(renderer):
    made = frames.sphere()
    assert ran(renderer, made)[0] == ALL
    assert ran(renderer, made)[0] == {"resolve", "light"}
    return made


@pytest.mark.parametrize(
    ("options", "steps"),
    [
        ({}, LIGHT),
        ({"light": ps.Light(position=(1, 0, 0))}, LIGHT),
        ({"light": [], "ambient_occlusion": False}, LIGHT),
        ({"ambient_occlusion": True}, LIGHT | {"resolve", "visibility"}),
        ({"material": ps.Material(specular=0)}, LIGHT),
        ({"pose": SIDE}, VIEW),
        ({"camera": frames.CAMERA.fitted(50, 40)}, VIEW),
        ({"point_size": 2}, VIEW),
        ({"point_size": np.full((120, 160), 1.5)}, VIEW),
        ({"splat": "round"}, VIEW),
        ({"normals": "triangles-8"}, NORMALS),
        ({"normals": np.full((120, 160, 3), (0, 0, -1.0))}, NORMALS),
        ({"noise": 0.001}, NORMALS),
    ],
)
def test_only_what_changed_runs_again_and_the_picture_is_that_of_a_new_renderer(renderer, frame, options, steps):
    count, image = ran(renderer, frame, **options)
    assert count == steps
    again = (
        LIGHT if steps == LIGHT or "visibility" in steps else {"resolve", "light"}
    )  # the second light on a view keeps its surfaces
    assert ran(renderer, frame, **options)[0] == again
    assert ran(renderer, frame, **options)[0] == LIGHT
    renderer.render(frames.step())
    assert (renderer.render(frames.sphere(), **options) == image).all()


@pytest.mark.parametrize(
    ("shading", "steps"), [("none", {"resolve"}), ("flat", {"light", "resolve"}), ("gouraud", {"light", "resolve"})]
)
def test_models_that_light_points_look_them_up_again(renderer, frame, shading, steps):
    phong = renderer.render(frame)
    at_once = shading == "flat" and renderer.context.gl.version_code < 430  # GL points are lit as they are drawn
    assert ran(renderer, frame, shading=shading)[0] == ({"lit splats"} if at_once else steps)
    assert ran(renderer, frame, shading=shading, light=ps.Light(position=(1, 0, 0)))[0] == steps
    assert (renderer.render(frame) == phong).all()


def test_an_equal_frame_is_a_new_one(renderer, frame):
    assert ran(renderer, ps.Frame(frame.color, frame.depth, frame.camera))[0] == ALL


def test_arrays_that_the_caller_has_written_into_are_seen(renderer, frame):
    sizes = np.ones(frame.depth.shape, np.float32)
    renderer.render(frame, point_size=sizes)
    sizes[60, 80] = 0
    assert ran(renderer, frame, point_size=sizes)[0] == VIEW


def test_normals_are_shared_by_pictures_and_estimates(renderer, frame):
    before = renderer.steps.counts.copy()
    renderer.estimate_normals(frame)
    assert renderer.steps.counts == before
    renderer.estimate_normals(frame, "central")
    assert ran(renderer, frame)[0] == NORMALS


def test_a_step_that_failed_runs_again(renderer, frame):
    with pytest.raises(ValueError, match="larger than this GPU's textures"):
        renderer.render(frame, camera=ps.Camera(9, 9, 9, 9, 10**6, 4))
    assert ran(renderer, frame)[0] == VIEW


def test_timing_is_asked_for_and_tells_each_step(renderer, frame):
    renderer.steps.laps.clear()
    renderer.steps.timed = True
    ran(renderer, frames.sphere())
    renderer.steps.timed = False
    assert set(renderer.steps.laps) == ALL
    assert all(lap.wall_ms > 0 for lap in renderer.steps.laps.values())


def test_a_step_inside_another_is_timed_too_and_one_that_fails_leaves_the_timer_ready(renderer):
    steps = renderer.steps

    def outer():
        steps.always("inner", lambda: None)
        raise RuntimeError("half way")

    steps.timed = True
    try:
        with renderer._in_use():
            with pytest.raises(RuntimeError, match="half way"):
                steps.always("outer", outer)
            steps.always("outer", lambda: steps.always("inner", lambda: None))
    finally:
        steps.timed = False
    assert 0 < steps.laps["inner"].wall_ms < steps.laps["outer"].wall_ms


def test_scenes_and_single_frames_follow_each_other(renderer, frame):
    alone = renderer.render(frame, pose=SIDE)
    scene = ps.Scene((ps.Node(ps.PointObject(frame)),), camera=frame.camera, pose=SIDE)
    for _ in range(2):
        assert (renderer.render(scene) == alone).all()
        assert (renderer.render(frame, pose=SIDE) == alone).all()
    renderer.render(scene, light=ps.Light(position=(1, 0, 0)))
    assert (renderer.render(frame, pose=SIDE) == alone).all()


class TestWhenAStepRuns:
    """By its own arguments, without a GPU."""

    @pytest.fixture
    def steps(self):
        return Steps(None, True)

    def test_equal_values_are_unchanged_and_the_result_is_kept(self, steps):
        for _ in range(2):
            assert steps.run("add", lambda a, b: a + b.sum(), 1, np.ones(3)) == 4
        assert steps.counts == {"add": 1}
        assert steps.run("add", lambda a, b: a + b.sum(), 2, np.ones(3)) == 5

    def test_an_array_that_was_written_into_has_changed(self, steps):
        array = np.ones(3)
        steps.run("sum", np.sum, array)
        array[0] = 7
        assert steps.run("sum", np.sum, array) == 9

    def test_what_another_step_wrote_has_changed_and_what_the_step_wrote_itself_has_not(self, steps):
        image = Versioned()

        def write(into, _):
            into.raise_version()

        for _ in range(2):
            steps.run("write", write, image, 1)
        assert steps.counts == {"write": 1}
        image.raise_version()
        steps.run("write", write, image, 1)
        assert steps.counts == {"write": 2}

    def test_another_image_of_the_same_version_is_another_argument(self, steps):
        for image in (Versioned(), Versioned()):
            steps.run("read", id, image)
        assert steps.counts == {"read": 2}

    def test_images_are_seen_inside_of_tuples(self, steps):
        image = Versioned()
        steps.run("read", id, (1, (image, "a")))
        image.raise_version()
        steps.run("read", id, (1, (image, "a")))
        assert steps.counts == {"read": 2}

    def test_each_thing_that_a_step_runs_on_has_its_own_last_run(self, steps):
        one, two = Versioned(), Versioned()
        for of in (one, two, one, two):
            steps.run("step", str, 1, of=of)
        assert steps.counts == {"step": 2}
        steps.forget(of=one)
        for of in (one, two):
            steps.run("step", str, 1, of=of)
        assert steps.counts == {"step": 3}

    def test_a_step_that_failed_is_not_taken_for_done(self, steps):
        steps.run("divide", lambda a: 1 / a, 1)
        with pytest.raises(ZeroDivisionError):
            steps.run("divide", lambda a: 1 / a, 0)
        with pytest.raises(ZeroDivisionError):
            steps.run("divide", lambda a: 1 / a, 0)
        assert steps.run("divide", lambda a: 1 / a, 1) == 1


def test_a_stream_that_is_lit_as_it_is_drawn_keeps_no_surfaces_of_views(renderer):
    lamp, first = ps.Light(position=(1, 0, 0)), frames.sphere()
    surfaces = [renderer.draw(first, light) and renderer._pipeline._target.surfaces for light in (None, lamp)][1]
    assert surfaces._made
    renderer.draw(frames.sphere())
    assert not surfaces._made
    renderer.draw(first)
    picture = renderer.render(first, lamp)
    assert surfaces._made
    with ps.Renderer() as other:
        assert (other.render(first, lamp) == picture).all()


def test_a_stream_whose_lights_cast_shadows_makes_its_surfaces_once(renderer):
    light = ps.Light(position=(1, -1, 0), shadow=True)
    renderer.draw(frames.sphere(), light)
    surface = renderer._pipeline._target.surfaces.surface
    renderer.draw(frames.sphere(), light)
    assert renderer._pipeline._target.surfaces.surface is surface
