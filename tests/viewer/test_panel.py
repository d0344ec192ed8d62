"""The panel over the picture, with and without its extra."""

import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from PIL import ImageFont

import pointshade_gl as ps
from pointshade_gl.scene.orbit import State
from pointshade_gl.viewer.controller import KINDS, as_kind, kind_of, titles
from pointshade_gl.viewer.events import Event, TakeLight
from pointshade_gl.viewer.overlay import POINTS
from pointshade_gl.viewer.panel_sections import Widgets

from ..support import frames
from ..support.posed_views import corner, disturbed, views
from ..support.viewing import click_row, press, quiet, row_place, rows, settle, shown


class TestPanel:
    def test_g_opens_it_and_the_mouse_over_it_is_its_own(self, open_viewer):
        viewer = open_viewer(window_size=(640, 480))
        before = shown(quiet(viewer))
        press(viewer, "G")
        for _ in range(8):
            viewer.step(wait=False)
        assert (shown(viewer) != before)[:, 400:].mean() > 0.3
        for place in ((540, 100), (541, 101), (545, 120)):
            viewer.handle(Event("move", x=place[0], y=place[1]))
            viewer.step(wait=False)
        light = viewer.state.light_at
        viewer.handle(Event("move", x=560, y=200))
        assert viewer.state.light_at == light
        press(viewer, "G")
        assert (shown(viewer)[:, 400:] != before[:, 400:]).mean() < 0.3

    def test_a_click_on_its_box_changes_the_state(self, open_viewer):
        viewer = open_viewer(window_size=(640, 480), panel=True)
        click_row(viewer, "shadows (S)")
        assert viewer.state.shadows and viewer.state.light_mode
        click_row(viewer, "casts a shadow")
        assert not viewer.held.shadow

    def test_it_changes_nothing_while_it_draws_and_returns_what_was_chosen(self, open_viewer, monkeypatch):
        viewer = open_viewer(lights=TestLights.LAMPS, window_size=(640, 480), panel=True)
        draw, chosen = viewer.screen.panel.draw, []

        def drawn(*arguments):
            before, frame = viewer.moment, viewer.frame
            answer = draw(*arguments)
            assert viewer.moment == before and viewer.frame is frame
            if answer != (before, []):
                chosen.append((answer[0].state.shadows, answer[1]))
            return answer

        monkeypatch.setattr(viewer.screen.panel, "draw", drawn)
        click_row(viewer, "shadows (S)")
        click_row(viewer, "light 2 (directional)")
        assert chosen == [(False, []), (False, [TakeLight(1)])]
        assert not viewer.state.shadows and viewer.light_number == 1

    def test_it_comes_to_rest(self, open_viewer):
        viewer = quiet(open_viewer(panel=True))
        for _ in range(10):
            viewer.step(wait=False)
        assert quiet(viewer).patience(time.perf_counter()) in (0, None)
        viewer.step(wait=False)
        assert viewer.patience(time.perf_counter()) is None
        assert set(viewer.renderer.steps.laps) >= {"surface", "splats", "resolve"}

    def test_it_keeps_what_its_sliders_cannot_show(self, open_viewer):
        look = ps.Appearance(ps.Material(0.1, 7, 0.3, 900), point_size=0.01, max_depth_step=0.07)
        state = State(look=look, light_intensity=9)
        viewer = open_viewer(state=replace(state, panel=True))
        for _ in range(4):
            viewer.step(wait=False)
        assert viewer.state == replace(state, panel=True)

    def test_without_its_extra_the_viewer_works_and_says_how_to_get_it(self, open_viewer, monkeypatch):
        monkeypatch.setitem(sys.modules, "imgui_bundle", None)
        viewer = open_viewer()
        press(viewer, "G")
        assert "pip install '.[gui]' in the clone" in viewer.messages.text and not viewer.state.panel


def write(viewer, text):
    """As from a keyboard: each key comes before its character."""
    for sign in text:
        viewer.handle(Event("key", sign.upper()))
        viewer.handle(Event("text", sign))
    settle(viewer)


def key(viewer, name, **held):
    viewer.handle(Event("key", name, **held))
    settle(viewer)


