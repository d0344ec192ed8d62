"""Undo and redo, and the reset: view and lights come back exactly, step by step."""

from dataclasses import fields, replace

import pytest

import pointshade_gl as ps
from pointshade_gl.scene.orbit import OWN_LIGHT, OrbitStage, State
from pointshade_gl.viewer.document import Document, Session
from pointshade_gl.viewer.events import Command, Event, Remember, ShowFrame
from pointshade_gl.viewer.overlay import Messages
from pointshade_gl.viewer.playback import Playback
from pointshade_gl.viewer.state import STEPS, History, Snapshot, Views, restyled, switches_of

from ..support import frames
from ..support.viewing import drag, move, press, quiet, shown

STAGE = OrbitStage.of(frames.sphere())
RED = ps.Light(position=(-1, -0.5, 0.2), color=(1, 0.5, 0.2))
LAMP = ps.Light(position=(0.3, -0.6, 0.9), direction=(-0.3, 0.6, 0.5), cone=(10, 25), intensity=2, shadow=True)
SUN = ps.Light(direction=(0.2, 0.5, 1), color=(0.5, 0.6, 1))
SCENE = ps.Scene(
    (ps.Node(ps.PointObject(frames.sphere_before_wall())), *map(ps.Node, (LAMP, SUN))), camera=frames.CAMERA
)


def moment(**values):
    return Snapshot(State(**values), STAGE, OWN_LIGHT, ())


def wheel(viewer, steps, at=0.0, **held):
    viewer.handle(Event("wheel", steps=steps, time=at, **held))


def click(viewer, x, y, at=0.0):
    for kind in ("press", "release"):
        viewer.handle(Event(kind, "left", x, y, time=at))


def undo(viewer):
    viewer.handle(Event("key", "Z", ctrl=True))


def redo(viewer):
    viewer.handle(Event("key", "Z", ctrl=True, shift=True))


class TestHistory:
    def test_each_step_is_undone_and_done_again_and_a_new_one_ends_that(self):
        history = History(moment())
        for yaw in (10, 20, 30):
            history.act(moment(yaw=yaw))
        assert [history.undo(moment(yaw=30)).state.yaw, history.undo(moment(yaw=20)).state.yaw] == [20, 10]
        assert history.redo(moment(yaw=10)).state.yaw == 20
        history.act(moment(yaw=99))
        assert history.redo(moment(yaw=99)) is None
        assert history.undo(moment(yaw=99)).state.yaw == 20

    def test_changes_of_one_kind_without_a_pause_are_one_step(self):
        history = History(moment())
        for time, yaw in ((0, 1), (0.5, 2), (1.0, 3), (5.0, 4)):
            history.act(moment(yaw=yaw), "wheel", time)
        assert history.undo(moment(yaw=4)).state.yaw == 3
        assert history.undo(moment(yaw=3)).state.yaw == 0

    def test_what_does_not_change_is_no_step_and_help_and_panel_are_none(self):
        history = History(moment())
        history.act(moment())
        history.act(moment(help=True, panel=True))
        assert history.undo(moment()) is None

    def test_there_and_back_in_one_go_is_no_step(self):
        history = History(moment(yaw=5))
        for yaw in (6, 7, 5):
            history.act(moment(yaw=yaw), "drag", pause=float("inf"))
        assert history.undo(moment(yaw=5)) is None

    def test_it_has_an_end(self):
        history = History(moment())
        for yaw in range(STEPS + 50):
            history.act(moment(yaw=yaw + 1))
        undone = 0
        while history.undo(moment()):
            undone += 1
        assert undone == STEPS


