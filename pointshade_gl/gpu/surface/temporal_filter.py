"""Averages the depth and the normals of a stream's frames over time, where the surface has not changed."""

from __future__ import annotations

import weakref
from typing import NamedTuple

import moderngl
import numpy as np

from ...estimation.noise_model import Decisions
from ...scene.camera import Camera
from ...scene.frame import Frame
from ...scene.noise import Noise
from ..core.frame_textures import PointSurface
from ..core.images import RG32F, RGBA32F, Fitted, Image, Images, empty
from ..core.passes import FullscreenPasses
from ..core.steps import Steps


class Stream(NamedTuple):
    """The next frame of a stream, the filter, and what earlier frames have left."""

    temporal: TemporalPass
    history: History
    frame: Frame


class TemporalPass(FullscreenPasses):
    """Warps the history of a stream into the new frame's camera, compares, and mixes: see common/temporal.glsl.

    It takes 24 bytes a pixel of the largest frame, and each history 32 bytes a pixel.
    """

    def __init__(self, context: moderngl.Context, steps: Steps):
        super().__init__(context)
        self._steps = steps
        self._change = self._keep(Fitted(context, Image, RG32F, RGBA32F))  # and the old normals in its axes

    def filter_depth(self, picture: moderngl.Texture, noise: Noise, stream: Stream, camera: Camera) -> moderngl.Texture:
        """Average depth over time. Takes and returns depth with its noise as depth_average.frag writes them.

        The noise stays that of one frame, so that normals are estimated as before: their lower noise shows as less
        flicker, and no decision changes.
        """
        return self._steps.always("temporal", self._filter_depth, picture, noise, stream, camera)

    def filter_normals(self, surface: PointSurface, stream: Stream, camera: Camera) -> None:
        """Average the surface's normals with those remembered: at creases they flip even where depth hardly changes."""
        self._steps.always("temporal normals", self._filter_normals, surface, stream, camera)

    def _filter_depth(
        self, picture: moderngl.Texture, noise: Noise, stream: Stream, camera: Camera
    ) -> moderngl.Texture:
        history, change = stream.history.fit(picture.size), self._change.fit(picture.size)
        view = stream.history.view_from(stream.frame, camera)
        rounding = noise.step, noise.powers[1]
        if view is None:
            empty(change.target)
        else:
            maps = {"picture": picture, "history_map": history.depth.texture, "normal_map": history.normals.texture}
            moved = not np.array_equal(view, np.eye(4))
            way = {"intrinsics": camera.intrinsics, "view": view.T.astype("f4").tobytes()} if moved else {}
            compare = self.fullscreen("surface/temporal_change.frag", MOVED=int(moved))
            compare.draw(change.target, maps, rounding=rounding, **way)
        maps = {"picture": picture, "change_map": change.texture}
        mix = self.fullscreen("surface/temporal_depth.frag")
        mix.draw(history.depth.target, maps, intrinsics=camera.intrinsics, rounding=rounding)
        return history.depth.textures[1]

    def _filter_normals(self, surface: PointSurface, stream: Stream, camera: Camera) -> None:
        history, change = stream.history.fit(surface.size), self._change.fit(surface.size)
        maps = {"surface_map": surface.texture, "history_map": history.depth.texture}
        maps |= {"old_normal_map": change.textures[1]}
        mix = self.fullscreen("surface/temporal_normals.frag")
        mix.draw(history.normals.target, maps, intrinsics=camera.intrinsics)
        self._context.copy_framebuffer(surface.target, history.normals.target)
        stream.history.remember(stream.frame, camera)


class History:
    """What the frames of one stream have left on the GPU, with the camera and pose of the last one.

    decisions  which noise estimate the stream uses
    """

    def __init__(self, context: moderngl.Context):
        self._context = context
        self.decisions = Decisions()
        self._image: HistoryImage | None = None
        self._last: tuple[weakref.ref[Frame], Camera, np.ndarray] | None = None

    def fit(self, size: tuple[int, int]) -> HistoryImage:
        """Return the images, emptied if the size has changed."""
        if self._image is None or self._image.size != size:
            self.release()
            self._image = HistoryImage(self._context, size)
        return self._image

    def view_from(self, frame: Frame, camera: Camera) -> np.ndarray | None:
        """Return (4, 4) from the axes of a frame's camera to those of the last frame's; the identity if neither has
        moved.

        None if nothing can be used: after another camera, and where the frame has been filtered before.
        """
        if self._last is None or self._last[0]() is frame or self._last[1] != camera:
            return None
        pose = self._last[2]
        return np.eye(4) if np.array_equal(pose, frame.pose) else np.linalg.inv(pose) @ frame.pose

    def remember(self, frame: Frame, camera: Camera) -> None:
        """Note that the images now include this frame."""
        self._last = weakref.ref(frame), camera, frame.pose

    def forget(self) -> None:
        """Start the stream anew."""
        self._last = None
        self.decisions = Decisions()

    def release(self) -> None:
        self.forget()
        if self._image is not None:
            self._image.release()
        self._image = None


class HistoryImage(Images):
    """What is remembered.

    depth    depth, noise of the last frame, noise that is left, share of the last frame; noise over depth;
             and depth and noise of the last frame once more, as estimators read them
    normals  unit normal and depth, as in PointSurface
    """

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        self.depth = self._keep(Image(context, size, RGBA32F, RG32F))
        self.normals = self._keep(Image(context, size))
