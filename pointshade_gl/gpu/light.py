"""Light pass: pictures of surfaces -> lit pictures, by the formulas of shaders/common/phong.glsl."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from ..camera import Camera
from ..shading import Material
from .passes import FullscreenPass, data_texture
from .textures import FrameTextures, Target


class LightPass:
    """Lights the pixels of a view, or the points of a frame for shading models that show light between points."""

    def __init__(self, context: moderngl.Context):
        self._context = context
        self._passes: dict[str, FullscreenPass] = {}
        self._lights = data_texture(context, 3, 1, 4)

    def draw_pixels(self, target: Target, camera: Camera, lights: np.ndarray, material: Material) -> None:
        """target.surface and albedo -> target.picture. lights (n, 3, 4) float32 in target axes."""
        target.picture.clear()
        maps = {"surface_map": target.surface, "albedo_map": target.albedo}
        inputs = self.inputs(lights, material)
        self._pass("pixels").draw(target.picture, maps, intrinsics=camera.intrinsics, eye=(0.0, 0.0, 0.0), **inputs)

    def draw_points(
        self, frame: FrameTextures, camera: Camera, eye: np.ndarray, lights: np.ndarray, material: Material
    ) -> None:
        """frame.surface and color -> frame.lit. lights and the eye (3,) in source axes."""
        frame.lit_target.clear()  # nothing undefined where there is no point: it would be weighted by 0, not left out
        maps = {"surface_map": frame.surface, "albedo_map": frame.color}
        inputs = self.inputs(lights, material)
        self._pass("points").draw(
            frame.lit_target, maps, intrinsics=camera.intrinsics, eye=tuple(eye.tolist()), **inputs
        )

    def inputs(self, lights: np.ndarray, material: Material) -> dict[str, Any]:
        """What shaders/common/lights.glsl reads, by the names of the uniforms. lights (n, 3, 4) float32."""
        rows = max(len(lights), 1)  # a texture has at least one; light_count says how many are meant
        if self._lights.height != rows:
            self._lights.release()
            self._lights = data_texture(self._context, 3, rows, 4)
        if len(lights):
            self._lights.write(lights)
        strengths = (material.ambient, material.diffuse, material.specular, material.shininess)
        uniforms = {"material": strengths, "ambient": (1.0, 1.0, 1.0), "light_count": len(lights)}
        return {"lights": self._lights, **uniforms}

    def _pass(self, name: str) -> FullscreenPass:
        if name not in self._passes:
            self._passes[name] = FullscreenPass(self._context, "light.frag", POINTS=int(name == "points"))
        return self._passes[name]

    def release(self) -> None:
        for item in (self._lights, *self._passes.values()):
            item.release()
