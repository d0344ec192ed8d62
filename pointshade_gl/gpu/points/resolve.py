"""Resolve pass: looks up, for each pixel of the view, which point of the frame it shows, and that point's values."""

from __future__ import annotations

from typing import Any, NamedTuple

import moderngl
import numpy as np

from ...scene.appearance import LIT_EARLY, shader_model
from ...scene.camera import Camera
from ..core.canvas import Canvas
from ..core.images import depth_tested, empty
from ..core.passes import FullscreenPasses
from ..core.programs import source_and_target
from ..core.view_images import SplatImage
from ..shading.light_set import environment_of

UPRIGHT = 1e-6  # of a view's axes: turned by less they are the frame's


class Looking(NamedTuple):
    """Where the pixels of a view look up their points: the frame, its rasterised splats, and the transform between."""

    surface: moderngl.Texture  # of the frame's points
    colors: moderngl.Texture  # the picture, or for flat and gouraud the light of the points
    source: Camera  # that took the frame
    splats: SplatImage
    camera: Camera  # who looks
    view: np.ndarray  # (4, 4) source axes to target axes
    look_up: bool  # the splats left the nearest 1/z (compute), not source ids (points)
    near: float  # source units: the splats' depth is 1 - near/z
    shading: str
    certainty: moderngl.Texture | None  # of the frame's normals
    visibility: moderngl.Texture | None  # what its points see of the light from all around

    def maps(self) -> dict[str, moderngl.Texture]:
        """Return the textures of the frame by the names of the shaders' samplers."""
        return {"surface_map": self.surface, "light_map" if self.shading in LIT_EARLY else "color_map": self.colors}

    def way(self) -> dict[str, Any]:
        """Return the uniforms that project the frame into the view."""
        return source_and_target(self.source, self.camera, self.view)


def shared_variant(view: np.ndarray, surface: moderngl.Texture, colors: moderngl.Texture) -> int:
    """Return `SHARED` of resolve_surfaces.frag for a view (4, 4) of a frame from its own place."""
    is_upright = np.abs(view[:3, :3] - np.eye(3)).max() < UPRIGHT
    return 2 if is_upright and surface.size == colors.size else 1


class ResolvePass(FullscreenPasses):
    """Turns rasterised splats into surfaces or into the picture. One program for each shading model."""

    def draw_picture(self, canvas: Canvas, looking: Looking) -> None:
        """Draw the picture, for the shading models none, flat and gouraud."""
        needs_way = looking.look_up or looking.shading == "gouraud"  # else the source id says it all
        inputs = looking.way() if needs_way else {}
        with canvas.opened(looking.splats.window) as image:
            self._draw("points/resolve_picture.frag", image, looking, inputs, LINEAR=int(canvas.linear))

    def draw_lit(self, canvas: Canvas, looking: Looking, lights: dict[str, Any]) -> None:
        """Draw the picture, lit in the same pass, for phong. lights: the inputs of light_surface."""
        with canvas.opened(looking.splats.window) as image:
            inputs = lights | looking.way()
            constants = {"LINEAR": int(canvas.linear), "ALONE": int("only_light" in lights), **environment_of(lights)}
            self._draw("points/resolve_lit.frag", image, looking, inputs, **constants)

    def draw_surfaces(
        self,
        image: moderngl.Framebuffer,
        looking: Looking,
        number: int,
        depth: tuple[float, float] | None = None,
        samples: int | None = None,
    ) -> None:
        """Draw surfaces: unit normal and depth; albedo and the number of its material. A normal of 0 marks what is lit
        already.

        depth  (near, scale) of one of several objects, the nearest of which stays; without it the object is alone,
               and the image is emptied first
        samples  the albedo is the mean of so many: see `SHARED` in resolve_surfaces.frag
        """
        near, scale = depth or (0.0, 1.0)
        inputs = looking.way() | {"near": near, "scale": scale, "material_number": float(number)}
        if depth is None:
            empty(image, looking.splats.window)
            shared = {} if samples is None else {"samples": samples}
            how = shared_variant(looking.view, looking.surface, looking.colors) if shared else 0
            self._draw("points/resolve_surfaces.frag", image, looking, inputs | shared, SHARED=how)
            return
        with depth_tested(self._context, image, looking.splats.window):
            self._draw("points/resolve_surfaces.frag", image, looking, inputs)

    def _draw(
        self, fragment: str, image: moderngl.Framebuffer, looking: Looking, inputs: dict[str, Any], **constants: int
    ) -> None:
        constants |= {"SHADING": shader_model(looking.shading)}
        textures = looking.maps()
        if looking.shading == "phong" and looking.certainty is not None:
            constants["CERTAINTY"], textures["certainty_map"] = 1, looking.certainty
        if looking.shading == "phong" and looking.visibility is not None:
            constants["VISIBILITY"], textures["visibility_map"] = 1, looking.visibility
        if looking.look_up:
            looking.splats.nearest.bind_to_storage_buffer(0)
            inputs["target_size"] = looking.splats.size
        else:
            textures["source_ids"] = looking.splats.source_ids
            inputs["first_id"] = 1
            if "view" in inputs:  # without it, the source id says it all
                textures["window_depths"], inputs["depth_scale"] = looking.splats.depth, looking.near
        self.fullscreen(fragment, looking.look_up, **constants).draw(image, textures, **inputs)
