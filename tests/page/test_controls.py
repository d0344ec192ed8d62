"""Mouse, wheel, keys and fingers on a page, by the browser's own events: the same actions as in the window."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.page import draw_page
from pointshade_gl.scene.graph import scene_of
from pointshade_gl.scene.orbit import OrbitStage, State, marker_place, rims_from
from pointshade_gl.viewer.events import Event

from ..support import frames
from ..support.viewing import Hand

pytestmark = [pytest.mark.system, pytest.mark.browser, pytest.mark.gl]
FRAME = frames.sphere()
STAGE = OrbitStage.of(FRAME)
NAMES = {"lightAt": "light_at", "lightReach": "light_reach", "lightMode": "light_mode"}
SEEN = """(state) => {
  const { stage, held } = pointshade.data;
  return [...pose(state, stage).flat(), ...light(state, stage, HOME, held).position];
}"""  # from where, and in which light
LIGHT = ps.Light(position=(-0.6, -0.5, 0.4))


@pytest.fixture(scope="module")
def opened(browser, renderer):
    """One page for all tests: it takes a second to open."""
    with browser.opened(draw_page(renderer, FRAME, title="a sphere", light=LIGHT), has_touch=True) as page:
        page.wait_until_drawn()
        page.page.evaluate("window.first = pointshade.state")
        yield page


@pytest.fixture
def shown(opened):
    """The page as it was at the start, the mouse beside the picture."""
    opened.page.mouse.move(300, 470)
    opened.page.evaluate("pointshade.state = first")
    yield opened
    for key in ("Control", "Shift"):
        opened.page.keyboard.up(key)
    assert opened.complaints == []


def camera_of(shown):
    return FRAME.camera.fitted(*shown.page.evaluate("[picture.width, picture.height]"))


def as_state(found):
    """The window's state with the values of the page's."""
    values = {name: found[name] for name in ("yaw", "pitch", "distance", "pan", "lit", *NAMES)}
    values = {NAMES.get(name, name): tuple(v) if isinstance(v, list) else v for name, v in values.items()}
    return State(**values).with_look(shading=found["shading"])


def assert_same(found, expected):
    for name in ("yaw", "pitch", "distance", "pan", "light_at", "light_reach"):
        assert getattr(as_state(found), name) == pytest.approx(getattr(expected, name), abs=1e-9), name
    assert (as_state(found).light_mode, found["lit"]) == (expected.light_mode, expected.lit)


def places(*ends, steps=5):
    for (a, b), (c, d) in pairwise(ends):
        yield from ((a + (c - a) * k / steps, b + (d - b) * k / steps) for k in range(1, steps + 1))


def pixel(x, y):
    """The window counts pixels from the middle of the first one, the browser from its edge."""
    return {"x": x - 0.5, "y": y - 0.5}


def drag(page, start, end, button="left"):
    page.mouse.move(*start)
    page.mouse.down(button=button)
    page.mouse.move(*end, steps=5)
    page.mouse.up(button=button)


class TestMouse:
    def test_the_light_follows_it_as_in_the_window(self, shown):
        mouse, state, camera = Hand(), as_state(shown.state), camera_of(shown)
        for x, y in places((400, 100), (600, 300), (100, 200), (320, 30), (330, 400)):
            shown.page.mouse.move(x, y)
            state = mouse.handle(Event("move", **pixel(x, y)), state, STAGE, camera)
            assert_same(shown.state, state)
        assert rims_from(state.middle(STAGE, camera), 330, 400, camera) == pytest.approx(state.light_at, abs=0.01)

    def test_the_marker_is_where_the_light_is_on_the_window(self, shown):
        shown.page.mouse.move(300, 200, steps=3)
        box = shown.page.locator("#marker").bounding_box()
        x, y = marker_place(as_state(shown.state), STAGE, camera_of(shown))
        middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        assert middle == pytest.approx((x + 0.5, y + 0.5), abs=0.1)

    def test_a_drag_turns_the_object_and_the_light_stays(self, shown):
        shown.page.mouse.move(200, 200)
        before, camera = as_state(shown.state), camera_of(shown)
        drag(shown.page, (200, 200), (330, 150))
        assert_same(shown.state, before.orbited(130, -50, min(camera.width, camera.height), STAGE))

    @pytest.mark.parametrize("how", ["Control", "middle"])
    def test_ctrl_or_the_middle_button_drags_the_object_along(self, shown, how):
        shown.page.mouse.move(200, 200)
        before, camera = as_state(shown.state), camera_of(shown)
        if how == "Control":
            shown.page.keyboard.down("Control")
        drag(shown.page, (200, 200), (260, 290), "left" if how == "Control" else "middle")
        assert_same(shown.state, before.panned(60, 90, camera.fx))

    def test_the_wheel_zooms_and_with_shift_moves_the_light_away(self, shown):
        shown.page.mouse.move(200, 200)
        before = as_state(shown.state)
        shown.page.mouse.wheel(0, -200)
        shown.wait_for("pointshade.state.distance < 1")
        assert_same(shown.state, before.zoomed(2))
        shown.page.keyboard.down("Shift")
        shown.page.mouse.wheel(0, -100)
        shown.wait_for(f"pointshade.state.lightReach > {before.light_reach}")
        assert_same(shown.state, before.zoomed(2).light_reached(1))

    def test_a_click_keeps_the_light_and_l_lets_it_follow_again_without_a_jump(self, shown):
        shown.page.mouse.move(250, 150, steps=5)
        shown.page.mouse.down()
        shown.page.mouse.move(252, 151)
        shown.page.mouse.up()
        kept, camera = as_state(shown.state), camera_of(shown)
        assert not kept.light_mode and (kept.yaw, kept.pitch) == (0, 0)
        place = rims_from(kept.middle(STAGE, camera), 251.5, 150.5, camera)
        assert kept.light_at == pytest.approx(place, abs=0.01)
        shown.page.mouse.move(500, 300, steps=4)
        assert_same(shown.state, kept)
        shown.page.keyboard.press("l")
        assert_same(shown.state, replace(kept, light_mode=True))
        shown.page.mouse.move(501, 300)
        assert as_state(shown.state).light_at == pytest.approx(kept.light_at, abs=0.05)

    def test_further_clicks_leave_a_light_that_is_kept_alone_and_unlit_they_place_none(self, shown):
        shown.page.mouse.click(250, 150)
        kept = as_state(shown.state)
        shown.page.mouse.click(400, 300)
        assert_same(shown.state, kept)
        shown.page.keyboard.press("l")
        shown.page.keyboard.press("b")
        shown.page.mouse.move(330, 80)
        unlit = as_state(shown.state)
        shown.page.mouse.click(330, 80)
        assert_same(shown.state, unlit)

    def test_a_light_that_is_kept_turns_with_the_object_and_a_ctrl_shift_drag_moves_it(self, shown):
        shown.page.mouse.click(250, 150)
        kept, camera = as_state(shown.state), camera_of(shown)
        drag(shown.page, (250, 150), (330, 130))
        turned = kept.orbited(80, -20, min(camera.width, camera.height), STAGE)
        assert turned.light_at != kept.light_at
        assert_same(shown.state, turned)
        for key in ("Control", "Shift"):
            shown.page.keyboard.down(key)
        drag(shown.page, (330, 130), (100, 300))
        moved = as_state(shown.state)
        assert moved.light_at[0] < turned.light_at[0] - 0.5 and moved.yaw == pytest.approx(turned.yaw)

    def test_a_double_click_lets_orbits_turn_around_a_point_and_beside_the_object_around_its_middle(self, shown):
        page, camera = shown.page, camera_of(shown)
        page.mouse.move(260, 180, steps=3)
        before = shown.state
        page.mouse.dblclick(260, 180)
        after = shown.state
        assert after["pivot"] != [0, 0, 0] and after["lightMode"]
        seen = [page.evaluate(SEEN, state) for state in (before, after)]
        assert seen[0] == pytest.approx(seen[1], abs=1e-9)
        depth = page.evaluate("pointshade.drawing.depthAt(260, 180)")
        u, v = (260 - 0.5 - camera.cx) / camera.fx, (180 - 0.5 - camera.cy) / camera.fy
        point = (u * depth, v * depth, depth)
        assert page.evaluate("seenPivot(pointshade.state, pointshade.data.stage)") == pytest.approx(point, rel=0.01)
        drag(page, (200, 200), (330, 150))
        assert page.evaluate("seenPivot(pointshade.state, pointshade.data.stage)") == pytest.approx(point, rel=0.01)
        page.evaluate("pointshade.state = first")
        drag(page, (200, 200), (330, 150))
        page.mouse.dblclick(5, 5)
        assert shown.state["pivot"] == pytest.approx([0, 0, 0], abs=1e-9)

    def test_the_light_stays_when_the_mouse_leaves_and_does_not_jump_when_it_comes_back_elsewhere(self, shown):
        shown.page.mouse.move(300, 300, steps=3)
        shown.page.mouse.move(300, 470, steps=3)
        left = as_state(shown.state)
        shown.page.mouse.move(20, 470)
        shown.page.mouse.move(20, 200)
        assert as_state(shown.state).light_at == pytest.approx(left.light_at)


class TestKeys:
    @pytest.mark.parametrize(
        ("keys", "action"),
        [
            (["ArrowLeft"], lambda s: s.orbited(-5, 0, 120)),
            (["ArrowUp", "ArrowUp"], lambda s: s.orbited(0, -10, 120)),
            (["Shift+ArrowRight"], lambda s: replace(s, light_at=(s.light_at[0] + 0.1, s.light_at[1]))),
            (["Shift+ArrowDown"], lambda s: replace(s, light_at=(s.light_at[0], s.light_at[1] + 0.1))),
            (["Control+ArrowRight"], lambda s: s.panned(0.04, 0, FRAME.camera.fx / 120)),
            (["+", "+", "-"], lambda s: s.zoomed(1)),
            (["."], lambda s: s.light_reached(1)),
            ([","], lambda s: s.light_reached(-1)),
            (["l"], lambda s: replace(s, light_mode=False)),
            (["b"], lambda s: replace(s, lit=False)),
            (["b", "B"], lambda s: s),
            (["b", "2"], lambda s: s.with_look(shading="flat")),
            (["ArrowLeft", "Shift+ArrowUp", "+", ".", "Control+ArrowUp", "r"], lambda s: s),
        ],
        ids=lambda value: " ".join(value) if isinstance(value, list) else "",
    )
    def test_everything_can_be_done_by_them(self, shown, keys, action):
        before = as_state(shown.state)
        for key in keys:
            shown.page.keyboard.press(key)
        assert_same(shown.state, action(before))
        assert as_state(shown.state).look.shading == action(before).look.shading

    def test_they_choose_the_shading(self, shown):
        for key, shading in zip("12345", ("none", "flat", "gouraud", "phong", "edl"), strict=True):
            shown.page.keyboard.press(key)
            assert shown.state["shading"] == shading == shown.page.locator("#shading").input_value()

    def test_the_light_stays_within_reach_of_them(self, shown):
        for _ in range(40):
            shown.page.keyboard.press("Shift+ArrowRight")
        assert math.hypot(*shown.state["lightAt"]) == pytest.approx(175 / 90)
        shown.page.keyboard.press("Shift+ArrowLeft")
        assert shown.state["lightAt"][0] < 175 / 90 - 0.09

    def test_those_of_the_browser_stay_the_browser_s(self, shown):
        taken = """(keys) => keys.map(([key, held]) => !document.body.dispatchEvent(
            new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true, [held]: true })))"""
        keys = [("r", "ctrlKey"), ("l", "metaKey"), ("ArrowLeft", "altKey"), ("Tab", ""), ("F5", ""), ("Enter", "")]
        assert shown.page.evaluate(taken, keys) == [False] * len(keys)
        assert shown.page.evaluate(taken, [("r", ""), ("ArrowLeft", "")]) == [True, True]


class TestFingers:
    def test_the_light_is_under_one(self, shown):
        shown.fingers(((400, 300), (250, 100)))
        state, camera = as_state(shown.state), camera_of(shown)
        place = pixel(250, 100)
        assert state.light_at == pytest.approx(rims_from(state.middle(STAGE, camera), *place.values(), camera))
        assert (state.yaw, state.pitch, state.light_mode) == (0, 0, True)

    def test_the_light_goes_where_one_touches_also_after_a_click_of_the_mouse(self, shown):
        shown.page.mouse.click(200, 200)
        shown.page.keyboard.press("l")
        shown.fingers(((400, 300), (400, 300)))
        shown.page.wait_for_timeout(100)  # the browser makes a click of the touch
        state, camera = as_state(shown.state), camera_of(shown)
        assert state.light_at == pytest.approx(rims_from(state.middle(STAGE, camera), 399.5, 299.5, camera))
        assert state.light_mode

    def test_a_tap_after_a_click_of_the_mouse_lets_it_follow_on(self, shown):
        """Browsers send a click after a tap."""
        shown.page.mouse.click(200, 200)
        shown.page.keyboard.press("l")
        shown.page.evaluate("picture.addEventListener('click', () => (window.clicked = true), { once: true })")
        shown.fingers(((400, 300), (400, 300)))
        shown.wait_for("window.clicked")
        assert as_state(shown.state).light_mode

    def test_two_turn_the_object(self, shown):
        before, camera = as_state(shown.state), camera_of(shown)
        shown.fingers(((200, 200), (260, 230)), ((300, 200), (360, 230)))
        assert_same(shown.state, before.orbited(60, 30, min(camera.width, camera.height), STAGE))

    def test_two_that_part_zoom(self, shown):
        before = as_state(shown.state)
        shown.fingers(((250, 200), (200, 200)), ((350, 200), (400, 200)))
        assert_same(shown.state, before.zoomed(math.log(2) / math.log(1.1)))
        shown.fingers(((200, 200), (250, 200)), ((400, 200), (350, 200)))
        assert_same(shown.state, before)

    def test_three_move_the_object(self, shown):
        before, camera = as_state(shown.state), camera_of(shown)
        shown.fingers(*(((x, 200), (x + 40, 170)) for x in (200, 300, 400)))
        assert_same(shown.state, before.panned(40, -30, camera.fx))

    def test_while_the_light_does_not_follow_one_turns_and_two_move_the_object(self, shown):
        shown.page.locator("#follow").tap()
        before, camera = as_state(shown.state), camera_of(shown)
        shown.fingers(((200, 200), (260, 230)))
        turned = before.orbited(60, 30, min(camera.width, camera.height), STAGE)
        assert_same(shown.state, turned)
        shown.fingers(((200, 200), (260, 230)), ((300, 200), (360, 230)))
        kept = turned.panned(60, 30, camera.fx)
        assert_same(shown.state, kept)
        shown.fingers(((400, 300), (400, 300)))
        assert_same(shown.state, kept)


class TestButtons:
    def test_they_do_what_their_keys_do_and_show_it(self, shown):
        start = as_state(shown.state)
        for name, changed in (("follow", {"light_mode": False}), ("unlit", {"lit": False})):
            button = shown.page.locator(f"#{name}")
            before = button.get_attribute("aria-pressed")
            button.click()
            assert button.get_attribute("aria-pressed") != before
            start = replace(start, **changed)
            assert_same(shown.state, start)
        for on in (True, False):  # the light was given without a shadow: it casts one as soon as somebody wants it
            shown.page.locator("#shadows").click()
            assert shown.state["shadows"] is on and shown.page.evaluate("pointshade.seen().lights[0].shadow")
        shown.page.locator("#shading").select_option("flat")
        assert shown.state["shading"] == "flat" and shown.state["lit"]

    def test_reset_brings_back_what_was_there_at_the_start(self, shown):
        start = as_state(shown.state)
        drag(shown.page, (200, 200), (330, 150))
        shown.page.mouse.wheel(0, -300)
        shown.wait_for("pointshade.state.distance < 1")
        shown.page.mouse.move(100, 300, steps=4)
        shown.page.locator("#reset").click()
        assert_same(shown.state, start)


@pytest.mark.parametrize("kind", ["cloud", "frame that looks down"])
def test_ten_drags_end_where_they_do_in_the_window(browser, renderer, kind):
    """Across, down, over the pole, back: about its own up, in the picture as it began; about a frame not so far."""
    positions = np.random.default_rng(0).normal(0, (0.5, 0.2, 0.9), (2000, 3))
    source = ps.PointCloud(positions.astype(np.float32), up="z") if kind == "cloud" else FRAME.with_up((0, -1, -0.3))
    scene, view = scene_of(source) if kind == "cloud" else source, ps.View(pitch=35)
    hand, state, stage = Hand(), State(), OrbitStage.of(scene)
    state = state.seen_from(np.linalg.inv(scene.pose) @ view.seen(scene)[1], stage)
    with browser.opened(draw_page(renderer, source, pitch=35)) as page:
        page.wait_until_drawn()
        camera = scene.picture_camera.fitted(*page.page.evaluate("[picture.width, picture.height]"))
        ways = np.random.default_rng(1).uniform(-150, 150, (10, 2))
        ways[:3] = (180, 0), (0, 190), (-170, 60)
        for across, down in ways.tolist():
            start, end = (300, 220), (300 + across, 220 + down)
            page.page.mouse.move(*start)
            drag(page.page, start, end)
            for what, place in (("press", start), *(("move", at) for at in places(start, end)), ("release", end)):
                state = hand.handle(Event(what, "left", **pixel(*place)), state, stage, camera)
            found = np.array(page.page.evaluate("pose(pointshade.state, pointshade.data.stage)"))
            expected = state.pose(stage)
            turned = found[:3, :3].T @ expected[:3, :3]
            assert np.degrees(np.arccos(np.clip((np.trace(turned) - 1) / 2, -1, 1))) < 0.1
            assert np.linalg.norm(found[:3, 3] - expected[:3, 3]) < 1e-3 * stage.radius
