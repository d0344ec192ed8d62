"""Keeps frames on the GPU: each is uploaded once, with its normals; and the history of filtered streams."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import moderngl

from ...estimation.noise_model import STAR_GAIN, Decisions
from ...notes.notes import print_note
from ...notes.words import option
from ...scene.appearance import Appearance
from ...scene.camera import Camera
from ...scene.frame import Frame
from ...scene.noise import Choice, Noise, parse_max_depth_step, parse_noise
from ...scene.visible import bridged_camera
from ..core.frame_textures import Colors, DepthTextures, FrameTextures, LargePoints, PointSurface
from ..core.images import Image, Owner
from ..core.steps import Steps
from ..shading.occlusion import VisibilityPass
from .noise_measurement import Stream, StreamHistory, TemporalPass
from .source_colors import SourceColors
from .surface_normals import Estimator, SurfacePass

if TYPE_CHECKING:
    from .refinement import CalmNormalsPass, CompletionPass, HiddenPlanesPass, UpsamplePass


SEEN_TILT = 0.01  # radians: noise that tilts normals by less changes no light by more than a hundredth


class Streams(Owner):
    """Keeps the streams, each known by its place among the point objects of a scene."""

    def __init__(self, context: moderngl.Context, steps: Steps):
        super().__init__(context)
        self._histories: dict[int, StreamHistory] = {}
        self._temporal = self._keep(TemporalPass(context, steps))

    def stream_of(self, frame: Frame, place: int) -> Stream:
        """Return the stream at a place, with its next frame."""
        if place not in self._histories:
            self._histories[place] = StreamHistory(self._context)
        return Stream(self._temporal, self._histories[place], frame)

    def keep_only(self, places: Iterable[int]) -> None:
        """Free the history of all other streams."""
        for place in self._histories.keys() - set(places):
            self._histories.pop(place).release()

    def release(self) -> None:
        self.keep_only(())
        super().release()


BEYOND = 2.0  # times the farthest depth: where the photograph is seen that has no surface
NOTED_SHARE = 1e-4  # share of the pixels from which on it is worth a note


class DrawnPoints(NamedTuple):
    """A frame's points as they are drawn, and the camera that saw them at their size."""

    surface: PointSurface
    lit: Image
    camera: Camera
    colors: Colors


