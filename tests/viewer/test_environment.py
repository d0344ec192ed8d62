"""Light from all around in the window: keys, the right button and the panel change it, undo and reset bring it back."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.cli import main as cli
from pointshade_gl.scene.orbit import OWN_LIGHT, OrbitStage, State
from pointshade_gl.viewer.controller import Control, ControllerInputs, controller
from pointshade_gl.viewer.events import Event, Remember, ShowMessage
from pointshade_gl.viewer.panel_sections import Widgets, show_environment
from pointshade_gl.viewer.state import ShownPicture, Snapshot

from ..support import frames
from ..support.viewing import drag, press, quiet, shown

SKY, STUDIO = map(ps.Environment.of, ("sky", "studio"))
OWN = ps.Environment(np.full((4, 8, 3), 0.5), "a.hdr")
STAGE = OrbitStage(np.array([0.0, 0.0, 2.0]), 1.0, np.eye(3))
PLACE = ControllerInputs(ps.Camera(300, 300, 159.5, 119.5, 320, 240), 320, 240)
TRIANGLE = ps.Mesh([(-1, -1, 3), (1, -1, 3), (0, 1, 3)], [(0, 1, 2)])


def under(**finish):
    return Control(Snapshot(State(finish=ps.OutputSettings(**finish)), STAGE, OWN_LIGHT, ()))


def after(control, *events):
    for event in events:
        control, effects = controller(control, PLACE, event)
    return control.now.state.finish, effects


def key(name, **held):
    return Event("key", name, **held)


class TestKeys:
    @pytest.mark.parametrize(
        ("before", "following", "says"),
        [
            (None, SKY, "light from all around: sky, with the mouse's light low"),
            (SKY, STUDIO, "light from all around: studio"),
            (STUDIO, None, "no light from all around"),
            (OWN, None, "no light from all around"),
        ],
    )
    def test_e_takes_the_next_environment(self, before, following, says):
        finish, effects = after(under(environment=before, environment_rotation=20), key("E"))
        assert finish.environment is following and finish.environment_rotation == 20
        assert effects == (ShowMessage(says), Remember())

    def test_shift_and_arrows_turn_it(self):
        turned, _ = after(under(environment="sky"), *[key("RIGHT", shift=True)] * 3)
        assert turned.environment_rotation == 45
        turned, _ = after(under(environment="sky"), key("LEFT", shift=True))
        assert turned.environment_rotation == 345
        finish, effects = after(under(), key("RIGHT", shift=True))
        assert finish == ps.OutputSettings() and effects[0] == ShowMessage(
            "there is no environment to turn: E gives one"
        )

    @pytest.mark.parametrize(
        ("before", "following", "word"),
        [(None, True, "yes"), (True, False, "no"), (False, None, "auto"), (0.3, None, "auto")],
    )
    def test_a_goes_through_ambient_occlusion(self, before, following, word):
        finish, effects = after(under(ambient_occlusion=before), key("A"))
        assert finish.ambient_occlusion is following and effects[0].text.endswith(f": {word}")

    def test_while_unlit_a_message_says_when_it_is_seen(self):
        _, effects = after(under(), key("B"), key("E"))
        assert effects[0].text == "light from all around: sky, with the mouse's light low; seen once lit again (B)"


class TestMouse:
    def test_the_right_button_turns_it_and_nothing_else(self):
        press_, move = Event("press", "right", 100, 100), Event("move", x=160, y=130)
        before = under(environment="sky")
        control, effects = controller(controller(before, PLACE, press_)[0], PLACE, move)
        assert control.now.state == before.now.state.environment_turned(60 / 240 * 120) != before.now.state
        assert control.now.state.finish.environment_rotation == 30 and isinstance(effects[0], Remember)
        control, _ = controller(control, PLACE, Event("release", "right", 160, 130))
        control, _ = controller(control, PLACE, Event("move", x=60, y=130))
        assert control.now.state.finish.environment_rotation == 30

    def test_without_an_environment_nothing_turns(self):
        before = under()
        control, _ = controller(before, PLACE, Event("press", "right", 100, 100))
        control, _ = controller(control, PLACE, Event("move", x=160, y=130))
        assert control.now.state == before.now.state


class Ui:
    """The panel's widgets, without a window: what a user makes of them, by their names."""

    def __init__(self, **made):
        self.made, self.seen, self.imgui = made, {}, self

    option = Widgets.option

    def section(self, name, opened):
        return True

    def begin_disabled(self, off):
        pass

    def end_disabled(self):
        pass

    def choose(self, name, value, default, known, why=""):
        self.seen[name] = value
        return self.made.get(name, value)

    def slide(self, name, value, default, low, high, why="", logarithmic=False):
        self.seen[name] = value
        return self.made.get(name, value)


