"""Streams frames from an Intel RealSense camera: `for frame in RealSenseSource():`."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from typing import Any

import numpy as np

from ..scene.camera import Camera
from ..scene.frame import Frame


class RealSenseSource(Iterator[Frame]):
    """The frames of an Intel RealSense camera from now on, without end; depth is aligned to the colour picture.

    Close it after use.

    Parameters
    ----------
    size : (2,) int
        Width and height of depth and colour, pixels; the camera must offer them at this fps.
    fps : int
        Pictures per second.
    sdk : module, optional
        The module pyrealsense2, or an object that behaves like it; None imports it.

    Attributes
    ----------
    camera : Camera
        Camera of all frames.

    Raises
    ------
    ValueError
        Without the extra `realsense`.
    OSError
        If no camera answers, and for a frame that does not come in time; the next one may come again.
    """

    def __init__(self, size: tuple[int, int] = (640, 480), fps: int = 30, sdk: Any = None):
        try:
            rs: Any = sdk or import_module("pyrealsense2")
        except ImportError:
            raise ValueError("a RealSense camera needs pyrealsense2: pip install 'pointshade-gl[realsense]'") from None
        config, self._pipeline = rs.config(), rs.pipeline()
        config.enable_stream(rs.stream.depth, *size, rs.format.z16, fps)
        config.enable_stream(rs.stream.color, *size, rs.format.rgb8, fps)
        try:
            profile = self._pipeline.start(config)
        except RuntimeError as error:
            raise OSError(f"no RealSense camera gives {size[0]}x{size[1]} at {fps} fps: {error}") from None
        self._stream = object()  # what its frames have in common
        self._align = rs.align(rs.stream.color)
        self._metres = np.float32(profile.get_device().first_depth_sensor().get_depth_scale())
        seen = profile.get_stream(rs.stream.color).as_video_stream_profile().get_intrinsics()
        self.camera = Camera(seen.fx, seen.fy, seen.ppx, seen.ppy, seen.width, seen.height)

    def __next__(self) -> Frame:
        try:
            pictures = self._align.process(self._pipeline.wait_for_frames())
        except RuntimeError as error:
            raise OSError(f"the RealSense camera gave no frame: {error}") from None
        depth = np.asanyarray(pictures.get_depth_frame().get_data()) * self._metres
        color = np.asanyarray(pictures.get_color_frame().get_data())
        return Frame(color, depth, self.camera, source=self._stream)

    def close(self) -> None:
        """Stop the camera."""
        self._pipeline.stop()
