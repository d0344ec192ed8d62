"""Frames on the GPU: uploaded once, with the normals that were asked for."""

from __future__ import annotations

import moderngl

from ..estimators import parse_max_depth_step
from ..frame import Frame
from ..look import Look
from ..noise import Choice, parse_noise
from .steps import Steps
from .surface import SurfacePass
from .textures import FrameTextures


class FrameStore:
    """Keeps the textures of the frames in use.

    choice  what estimated the last normals, and why
    """

    def __init__(self, context: moderngl.Context, steps: Steps):
        self._context, self._steps = context, steps
        self._surface = SurfacePass(context)
        self._kept: list[FrameTextures] = []
        self.choice: Choice | None = None

    def upload(self, frames: list[Frame]) -> list[FrameTextures]:
        """The textures of each frame. Those that belong to no frame in use are reused, or freed."""
        free = [kept for kept in self._kept if not any(kept.frame is frame for frame in frames)]
        wanted: list[FrameTextures] = []
        for frame in frames:
            kept = next((one for one in self._kept if one.frame is frame and one not in wanted), None)
            kept = kept or next((one for one in free if one.fits(frame)), None)
            if kept in free:
                free.remove(kept)
            wanted.append(self._add(frame) if kept is None else kept)
            self._steps.run("upload", wanted[-1].upload, frame, of=wanted[-1])
        for one in free:
            self._kept.remove(one)
            self._steps.forget(of=one)
            one.release()
        return wanted

    def find_normals(self, textures: FrameTextures, frame: Frame, look: Look) -> None:
        """The surface at the frame's points: normals by an estimator, or the caller's own."""
        if isinstance(look.normals, str):
            options = look.normals, parse_max_depth_step(look.max_depth_step), parse_noise(look.noise, frame.depth)
            run = self._surface.run
            self.choice = self._steps.run("surface", run, textures, frame.camera, *options, of=textures)
        else:
            self._steps.run("surface", textures.surface.write, look.normals, frame.depth, of=textures)
            self.choice = Choice("the caller's")

    def _add(self, frame: Frame) -> FrameTextures:
        self._kept.append(FrameTextures(self._context, frame))
        return self._kept[-1]

    def release(self) -> None:
        for item in (*self._kept, self._surface):
            item.release()
