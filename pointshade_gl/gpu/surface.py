"""Surface pass: depth texture -> surface texture (normal and depth), by the estimator that was asked for."""

from __future__ import annotations

import moderngl
import numpy as np

from ..camera import Camera
from ..estimators import PLANE_FITS, TRIANGLES, Step
from ..noise import Choice
from ..noise_stream import Decisions
from ..noise_words import NoiseWords
from .memory import Owner
from .noise import NoisePass
from .passes import FullscreenPass, data_texture
from .raw_gl import DEPTH_TEST
from .state import enabled
from .textures import DepthTextures, empty

Told = np.ndarray | NoiseWords | None
Estimator = tuple[str, Step, Told, str]  # method, gate, noise, flying, as `SurfacePass.run` takes them


class SurfacePass:
    """Writes unit normals, source axes, towards the camera; (0, 0, 0) where depth is missing.

    Shaders are compiled when an estimator is first used.
    """

    def __init__(self, context: moderngl.Context):
        self._context = context
        self._passes: dict[str, FullscreenPass] = {}
        self._noise: NoisePass | None = None
        self._scratch: Scratch | None = None
        self._decisions = Decisions()

    def run(
        self,
        frame: DepthTextures,
        camera: Camera,
        method: str,
        max_step: Step,
        noise: Told,
        flying: str,
    ) -> Choice:
        """max_step = (metres, share of the depth) for the estimators that have a gate; noise (1, 1) or (h, w)
        metres, or in words; flying as in Look.

        Returns what ran, and for "auto" and "adaptive" why.
        """
        frame.surface.raise_version()
        if method in ("auto", "adaptive"):
            return self._run_by_noise(frame, camera, method, noise, flying == "snap")
        source, intrinsics = {"depth_map": frame.depth}, camera.intrinsics
        if method in TRIANGLES:
            count = TRIANGLES[method]
            triangles = self._pass("surface_triangles.frag")
            triangles.draw(frame.surface.target, source, intrinsics=intrinsics, triangle_count=count, max_step=max_step)
        elif method in PLANE_FITS:
            fit = self._pass("surface_plane_fit.frag", WINDOW=PLANE_FITS[method])
            fit.draw(frame.surface.target, source, intrinsics=intrinsics)
        elif method == "star-borrow":
            scratch = self._fit(frame)
            self._pass("surface_star.frag", RESIDUAL=1).draw(scratch.target, source, intrinsics=intrinsics)
            textures = source | {"normal_map": scratch.image}
            self._pass("surface_borrow.frag").draw(frame.surface.target, textures, intrinsics=intrinsics)
        else:
            name = f"surface_{method.replace('-', '_')}.frag"
            self._pass(name).draw(frame.surface.target, source, intrinsics=intrinsics)
        return Choice(method)

    def write(self, frame: DepthTextures, camera: Camera, normals: np.ndarray) -> None:
        """The caller's own normals (h, w, 3) float32, (0, 0, 0) where missing."""
        frame.surface.raise_version()
        scratch = self._fit(frame)
        scratch.image.write(np.concatenate([normals, np.zeros_like(normals[..., :1])], -1))
        maps = {"normal_map": scratch.image, "depth_map": frame.depth}
        self._pass("surface_given.frag").draw(frame.surface.target, maps, intrinsics=camera.intrinsics)

    def _run_by_noise(self, frame: DepthTextures, camera: Camera, method: str, told: Told, snap: bool) -> Choice:
        if self._noise is None:
            self._noise = NoisePass(self._context)
        focal = (abs(camera.fx) + abs(camera.fy)) / 2
        is_told = told is not None
        if isinstance(told, NoiseWords):
            noise, told = self._noise.read(frame, told), None
        else:
            noise = self._noise.measure(frame, focal)
            if frame.source is not None:
                noise = self._decisions.settle((frame.source, frame.size), noise)
        if method == "auto" and told is None and noise.is_clean:
            source = {"depth_map": frame.depth}
            self._pass("surface_star.frag").draw(frame.surface.target, source, intrinsics=camera.intrinsics)
            return Choice("star", noise, is_told)
        textures = {"picture": self._noise.calm_depth(frame, noise, told, focal if snap else 0.0)}
        empty(frame.surface.staged_target, frame.surface.window)
        with enabled(self._context, DEPTH_TEST):
            for stage in range(4):
                adaptive = self._pass("surface_adaptive.frag", STAGE=stage)
                adaptive.draw(frame.surface.staged_target, textures, intrinsics=camera.intrinsics)
        return Choice("adaptive", noise, is_told)

    def _pass(self, fragment: str, **constants: int) -> FullscreenPass:
        key = f"{fragment} {constants}"
        if key not in self._passes:
            self._passes[key] = FullscreenPass(self._context, fragment, **constants)
        return self._passes[key]

    def _fit(self, frame: DepthTextures) -> Scratch:
        if self._scratch is None or self._scratch.size != frame.size:
            if self._scratch is not None:
                self._scratch.release()
            self._scratch = None
            self._scratch = Scratch(self._context, *frame.size)
        return self._scratch

    def release(self) -> None:
        for item in (self._scratch, self._noise, *self._passes.values()):
            if item is not None:
                item.release()


class Scratch(Owner):
    """What surface_star.frag writes for surface_borrow.frag: normal and residual; or the caller's normals."""

    def __init__(self, context: moderngl.Context, width: int, height: int):
        super().__init__(context)
        self.size = width, height
        with self._all_or_nothing():
            self.image = self._keep(data_texture(context, width, height, 4))
            self.target = self._allocate(context.framebuffer, [self.image])
