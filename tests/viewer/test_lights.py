"""The lights of the window: each keeps its kind when the mouse takes it and leaves it, for frames as for scenes."""

from dataclasses import replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.orbit import UPPER_LEFT, OrbitStage, State, marker_place
from pointshade_gl.viewer.controller import added, placed, removed, taking, titles
from pointshade_gl.viewer.overlay import draw_marker
from pointshade_gl.viewer.state import Snapshot

from ..support import frames
from ..support.viewing import move, press, quiet, shown

POINT = ps.Light(position=(-1, -0.5, 0.2), color=(1, 0.5, 0.2), attenuation=(1, 0.2, 0.1))
SPOT = ps.Light(position=(0.3, -0.6, 0.9), direction=(-0.3, 0.6, 0.5), cone=(10, 25), intensity=2, shadow=True)
SUN = ps.Light(direction=(0.2, 0.5, 1), color=(0.5, 0.6, 1))
AREA = ps.Light((0.4, -0.3, 0.1), (-0.3, 0.6, 0.9), size=(0.3, 0.1), watts=4)
LIGHTS = [POINT, SPOT, SUN]


def of_frame(open_viewer, lights):
    return quiet(open_viewer(frames.sphere(), lights=lights))


def of_scene(open_viewer, lights):
    nodes = ps.Node(ps.PointObject(frames.sphere())), *(ps.Node(light) for light in lights)
    return quiet(open_viewer(ps.Scene(nodes, camera=frames.CAMERA)))


both = pytest.mark.parametrize("show", [of_frame, of_scene])


def drawn(viewer):
    """The lights that draw the window, the one that the mouse holds first."""
    return viewer.picture.lights


def same(light, other):
    """Equal, to rounding; a direction may have another length."""
    unit = [None if one.direction is None else one.direction / np.linalg.norm(one.direction) for one in (light, other)]
    assert (unit[0] is None) == (unit[1] is None) and (light.position is None) == (other.position is None)
    assert unit[0] is None or unit[0] == pytest.approx(unit[1], abs=1e-6)
    assert light.position is None or light.position == pytest.approx(other.position, abs=1e-6)
    assert replace(light, position=None, direction=None) == replace(other, position=None, direction=None)


@both
@pytest.mark.parametrize("first", range(3))
def test_tab_takes_one_light_after_the_other_and_changes_none(open_viewer, show, first):
    lights = LIGHTS[first:] + LIGHTS[:first]
    viewer = show(open_viewer, lights)
    aimed = replace(SPOT, direction=viewer.stage.pivot - SPOT.position)  # the mouse's spot turns to the object's middle
    for turn in range(2):
        for k in range(3):
            if drawn(viewer)[0].is_spot or turn:
                lights = [aimed if light.is_spot else light for light in lights]
            for light, expected in zip(drawn(viewer), lights[k:] + lights[:k], strict=True):
                same(light, expected)
            press(viewer, "TAB")


@both
@pytest.mark.parametrize("light", [*LIGHTS, AREA])
def test_a_light_that_the_mouse_has_moved_is_still_of_its_kind(open_viewer, show, light):
    viewer = show(open_viewer, [light, POINT])
    move(viewer, (160, 120), (250, 40))
    press(viewer, "TAB")
    (left,) = viewer.lights
    moved = {name: getattr(left, name) for name in ("position", "direction")}
    assert left == replace(light, **moved)
    assert all((moved[name] is None) == (getattr(light, name) is None) for name in moved)
    assert moved != {name: getattr(light, name) for name in moved}


@both
def test_a_light_without_place_and_direction_stays_far_away(open_viewer, show):
    viewer = show(open_viewer, [ps.Light()])
    (light,) = drawn(viewer)
    assert light.position is None
    assert light.direction == pytest.approx(np.array((1, 1, 2)) / np.sqrt(6))


@both
def test_s_switches_off_the_shadows_of_all_lights_and_leaves_each_its_own(open_viewer, show):
    viewer = show(open_viewer, LIGHTS)
    assert [light.shadow for light in drawn(viewer)] == [False, True, False]
    press(viewer, "S")
    assert not any(light.shadow for light in drawn(viewer))
    press(viewer, "TAB", "S")
    assert [light.shadow for light in drawn(viewer)] == [True, False, False]


def test_the_viewer_s_own_light_casts_shadows_when_s_asks_for_them(open_viewer):
    viewer = quiet(open_viewer(frames.sphere_before_wall()))
    move(viewer, (160, 120), (30, 60))
    assert [light.shadow for light in drawn(viewer)] == [False]
    plain = shown(viewer).astype(int)
    press(viewer, "S")
    assert [light.shadow for light in drawn(viewer)] == [True]
    assert (shown(quiet(viewer)) < plain - 10).any()


