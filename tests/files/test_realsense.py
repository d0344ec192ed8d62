"""A RealSense camera, replaced by an object that behaves like pyrealsense2."""

import sys
from contextlib import closing
from types import SimpleNamespace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.frame_sources import prefetched
from pointshade_gl.files.live import RealSenseSource

COLOR = np.random.default_rng(1).integers(0, 256, (3, 4, 3), np.uint8)
DEPTH = np.array([[0, 1000, 2000, 3000]] * 3, np.uint16)


class Sdk:
    """Module, configuration and pipeline in one: records what it is asked for."""

    stream = SimpleNamespace(depth="depth", color="color")
    format = SimpleNamespace(z16="z16", rgb8="rgb8")

    def __init__(self, fails_to_start=False, late=()):
        self.asked, self.fails_to_start, self.late, self.given = [], fails_to_start, late, 0

    def config(self):
        return SimpleNamespace(
            enable_stream=lambda *stream: self.asked.append(stream),
        )

    def pipeline(self):
        return SimpleNamespace(start=self.start, wait_for_frames=self.wait, stop=lambda: self.asked.append("stop"))

    def start(self, config):
        if self.fails_to_start:
            raise RuntimeError("No device connected")
        seen = SimpleNamespace(fx=5.0, fy=6.0, ppx=1.5, ppy=1.0, width=4, height=3)
        stream = SimpleNamespace(as_video_stream_profile=lambda: SimpleNamespace(get_intrinsics=lambda: seen))
        sensor = SimpleNamespace(get_depth_scale=lambda: 0.0005)
        device = SimpleNamespace(first_depth_sensor=lambda: sensor)
        return SimpleNamespace(get_device=lambda: device, get_stream={"color": stream}.__getitem__)

    def align(self, to):
        assert to == "color"
        return SimpleNamespace(process=lambda pictures: pictures | {"aligned": True})

    def wait(self):
        self.given += 1
        if self.given in self.late:
            raise RuntimeError("Frame didn't arrive within 5000")
        return Pictures(depth=DEPTH + np.uint16(self.given), color=COLOR)


class Pictures(dict):
    def __or__(self, other):
        return Pictures({**self, **other})

    def get_depth_frame(self):
        assert self["aligned"]
        return SimpleNamespace(get_data=lambda: self["depth"])

    def get_color_frame(self):
        return SimpleNamespace(get_data=lambda: self["color"])


def test_frames_have_the_cameras_own_intrinsics_and_metres():
    with closing(RealSenseSource(sdk=Sdk())) as source:
        first, second = next(source), next(source)
    assert first.camera == ps.Camera(5, 6, 1.5, 1, 4, 3)
    np.testing.assert_array_equal(first.color, COLOR)
    np.testing.assert_allclose(first.depth, (DEPTH + 1) * 0.0005, rtol=1e-6)
    np.testing.assert_allclose(second.depth, (DEPTH + 2) * 0.0005, rtol=1e-6)


def test_what_is_asked_of_the_camera_and_that_it_is_stopped():
    sdk = Sdk()
    RealSenseSource((848, 480), 60, sdk).close()
    streams = [("depth", 848, 480, "z16", 60), ("color", 848, 480, "rgb8", 60)]
    assert sdk.asked == [*streams, "stop"]


def test_a_late_frame_is_skipped_and_the_stream_goes_on():
    told = []
    with closing(RealSenseSource(sdk=Sdk(late=(2,)))) as source:
        frames = prefetched(source, told.append)
        depths = [next(frames).depth[0, 0] for _ in range(3)]
        frames.close()
    np.testing.assert_allclose(depths, [0.0005, 0.0015, 0.002], rtol=1e-5)
    assert told == ["the RealSense camera gave no frame: Frame didn't arrive within 5000"]


def test_no_camera_is_one_sentence():
    with pytest.raises(OSError, match="no RealSense camera gives 640x480 at 30 fps: No device connected"):
        RealSenseSource(sdk=Sdk(fails_to_start=True))


def test_without_the_extra_it_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyrealsense2", None)
    with pytest.raises(ValueError, match=r"pip install '\.\[realsense\]' in the clone"):
        RealSenseSource()
