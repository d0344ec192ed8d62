"""Resolve pass: every visible pixel is looked up in its frame and lit once."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np

from ..camera import Camera
from ..shading import SHADINGS, Light, Material
from .passes import FullscreenPass, data_texture
from .textures import FrameTextures, Target

UPPER_LEFT = (1.0, 1.0, 2.0)  # the default light's direction of travel, target axes


class ResolvePass:
    """Source ids -> lit picture, by the formulas of shaders/common/phong.glsl. One program a shading model."""

    def __init__(self, context: moderngl.Context):
        self._context = context
        self._passes: dict[str, FullscreenPass] = {}

    def draw(
        self,
        frame: FrameTextures,
        source: Camera,
        target: Target,
        camera: Camera,
        view: np.ndarray,
        lights: np.ndarray,
        material: Material,
        shading: str,
    ) -> None:
        """lights (n, 3, 4) float32 as `light_rows` makes them."""
        if shading not in self._passes:
            self._passes[shading] = FullscreenPass(self._context, "resolve.frag", SHADING=SHADINGS.index(shading))
        target.picture.clear()
        textures = {"source_ids": target.source_ids, "surface_map": frame.surface, "color_map": frame.color}
        if shading == "none":
            self._passes[shading].draw(target.picture, textures, first_id=1)
            return
        # A texture has at least one row; light_count says how many are meant.
        light_map = data_texture(self._context, 3, max(len(lights), 1), 4)
        light_map.write(lights if len(lights) else np.zeros((1, 3, 4), np.float32))
        inside = {"target": camera.intrinsics} if shading in ("gouraud", "phong") else {}  # they vary within a splat
        self._passes[shading].draw(
            target.picture,
            textures | {"lights": light_map},
            first_id=1,
            source=source.intrinsics,
            view=view.T.astype("f4").tobytes(),
            material=(material.ambient, material.diffuse, material.specular, material.shininess),
            ambient=(1.0, 1.0, 1.0),
            light_count=len(lights),
            **inside,
        )
        light_map.release()

    def release(self) -> None:
        for item in self._passes.values():
            item.release()


def light_rows(lights: Sequence[Light], pose: np.ndarray) -> np.ndarray:
    """Lights as shaders/common/lights.glsl reads them: (n, 3, 4) float32, in the axes of a camera with this pose."""
    rows = np.zeros((len(lights), 3, 4))
    for row, light in zip(rows, lights, strict=True):
        if light.position is not None:
            row[0] = [*(pose[:3, :3].T @ (np.array(light.position) - pose[:3, 3])), 1]
        elif light.direction is not None:
            row[0, :3] = pose[:3, :3].T @ np.array(light.direction)
        else:
            row[0, :3] = UPPER_LEFT
        row[1, :3] = np.array(light.color) * light.intensity
        row[2, :3] = light.attenuation
    return rows.astype(np.float32)
