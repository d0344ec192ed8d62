"""Several views of one thing in the window: merged and played by a key, switched one by one, listed in the panel."""

import threading
import time
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.frame_sources import choose_views
from pointshade_gl.scene.orbit import marker_place
from pointshade_gl.viewer import panel_sections
from pointshade_gl.viewer.events import Event, PlayCommand, Seek, StepFrames
from pointshade_gl.viewer.playback import Playback
from pointshade_gl.viewer.state import Views, check_views

from ..support import frames
from ..support.view_sets import pose_at, seen_from
from ..support.viewing import click_row, press, quiet, shown

WALK = [seen_from(pose_at(yaw)) for yaw in range(-12, 13, 3)]  # nine views
TIMELINE = -26  # rows from there on are the strip's


class Files(list):
    """Frames as files give them; those in `broken` cannot be read, and all but the first `free` wait for the gate."""

    def __init__(self, views=WALK, broken=()):
        super().__init__(views)
        self.broken, self.gate, self.read, self.free = broken, threading.Event(), [], 0
        self.gate.set()

    def __getitem__(self, index):
        if len(self.read) >= self.free:
            self.gate.wait(20)
        self.read.append(index)
        if index in self.broken:
            raise OSError(f"frame {index} is cut off")
        return super().__getitem__(index)


class TestViews:
    def views(self):
        return Views.of(dict(enumerate(WALK[:3])), 1)

    def test_all_are_on_at_first_and_home_is_the_frame_that_is_named(self):
        views = self.views()
        assert views.shown == tuple(WALK[:3]) and views.home is WALK[1] and views.names == ("0", "1", "2")
        assert Views.of({4: WALK[4], 7: WALK[7]}).home is WALK[4]

    def test_a_switch_takes_one_away_and_gives_it_back(self):
        views = self.views().switched(1, False)
        assert views.shown == (WALK[0], WALK[2]) and views.shown_names == ["0", "2"]
        assert views.points_known == WALK[0].points_known + WALK[2].points_known
        assert views.switched(1, True).shown == views.all_on().shown == tuple(WALK[:3])

    def test_the_last_one_stays_on(self):
        views = self.views().switched(0, False).switched(1, False)
        assert views.switched(2, False) is views and views.shown == (WALK[2],)


class TestChoice:
    @pytest.mark.parametrize(
        ("count", "among", "chosen"),
        [
            (3, None, [0, 4, 8]),
            (3, 5, [0, 5, 8]),
            (3, 8, [0, 4, 8]),
            (3, -1, [0, 4, 8]),
            (None, 3, list(range(9))),
            (20, 3, list(range(9))),
        ],
    )
    def test_views_are_spread_evenly_round_the_frame_that_is_shown(self, count, among, chosen):
        assert choose_views(WALK, count, among=among) == chosen

    def test_more_than_200_are_not_merged(self):
        told = []
        chosen = choose_views([*WALK] * 50, 300, told.append)
        assert len(chosen) == 200 and (chosen[0], chosen[-1]) == (0, 449) and "only 200 of 300" in told[0]

    @pytest.mark.parametrize(("views", "count"), [(2, 2), ("all", None)])
    def test_numbers_and_all_are_taken(self, views, count):
        assert check_views(views) == count

    @pytest.mark.parametrize("views", [1, 0, 2.5, "some", None])
    def test_anything_else_is_refused(self, views):
        with pytest.raises((TypeError, ValueError), match="views must be 'all', or it must be a whole number from 2"):
            check_views(views)


@pytest.fixture
def merging():
    """merging(source, count, skipped) is a Playback, and the frame that it shows while it reads frames to merge."""
    made = []

    def start(source, count, skipped=print, home=0):
        source.free = 100  # until merging starts
        made.append(Playback([source], [None], count, skipped))
        playback, frame = made[-1], made[-1].first(merge=False)
        playback.obey(PlayCommand.TOGGLE_PAUSE, frame)
        frame = playback.obey(Seek(home), frame)[0]
        source.free, source.read = 0, []
        assert playback.obey(PlayCommand.TOGGLE_MERGE, frame) == (None, "") and playback.is_merging
        return playback, frame

    yield start
    for one in made:
        one.close()


def read(playback):
    while not (answer := playback.merged())[1]:
        threading.Event().wait(0.001)
    return answer


class TestMerging:
    def test_frames_are_read_by_threads_and_each_tells(self, merging):
        source, woken = Files(), threading.Semaphore(0)
        source.gate.clear()
        playback, frame = merging(source, 3, home=5)
        playback.wake_by(woken.release)
        assert playback.merged() == (None, "")
        assert playback.strip(frame) == ("merging: 0 of 3 views are read     Esc ends it", 0)
        source.gate.set()
        assert all(woken.acquire(timeout=20) for _ in range(3))
        assert playback.strip(frame).text.startswith("merging: 3 of 3 views are read")
        views, text = playback.merged()
        assert not playback.is_merging and views.names == ("0", "5", "8") and views.home is WALK[5]
        assert text == "3 views as one object; M plays the frames"

    def test_what_cannot_be_read_is_told_and_left_out(self, merging):
        told = []
        views, _ = read(merging(Files(broken=(4,)), 3, told.append)[0])
        assert views.frames == (WALK[0], WALK[8]) and told[-1] == "frame 4 is cut off"

    def test_fewer_than_two_are_refused(self, merging):
        answer = read(merging(Files(broken=(0, 8)), 3, home=4)[0])
        assert answer == (None, "not merged: fewer than two of 3 frames can be read")

    def test_it_can_be_given_up(self, merging):
        source = Files()
        source.gate.clear()
        playback, _ = merging(source, None)
        threading.Timer(0.05, source.gate.set).start()
        assert playback.end_merging()
        assert not playback.is_merging and len(source.read) <= 2


