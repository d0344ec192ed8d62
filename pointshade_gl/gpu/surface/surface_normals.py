"""Surface pass: turns a depth texture into a surface texture of normals and depth, also where depth is sparse."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import moderngl
import numpy as np

from ...scene.camera import Camera
from ...scene.noise import PLANE_FITS, SPARSE_LEVELS, SPARSE_TILTS, TRIANGLES, Choice, Noise, NoiseWords, Step
from ..context.caller_state import DEPTH_TEST, enabled
from ..core.frame_textures import DepthTextures
from ..core.images import Fitted, Image, Images, empty
from ..core.programs import FullscreenPasses
from .noise_measurement import NoisePass, Stream

if TYPE_CHECKING:
    from ...estimation.noise_model import Decisions

GivenNoise = np.ndarray | NoiseWords | None  # the caller's noise, (1, 1) or (h, w) metres or in words; None measures it
Estimator = tuple[str, Step, GivenNoise, str]  # method, beyond which step a neighbour is another surface, noise, flying


class SurfacePass(FullscreenPasses):
    """Writes unit normals, source axes, towards the camera; (0, 0, 0) where depth is missing.

    Shaders are compiled when an estimator is first used.
    """

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._scratch = self._keep(Fitted(context, Image))  # normal and residual, or the caller's normals
        self._noise, self._sparse = self._keep(NoisePass(context)), self._keep(SparsePass(context))

    def run(
        self, frame: DepthTextures, camera: Camera, estimator: Estimator, stream: Stream | None = None,
        decisions: Decisions | None = None,
    ) -> Choice:  # fmt: skip
        """Estimate the normals of a frame. Returns which method ran, and for "auto" and "adaptive" why.

        stream     if noisy depth is filtered over time
        decisions  of all streams, if the frame is the next of one; else it has its own noise
        """
        method, max_step, noise, flying = estimator
        frame.surface.raise_version()
        frame.surface.certainty = None
        if method in ("auto", "adaptive"):
            decisions = stream.history.decisions if stream else decisions
            return self._run_by_noise(frame, camera, method, noise, flying == "snap", stream, decisions)
        target, inputs = frame.surface.target, {"depth_map": frame.depth, "intrinsics": camera.intrinsics}
        if method in TRIANGLES:
            inputs |= {"triangle_count": TRIANGLES[method], "max_step": max_step}
            self.fullscreen("surface/normals_triangles.frag").draw(target, {}, **inputs)
        elif method in PLANE_FITS:
            self.fullscreen("surface/normals_plane_fit.frag", WINDOW=PLANE_FITS[method]).draw(target, {}, **inputs)
        elif method == "sparse":
            self._sparse.run(frame, camera)
        elif method == "star-borrow":
            scratch = self._scratch.fit(frame.size)
            self.fullscreen("surface/normals_star.frag", RESIDUAL=1).draw(scratch.target, {}, **inputs)
            self.fullscreen("surface/normals_borrow.frag").draw(target, {"normal_map": scratch.texture}, **inputs)
        else:
            self.fullscreen(f"surface/normals_{method.replace('-', '_')}.frag").draw(target, {}, **inputs)
        return Choice(method)

    def write(self, frame: DepthTextures, camera: Camera, normals: np.ndarray) -> None:
        """Write the caller's own normals (h, w, 3) float32, (0, 0, 0) where missing."""
        frame.surface.raise_version()
        frame.surface.certainty = None
        scratch = self._scratch.fit(frame.size)
        scratch.texture.write(np.concatenate([normals, np.zeros_like(normals[..., :1])], -1))
        maps = {"normal_map": scratch.texture, "depth_map": frame.depth}
        self.fullscreen("surface/normals_given.frag").draw(frame.surface.target, maps, intrinsics=camera.intrinsics)

    def measure_noise(self, frame: DepthTextures, camera: Camera) -> Noise:
        """Measure the noise, as "auto" and "adaptive" do. camera: that took the depth."""
        noise = self._noise.measure(frame, _mean_focal(camera))
        if not noise.may_be_bumpy:
            return noise
        from ...estimation.noise_model import find_bumps  # only here

        return replace(noise, bumps=find_bumps(self._bumpy.measure(frame), noise))

    def _find_noise(
        self, frame: DepthTextures, camera: Camera, words: NoiseWords | None, decisions: Decisions | None
    ) -> Noise:
        """Return the noise that the caller has described, or the frame's: of a stream, one estimate for all."""
        if words:
            return self._noise.read(frame, words)
        if frame.noise:
            return frame.noise
        noise = self.measure_noise(frame, camera)
        return decisions.settle((frame.source, frame.size), noise) if decisions else noise

    def _run_by_noise(
        self, frame: DepthTextures, camera: Camera, method: str, given: GivenNoise, snap: bool, stream: Stream | None,
        decisions: Decisions | None,
    ) -> Choice:  # fmt: skip
        is_given = given is not None
        words, levels = (given, None) if isinstance(given, NoiseWords) else (None, given)
        noise = self._find_noise(frame, camera, words, decisions)
        if method == "auto" and levels is None and noise.is_clean:
            star, source = self.fullscreen("surface/normals_star.frag"), {"depth_map": frame.depth}
            star.draw(frame.surface.target, source, intrinsics=camera.intrinsics)
            return Choice("star", noise, is_given)
        calm = self._noise.calm_depth(frame, noise, levels, _mean_focal(camera) if snap else 0.0)
        if stream:
            calm = stream.temporal.filter_depth(calm, noise, stream, camera)
        self._fit_planes(frame, calm, noise, camera, noise.bumps if levels is None else 0.0)
        if stream:
            stream.temporal.filter_normals(frame.surface, stream, camera)
        frame.surface.certainty = self._noise.find_certainty(frame.surface, noise, camera)
        return Choice("adaptive", noise, is_given)

    def _fit_planes(
        self, frame: DepthTextures, calm: moderngl.Texture, noise: Noise, camera: Camera, bumps: float
    ) -> None:
        """Fit planes, as wide as the noise requires, to the depth of `NoisePass.calm_depth`."""
        surface = frame.surface
        inputs = {"calm_depth": calm, "intrinsics": camera.intrinsics}
        if bumps:
            inputs |= self._bumpy.find(frame, bumps)
        empty(surface.staged_target, surface.window)
        with enabled(self._context, DEPTH_TEST):
            if bumps:
                self.fullscreen("surface/normals_bumpy.frag").draw(surface.staged_target, {}, **inputs, bumps=bumps)
            elif noise.is_rounded:
                self._flat.run(frame, noise, camera)
            for stage in range(4):
                adaptive = self.fullscreen("surface/normals_adaptive.frag", STAGE=stage, BUMPY=int(bumps > 0))
                adaptive.draw(surface.staged_target, {}, **inputs)

    @cached_property
    def _flat(self) -> FlatCellsPass:
        return self._keep(FlatCellsPass(self._context))

    @cached_property
    def _bumpy(self) -> BumpyPlanesPass:
        return self._keep(BumpyPlanesPass(self._context))


