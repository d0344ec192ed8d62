"""What hands do to the window: real events of an X server, and what is seen of them."""

import os
import shlex
import shutil
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.scene.orbit import DEGREES, State, marker_place, softly_turned
from pointshade_gl.viewer import background as open_dialog
from pointshade_gl.viewer import window

from ..support import frames
from ..support.view_sets import pose_at, seen_from
from ..support.viewing import quiet, row_place, settle, shown

if not sys.platform.startswith("linux"):
    pytest.skip("speaks to an X server", allow_module_level=True)

from ..support.hands import Hands

pytestmark = pytest.mark.system

FLOOR = ps.Mesh([(-2, 0.4, 0.5), (2, 0.4, 0.5), (2, 0.4, 4), (-2, 0.4, 4)], [(0, 2, 1), (0, 3, 2)], [(0, -1, 0)] * 4)
LAMP = ps.Light(position=(0.5, -1, 0.5), direction=(-0.3, 1, 0.7), cone=(20, 40), color=(1, 0.8, 0.5), shadow=True)
SUN = ps.Light(direction=(0.5, 0.3, 1), color=(0.2, 0.4, 1), shadow=True)
SCENE = ps.Scene(
    (ps.Node(ps.PointObject(frames.sphere()), "ball"), ps.Node(FLOOR, "floor"), ps.Node(LAMP), ps.Node(SUN)),
    camera=frames.CAMERA,
)


@pytest.fixture
def hands(display, open_viewer, monkeypatch):
    """hands(source, ...): at a window of their own."""
    if not display:
        pytest.skip("moves the pointer: not on anybody's own screen, needs Xvfb")
    made = []
    clock = SimpleNamespace(perf_counter=lambda: made[-1].clock if made else time.perf_counter())
    monkeypatch.setattr(window, "time", clock)

    def begin(*source, **options):
        made.append(Hands(open_viewer(*source, **options)))
        return made[-1]

    yield begin
    for one in made:
        one.close()


def seen(one):
    """The picture without text."""
    return shown(quiet(one.viewer)).astype(int)


def surface_at(viewer, x, y):
    """The point of the world that a pixel shows."""
    point = viewer.screen.find_surface(viewer.picture, x, y)
    pose = viewer.pose @ viewer.state.pose(viewer.stage)
    return pose[:3, :3] @ point + pose[:3, 3]


def pixel_of(viewer, point):
    x, y, z, _ = np.linalg.inv(viewer.pose @ viewer.state.pose(viewer.stage)) @ [*point, 1]
    c = viewer.camera
    return c.fx * x / z + c.cx, c.fy * y / z + c.cy


class TestPlaces:
    def test_a_quick_drag_begins_where_the_button_went_down(self, hands):
        """All of it, and the way on, has happened before the window looks."""
        one = hands()
        one.point(100, 120)
        one.button("left", "press")
        one.point(150, 120)
        one.point(220, 120)
        one.button("left", "release")
        one.point(20, 20)
        one.look()
        assert one.viewer.state.yaw == pytest.approx(softly_turned(0, -120 / 240 * DEGREES))

    def test_a_click_is_where_the_pointer_was_not_where_it_went(self, hands):
        one, told = hands(), []
        one.viewer.on_event = lambda event: told.append(event)
        one.look()
        told.clear()
        one.point(40, 50)
        one.button("left")
        one.button("up")
        one.point(300, 200)
        one.look()
        places = {event.kind: (event.x, event.y) for event in told if event.kind in ("press", "release", "wheel")}
        assert places == dict.fromkeys(("press", "release", "wheel"), (40, 50))


