"""Light pass: shades surfaces (normal, depth, albedo) with Phong's model (shaders/common/phong.glsl)."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from ...estimation.environment_light import nearest_lobe
from ...scene.camera import Camera
from ..core.programs import FullscreenPass, FullscreenPasses, data_texture
from .light_set import Lighting

CONSTANTS = (  # of shaders/shading/light.frag
    "POINTS", "SHADOWS", "MATERIALS", "LINEAR", "ALONE", "CERTAINTY", "EDL", "VISIBILITY", "SPLIT", "SPLATS",
    "ENVIRONMENT",
)  # fmt: skip
SURELY_HELD = 1024  # rows of a texture, by every driver


class LightPass(FullscreenPasses):
    """Lights the pixels of a view; or the points of a frame, where light is interpolated between them."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._tables: dict[str, moderngl.Texture] = {}
        self.last: tuple[FullscreenPass, moderngl.Framebuffer] | None = None  # what was drawn last, and where

    def draw(
        self, image: moderngl.Framebuffer, surface: moderngl.Texture, albedo: moderngl.Texture, camera: Camera,
        lighting: Lighting, materials: np.ndarray, points: tuple[np.ndarray, float] | None = None,
        linear: bool = False, has_doubts: bool = False, certainty: moderngl.Texture | None = None,
        has_eye_dome: bool = False, visibility: moderngl.Texture | None = None, split: bool = False,
    ) -> None:  # fmt: skip
        """Light surfaces (unit normal, depth) with their albedo, both as the camera sees them, into the image's
        scissor.

        materials  (m, 4) float32, see `Material.strengths`: one for all, or one for each number in the albedo's alpha
        points     None lights pixels, linear albedo -> sRGB. Else (eye (3,), scale): lights the points of a frame,
                   whose albedo is a picture, sRGB of any size -> linear; surfaces are `scale` times as far as they say.
        linear     pixels stay linear, too
        split      draws what a white matt surface sends back, and highlights, in two images
        has_doubts  the normals of pixels are as long as they are certain
        certainty   of the normals of points, see shaders/common/toksvig.glsl
        visibility  what is seen of the light from all around: see shaders/common/surroundings.glsl
        has_eye_dome  some pixels have negative material numbers: see shaders/common/eye_dome.glsl
        """
        inputs = self.inputs(lighting, True)
        if lighting.environment is not None:
            inputs |= lighting.environment.inputs
        inputs["intrinsics"] = camera.intrinsics
        inputs["eye"] = (0.0, 0.0, 0.0) if points is None else tuple(points[0].tolist())
        if len(materials) > 1:
            inputs["materials"] = self._table("materials", _with_lobes(materials, lighting))
        else:
            inputs["material"] = tuple(materials[0].tolist())
        if points is not None:
            inputs["scale"] = points[1]
        if certainty is not None:
            inputs["certainty_map"] = certainty
        if visibility is not None:
            inputs["visibility_map"] = visibility
        kind = (
            points is not None, lighting.shadows.kind if lighting.shadows else 0, "materials" in inputs, linear,
            "only_light" in inputs, has_doubts or certainty is not None, has_eye_dome, visibility is not None, split,
            "splat_map" in inputs, 0 if lighting.environment is None else 2 if "lobe_map" in inputs else 1,
        )  # fmt: skip
        light = self._passes.get(kind) or self._pass_of(kind)
        colors = "albedo_map" if points is None else "color_map"
        maps = {"surface_map": surface} if split and len(materials) == 1 else {"surface_map": surface, colors: albedo}
        light.draw(image, maps, **inputs)
        self.last = light, image

    def _pass_of(self, kind: tuple[int, ...]) -> FullscreenPass:
        constants = {name: int(value) for name, value in zip(CONSTANTS, kind, strict=True)}
        constants |= {} if constants.pop("ENVIRONMENT") == 0 else {"ENVIRONMENT": kind[-1]}
        self._passes[kind] = found = self.fullscreen("shading/light.frag", None, **constants)
        return found

    def inputs(self, lighting: Lighting, may_be_alone: bool = False) -> dict[str, Any]:
        """Return the inputs of shaders/common/lights.glsl, or with shadows of shadowed_lights.glsl, by the names of the
        uniforms.

        may_be_alone  a single light without shadows becomes `only_light`
        """
        rows, ambient, shadows = lighting[:3]
        if may_be_alone and len(rows) == 1 and shadows is None:
            return {"only_light": rows[0, :4].tobytes(), "ambient": ambient}
        inputs: dict[str, Any] = {"lights": self._table("lights", rows), "light_count": len(rows), "ambient": ambient}
        if shadows is not None:
            inputs |= {"shadow_map": shadows.shadow_map.texture, "views": self._table("views", shadows.views)}
            inputs["to_world"] = shadows.to_world.T.astype("f4").tobytes()
            if shadows.splats is not None:
                inputs |= {"splat_map": shadows.splats.image.texture, "splat_thickness": shadows.splats.thickness}
        return inputs

    def _table(self, name: str, rows: np.ndarray) -> moderngl.Texture:
        """Return a texture of rows (n, m, 4), read texel by texel. It has one row at least."""
        table, size = self._tables.get(name), (rows.shape[1], max(len(rows), 1))
        if size[1] > SURELY_HELD and size[1] > (limit := self._context.info["GL_MAX_TEXTURE_SIZE"]):
            raise ValueError(f"{len(rows)} {name} are too many: this GPU's textures have {limit} rows")
        if table is None or table.size != size:
            if table is not None:
                self._tables.pop(name).release()
            table = self._tables[name] = data_texture(self._context, *size, 4)
        if len(rows):
            table.write(np.ascontiguousarray(rows, np.float32))
        return table

    def release(self) -> None:
        for table in self._tables.values():
            table.release()
        super().release()


def _with_lobes(materials: np.ndarray, lighting: Lighting) -> np.ndarray:
    """Return (m, n, 4) rows of materials, with the numbers of their maps of an environment."""
    lobes = lighting.environment and lighting.environment.lobes
    if not lobes:
        return materials[:, None]
    numbers = [(nearest_lobe(lobes.exponents, shininess), 0.0, 0.0, 0.0) for *_, shininess in materials]
    return np.stack([materials, np.array(numbers)], 1)
