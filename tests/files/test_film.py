"""Films: what players show, and that no half-written file is left."""

import os
import re
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image, ImageSequence
from pytest import approx

from pointshade_gl.files.writing.film import BACKGROUND, Film, check_film


def picture(k=0, width=64, height=48):
    """(h, w, 4): a square of one colour, another for each k, with nothing around it."""
    image = np.zeros((height, width, 4), np.uint8)
    image[8:40, 8:40] = (40 * (k % 6), 200 - 20 * (k % 6), 90, 255)
    return image


def gradients(count=12):
    """Pictures of many colours, smooth in space and time."""
    v, u = np.mgrid[0:96, 0:128]
    for k in range(count):
        channels = 127 + 120 * np.sin(u / 40 + k / 4), u * 2, v * 2 * (k + 1) / count
        yield np.stack(channels, axis=2).clip(0, 255).astype(np.uint8)


def decoded(path):
    """(n, h, w, 3) uint8 of an .mp4, and what ffmpeg says about it."""
    from imageio_ffmpeg import get_ffmpeg_exe

    facts = subprocess.run([get_ffmpeg_exe(), "-hide_banner", "-i", path], capture_output=True, text=True).stderr
    command = [get_ffmpeg_exe(), "-v", "error", "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    raw = subprocess.run(command, capture_output=True, check=True).stdout
    found = re.search(r", (\d+)x(\d+)", facts)
    width, height = int(found[1]), int(found[2])
    return np.frombuffer(raw, np.uint8).reshape(-1, height, width, 3), facts


def shown(path):
    """The pictures of a .gif as (h, w, 3) uint8, and its durations in milliseconds."""
    with Image.open(path) as film:
        frames = [(np.asarray(item.convert("RGB")), item.info["duration"]) for item in ImageSequence.Iterator(film)]
        assert film.info["loop"] == 0
    return [item for item, _ in frames], [duration for _, duration in frames]


class TestMp4:
    @pytest.mark.system
    @pytest.mark.skipif(os.name == "nt", reason="Windows has no process groups of this kind")
    def test_ctrl_c_reaches_us_alone_so_a_film_can_still_be_finished(self, tmp_path):
        """A terminal sends it to all processes of a command."""
        code = """if True:
            import os, signal, sys, time
            import numpy as np
            from pointshade_gl.files.writing.film import Film

            with Film(sys.argv[1], fps=10) as film:
                film.add(np.full((48, 64, 4), 255, np.uint8))
                try:
                    os.killpg(0, signal.SIGINT)
                    time.sleep(5)
                except KeyboardInterrupt:
                    time.sleep(0.3)  # in which ffmpeg would end
                film.add(np.full((48, 64, 4), 255, np.uint8))
        """
        path = tmp_path / "out.mp4"
        subprocess.run([sys.executable, "-c", code, path], check=True, timeout=60, start_new_session=True)
        assert len(decoded(path)[0]) == 2

    def test_every_picture_is_there_in_its_colours_over_a_dark_background(self, tmp_path):
        with Film(tmp_path / "out.mp4", fps=12.5) as film:
            for k in range(6):
                film.add(picture(k))
        images, facts = decoded(tmp_path / "out.mp4")
        assert images.shape == (6, 48, 64, 3)
        assert "h264" in facts and "yuv420p" in facts and "bt709" in facts and "12.50 fps" in facts
        for k, image in enumerate(images):
            assert image[24, 24] == approx(picture(k)[24, 24, :3], abs=6)
            assert image[3, 60] == approx(BACKGROUND, abs=4)

    def test_odd_sizes_lose_a_pixel(self, tmp_path):
        with Film(tmp_path / "out.mp4") as film:
            film.add(picture(1, 65, 49))
            film.add(picture(2, 65, 49))
        images, _ = decoded(tmp_path / "out.mp4")
        assert images.shape == (2, 48, 64, 3) and images[1][24, 24] == approx(picture(2)[24, 24, :3], abs=6)

    def test_when_ffmpeg_gives_up_its_words_are_told_and_nothing_is_left(self, tmp_path):
        film = Film(tmp_path / "out.mp4")
        with pytest.raises(OSError, match=r"cannot write .*out.mp4: ffmpeg ended with \S+"), film:
            film.add(np.zeros((1, 1, 3), np.uint8))  # no even size is left
            film.add(np.zeros((1, 1, 3), np.uint8))
        assert not list(tmp_path.iterdir())

    def test_without_the_extra_it_is_named(self, tmp_path, monkeypatch):
        monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
        with pytest.raises(ValueError, match=r"pip install '\.\[video\]' in the clone for \.mp4; \.gif works without"):
            check_film(tmp_path / "out.mp4")
        with Film(tmp_path / "out.gif") as film:
            film.add(picture())


class TestGif:
    def test_every_picture_is_there_in_its_colours_and_it_loops(self, tmp_path):
        with Film(tmp_path / "out.gif", fps=20) as film:
            for k in range(6):
                film.add(picture(k))
        images, durations = shown(tmp_path / "out.gif")
        assert durations == [50] * 6
        for k, image in enumerate(images):
            assert image[24, 24] == approx(picture(k)[24, 24, :3], abs=2)
            assert image[3, 60] == approx(BACKGROUND, abs=2)

    def test_many_colours_are_met_closely_and_without_speckle(self, tmp_path):
        with Film(tmp_path / "out.gif") as film:
            for image in gradients():
                film.add(image)
        images, _ = shown(tmp_path / "out.gif")
        errors = np.array([np.subtract(a, b, dtype=int) for a, b in zip(images, gradients(), strict=True)])
        assert 10 * np.log10(255**2 / np.mean(errors**2.0)) > 30

    @pytest.mark.parametrize(("fps", "longest"), [(30, 40), (24, 50), (100, 20), (12, 90)])
    def test_the_film_lasts_as_long_as_its_pictures_a_second_say(self, tmp_path, fps, longest):
        """Durations alternate between whole hundredths of a second, and none is below two: browsers slow those down."""
        with Film(tmp_path / "out.gif", fps) as film:
            for k in range(24):
                film.add(picture(k))
        _, durations = shown(tmp_path / "out.gif")
        assert sum(durations) == approx(max(24 / fps, 24 * 0.02) * 1000, abs=5) and max(durations) == longest

    def test_what_stands_still_costs_next_to_nothing(self, tmp_path):
        sizes = []
        for count in (1, 20):
            with Film(tmp_path / f"{count}.gif") as film:
                for k in range(count):
                    image = next(gradients()).copy()
                    image[:4, :4] = 10 * k  # only this corner moves
                    film.add(image)
            sizes.append((tmp_path / f"{count}.gif").stat().st_size)
        assert sizes[1] < 3 * sizes[0]


@pytest.mark.parametrize("suffix", ["mp4", "gif"])
class TestBoth:
    def test_later_pictures_of_another_size_are_fitted_in(self, tmp_path, suffix):
        path = tmp_path / f"out.{suffix}"
        with Film(path) as film:
            film.add(picture())
            film.add(np.full((96, 64, 3), 250, np.uint8))  # twice as high: 32 pixels wide in the middle
        images = decoded(path)[0] if suffix == "mp4" else shown(path)[0]
        assert images[1].shape == (48, 64, 3)
        assert images[1][24, 32] == approx(250, abs=4) and images[1][24, 6] == approx(BACKGROUND, abs=4)

    def test_an_error_in_the_middle_leaves_nothing(self, tmp_path, suffix):
        with pytest.raises(KeyboardInterrupt), Film(tmp_path / f"out.{suffix}") as film:
            film.add(picture())
            raise KeyboardInterrupt
        assert not list(tmp_path.iterdir())

    def test_an_error_leaves_the_film_that_was_there(self, tmp_path, suffix):
        (tmp_path / f"out.{suffix}").write_bytes(b"the old film")
        with pytest.raises(TypeError, match="must be uint8"), Film(tmp_path / f"out.{suffix}") as film:
            film.add(picture())
            film.add(picture() / 255)
        assert (tmp_path / f"out.{suffix}").read_bytes() == b"the old film" and len(list(tmp_path.iterdir())) == 1

    def test_until_it_is_closed_nothing_lies_under_its_name(self, tmp_path, suffix):
        film = Film(tmp_path / f"out.{suffix}")
        film.add(picture())
        assert not (tmp_path / f"out.{suffix}").exists()
        film.close()
        film.close()
        assert [path.name for path in tmp_path.iterdir()] == [f"out.{suffix}"]

    def test_a_film_without_a_picture_is_none(self, tmp_path, suffix):
        with Film(tmp_path / f"out.{suffix}"):
            pass
        assert not list(tmp_path.iterdir())

    @pytest.mark.skipif(not hasattr(os, "symlink") or sys.platform == "win32", reason="needs links")
    def test_a_link_stays_a_link(self, tmp_path, suffix):
        (tmp_path / "there").mkdir()
        (tmp_path / f"out.{suffix}").symlink_to(tmp_path / "there" / f"film.{suffix}")
        with Film(tmp_path / f"out.{suffix}") as film:
            film.add(picture())
        assert (tmp_path / f"out.{suffix}").is_symlink() and (tmp_path / "there" / f"film.{suffix}").is_file()


@pytest.mark.parametrize(
    ("name", "error", "sentence"),
    [
        ("out.avi", ValueError, r"out\.avi: the suffix of a film must be \.mp4 or \.gif"),
        ("out", ValueError, "the suffix of a film"),
        ("no/out.mp4", FileNotFoundError, "create it first"),
        ("folder.gif", IsADirectoryError, "it is a folder"),
    ],
)
def test_places_where_no_film_can_lie(tmp_path, name, error, sentence):
    (tmp_path / "folder.gif").mkdir()
    with pytest.raises(error, match=sentence):
        check_film(tmp_path / name)
    with pytest.raises(error, match=sentence):
        Film(tmp_path / name)


@pytest.mark.parametrize("fps", [0, -1, 1e-5, 1e5, float("nan"), float("inf")])
def test_impossible_fps(tmp_path, fps):
    with pytest.raises(ValueError, match=r"fps must be pictures per second, from 0\.01 to 1000, got"):
        Film(tmp_path / "out.gif", fps)


@pytest.mark.parametrize("suffix", ["mp4", "gif"])
@pytest.mark.parametrize("fps", [0.01, 1000])
def test_the_slowest_and_the_quickest_film_can_be_written(tmp_path, suffix, fps):
    with Film(tmp_path / f"out.{suffix}", fps) as film:
        film.add(picture(0))
        film.add(picture(1))
    assert (tmp_path / f"out.{suffix}").stat().st_size


def test_a_link_that_leads_back_to_itself_is_no_place_for_a_film(tmp_path):
    (tmp_path / "out.gif").symlink_to("out.gif")
    with pytest.raises(OSError, match=r"out\.gif is a link that leads back to itself"):
        Film(tmp_path / "out.gif")