def test_s_says_when_no_light_casts_shadows(open_viewer):
    viewer = of_frame(open_viewer, [POINT, SUN])
    press(viewer, "S")
    assert viewer.messages.text == "shadows on, but no light casts any"
    press(viewer, "S")
    assert viewer.messages.text == "shadows off, but no light casts any"


def test_what_has_lights_without_shadows_or_none_starts_without(open_viewer):
    assert not of_frame(open_viewer, [POINT, SUN]).state.shadows
    viewer = open_viewer(ps.PointCloud(np.random.default_rng(0).normal((0, 0, 5), 0.5, (500, 3))))
    assert not viewer.state.shadows and viewer.held.shadow  # until S asks for them
    assert of_frame(open_viewer, [POINT, SPOT]).state.shadows


STAGE, POSE = OrbitStage.of(frames.sphere()), np.eye(4)


def holding(number):
    """Three lights with names, of which the mouse holds this one."""
    state = State().with_light(POINT, STAGE, POSE)
    return taking(number, Snapshot(state, STAGE, POINT, (SPOT, SUN), 0, ("lamp", "spot", "sun")), POSE)


class TestMoreOrFewer:
    @pytest.mark.parametrize("number", range(3))
    def test_an_added_one_is_the_last_of_the_list_and_the_others_stay(self, number):
        before = holding(number)
        now = added(before, POSE)
        assert titles(now) == ["lamp (point)", "spot (spot)", "sun (directional)", "light 4 (point)"]
        assert now.number == 3 and titles(taking(number, now, POSE)) == titles(now)
        for light, other in zip(before.lights, taking(number, now, POSE).lights[: 2 - number], strict=False):
            assert light == other

    def test_ten_more_stand_in_ten_places(self):
        now = Snapshot(State(light_at=(0.0, 0.0)), STAGE, POINT, ())
        for _ in range(10):
            now = added(now, POSE)
        places = np.array([light.position for light in (now.state.light(STAGE, POSE), *now.lights)])
        apart = np.linalg.norm(places[:, None] - places, axis=-1) + 9 * np.eye(11)
        assert apart.min() > 0.1 * STAGE.radius

    @pytest.mark.parametrize("gone", range(3))
    @pytest.mark.parametrize("number", range(3))
    def test_a_removed_one_leaves_the_others_with_their_names(self, number, gone):
        names = [name for k, name in enumerate(titles(holding(number))) if k != gone]
        now = removed(gone, holding(number), POSE)
        assert titles(now) == names and len(now.lights) == 1
        held = names[now.number]
        assert gone == number or held == titles(holding(number))[number]

    def test_the_last_one_stays(self):
        now = Snapshot(State(), STAGE, POINT, ())
        assert removed(0, now, POSE) is now

    def test_no_direction_is_none(self):
        now = Snapshot(State().with_light(SUN, STAGE, POSE), STAGE, SUN, ())
        assert placed(now, (0, 0, 0), POSE).state.light_at == pytest.approx(now.state.light_at)


def test_each_light_has_a_marker_that_points_at_the_object(open_viewer):
    """The first is white and above on the left, the second blue and from the right."""
    lights = ps.Light(position=(-1, -1, 0.2)), ps.Light(direction=(-1, 0, 0.3), color=(0.1, 0.2, 1))
    viewer = of_frame(open_viewer, lights)
    u, v = viewer.state.middle(viewer.stage, viewer.camera)
    with_markers, viewer.state = shown(quiet(viewer)).astype(int), replace(viewer.state, lit=False)
    assert viewer.state.light_at != UPPER_LEFT
    for k, state in enumerate([viewer.state, viewer.state.with_light(viewer.lights[0], viewer.stage, POSE)]):
        x, y = marker_place(state, viewer.stage, viewer.camera)
        (column, row), radius = np.rint((x, y)).astype(int), (7, 4.5)[k]
        assert with_markers[row, column] == pytest.approx(255 * np.array(state.light_color), abs=2)
        way = np.array([u - x, v - y]) / np.hypot(u - x, v - y)
        tip, back = (np.rint((x, y) + side * 2.5 * radius * way).astype(int) for side in (1, -1))
        assert (with_markers[tip[1], tip[0]] == with_markers[row, column]).all()
        assert (with_markers[back[1], back[0]] != with_markers[row, column]).any()


@pytest.mark.parametrize("color", [(1, 1, 1), (1, 0.8, 0.3), (0.1, 0.1, 0.6), (0, 0, 0)])
@pytest.mark.parametrize("ground", [0, 128, 255])
def test_a_marker_is_seen_on_every_ground(color, ground):
    marker = draw_marker(7.0, color, 30, is_behind=False).astype(float)
    share = marker[..., 3:] / 255
    shown = share * marker[..., :3] + (1 - share) * ground
    assert np.abs(shown - ground).max() > 100