class TestKeys:
    def test_a_number_is_typed_and_its_keys_do_nothing_else(self, open_viewer):
        viewer = open_viewer(window_size=(640, 480), panel=True)
        click_row(viewer, "ambient", ctrl=True)
        write(viewer, "10.74")
        for name in ("BACKSPACE", "HOME", "DELETE"):
            key(viewer, name)
        before = viewer.state
        press(viewer, "S", "N", "B")  # letters are no part of a number
        key(viewer, "ENTER")
        assert viewer.state.look.material.ambient == 0.7
        assert viewer.state == before.with_look(material=viewer.state.look.material)
        press(viewer, "S")
        assert viewer.state.shadows

    @pytest.mark.system
    def test_impossible_numbers_become_the_nearest_possible(self, open_viewer):
        viewer = open_viewer(window_size=(640, 480), panel=True)
        for text, number in (("-3", 0.0), ("1e30", 1.0)):
            click_row(viewer, "diffuse", ctrl=True)
            write(viewer, text)
            key(viewer, "ENTER")
            assert viewer.state.look.material.diffuse == number

    def test_esc_leaves_a_field_as_it_was(self, open_viewer):
        viewer = open_viewer(window_size=(640, 480), panel=True)
        click_row(viewer, "specular", ctrl=True)
        write(viewer, "0.9")
        key(viewer, "ESCAPE")
        assert viewer.state.look.material.specular == 0.3 and not viewer.window.is_closing
        key(viewer, "ESCAPE")
        assert viewer.window.is_closing

    def test_keys_that_come_with_the_click_wait_for_what_it_opens(self, open_viewer):
        viewer = open_viewer(window_size=(640, 480), panel=True)
        x, y = rows(viewer)["ambient"]
        viewer.handle(Event("move", x=x, y=y))
        settle(viewer)
        viewer.handle(Event("press", "left", x, y, ctrl=True))
        viewer.handle(Event("release", "left", x, y, ctrl=True))
        for sign in "0.2S":
            viewer.handle(Event("key", sign))
            viewer.handle(Event("text", sign))
        viewer.handle(Event("key", "ENTER"))
        settle(viewer)
        assert viewer.state.look.material.ambient == 0.2 and not viewer.state.shadows

    def test_esc_closes_the_colours_and_not_the_program(self, open_viewer):
        viewer = open_viewer(window_size=(640, 480), panel=True)
        before = shown(quiet(viewer))
        click_row(viewer, "colour")
        assert (shown(quiet(viewer)) != before)[220:, 448:].mean() > 0.4
        press(viewer, "S")
        assert not viewer.state.shadows
        key(viewer, "ESCAPE")
        assert not viewer.window.is_closing and not viewer.screen.panel.takes_keys

    def test_arrows_and_enter_choose_from_a_list(self, open_viewer):
        viewer = open_viewer(window_size=(640, 480), panel=True)
        click_row(viewer, "shading")
        for name in ("UP", "UP", "ENTER"):
            key(viewer, name)
        assert viewer.state.look.shading == "flat" and not viewer.screen.panel.takes_keys

    @pytest.mark.system
    def test_numbers_are_copied_and_pasted(self, open_viewer):
        viewer = open_viewer(window_size=(640, 480), panel=True)
        click_row(viewer, "diffuse", ctrl=True)
        key(viewer, "A", ctrl=True)
        key(viewer, "C", ctrl=True)
        assert viewer.window.pasted() == "0.90"
        key(viewer, "ESCAPE")
        viewer.window.copy("0.45")
        click_row(viewer, "ambient", ctrl=True)
        for name in "AV":
            key(viewer, name, ctrl=True)
        key(viewer, "ENTER")
        assert viewer.state.look.material.ambient == 0.45


class TestDoubleClick:
    @pytest.mark.system
    def test_on_a_name_it_brings_back_the_usual_value(self, open_viewer):
        look = ps.Appearance(ps.Material(0.4, 0.5, 0.6, 70), shading="flat", missing="complete")
        state = State(look=look, light_intensity=3, light_reach=2, light_color=(1, 0, 0))
        viewer = open_viewer(state=state, window_size=(640, 480), panel=True)
        usual = State()
        for name in ("ambient", "diffuse", "specular", "shininess", "shading", "intensity", "distance", "colour"):
            click_row(viewer, f"{name}:")
            assert viewer.state != replace(usual, panel=True)
            click_row(viewer, f"{name}:", clicks=2)
        assert viewer.state == replace(usual, panel=True)

    def test_on_a_number_it_lets_it_be_typed_and_the_slider_does_not_move(self, open_viewer):
        viewer = open_viewer(window_size=(640, 480), panel=True)
        click_row(viewer, "diffuse", clicks=2)
        assert viewer.state.look.material.diffuse == 0.9 and viewer.screen.panel.takes_keys
        write(viewer, "0.25")
        key(viewer, "ENTER")
        assert viewer.state.look.material.diffuse == 0.25
        press_undo(viewer)
        assert viewer.state.look.material.diffuse == 0.9
        press_undo(viewer)
        assert viewer.messages.text == "nothing to undo"

    @pytest.mark.system
    def test_two_slow_clicks_and_esc_type_nothing(self, open_viewer):
        viewer = open_viewer(window_size=(640, 480), panel=True)
        click_row(viewer, "diffuse")
        moved = viewer.state.look.material.diffuse
        click_row(viewer, "diffuse")
        assert viewer.state.look.material.diffuse == moved < 0.5 and not viewer.screen.panel.takes_keys
        press_undo(viewer)
        click_row(viewer, "diffuse", clicks=2)
        write(viewer, "0.25")
        key(viewer, "ESCAPE")
        assert viewer.state.look.material.diffuse == 0.9
        press_undo(viewer)
        assert viewer.messages.text == "nothing to undo"


