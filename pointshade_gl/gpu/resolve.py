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
        self._programs: dict[str, tuple[moderngl.Program, moderngl.VertexArray]] = {}  # one a shading model

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
        program, array = self._model(shading)
        set_uniforms(program, source_ids=0, surface_map=1, color_map=2, first_id=1)
        if shading != "none":
            set_uniforms(
                program,
                lights=3,
                source=source.intrinsics,
                view=view.T.astype("f4").tobytes(),
                material=(material.ambient, material.diffuse, material.specular, material.shininess),
                ambient=(1.0, 1.0, 1.0),
                light_count=len(lights),
            )
        if shading in ("gouraud", "phong"):  # these two also ask where in the splat the pixel lies
            set_uniforms(program, target=camera.intrinsics)
        # A texture has at least one row; light_count says how many are meant.
        rows = lights if len(lights) else np.zeros((1, 3, 4), np.float32)
        light_map = self._context.texture((3, len(rows)), 4, rows.tobytes(), dtype="f4")
        light_map.filter = (moderngl.NEAREST, moderngl.NEAREST)
        for unit, texture in enumerate((target.source_ids, frame.surface, frame.color, light_map)):
            texture.use(unit)
        target.picture.use()
        array.render(moderngl.TRIANGLES, 3)
        light_map.release()

    def _model(self, shading: str) -> tuple[moderngl.Program, moderngl.VertexArray]:
        if shading not in self._programs:
            number = SHADINGS.index(shading)
            program = build_program(self._context, "fullscreen.vert", "resolve.frag", SHADING=number)
            self._programs[shading] = program, self._context.vertex_array(program, [])
        return self._programs[shading]

    def release(self) -> None:
        for program, array in self._programs.values():
            array.release()
            program.release()


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