class TestUndo:
    def test_drags_wheel_light_and_keys_are_one_step_each(self, open_viewer):
        viewer = open_viewer(lights=[RED, LAMP, SUN])
        steps = [
            lambda: drag(viewer, (160, 120), (200, 100)),
            lambda: [wheel(viewer, 1, at) for at in (1, 1.1, 1.2)],
            lambda: [wheel(viewer, 1, at, shift=True) for at in (1.3, 1.4)],
            lambda: drag(viewer, (160, 120), (150, 100), "middle"),
            lambda: drag(viewer, (160, 120), (150, 100), ctrl=True, shift=True),
            lambda: press(viewer, "L"),
            lambda: press(viewer, "TAB"),
            lambda: press(viewer, "S"),
            lambda: press(viewer, "B"),
            lambda: press(viewer, "R"),
        ]
        moments, pictures = [viewer.moment], [shown(quiet(viewer))]
        for step in steps:
            step()
            assert not viewer.moment.shows(moments[-1])
            moments.append(viewer.moment)
            pictures.append(shown(quiet(viewer)))
        for expected, picture in zip(moments[-2::-1], pictures[-2::-1], strict=True):
            undo(viewer)
            assert viewer.moment.shows(expected) and (shown(quiet(viewer)) == picture).all()
        undo(viewer)
        assert viewer.messages.text == "nothing to undo"
        for k, (expected, picture) in enumerate(zip(moments[1:], pictures[1:], strict=True)):
            (viewer.handle(Event("key", "Y", ctrl=True)) if k % 2 else redo(viewer))
            assert viewer.moment.shows(expected) and (shown(quiet(viewer)) == picture).all()
        redo(viewer)
        assert viewer.messages.text == "nothing to do again"

    def test_a_placed_light_goes_back_to_where_it_was_before_it_was_taken_there(self, open_viewer):
        viewer = open_viewer()
        start = viewer.state
        move(viewer, (160, 120), (60, 60))
        click(viewer, 60, 60, 1)
        placed = viewer.state
        assert not placed.light_mode
        undo(viewer)
        assert viewer.state == start
        redo(viewer)
        assert viewer.state == placed

    def test_the_light_that_follows_the_mouse_makes_no_steps_and_stays_when_a_drag_is_undone(self, open_viewer):
        viewer = open_viewer()
        move(viewer, (160, 120), (60, 60))
        hovered = viewer.state
        drag(viewer, (60, 60), (100, 60))
        undo(viewer)
        assert viewer.state == hovered
        undo(viewer)
        assert viewer.state == hovered and viewer.messages.text == "nothing to undo"
        before = viewer.state.light_at
        move(viewer, (100, 60), (101, 60), steps=1)  # and it does not jump to the mouse then
        assert viewer.state.light_at == pytest.approx(before, abs=0.02)

    def test_a_double_click_is_one_step_and_does_not_place_the_light(self, open_viewer):
        viewer = open_viewer()
        before = viewer.state
        click(viewer, 160, 80, 1.0)
        click(viewer, 160, 80, 1.2)
        assert viewer.state.pivot != (0, 0, 0) and viewer.state.light_mode
        undo(viewer)
        assert viewer.state == before
        undo(viewer)
        assert viewer.messages.text == "nothing to undo"

    def test_sliders_of_the_panel_are_steps_too(self, open_viewer, monkeypatch):
        pytest.importorskip("imgui_bundle")
        viewer = open_viewer(panel=True)
        quiet(viewer).step(wait=False)
        before = viewer.state
        draw, intensity = viewer.screen.panel.draw, [1.5, 2.0]

        def slide(*arguments):
            now, effects = draw(*arguments)
            state = replace(now.state, light_intensity=intensity.pop(0)) if intensity else now.state
            return now._replace(state=state), effects

        monkeypatch.setattr(viewer.screen.panel, "draw", slide)
        for _ in range(3):
            shown(viewer)
        assert viewer.state.light_intensity == 2
        undo(viewer)
        assert viewer.state == before

    def test_what_an_application_moves_is_no_step(self, open_viewer):
        viewer = open_viewer()
        viewer.state = viewer.state.with_light_direction((1, 0, 0))
        drag(viewer, (160, 120), (200, 100))
        viewer.state = viewer.state.with_light_direction((0, 1, 0))
        undo(viewer)
        assert viewer.state.towards == pytest.approx((1, 0, 0)) and viewer.state.yaw == 0
        undo(viewer)
        assert viewer.messages.text == "nothing to undo"


OTHERS = {
    "yaw": 20,
    "pitch": 10,
    "roll": 5,
    "distance": 2,
    "pan": (0.1, 0),
    "pivot": (0, 0, 0.1),
    "light_at": (0.5, 0),
    "light_reach": 2,
    "light_mode": False,
    "light_color": (1, 0, 0),
    "light_intensity": 2,
    "lit": False,
    "shadows": True,
}  # a value that is not the default
LOOKS = {
    "material": ps.Material(0.2, 0.8, 0.4, 50), "shading": "flat", "normals": "star", "point_size": 2.0,
    "max_depth_step": "3%", "noise": "kinect", "flying": "snap", "splat": "round", "unlight": True,
    "remove_highlights": True, "align": True, "missing": "keep",
}  # fmt: skip
FINISHES = {
    "environment": "sky", "environment_intensity": 2, "environment_rotation": 90, "ambient_occlusion": True,
    "tone": "neutral",
}  # fmt: skip
EVERYTHING = [
    *((name, lambda now, n=name: now._replace(state=replace(now.state, **{n: OTHERS[n]}))) for name in OTHERS),
    *((name, lambda now, n=name: now._replace(state=now.state.with_look(**{n: LOOKS[n]}))) for name in LOOKS),
    *((name, lambda now, n=name: now._replace(state=now.state.with_finish(**{n: FINISHES[n]}))) for name in FINISHES),
    ("held", lambda now: now._replace(held=LAMP)),
    ("lights", lambda now: now._replace(lights=(SUN,))),
    ("number", lambda now: now._replace(lights=(SUN,), number=1)),
    ("names", lambda now: now._replace(names=("lamp",))),
]


