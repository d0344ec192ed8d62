"""Light pass: pictures of surfaces -> lit pictures, by the formulas of shaders/common/phong.glsl."""

from __future__ import annotations

from typing import Any, NamedTuple

import moderngl
import numpy as np

from ..camera import Camera
from ..look import Material
from .passes import FullscreenPass, data_texture
from .textures import FrameTextures, Target, empty


class Shadows(NamedTuple):
    """What the lights' shadows are looked up in."""

    maps: dict[str, moderngl.Texture]  # shadow_map and views
    to_world: np.ndarray  # (3, 3) from the lit surfaces' axes


class LightPass:
    """Lights the pixels of a view, or the points of a frame for shading models that show light between points."""

    def __init__(self, context: moderngl.Context):
        self._context = context
        self._passes: dict[str, FullscreenPass] = {}
        self._lights = data_texture(context, 3, 1, 4)

    def draw_pixels(self, target: Target, camera: Camera, lights: np.ndarray, material: Material) -> None:
        """target.surface and albedo -> target.picture. lights (n, 3, 4) float32 in target axes."""
        empty(target.picture, target.window)
        maps = {"surface_map": target.surface, "albedo_map": target.albedo}
        inputs = self.inputs(lights, material)
        self._pass("pixels").draw(target.picture, maps, intrinsics=camera.intrinsics, eye=(0.0, 0.0, 0.0), **inputs)

    def draw_points(
        self, frame: FrameTextures, camera: Camera, eye: np.ndarray, lights: np.ndarray, material: Material
    ) -> None:
        """frame.surface and color -> frame.lit. lights and the eye (3,) in source axes."""
        empty(frame.lit_target, frame.window)  # nothing undefined beside the points: it is weighted by 0, not left out
        maps = {"surface_map": frame.surface, "albedo_map": frame.color}
        inputs = self.inputs(lights, material)
        self._pass("points").draw(
            frame.lit_target, maps, intrinsics=camera.intrinsics, eye=tuple(eye.tolist()), **inputs
        )

    def draw_scene(
        self, target: Target, camera: Camera, lights: np.ndarray, materials: np.ndarray, ambient: Any, shadows: Shadows
    ) -> None:
        """As draw_pixels with lights (n, 5, 4), a material (4,) for each number in the albedo's alpha."""
        empty(target.picture)
        table = data_texture(self._context, 1, len(materials), 4)
        table.write(materials.astype("f4"))
        maps = {"surface_map": target.surface, "albedo_map": target.albedo, "materials": table}
        inputs = self.scene_inputs(lights, ambient, shadows)
        self._pass("scene").draw(target.picture, maps, intrinsics=camera.intrinsics, eye=(0.0, 0.0, 0.0), **inputs)
        table.release()

    def draw_scene_points(
        self,
        frame: FrameTextures,
        camera: Camera,
        eye: np.ndarray,
        lights: np.ndarray,
        material: Material,
        scale: float,
        ambient: Any,
        shadows: Shadows,
    ) -> None:
        """As draw_points with lights (n, 5, 4); scale is the object's, lights and eye are in its turned axes."""
        empty(frame.lit_target, frame.window)
        maps = {"surface_map": frame.surface, "albedo_map": frame.color}
        inputs = self.scene_inputs(lights, ambient, shadows) | {"material": material.strengths, "scale": scale}
        light_pass = self._pass("scene points")
        light_pass.draw(frame.lit_target, maps, intrinsics=camera.intrinsics, eye=tuple(eye.tolist()), **inputs)

    def scene_inputs(self, lights: np.ndarray, ambient: Any, shadows: Shadows) -> dict[str, Any]:
        """What shaders/common/scene_light.glsl reads, by the names of the uniforms. lights (n, 5, 4) float32."""
        inputs = {"lights": self._write(lights), "light_count": len(lights), "ambient": tuple(ambient)}
        return inputs | shadows.maps | {"to_world": shadows.to_world.T.astype("f4").tobytes()}

    def inputs(self, lights: np.ndarray, material: Material) -> dict[str, Any]:
        """What shaders/common/lights.glsl reads, by the names of the uniforms. lights (n, 3, 4) float32."""
        uniforms = {"material": material.strengths, "ambient": (1.0, 1.0, 1.0), "light_count": len(lights)}
        return {"lights": self._write(lights), **uniforms}

    def _write(self, lights: np.ndarray) -> moderngl.Texture:
        size = lights.shape[1], max(len(lights), 1)  # a texture has at least one row; light_count says how many count
        if self._lights.size != size:
            self._lights.release()
            self._lights = data_texture(self._context, *size, 4)
        if len(lights):
            self._lights.write(np.ascontiguousarray(lights))
        return self._lights

    def _pass(self, name: str) -> FullscreenPass:
        if name not in self._passes:
            constants = {"POINTS": int("points" in name), "SCENE": int("scene" in name)}
            self._passes[name] = FullscreenPass(self._context, "light.frag", **constants)
        return self._passes[name]

    def release(self) -> None:
        for item in (self._lights, *self._passes.values()):
            item.release()