def press_undo(viewer):
    key(viewer, "Z", ctrl=True)


def test_ticks_that_follow_each_other_are_steps_of_their_own(open_viewer):
    viewer = open_viewer(window_size=(640, 480), panel=True)
    for row in ("shadows (S)", "lit (B)"):
        click_row(viewer, row)
    press_undo(viewer)
    assert viewer.state.lit and viewer.state.shadows
    press_undo(viewer)
    assert not viewer.state.shadows


def test_what_a_colour_opens_is_seen_also_while_nothing_is_greyed_out(open_viewer):
    viewer = open_viewer(lights=[ps.Light((-1, -1, 0), shadow=True)], window_size=(640, 480), panel=True)
    click_row(viewer, "colour")
    colours = shown(quiet(viewer))[230:400, 400:].reshape(-1, 3)
    assert len(np.unique(colours, axis=0)) > 2000  # a square of shades of red


class TestPlace:
    @pytest.mark.parametrize("size", [(640, 480), pytest.param((1280, 960), marks=pytest.mark.system), (320, 240)])
    @pytest.mark.parametrize("records", [False, True])
    def test_help_and_messages_are_beside_it(self, open_viewer, tmp_path, size, records):
        film = {"record": tmp_path / "film.gif"} if records else {}
        viewer = open_viewer(window_size=size, panel=True, **film)
        settle(quiet(viewer))
        panel = shown(viewer)[:, -viewer.panel_covers :]
        assert viewer.panel_covers
        for says in (lambda: viewer.say("a word " * 40), lambda: press(viewer, "H")):
            before = shown(viewer)
            says()
            after = shown(viewer)
            assert (after != before).any() and (after[:, -viewer.panel_covers :] == panel).all()

    @pytest.mark.system
    def test_nothing_of_it_is_cut_off_and_it_scrolls_to_its_end(self, open_viewer):
        lamp = ps.Node(LAMP_OF_A_LONG_NAME, "the lamp with the very long name at the end of the corridor")
        scene = ps.Scene((ps.Node(ps.PointObject(frames.sphere()), "ball"), lamp, lamp), camera=frames.CAMERA)
        for source, last in ((scene, "ball"), (frames.sphere(), "points")):
            for size in ((640, 480), (320, 240)):
                viewer = open_viewer(source, window_size=size, panel=True)
                assert row_place(viewer, last)[1] < size[1]
                imgui, ends = viewer.screen.panel._imgui, []
                with pytest.MonkeyPatch.context() as instead:
                    for name in ("checkbox", "button", "slider_float", "begin_combo", "text_unformatted"):
                        instead.setattr(imgui, name, ending(imgui, getattr(imgui, name), ends))
                    shown(viewer)
                assert ends and max(ends) < size[0]

    def test_where_it_would_leave_no_picture_it_begins_collapsed(self, open_viewer):
        for size, is_open in (((200, 150), False), ((320, 240), True)):
            viewer = open_viewer(window_size=size, panel=True)
            settle(viewer)
            assert bool(viewer.panel_width) == is_open

    def test_it_shrinks_in_small_windows_and_has_the_messages_letters(self, open_viewer):
        viewer = open_viewer(window_size=(1000, 800), panel=True)
        settle(viewer)
        imgui, panel = viewer.screen.panel._imgui, viewer.screen.panel
        text = "Move the mouse"
        wide = ImageFont.load_default(POINTS).getlength(text)
        assert imgui.calc_text_size(text).x == pytest.approx(wide, rel=0.04)
        assert panel.width(1000, 800) > panel.width(640, 480) > panel.width(320, 240)


LAMP_OF_A_LONG_NAME = ps.Light((0, -1, 0))


def ending(imgui, draw, ends):
    def drawn(*arguments):
        result = draw(*arguments)
        ends.append(imgui.get_item_rect_max().x)
        return result

    return drawn


