"""Resolve pass: what each pixel of the view shows is looked up in the frame."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from ..camera import Camera
from ..look import SHADINGS
from .passes import FullscreenPass
from .programs import source_and_target
from .textures import FrameTextures, Target, confine, empty


class ResolvePass:
    """What the splats left -> the picture, or surfaces for the light pass. One program a shading model.

    In each method the frame is that of the camera `source`, `camera` looks at it, and view (4, 4) takes source axes to
    target axes. look_up: the splats left the nearest 1/z (compute), not source ids (points).
    """

    def __init__(self, context: moderngl.Context):
        self._context = context
        self._passes: dict[tuple[str, str, bool], FullscreenPass] = {}

    def draw_picture(
        self,
        frame: FrameTextures,
        source: Camera,
        target: Target,
        camera: Camera,
        view: np.ndarray,
        shading: str,
        look_up: bool,
    ) -> None:
        """none, flat or gouraud -> target.picture."""
        uniforms: dict[str, Any] = {}
        if look_up or shading == "gouraud":  # else the source id says it all
            uniforms |= source_and_target(source, camera, view)
        empty(target.picture, target.window)
        self._draw("resolve_picture.frag", target.picture, frame, target, shading, look_up, uniforms)

    def draw_lit(
        self,
        frame: FrameTextures,
        source: Camera,
        target: Target,
        camera: Camera,
        view: np.ndarray,
        look_up: bool,
        lights: dict[str, Any],
    ) -> None:
        """phong, lit at once -> target.picture. lights as LightPass.inputs gives them."""
        uniforms = lights | source_and_target(source, camera, view)
        empty(target.picture, target.window)
        self._draw("resolve_lit.frag", target.picture, frame, target, "phong", look_up, uniforms)

    def draw_surfaces(
        self,
        image: moderngl.Framebuffer,
        frame: FrameTextures,
        source: Camera,
        target: Target,
        camera: Camera,
        view: np.ndarray,
        shading: str,
        look_up: bool,
        material_number: float,
        depth: tuple[float, float] | None = None,
    ) -> None:
        """Surfaces of any shading model -> image, which is target.surfaces or target.shared_surfaces.

        depth: (near, scale) of one of several objects, of which the image keeps the nearest; view is without the
        scale. Without depth the object is alone, and the image is emptied first.
        """
        near, scale = depth or (0.0, 1.0)
        uniforms = {"near": near, "scale": scale, "material_number": material_number}
        uniforms |= source_and_target(source, camera, view)
        inputs = "resolve_surfaces.frag", image, frame, target, shading, look_up, uniforms
        if depth is None:
            empty(image, target.window)
            self._draw(*inputs)
            return
        confine(image, target.window)
        self._context.enable_only(moderngl.DEPTH_TEST)
        self._draw(*inputs)
        self._context.enable_only(moderngl.NOTHING)
        confine(image, None)

    def _draw(
        self,
        fragment: str,
        image: moderngl.Framebuffer,
        frame: FrameTextures,
        target: Target,
        shading: str,
        look_up: bool,
        uniforms: dict[str, Any],
    ) -> None:
        key = fragment, shading, look_up
        if key not in self._passes:
            constants = {"SHADING": SHADINGS.index(shading), "LOOK_UP": int(look_up)}
            self._passes[key] = FullscreenPass(self._context, fragment, 430 if look_up else 330, **constants)
        colors = frame.lit if shading in ("flat", "gouraud") else frame.color
        textures = {"surface_map": frame.surface, "color_map": colors}
        if look_up:
            target.nearest.bind_to_storage_buffer(0)
            uniforms["target_size"] = target.size
        else:
            textures["source_ids"] = target.source_ids
            uniforms["first_id"] = 1
        self._passes[key].draw(image, textures, **uniforms)

    def release(self) -> None:
        for item in self._passes.values():
            item.release()
