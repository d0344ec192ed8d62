"""Resolve pass: every visible pixel is looked up in its frame and lit once."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np

from ..camera import Camera
from ..shading import SHADINGS, Light, Material
from .programs import build_program, set_uniforms
from .textures import FrameTextures, Target

UPPER_LEFT = (1.0, 1.0, 2.0)  # the default light's direction of travel, target axes


class ResolvePass:
    """Source ids -> lit picture, by the formulas of shaders/common/phong.glsl."""

    def __init__(self, context: moderngl.Context):
        self._context = context
        self._program = build_program(context, "fullscreen.vert", "resolve.frag")
        self._array = context.vertex_array(self._program, [])

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
        set_uniforms(
            self._program,
            source_ids=0,
            depth_map=1,
            normal_map=2,
            color_map=3,
            lights=4,
            source=source.intrinsics,
            target=camera.intrinsics,
            view=view.T.astype("f4").tobytes(),
            first_id=1,
            shading=SHADINGS.index(shading),
            material=(material.ambient, material.diffuse, material.specular, material.shininess),
            ambient=(1.0, 1.0, 1.0),
            light_count=len(lights),
        )
        # A texture has at least one row; light_count says how many are meant.
        rows = lights if len(lights) else np.zeros((1, 3, 4), np.float32)
        light_map = self._context.texture((3, len(rows)), 4, rows.tobytes(), dtype="f4")
        light_map.filter = (moderngl.NEAREST, moderngl.NEAREST)
        for unit, texture in enumerate((target.source_ids, frame.depth, frame.normals, frame.color, light_map)):
            texture.use(unit)
        target.picture.use()
        self._array.render(moderngl.TRIANGLES, 3)
        light_map.release()

    def release(self) -> None:
        self._array.release()
        self._program.release()


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
