"""The shadow map: the depth that every shadow-casting light sees, as tiles of one texture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import moderngl
import numpy as np

from ...scene.shadow_cameras import ShadowView
from ..core.images import Box, check_size, confine
from ..core.memory import Owner
from ..core.steps import Versioned


class Tile(NamedTuple):
    """The part of the shadow map that shows one light's view."""

    target: moderngl.Framebuffer
    first: tuple[int, int]  # column and row in the map
    side: int

    def part(self, window: Box) -> Box:
        """Return where a window of the view lies in the map."""
        return self.first[0] + window[0], self.first[1] + window[1], *window[2:]


class ShadowMap(Versioned, Owner):
    """Depth, as 1 - near/z, of every view of the lights; a single texel until there are any."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._layout = 0, 0  # pixels a side, number of views
        self._make(1, 1)

    def fit(self, views: Sequence[ShadowView]) -> bool:
        """Make room for the views, all of one size. Returns whether the map had to be made anew."""
        layout = views[0].eye.camera.width, len(views)
        is_new = layout != self._layout
        if is_new:
            columns = math.ceil(math.sqrt(len(views)))
            self._make(columns * layout[0], math.ceil(len(views) / columns) * layout[0])
            self._layout = layout
        return is_new

    def tile(self, k: int) -> Tile:
        """Return the k-th view's part, emptied. Its target draws only there, until the next one is asked for."""
        side, first = self._layout[0], self._first(k)
        confine(self._target, None)
        self._target.use()
        self._target.clear(depth=1.0, viewport=(*first, side, side))
        self._target.viewport = (*first, side, side)
        confine(self._target, (*first, side, side))  # large points reach over a viewport
        self.raise_version()
        return Tile(self._target, first, side)

    def rows(self, views: Sequence[ShadowView], axes: np.ndarray) -> np.ndarray:
        """Return (n, 5, 4) for shaders/common/shadow.glsl. axes: the pose of the camera in whose axes points are."""
        rows = np.zeros((max(len(views), 1), 5, 4))
        for k, (eye, contact, spread) in enumerate(views):
            rows[k, :3] = (np.linalg.inv(eye.pose) @ axes)[:3]
            rows[k, 3] = (eye.camera.fx, eye.camera.cx, *self._first(k))
            rows[k, 4] = eye.near, eye.camera.width, contact, spread * eye.camera.fx
        return rows

    def _first(self, k: int) -> tuple[int, int]:
        side, count = self._layout
        columns = math.ceil(math.sqrt(count))
        return k % columns * side, k // columns * side

    def _make(self, width: int, height: int) -> None:
        check_size(self._context, width, height)
        self.release()
        self._layout = 0, 0  # stays so when the new one does not fit the GPU
        with self._all_or_nothing():
            self.texture = self._allocate(self._context.depth_texture, (width, height))
            self.texture.compare_func = ""
            self.texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self._target: Any = self._allocate(self._context.framebuffer, [], self.texture)