class TestLight:
    @pytest.mark.parametrize("way_out", [(400, 60), (160, -60)])
    def test_it_stays_where_it_was_held_when_the_pointer_goes_out_of_the_window_and_comes_back(self, hands, way_out):
        one = hands()
        one.travel((160, 120), (70, 90))
        one.rest()
        held, before = one.viewer.state.light_at, seen(one)
        one.travel((70, 90), way_out)
        assert one.viewer.state.light_at == held
        assert (seen(one) == before).all()
        one.point(250, 200)
        one.look()
        assert one.viewer.state.light_at == held
        one.travel((250, 200), (70, 200))
        assert one.viewer.state.light_at != held

    def test_it_stays_where_it_was_held_when_the_pointer_goes_to_the_panel_and_comes_back(self, hands):
        pytest.importorskip("imgui_bundle")
        one = hands(window_size=(640, 480))
        one.key("g")
        one.look(8)
        one.travel((200, 240), (150, 180))
        one.rest()
        held = one.viewer.state.light_at
        one.travel((150, 180), (560, 150))
        assert one.viewer.state.light_at == held
        one.rest(0.1)
        one.point(200, 300)
        one.look()
        assert one.viewer.state.light_at == held

    def test_a_place_at_the_edge_that_was_held_stays_too(self, hands):
        one = hands()
        one.travel((160, 120), (316, 120))
        one.rest()
        held = one.viewer.state.light_at
        one.travel((316, 120), (420, 120))
        assert one.viewer.state.light_at == held and held[0] > 0.5

    def test_a_way_through_the_window_without_a_stop_leaves_it_alone(self, hands):
        one = hands()
        one.point(-50, 100)
        one.look()
        before = one.viewer.state.light_at
        one.travel((-50, 100), (400, 140))
        assert one.viewer.state.light_at == before

    def test_a_window_that_draws_slowly_takes_no_pause_of_its_own_for_one_of_the_hand(self, hands, monkeypatch):
        one = hands()
        one.travel((160, 120), (70, 90))
        one.rest()
        held, draw = one.viewer.state.light_at, one.viewer.screen.draw
        way = iter([(140, 90), (220, 90), (300, 90), (400, 90)])

        def slowly(*arguments):
            chosen = draw(*arguments)
            if place := next(way, None):
                one.point(*place)
                one.server.sync()
                one.clock += 0.4
            return chosen

        monkeypatch.setattr(one.viewer.screen, "draw", slowly)
        one.point(80, 90)
        one.look(8)
        assert next(way, None) is None and one.viewer.state.light_at == held

    def test_a_click_places_it_until_l_lets_it_go_and_further_clicks_leave_it_alone(self, hands):
        one = hands()
        one.click(80, 60)  # the pointer came at once, and did not take the light along
        viewer = one.viewer
        assert marker_place(viewer.state, viewer.stage, viewer.camera) == pytest.approx((80, 60), abs=1)
        assert not viewer.state.light_mode and "L lets it follow" in viewer.messages.text
        held, placed = viewer.state.light_at, seen(one)
        one.travel((80, 60), (250, 200), (20, 220))
        assert viewer.state.light_at == held and (seen(one) == placed).all()
        one.rest(0.5)
        one.click(200, 200)
        assert viewer.state.light_at == held and not viewer.state.light_mode
        one.key("l")
        one.travel((20, 220), (250, 60))
        assert viewer.state.light_at != held

    def test_a_click_places_nothing_while_no_light_is_seen(self, hands):
        one = hands()
        one.key("b")
        before = one.viewer.state
        one.click(80, 60)
        assert one.viewer.state == before

    def test_a_hand_that_trembles_clicks_and_one_that_moves_on_drags(self, hands):
        one = hands()
        for moved, places, turns in ((2, True, False), (12, False, True)):
            one.key("r")
            one.point(100, 100)
            one.look()
            one.button("left", "press")
            one.point(100 + moved, 100)
            one.button("left", "release")
            one.look()
            assert (not one.viewer.state.light_mode, one.viewer.state.yaw != 0) == (places, turns)

    def test_the_marker_does_not_blink_while_a_button_is_down_for_a_click(self, hands):
        one = hands()
        one.travel((160, 120), (100, 100))
        before = seen(one)
        one.button("left", "press")
        one.look()
        assert (seen(one) == before).all()

    def test_a_click_on_the_panel_places_nothing(self, hands):
        pytest.importorskip("imgui_bundle")
        one = hands(window_size=(640, 480), panel=True)
        one.point(600, 20)
        one.look(8)
        one.button("left")
        one.look(8)
        assert one.viewer.state.light_mode

    def test_right_and_middle_clicks_and_clicks_with_ctrl_place_nothing(self, hands):
        one = hands()
        one.point(100, 100)
        for name in ("middle", "right"):
            one.button(name)
        one.key("Control_R")
        one.look()
        assert one.viewer.state.light_mode


