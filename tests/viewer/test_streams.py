"""Streams of frames in the window, and films of it."""

import pytest
from PIL import Image

from pointshade_gl.viewer import Viewer

from ..support import frames
from ..support.viewing import Spoilt, press


class TestStreams:
    def test_a_sequence_plays_over_and_over_past_what_cannot_be_read(self, open_viewer, capsys):
        viewer = open_viewer(Spoilt(), fps=200)
        seen = []
        while len(seen) < 5:
            viewer.step()
            if not seen or viewer.frame is not seen[-1]:
                seen.append(viewer.frame)
        first, _, last = Spoilt.frames
        assert seen == [first, last, first, last, first]
        assert capsys.readouterr().err == "warning: skipped: frame 1 is broken\n"
        assert "frame 1 is broken" in viewer.messages.text

    def test_space_pauses_and_the_arrows_step(self, open_viewer):
        first, _, last = Spoilt.frames
        viewer = open_viewer(Spoilt(), fps=500)
        press(viewer, "SPACE")
        while viewer.frame is not last:
            press(viewer, "RIGHT")
        press(viewer, "LEFT")
        assert viewer.frame is first
        viewer.step(wait=False)
        assert viewer.document.playback.players[0].patience(0) is None
        press(viewer, "SPACE")
        while viewer.frame is first:
            viewer.step()
        assert viewer.frame is last

    def test_any_iterable_is_a_stream_and_its_end_leaves_the_last_frame(self, open_viewer):
        viewer = open_viewer(iter([frames.sphere(), frames.step()]))
        last = None
        while (
            viewer.document.playback.players[0]._thread.is_alive()
            or not viewer.document.playback.players[0]._queue.empty()
        ):
            viewer.step(wait=False)
            last = viewer.frame
        assert last.depth[0, 0] == pytest.approx(1.2)

    def test_what_a_stream_raises_otherwise_ends_the_viewer(self, open_viewer):
        def camera():
            yield frames.sphere()
            raise RuntimeError("unplugged")

        with pytest.raises(RuntimeError, match="unplugged"):
            Viewer(camera(), window_size=(64, 48)).run()

    def test_a_source_without_frames_is_said(self, display):
        with pytest.raises(ValueError, match="no frame"):
            Viewer(iter([]))

    def test_a_film_of_what_is_seen_is_written(self, tmp_path):
        viewer = Viewer(frames.sphere(), window_size=(64, 48), record=tmp_path / "film.gif", fps=100)
        while viewer.recorder._written < 5:
            viewer.step()
        viewer.window.glfw.set_window_size(viewer.window.handle, 100, 90)
        while viewer.recorder._written < 10:
            viewer.step()
        viewer.release()
        with Image.open(tmp_path / "film.gif") as film:
            assert film.size == (64, 48)
