"""Many pictures into films and numbered files: what is drawn, in which order, and what is left after an error."""

import threading
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageSequence

import pointshade_gl as ps
from pointshade_gl.files.access.known_names import numbered
from pointshade_gl.files.writing.film import check_series, is_series
from pointshade_gl.renderer.series import jobs_of, sequence_jobs, write_series
from pointshade_gl.scene.viewpoint import View

from ..support import frames

CAMERA = ps.Camera(50, 50, 19.5, 14.5, 40, 30)
UNLIT = View(look=ps.Appearance(shading="none"))


def grey(value, distance=1.5, pose=None):
    """A wall of one grey."""
    color = np.full((30, 40, 3), value, np.uint8)
    return ps.Frame(color, np.full((30, 40), distance, np.float32), CAMERA, pose)


def refuse(text):
    raise AssertionError(f"an unexpected warning: {text}")


def greys(paths):
    values = {}
    for path in paths:
        with Image.open(path) as image:
            values[path.name] = image.getpixel((20, 15))[0]
    return values


@pytest.mark.parametrize(
    ("name", "made"),
    [
        ("%04d.png", "0007.png"),
        ("a%d.png", "a7.png"),
        ("%3d of 100%.jpg", "  7 of 100%.jpg"),
        ("x%02d.webp", "x07.webp"),
    ],
)
def test_names_are_numbered(name, made):
    assert is_series(Path(name)) and numbered(Path("out") / name, 7) == Path("out") / made


def test_films_are_series_and_other_names_are_one_picture():
    assert is_series(Path("a.mp4")) and is_series(Path("a.GIF"))
    assert not any(is_series(Path(name)) for name in ("a.png", "100%.png", "50%off.png", "%04d/a.png"))


@pytest.mark.parametrize(
    ("name", "error", "sentence"),
    [
        ("a.png", ValueError, r"a film \(\.mp4, \.gif\) or a number in the name \(such as %04d\.png\), got .*a\.png"),
        ("%d.mp4", ValueError, "suffix must be one of"),
        ("no/%d.png", FileNotFoundError, "create it first"),
        ("no/a.gif", FileNotFoundError, "create it first"),
    ],
)
def test_places_where_no_series_can_lie(tmp_path, name, error, sentence):
    with pytest.raises(error, match=sentence):
        check_series(tmp_path / name)


def test_every_frame_of_a_sequence_becomes_its_file(renderer, tmp_path):
    done = []
    source = [grey(10 * k) for k in range(12)]
    shots, count = jobs_of(source, UNLIT, None, None, refuse)
    written = write_series(renderer, shots, tmp_path / "%02d.png", 25, lambda *told: done.append(told), count)
    assert written == (12, (40, 30)) and done == [(k + 1, count) for k in range(12)]
    assert greys(sorted(tmp_path.iterdir())) == {f"{k:02d}.png": 10 * k for k in range(12)}


def test_the_first_frames_are_taken_when_asked(renderer, tmp_path):
    shots, count = jobs_of([grey(10 * k) for k in range(12)], UNLIT, None, 3, refuse)
    assert count == 3 and write_series(renderer, shots, tmp_path / "%d.png", 25)[0] == 3


def test_a_film_holds_the_frames_in_their_order(renderer, tmp_path):
    shots, _ = jobs_of([grey(20 * k) for k in range(10)], UNLIT, None, None, refuse)
    write_series(renderer, shots, tmp_path / "out.gif", 20)
    with Image.open(tmp_path / "out.gif") as film:
        shown = [image.convert("RGB").getpixel((20, 15))[0] for image in ImageSequence.Iterator(film)]
    assert shown == pytest.approx([20 * k for k in range(10)], abs=2)


def test_a_skipped_frame_leaves_a_gap_in_the_numbers(renderer, tmp_path):
    class Spoilt(list):
        def __getitem__(self, k):
            if k == 2:
                raise ValueError("frame 2: is broken")
            return super().__getitem__(k)

    told = []
    shots = sequence_jobs(Spoilt(grey(10 * k) for k in range(5)), UNLIT, told.append)
    assert write_series(renderer, shots, tmp_path / "%d.png", 25)[0] == 4
    assert greys(sorted(tmp_path.iterdir())) == {"0.png": 0, "1.png": 10, "3.png": 30, "4.png": 40}
    assert told == ["frame 2: is broken"]


def test_a_stream_without_a_length_will_do(renderer, tmp_path):
    shots = sequence_jobs((grey(10 * k) for k in range(3)), UNLIT, refuse)
    assert write_series(renderer, shots, tmp_path / "%d.png", 25)[0] == 3


