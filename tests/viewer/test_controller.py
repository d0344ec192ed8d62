"""The controller without a window: an event in, another state and effects out."""

import math
from dataclasses import replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.orbit import OWN_LIGHT, OrbitStage, State, marker_place
from pointshade_gl.viewer.controller import (
    BAR,
    Control,
    ControllerInputs,
    controller,
    hides_pointer,
    is_for_timeline,
    turned_around,
)
from pointshade_gl.viewer.events import (
    ChangeRate,
    Command,
    Event,
    Open,
    PlayCommand,
    Remember,
    Scrub,
    Seek,
    ShowMessage,
    StepFrames,
    TakeLight,
    TurnAround,
)
from pointshade_gl.viewer.keys import BY_NAME, OWN_LOOKS, STAYS
from pointshade_gl.viewer.state import Snapshot

CAMERA = ps.Camera(300, 300, 159.5, 119.5, 320, 240)
STAGE = OrbitStage(np.array([0.0, 0.0, 2.0]), 1.0, np.eye(3))
PLACE = ControllerInputs(CAMERA, 320, 240)
FILM = replace(PLACE, total=10)
START = Control(Snapshot(State(), STAGE, OWN_LIGHT, ()))


def after(*events, control=START, place=PLACE):
    """What is there after some events, and the effects of the last one."""
    effects = ()
    for event in events:
        control, effects = controller(control, place, event, is_for_timeline(control, place, event))
    return control, effects


def key(name, **held):
    return Event("key", name, **held)


def click(x, y, time):
    return [Event(kind, "left", x, y, time=time) for kind in ("press", "release")]


class TestKeys:
    @pytest.mark.parametrize(
        ("name", "effect"),
        [
            ("R", Command.RESET),
            ("P", Command.SAVE_PICTURE),
            ("G", Command.TOGGLE_PANEL),
            ("Q", Command.CLOSE),
            ("ESCAPE", Command.LEAVE),
            ("KP.", Command.FRAME_OBJECT),
            ("F11", Command.TOGGLE_FULL_SCREEN),
            ("CTRL+O", Command.OPEN_FILES),
            ("SHIFT+O", Command.OPEN_FOLDER),
            ("SPACE", PlayCommand.TOGGLE_PAUSE),
            ("SHIFT+SPACE", PlayCommand.TOGGLE_LOOP),
            ("M", PlayCommand.TOGGLE_MERGE),
            ("LEFT", StepFrames(-1)),
            ("RIGHT", StepFrames(1)),
            ("HOME", Seek(0)),
            ("END", Seek(-1)),
            (",", ChangeRate(0.5)),
            (".", ChangeRate(2.0)),
        ],
    )
    def test_what_others_do_is_only_asked_for(self, name, effect):
        control, effects = after(key(name))
        assert control == START and effects[0] == effect and effects[-1] == Remember()

    def test_ctrl_makes_them_others(self):
        assert after(key("Z", ctrl=True))[1][0] == Command.UNDO
        assert after(key("Z", ctrl=True, shift=True))[1][0] == after(key("Y", ctrl=True))[1][0] == Command.REDO
        assert after(key("Z"))[1] == (Remember(),)

    def test_light_and_look_are_another_state_and_a_message(self):
        control, effects = after(key("2"))
        assert control == START.with_state(State().with_look(shading="flat"))
        assert effects == (ShowMessage("shading: flat"), Remember())
        assert after(key("L"))[0].now.state == State(light_mode=False)
        assert after(key("L"))[1][0] == ShowMessage(STAYS)
        assert after(key("B"))[0].now.state == State(lit=False)
        assert after(key("S"))[0].now.state == State(shadows=True)

    @pytest.mark.parametrize("name", ["N", "+", "-", "U", "X"])
    def test_the_look_of_a_scene_is_its_own(self, name):
        assert after(key(name))[0] != START
        control, effects = after(key(name), place=replace(PLACE, shown=ps.Scene()))
        assert control == START and effects == (ShowMessage(OWN_LOOKS), Remember())

    def test_tab_takes_the_next_light_of_several(self):
        assert after(key("TAB"))[1][0] == ShowMessage("there is only one light: the panel (G) adds one")
        several = replace(START, now=START.now._replace(lights=(OWN_LIGHT,), number=1))
        assert after(key("TAB"), control=several)[1][0] == TakeLight(0)

    def test_escape_closes_the_help_first(self):
        helped, _ = after(key("H"))
        assert helped.now.state.help
        assert after(key("ESCAPE"), control=helped) == (START, (Remember(),))

    def test_a_key_that_the_panel_took_does_nothing(self):
        for name in BY_NAME:
            assert controller(START, PLACE, key(name), is_taken=True) == (START, ())

    def test_a_character_is_no_key(self):
        assert after(Event("text", "q")) == (START, ())


