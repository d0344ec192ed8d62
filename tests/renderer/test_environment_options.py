"""Light from all around as an option: which lights it leaves, whose it is, and what films and batches make of it."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.batch.manifest import plain_value
from pointshade_gl.estimation.ground import LIGHT as GROUND_LIGHT
from pointshade_gl.estimation.ground import up_and_floor
from pointshade_gl.pipeline.light_setup import environment_light_of
from pointshade_gl.renderer.requests import RenderRequest
from pointshade_gl.scene.environment import Environment
from pointshade_gl.scene.settings import with_environment_turned
from pointshade_gl.scene.viewpoint import views_of_turn

from ..support import frames

SKY, STUDIO = Environment.of("sky"), Environment.of("studio")
LAMP = ps.Light(position=(0, -1, 0))
TRIANGLE = ps.Mesh([(0, 0, 2), (1, 0, 2), (0, 1, 2)], [(0, 1, 2)])


def lights_of(scene, **options):
    return list(RenderRequest.of(scene, **options).lights_of(scene))


def test_beside_an_environment_there_is_no_lamp_unless_one_is_given_or_the_scene_has_its_own():
    dark, lit = ps.Scene([ps.Node(TRIANGLE)]), ps.Scene([ps.Node(TRIANGLE), ps.Node(LAMP)])
    assert lights_of(dark) == [ps.Light()] and lights_of(dark, ground=True) == [GROUND_LIGHT]
    for more in ({}, {"ground": True}):
        assert lights_of(dark, environment="sky", **more) == []
        assert lights_of(dark, environment="sky", light=LAMP, **more) == [LAMP]
        assert lights_of(lit, environment="sky", **more) == [LAMP]
    below = ps.Scene([ps.Node(TRIANGLE)], environment="studio")
    assert lights_of(below) == [] and lights_of(below, light=LAMP) == [LAMP]


def test_an_environment_that_is_given_replaces_the_scenes_own():
    scene = ps.Scene([ps.Node(TRIANGLE)], environment="studio")
    assert scene.environment is STUDIO and scene.framed().environment is STUDIO
    assert scene.with_node((0,), visible=False).environment is STUDIO
    assert RenderRequest.of(scene).environment_of(scene) is STUDIO
    assert RenderRequest.of(scene, environment="sky").environment_of(scene) is SKY
    assert RenderRequest.of(frames.sphere()).environment_of(ps.Scene()) is None
    with pytest.raises(ValueError, match="environment must be sky or studio"):
        ps.Scene(environment="studio.hdr")


def test_a_view_hands_its_environment_on():
    view = ps.View(finish=ps.OutputSettings(environment="sky", environment_rotation=20))
    frame = frames.sphere()
    assert RenderRequest.seen(frame, view).finish.environment is SKY
    assert view.of(frame)["environment"] is SKY and view.of(frame)["environment_rotation"] == 20
    assert view == ps.View(finish=ps.OutputSettings(environment="sky", environment_rotation=20)) != ps.View()


def test_a_turntable_of_the_light_turns_the_environment():
    frame, view = (
        frames.sphere(),
        ps.View([LAMP], finish=ps.OutputSettings(environment="sky", environment_rotation=350)),
    )
    turned = list(views_of_turn(frame, view, "light", 4))
    assert [one.finish.environment_rotation for one in turned] == [350, 80, 170, 260]
    places = [np.array(one.lights[0].position) for one in turned]
    plain = [one.lights[0].position for one in views_of_turn(frame, ps.View([LAMP]), "light", 4)]
    np.testing.assert_array_equal(places, plain)
    alone = ps.View(finish=ps.OutputSettings(environment="sky"))
    assert all(one.lights == () for one in views_of_turn(frame, alone, "light", 4))
    assert [one.finish for one in views_of_turn(frame, alone, "camera", 2)] == [alone.finish] * 2
    scene = ps.Scene([ps.Node(TRIANGLE)], environment="sky")
    assert next(views_of_turn(scene, ps.View(), "light", 4)).lights == ()


def test_a_rotation_that_is_a_matrix_is_turned_about_up():
    """With y up: a quarter counterclockwise seen from above brings what was seen along z to x."""
    turned = with_environment_turned(ps.OutputSettings(environment_rotation=np.eye(3)), 90)
    np.testing.assert_allclose(np.array(turned.environment_rotation) @ (1, 0, 0), (0, 0, 1), atol=1e-12)
    lying = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # the world's z is up
    quarter = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])  # the same about z
    turned = with_environment_turned(ps.OutputSettings(environment_rotation=lying), 90, quarter)
    other = with_environment_turned(ps.OutputSettings(environment_rotation=lying), 90)
    np.testing.assert_allclose(turned.environment_rotation, other.environment_rotation, atol=1e-12)


def test_a_manifest_tells_environments_apart():
    bright, dim = (Environment(np.full((4, 8, 3), level)) for level in (1.0, 0.5))
    assert plain_value(ps.OutputSettings(environment="sky")) == {"environment": "sky"}
    first, second = (plain_value(ps.OutputSettings(environment=one))["environment"] for one in (bright, dim))
    assert first != second and first == plain_value(Environment(np.ones((4, 8, 3)), "b.hdr")) and len(first) == 71


@pytest.mark.parametrize("yaw", [0, 70, 200])
def test_a_scenes_own_environment_stands_in_the_worlds_axes_and_another_behind_its_camera(yaw):
    pose = ps.orbit_pose(np.diag([1.0, -1, -1, 1]), (0, 0, -2), yaw, 20, upright=(0, 1, 0))
    scene = ps.Scene([ps.Node(TRIANGLE)], ps.Camera.from_fov(50, 40, 30), pose, environment="studio")
    own = environment_light_of(ps.OutputSettings(), scene, scene, (), (), up_and_floor)
    np.testing.assert_allclose(own.to_sky, np.eye(3), atol=1e-9)
    turned = environment_light_of(ps.OutputSettings(environment_rotation=90), scene, scene, (), (), up_and_floor)
    np.testing.assert_allclose(np.array(turned.to_sky) @ (1, 0, 0), (0, 0, 1), atol=1e-9)
    given = environment_light_of(ps.OutputSettings(environment="sky"), scene, scene, (), (), up_and_floor)
    away = np.array(given.to_sky) @ pose[:3, 2]
    assert away[0] == pytest.approx(0, abs=1e-9) and away[2] < -0.9