def test_nothing_to_write_is_said(renderer, tmp_path):
    with pytest.raises(ValueError, match=r"nothing to write to .*out\.gif: no frame could be read"):
        write_series(renderer, sequence_jobs([], UNLIT, refuse), tmp_path / "out.gif", 25)
    assert not list(tmp_path.iterdir())


def test_what_is_no_frame_does_not_end_a_series_in_silence(renderer, tmp_path):
    with pytest.raises(TypeError, match="what the source gives must be a Frame, got None"):
        write_series(renderer, sequence_jobs(iter([grey(1), None, grey(2)]), UNLIT, refuse), tmp_path / "%d.png", 25)


def test_the_camera_turns_round_the_first_frames_pivot_carried_along():
    """Frames whose own pivots jump do not make the camera jump."""
    moved = np.eye(4)
    moved[:3, 3] = 1, 2, 3
    near, far = [
        request.pose for _, request in sequence_jobs([grey(1, 1.5), grey(2, 4.0, moved)], View(yaw=30), refuse)
    ]
    np.testing.assert_allclose(far[:3, 3] - near[:3, 3], (1, 2, 3), atol=1e-12)
    np.testing.assert_allclose(far[:3, :3], near[:3, :3], atol=1e-12)


def test_a_light_that_turns_runs_only_the_light_pass(renderer, tmp_path):
    frame = grey(200)
    shots, count = jobs_of(frame, View(), "light", 8, refuse)
    before = renderer.steps.counts.copy()
    assert write_series(renderer, shots, tmp_path / "out.gif", 20)[0] == count == 8
    ran = renderer.steps.counts - before
    assert ran == {"upload": 1, "surface": 1, "splats": 1, "resolve": 2, "light": 7}


def test_a_light_that_turns_moves_the_bright_side(renderer, tmp_path):
    """On a sphere: after a quarter turn the right half is brighter than the left, after three quarters darker."""
    shots, _ = jobs_of(frames.sphere(), View(), "light", 4, refuse)
    write_series(renderer, shots, tmp_path / "%d.png", 20)
    halves = []
    for k in range(4):
        with Image.open(tmp_path / f"{k}.png") as image:
            light = np.asarray(image.convert("RGB"), float).mean(-1)
        halves.append((light[:, :80].mean(), light[:, 80:].mean()))
    (left0, right0), (left1, right1), (left2, right2), (left3, right3) = halves
    assert right1 / left1 > 1.5 * right0 / left0 and left3 / right3 > 1.5 * left0 / right0
    assert left0 + right0 > max(left1 + right1, left3 + right3) > left2 + right2


def test_the_light_goes_once_round_while_a_sequence_plays():
    """Around what the first frame shows: frames whose own middles jump do not make the light jump."""
    source = [grey(10 * k, 2 + k % 2) for k in range(4)]
    jobs, count = jobs_of(source, View(), "light", None, refuse)
    shown = [request for _, request in jobs]
    assert count == 4 and [request.source for request in shown] == source
    places = np.array([request.lights[0].position for request in shown])
    middle = source[0].pivot
    np.testing.assert_allclose(places[:, 1], places[0, 1])
    np.testing.assert_allclose((places[0] + places[2])[[0, 2]] / 2, middle[[0, 2]], atol=1e-9)
    assert jobs_of(source, View(), "light", 3, refuse)[1] == 3


def test_a_single_frame_without_a_turntable_cannot_become_a_film():
    with pytest.raises(
        ValueError, match="a single frame cannot become a film: pass turntable='light' or 'camera', or write"
    ):
        jobs_of(grey(1), View(), None, None, refuse)
    with pytest.raises(ValueError, match="unknown turntable 'table': known are light, camera, swing, 360"):
        jobs_of(grey(1), View(), "table", None, refuse)


@pytest.mark.parametrize("name", ["out.gif", "out.mp4", "%d.png"])
def test_an_error_in_the_middle_ends_all_threads_and_leaves_nothing_half_written(renderer, tmp_path, name):
    before = set(threading.enumerate())

    def source():
        yield from (grey(10), grey(20), grey(30))
        raise KeyError("a bug")

    with pytest.raises(KeyError, match="a bug"):
        write_series(renderer, sequence_jobs(source(), UNLIT, refuse), tmp_path / name, 25)
    left = [path.name for path in tmp_path.iterdir()]
    assert not any(name.endswith((".part", ".gif", ".mp4")) for name in left)
    assert set(threading.enumerate()) <= before


def test_an_error_of_the_encoder_comes_through(renderer, tmp_path):
    (tmp_path / "1.png").mkdir()
    shots = sequence_jobs([grey(10 * k) for k in range(5)], UNLIT, refuse)
    with pytest.raises(IsADirectoryError, match=r"cannot write .*1\.png: it is a folder"):
        write_series(renderer, shots, tmp_path / "%d.png", 25)
