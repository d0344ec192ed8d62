"""Temporal pass: the surface of a stream's frames is averaged over time, where neither scene nor view has changed it."""

from __future__ import annotations

import weakref
from typing import NamedTuple

import moderngl
import numpy as np

from ..camera import Camera
from ..frame import Frame
from ..noise import Noise
from .memory import Owner
from .passes import FullscreenPass, data_texture
from .steps import Steps
from .textures import PointSurface


class TemporalPass(Owner):
    """Compares averaged depth with what a history holds, and mixes the two; then the normals."""

    def __init__(self, context: moderngl.Context, steps: Steps):
        super().__init__(context)
        self._steps = steps
        self._passes: dict[str, FullscreenPass] = {}
        self._change: ChangeImage | None = None

    def filter_depth(self, picture: moderngl.Texture, stream: Stream, camera: Camera, noise: Noise) -> moderngl.Texture:
        return self._steps.always("temporal", self._filter_depth, picture, stream, camera, noise)

    def _filter_depth(self, picture: moderngl.Texture, stream: Stream, camera: Camera, noise: Noise) -> moderngl.Texture:
        history, frame = stream
        rounding = noise.step, noise.powers[1]
        view = history.view_of(frame, camera, picture.size)
        change = self._fit(picture.size)
        if view is None:
            change.target.clear(0.0, -1.0)
        else:
            moved = not np.array_equal(view, np.eye(4))
            extra = {"intrinsics": camera.intrinsics, "view": view.T.astype("f4").tobytes()} if moved else {}
            maps = {"picture": picture, "history_map": history.image.depth, "normal_map": history.image.normals}
            self._pass("temporal_change.frag", MOVED=int(moved)).draw(change.target, maps, rounding=rounding, **extra)
        maps = {"picture": picture, "change_map": change.change}
        self._pass("temporal_depth.frag").draw(history.image.depth_target, maps, intrinsics=camera.intrinsics, rounding=rounding)
        return history.image.depth

    def filter_normals(self, surface: PointSurface, stream: Stream, camera: Camera) -> None:
        self._steps.always("temporal normals", self._filter_normals, surface, stream, camera)

    def _filter_normals(self, surface: PointSurface, stream: Stream, camera: Camera) -> None:
        history, frame = stream
        if history.is_known:
            maps = {"surface_map": surface.texture, "old_normal_map": self._change.normals, "history_map": history.image.depth}
            self._pass("temporal_normals.frag").draw(history.image.normal_target, maps, intrinsics=camera.intrinsics)
            self._context.copy_framebuffer(surface.target, history.image.normal_target)
        else:
            self._context.copy_framebuffer(history.image.normal_target, surface.target)
        history.keep(frame, camera)

    def _pass(self, fragment: str, **constants: int) -> FullscreenPass:
        key = f"{fragment} {constants}"
        if key not in self._passes:
            self._passes[key] = self._keep(FullscreenPass(self._context, fragment, **constants))
        return self._passes[key]

    def _fit(self, size) -> ChangeImage:
        if self._change is None or self._change.size != size:
            if self._change is not None:
                self._change.release()
            self._change = None
            self._change = ChangeImage(self._context, size)
        return self._change

    def release(self) -> None:
        if self._change is not None:
            self._change.release()
        super().release()


class ChangeImage(Owner):
    def __init__(self, context, size):
        super().__init__(context)
        self.size = size
        with self._all_or_nothing():
            self.change = self._keep(data_texture(context, *size, 2))
            self.normals = self._keep(data_texture(context, *size, 4))
            self.target = self._allocate(context.framebuffer, [self.change, self.normals])


class HistoryImage(Owner):
    def __init__(self, context, size):
        super().__init__(context)
        self.size = size
        with self._all_or_nothing():
            self.depth = self._keep(data_texture(context, *size, 4))
            self.normals = self._keep(data_texture(context, *size, 4))
            self.depth_target = self._allocate(context.framebuffer, [self.depth])
            self.normal_target = self._allocate(context.framebuffer, [self.normals])


class History:
    def __init__(self, temporal: TemporalPass, context):
        self.temporal, self._context = temporal, context
        self.image: HistoryImage | None = None
        self._last = None

    def view_of(self, frame, camera, size):
        if self.image is None or self.image.size != size:
            self.release()
            self.image = HistoryImage(self._context, size)
        if self._last is None or self._last[0]() is frame or self._last[1] != camera:
            self._last = None
            return None
        if np.array_equal(self._last[2], frame.pose):
            return np.eye(4)
        return np.linalg.inv(self._last[2]) @ frame.pose

    @property
    def is_known(self):
        return self._last is not None

    def keep(self, frame, camera):
        self._last = weakref.ref(frame), camera, frame.pose

    def forget(self):
        self._last = None

    def release(self):
        self._last = None
        if self.image is not None:
            self.image.release()
        self.image = None


class Stream(NamedTuple):
    history: History
    frame: Frame