class TestPivot:
    @pytest.mark.parametrize(
        "source",
        [
            lambda: (frames.sphere_before_wall(), {}),
            lambda: (frames.sphere_before_wall(), {"state": State(look=ps.Appearance(splat="mesh", shading="flat"))}),
            lambda: (SCENE, {}),
            lambda: ([seen_from(pose_at(yaw)) for yaw in (0, 15)], {"views": "all"}),
        ],
        ids=["frame", "mesh", "scene", "set"],
    )
    def test_a_double_click_makes_drags_turn_around_the_point_without_a_jump(self, hands, source):
        source, options = source()
        one = hands(source, **options)
        one.until(lambda: not one.viewer.document.playback.is_merging)
        one.look()
        press = (190, 150)
        one.point(*press)
        one.look()
        before, light = seen(one), one.viewer.state.light(one.viewer.stage, one.viewer.pose, one.viewer.held)
        point = surface_at(one.viewer, *press)
        one.double_click(*press)
        viewer = one.viewer
        assert viewer.messages.text == "drags turn around this point" and viewer.state.light_mode
        after = viewer.state.light(viewer.stage, viewer.pose, viewer.held)
        for name in ("position", "direction"):
            assert getattr(after, name) == (getattr(light, name) and pytest.approx(getattr(light, name)))
        assert (np.abs(seen(one) - before).max(-1) > 2).mean() < 1e-3
        one.button("left", "press")
        one.travel(press, (230, 120))
        one.button("left", "release")
        one.look()
        assert abs(viewer.state.yaw) > 10
        assert pixel_of(viewer, point) == pytest.approx(press, abs=0.6)
        one.button("up")
        one.look()
        assert pixel_of(viewer, point) == pytest.approx(press, abs=0.6)

    def test_beside_the_object_it_is_the_object_s_middle_again(self, hands):
        one = hands(frames.sphere())
        one.double_click(160, 80)
        pivot = one.viewer.state.pivot
        assert pivot != (0, 0, 0)
        one.point(5, 5)
        one.rest(0.5)
        before = seen(one)
        one.double_click(5, 5)
        assert one.viewer.state.pivot == (0, 0, 0) and "middle" in one.viewer.messages.text
        assert (np.abs(seen(one) - before).max(-1) > 2).mean() < 1e-3
        one.key("z", "Control_L")
        assert one.viewer.state.pivot == pivot
        one.key("r")
        assert one.viewer.state.pivot == (0, 0, 0)

    def test_two_clicks_with_a_pause_or_apart_are_none(self, hands):
        one = hands()
        one.click(150, 120)
        one.rest(0.6)
        one.click(150, 120)
        one.click(180, 120)
        assert one.viewer.state.pivot == (0, 0, 0)

    def test_it_reads_few_pixels_and_draws_no_picture(self, hands, monkeypatch):
        one = hands(frames.sphere_before_wall())
        one.point(160, 120)
        one.look()
        texture, drawn = type(one.viewer.renderer._pipeline._target.color), one.viewer.renderer.steps.counts.copy()
        monkeypatch.setattr(texture, "read", lambda *_: pytest.fail("a whole picture leaves the GPU"))
        assert one.viewer.screen.find_surface(one.viewer.picture, 160, 120)
        assert one.viewer.renderer.steps.counts["upload"] == drawn["upload"]
        assert one.viewer.renderer.steps.counts["light"] == drawn["light"]


class TestPanel:
    def test_a_name_and_a_number_are_clicked_twice(self, hands):
        one = hands(window_size=(640, 480), panel=True)
        viewer = one.viewer

        def double_click(row):
            one.point(*row_place(viewer, row))
            one.rest(1)
            one.double_click(*row_place(viewer, row))
            settle(viewer)

        double_click("diffuse")
        for name in ("period", "2", "Return"):
            one.key(name)
        settle(viewer)
        assert viewer.state.look.material.diffuse == 0.2
        double_click("diffuse:")
        assert viewer.state.look.material.diffuse == 0.9
        one.key("z", "Control_L")
        assert viewer.state.look.material.diffuse == 0.2

    def test_a_light_is_added_placed_and_taken_away(self, hands):
        one = hands(window_size=(640, 480), panel=True)
        viewer = one.viewer
        one.click(*row_place(viewer, "add a light"))
        settle(viewer)
        assert len(viewer.lights) == 1
        at = row_place(viewer, "at x")
        one.rest(1)
        one.double_click(*at)
        for name in ("period", "4", "Return"):
            one.key(name)
        settle(viewer)
        assert viewer.picture.lights[0].position[0] == pytest.approx(0.4, abs=1e-5)
        one.rest(1)
        one.click(*row_place(viewer, "x"))
        settle(viewer)
        assert not viewer.lights
        for count in (1, 1, 0):
            one.key("z", "Control_L")
            assert len(viewer.lights) == count
        assert viewer.state.light_mode