class FrameStore(Owner):
    """Keeps the textures of the frames in use.

    choice   which method estimated the last normals, and why
    colors   of the points of frames
    streams  those that are filtered over time
    """

    def __init__(self, context: moderngl.Context, steps: Steps):
        super().__init__(context)
        self._steps = steps
        self._surface, self._visibility = self._keep(SurfacePass(context)), self._keep(VisibilityPass(context))
        self.colors = self._keep(SourceColors(context, steps))
        self.streams = self._keep(Streams(context, steps))
        self._kept: list[FrameTextures] = []
        self.choice: Choice | None = None
        self._decisions = Decisions()
        self._noted: set[Hashable] = set()  # the streams of which a note was given

    @cached_property
    def _upsample(self) -> UpsamplePass:
        from .refinement import UpsamplePass  # only here

        return self._keep(UpsamplePass(self._context, self._surface))

    @cached_property
    def _completion(self) -> CompletionPass:
        from .refinement import CompletionPass  # only here

        return self._keep(CompletionPass(self._context))

    @cached_property
    def _calm(self) -> CalmNormalsPass:
        from .refinement import CalmNormalsPass  # only here

        return self._keep(CalmNormalsPass(self._context))

    @cached_property
    def _bridge(self) -> HiddenPlanesPass:
        from .refinement import HiddenPlanesPass  # only here

        return self._keep(HiddenPlanesPass(self._context))

    def upload(self, frames: list[Frame]) -> list[FrameTextures]:
        """Return the textures of each frame, twice for one that comes twice. All others are reused or freed."""
        known: dict[Frame | None, list[FrameTextures]] = {}
        for textures in self._kept:
            known.setdefault(textures.frame, []).append(textures)
        found = [known[frame].pop(0) if known.get(frame) else None for frame in frames]
        free = [textures for rest in known.values() for textures in rest]
        wanted: list[FrameTextures] = []
        drawn = Counter(frame.source for frame in set(frames)) if len(frames) > 1 else {}
        for frame, textures in zip(frames, found, strict=True):
            textures = textures or next((one for one in free if one.fits(frame)), None)
            if textures is None:
                textures = FrameTextures(self._context, frame)
                self._kept.append(textures)
            elif textures in free:
                free.remove(textures)
            textures.is_next = frame.source is not None and drawn.get(frame.source, 1) == 1  # together they are no film
            wanted.append(textures)
            self._steps.run("upload", wanted[-1].upload, frame, of=wanted[-1])
        for textures in free:
            self._kept.remove(textures)
            self._steps.forget(of=textures.images)
            textures.release()
        return wanted

    def find_normals(self, textures: FrameTextures, frame: Frame, look: Appearance, place: int = 0) -> None:
        """Write the surface of a frame's points, with estimated normals or the caller's own.

        place  which of the streams the frame belongs to, if it is filtered over time
        """
        if estimator := _estimator(frame, look):
            stream = self.streams.stream_of(frame, place) if look.temporal else None
            inputs = textures, frame.camera, estimator, stream, self._decisions if textures.is_next else None
            textures.choice = self._steps.run("surface", self._surface.run, *inputs, of=textures)
            if stream and textures.choice.method != "adaptive":
                stream.history.forget()  # it was not filtered
            if look.normals == "auto" and frame.is_sparse:
                textures.choice = replace(textures.choice, missing=1 - frame.points_known / frame.depth.size)
        else:
            self._steps.run("surface", self._surface.write, textures, frame.camera, look.normals, of=textures)
            textures.choice = Choice("the caller's")
        self.choice = textures.choice

    def measure_noise(self, depth: DepthTextures, camera: Camera) -> Noise:
        """Measure the noise of a depth texture that belongs to no frame: frames are measured with their normals."""
        return self._surface.measure_noise(depth, camera)

    def find_points(
        self, textures: FrameTextures, frame: Frame, look: Appearance, camera: Camera, place: int = 0
    ) -> DrawnPoints:
        """Return a frame's points with their normals, at the size of `camera`, which is the frame's own, resized."""
        self.find_normals(textures, frame, look, place)
        points = textures.surface, textures.lit
        if camera != frame.camera:
            large = self._fit(textures, "large", (camera.width, camera.height))
            inputs = textures, textures.surface, frame.camera, _estimator(frame, look)
            self._steps.run("upsample", self._upsample.run, *inputs, large.surface, of=textures)
            points = large.surface, large.lit
        return DrawnPoints(*points, camera, self.colors.find(textures, frame, look, points[0], camera))

    def complete(self, textures: FrameTextures, frame: Frame, points: DrawnPoints, photo: bool = False) -> DrawnPoints:
        """Return the points of `find_points`, and surfaces where depth is missing; the same points if none is.

        photo  whether points far behind all others show the photograph where no surface is found
        """
        if frame.points_known == frame.depth.size:
            return points
        completed = self._fit(textures, "completed", points.surface.size)
        inputs = textures, points.surface, points.camera, completed.surface
        beyond = BEYOND * frame.depth_range[1] if photo else 0.0
        found = self._steps.run("completion", self._complete, *inputs, beyond, of=textures)
        textures.choice = replace(textures.choice, completed=found)
        return points._replace(surface=completed.surface, lit=completed.lit)

    def _complete(self, textures: FrameTextures, *inputs: Any) -> float:
        """Return the share of the pixels that are completed, and tell it: once of each stream."""
        completed, left = self._completion.run(textures, *inputs)
        source = textures.source
        if completed >= NOTED_SHARE and source not in self._noted:
            empty = f", {100 * left:.2g} % stay empty" if left >= NOTED_SHARE else ""
            keeps = f"{option('missing', 'keep')} shows what was measured"
            what = f"{100 * completed:.2g} % of the pixels have no depth and are completed"
            print_note(f"{what} from those around{empty}: {keeps}")
            self._noted.add(source)
        return completed

    def calm(self, textures: FrameTextures, points: DrawnPoints, noise: Noise) -> DrawnPoints:
        """Return points whose normals are calm, for light; the same points if their normals are sure."""
        surface = points.surface
        if noise.is_clean or surface.certainty is None:
            return points
        if not noise.bumps and STAR_GAIN * noise.relative * points.camera.fx < SEEN_TILT:
            return points
        calm = self._fit(textures, "calm", surface.size)
        inputs = textures, surface, points.camera, noise, calm.surface
        wrong = self._steps.run("calm", self._calm.run, *inputs, of=textures)
        self.choice = textures.choice = replace(textures.choice, calm=True, wrong=wrong)
        return points._replace(surface=calm.surface, lit=calm.lit)

    def bridge(self, textures: FrameTextures, points: DrawnPoints) -> PointSurface:
        """Return what the points hide and what continues behind them, at the size of their `bridged_camera`."""
        camera = bridged_camera(points.camera)
        bridged = self._fit(textures, "bridged", (camera.width, camera.height)).surface
        self._steps.run("bridge", self._bridge.run, points.surface, points.camera, bridged, of=textures)
        return bridged

    def find_visibility(self, textures: FrameTextures, points: DrawnPoints, radius: float) -> Image:
        """Return what the points see of the light from all around. radius: of what may hide it, in the frame's unit."""
        inputs = points.surface, points.camera, radius, points.surface.visibility
        self._steps.run("visibility", self._visibility.run, *inputs, of=textures)
        return points.surface.visibility

    def _fit(
        self, textures: FrameTextures, name: Literal["large", "completed", "calm", "bridged"], size: tuple[int, int]
    ) -> LargePoints:
        points: LargePoints | None = getattr(textures, name)
        if points is None or points.size != size:
            if points is not None:
                self._steps.forget(of=points.images)
                points.release()
            setattr(textures, name, None)  # stays so when the new one does not fit the GPU
            points = LargePoints(self._context, size)
            setattr(textures, name, points)
        return points

    def release(self) -> None:
        while self._kept:
            self._kept.pop().release()
        super().release()


def _estimator(frame: Frame, look: Appearance) -> Estimator | None:
    """What estimates the normals, as `SurfacePass.run` takes it; None for the caller's own."""
    if not isinstance(look.normals, str):
        return None
    method = "sparse" if look.normals == "auto" and frame.is_sparse else look.normals
    return method, parse_max_depth_step(look.max_depth_step), parse_noise(look.noise, frame.depth), look.flying
