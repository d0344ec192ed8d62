"""Several sources at once: each plays at its own rate, and all are drawn as one object."""

import json
import shlex
import shutil
import threading

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.cli.inputs import load_several
from pointshade_gl.cli.options import FrameOptions
from pointshade_gl.viewer import Viewer
from pointshade_gl.viewer.events import PlayCommand, StepFrames
from pointshade_gl.viewer.playback import Playback
from pointshade_gl.viewer.state import Views

from ..support import frames
from ..support.view_sets import pose_at, replaced, seen_from, write_views
from ..support.viewing import press, quiet, shown

LEFT, RIGHT = seen_from(pose_at(-8)), seen_from(pose_at(8))


def film(view, count):
    """Frames that get darker."""
    return [replaced(view, color=(view.color * (1 - 0.05 * k)).astype(np.uint8)) for k in range(count)]


@pytest.fixture
def play():
    made = []

    def start(sources, rates):
        made.append(Playback(sources, rates, 8, print))
        return made[-1], made[-1].first(merge=False)

    yield start
    for one in made:
        one.close()


def take(together, views, now):
    """What comes next, as soon as a thread has it."""
    while (new := together.advance(views, now)) is None:
        threading.Event().wait(0.001)
    return new


def wait_until_read(together):
    while any(player._queue.empty() for player in together.players):
        threading.Event().wait(0.001)


class TestTogether:
    def test_each_source_keeps_its_rate_and_the_other_ones_frames_stay(self, play):
        fast, slow = film(LEFT, 6), film(RIGHT, 6)
        together, views = play([fast, slow], [10, 5])
        assert views.frames == (fast[0], slow[0])
        shown = []
        for tick in range(8):
            wait_until_read(together)
            if new := together.advance(views, 100 + 0.1001 * tick):
                views = new
                shown.append((fast.index(views.frames[0]), slow.index(views.frames[1])))
        assert shown == [(1, 1), (2, 1), (3, 2), (4, 2), (5, 3), (0, 3), (1, 4), (2, 4)]

    def test_the_first_that_is_due_wakes_the_window(self, play):
        woken = threading.Event()
        together, views = play([film(LEFT, 3), film(RIGHT, 3)], [10, 4])
        wait_until_read(together)
        together.wake_by(woken.set)
        views = take(together, views, 50.0)
        wait_until_read(together)
        assert together.patience(views, 50.0) == pytest.approx(0.1) and woken.wait(20)

    def test_all_pause_and_step_together(self, play):
        left, right = film(LEFT, 3), film(RIGHT, 4)
        together, views = play([left, right], [None, None])
        views, _ = together.obey(StepFrames(-1), views)
        assert views.frames == (left[2], right[3]) and all(one.is_paused for one in together.players)
        assert together.advance(views, 9) is None and together.patience(views, 9) is None
        assert together.obey(PlayCommand.TOGGLE_PAUSE, views) == (None, "playing")
        assert together.is_moving(views) and take(together, views, 10) is not None

    def test_a_single_frame_beside_a_film_stays_and_costs_nothing(self, play):
        together, views = play([LEFT, film(RIGHT, 3)], [None, None])
        assert all(take(together, views, 1).frames[0] is LEFT for _ in range(4))

    def test_a_source_without_frames_ends_it_with_a_sentence(self, play):
        with pytest.raises(ValueError, match="no frames"):
            play([film(LEFT, 2), iter(())], [None, None])