class TestPanel:
    def test_it_changes_all_of_it(self):
        state = State(finish=ps.OutputSettings(environment="sky"))
        made = {"environment": "studio", "brightness": 0.5, "turned": 90.0, "occlusion": "no"}
        finish = show_environment(Ui(**made), state, True).finish
        assert finish == ps.OutputSettings(
            environment="studio", environment_intensity=0.5, environment_rotation=90, ambient_occlusion=False
        )
        assert show_environment(Ui(environment="none"), state, True).finish.environment is None

    @pytest.mark.parametrize(
        ("finish", "names"),
        [
            (ps.OutputSettings(), {"environment": "none", "occlusion": "auto"}),
            (ps.OutputSettings(environment=OWN, ambient_occlusion=0.25), {"environment": "own", "occlusion": "0.25"}),
            (ps.OutputSettings(environment="sky", environment_rotation=np.eye(3)), {"environment": "sky"}),
            (ps.OutputSettings(environment="sky", environment_rotation=-30, environment_intensity=50), {"turned": -30}),
        ],
    )
    def test_untouched_it_changes_nothing(self, finish, names):
        ui, state = Ui(), State(finish=finish)
        assert show_environment(ui, state, True) == state
        assert names.items() <= ui.seen.items() and ("turned" in ui.seen) == (
            type(finish.environment_rotation) is float
        )


class TestWindow:
    def test_nothing_burns_under_it_and_the_two_differ(self, open_viewer):
        """White is as bright as it may be without the mouse's light, which is low beside light from all around."""
        viewer = quiet(open_viewer(ps.load_frame("vase")))
        pictures = []
        for _ in range(2):
            press(viewer, "E")
            pictures.append(viewer.screen.read(viewer.picture, 1).astype(int))
            seen = pictures[-1][pictures[-1][..., 3] > 0]
            assert (seen[:, :3] >= 254).any(-1).mean() < 0.001
        assert np.abs(pictures[0] - pictures[1]).mean(where=pictures[0][..., 3:] > 0) > 7
        press(viewer, "E")
        assert viewer.state.light_intensity == 1
        assert open_viewer(state=State(finish=ps.OutputSettings(environment="sky"))).state.light_intensity < 0.5

    def test_it_is_drawn_undone_and_reset(self, open_viewer):
        viewer = quiet(open_viewer(frames.sphere()))
        plain = shown(viewer)
        press(viewer, "E")
        lit = shown(quiet(viewer))
        assert (lit != plain).mean() > 0.1
        drag(viewer, (100, 100), (160, 100), "right")
        assert viewer.state.finish.environment_rotation == 30 and (shown(quiet(viewer)) != lit).any()
        viewer.handle(Event("key", "Z", ctrl=True))
        assert viewer.state.finish == ps.OutputSettings(environment="sky")
        viewer.handle(Event("key", "Z", ctrl=True))
        assert viewer.state.finish == ps.OutputSettings() and (shown(quiet(viewer)) == plain).all()
        viewer.handle(Event("key", "Y", ctrl=True))
        press(viewer, "R")
        assert viewer.state.finish == ps.OutputSettings()

    def test_a_scenes_own_environment_can_be_switched_off(self, open_viewer):
        scene = ps.Scene([ps.Node(TRIANGLE)], environment=OWN)
        viewer = open_viewer(scene)
        assert viewer.state.finish.environment is OWN and viewer.picture.request().source is viewer.frame
        press(viewer, "E")
        dark = viewer.picture.request()
        assert dark.source.environment is None and dark.environment_of(dark.source) is None
        assert viewer.picture.request().source is dark.source
        press(viewer, "R")
        assert viewer.state.finish.environment is OWN

    def test_the_finish_of_the_window_is_its_own_otherwise(self, open_viewer):
        finish = ps.OutputSettings(7, "white", True, environment="sky", ambient_occlusion=False)
        request = open_viewer(state=State(finish=finish)).picture.request(3)
        assert request.finish == ps.OutputSettings(
            3, exposure=0.0, fill=request.finish.fill, environment="sky", ambient_occlusion=False
        )

    def test_the_command_line_opens_it_so(self, typed, monkeypatch, tmp_path):
        opened = []

        class Opened(Exception):
            pass

        def open_window(*arguments, **options):
            opened.append(options["state"].finish)
            raise Opened

        monkeypatch.setattr("pointshade_gl.viewer.Viewer", open_window)
        with pytest.raises(Opened):
            cli.command_line()(["view", "vase", "--environment", "studio", "--ao", "no"], standalone_mode=False)
        assert opened == [ps.OutputSettings(environment="studio", ambient_occlusion=False)]


class TestRest:
    """What hides light from all around is found for each frame of a stream, and for each view of a scene."""

    MUCH = ps.Appearance(ps.Material(ambient=0.8))

    def request(self, content, rests, plays=False, **finish):
        state = State(look=self.MUCH, finish=ps.OutputSettings(**finish))
        picture = ShownPicture(Snapshot(state, STAGE, OWN_LIGHT, ()), content, content.camera, plays=plays)
        return picture.request(1, rests).finish.ambient_occlusion

    def test_a_stream_and_a_scene_have_none_until_they_rest(self):
        frame = frames.sphere()
        scene = ps.Scene([ps.Node(content=TRIANGLE)]).framed()
        assert self.request(frame, False) is None and self.request(frame, True, plays=True) is None
        assert self.request(frame, False, plays=True) is False
        assert self.request(scene, False) is False and self.request(scene, True) is None

    def test_unless_it_is_asked_for(self):
        assert self.request(frames.sphere(), False, plays=True, ambient_occlusion=True) is True