class TestFullScreen:
    def place(self, one):
        glfw, handle = one.viewer.window.glfw, one.viewer.window.handle
        return glfw.get_window_pos(handle), glfw.get_window_size(handle)

    @pytest.mark.parametrize(("there", "back"), [("f", "f"), ("F11", "F11"), ("f", "Escape")])
    def test_it_fills_the_screen_and_comes_back_to_its_place_and_size(self, hands, there, back):
        one = hands(window_size=(500, 400))
        before = self.place(one)
        one.key(there)
        screen = one.server.screen()
        assert self.place(one) == ((0, 0), (screen.width_in_pixels, screen.height_in_pixels))
        assert shown(one.viewer).shape[:2] == (screen.height_in_pixels, screen.width_in_pixels)
        one.key(back)
        assert self.place(one) == before and not one.viewer.window.is_closing
        one.key("Escape")
        assert one.viewer.window.is_closing

    def test_escape_closes_the_help_first(self, hands):
        one = hands()
        one.key("f")
        one.key("h")
        one.key("Escape")
        assert one.viewer.window.is_full_screen and not one.viewer.state.help


class TestKeypad:
    def test_its_digits_are_sides_and_those_above_the_letters_shadings(self, hands):
        one = hands()
        for name, place in (("KP_3", (90, 0)), ("KP_7", (0, 90)), ("KP_1", (0, 0))):
            one.key(name)
            assert (one.viewer.state.yaw, one.viewer.state.pitch) == place
            assert one.viewer.state.look.shading == "phong"
        one.key("KP_3", "Control_L")
        one.key("KP_8")
        one.key("KP_6")
        assert (one.viewer.state.yaw, one.viewer.state.pitch) == (-75, 15)
        one.key("KP_9")
        assert (one.viewer.state.yaw, one.viewer.state.pitch) == (105, -15)
        one.key("2")
        assert one.viewer.state.look.shading == "flat" and one.viewer.state.yaw == 105

    def test_0_is_where_the_camera_was_and_the_dot_shows_all_of_the_object(self, hands):
        one = hands()
        before = seen(one)
        one.point(160, 120)
        one.button("up")
        one.button("up")
        one.key("KP_7")
        one.key("KP_0")
        assert (seen(one) == before).all()
        for _ in range(20):
            one.button("up")
        one.key("KP_4")
        one.key("KP_Decimal")
        covered = (seen(one) > 70).any(-1)
        v, u = np.nonzero(covered)
        assert u.min() > 0 and u.max() < 319 and v.min() > 0 and v.max() < 239
        assert (u.min() + u.max()) / 2 == pytest.approx(160, abs=40)


class TestOpenDialog:
    """zenity is a program of ours, which prints what a user would choose."""

    @pytest.fixture
    def zenity(self, tmp_path, monkeypatch):
        pytest.importorskip("imgui_bundle")
        program = tmp_path / "programs" / "zenity"
        program.parent.mkdir()
        monkeypatch.setenv("PATH", str(program.parent), prepend=os.pathsep)

        def prints(*paths, first=""):
            program.write_text("#!/bin/sh\n" + first + "\n" + f"printf '%s\\n' {shlex.join(map(str, paths))}\n")
            program.chmod(0o755)

        return prints

    @pytest.mark.parametrize(("key", "held"), [("o", ()), ("o", ("Control_L",)), ("o", ("Shift_L",))])
    def test_what_is_chosen_is_opened(self, hands, zenity, tmp_path, key, held):
        ps.save_scene(tmp_path / "scene.gltf", SCENE)
        zenity(tmp_path / "scene.gltf")
        one = hands()
        one.key(key, *held)
        one.until(lambda: isinstance(one.viewer.frame, ps.Scene))

    def test_the_window_goes_on_while_it_asks(self, hands, zenity, tmp_path):
        gate = tmp_path / "gate"
        zenity(first=f"while [ ! -e {shlex.quote(str(gate))} ]; do sleep 0.05; done")
        one = hands()
        frame = one.viewer.frame
        one.key("o")
        one.key("3")
        assert one.viewer.state.look.shading == "gouraud"
        one.key("o")
        assert one.viewer.messages.text == "a dialog is open already"
        gate.touch()
        one.key("h")
        one.until(lambda: one.viewer._dialog is None)
        assert one.viewer.frame is frame and not one.viewer.messages.text.startswith("not opened")

    def test_a_window_that_closes_takes_it_along(self, hands, zenity):
        zenity(first="exec sleep 600")
        one = hands()
        one.key("o")
        one.viewer._dialog.close()
        one.until(lambda: one.viewer._dialog.is_done)

    def test_without_a_program_for_it_a_message_tells_what_to_do(self, hands, tmp_path, monkeypatch):
        one = hands()
        monkeypatch.setenv("PATH", str(tmp_path))
        one.key("o")
        assert "zenity" in one.viewer.messages.text and "drop files" in one.viewer.messages.text

    def test_without_the_extra_a_message_tells_what_to_do(self, hands, monkeypatch):
        one = hands()
        monkeypatch.setattr(open_dialog, "find_spec", lambda _: None)
        one.key("o")
        assert "pip install" in one.viewer.messages.text and "drop files" in one.viewer.messages.text