class TestSize:
    @pytest.mark.parametrize("size", [(640, 480), (1280, 960), (320, 240)])
    def test_the_picture_is_whole_beside_it(self, open_viewer, size):
        viewer = open_viewer(frames.sphere(), window_size=size, panel=True)
        settle(viewer)
        wide, size = viewer.panel_width, viewer.window.picture_size  # it fits the screen
        assert wide <= max(size[0] / 3, 150)
        camera = viewer.camera
        drawn = ps.render(viewer.frame, camera=camera, light=viewer.state.light(viewer.stage, viewer.pose))
        assert not drawn[:, size[0] - wide :, 3].any() and drawn[..., 3].any()
        assert camera.fx == pytest.approx(viewer.frame.camera.fitted(size[0] - wide, size[1]).fx)

    def test_collapsed_it_gives_its_place_back(self, open_viewer):
        viewer = open_viewer(window_size=(640, 480), panel=True)
        settle(viewer)
        x = 640 - viewer.panel_width + 10
        for kind in ("move", "press", "release"):
            viewer.handle(Event(kind, "" if kind == "move" else "left", x, 9))
            settle(viewer)
        assert viewer.panel_width == 0 and viewer.camera == viewer.window.fit(viewer.own_camera)

    def test_a_screen_of_another_scale_gets_another_panel(self, open_viewer, monkeypatch):
        viewer = open_viewer(window_size=(640, 480), panel=True)
        settle(viewer)
        wide = viewer.screen.panel.width(1280, 960)
        monkeypatch.setattr(type(viewer.window), "scale", property(lambda _: 2.0))
        settle(viewer)
        assert viewer.screen.panel.width(2560, 1920) == 2 * wide
        assert shown(viewer).any()


class TestMoreLights:
    def test_one_is_added_beside_the_held_one_and_taken_away_again(self, open_viewer):
        viewer = open_viewer(window_size=(640, 480), panel=True)
        before, picture = viewer.picture.lights, shown(quiet(viewer))
        click_row(viewer, "add a light")
        assert titles(viewer.moment) == ["light 1 (point)", "light 2 (point)"] and viewer.light_number == 1
        assert [replace(light, shadow=False) for light in viewer.lights] == before
        assert (shown(quiet(viewer)) != picture).any()
        assert np.linalg.norm(np.subtract(viewer.picture.lights[0].position, before[0].position)) > 0.1
        press_undo(viewer)
        assert viewer.picture.lights == before and not viewer.lights
        key(viewer, "Z", ctrl=True, shift=True)
        click_row(viewer, "x")  # the last one of that name
        assert viewer.picture.lights == before and not viewer.lights

    @pytest.mark.system
    def test_a_place_is_typed_in_metres_and_the_light_stays_there(self, open_viewer):
        pose = ps.orbit_pose(None, (0, 0, 1.0), 25, 10)
        frame = ps.Frame(None, frames.sphere().depth, frames.CAMERA, pose)
        viewer = open_viewer(frame, window_size=(640, 480), panel=True)
        for axis, text in (("x", "-0.4"), ("y", "-0.55"), ("z", "0.2")):
            click_row(viewer, f"at {axis}", clicks=2)
            write(viewer, text)
            key(viewer, "ENTER")
        assert viewer.picture.lights[0].position == pytest.approx((-0.4, -0.55, 0.2), abs=1e-5)
        assert not viewer.state.light_mode
        for _ in range(3):
            press_undo(viewer)
        assert viewer.state == replace(State(), panel=True)

    def test_the_way_that_the_sun_shines_is_typed(self, open_viewer):
        viewer = open_viewer(lights=[ps.Light(direction=(0, 1, 1))], window_size=(640, 480), panel=True)
        click_row(viewer, "towards x", clicks=2)
        write(viewer, "1")
        key(viewer, "ENTER")
        assert viewer.picture.lights[0].direction == pytest.approx(np.array([1, 0.5**0.5, 0.5**0.5]) / 2**0.5, abs=1e-5)


