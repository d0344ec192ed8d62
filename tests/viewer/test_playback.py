"""How a stream is played: at its rate by the clock it is given, read by a thread, paused and stepped."""

import threading

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.viewer.playback import Player

CAMERA = ps.Camera(10, 10, 3.5, 2.5, 8, 6)
FRAMES = [ps.Frame(None, np.full((6, 8), 1.0 + k), CAMERA) for k in range(4)]


class Folder(list):
    """Frames as files would give them; those in `broken` cannot be read. A list is a Sequence."""

    def __init__(self, broken=()):
        super().__init__(FRAMES)
        self.broken = broken

    def __getitem__(self, index):
        if index in self.broken:
            raise OSError(f"frame {index} is cut off")
        return super().__getitem__(index)


@pytest.fixture
def play():
    """play(source, ...) is a Player that ends with the test, with its thread."""
    made = []

    def start(*arguments, **options):
        made.append(Player(*arguments, **options))
        return made[-1]

    yield start
    for one in made:
        thread = one._thread
        one.close()
        assert thread is None or not thread.is_alive()


def take(playback, now=0.0):
    """The next frame, as soon as the thread has it."""
    while (frame := playback.advance(now)) is None:
        threading.Event().wait(0.001)
    return frame


def test_frames_come_in_order_and_over_again(play):
    playback = play(Folder())
    assert playback.first() is FRAMES[0]
    assert [take(playback) for _ in range(6)] == [FRAMES[k] for k in (1, 2, 3, 0, 1, 2)]
    assert playback.index == 2


def test_fps_hold_them_back_and_a_delay_is_not_made_up_for(play):
    playback = play(Folder(), fps=10)
    playback.first()
    assert take(playback, 5.0) is FRAMES[1]
    assert playback.advance(5.01) is None
    while playback.patience(5.02) is None:
        threading.Event().wait(0.001)
    assert 0 < playback.patience(5.02) < 0.1
    assert take(playback, 5.11) is FRAMES[2]
    while playback.patience(5.15) is None:
        threading.Event().wait(0.001)
    assert playback.patience(5.15) == pytest.approx(0.05)
    assert take(playback, 9.0) is FRAMES[3]
    while playback.patience(9.0) is None:
        threading.Event().wait(0.001)
    assert playback.advance(9.09) is None
    assert playback.advance(9.1) is FRAMES[0]


def test_whoever_shows_them_is_woken_when_a_frame_has_come_and_not_before(play):
    gate, woken = threading.Event(), threading.Event()

    def camera():
        yield FRAMES[0]
        gate.wait(20)
        yield FRAMES[1]

    playback = play(camera())
    playback.first()
    playback.wake = woken.set
    assert playback.advance(0) is None and playback.patience(0) is None
    gate.set()
    assert woken.wait(20)
    assert playback.patience(0) == 0 and playback.advance(0) is FRAMES[1]


def test_paused_nothing_comes_and_playing_on_follows_the_frame_shown(play):
    playback = play(Folder())
    playback.first()
    take(playback)
    playback.toggle()
    assert playback.advance(100) is None and playback.patience(100) is None
    playback.toggle()
    assert take(playback) is FRAMES[2]


def test_steps_go_both_ways_round_past_what_cannot_be_read_and_play_goes_on_from_there(play):
    told = []
    playback = play(Folder(broken=(1,)), skipped=told.append)
    assert playback.first() is FRAMES[0]
    assert playback.step(1) is FRAMES[2]
    assert playback.step(-1) is FRAMES[0]
    assert playback.step(-1) is FRAMES[3]
    assert playback.is_paused and "frame 1 is cut off" in told
    playback.step(-1)
    playback.toggle()
    assert take(playback) is FRAMES[3]


def test_a_camera_steps_forwards_only(play):
    playback = play(iter(FRAMES))
    playback.first()
    playback.step(-1)
    assert playback.advance(0) is None
    playback.step(1)
    assert take(playback) is FRAMES[1]
    assert playback.advance(0) is None


def test_an_unreadable_frame_is_told_and_skipped(play):
    told = []
    playback = play(Folder(broken=(0, 2)), skipped=told.append)
    assert playback.first() is FRAMES[1]
    assert take(playback) is FRAMES[3]
    assert told[:2] == ["frame 0 is cut off", "frame 2 is cut off"]


def test_a_sequence_of_which_nothing_can_be_read_ends_with_a_sentence(play):
    with pytest.raises(ValueError, match="none of the 4 frames can be read"):
        play(Folder(broken=(0, 1, 2, 3))).first()


@pytest.mark.parametrize("fps", [0, -1, float("nan"), 1e9])
def test_fps_that_are_none_are_refused(fps):
    with pytest.raises(ValueError, match="fps must be"):
        Player(FRAMES, fps=fps)