def _mean_focal(camera: Camera) -> float:
    """Pixels."""
    return (abs(camera.fx) + abs(camera.fy)) / 2


CELLS, NORMALS = "surface/sparse_cells.frag", "surface/normals_sparse.frag"


class SparsePass(FullscreenPasses):
    """Writes the surface of a frame, see shaders/common/normals_sparse.glsl."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._images = self._keep(Fitted(context, CellImages))

    def run(self, frame: DepthTextures, camera: Camera) -> None:
        images = self._images.fit(frame.size)
        first, join = self.fullscreen(CELLS, FROM_DEPTH=1), self.fullscreen(CELLS)
        first.draw(images.levels[0].target, {"finer": frame.depth})
        for finer, coarser in zip(images.levels, images.levels[1:], strict=False):
            join.draw(coarser.target, {"finer": finer.texture})
        answer, rest = self.fullscreen(NORMALS), self.fullscreen(NORMALS, REST=1)
        target, common = frame.surface.staged_target, {"depth_map": frame.depth, "intrinsics": camera.intrinsics}
        empty(target, frame.surface.window)
        with enabled(self._context, DEPTH_TEST):
            for tilt in SPARSE_TILTS:
                for level, cells in enumerate(images.levels, 1):
                    answer.draw(target, {"cells": cells.texture}, level=level, tilt=tilt, **common)
            rest.draw(target, {}, **common)


class CellImages(Images):
    """The cells of one size of frame, from 2x2 pixels on: each level half as many a side as the one before.

    See shaders/common/sparse_cells.glsl.
    """

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        sizes = [(-(-size[0] >> k), -(-size[1] >> k)) for k in range(1, SPARSE_LEVELS + 1)]
        self.levels = [self._keep(Image(context, one)) for one in sizes]


class BumpyPlanesPass(FullscreenPasses):
    """Fits a plane to a wide window around each cell; cells get the planes on which windows agree. For bumps."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._windows = self._keep(Fitted(context, Image))
        self._planes = self._keep(Fitted(context, Image))

    def measure(self, frame: DepthTextures) -> np.ndarray:
        """Return (rows, columns, 4) float32: what windows leave of planes, for `find_bumps`."""
        cells, first = _flat_cells(frame)
        windows, measure = self._windows.fit(cells), self.fullscreen("surface/bumpy_windows.frag", MEASURE=1)
        measure.draw(windows.target, {"depth_map": frame.depth}, first=first)
        return windows.read()

    def find(self, frame: DepthTextures, bumps: float) -> dict[str, moderngl.Texture | tuple[int, int]]:
        """Return the inputs of shaders that draw the planes. bumps: standard deviation of 1/z about planes."""
        cells, first = _flat_cells(frame)
        windows, planes = self._windows.fit(cells), self._planes.fit(cells)
        fit, spread = (self.fullscreen("surface/bumpy_windows.frag", SPREAD=k) for k in (0, 1))
        common = {"depth_map": frame.depth, "first": first, "bumps": bumps}
        fit.draw(windows.target, {}, **common)
        spread.draw(planes.target, {"planes": windows.texture}, **common)
        return {"planes": planes.texture, "first": first}


class FlatCellsPass(FullscreenPasses):
    """Writes the surface of pixels on wide planes of rounded depth, and leaves all others to later passes."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._windows = self._keep(Fitted(context, Image))  # one plane for each cell,
        self._planes = self._keep(Fitted(context, Image))  # and with those that neighbours lend

    def run(self, frame: DepthTextures, noise: Noise, camera: Camera) -> None:
        """Write the surface of flat pixels. noise: with a rounding step."""
        cells, first = _flat_cells(frame)
        windows, planes = self._windows.fit(cells), self._planes.fit(cells)
        common = {"depth_map": frame.depth, "first": first, "rounding": noise.rounding}
        self.fullscreen("surface/flat_cells.frag").draw(windows.target, {}, **common)
        spread = self.fullscreen("surface/flat_cells.frag", SPREAD=1)
        spread.draw(planes.target, {"planes": windows.texture}, **common)
        common |= {"planes": planes.texture, "intrinsics": camera.intrinsics}
        self.fullscreen("surface/normals_flat.frag").draw(frame.surface.staged_target, {}, **common)


def _flat_cells(frame: DepthTextures) -> tuple[tuple[int, int], tuple[int, int]]:
    from ...estimation.noise_model import flat_grid  # only here

    return flat_grid(*frame.size)
