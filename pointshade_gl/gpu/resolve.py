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
    """What the splats left -> surfaces for the light pass, or the picture. One program a shading model."""

    def __init__(self, context: moderngl.Context):
        self._context = context
        self._passes: dict[tuple[str, bool, str], FullscreenPass] = {}

    def draw(
        self,
        frame: FrameTextures,
        source: Camera,
        target: Target,
        camera: Camera,
        view: np.ndarray,
        shading: str,
        look_up: bool,
        lights: dict[str, Any] | None = None,
    ) -> None:
        """look_up: the splats left the nearest 1/z (compute), not source ids (points).

        lights: for phong, to light at once; without, target.surfaces is written, else target.picture.
        """
        uniforms: dict[str, Any] = dict(lights or {})
        if look_up or shading in ("gouraud", "phong"):  # else the source id says it all
            uniforms |= source_and_target(source, camera, view)
        image = target.surfaces if shading == "phong" and lights is None else target.picture
        empty(image, target.window)
        self._draw(image, frame, target, shading, look_up, "" if lights is None else "LIT", uniforms)

    def draw_object(
        self,
        frame: FrameTextures,
        source: Camera,
        target: Target,
        camera: Camera,
        view: np.ndarray,
        shading: str,
        look_up: bool,
        near: float,
        scale: float,
        material_number: float,
    ) -> None:
        """One of several objects: target.shared_surfaces keeps what is nearest. view is without the object's scale."""
        uniforms = source_and_target(source, camera, view)
        uniforms |= {"near": near, "scale": scale, "material_number": material_number}
        confine(target.shared_surfaces, target.window)
        self._context.enable_only(moderngl.DEPTH_TEST)
        self._draw(target.shared_surfaces, frame, target, shading, look_up, "SCENE", uniforms)
        self._context.enable_only(moderngl.NOTHING)
        confine(target.shared_surfaces, None)

    def _draw(
        self,
        image: moderngl.Framebuffer,
        frame: FrameTextures,
        target: Target,
        shading: str,
        look_up: bool,
        variant: str,
        uniforms: dict[str, Any],
    ) -> None:
        """variant: a constant of resolve.frag that is set, or ''."""
        key = shading, look_up, variant
        if key not in self._passes:
            constants = {"SHADING": SHADINGS.index(shading), "LOOK_UP": int(look_up)} | (
                {variant: 1} if variant else {}
            )
            self._passes[key] = FullscreenPass(self._context, "resolve.frag", 430 if look_up else 330, **constants)
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