class TestWindow:
    def test_a_new_frame_is_uploaded_alone_and_what_is_seen_is_what_render_draws(self, open_viewer):
        left, right = film(LEFT, 3), film(RIGHT, 3)
        viewer = open_viewer(left, others=[right], fps=(500, 500))
        press(viewer, "SPACE", "1")
        shown(quiet(viewer))
        views = viewer.frame
        before = viewer.renderer.steps.counts.copy()
        viewer.frame = views.with_frames([None, right[(right.index(views.frames[1]) + 1) % 3]])
        picture = shown(quiet(viewer))
        ran = viewer.renderer.steps.counts - before
        assert ran["upload"] == ran["surface"] == 1 and ran["agreement"] == 2
        drawn = ps.render(viewer.frame.frames, camera=viewer.camera, pose=viewer.pose, shading="none")
        solid = drawn[..., 3] == 255
        assert solid.mean() > 0.9
        solid[-26:] = False  # there the strip tells the rate
        assert (picture[solid] == drawn[solid][:, :3]).all()

    def test_it_plays_keeps_its_switches_and_m_says_that_it_is_merged(self, open_viewer):
        viewer = open_viewer(film(LEFT, 4), others=[film(RIGHT, 4), LEFT], fps=200)
        viewer.frame = viewer.frame.switched(2, False)
        seen = set()
        while len(seen) < 8:
            viewer.step()
            seen |= set(viewer.frame.shown)
        assert viewer.frame.on == (True, True, False) and viewer.frame.names == ("source 0", "source 1", "source 2")
        press(viewer, "M")
        assert viewer.messages.text == "these sources are always merged" and isinstance(viewer.frame, Views)
        press(viewer, "SPACE", "RIGHT")
        assert viewer.document.playback.players[0].is_paused

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            ({"others": [film(LEFT, 2)], "views": 2}, "views merges the frames of one sequence"),
            ({"others": [film(LEFT, 2)], "fps": (30, 20, 10)}, "fps must be a number of frames per .* one for each"),
            ({"others": [film(LEFT, 2)], "fps": (30, 0)}, "fps must be frames per second"),
            ({"others": ["vase"]}, "others must be Frames or iterables of frames, got 'vase'"),
            ({"others": [ps.Scene(camera=frames.CAMERA)]}, "others must be Frames or iterables of frames, got a Scene"),
            ({"others": LEFT}, "others must be Frames or iterables of frames"),
        ],
    )  # fmt: skip
    def test_what_cannot_play_together_is_said(self, options, message):
        with pytest.raises((TypeError, ValueError), match=message):
            Viewer(film(LEFT, 2), **options)

    def test_a_scene_has_no_others(self):
        with pytest.raises(TypeError, match="a scene has no others"):
            Viewer(ps.Scene(camera=frames.CAMERA), others=[LEFT])


class TestCommandLine:
    @pytest.fixture
    def folders(self, tmp_path):
        return [write_views(tmp_path / name, film(view, 3)) for name, view in (("left", LEFT), ("right", RIGHT))]

    @pytest.mark.parametrize(
        ("line", "sentence"),
        [
            ("{0} {1} --views 3", "INPUTs are merged as they play: leave out --views"),
            ("{0} {1} --fps 10,20,30", "per second, or one for each INPUT, got '10,20,30'"),
            ("{0} {1} --fps fast", "--fps must be a number of frames per second, or one for each INPUT, got 'fast'"),
            ("{0} {1} --depth {0}/depth/0.png", "pass --depth or --color with one INPUT"),
            ("{0} {0}/depth/0.png", "more INPUTs must be folders of frames, clouds or scenes, got"),
            ("{0} picture.png", "picture.png does not exist"),
        ],
    )  # fmt: skip
    def test_what_cannot_play_together_is_said(self, typed, folders, line, sentence):
        code, _, err = typed("view " + line.format(*(shlex.quote(str(folder)) for folder in folders)))
        assert code == 2 and sentence in err, err

    def test_frames_of_each_have_the_pose_that_a_file_gives_it(self, folders, tmp_path):
        poses = {name: frame.pose.tolist() for name, frame in (("right", LEFT), ("left", RIGHT))}
        (tmp_path / "poses.json").write_text(json.dumps(poses))
        shutil.rmtree(folders[1] / "pose")
        left, right = load_several(FrameOptions(poses=str(tmp_path / "poses.json")), list(map(str, folders)))
        assert all((frame.pose == RIGHT.pose).all() for frame in left)
        assert all((frame.pose == LEFT.pose).all() for frame in right) and len(right) == 3

    def test_a_folder_without_poses_is_not_merged(self, typed, folders):
        shutil.rmtree(folders[1] / "pose")
        code, _, err = typed(f"view '{folders[0]}' '{folders[1]}' --depth-scale 1000")
        assert (
            code == 2
            and "right has no poses: several INPUTs are merged by their poses, pass those as --poses FILE" in err
        )