class TestEverything:
    @pytest.mark.parametrize("change", [change for _, change in EVERYTHING], ids=[name for name, _ in EVERYTHING])
    def test_undo_redo_and_r_know_every_field(self, change):
        session = Session(Document(Playback([frames.sphere()], [None], 8, print), State()), Messages())
        start = session.moment
        session.moment = changed = change(start)
        assert changed != start
        session.perform(Remember())
        for effect, expected in [(Command.UNDO, start), (Command.REDO, changed), (Command.RESET, start)]:
            session.perform(effect)
            assert session.moment == expected

    def test_no_field_is_forgotten(self):
        named = {name for name, _ in EVERYTHING}
        assert {field.name for field in fields(State)} == {*OTHERS, "look", "finish", "help", "panel", "readout"}
        assert {field.name for field in fields(ps.Appearance)} == {
            *LOOKS,
            "upsample",
            "normals_at",
            "temporal",
        }  # no switch
        assert named >= set(Snapshot._fields) - {"state", "stage", "switches"}

    def test_views_and_nodes_that_are_off_come_back_and_clouds_look_as_before(self):
        cloud = ps.Node(ps.PointCloud([(0, 0, 1), (0, 1, 1), (1, 0, 1)]), "cloud")
        node = ps.Node(ps.PointObject(frames.sphere()), "ball", children=(cloud, ps.Node(LAMP)))
        scene = ps.Scene((node,), camera=frames.CAMERA)
        sphere = frames.sphere()
        both = Views((sphere, sphere), ("0", "1"), sphere, (True, True))
        off = scene.with_node((0, 0), visible=False)
        large = restyled(scene, lambda _: {"splat": "ball", "point_size": "3px"})
        for before, after in ((both, both.switched(1, False)), (scene, off), (scene, large)):
            first = before.home if isinstance(before, Views) else before
            session = Session(Document(Playback([first], [None], 8, print), State()), Messages())
            session.frame = before
            session.document.history.follow(session.moment)
            session.perform(ShowFrame(after))
            session.perform(Remember())
            for effect, expected in [(Command.UNDO, before), (Command.REDO, after), (Command.RESET, before)]:
                session.perform(effect)
                assert switches_of(session.frame) == switches_of(expected)

    def test_merging_is_no_step(self, open_viewer):
        viewer = open_viewer([frames.sphere(), frames.sphere()], views=2)
        while viewer.document.playback.is_merging:
            viewer.step()
        press(viewer, "M", "M")
        undo(viewer)
        assert viewer.messages.text == "nothing to undo"

    def test_an_application_that_shows_another_scene_is_not_taken_back(self, open_viewer):
        viewer = open_viewer(SCENE)
        press(viewer, "S")
        viewer.frame = other = SCENE.with_node((0,), name="other")
        undo(viewer)
        assert viewer.frame is other and viewer.state.shadows


class TestReset:
    @pytest.mark.parametrize(
        ("source", "options"),
        [(frames.sphere(), {}), (frames.sphere(), {"lights": [RED, LAMP, SUN]}), (SCENE, {})],
        ids=["frame", "lights", "scene"],
    )
    def test_r_brings_back_exactly_what_was_there_at_the_start(self, open_viewer, source, options):
        viewer = open_viewer(source, **options)
        start, picture = viewer.moment, shown(quiet(viewer))
        move(viewer, (160, 120), (60, 60))
        press(viewer, "TAB", "L", "S")
        drag(viewer, (160, 120), (200, 100))
        drag(viewer, (160, 120), (150, 100), "middle")
        drag(viewer, (160, 120), (150, 100), ctrl=True, shift=True)
        wheel(viewer, 3, 1)
        wheel(viewer, 3, 2, shift=True)
        click(viewer, 160, 80, 3)
        click(viewer, 160, 80, 3.1)
        press(viewer, "B")
        viewer.state = replace(viewer.state, light_color=(1, 0, 0), light_intensity=2)
        press(viewer, "R")
        assert viewer.moment == start
        assert (shown(quiet(viewer)) == picture).all()

    def test_r_keeps_the_help_and_the_panel(self, open_viewer):
        viewer = open_viewer()
        start = viewer.state
        press(viewer, "2", "N", "+", "U", "E", "A", "H", "R")
        assert viewer.state == replace(start, help=True)

    def test_r_knows_a_state_that_the_caller_gave_and_one_that_on_start_made(self, open_viewer):
        given = State(yaw=20, light_at=(0.5, 0.5), light_mode=False, light_color=(0, 1, 0))
        viewer = open_viewer(state=given)
        drag(viewer, (160, 120), (200, 100))
        press(viewer, "L", "R")
        assert viewer.state == given

    def test_lights_of_the_world_stand_there_again_when_another_frame_is_shown(self, open_viewer):
        other = ps.Frame(
            frames.sphere().color, frames.sphere().depth, frames.CAMERA, ps.orbit_pose(None, (0, 0, 1.5), 20)
        )
        viewer = open_viewer(lights=[RED, SUN])
        viewer.frame = other
        move(viewer, (160, 120), (60, 60))
        press(viewer, "R")
        light = viewer.state.light(viewer.stage, viewer.pose, viewer.held)
        assert light.position == pytest.approx(RED.position) and viewer.lights == (SUN,)
