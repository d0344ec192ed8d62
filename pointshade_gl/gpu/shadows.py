"""The shadow map: what each light with a shadow sees of the scene, as tiles of one depth picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import moderngl
import numpy as np

from ..shadow_views import ShadowView
from .memory import Owner
from .steps import Versioned, kept, same, state_of
from .textures import check_size, confine


class Tile(NamedTuple):
    """The part of the shadow map that one view draws into."""

    target: moderngl.Framebuffer
    first: tuple[int, int]  # column and row in the map
    side: int


class ShadowMap(Versioned, Owner):
    """1 - near/z of every view of the lights; a single texel until there are any."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._layout = 0, 0  # pixels a side, number of views
        self._shown: list[Any] = []  # what each view shows
        self._make(1, 1)

    def fit(self, views: Sequence[ShadowView]) -> None:
        """Makes room for the views, all of one size. If it has to be made anew, it is empty."""
        layout = views[0].eye.camera.width, len(views)
        if layout != self._layout:
            columns = math.ceil(math.sqrt(len(views)))
            self._make(columns * layout[0], math.ceil(len(views) / columns) * layout[0])
            self._layout = layout
            self._shown = [None] * layout[1]

    def tile(self, k: int, view: ShadowView, things: tuple[Any, ...]) -> Tile | None:
        """The k-th view's part, emptied, to draw these things; None if it shows them already.

        Its target draws there only, until the next one is asked for.
        """
        now = state_of((view, things))
        if same(self._shown[k], now):
            return None
        self._shown[k] = kept(now)
        side, first = self._layout[0], self._first(k)
        confine(self._target, None)
        self._target.use()
        self._target.clear(depth=1.0, viewport=(*first, side, side))
        self._target.viewport = (*first, side, side)
        self.raise_version()
        return Tile(self._target, first, side)

    def rows(self, views: Sequence[ShadowView], axes: np.ndarray) -> np.ndarray:
        """(n, 5, 4) as shaders/common/shadow.glsl reads them, for points in the axes of a camera with this pose."""
        rows = np.zeros((max(len(views), 1), 5, 4))
        for k, (eye, contact) in enumerate(views):
            rows[k, :3] = (np.linalg.inv(eye.pose) @ axes)[:3]
            rows[k, 3] = (eye.camera.fx, eye.camera.cx, *self._first(k))
            rows[k, 4, :3] = eye.near, eye.camera.width, contact
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