class TestMouse:
    def test_a_drag_turns_the_view_as_one_step(self):
        pressed, effects = after(Event("press", "left", 100, 100))
        assert pressed.now == START.now and effects == (Remember(("drag", 1), pause=math.inf),)
        turned, effects = after(Event("move", x=160, y=100), control=pressed)
        assert turned.now.state.yaw == State().orbited(60, 0, 240).yaw
        assert effects == (Remember(("drag", 1), pause=math.inf),)
        released, effects = after(Event("release", "left", 160, 100), control=turned)
        assert released.now == turned.now and effects == ()
        assert after(Event("press", "left", 5, 5), control=released)[1][0].kind == ("drag", 2)

    def test_the_wheel_zooms_or_moves_the_light(self):
        control, effects = after(Event("wheel", steps=2, time=7.0))
        assert control.now.state == State().zoomed(2) and effects == (Remember(("wheel", False), 7.0),)
        control, effects = after(Event("wheel", steps=2, shift=True, time=7.0))
        assert control.now.state == State().light_reached(2) and effects == (Remember(("wheel", True), 7.0),)

    def test_a_click_places_the_light_and_a_second_one_turns_around_the_point_instead(self):
        placed, effects = after(*click(80, 60, 1.0))
        state = placed.now.state
        assert not state.light_mode and marker_place(state, STAGE, CAMERA) == pytest.approx((80, 60))
        assert effects == (ShowMessage(STAYS), Remember("place", pause=-math.inf))
        again, effects = after(Event("press", "left", 80, 60, time=1.2), control=placed)
        assert again.now == START.now and effects == (Command.DROP_STEP, TurnAround(80, 60))
        late, effects = after(Event("press", "left", 80, 60, time=3.0), control=placed)
        assert late.now == placed.now and TurnAround(80, 60) not in effects

    def test_a_light_that_is_kept_already_is_left_alone(self):
        parked = START.with_state(State(light_mode=False))
        control, effects = after(*click(80, 60, 1.0), control=parked)
        assert control.now == parked.now and effects == ()
        _, effects = after(Event("press", "left", 80, 60, time=1.2), control=control)
        assert effects == (TurnAround(80, 60),)

    def test_turned_around_a_point_the_picture_stays_and_beside_it_around_the_middle(self):
        point = 0.3, -0.2, 1.5
        control, effects = turned_around(START, point)
        state = control.now.state
        assert state.pose(STAGE) == pytest.approx(np.eye(4)) and state.seen_pivot(STAGE) == pytest.approx(point)
        assert effects == (ShowMessage("drags turn around this point"), Remember())
        control, effects = turned_around(control, None)
        assert control.now.state.pivot == (0, 0, 0)
        assert effects[0] == ShowMessage("drags turn around the object's middle")

    def test_over_the_panel_it_is_away_and_files_are_opened_from_there(self):
        held, _ = after(Event("move", x=100, y=100, time=0.0), Event("move", x=120, y=100, time=0.1))
        control, effects = controller(held, PLACE, Event("move", x=300, y=10, time=1.0), is_taken=True)
        assert control.now == held.now and control.mouse.last is None and effects == ()
        control, effects = after(Event("drop", x=50, y=50, paths=("a", "b")), control=held)
        assert control.mouse.last is None and effects == (Open(("a", "b")),)

    def test_of_a_minimised_window_it_does_nothing(self):
        away = replace(PLACE, camera=None)
        for event in (Event("press", "left", 5, 5), Event("move", x=90, y=50), Event("wheel", steps=1)):
            assert after(event, place=away) == (START, ())
        assert after(Event("drop", paths=("a",)), place=away)[1] == (Open(("a",)),)
        assert after(Event("refresh"), place=away) == (START, (Command.REDRAW,))


class TestTimeline:
    BAR = 240 - BAR / 2

    def test_it_shows_the_frame_below_the_mouse_until_that_is_released(self):
        control, effects = after(Event("press", "left", 170, self.BAR), place=FILM)
        assert control.is_scrubbing and control.now == START.now and effects == (Scrub(5),)
        for x, frame in ((-50, 0), (100, 3), (900, 9)):
            assert after(Event("move", x=x, y=10), control=control, place=FILM)[1] == (Scrub(frame),)
        released, effects = after(Event("release", "left", 100, 10), control=control, place=FILM)
        assert not released.is_scrubbing and effects == ()

    @pytest.mark.parametrize(("place", "y"), [(PLACE, BAR), (FILM, 200)])
    def test_beside_it_or_without_frames_the_mouse_is_for_the_picture(self, place, y):
        event = Event("press", "left", 170, y)
        assert not is_for_timeline(START, place, event)
        control, _ = after(event, place=place)
        assert not control.is_scrubbing and control.mouse.drag == "orbit"

    def test_the_pointer_is_hidden_where_the_marker_stands_for_it(self):
        over, beside = Event("move", x=9, y=self.BAR), Event("move", x=9, y=9)
        assert hides_pointer(START, FILM, beside, False) and not hides_pointer(START, FILM, over, False)
        assert not hides_pointer(START, FILM, beside, is_taken=True)
        assert not hides_pointer(START.with_state(State(lit=False)), FILM, beside, False)
        turning, _ = after(Event("press", "left", 100, 100), Event("move", x=160, y=100))
        assert not hides_pointer(turning, FILM, beside, False)


def test_it_changes_nothing_that_it_was_given():
    control = START
    for event in (*click(80, 60, 1.0), *click(80, 60, 1.2), key("N"), key("S"), Event("wheel", steps=1)):
        before = replace(control)
        answer = controller(control, PLACE, event)
        assert control == before and controller(control, PLACE, event) == answer
        control = answer[0]
    assert Control(Snapshot(State(), STAGE, OWN_LIGHT, ())) == START