class TestLights:
    LAMPS = ps.Light(position=(-1, -1, 0), shadow=True), ps.Light(direction=(0, 1, 1), angle=2)

    def test_a_list_names_them_and_the_mouse_takes_what_is_chosen(self, open_viewer):
        nodes = [ps.Node(ps.PointObject(frames.sphere()), "ball")]
        nodes += [ps.Node(light, name) for light, name in zip(self.LAMPS, ("lamp", "sun"), strict=True)]
        viewer = open_viewer(ps.Scene(tuple(nodes)), window_size=(640, 480), panel=True)
        click_row(viewer, "sun (directional)")
        assert viewer.held == self.LAMPS[1] and viewer.light_number == 1
        click_row(viewer, "lamp (point)")
        assert viewer.light_number == 0 and viewer.held.position is not None

    @pytest.mark.system
    def test_each_has_a_size_and_a_shadow_of_its_own(self, open_viewer):
        viewer = open_viewer(lights=self.LAMPS, window_size=(640, 480), panel=True)
        click_row(viewer, "radius", ctrl=True)
        write(viewer, "0.2")
        key(viewer, "ENTER")
        assert viewer.held.radius == 0.2 and viewer.lights == self.LAMPS[1:]
        press(viewer, "TAB")
        click_row(viewer, "casts a shadow")
        assert viewer.held.shadow and viewer.held.angle == 2 and viewer.lights[0].radius == 0.2

    @pytest.mark.system
    def test_an_area_has_a_width_and_a_height(self, open_viewer):
        lamp = ps.Light((-1, -1, 0), (1, 1, 1), size=(0.4, 0.3), watts=20)
        viewer = open_viewer(lights=[lamp], window_size=(640, 480), panel=True)
        click_row(viewer, "height", ctrl=True)
        write(viewer, "0.2")
        key(viewer, "ENTER")
        assert viewer.held == replace(lamp, size=(0.4, 0.2))

    def test_light_above_white_rolls_off_if_it_is_asked_to(self, open_viewer):
        viewer = open_viewer(lights=[ps.Light((-1, -1, 0), intensity=5)], window_size=(640, 480), panel=True)
        before = shown(quiet(viewer))
        click_row(viewer, "tone")
        for name in ("DOWN", "ENTER"):
            key(viewer, name)
        assert viewer.state.finish.tone == "neutral"
        assert (shown(quiet(viewer)) != before).any()

    @pytest.mark.parametrize("kind", ["spot", "directional", "area"])
    def test_it_becomes_one_of_another_kind(self, open_viewer, kind):
        viewer = open_viewer(window_size=(640, 480), panel=True, lights=[ps.Light(position=(-1, -1, 0), radius=0.1)])
        before = shown(quiet(viewer))
        click_row(viewer, "kind")
        for name in ["DOWN"] * KINDS.index(kind) + ["ENTER"]:
            key(viewer, name)
        assert kind_of(viewer.state.light(viewer.stage, viewer.pose, viewer.held)) == kind
        assert (shown(quiet(viewer)) != before).any()


def test_it_tells_rate_and_samples(open_viewer):
    viewer = open_viewer(window_size=(640, 480), panel=True)
    viewer.samples = 7
    told = []
    imgui, text = viewer.screen.panel._imgui, viewer.screen.panel._imgui.text
    with pytest.MonkeyPatch.context() as instead:
        instead.setattr(imgui, "text", lambda line: told.append(line) or text(line))
        for x in (100, 110, 120):
            viewer.handle(Event("move", x=x, y=100))
            viewer.step()
        for _ in range(40):
            if viewer.redrawing.samples == 7:
                break
            viewer.step()
        viewer.step(wait=False)
        shown(viewer)
    assert any(line.endswith("pictures/s") for line in told) and told[-1] == "7 of 7 samples"


@pytest.mark.parametrize("is_scene", [False, True])
def test_no_explanation_names_an_option_of_the_command_line(open_viewer, monkeypatch, is_scene):
    source, shown_texts = frames.sphere(), []
    if is_scene:
        source = ps.Scene((ps.Node(ps.PointObject(source), "ball"),), camera=frames.CAMERA)
    monkeypatch.setattr(Widgets, "explain", lambda _, why: shown_texts.append(why))
    monkeypatch.setattr(Widgets, "section", lambda *_, **__: True)  # all of them are open
    for kind in KINDS:
        light = as_kind(ps.Light(position=(-1, -1, 0)), kind, 0.2)
        settle(open_viewer(source, window_size=(640, 480), panel=True, lights=[light]))
    assert any("ambient light" in text for text in shown_texts)
    assert [text for text in shown_texts if "--" in text] == []


@pytest.mark.system
def test_merged_views_are_aligned_if_it_is_asked_to(open_viewer):
    given = disturbed(views(corner(), 2), 0.02, 0.5)
    viewer = open_viewer(given, views=2, window_size=(640, 800), panel=True)
    while viewer.document.playback.is_merging:
        viewer.step()
    before = shown(quiet(viewer))
    click_row(viewer, "points")
    click_row(viewer, "align views")
    assert viewer.state.look.align and (shown(quiet(viewer)) != before).any()
    assert list(viewer.renderer.aligned) == given