class TestDrop:
    @pytest.fixture
    def folder(self, tmp_path):
        """A frame as files, with a name that is no plain one."""
        place = tmp_path / "my frame ü"
        place.mkdir()
        frame = frames.sphere_before_wall()
        Image.fromarray((frame.depth * 1000).astype(np.uint16)).save(place / "depth.png")
        Image.fromarray(frame.color[..., :3]).save(place / "color.png")
        c = frames.CAMERA
        numbers = f'"fx": {c.fx}, "fy": {c.fy}, "cx": {c.cx}, "cy": {c.cy}, "width": 160, "height": 120'
        (place / "intrinsics.json").write_text(f'{{{numbers}, "depth_scale": 1000}}')
        return place

    def test_a_folder_is_shown_as_view_would_show_it(self, hands, folder):
        one = hands()
        one.button("up")
        one.key("2")
        one.drop(folder)
        viewer = one.viewer
        assert viewer.frame.depth == pytest.approx(ps.load_frame(folder).depth)
        assert viewer.state == State(look=ps.Appearance(shading="flat", missing="complete"))
        assert (seen(one) > 40).any(-1).mean() > 0.9  # the wall
        one.key("z", "Control_L")
        assert viewer.messages.text == "nothing to undo"

    def test_depth_and_colour_that_are_dropped_together_are_one_frame(self, hands, folder):
        one = hands()
        one.drop(folder / "color.png", folder / "depth.png")
        frame = one.viewer.frame
        assert frame.points_known > 10_000 and (frame.color == ps.load_frame(folder).color).all()
        for name, unnamed in (("depth.png", "a.png"), ("color.png", "b.png")):
            shutil.copy(folder / name, folder.parent / unnamed)
        one.drop(*(folder.parent / "b.png", folder.parent / "a.png", folder / "intrinsics.json"))
        assert one.viewer.frame is not frame and (one.viewer.frame.depth == frame.depth).all()

    def test_a_scene_brings_its_lights_and_a_sequence_plays(self, hands, folder):
        one = hands()
        ps.save_scene(folder.parent / "scene.gltf", SCENE)
        one.drop(folder.parent / "scene.gltf")
        assert isinstance(one.viewer.frame, ps.Scene) and one.viewer.state.shadows
        assert one.viewer.held.is_spot and len(one.viewer.lights) == 1
        many = folder.parent / "many"
        shutil.copytree(folder, many)
        for name in ("color", "depth"):
            (many / f"{name}.png").rename(many / f"{name}_0001.png")
            shutil.copy(many / f"{name}_0001.png", many / f"{name}_0002.png")
        one.drop(many)
        first = one.viewer.frame
        one.until(lambda: one.viewer.frame is not first)
        assert not one.viewer.lights and not one.viewer.state.shadows

    @pytest.mark.parametrize("names", [["notes.txt"], ["nothing"], ["one.txt", "two.txt"], ["picture.jpg"]])
    def test_what_cannot_be_shown_is_said_and_the_old_thing_stays(self, hands, tmp_path, names):
        one = hands(SCENE)
        one.key("Tab")
        before, picture = one.viewer.moment, seen(one)
        for name in names:
            if name != "nothing":
                (tmp_path / name).write_text("a few words")
        one.drop(*(tmp_path / name for name in names))
        assert one.viewer.messages.text.startswith("not opened: ") and names[0] in one.viewer.messages.text
        assert one.viewer.moment == before and one.viewer.frame.lights == SCENE.lights
        assert (seen(one) == picture).all()
        one.key("z", "Control_L")
        assert one.viewer.messages.text == "undone"
