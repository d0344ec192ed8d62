"""Shadow pass: what each light with a shadow sees of the scene, as tiles of one depth picture."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import moderngl
import numpy as np

from ..shadow_views import ShadowView
from .passes import FullscreenPass, data_texture
from .textures import Target, check_size, confine, empty


class ShadowPass:
    """Draws the views of the lights; `map` holds 1 - near/z, and `views` says how to look a point up in it."""

    def __init__(self, context: moderngl.Context):
        self._context = context
        self._passes: dict[bool, FullscreenPass] = {}
        self._side = self._count = 0
        self._made: list[Any] = []

    def draw(
        self,
        views: list[ShadowView],
        draw_meshes: Callable[[moderngl.Framebuffer, ShadowView], None],
        splats: list[Callable[[Target, ShadowView], tuple[bool, float]]],
    ) -> None:
        """Every view with the meshes and with each of the splats, which draw into a target of their own.

        splats return look_up, and the near distance that their 1/z counts by.
        """
        side = views[0].camera.width
        self._fit(side, len(views))
        self.target.viewport = (0, 0, *self.map.size)
        empty(self.target)
        for k, view in enumerate(views):
            first = self.tile(k)
            self.target.viewport = (*first, side, side)
            draw_meshes(self.target, view)
            for draw in splats:
                look_up, near = draw(self._scratch, view)
                if look_up not in self._passes:
                    version = 430 if look_up else 330
                    self._passes[look_up] = FullscreenPass(self._context, "shadow.frag", version, LOOK_UP=int(look_up))
                inputs: dict[str, Any] = {"first": first}
                if look_up:
                    self._scratch.nearest.bind_to_storage_buffer(0)
                    inputs |= {"side": side, "near": near}
                else:
                    inputs["depth_map"] = self._scratch.depth
                left, top, width, height = self._scratch.window
                confine(self.target, (first[0] + left, first[1] + top, width, height))
                self._context.enable_only(moderngl.DEPTH_TEST)
                self._passes[look_up].draw(self.target, {}, **inputs)
                self._context.enable_only(moderngl.NOTHING)
                confine(self.target, None)

    def write_views(self, views: list[ShadowView], axes: np.ndarray) -> moderngl.Texture:
        """How shaders/common/shadow.glsl looks points up that are given in the axes of a camera with this pose."""
        rows = np.zeros((len(views), 5, 4))
        for k, (row, view) in enumerate(zip(rows, views, strict=True)):
            row[:3] = (np.linalg.inv(view.pose) @ axes)[:3]
            row[3] = (view.camera.fx, view.camera.cx, *self.tile(k))
            row[4, :3] = view.near, view.camera.width, view.contact
        self.views.write(rows.astype("f4"))
        return self.views

    def tile(self, k: int) -> tuple[int, int]:
        """First column and row of the k-th view."""
        columns = math.ceil(math.sqrt(self._count))
        return k % columns * self._side, k // columns * self._side

    def _fit(self, side: int, count: int) -> None:
        if (side, count) == (self._side, self._count):
            return
        self.release_images()
        self._side, self._count = side, count
        columns = math.ceil(math.sqrt(count))
        size = columns * side, math.ceil(count / columns) * side
        check_size(self._context, *size)
        self.map = self._context.depth_texture(size)
        self.map.compare_func = ""
        self.map.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self.target = self._context.framebuffer([], self.map)
        self.views = data_texture(self._context, 5, count, 4)
        self._scratch = Target(self._context, side, side)
        self._made = [self._scratch, self.views, self.target, self.map]

    def release_images(self) -> None:
        self._side = self._count = 0
        for item in self._made:
            item.release()
        self._made = []

    def release(self) -> None:
        self.release_images()
        for item in self._passes.values():
            item.release()
