"""Where viewer and light go: pure arithmetic, no window."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.orbit import RIM, OrbitStage, State, marker_place, rims_from
from pointshade_gl.viewer.events import Event

from ..support import frames
from ..support.viewing import Hand

CAMERA = ps.Camera(500, 500, 319.5, 239.5, 640, 480)
STAGE = OrbitStage(np.array([0.0, 0.0, 2.0]), 1.0, np.eye(3))


def moves(*places, state=None, mouse=None, camera=CAMERA, **options):
    """The states after the mouse moved through these places."""
    mouse, state, states = mouse or Hand(), state or State(), []
    for x, y in places:
        state = mouse.handle(Event("move", x=x, y=y, **options), state, STAGE, camera)
        states.append(state)
    return states


def line(start, end, steps=40):
    return [tuple(np.array(start) + (np.array(end) - start) * k / steps) for k in range(steps + 1)]


class TestLight:
    @pytest.mark.parametrize(
        ("place", "towards"),
        [
            ((0, 0), (0, 0, -1)),
            ((1, 0), (1, 0, 0)),
            ((-1, 0), (-1, 0, 0)),
            ((0, -1), (0, -1, 0)),
            ((0, 1), (0, 1, 0)),
            ((0.5, 0), (math.sqrt(0.5), 0, -math.sqrt(0.5))),
            ((1.5, 0), (math.sqrt(0.5), 0, math.sqrt(0.5))),
        ],
    )
    def test_the_window_is_a_map_of_directions(self, place, towards):
        assert replace(State(), light_at=place).towards == pytest.approx(towards, abs=1e-12)

    @pytest.mark.parametrize("place", [(0.2, 0.1), (-0.7, 0.9), (0.0, -1.5), (1.3, -1.1)])
    def test_a_direction_has_its_place_on_the_window(self, place):
        state = replace(State(), light_at=place)
        assert State().with_light_direction(state.towards).light_at == pytest.approx(place)

    def test_a_mouse_that_goes_straight_through_window_and_rim_turns_the_light_without_a_jump(self):
        states = moves(*line((10, 20), (630, 470), 400))
        angles = [math.acos(np.clip(a.towards @ b.towards, -1, 1)) for a, b in pairwise(states)]
        assert max(map(math.degrees, angles)) < 3
        assert states[0].light_at == pytest.approx(State().light_at)

    def test_the_marker_comes_to_the_mouse_and_stays_there(self):
        *_, last = moves(*line((100, 400), (500, 300)), *line((500, 300), (200, 100)))
        assert marker_place(last, STAGE, CAMERA) == pytest.approx((200, 100), abs=4)

    def test_it_is_in_the_world_where_the_viewer_sees_it(self):
        state = replace(State(), light_at=(-1, 0))
        assert state.light(STAGE, np.eye(4)).position == pytest.approx((-1, 0, 2))
        assert replace(state, light_reach=2).light(STAGE, np.eye(4)).position == pytest.approx((-2, 0, 2))
        assert replace(state, yaw=90).light(STAGE, np.eye(4)).position == pytest.approx((0, 0, 1))
        assert state.light(STAGE, ps.orbit_pose(None, (0, 0, 2), yaw=90)).position == pytest.approx((0, 0, 1))

    def test_shift_and_wheel_move_it_away_and_back(self):
        mouse = Hand()
        there = mouse.handle(Event("wheel", steps=3, shift=True), State(), STAGE, CAMERA)
        assert there.light_reach > 1 and there.distance == 1
        back = mouse.handle(Event("wheel", steps=-3, shift=True), there, STAGE, CAMERA)
        assert back.light_reach == pytest.approx(1)

    def test_outside_of_light_mode_the_plain_mouse_leaves_it_and_ctrl_shift_drag_moves_it(self):
        parked, mouse = State(light_mode=False), Hand()
        assert moves((10, 10), (600, 400), state=parked, mouse=mouse)[-1] == parked
        mouse.handle(Event("press", "left", 600, 400, ctrl=True, shift=True), parked, STAGE, CAMERA)
        first, *_, last = moves((600, 400), *line((600, 400), (100, 400)), state=parked, mouse=mouse)
        assert first.light_at == pytest.approx(parked.light_at)
        assert last.light_at[0] < -0.8

    def test_it_does_not_jump_when_the_window_changes_its_shape_or_the_mouse_comes_back_elsewhere(self):
        mouse = Hand()
        *_, held = moves(*line((100, 100), (400, 300)), mouse=mouse)
        (after,) = moves((400, 300), state=held, mouse=mouse, camera=CAMERA.fitted(900, 500))
        assert after.light_at == pytest.approx(held.light_at)
        mouse.handle(Event("leave"), after, STAGE, CAMERA)
        assert moves((5, 470), state=after, mouse=mouse)[0].light_at == pytest.approx(held.light_at)

    def test_it_does_not_jump_after_an_orbit_or_a_pan(self):
        for drag, options in (("left", {}), ("middle", {}), ("left", {"ctrl": True})):
            mouse = Hand()
            *_, held = moves(*line((100, 100), (300, 200)), mouse=mouse)
            mouse.handle(Event("press", drag, 300, 200, **options), held, STAGE, CAMERA)
            *_, dragged = moves(*line((300, 200), (420, 260)), state=held, mouse=mouse)
            assert dragged != held and dragged.light_at == held.light_at
            mouse.handle(Event("release", drag, 420, 260), dragged, STAGE, CAMERA)
            assert moves((420, 260), state=dragged, mouse=mouse)[0].light_at == pytest.approx(held.light_at)

    def test_in_light_mode_it_stays_with_the_viewer_and_otherwise_with_the_object(self):
        start = replace(State(), light_at=(-0.5, 0.2))
        with_viewer = start.orbited(100, 30, 480)
        assert with_viewer.light_at == start.light_at
        parked = replace(start, light_mode=False)
        before, after = parked.light(STAGE, np.eye(4)), parked.orbited(100, 30, 480).light(STAGE, np.eye(4))
        assert after.position == pytest.approx(before.position)


class TestView:
    def test_at_the_start_it_is_the_frame_s_own(self):
        assert State().pose(STAGE) == pytest.approx(np.eye(4))

    def test_orbiting_keeps_the_object_where_it_is_and_is_that_of_the_command_line(self):
        state = State(yaw=30, pitch=-20, distance=0.5)
        assert state.pose(STAGE) == pytest.approx(ps.orbit_pose(None, STAGE.pivot, 30, -20, 0.5))

    def test_the_near_side_goes_with_the_mouse(self):
        dragged = State().orbited(40, 0, 480)
        near = np.linalg.inv(dragged.pose(STAGE)) @ [0, 0, 1.5, 1]
        assert near[0] > 0.05
        near = np.linalg.inv(State().orbited(0, 40, 480).pose(STAGE)) @ [0, 0, 1.5, 1]
        assert near[1] > 0.05

    def test_drags_about_a_single_frame_end_softly_however_many_moves_they_are(self):
        stage = OrbitStage.of(frames.sphere())
        assert stage.one_sided and not OrbitStage.of(ps.Scene((ps.Node(ps.PointObject(frames.sphere())),))).one_sided
        near = State().orbited(-80, 40, 480, stage)
        assert (near.yaw, near.pitch) == pytest.approx((20, 10)) and not near.is_near_end(stage)  # as of others
        far = State().orbited(-4000, 4000, 480, stage)
        assert 49 < far.yaw <= 50 and 49 < far.pitch <= 50 and far.is_near_end(stage)
        once, often = State(yaw=-10).orbited(300, 0, 480, stage), State(yaw=-10)
        for _ in range(60):
            often = often.orbited(5, 0, 480, stage)
        assert once.yaw == pytest.approx(often.yaw) and -50 < once.yaw < -45
        back = once.orbited(-40, 0, 480, stage)
        assert back.yaw == pytest.approx(once.yaw + 10)  # the way back is as fast as ever

    def test_a_view_that_was_asked_for_from_farther_round_stays_and_comes_back(self):
        stage = OrbitStage.of(frames.sphere())
        typed = State(yaw=120, pitch=-70)
        outward = typed.orbited(-40, -40, 480, stage)
        assert (outward.yaw, outward.pitch) == pytest.approx((120, -70))
        inward = typed.orbited(40, 40, 480, stage)
        assert (inward.yaw, inward.pitch) == pytest.approx((110, -60))

    @pytest.mark.parametrize("zoom", [-5, 0, 7])
    def test_panning_takes_the_object_along_with_the_mouse_at_every_zoom(self, zoom):
        state = State(yaw=20).zoomed(zoom)
        before, after = state.middle(STAGE, CAMERA), state.panned(60, -30, CAMERA.fx).middle(STAGE, CAMERA)
        assert np.subtract(after, before) == pytest.approx((60, -30))
        pose = state.panned(60, -30, CAMERA.fx).pose(STAGE)
        x, y, z, _ = np.linalg.inv(pose) @ [*STAGE.pivot, 1]
        assert (CAMERA.fx * x / z + CAMERA.cx, CAMERA.fy * y / z + CAMERA.cy) == pytest.approx(after)

    def test_zoom_has_an_end_on_both_sides(self):
        assert 0 < State().zoomed(1000).distance < 0.1
        assert 10 < State().zoomed(-1000).distance < 100

    def test_reset_brings_view_and_light_back_and_keeps_what_was_chosen(self):
        start = State(yaw=9, light_at=(0.1, 0.2), light_color=(1, 0, 0), shadows=True)
        used = State(
            yaw=3, pan=(1, 0), pivot=(1, 0, 0), light_at=(1, 1), light_reach=3, light_intensity=2, light_mode=False,
            lit=False, look=ps.Appearance(shading="flat"), help=True,
        )  # fmt: skip
        assert used.reset_view(start) == replace(start, look=ps.Appearance(shading="flat"), help=True)


class TestLook:
    def test_one_of_its_values_changes_and_the_others_stay(self):
        state = State(look=ps.Appearance(splat="round", noise="kinect"), yaw=3).with_look(shading="flat", point_size=2)
        assert state == State(look=ps.Appearance(splat="round", noise="kinect", shading="flat", point_size=2), yaw=3)
        assert (State().point_size, state.point_size) == (1, 2)

    @pytest.mark.parametrize("option", ["normals", "point_size", "noise"])
    def test_it_has_one_value_for_all_pixels(self, option):
        with pytest.raises(ValueError, match="must have one value for all pixels"):
            State(look=ps.Appearance(**{option: np.ones((2, 2))}))


def test_the_marker_is_where_the_mouse_has_to_be():
    state = replace(State(), light_at=(0.3, -0.4))
    x, y = marker_place(state, STAGE, CAMERA)
    assert rims_from(state.middle(STAGE, CAMERA), x, y, CAMERA) == pytest.approx((0.3, -0.4))
    assert x == pytest.approx(319.5 + 0.3 * RIM * 480)


def test_a_frame_with_rows_that_run_upwards_is_handled_as_it_looks():
    """Negative fy: the same picture, the same light and drags on the screen."""
    frame = frames.sphere()
    c = frame.camera
    turned = ps.Frame(frame.color, frame.depth, ps.Camera(c.fx, -c.fy, c.cx, c.cy, c.width, c.height))
    stage, other = OrbitStage.of(frame), OrbitStage.of(turned)
    state = State(yaw=10, pitch=20, distance=0.8, pan=(0.1, 0.05), light_at=(0.2, -0.7))
    place = np.linalg.inv(state.pose(stage)) @ [*(state.light(stage, np.eye(4)).position or ()), 1]
    same = np.linalg.inv(state.pose(other)) @ [*(state.light(other, np.eye(4)).position or ()), 1]
    assert same == pytest.approx(place * (1, -1, 1, 1))
    assert state.middle(other, turned.camera) == pytest.approx(state.middle(stage, c))


def test_a_frame_without_any_depth_has_a_stage():
    assert OrbitStage.of(frames.all_missing()).radius > 0


@pytest.mark.parametrize("axis", [(0.0, 1.0, 0.0), (0.0, 0.9, 0.4358898943540673)])
@pytest.mark.parametrize("fy", [1, -1])
def test_a_viewer_stands_where_it_is_put_at_any_roll_and_also_beyond_the_object(axis, fy):
    stage = OrbitStage(np.array([0.1, -0.2, 1.5]), 1.0, np.diag([1.0, fy, 1.0]), axis)
    rng = np.random.default_rng(4)
    for _ in range(50):
        pose = np.eye(4)
        pose[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        pose[:3, :3] *= np.sign(np.linalg.det(pose[:3, :3]))
        pose[:3, 3] = rng.normal(size=3)
        np.testing.assert_allclose(State().seen_from(pose, stage).pose(stage), pose, atol=1e-12)
        turned = State(yaw=rng.uniform(-179, 179), pitch=rng.uniform(-89, 89), distance=0.7, pan=(0.1, -0.05))
        again = State().seen_from(turned.pose(stage), stage)
        assert (again.yaw, again.pitch, again.roll) == pytest.approx((turned.yaw, turned.pitch, 0))
        assert (again.distance, *again.pan) == pytest.approx((turned.distance, *turned.pan))


def test_with_a_roll_a_drag_still_turns_what_the_mouse_holds():
    plain, rolled = (State(roll=roll).orbited(30, 0, 300) for roll in (0, 90))
    assert (plain.yaw, plain.pitch) == (-12, 0) and (rolled.yaw, rolled.pitch) == pytest.approx((0, 12))


def test_a_view_from_a_side_may_end_a_roll_and_a_drag_keeps_it():
    assert State(roll=20).turned(90, 0, roll=0.0).roll == 0 and State(roll=20).orbited(30, 5, 300).roll == 20