def rendered(viewer, source):
    """What `render` draws of frames where a paused viewer looks, under its light."""
    light = replace(viewer.state.light(viewer.stage, viewer.pose), shadow=False)
    return ps.render(source, light, camera=viewer.camera, pose=viewer.pose)


def far_from_marker(viewer):
    """(h, w) bool"""
    x, y = marker_place(viewer.state, viewer.stage, viewer.camera)
    v, u = np.mgrid[:240, :320]
    return np.hypot(u - x, v - y) > 45  # it glows


def merge(viewer):
    """Presses M. The views, as soon as they are shown."""
    press(viewer, "M")
    return merged(viewer).frame


def merged(viewer):
    """The viewer, as soon as it shows the views."""
    while not isinstance(viewer.frame, Views):
        viewer.step()
    return viewer


@pytest.fixture
def paused(open_viewer):
    """Nine views, paused at the third."""
    viewer = open_viewer(Files(), fps=500)
    while viewer.document.playback.players[0].index != 2:
        viewer.perform(StepFrames(1))
    return quiet(viewer)


class TestKey:
    def test_m_draws_the_views_as_one_object_from_where_it_is_and_plays_on(self, paused):
        before = shown(paused)
        views = merge(paused)
        assert views.home is WALK[2] and len(views.frames) == 8 and WALK[2] in views.frames
        assert "8 views as one object" in paused.messages.text
        merged = shown(quiet(paused))
        drawn, far = rendered(paused, views.frames), far_from_marker(paused)
        solid = (drawn[..., 3] == 255) & far
        assert (merged[solid] == drawn[solid][:, :3]).all()
        assert 0 < np.abs(merged.astype(int) - before)[:TIMELINE][far[:TIMELINE]].mean() < 6  # nothing jumps
        press(paused, "M")
        assert paused.frame is WALK[2] and (shown(quiet(paused)) == before).all()
        press(paused, "RIGHT")
        assert paused.frame is WALK[3]

    def test_while_views_are_read_the_window_lives_and_says_so(self, paused):
        source = paused.document.playback._first
        source.gate.clear()
        press(paused, "M")
        paused.step(wait=False)
        assert paused.strip == ("merging: 0 of 8 views are read     Esc ends it", 0)
        drawn = paused.drawn
        paused.handle(Event("move", x=50, y=50))
        paused.handle(Event("move", x=90, y=60))
        paused.step(wait=False)
        assert paused.drawn == drawn + 1 and paused.frame is WALK[2]
        source.gate.set()

    def test_m_again_gives_it_up(self, paused):
        source = paused.document.playback._first
        source.gate.clear()
        press(paused, "M")
        threading.Timer(0.05, source.gate.set).start()
        press(paused, "M")
        assert paused.messages.text == "not merged"
        paused.step(wait=False)
        assert paused.frame is WALK[2]

    def test_merged_it_rests_and_keys_of_a_stream_say_what_to_press(self, paused):
        press(paused, "SPACE")
        views = merge(paused)
        for name in ("SPACE", "LEFT", "RIGHT"):
            press(paused, name)
            assert "M plays" in paused.messages.text and paused.frame is views
        quiet(paused).step(wait=False)
        assert paused.patience(time.perf_counter()) is None

    def test_what_cannot_be_merged_is_said(self, open_viewer):
        viewer = open_viewer()
        press(viewer, "M")
        assert viewer.messages.text == "a single frame: nothing to merge"
        viewer = open_viewer(iter(WALK))
        press(viewer, "M")
        assert viewer.messages.text == "only frames of a sequence can be merged"
        viewer = open_viewer(Files(broken=range(1, 9)))
        press(viewer, "SPACE", "M")
        while viewer.document.playback.is_merging:
            viewer.step()
        assert viewer.messages.text == "not merged: fewer than two of 8 frames can be read"

    def test_light_look_shadows_reset_and_saving_work_on_the_merged_object(self, open_viewer, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        viewer = merged(open_viewer(WALK, views=3))
        seen = [shown(quiet(viewer))]
        for name in ("1", "2", "S", "+"):
            press(viewer, name)
            seen.append(shown(quiet(viewer)))
        assert all((a != b).any() for a, b in pairwise(seen))
        viewer.state = viewer.state.orbited(40, 10, 240)
        press(viewer, "R", "P")
        assert viewer.state.yaw == 0 and (tmp_path / "pointshade_0001.png").exists()


class TestStart:
    def test_it_may_begin_merged_and_play_afterwards(self, open_viewer):
        viewer = merged(open_viewer(WALK, views=3, fps=500))
        assert viewer.frame.frames == (WALK[0], WALK[4], WALK[8]) and viewer.frame.home is WALK[0]
        for _ in range(3):
            viewer.step(wait=False)
        assert isinstance(viewer.frame, Views)
        press(viewer, "M")
        while viewer.frame is not WALK[3]:
            viewer.step()
        assert len(merge(viewer).frames) == 3

    def test_while_they_are_read_the_first_frame_is_seen(self, open_viewer):
        source = Files()
        source.gate.clear()
        source.free = 1
        viewer = open_viewer(source, views=2)
        assert viewer.frame is WALK[0]
        source.gate.set()
        assert merged(viewer).frame.frames == (WALK[0], WALK[8])

    def test_all_of_them(self, open_viewer):
        assert merged(open_viewer(WALK[:4], views="all")).frame.frames == tuple(WALK[:4])

    @pytest.mark.parametrize("source", [frames.sphere(), ps.Scene(camera=frames.CAMERA), iter(WALK)])
    def test_only_a_sequence_can(self, source):
        with pytest.raises(ValueError, match="views merges the frames of a sequence, and this is a"):
            ps.viewer.Viewer(source, views=3)


def counted_in(viewer, work):
    before = viewer.renderer.steps.counts.copy()
    work()
    viewer.step(wait=False)
    return {name: count for name, count in (viewer.renderer.steps.counts - before).items() if count}


class TestSwitches:
    def test_a_view_that_is_off_is_not_drawn(self, open_viewer):
        viewer = merged(open_viewer(WALK, views=3))
        full = shown(quiet(viewer))
        ran = counted_in(viewer, lambda: setattr(viewer, "frame", viewer.frame.switched(1, False)))
        assert "upload" not in ran and "surface" not in ran and ran["splats"] == 2
        two = shown(quiet(viewer))
        assert (two != full).any()
        viewer.frame = viewer.frame.switched(2, False)
        alone = shown(quiet(viewer))
        viewer.frame = viewer.frame.all_on()
        assert (shown(quiet(viewer)) == full).all()
        drawn = rendered(viewer, WALK[0])
        solid = (drawn[..., 3] == 255) & far_from_marker(viewer)
        assert (alone[solid] == drawn[solid][:, :3]).all()


class TestPanel:
    @pytest.fixture(autouse=True)
    def extra(self):
        pytest.importorskip("imgui_bundle")

    def test_a_click_on_a_box_switches_a_view(self, open_viewer):
        viewer = merged(open_viewer(WALK, views=3, window_size=(640, 480), panel=True))
        click_row(viewer, "frame 0")
        assert viewer.frame.on == (False, True, True)
        click_row(viewer, "frame 0")
        assert viewer.frame.on == (True, True, True)

    def test_the_primary_ones_are_marked_and_change_with_the_view(self, open_viewer, monkeypatch):
        viewer = merged(open_viewer(WALK, views="all", window_size=(640, 480), panel=True))
        told = []
        monkeypatch.setattr(panel_sections, "_show_weight", lambda _, weight: told.append(weight))
        for yaw in (0, 18):
            viewer.state = replace(viewer.state, yaw=yaw)
            viewer.step(wait=False)
            viewer.step(wait=False)
        first, last = told[:9], told[-9:]
        assert [weight == 1 for weight in first] == [True] * 3 + [False] * 6
        assert np.argmax(last) > 3 and sum(weight == 1 for weight in last) == 3

    def test_why_is_asked_once_and_only_where_it_is_open(self, open_viewer, monkeypatch):
        viewer = merged(open_viewer(WALK, views=3, window_size=(640, 480), panel=True))
        asked, explain = [], viewer.renderer.explain
        monkeypatch.setattr(viewer.renderer, "explain", lambda names: asked.append(names) or explain(names))
        for _ in range(4):
            viewer.step(wait=False)
        assert asked == []
        click_row(viewer, "why")
        assert asked == [["0", "4", "8"]]
        viewer.state = replace(viewer.state, yaw=5)
        viewer.step(wait=False)
        assert len(asked) == 1
        viewer.frame = viewer.frame.switched(1, False)
        viewer.step(wait=False)
        assert asked[1:] == [["0", "8"]]

    def test_200_views_leave_room_for_the_rest(self, open_viewer):
        camera = ps.Camera(8, 8, 3.5, 2.5, 8, 6)
        many = {k: ps.Frame(None, np.full((6, 8), 1.5), camera, pose_at(k / 20)) for k in range(200)}
        viewer = merged(open_viewer(list(many.values()), views=6, window_size=(640, 900), panel=True))
        heights = []
        for views in (viewer.frame, Views.of(many)):
            viewer.frame = replace(views, on=(True, True, *[False] * (len(views.frames) - 2)))
            for _ in range(4):
                viewer.step(wait=False)
            window = viewer.screen.panel._imgui.internal.find_window_by_name("pointshade")
            heights.append(window.size.y)
        assert heights[0] == heights[1] < 800
